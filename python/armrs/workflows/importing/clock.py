"""The clock of forces that were recorded by another device, aligned with that of the angles by what both show: the arm's movement."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ... import _armrs
from ...errors import BadInput, Text
from ...model import Model

_RATE = 50.0
"""Rate at which signals are compared [Hz]."""
_COARSE, _FINE = 0.04, 0.002
"""Steps of the shift [s]: first over all shifts, then about the best."""
_NEAR = 0.15
"""The posture alone tells the shift to this [s]; within it the equation of motion is asked."""
_SMOOTH = 0.06
"""Angles are averaged over this before they are differentiated [s]."""
_CREEP = 0.02
"""Speed at which friction has most of its size [rad/s]."""
_OVERLAP = 0.6
"""Least part of the angles that forces must cover."""
_ALIKE = 3.0
"""Shifts that leave at most this many times as much unexplained as the best are compared by the balance of the arm."""
_MOST = 6
"""As many are compared at most."""
_LATEST = 0.6
"""Lateness up to which forces are looked for [s]."""
_AS_GOOD = 1.2
"""The clock of the file is kept where it leaves at most so many times what the best shift does."""
_EXPLAINED = 0.6
"""Least share of the force's variance that the posture must explain: less is no match."""


@dataclass(frozen=True)
class Shift:
    """What to add to the time of the forces [s], and the share of their variance that the arm's posture then explains."""

    seconds: float
    explained: float


def align(t: np.ndarray, q: np.ndarray, force_t: np.ndarray, force: np.ndarray) -> list[Shift]:
    """Return the shifts of the force's clock at which posture and motion explain the forces about equally well, the best first.

    A movement that repeats itself explains them at several; which is the right one, the balance of the arm tells.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Time of the angles [s].
    q : ndarray, shape (n, n_joints)
        Angles in any convention [rad].
    force_t : ndarray, shape (m,)
        Time of the forces [s].
    force : ndarray, shape (m, 2)
        [N]

    Raises
    ------
    BadInput
        When no shift makes the forces belong to the movement.

    Notes
    -----
    The forces are regressed on sines and cosines of the sums of neighbouring angles, and on speeds: whatever the convention of the angles,
    gravity of a moving arm lies in the span of these.
    """
    good, seen = np.isfinite(q).all(axis=1), np.isfinite(force).all(axis=1)
    grid = np.arange(t[good][0], t[good][-1], 1.0 / _RATE)
    features = _features(np.column_stack([np.interp(grid, t[good], column) for column in q[good].T]))
    clock, values = force_t[seen], force[seen]
    covered = _OVERLAP * (grid[-1] - grid[0])
    shifts = np.arange(grid[0] - clock[-1] + covered, grid[-1] - clock[0] - covered, _COARSE)
    found = [Shift(float(s), _explained(float(s), grid, features, clock, values)) for s in shifts]
    best = max(found, key=lambda shift: shift.explained, default=Shift(0.0, 0.0))
    if best.explained < _EXPLAINED:
        said = Text(f"{100 * best.explained:.0f} % of the forces explained by the movement at the best offset")
        raise BadInput("clock of the forces", said, f"at least {100 * _EXPLAINED:.0f} %", hint="do the forces belong to this trial?")
    share = np.array([shift.explained for shift in found])
    around = np.pad(share, 1, constant_values=-np.inf)
    peaks = np.flatnonzero((share >= around[:-2]) & (share > around[2:]) & (1.0 - share <= _ALIKE * (1.0 - best.explained)))
    return sorted((found[k] for k in peaks), key=lambda shift: -shift.explained)[:_MOST]


def lateness(model: Model, t: np.ndarray, q: np.ndarray, force_on_arm: np.ndarray) -> tuple[float, float]:
    """Return how late forces are against angles of one recording [s], and how many times less is then unexplained.

    Parameters
    ----------
    model : Model
    t, q, force_on_arm
        As in `refine`, on one clock.
    """
    good = np.isfinite(q).all(axis=1) & np.isfinite(force_on_arm).all(axis=1)
    unexplained = _fitted(model, t[good], q[good], t[good], force_on_arm[good])
    best = 0.0
    for width, step in ((_LATEST, _COARSE), (_COARSE, 0.25 * _COARSE)):
        best = min((float(shift) for shift in best + np.arange(-width, width + 0.5 * step, step)), key=unexplained)
    return -best, unexplained(0.0) / max(unexplained(best), 1e-300)


def refine(
    model: Model, t: np.ndarray, q: np.ndarray, force_t: np.ndarray, force_on_arm: np.ndarray, near: float, *, one_file: bool = False
) -> float:
    """Return the shift near `near` [s] at which the equation of motion explains the torques of the contact force best.

    Parameters
    ----------
    model : Model
        Its lengths count; moments, inertias and passive laws are fitted.
    t, q
        As in `align`, the angles in the convention of armrs.
    force_t, force_on_arm
        As in `align`.
    near : float
        What `align` found.
    one_file : bool
        Whether both stand in one file: their clocks are the same where that explains the torques about as well.
    """
    unexplained = _fitted(model, t, q, force_t, force_on_arm)
    shifts = near + np.arange(-_NEAR, _NEAR + _FINE, _FINE)
    left = np.array([unexplained(float(shift)) for shift in shifts])
    if one_file and abs(near) <= _NEAR and unexplained(0.0) <= _AS_GOOD * left.min():
        return 0.0
    k = int(np.clip(np.argmin(left), 1, len(left) - 2))
    below, at, above = left[k - 1 : k + 2]
    curvature = below - 2.0 * at + above
    return float(shifts[k] + (0.5 * _FINE * (below - above) / curvature if curvature > 0.0 else 0.0))


def _fitted(model: Model, t: np.ndarray, q: np.ndarray, force_t: np.ndarray, force_on_arm: np.ndarray) -> Callable[[float], float]:
    """Return what the equation of motion leaves unexplained, by the shift of the forces' clock; arguments as in `refine`."""
    good, seen = np.isfinite(q).all(axis=1), np.isfinite(force_on_arm).all(axis=1)
    grid = np.arange(t[good][0], t[good][-1], 1.0 / _RATE)
    angles = _smoothed(np.column_stack([np.interp(grid, t[good], column) for column in q[good].T]))
    speeds = np.gradient(angles, grid, axis=0)
    accelerations = np.gradient(speeds, grid, axis=0)
    kernels = _armrs.Arm.from_model(model)
    rows = kernels.regressor(angles, speeds, accelerations)
    n, joints = angles.shape
    own = np.zeros((n, joints, 4 * joints))
    for j in range(joints):
        own[:, j, 4 * j : 4 * j + 4] = np.column_stack([angles[:, j], speeds[:, j], np.tanh(speeds[:, j] / _CREEP), np.ones(n)])
    design, jacobian = np.concatenate([rows, own], axis=2), kernels.jacobian(angles)
    clock, values = force_t[seen], force_on_arm[seen]

    def unexplained(shift: float) -> float:
        inside = (grid - shift >= clock[0]) & (grid - shift <= clock[-1])
        force = np.column_stack([np.interp(grid[inside] - shift, clock, column) for column in values.T])
        torque = np.einsum("nij,ni->nj", jacobian[inside], force)
        whole = np.column_stack([design[inside].reshape(-1, design.shape[2]), torque.ravel()])
        # The last entry of the triangle is what the columns before leave of the torques.
        return float(np.linalg.qr(whole, mode="r")[-1, -1] ** 2) / len(whole)  # type: ignore[call-overload]

    return unexplained


def _smoothed(angles: np.ndarray) -> np.ndarray:
    half = max(1, round(0.5 * _SMOOTH * _RATE))
    padded = np.pad(angles, ((half, half), (0, 0)), mode="edge")
    kernel = np.full(2 * half + 1, 1.0 / (2 * half + 1))
    return np.column_stack([np.convolve(column, kernel, "valid") for column in padded.T])


def _features(q: np.ndarray) -> np.ndarray:
    sums = [q[:, a : b + 1].sum(axis=1) for a in range(q.shape[1]) for b in range(a, q.shape[1])]
    speeds = np.gradient(q, axis=0)
    columns = [np.ones(len(q)), *(f(s) for s in sums for f in (np.sin, np.cos)), *speeds.T, *np.tanh(speeds * _RATE / _CREEP).T]
    return np.column_stack(columns)


def _explained(shift: float, grid: np.ndarray, features: np.ndarray, clock: np.ndarray, values: np.ndarray) -> float:
    inside = (grid - shift >= clock[0]) & (grid - shift <= clock[-1])
    if inside.mean() < _OVERLAP:
        return 0.0
    target = np.column_stack([np.interp(grid[inside] - shift, clock, column) for column in values.T])
    target -= target.mean(axis=0)
    left = target - features[inside] @ np.linalg.lstsq(features[inside], target, rcond=None)[0]
    total = float(np.sum(target**2))
    return 1.0 - float(np.sum(left**2)) / total if total > 0.0 else 0.0
