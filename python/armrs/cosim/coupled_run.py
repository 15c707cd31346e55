"""The result of a coupled run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import view_registry
from ..tabular import Labelled, Series, Tabular, Tidy
from .intermediate_outputs import Jump
from .system import Connection, System, parted

RESULTS = ("stable", "good", "ended")
"""Verdicts of runs whose numbers may be used."""


@dataclass(frozen=True)
class ConnectionReport:
    """What a connection did.

    Attributes
    ----------
    connection : Connection
    unit : str
    residual_max, residual_rms : float
        Input that was held during a step less the mean of the output at both of its ends, in the unit of the input; for an iterated
        coupling less the value it should have been.
    energy_exchanged : float, optional
        Largest magnitude of the work that went through since the start [J]; None without a dual variable.
    energy_created : float, optional
        What the target received more than the source gave [J].
    """

    connection: Connection
    unit: str
    residual_max: float
    residual_rms: float
    energy_exchanged: float | None
    energy_created: float | None


@dataclass(frozen=True, eq=False)
class CoupledRun(Tabular, Series):
    """A run of a system.

    Attributes
    ----------
    system : System
    verdict : {"stable", "good", "ended", "unstable", "not resolved", "not accurate", "diverged", "failed", "not converged"}
        "stable" where the error was not estimated, "good" where it is within the accuracy, "ended" where a slave ended the run.
        The others are no results.
    why : str
        One line on the verdict.
    t : ndarray, shape (n,)
        Communication points [s].
    columns : dict of str to ndarray, shape (n,)
        Every output that is a number or a truth value, by slave and variable.
    used, residual : ndarray, shape (n - 1, connections)
        Inputs that were held in each step, and what they were off.
    created : ndarray, shape (n, connections)
        Energy that the coupling has created since the start [J]; NaN without a dual variable.
    connections : tuple of ConnectionReport
    evaluations : float
        Steps of all slaves together for each communication step.
    warnings : tuple of str
    beyond : dict of str to (float, float)
        How far connected outputs go beyond their values at both ends of a step, and when [s]; of those alone that do.
    jumps : dict of str to list of Jump
        Jumps of connected outputs, of those alone that do.
    resolution : float, optional
        Longest time without a reading of the slaves [s]; a shorter event may not be seen. None where the error was not estimated.
    estimates : tuple of `armrs.cosim.error_estimate.Estimate`
        Estimated errors; empty where they were not estimated.
    """

    system: System
    verdict: str
    why: str
    t: np.ndarray
    columns: dict[str, np.ndarray] = field(repr=False)
    used: np.ndarray = field(repr=False)
    residual: np.ndarray = field(repr=False)
    created: np.ndarray = field(repr=False)
    connections: tuple[ConnectionReport, ...] = field(repr=False)
    evaluations: float
    warnings: tuple[str, ...]
    beyond: dict[str, tuple[float, float]] = field(default_factory=dict, repr=False)
    jumps: dict[str, list[Jump]] = field(default_factory=dict, repr=False)
    resolution: float | None = None
    estimates: tuple[Any, ...] = field(default=(), repr=False)

    def __repr__(self) -> str:
        return f"CoupledRun({', '.join(self.system.slaves)}: {self.verdict}, {self.t[-1]:g} s, {len(self.t)} points)"

    def _units(self) -> dict[str, str]:
        """Return the unit of each output."""
        slaves = self.system.slaves
        places = {name: parted(name, slaves) for name in self.columns}
        return {name: slaves[slave].variable(variable).unit or "" for name, (slave, variable) in places.items()}

    def tidy(self) -> Tidy:
        """Return every output at every communication point."""
        return Tidy({"t": self.t, **self.columns}, {"t": "s"} | {name: unit for name, unit in self._units().items() if unit})

    def labelled(self) -> tuple[Mapping[str, Any], Mapping[str, Labelled]]:
        """Return every output over time."""
        units = self._units()
        return {"time": self.t}, {name: Labelled(("time",), values, units[name]) for name, values in self.columns.items()}

    def to_dict(self) -> dict[str, Any]:
        """Return what the run came to, as plain data."""
        data: dict[str, Any] = view_registry.of(self).data(self)
        return data
