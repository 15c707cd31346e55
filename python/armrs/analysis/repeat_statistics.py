"""Mean and standard deviation over repeats of one movement; NaN where a repeat has no samples."""

from __future__ import annotations

import numpy as np

_ITERATIONS = 30
"""In which shape and levels are fitted: each leaves of the error about the share of values that is missing."""


def mean(values: np.ndarray) -> np.ndarray:
    """Return the mean of values, (repeats, k), over the repeats that have samples."""
    there = np.isfinite(values)
    count = there.sum(axis=0)
    return np.where(count > 0, np.where(there, values, 0.0).sum(axis=0) / np.maximum(count, 1), np.nan)


def deviation(values: np.ndarray) -> np.ndarray:
    """Return the standard deviation of values, (repeats, k), over repeats; NaN where fewer than two have samples."""
    there = np.isfinite(values)
    count = there.sum(axis=0)
    square = np.where(there, values - mean(values), 0.0) ** 2
    return np.where(count > 1, np.sqrt(square.sum(axis=0) / np.maximum(count - 1, 1)), np.nan)


def completed(values: np.ndarray, broken: np.ndarray) -> np.ndarray:
    """Return values, (repeats, k), with what gaps took from broken repeats: the shape of all repeats at the level of each.

    Without it a gap in one repeat takes its angles from all, and means over other angles are other quantities. Shape and levels are those
    of least squares, fitted in turn.
    """
    level, shape = np.zeros(len(values)), mean(values)
    for _ in range(_ITERATIONS):
        level = mean((values - shape).T)
        shape = mean(values - level[:, None])
    return np.where(broken[:, None] & ~np.isfinite(values), shape + level[:, None], values)


def slope(values: np.ndarray, edges: np.ndarray) -> float:
    """Return the slope of the straight line through values in bins with these edges; zero for fewer than two that are there."""
    there, middle = np.isfinite(values), 0.5 * (edges[1:] + edges[:-1])
    return float(np.polyfit(middle[there], values[there], 1)[0]) if there.sum() > 1 else 0.0
