"""The clock of forces that were recorded by another device, aligned with that of the angles by what both show: the arm's movement."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ... import _armrs
from ...errors import BadInput, Text
from ...model import Model

_RATE = 50.0
"""Rate at which signals are compared [Hz]."""
_COARSE = 0.04
"""Steps of the shift over all shifts [s]."""
NEAR = 0.35
"""The posture alone tells the shift to this [s]; within it the equation of motion is asked."""
_STEP, _LONGEST, _SETTLED, _ROUNDS = 0.01, 0.05, 1e-5, 40
"""Steps of the shift [s]: over which slopes are taken, the longest in one round, and the one that ends the rounds."""
_TOGETHER = 1.1
"""One shift holds for all recordings where it leaves at most so many times what a shift for each does."""
_ENDS = 2.0
"""Recordings that begin and end within so many steps of each other seem to be on one clock."""
_COMPARED = 0.25
"""Least part of the angles on which two shifts are compared."""
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


def together(t: np.ndarray, force_t: np.ndarray) -> bool:
    """Whether angles and forces begin and end at the same times [s]: then their clocks are at most `NEAR` apart."""
    step = max(float(np.median(np.diff(stamps))) for stamps in (t, force_t))
    return bool(max(abs(t[0] - force_t[0]), abs(t[-1] - force_t[-1])) <= _ENDS * step)


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
        As in `Recording`, on one clock.
    """
    good = np.isfinite(q).all(axis=1) & np.isfinite(force_on_arm).all(axis=1)
    fit = _Fit.of(model, Recording(t[good], q[good], t[good], force_on_arm[good]), [0.0], _LATEST + _COARSE)
    best = 0.0
    for width, step in ((_LATEST, _COARSE), (_COARSE, 0.25 * _COARSE)):
        tried = [float(shift) for shift in best + np.arange(-width, width + 0.5 * step, step)]
        best = min(tried, key=lambda shift: _left([fit], [shift]))
    return -best, _left([fit], [0.0]) / max(_left([fit], [best]), 1e-300)


@dataclass(frozen=True)
class Recording:
    """Angles, and forces on a clock of their own.

    Attributes
    ----------
    t, q
        As in `align`, the angles in the convention of armrs.
    force_t, force_on_arm
        As in `align`.
    near : float
        What `align` found [s].
    one_file : bool
        Whether both stand in one file.
    """

    t: np.ndarray
    q: np.ndarray
    force_t: np.ndarray
    force_on_arm: np.ndarray
    near: float = 0.0
    one_file: bool = False

    @property
    def one_clock(self) -> bool:
        """Whether both seem to be on one clock: they stand in one file, or begin and end together."""
        return self.one_file or together(self.t, self.force_t)


def refine(model: Model, recordings: Sequence[Recording]) -> list[float]:
    """Return for each recording the shift near what `align` found at which the equation of motion explains the contact torques best [s].

    Parameters
    ----------
    model : Model
        Its lengths count; moments, inertias and passive laws are fitted to all recordings together.
    recordings : sequence of Recording

    Notes
    -----
    In one slow movement, a delay and a viscosity look alike. All recordings share the laws of the joints; and one shift holds for all,
    as where one trigger starts both devices, if that explains the torques about as well. Where both seem to be on one clock, they are
    if that explains the torques about as well. A movement that repeats itself may have been taken a period off; so the shift of every
    recording is tried for all. Shifts are compared on the samples that have forces at both: what a longer shift leaves out, such as a
    jerk at the start, is no argument for it.
    """
    near = np.array([recording.near for recording in recordings])
    each = _descended(_fits(model, recordings, near), near, near, together=False)
    if all(recording.one_clock for recording in recordings):
        fits = _fits(model, recordings, each, 0.0 * near)
        if fits and _left(fits, 0.0 * near) <= _AS_GOOD * _left(fits, _descended(fits, each, near, together=False)):
            return [0.0] * len(recordings)
    best, held = _TOGETHER, each
    if len(recordings) == 1:
        return each.tolist()
    for shift in _distinct([float(np.median(each)), *near.tolist()]):
        start = np.full(len(near), shift)
        fits = _fits(model, recordings, each, start)
        if not fits:
            continue
        common = _descended(fits, start, start, together=True)
        times = _left(fits, common) / max(_left(fits, _descended(fits, each, near, together=False)), 1e-300)
        if times <= best:
            best, held = times, common
    return held.tolist()


def _distinct(shifts: Sequence[float]) -> list[float]:
    """Return shifts of which none can be reached from another one."""
    found: list[float] = []
    for shift in shifts:
        if all(abs(shift - other) > NEAR for other in found):
            found.append(shift)
    return found


@dataclass(frozen=True)
class _Fit:
    """What the equation of motion asks of one recording: `design` times unknowns is the torque of the contact force."""

    grid: np.ndarray
    design: np.ndarray
    jacobian: np.ndarray
    clock: np.ndarray
    values: np.ndarray

    @classmethod
    def of(cls, model: Model, recording: Recording, shifts: Sequence[float], widest: float) -> _Fit:
        """Return that of the samples that have forces at every shift up to `widest` [s] from each of these."""
        good, seen = np.isfinite(recording.q).all(axis=1), np.isfinite(recording.force_on_arm).all(axis=1)
        t, clock = recording.t[good], recording.force_t[seen]
        grid = np.arange(t[0], t[-1], 1.0 / _RATE)
        angles = _smoothed(np.column_stack([np.interp(grid, t, column) for column in recording.q[good].T]))
        speeds = np.gradient(angles, grid, axis=0)
        accelerations = np.gradient(speeds, grid, axis=0)
        kernels = _armrs.Arm.from_model(model)
        rows = kernels.regressor(angles, speeds, accelerations)
        n, joints = angles.shape
        own = np.zeros((n, joints, 4 * joints))
        for j in range(joints):
            own[:, j, 4 * j : 4 * j + 4] = np.column_stack([angles[:, j], speeds[:, j], np.tanh(speeds[:, j] / _CREEP), np.ones(n)])
        inside = (grid - max(shifts) - widest >= clock[0]) & (grid - min(shifts) + widest <= clock[-1])
        design = np.concatenate([rows, own], axis=2)[inside]
        return cls(grid[inside], design, kernels.jacobian(angles)[inside], clock, recording.force_on_arm[seen])

    def torque(self, shift: float) -> np.ndarray:
        """Return the torque of the contact force, joint by joint in one column, with the clock of the forces shifted [s]."""
        force = np.column_stack([np.interp(self.grid - shift, self.clock, column) for column in self.values.T])
        return np.einsum("nij,ni->nj", self.jacobian, force).ravel()


def _fits(model: Model, recordings: Sequence[Recording], *hypotheses: np.ndarray) -> list[_Fit]:
    """Return what the equation of motion asks of samples with forces at the shifts of all hypotheses; nothing where these are few."""
    fits = [_Fit.of(model, r, shifts, NEAR + _STEP) for r, shifts in zip(recordings, np.column_stack(hypotheses).tolist(), strict=True)]
    enough = all(len(fit.grid) >= _COMPARED * (r.t[-1] - r.t[0]) * _RATE for fit, r in zip(fits, recordings, strict=True))
    return fits if enough or len(hypotheses) == 1 else []


def _left(fits: Sequence[_Fit], shifts: Sequence[float] | np.ndarray) -> float:
    """Return the mean square of the torques that the equation of motion leaves unexplained, with one set of laws for all recordings."""
    torque = np.concatenate([fit.torque(float(shift)) for fit, shift in zip(fits, shifts, strict=True)])
    whole = np.column_stack([np.concatenate([fit.design.reshape(-1, fit.design.shape[2]) for fit in fits]), torque])
    # The last entry of the triangle is what the columns before leave of the torques.
    return float(np.linalg.qr(whole, mode="r")[-1, -1] ** 2) / max(len(whole), 1)  # type: ignore[call-overload]


def _descended(fits: Sequence[_Fit], shifts: np.ndarray, near: np.ndarray, *, together: bool) -> np.ndarray:
    """Return the shifts to which steps of Gauss and Newton lead, within `NEAR` of what was found; `together` keeps their differences."""
    design = np.concatenate([fit.design.reshape(-1, fit.design.shape[2]) for fit in fits])
    ends = np.cumsum([0, *(fit.design.shape[0] * fit.design.shape[1] for fit in fits)])
    for _ in range(_ROUNDS):
        slopes = np.zeros((len(design), len(fits)))
        for k, (fit, shift) in enumerate(zip(fits, shifts, strict=True)):
            slopes[ends[k] : ends[k + 1], k] = (fit.torque(shift + _STEP) - fit.torque(shift - _STEP)) / (2.0 * _STEP)
        torque = np.concatenate([fit.torque(float(shift)) for fit, shift in zip(fits, shifts, strict=True)])
        columns = slopes.sum(axis=1, keepdims=True) if together else slopes
        steps = np.linalg.lstsq(np.hstack([design, -columns]), torque, rcond=None)[0][design.shape[1] :]
        moved = np.clip(shifts + np.clip(steps, -_LONGEST, _LONGEST), near - NEAR, near + NEAR)
        if np.abs(moved - shifts).max() < _SETTLED:
            return moved
        shifts = moved
    return shifts


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
