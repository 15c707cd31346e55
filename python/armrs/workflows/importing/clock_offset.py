"""Clock offset between forces and angles from different devices, by regression on the equation of motion."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ... import _armrs
from ...model import Model
from . import offset_search
from .offset_search import EDGE, FINE, averaged, smoothed

_RATE = 50.0
"""Rate at which signals are compared [Hz]."""
_COARSE = 0.04
"""First steps of the lateness [s]."""
NEAR = 0.35
"""Accuracy of the shift from the posture alone [s]; within it the equation of motion is used."""
_STEP, _LONGEST, _SETTLED, _ROUNDS = 0.01, 0.05, 1e-5, 40
"""Steps of the shift [s]: over which slopes are taken, the longest in one round, and the one that ends the rounds."""
_TOGETHER = 1.5
"""One shift holds for all recordings where it leaves at most so many times what a shift for each does."""
_FEWEST = 100
"""Samples of a recording from which on its ends are left out."""
_ENDS = 2.0
"""Recordings that begin and end within so many steps of each other seem to be on one clock."""
_DOUBTFUL = 1.5
"""Another shift may be right where it leaves at most so many times what the one taken does."""
_COMPARED = 0.25
"""Least part of the angles on which two shifts are compared."""
_CREEP = 0.02
"""Speed at which friction has most of its size [rad/s]."""
_LATEST = 0.6
"""Largest lateness of forces that is tried [s]."""
_AS_GOOD = 1.2
"""The clock of the file is kept where it leaves at most so many times what the best shift does."""


def together(t: np.ndarray, force_t: np.ndarray) -> bool:
    """Whether angles and forces begin and end at the same times [s]: then their clocks are at most `NEAR` apart."""
    step = max(float(np.median(np.diff(stamps))) for stamps in (t, force_t))
    return bool(max(abs(t[0] - force_t[0]), abs(t[-1] - force_t[-1])) <= _ENDS * step)


def lateness(model: Model, t: np.ndarray, q: np.ndarray, force_on_arm: np.ndarray) -> tuple[float, float]:
    """Return how late forces are against angles of one recording [s], and how many times less is then unexplained.

    Parameters
    ----------
    model : Model
    t, q, force_on_arm
        As in `Recording`, on one clock.
    """
    good = np.isfinite(q).all(axis=1) & np.isfinite(force_on_arm).all(axis=1)
    # Of a short recording, half must be left to compare.
    latest = min(_LATEST, 0.25 * float(np.ptp(t[good])) - _COARSE - EDGE)
    if latest < _COARSE:
        return 0.0, 1.0
    fit = _Fit.of(model, Recording(t[good], q[good], t[good], force_on_arm[good]), [0.0], latest + _COARSE)
    best = 0.0
    for width, step in ((latest, _COARSE), (_COARSE, 0.25 * _COARSE)):
        tried = [float(shift) for shift in best + np.arange(-width, width + 0.5 * step, step)]
        best = min(tried, key=lambda shift: _left([fit], [shift]))
    return -best, _left([fit], [0.0]) / max(_left([fit], [best]), 1e-300)


@dataclass(frozen=True)
class Recording:
    """Angles, and forces on a clock of their own.

    Attributes
    ----------
    t, q
        Time of the angles [s], shape (n,), and the angles in the convention of armrs [rad], shape (n, n_joints).
    force_t, force_on_arm
        Time of the forces by their own clock [s], shape (m,), and the forces [N], shape (m, 2).
    near : float
        What `matching` found: what to add to the time of the forces [s].
    one_file : bool
        Whether both stand in one file.
    others : tuple of float
        What `matching` found as well [s].
    """

    t: np.ndarray
    q: np.ndarray
    force_t: np.ndarray
    force_on_arm: np.ndarray
    near: float = 0.0
    one_file: bool = False
    others: tuple[float, ...] = ()

    @property
    def one_clock(self) -> bool:
        """Whether both seem to be on one clock: they stand in one file, or begin and end together."""
        return self.one_file or together(self.t, self.force_t)


def refine(model: Model, recordings: Sequence[Recording]) -> list[float]:
    """Return for each recording the shift near what `matching` found at which the equation of motion explains the contact torques best [s].

    Parameters
    ----------
    model : Model
        Its lengths count; moments, inertias and passive laws are fitted to all recordings together.
    recordings : sequence of Recording

    Notes
    -----
    In one slow movement, a delay resembles a viscosity. All recordings share the laws of the joints; and one shift holds for all,
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
    for shift in _distinct([float(np.median(each)), *near.tolist(), *_of_all(recordings)]):
        start = np.full(len(near), shift)
        fits = _fits(model, recordings, each, start)
        if not fits:
            continue
        common = _descended(fits, start, start, together=True)
        times = _left(fits, common) / max(_left(fits, _descended(fits, each, near, together=False)), 1e-300)
        if times <= best:
            best, held = times, common
    return held.tolist()


@dataclass(frozen=True)
class Found:
    """The shift of one recording.

    Attributes
    ----------
    seconds : float
        Added to the time of the forces [s].
    std : float
        Its standard deviation [s], of residuals that are independent from second to second; infinite where a delay cannot be distinguished
        from the laws of the joints.
    others : tuple of float
        Other shifts that explain the torques about as well [s].
    """

    seconds: float
    std: float
    others: tuple[float, ...]


def certain(model: Model, recordings: Sequence[Recording], shifts: Sequence[float]) -> list[Found]:
    """Return the shifts that `refine` found, or better ones of `others`, with what is not known of them.

    Parameters
    ----------
    model, recordings
        As in `refine`.
    shifts : sequence of float
        [s]
    """
    held = np.array(shifts)
    common = len(recordings) > 1 and float(np.ptp(held)) == 0.0
    if all(recording.one_clock for recording in recordings) and not held.any():
        doubted: list[list[float]] = [[] for _ in recordings]
    elif common:
        held, doubted = _other_common(model, recordings, held)
    else:
        held, doubted = _other_single(model, recordings, held)
    stds = _deviations(_fits(model, recordings, held), held, together=common)
    return [Found(float(s), std, tuple(sorted(o))) for s, std, o in zip(held, stds, doubted, strict=True)]


def _other_common(model: Model, recordings: Sequence[Recording], held: np.ndarray) -> tuple[np.ndarray, list[list[float]]]:
    """Return the shift of all recordings that is best, and others that are about as good."""
    doubted: list[float] = []
    for other in _distinct([float(held[0]), *(shift for recording in recordings for shift in recording.others)])[1:]:
        start = np.full(len(held), other)
        if not (fits := _fits(model, recordings, held, start)):
            continue
        found = _descended(fits, start, start, together=True)
        times = _left(fits, found) / max(_left(fits, held), 1e-300)
        if times < 1.0:
            held, found = found, held
        if max(times, 1.0 / max(times, 1e-300)) <= _DOUBTFUL:
            doubted.append(float(found[0]))
    return held, [doubted] * len(recordings)


def _other_single(model: Model, recordings: Sequence[Recording], held: np.ndarray) -> tuple[np.ndarray, list[list[float]]]:
    """Return for each recording the best of its shifts while the others keep theirs, and those that are about as good."""
    triangles = [_triangle(fit, float(s)) for fit, s in zip(_fits(model, recordings, held), held, strict=True)]
    doubted: list[list[float]] = []
    for k, recording in enumerate(recordings):
        doubted.append([])
        rest = np.concatenate([np.zeros((0, triangles[0].shape[1])), *triangles[:k], *triangles[k + 1 :]])
        without = _last(rest)
        for other in _distinct([float(held[k]), *recording.others])[1:]:
            fit = _Fit.of(model, recording, [float(held[k]), other], NEAR + _STEP)
            if len(fit.grid) < _COMPARED * (recording.t[-1] - recording.t[0]) * _RATE:
                doubted[k].append(other)
                continue

            def left(shift: float, fit: _Fit = fit, rest: np.ndarray = rest, without: float = without) -> float:
                return max(_last(np.concatenate([rest, _triangle(fit, shift)])) - without, 1e-300)

            best = other
            for width, step in ((NEAR, 0.05), (0.0375, 0.0125)):
                best = min((float(s) for s in best + np.arange(-width, width + 0.5 * step, step)), key=left)
            times = left(best) / left(float(held[k]))
            if times < 1.0:
                best, held[k] = float(held[k]), best
                triangles[k] = _triangle(_Fit.of(model, recording, [float(held[k])], NEAR + _STEP), float(held[k]))
            if max(times, 1.0 / times) <= _DOUBTFUL:
                doubted[k].append(best)
    return held, doubted


def _triangle(fit: _Fit, shift: float) -> np.ndarray:
    """Return the triangle of the regressors and the torques at a shift [s]."""
    rows = fit.design.reshape(-1, fit.design.shape[2])
    return np.asarray(np.linalg.qr(np.column_stack([rows, fit.torque(shift)]), mode="r"))


def _last(rows: np.ndarray) -> float:
    """Return the sum of squares that the regressors leave of the torques in the last column."""
    return float(np.linalg.qr(rows, mode="r")[-1, -1] ** 2) if len(rows) >= rows.shape[1] else 0.0  # type: ignore[call-overload]


def _deviations(fits: Sequence[_Fit], shifts: np.ndarray, *, together: bool) -> list[float]:
    """Return the standard deviations of shifts, by a sandwich over seconds of the recordings [s]."""
    slopes = [(fit.torque(float(s) + _STEP) - fit.torque(float(s) - _STEP)) / (2.0 * _STEP) for fit, s in zip(fits, shifts, strict=True)]
    ends = np.cumsum([0, *(len(slope) for slope in slopes)])
    columns = np.zeros((ends[-1], 1 if together else len(fits)))
    for k, slope in enumerate(slopes):
        columns[ends[k] : ends[k + 1], 0 if together else k] = -slope
    design = np.concatenate([fit.design.reshape(-1, fit.design.shape[2]) for fit in fits])
    design = design[:, np.abs(design).max(axis=0) > 0.0]
    design = design / np.abs(design).max(axis=0)
    torque = np.concatenate([fit.torque(float(s)) for fit, s in zip(fits, shifts, strict=True)])
    # The shift follows from the part that the laws of the joints do not explain.
    own = columns - design @ np.linalg.lstsq(design, columns, rcond=1e-10)[0]
    left = torque - design @ np.linalg.lstsq(design, torque, rcond=1e-10)[0]
    information = own.T @ own
    blocks = np.add.reduceat(own * left[:, None], np.arange(0, len(left), round(_RATE) * fits[0].design.shape[1]), axis=0)
    if np.linalg.cond(information) > 1e12:
        return [float("inf")] * len(fits)
    inverse = np.linalg.inv(information)
    stds = np.sqrt(np.diag(inverse @ (blocks.T @ blocks) @ inverse))
    return [float(stds[0 if together else k]) for k in range(len(fits))]


def _of_all(recordings: Sequence[Recording]) -> list[float]:
    """Return the shifts that may be those of every recording."""
    rest = recordings[1:]
    return [s for s in recordings[0].others if all(any(abs(s - other) < NEAR for other in r.others) for r in rest)]


def _distinct(shifts: Sequence[float]) -> list[float]:
    """Return shifts of which none can be reached from another one."""
    found: list[float] = []
    for shift in shifts:
        if all(abs(shift - other) > NEAR for other in found):
            found.append(shift)
    return found


@dataclass(frozen=True)
class _Fit:
    """The equation of motion of one recording: `design` times unknowns is the torque of the contact force."""

    grid: np.ndarray
    design: np.ndarray
    fine: np.ndarray
    jacobian: np.ndarray
    inside: np.ndarray
    clock: np.ndarray
    force: np.ndarray

    @classmethod
    def of(cls, model: Model, recording: Recording, shifts: Sequence[float], widest: float) -> _Fit:
        """Return that of the samples that have forces at every shift up to `widest` [s] from each of these."""
        fine, clock, force, jacobian, rows = _equation(model, recording)
        grid, beyond = fine[::FINE], widest + EDGE
        inside = np.zeros(len(grid), dtype=bool)
        while inside.sum() < _COMPARED * len(grid) and beyond > _STEP:  # a short recording has not much of an edge to leave out
            inside = (grid - max(shifts) - beyond >= clock[0]) & (grid - min(shifts) + beyond <= clock[-1])
            beyond *= 0.5
        return cls(grid[inside], smoothed(rows, FINE * _RATE)[inside], fine, jacobian, inside, clock, force)

    def torque(self, shift: float) -> np.ndarray:
        """Return the torque of the contact force, joint by joint in one column, with the clock of the forces shifted [s]."""
        force = np.column_stack([np.interp(self.fine - shift, self.clock, column) for column in self.force.T])
        return smoothed(np.einsum("nij,ni->nj", self.jacobian, force), FINE * _RATE)[self.inside].ravel()


def _equation(model: Model, recording: Recording) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return times of angles and of forces, forces, Jacobian, and regressors of the equation of motion."""
    good, seen = np.isfinite(recording.q).all(axis=1), np.isfinite(recording.force_on_arm).all(axis=1)
    rate = FINE * _RATE
    fine, angles = averaged(recording.t[good], recording.q[good], rate)
    clock, force = averaged(recording.force_t[seen], recording.force_on_arm[seen], rate)
    speeds = np.gradient(angles, fine, axis=0)
    kernels = _armrs.Arm.from_model(model)
    rows = kernels.regressor(angles, speeds, np.gradient(speeds, fine, axis=0))
    # At its ends a mean is one to the side, and its slope none of the angle's.
    ends = slice(round(offset_search.AVERAGED * rate), -round(offset_search.AVERAGED * rate)) if len(fine) > _FEWEST else slice(None)
    fine, angles, speeds, rows = fine[ends], angles[ends], speeds[ends], rows[ends]
    n, joints = angles.shape
    own = np.zeros((n, joints, 4 * joints))
    for j in range(joints):
        own[:, j, 4 * j : 4 * j + 4] = np.column_stack([angles[:, j], speeds[:, j], np.tanh(speeds[:, j] / _CREEP), np.ones(n)])
    return fine, clock, force, kernels.jacobian(angles), np.concatenate([rows, own], axis=2)


def matched(model: Model, recordings: Sequence[Recording]) -> list[list[float]]:
    """Return for each recording the shifts at which one equation of motion explains the torques about equally well, the best first [s].

    Parameters
    ----------
    model, recordings
        As in `refine`.
    """
    matches = []
    for recording in recordings:
        fine, clock, force, jacobian, rows = _equation(model, recording)
        within = NEAR if together(recording.t, recording.force_t) else np.inf
        inner = slice(round(EDGE * _RATE), -round(EDGE * _RATE)) if len(fine) > _FEWEST else slice(None)
        grid, design, jacobian = fine[::FINE][inner], smoothed(rows, FINE * _RATE)[inner], jacobian[::FINE][inner]
        matches.append(offset_search.Match.of_motion(grid, design, jacobian, clock[::FINE], smoothed(force, FINE * _RATE), within))
    return offset_search.together(matches)


def _fits(model: Model, recordings: Sequence[Recording], *hypotheses: np.ndarray) -> list[_Fit]:
    """Return the equation of motion of samples with forces at the shifts of all hypotheses; nothing where these are few."""
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
