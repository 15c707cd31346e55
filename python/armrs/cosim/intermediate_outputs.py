"""Outputs between the communication points: a slave divides a step into parts, and its outputs are read after each of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..fmu.slave_interface import Partner

_JUMP = 4.0
"""Ratio of a change to those before and after it from which it is a jump."""
_FEWEST = 3
"""Parts of a step of a slave with inputs: the first shows what the inputs do, and the change in another is compared with one beside it."""


@dataclass(frozen=True)
class Jump:
    """A jump of an output.

    Attributes
    ----------
    time : float
        End of the part of a step in which it is [s].
    size : float
    at_point : bool
        Whether a communication point of the first run is at either end of this part, so that the jump may be there. One just after such a
        point delays what the others get by less than a step, and by half of that in the second run: two runs give its effect.
    """

    time: float
    size: float
    at_point: bool


def parts(slave: Partner, step: float, resolution: float) -> int:
    """Return in how many equal parts a slave makes a step [s], so that none is longer than the resolution [s] where it can."""
    wanted = max(1, math.ceil(step / resolution - 1e-9))
    inner = slave.internal_step
    if inner is None:
        return wanted
    whole = max(1, round(step / inner))
    if abs(whole * inner - step) > 1e-6 * inner:
        return min(wanted, math.ceil(step / inner)) if slave.can_vary_step else 1
    return next((n for n in range(wanted, whole) if whole % n == 0), whole)


def outliers(changes: np.ndarray) -> np.ndarray:
    """Return the sizes of changes, shape (n, k), that are far larger than those before and after, and zero elsewhere."""
    sizes = np.abs(changes)
    if len(sizes) < 2:
        return np.zeros_like(sizes)
    none = np.zeros((1, sizes.shape[1]))
    beside = np.maximum(np.concatenate([none, sizes[:-1]]), np.concatenate([sizes[1:], none]))
    return np.where(sizes > _JUMP * beside, sizes, 0.0)


class IntermediateOutputs:
    """What connected outputs do between the communication points of a run, seen in its second run with two steps for each.

    Parameters
    ----------
    out_of : sequence of ndarray
        Places of the outputs of each slave among all.
    driven : sequence of bool
        Whether a slave has inputs that are connected. Its outputs may follow them at once where a step begins: such a change is compared
        with those where the steps before and after begin.
    count : int
        Number of outputs.
    resolution : float
        Longest time between two readings [s]; infinite for none between the communication points.

    Attributes
    ----------
    beyond : ndarray, shape (2, count)
        Largest distance of an output from the range of its values at both ends of a step, and when that was [s].
    jumps : list of list of Jump
        Jumps of each output.
    longest : float
        Actual longest time between two readings [s].
    """

    def __init__(self, out_of: Sequence[np.ndarray], driven: Sequence[bool], count: int, resolution: float) -> None:
        self._out_of, self._driven, self.resolution = out_of, driven, resolution
        self.beyond: np.ndarray = np.zeros((2, count))
        self.jumps: list[list[Jump]] = [[] for _ in range(count)]
        self.longest = 0.0
        self._seen: dict[int, list[tuple[float, np.ndarray]]] = {}
        # Of slaves without inputs: everything that was seen, with whether a communication point of the run follows.
        self._series: dict[int, list[tuple[float, np.ndarray, bool]]] = {}
        # Of the others: what changes where a step begins, and whether a communication point of the run is there.
        self._first: dict[int, list[tuple[float, np.ndarray, bool]]] = {}
        self._is_second = False

    def begin(self, i: int, slave: Partner, step: float) -> int:
        """Return in how many parts a slave, the i-th, makes its step, and forget the last."""
        self._seen[i] = []
        if math.isinf(self.resolution):
            return 1
        n = parts(slave, step, min(self.resolution, step / _FEWEST) if self._driven[i] else self.resolution)
        self.longest = max(self.longest, step / n)
        return n

    def see(self, i: int, time: float, values: np.ndarray) -> None:
        """Take the outputs of a slave within its step."""
        self._seen[i].append((time, values))

    def end(self, start: np.ndarray, time: float, end: np.ndarray) -> None:
        """Compare what was seen with all outputs at both ends of the step, which ends at a time [s]."""
        for i, seen in self._seen.items():
            if math.isinf(self.resolution):
                continue
            places = self._out_of[i]
            rows = np.array([row for _, row in seen]).reshape(len(seen), len(places))
            times = np.array([at for at, _ in seen])
            if seen:
                both = np.stack([start[places], end[places]])
                beyond = np.maximum(rows - both.max(axis=0), both.min(axis=0) - rows)
                beyond[~np.isfinite(rows)] = np.inf
                self._keep_most(places, beyond, times)
            if self._driven[i]:
                rows, times = np.vstack([rows, end[places]]), np.append(times, time)
                self._first.setdefault(i, []).append((times[0], rows[0] - start[places], not self._is_second))
                at_point = [False] * (len(seen) - 1) + [self._is_second]
                self._list(places, outliers(np.diff(rows, axis=0)), times[1:], at_point)
            else:
                series = self._series.setdefault(i, [(time, start[places], True)])
                series += [(at, row, False) for at, row in seen]
                series.append((time, end[places], self._is_second))
        self._is_second = not self._is_second

    def close(self) -> None:
        """Search for jumps in the readings of several steps."""
        for i, series in self._series.items():
            found = outliers(np.diff([row for _, row, _ in series], axis=0))
            at_point = [before or after for (_, _, before), (_, _, after) in pairwise(series)]
            self._list(self._out_of[i], found, [at for at, _, _ in series[1:]], at_point)
        for i, first in self._first.items():
            found = outliers(np.array([change for _, change, _ in first]))
            self._list(self._out_of[i], found, [at for at, _, _ in first], [at_point for _, _, at_point in first])
        for found_of in self.jumps:
            found_of.sort(key=lambda jump: jump.time)

    def _list(self, places: np.ndarray, found: np.ndarray, times: Sequence[float] | np.ndarray, at_point: Sequence[bool]) -> None:
        for row, column in np.argwhere(found):
            self.jumps[places[column]].append(Jump(float(times[row]), float(found[row, column]), at_point[row]))

    def _keep_most(self, places: np.ndarray, beyond: np.ndarray, times: np.ndarray) -> None:
        row = np.argmax(beyond, axis=0)
        most = beyond[row, np.arange(len(places))]
        more = most > self.beyond[0, places]
        self.beyond[0, places[more]] = most[more]
        self.beyond[1, places[more]] = times[row[more]]
