"""Communication step sizes: constant, given, or controlled by the error."""

from __future__ import annotations

import math

from .system import System

_SAFETY = 0.8
"""Share that is taken of the step with which the error would be just what is allowed."""
_LEAST, _MOST = 0.25, 2.0
"""Least and largest ratio of the length of a step to that of the last."""
_REPEATED = 2.0
"""Error, in units of what is allowed, from which a step is made again."""


class StepControl:
    """The steps of a run, one after the other.

    With `shortest_step` of the system, a step is a whole number of shortest steps, up to `step`: its error is to stay below what is
    allowed. Where all slaves can go back, a step with twice that error is made again.

    Attributes
    ----------
    repeats : bool
        Whether a step may be made again.
    """

    def __init__(self, system: System) -> None:
        self._grid, self._duration = system.grid, system.duration
        self._unit = system.step if system.shortest_step is None else system.shortest_step
        self._total = len(system.grid) - 1 if system.grid else math.ceil(system.duration / self._unit - 1e-6)
        self._most = 1 if system.grid else max(1, round(system.step / self._unit))
        self._at, self._length = 0, 1
        self.repeats = self._most > 1 and all(slave.can_rollback for slave in system.slaves.values())

    @property
    def begin(self) -> float:
        """Beginning of the next step [s]; a product, so that time does not drift."""
        return self._grid[self._at] if self._grid else self._at * self._unit

    @property
    def end(self) -> float | None:
        """End of the next step [s], the last cut to the end of the run; None where none is left."""
        if self._at >= self._total:
            return None
        return self._grid[self._at + 1] if self._grid else min((self._at + self._length) * self._unit, self._duration)

    def shorten(self, error: float) -> bool:
        """Take a shorter step instead of one with an error, in units of what is allowed; return whether there is one to take."""
        if error <= _REPEATED or self._length == 1:
            return False
        self._length = self._next(error)
        return True

    def go_on(self, error: float) -> int:
        """Go on from a step with an error, in units of what is allowed; return how many of the longest steps were completed."""
        before, self._at = self._at, self._at + self._length
        self._length = min(self._next(error), max(1, self._total - self._at))
        return self._at // self._most - before // self._most

    def _next(self, error: float) -> int:
        factor = _MOST if error <= 0.0 else max(_LEAST, min(_MOST, _SAFETY / math.sqrt(error)))
        return max(1, min(self._most, int(factor * self._length)))
