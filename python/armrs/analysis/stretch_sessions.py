"""Which joint a session stretches at several speeds: then its reflex is asked for, not a missing effect."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..io.trial import Trial
from .stretch_reflex import FEWEST

LEAST_RANGE = np.radians(20.0)
"""Range that a stretch needs to reach a speed and leave it again [rad]."""
HELD = 0.2
"""Share of that range up to which the other joints count as held."""
LEAST_SPEEDS = 2.0
"""The fastest stretch is faster than the slowest by this factor."""
SPAN = 0.1
"""Time over which a speed is taken, so that noise of the angles is none [s]."""


def stretched_joint(trials: Sequence[Trial]) -> int | None:
    """Return the joint, from 1, that every trial moves alone, at several speeds; None for other sessions."""
    if len(trials) < FEWEST:
        return None
    ranges = np.array([[_range(column) for column in trial.q.T] for trial in trials])
    joint = int(np.argmax(ranges.max(axis=0)))
    others = np.delete(ranges, joint, axis=1)
    if ranges[:, joint].min() < LEAST_RANGE or np.any(others > HELD * ranges[:, [joint]]):
        return None
    speeds = [_speed(trial, joint) for trial in trials]
    return joint + 1 if max(speeds) >= LEAST_SPEEDS * min(speeds) else None


def _range(angle: np.ndarray) -> float:
    there = angle[np.isfinite(angle)]
    return float(np.ptp(there)) if there.size else 0.0


def _speed(trial: Trial, joint: int) -> float:
    apart = max(1, min(round(SPAN * trial.rate), len(trial) - 1))
    steps = (trial.q[apart:, joint] - trial.q[:-apart, joint]) / (trial.t[apart:] - trial.t[:-apart])
    return float(np.nanmax(np.abs(steps), initial=0.0))
