"""The direction of motion of each joint at each sample."""

from __future__ import annotations

from itertools import pairwise

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


def bandwidth(qd: np.ndarray, direction: np.ndarray, rate: float) -> list[float]:
    """Return the bandwidth of each stroke of a joint that has samples with a direction [Hz]: one over the time above half its peak speed.

    That is where the spectrum of a pulse of speed is first zero: exactly for a rectangular one and a raised cosine, to 1 % for one of
    least jerk. Strokes of which the record holds a part, so that they begin or end at more than half their peak speed, are left out.
    """
    sign = np.where(np.isfinite(qd), np.sign(qd), 0.0)
    ends = np.flatnonzero(np.diff(sign, prepend=0.0, append=0.0))
    found = []
    for start, stop in pairwise(ends):
        fast = np.abs(qd[start:stop]) > 0.5 * np.abs(qd[start:stop]).max()
        if direction[start:stop].any() and not fast[0] and not fast[-1]:
            found.append(float(rate / fast.sum()))
    return found


def moves(angle: np.ndarray) -> bool:
    """Whether a joint with these angles [rad] moves; what is missing is NaN."""
    there = np.isfinite(angle)
    return bool(there.any() and np.ptp(angle[there]) >= LEAST_RANGE)


def _deep_inside(own: np.ndarray, margin: int) -> np.ndarray:
    """Return the samples that have `margin` of their like on both sides."""
    window = 2 * margin + 1
    return np.convolve(own, np.ones(window), mode="same") > window - 0.5 if window <= len(own) else np.zeros(len(own), dtype=bool)
