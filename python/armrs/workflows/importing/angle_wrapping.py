"""Angles that the recorder wraps at ±180° or at 360°: the turn in which they are counted, decided over all trials."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

TURN = 2.0 * np.pi
"""A whole turn [rad]."""
_FREE = 1.0 / 36.0
"""The arc that no angle of a channel reaches is at least this wide [turns]; a joint that fills the circle is left as it is."""
_JUMP = 0.1
"""A jump from one sample to the next is a wrap within this of a whole turn [turns]."""


def lowest(recordings: Sequence[np.ndarray], turn: float) -> float | None:
    """Return the angle from which a channel is counted, up to a turn more; None where its angles are right as they are.

    It lies in the middle of the widest arc that no sample of any trial reaches, in the turn in which the middle of the angles is
    within half a turn of zero. Angles are wrapped where they jump by a turn, or where they fill more than half a turn and without the
    wrap less than half of one.

    Parameters
    ----------
    recordings : sequence of ndarray
        The samples of each trial.
    turn : float
        A whole turn in their unit.

    >>> lowest([np.array([350.0, 358.0, 5.0]), np.array([2.0, 40.0])], 360.0)
    -165.0
    >>> lowest([np.array([-60.0, 40.0])], 360.0) is None
    True
    """
    known = [angles[np.isfinite(angles)] for angles in recordings]
    every = np.concatenate(known or [np.zeros(0)])
    if not every.size:
        return None
    around = np.unique(np.mod(every, turn))
    gaps = np.diff(around, append=around[0] + turn)
    widest = int(np.argmax(gaps))
    free, span = float(gaps[widest]), float(np.ptp(every))
    if free < _FREE * turn:
        return None
    filled = turn - free
    # From the end of the free arc on, the angles go on without a jump.
    middle = float(around[widest]) + free + 0.5 * filled
    wrapped = any(_jumps(angles, turn) for angles in known) or filled <= 0.5 * turn < span
    turned = wrapped or round(0.5 * float(every.max() + every.min()) / turn) != 0
    # Three digits of a turn lie well within the free arc.
    return round(float(middle - round(middle / turn) * turn - 0.5 * turn), 2 if turn < 10.0 else 0) if turned else None


def _jumps(angles: np.ndarray, turn: float) -> bool:
    return bool((np.abs(np.abs(np.diff(angles)) - turn) < _JUMP * turn).any())


def counted_from(angles: np.ndarray, low: float, turn: float) -> np.ndarray:
    """Return angles in the turn from `low` on.

    >>> counted_from(np.array([350.0, 5.0]), -165.0, 360.0)
    array([-10.,   5.])
    """
    return angles - turn * np.floor((angles - low) / turn)
