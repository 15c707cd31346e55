"""The FMU under test: its description, step sizes and values, and the list of findings."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .description import Description, finite
from .imported_slave import ImportedSlave
from .shared_library import C_TYPES, NAMES_IN_2
from .slave_interface import Variable

MOST_SHOWN = 5
"""Findings of one sort that are shown, of possibly thousands of variables."""
_SOLVED = 1e-6
"""Relative difference that a solver with a tolerance may leave between a step and its repetition."""


@dataclass
class ProbeContext:
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
    needs_tool : bool
        Whether no instance is made because the tool is missing that made the FMU.
    """

    path: Path
    folder: Path
    description: Description
    send: Callable[[dict[str, Any]], None]
    shown: dict[str, int] = field(default_factory=dict)
    wants_events: bool = False
    needs_tool: bool = False

    def step(self, what: str) -> None:
        """Announce the next step, for the case that it crashes."""
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
    def only_once(self) -> bool:
        """Whether this process holds one instance at most, ever."""
        return self.flag("canBeInstantiatedOnlyOncePerProcess")

    @property
    def start(self) -> float:
        """Start time of the default experiment [s]."""
        return finite(self.description.experiment.get("startTime")) or 0.0

    @property
    def size(self) -> float:
        """Communication step that is tried [s]."""
        sizes = (finite(self.description.experiment.get("stepSize")), self.description.number("fixedInternalStepSize"), 0.01)
        return next(size for size in sizes if size is not None and size > 0.0)

    @property
    def lag(self) -> float:
        """How far a slave with a fixed inner step may be from the end of a communication step [s]."""
        return 1.000001 * (self.description.number("fixedInternalStepSize") or 0.0)

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

    def compare(self, place: str, once: dict[str, list[Any]], again: dict[str, list[Any]], when: str) -> None:
        """Report outputs that are not as they were."""
        for name, values in once.items():
            pairs = list(zip(values, again[name], strict=True))
            if all(same(a, b) if isinstance(a, float) else a == b for a, b in pairs):
                continue
            text = f"{name} is {_short(values)} after a step and {_short(again[name])} {when}"
            # A solver that begins anew ends within its tolerance.
            if all(math.isclose(a, b, rel_tol=_SOLVED) if isinstance(a, float) else a == b for a, b in pairs):
                self.find(place, text, level="note", sort=f"{place} nearly")
            else:
                self.find(place, text, sort=place)


def same(a: float, b: float) -> bool:
    """Whether two numbers have the same bits."""
    return struct.pack("<d", a) == struct.pack("<d", b)


def _short(values: list[Any]) -> str:
    return repr(values[0]) if len(values) == 1 else repr(values)[:80]
