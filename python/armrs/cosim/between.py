"""What outputs do between the communication points: a slave makes a step in parts, and its outputs are read after each of them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .partner import Partner


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


class Between:
    """How far outputs go beyond their values at the communication points, between them.

    Parameters
    ----------
    count : int
        Number of outputs.
    resolution : float
        Longest time between two looks [s]; infinite for none between the communication points.

    Attributes
    ----------
    most, at : ndarray, shape (count,)
        Largest distance from the range of the values at the beginning and the end of a step, and when that was [s].
    longest : float
        Longest time between two looks in fact [s].
    """

    def __init__(self, count: int, resolution: float) -> None:
        self.resolution = resolution
        self.most, self.at = np.zeros(count), np.zeros(count)
        self.longest = 0.0
        self._seen: dict[int, list[tuple[float, np.ndarray]]] = {}

    def begin(self, i: int, slave: Partner, step: float) -> int:
        """Return in how many parts a slave, the i-th, makes its step, and forget the last."""
        n = parts(slave, step, self.resolution)
        self._seen[i] = []
        self.longest = max(self.longest, step / n)
        return n

    def see(self, i: int, time: float, values: np.ndarray) -> None:
        """Take the outputs of a slave within its step."""
        self._seen[i].append((time, values))

    def end(self, out_of: Sequence[np.ndarray], start: np.ndarray, end: np.ndarray) -> None:
        """Compare what was seen with all outputs at both ends of the step; `out_of` has the places of those of each slave."""
        for i, seen in self._seen.items():
            if not seen:
                continue
            places = out_of[i]
            values = np.array([row for _, row in seen])
            both = np.stack([start[places], end[places]])
            beyond = np.maximum(values - both.max(axis=0), both.min(axis=0) - values)
            beyond[~np.isfinite(values)] = np.inf
            row = np.argmax(beyond, axis=0)
            most = beyond[row, np.arange(len(places))]
            more = most > self.most[places]
            self.most[places[more]] = most[more]
            self.at[places[more]] = np.array([time for time, _ in seen])[row[more]]
