"""A coupled run with an estimate of its error: the run is repeated with half the step, and both are compared."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np

from ..errors import CoupledError
from ..result_warnings import with_warnings
from .coupled_run import CoupledRun
from .intermediate_outputs import Jump
from .master import LITTLE, run_system
from .slave import Slave
from .system import System, family, parted

_ROUNDING = 1e-9
"""Difference of two runs that is rounding, in units of the largest change of a variable."""
_SHARE = 4.0 / 3.0
"""Error of a run in units of its difference from one with half the step, for a coupling of second order; 2 for the first order, and 1 for
very high ones, so that this is within a factor of 1.5 of either."""


@dataclasses.dataclass(frozen=True)
class Estimate:
    """How far a variable of a run is off.

    Attributes
    ----------
    name : str
        Slave and variable.
    unit : str
    error : float
        Estimate of the largest error over the run, at the communication points or between them.
    allowed : float
        The accuracy of the system times the largest change of the variable in the run.
    at : float, optional
        When the variable goes beyond its values at the communication points by this error [s]; None where the error is one at these points.
    """

    name: str
    unit: str
    error: float
    allowed: float
    at: float | None = None

    @property
    def most(self) -> float:
        """Largest error at this estimate: that of a coupling of first order, of which it is two thirds."""
        return self.error if self.at is not None else 1.5 * self.error

    @property
    def text(self) -> str:
        """What is off, and by how much, for people."""
        size = f"{self.error:.3g} {self.unit}".strip()
        allowed = f"allowed is {self.allowed:.3g} {self.unit}".strip()
        if self.at is None:
            return f"{self.name} has an error of about {size} (at most {self.most:.3g}), {allowed}"
        return f"{self.name} goes {size} beyond its values at the neighbouring communication points at {self.at:.6g} s, {allowed}"


@with_warnings
def run_checked(system: System, *, progress: Callable[[int], None] = lambda steps: None) -> CoupledRun:
    """Run a system, and once more with half the step; only a run whose largest error is below the accuracy of the system is good.

    The second run has half the steps inside of arms, too; steps that an FMU makes inside are its own affair.
    The error of every output that is connected, and of the angles of every arm, is estimated as 4/3 of the difference between the two
    runs. In the second run slaves make each step in parts no longer than the resolution of the system, so that a pulse of a partner
    between the communication points is seen. The effect of a jump within a communication step on the others is not estimated: such a run
    is stable. Where an error is too large or not known, and the system allows it, the run itself is made again with half the step, and
    treated in the same way.

    Parameters
    ----------
    system : System
    progress : callable, optional
        Called with the number of communication steps made since the last call; the second run makes two for each of the first.

    Returns
    -------
    CoupledRun
        The run with the verdict "good", "ended" where a slave requested its end, or "stable" where its error cannot be estimated, which
        a warning states.

    Raises
    ------
    CoupledError
        When the run is no result, or its error is above the accuracy.
    """
    run = run_system(system, progress=progress)
    for halvings in range(system.refine + 1):
        if run.verdict != "stable" or not run.system.slaves:
            return run
        if reason := _cannot_halve(run.system):
            return dataclasses.replace(run, warnings=(*run.warnings, f"the error is not estimated: {reason}"))
        slaves = {name: slave.finer() for name, slave in run.system.slaves.items()}
        grid = _halved(run.t) if run.system.varies else ()
        finer = dataclasses.replace(run.system, step=0.5 * run.system.step, grid=grid, slaves=slaves, warnings=())
        try:
            again = run_system(finer, resolution=system.resolution, progress=progress)
        except CoupledError as error:
            parts = f"in parts of at most {1e3 * system.resolution:g} ms (resolution_s)"
            raise _refused(run, f"with half the step, {finer.step:g} s, {parts}, the run is {error}") from None
        if reason := _differs_at_the_start(run, again):
            return dataclasses.replace(run, warnings=(*run.warnings, f"the error is not estimated: {reason}"))
        told = (*run.warnings, *_computed_late(run, again))
        run = dataclasses.replace(run, estimates=estimates(run, again), resolution=again.resolution, warnings=told)
        worst = max(run.estimates, key=lambda e: e.most / e.allowed, default=None)
        if worst is None:
            reason = "no floating point number is connected, and there is no arm whose angles could be compared"
            return dataclasses.replace(run, warnings=(*run.warnings, f"the error is not estimated: {reason}"))
        reason = _jumps(run, again)
        if worst.most <= worst.allowed and not reason:
            most = f"the largest: {worst.text}" if worst.error else "both runs are equal except for rounding"
            why = f"the estimated errors are within the accuracy; {most}{_events_not_searched(run)}"
            text_of_step = f"the step was halved to {run.system.step:g} s, so that the errors are within the accuracy"
            halved = (*system.warnings, *run.warnings, text_of_step) if halvings else run.warnings
            return dataclasses.replace(run, verdict="good", why=why, warnings=halved)
        if worst.most <= worst.allowed and halvings == system.refine:
            return dataclasses.replace(run, estimates=(), warnings=(*run.warnings, f"the error is not estimated: {reason}"))
        if halvings == system.refine:
            raise _refused(run, f"{worst.text}; take a shorter step")
        # In the second run slaves make their steps in parts, which is not what a run with half the step does.
        for slave in finer.slaves.values():
            slave.reset()
        run = run_system(finer, progress=progress)
    raise AssertionError


def estimates(run: CoupledRun, finer: CoupledRun) -> tuple[Estimate, ...]:
    """Estimate the errors of a run from one with half its step."""
    connected = [".".join(c.source) for c in run.system.connections]
    angles = [name for name in run.columns if parted(name, run.system.slaves)[1].startswith("q[")]
    found = []
    for name in dict.fromkeys([*connected, *angles]):
        if name not in run.columns or name not in finer.columns:
            continue
        slave, variable = parted(name, run.system.slaves)
        described = run.system.slaves[slave].variable(variable)
        coarse, fine = run.columns[name], np.interp(run.t, finer.t, finer.columns[name])
        change = max(float(np.max(np.abs(fine - fine[0]))), LITTLE * abs(described.nominal))
        # Where a whole number or a truth value changes is a matter of a step, whatever the step.
        error = _SHARE * float(np.max(np.abs(coarse - fine))) if family(described) == "Float" else 0.0
        most, at = 0.0, 0.0
        if name in connected:
            most, at = max(finer.beyond.get(name, (0.0, 0.0)), _beyond(run.t, finer.t, finer.columns[name]))
        error, most = (0.0 if size <= _ROUNDING * change else size for size in (error, most))
        if family(described) == "Float" or most:
            found.append(
                Estimate(
                    name,
                    described.unit if described.unit not in (None, "1") else "",
                    max(error, most),
                    run.system.accuracy * change,
                    at if most > error else None,
                )
            )
    return tuple(found)


def _beyond(t: np.ndarray, finer: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """Return how far a run with finer steps goes beyond its values at the given times, between them, and when [s]."""
    at = np.searchsorted(t, finer, side="right").clip(1, len(t) - 1)
    ends = np.interp(t, finer, values)
    low, high = np.minimum(ends[at - 1], ends[at]), np.maximum(ends[at - 1], ends[at])
    beyond = np.maximum(values - high, low - values)
    worst = int(np.argmax(beyond))
    return float(beyond[worst]), float(finer[worst])


def _large_jumps(run: CoupledRun, finer: CoupledRun) -> Iterator[tuple[str, str, list[Jump]]]:
    """Give every output with jumps above the accuracy: its name, its unit, and these jumps."""
    for name, found in finer.jumps.items():
        slave, variable = parted(name, run.system.slaves)
        described, values = run.system.slaves[slave].variable(variable), finer.columns[name]
        change = max(float(np.max(np.abs(values - values[0]))), LITTLE * abs(described.nominal))
        yield name, described.unit or "", [jump for jump in found if jump.size > run.system.accuracy * change]


def _computed_late(run: CoupledRun, finer: CoupledRun) -> list[str]:
    """Return which outputs jump where their slaves begin: the first step is made with values that no step computed."""
    first = (finer.resolution or 0.0) * (1.0 + 1e-9)
    late = [
        (name, f"{jump.size:.3g} {unit}".strip()) for name, unit, large in _large_jumps(run, finer) for jump in large if jump.time <= first
    ]
    return [
        f"{name} jumps by {size} in the first step of its slave; if its initialization does not compute it, compute it there"
        for name, size in late
    ]


def _jumps(run: CoupledRun, finer: CoupledRun) -> str:
    """Return which output has jumps whose effect on the others cannot be estimated by two runs."""
    accuracy, resolution = run.system.accuracy, finer.resolution or 0.0
    for name, unit, large in _large_jumps(run, finer):
        for jump in large:
            if not jump.at_point:
                size = f"{jump.size:.3g} {unit}".strip()
                where = f"within the communication step at {jump.time:.6g} s"
                return f"{name} jumps by {size} {where}; put a communication point there, or take a shorter step"
        # How long the value between two jumps lasts is known to within the resolution at either end.
        for begin, end in pairwise([*(jump.time for jump in large), float(finer.t[-1])]):
            if 2.0 * resolution > accuracy * (end - begin) > 0.0:
                span = f"from {begin:.6g} to {end:.6g} s, known to within {1e3 * resolution:.3g} ms at either end"
                return f"{name} jumps, and stays {span}; take a shorter resolution_s"
    return ""


def _halved(t: np.ndarray) -> tuple[float, ...]:
    """Return times with their middles."""
    return tuple(np.sort(np.append(t, 0.5 * (t[1:] + t[:-1]))).tolist())


def _cannot_halve(system: System) -> str:
    shortest = system.step if system.shortest_step is None else system.shortest_step
    for slave in system.slaves.values():
        inner = slave.internal_step
        # Arms make shorter steps inside in the second run.
        if inner is not None and not isinstance(slave, Slave) and 0.5 * shortest < inner * (1.0 - 1e-9):
            return f"half the step is less than the inner step of {slave.name}, {inner:g} s"
    return ""


def _differs_at_the_start(run: CoupledRun, again: CoupledRun) -> str:
    """Return which slave is not as before after a reset."""
    for name, values in run.columns.items():
        if name in again.columns and values[0] != again.columns[name][0]:
            return f"{name} does not come back to its start when the slave is reset"
    return ""


def _events_not_searched(run: CoupledRun) -> str:
    """Return which events were not searched for."""
    return f"; an event of a partner shorter than {1e3 * run.resolution:.3g} ms can be missed" if run.resolution else ""


def _refused(run: CoupledRun, why: str) -> CoupledError:
    result = dataclasses.replace(run, verdict="not accurate", why=why)
    error = CoupledError(f"{result.verdict}: {why}")
    error.run = result
    return error
