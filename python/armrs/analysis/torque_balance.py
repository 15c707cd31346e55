"""Least-squares balance of the contact torques with gravity, inertia and passive joint laws, near the values of a model.

The wrong convention of angles or forces leaves most of the torques unexplained, whatever springs, dampers and friction the joints have.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .. import _armrs
from ..io.column_conventions import AlternativeConvention
from ..io.resample import complete_pieces, uniform_grid, usual_step
from ..model import Model

_CUTOFF = 3.0
"""Cutoff of the low-pass that angles and forces share [Hz]."""
SAMPLES = 800
"""Samples that are regressed: enough to decide a convention."""
BALANCED = 0.1
"""Share of the contact torques that the right reading of the columns leaves unexplained at most: in 99 of 100 of 128 sessions of two worlds
with up to two hidden effects it leaves 0.07."""
_SHORTEST = 1.0
"""Shortest stretch of complete samples that is used [s]."""
_FEWEST = 16
"""Samples that it has at least."""
_CREEPING = 0.03
"""Joint speed over which dry friction turns round [rad/s]."""
_FIRST_MOMENTS = (0.5, 1.6)
"""First moments relative to the model's: literature values are that far off at most."""
_INERTIA = (0.3, 3.0)
"""Inertia relative to the model's."""
_NOTHING, _ALIKE = 1e-6, 1e8
"""A regressor of less than this part of the largest does not act; regressors with a greater condition number are not distinguished."""
_ELASTIC, _CONSTANT, _VISCOUS, _DRY = 5.0, 5.0, 3.0, 1.0
"""Most of the passive laws, in weight moments of the whole stretched arm per rad, alone, per rad/s and alone."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Smoothed samples of movements with the force that the contact exerts.

    Attributes
    ----------
    q, speed, acceleration : ndarray, shape (n, n_joints)
        [rad], [rad/s], [rad/s²].
    force : ndarray, shape (n, 2)
        [N].
    moment : ndarray, shape (n,)
        [N m].
    """

    q: np.ndarray
    speed: np.ndarray
    acceleration: np.ndarray
    force: np.ndarray
    moment: np.ndarray

    def read_as(self, reading: AlternativeConvention) -> Motion:
        """Return the motion in another reading of its columns."""
        turn = reading.turn.T
        # The moment has the unit of the forces, if these share one.
        first, second = np.linalg.norm(reading.force, axis=1)
        scale = float(first) if first == second else 1.0
        return Motion(
            reading.angles(self.q), self.speed @ turn, self.acceleration @ turn, self.force @ reading.force.T, scale * self.moment
        )


def motion_of(recordings: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None]], samples: int = SAMPLES) -> Motion | None:
    """Return the complete stretches of recordings, smoothed and thinned; None where none is long enough.

    Parameters
    ----------
    recordings : sequence of (t, q, force, moment)
        Time [s], angles (n, n_joints) [rad], force (n, 2) [N], and moment (n,) [N m] or None; NaN where a sample is missing.
    samples : int
        About so many are kept.
    """
    pieces = []
    for t, q, force, moment in recordings:
        columns = np.column_stack([q, force, np.zeros(len(q)) if moment is None else moment])
        for piece in complete_pieces(np.isfinite(columns).all(axis=1)):
            if piece.stop - piece.start < _FEWEST or t[piece][-1] - t[piece][0] < _SHORTEST:
                continue
            grid = uniform_grid(t[piece])
            pieces.append((1.0 / usual_step(t[piece]), np.column_stack([np.interp(grid, t[piece], c) for c in columns[piece].T])))
    if not pieces:
        return None
    thin = max(1, sum(len(values) for _, values in pieces) // samples)
    smooth = [[a[::thin] for a in _armrs.smooth(values, rate, min(_CUTOFF, 0.2 * rate))] for rate, values in pieces]
    values, speed, acceleration = (np.concatenate(parts) for parts in zip(*smooth, strict=True))
    n = values.shape[1] - 3
    return Motion(values[:, :n], speed[:, :n], acceleration[:, :n], values[:, n : n + 2], values[:, n + 2])


def unexplained(model: Model, motion: Motion) -> float:
    """Return the share (root mean square) of the contact torques that gravity, inertia and passive laws leave.

    Bounded least squares over first moments and inertia near those of the model, and a spring, a constant moment, viscosity and dry
    friction in each joint. Above 1 where the torques are too small to carry the arm.
    """
    arm = _armrs.Arm.from_model(model)
    torque, segments, inertia, passive = _terms(arm, motion)
    weight = model.gravity * float(np.sum(np.abs(arm.first_moments)))
    columns = [*segments, inertia, *passive]
    laws = ((0.0, _ELASTIC), (-_CONSTANT, _CONSTANT), (0.0, _VISCOUS), (0.0, _DRY))
    bounds = [*[_FIRST_MOMENTS] * len(segments), _INERTIA]
    bounds += [(least * weight, most * weight) for _ in range(model.n_joints) for least, most in laws]
    # What matters of the tall system is its triangle.
    triangle: np.ndarray = np.linalg.qr(np.column_stack([*columns, torque]), mode="r")  # type: ignore[assignment]
    low, high = zip(*bounds, strict=True)
    left = _armrs.bounded_least_squares(triangle[:-1, :-1], triangle[:-1, -1].tolist(), low, high)
    size = float(np.sum(torque**2))
    return float(np.sqrt((left + triangle[-1, -1] ** 2) / size)) if size > 0.0 else 1.0


def weight_of(model: Model, motions: Sequence[Motion]) -> tuple[float, float] | None:
    """Return how many times heavier than its model the arm is by the contact torques, and the standard deviation.

    Least squares over one factor of gravity and inertia of all segments, and the passive laws of `unexplained`, without bounds. The
    deviation is that between motions (sandwich estimate).

    Parameters
    ----------
    model : Model
    motions : sequence of Motion
        Whose errors are independent of each other.

    Returns
    -------
    (float, float) or None
        None where the motions do not distinguish the weight from springs of the joints, and for a single motion.
    """
    if len(motions) < 2:
        return None
    arm, rows = _armrs.Arm.from_model(model), []
    for motion in motions:
        torque, segments, inertia, passive = _terms(arm, motion)
        rows.append((np.column_stack([np.sum(segments, axis=0) + inertia, *passive]), torque))
    whole = np.sum([a.T @ a for a, _ in rows], axis=0)
    size = np.sqrt(np.diag(whole))
    moved = size > _NOTHING * size.max()
    if not moved[0] or np.linalg.cond((whole / np.outer(size, size))[np.ix_(moved, moved)]) > _ALIKE:
        return None
    inverse = np.linalg.inv(whole[np.ix_(moved, moved)])
    found = inverse @ np.sum([a[:, moved].T @ torque for a, torque in rows], axis=0)
    scatter = [a[:, moved].T @ (torque - a[:, moved] @ found) for a, torque in rows]
    spread = inverse @ np.sum([np.outer(s, s) for s in scatter], axis=0) @ inverse * len(rows) / (len(rows) - 1)
    return float(found[0]), float(np.sqrt(spread[0, 0]))


def _terms(arm: _armrs.Arm, motion: Motion) -> tuple[np.ndarray, list[np.ndarray], np.ndarray, list[np.ndarray]]:
    """Return the contact torques, and what they balance: each first moment, inertia, and the passive laws of each joint; all flat [N m]."""
    n, joints = motion.q.shape
    torque = np.einsum("nij,ni->nj", arm.jacobian(motion.q)[:, :2, :], motion.force) + motion.moment[:, None]
    regressor = arm.regressor(motion.q, motion.speed, motion.acceleration)
    segments = [*np.moveaxis(regressor[:, :, :joints] * np.array(arm.first_moments), 2, 0)]
    inertia = regressor[:, :, 2 * joints :] @ np.array(arm.second_moments)
    passive = [
        np.outer(law, np.eye(joints)[j])
        for j in range(joints)
        for law in (motion.q[:, j], np.ones(n), motion.speed[:, j], np.tanh(motion.speed[:, j] / _CREEPING))
    ]
    return torque.ravel(), [s.ravel() for s in segments], inertia.ravel(), [law.ravel() for law in passive]
