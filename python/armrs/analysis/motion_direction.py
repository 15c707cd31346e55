"""The direction of motion of each joint at each sample."""

from __future__ import annotations

import numpy as np

LEAST_RANGE = np.radians(2.0)
"""A joint that moves less than this counts as held [rad]."""
MOVING = 0.25
"""A joint moves when its speed is above this part of its usual speed in the trial."""


def directions(q: np.ndarray, qd: np.ndarray, known: np.ndarray, margin: int) -> np.ndarray:
    """Return in which direction each joint moves; one that is held rests at any noise.

    `margin` samples beside every reversal count as rest: there the low-pass mixes both directions. So do those of unknown moment.
    """
    result = np.zeros(q.shape, dtype=int)
    for j in range(q.shape[1]):
        there = np.isfinite(qd[:, j])
        if not moves(q[:, j]):
            continue
        least = MOVING * np.percentile(np.abs(qd[there, j]), 90.0)
        signs = np.where(there & (np.abs(qd[:, j]) > least), np.sign(qd[:, j]), 0.0)
        for sign in (-1, 1):
            result[_deep_inside(signs == sign, margin) & known[:, j], j] = sign
    return result


def moves(angle: np.ndarray) -> bool:
    """Whether a joint with these angles [rad] moves; what is missing is NaN."""
    there = np.isfinite(angle)
    return bool(there.any() and np.ptp(angle[there]) >= LEAST_RANGE)


def _deep_inside(own: np.ndarray, margin: int) -> np.ndarray:
    """Return the samples that have `margin` of their like on both sides."""
    window = 2 * margin + 1
    return np.convolve(own, np.ones(window), mode="same") > window - 0.5 if window <= len(own) else np.zeros(len(own), dtype=bool)
