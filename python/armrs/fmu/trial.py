"""One FMU on trial: what it is tried with, and where findings go."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..cosim.imported import ImportedSlave
from ..cosim.library import C_TYPES, NAMES_IN_2
from ..cosim.partner import Variable
from .description import Description, finite

MOST_SHOWN = 5
"""Findings of one sort that are shown, of possibly thousands of variables."""


@dataclass
class Trial:
    """One FMU on trial.

    Attributes
    ----------
    path : Path
        The FMU.
    folder : Path
        Where it is unpacked.
    description : Description
    send : callable
        Takes records for the parent: what is done next, and what was found.
    shown : dict of str to int
        How many findings of each sort there were.
    wants_events : bool
        Whether no instance is made that does not use the event mode.
    """

    path: Path
    folder: Path
    description: Description
    send: Callable[[dict[str, Any]], None]
    shown: dict[str, int] = field(default_factory=dict)
    wants_events: bool = False

    def step(self, what: str) -> None:
        """Say what comes next, for the case that it crashes."""
        self.send({"step": what})

    def find(self, place: str, text: str, *, level: str = "error", sort: str = "") -> None:
        """Report a finding; of one sort only the first few."""
        count = self.shown[sort] = self.shown.get(sort, 0) + 1
        if not sort or count <= MOST_SHOWN:
            self.send({"level": level, "place": place, "text": text})

    def make(self, **mode: Any) -> ImportedSlave:
        """Return a new instance."""
        return ImportedSlave(self.path, name="tried", folder=self.folder, description=self.description, **mode)

    @property
    def fmi(self) -> int:
        """Major version of the standard."""
        return self.description.fmi

    def flag(self, name: str) -> bool:
        """Whether something is promised for co-simulation."""
        return self.description.flag(name)

    @property
    def start(self) -> float:
        """Start time of the default experiment [s]."""
        return finite(self.description.experiment.get("startTime")) or 0.0

    @property
    def size(self) -> float:
        """Communication step that is tried [s]."""
        sizes = (finite(self.description.experiment.get("stepSize")), self.description.number("fixedInternalStepSize"), 0.01)
        return next(size for size in sizes if size is not None and size > 0.0)

    def begin(self, slave: ImportedSlave) -> None:
        """Bring an instance to its first step."""
        slave.enter_initialization_mode(self.start)
        slave.exit_initialization_mode()

    def readable(self, *causalities: str) -> list[Variable]:
        """Variables of the types that can be read."""
        known = NAMES_IN_2 if self.fmi == 2 else C_TYPES
        return [v for v in self.description.variables if v.type in known and (not causalities or v.causality in causalities)]

    def outputs(self, slave: ImportedSlave) -> dict[str, list[Any]]:
        """All outputs that can be read."""
        return {v.name: slave.values(v.name) for v in self.readable("output")}
