"""Preconditioning: the first cycles of rested tissue resist more than later ones, so they do not count as repeats.

A cycle is a movement up and down, or down and up, through the same angles. What it dissipates is the area of its loop over the angles that
all cycles share. The level is that of the later half of the cycles; a first cycle whose loop is larger than a single one would be in one of
a hundred cases (the prediction interval of Student's t) is preconditioning, and so is the next after it, until one is not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from . import students_t

CHANCE = 0.01
"""Probability of a loop so large by chance."""
FEWEST = 6
"""Fewest cycles that are compared: the later half is three."""
LEAST_MORE = 0.05
"""Share by which a loop must exceed the later ones, however alike these are."""
_POINTS = 24
"""Angles at which the two ways of a cycle are compared."""


@dataclass(frozen=True, eq=False)
class Preconditioned:
    """First cycles of a movement that resist more than later ones.

    Attributes
    ----------
    course : int
        Of which trial, from 0.
    cycles : int
        How many first cycles.
    samples : slice
        Of the trial.
    more : float
        Share by which the first of them dissipates more than later ones do.
    """

    course: int
    cycles: int
    samples: slice
    more: float


@dataclass(frozen=True, eq=False)
class _Cycle:
    course: int
    samples: slice
    up: tuple[np.ndarray, np.ndarray]
    down: tuple[np.ndarray, np.ndarray]


def find(courses: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]]) -> list[Preconditioned]:
    """Find the first cycles of one joint that are preconditioning.

    Parameters
    ----------
    courses : sequence of (angle, moment, direction)
        Of the repeats of one movement in their order, each (n,) [rad, N m] and 1, -1 or 0 for a growing angle, a falling one and rest.

    Returns
    -------
    list of Preconditioned
        For each trial that has six cycles; where none has, for the repeats together, one after the other.
    """
    cycles = [_cycles(number, *course) for number, course in enumerate(courses)]
    series = [own for own in cycles if len(own) >= FEWEST] or [[cycle for own in cycles for cycle in own]]
    return [found for own in series for found in _first(own)]


def _cycles(course: int, angle: np.ndarray, moment: np.ndarray, direction: np.ndarray) -> list[_Cycle]:
    """Return pairs of one way and the next, back."""
    there = np.flatnonzero(direction)
    cuts = np.flatnonzero(np.diff(direction[there])) + 1
    ways = [run for run in np.split(there, cuts) if run.size >= 4]
    found = []
    for one, other in zip(ways[::2], ways[1::2], strict=False):
        rising, falling = (one, other) if direction[one[0]] > 0 else (other, one)
        found.append(
            _Cycle(course, slice(int(one[0]), int(other[-1]) + 1), (angle[rising], moment[rising]), (angle[falling], moment[falling]))
        )
    return found


def _first(cycles: Sequence[_Cycle]) -> list[Preconditioned]:
    """Return the first cycles that dissipate more than the later half, trial by trial."""
    if len(cycles) < FEWEST:
        return []
    low = max(float(way[0].min()) for c in cycles for way in (c.up, c.down))
    high = min(float(way[0].max()) for c in cycles for way in (c.up, c.down))
    if high <= low:
        return []
    at = np.linspace(low, high, _POINTS)
    loops = np.array([float(np.mean(_along(c.up, at) - _along(c.down, at))) for c in cycles])
    later = loops[len(loops) - len(loops) // 2 :]
    level, count = float(later.mean()), len(later)
    allowed = students_t.quantile(1.0 - 2.0 * CHANCE, count - 1) * float(later.std(ddof=1)) * np.sqrt(1.0 + 1.0 / count)
    larger = loops > level + max(allowed, LEAST_MORE * abs(level))
    number = int(np.argmin([*larger[: len(loops) - count], False]))
    first = cycles[:number]
    found = []
    for course in dict.fromkeys(c.course for c in first):
        own = [c for c in first if c.course == course]
        more = float(loops[cycles.index(own[0])] / level - 1.0)
        found.append(Preconditioned(course, len(own), slice(own[0].samples.start, own[-1].samples.stop), more))
    return found


def _along(way: tuple[np.ndarray, np.ndarray], at: np.ndarray) -> np.ndarray:
    order = np.argsort(way[0], kind="stable")
    return np.interp(at, way[0][order], way[1][order])
