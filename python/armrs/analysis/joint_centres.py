"""Functional joint centres: where the joints are, from the path on which a robot led the hand.

Markers are placed anew in every session, some millimetres beside the joints, and skin carries them along. The robot's encoders know the
path of the handle better. While a joint turns, the hand moves on a circle about it: lengths and angles of the markers are corrected until
they put the hand on the path of the handle (least squares with the expected errors as prior; Gamage and Lasenby 2002, Ehrig et al. 2006
for markers alone). What the path does not determine keeps its prior uncertainty.

If the path contradicts the markers by more than misplaced markers can, single causes are compared: another zero of one angle of arm or
robot, and another place of the robot. Each is fitted with a wide prior.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..io.dataset import Dataset
from ..io.plausibility import hand_off_handle, hand_path, handle_path
from ..io.trial import Trial
from ..model import Model
from .uncertainty import LENGTH_STD, Deviations

SKIN_STD = 0.002
"""Standard deviation of how far skin carries a marker along and across its segment, for each radian of the next joint [m/rad]."""
_PATH_STD = 0.0001
"""Least standard deviation of the distance of hand and handle in one posture about the fit [m], which every session shows itself: the
repeatability of robots is 0.03 to 0.1 mm by their data sheets."""
_POSTURES = 10
"""Independent postures of one movement, whatever its rate and its repeats: errors of this distance are alike in neighbouring ones."""
_BASE_STD = 0.01
"""Standard deviation of the place of the first joint relative to the robot [m]."""
_ZERO_STD, _PLACE_STD = np.radians(10.0), 0.1
"""The same of the zero of an angle [rad], and of that place [m], where it is fitted as the cause of a contradiction."""
_COMPLIANCE_STD = 0.5
"""Standard deviation of the compliance of the contact of hand and handle, relative."""
_FURTHEST = 4.0
"""Errors of markers beyond this, in their standard deviations, are errors of another kind, such as a wrong model: nothing is corrected."""
_LEAST_GAIN = 12.0
"""Of minus two log-likelihoods by which a single cause must explain path and markers better than misplaced markers do: 3.5 of their σ."""
_UNDECIDED = 9.0
"""The same by which one cause must explain them better than another one to exclude it: 3 σ."""
_ITERATIONS = 3
"""In which the scatter of the path about the fit, and a wrong zero, are estimated."""


@dataclass(frozen=True, eq=False)
class JointCentres:
    """Errors of lengths and angles from markers that are not at the joints.

    Attributes
    ----------
    shift : ndarray, shape (n_errors,)
        Most probable error of each kind, in the order of `_sizes`; zero where no robot shows them.
    factor : ndarray, shape (n_errors, n_unknown)
        Its covariance is `factor @ factor.T`: what remains unknown.
    elongation : ndarray, shape (n_joints, n_errors)
        What each error does to the lengths, which are means over the session.
    found : bool
        Whether the path of a handle was used.
    contradicted : bool
        Whether it contradicts the markers by more than misplaced markers can.
    causes : tuple of Cause
        Single errors that explain it, the most probable first: all that the path does not exclude.
    apart : float
        How far hand and handle are from each other then, root mean square [m].
    """

    shift: np.ndarray
    factor: np.ndarray
    elongation: np.ndarray
    found: bool
    contradicted: bool = False
    causes: tuple[Cause, ...] = ()
    apart: float = 0.0

    def warnings(self) -> tuple[str, ...]:
        """Return that the angles of arm and robot contradict each other, by how much, and what is done about it."""
        if not self.contradicted:
            return ()
        said = f"angles of arm and robot contradict each other: hand and handle are {1e3 * self.apart:.0f} mm apart"
        said += ", more than misplaced markers explain"
        if self.causes:
            said += f"; explained by {' or by '.join(map(str, self.causes))}"
        if self.found:
            return (f"{said}: the path of the robot is corrected, angles of the arm are used as measured",)
        return (f"{said}: joint centres are those of the markers, and intervals allow for such errors of the arm's angles",)

    def lines(self, model: Model) -> tuple[str, ...]:
        """Return where the joints were found, for the segments of the data set; nothing where no robot shows them."""
        if self.contradicted and not self.found:
            return ("Angles of arm and robot differ by more than misplaced markers explain: joint centres are those of the markers.",)
        if not self.found:
            return ()
        lengths = [f"{s.length - e:.4f} m ({-1e3 * e:+.1f} mm)" for s, e in zip(model.segments, self.elongation @ self.shift, strict=True)]
        return (f"Joint centres are those about which the robot's handle turned: lengths {', '.join(lengths)}.",)

    def applied(self, dataset: Dataset) -> Dataset:
        """Return a data set with corrected lengths and angles."""
        if not self.shift.any():
            return dataset
        model = dataset.model
        trials = tuple(dataclasses.replace(t, q=t.q - _relative(_turns(model, t.q, _speed(t))[0] @ self.shift)) for t in dataset.trials)
        return dataset.replace(model=lengthened(model, -self.elongation @ self.shift), trials=trials)

    def unknown(self, model: Model, q: np.ndarray, qd: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return independent errors that remain, of one standard deviation each: of the angles along a motion and of the lengths.

        Without speeds `qd`, those of the clock of the cameras are left out.

        Returns
        -------
        angles : ndarray, shape (n_unknown, n, n_joints)
            [rad]
        lengths : ndarray, shape (n_unknown, n_joints)
            [m]
        """
        angles = _relative(_turns(model, q, np.zeros_like(q) if qd is None else qd)[0] @ self.factor)
        return np.moveaxis(angles, 2, 0), (self.elongation @ self.factor).T


def lengthened(model: Model, more: np.ndarray) -> Model:
    """Return a model with segments that are longer, (n_joints,) [m]."""
    lengths = [s.length + float(e) for s, e in zip(model.segments, more, strict=True)]
    return model.replace(segments=tuple(s.replace(length=a, com=min(s.com, a)) for s, a in zip(model.segments, lengths, strict=True)))


def find(dataset: Dataset) -> JointCentres:
    """Return the errors of lengths and angles of a session, from the path of the handle where a robot was recorded."""
    model = dataset.model
    usable = [t for t in dataset.trials if np.isfinite(t.q).all(axis=1).any()]
    markers = any(t.force_on_arm is not None for t in usable)  # a dynamometer reads the angle at its axis
    q = np.concatenate([t.q[np.isfinite(t.q).all(axis=1)] for t in usable]) if usable else np.zeros((1, model.n_joints))
    turns, along = _turns(model, q, np.zeros_like(q))
    sizes = _sizes(dataset, turns, markers)
    prior = JointCentres(np.zeros(len(sizes)), np.diag(sizes)[:, :-1], along.mean(axis=0), False)
    prior = dataclasses.replace(prior, factor=prior.factor[:, prior.factor.any(axis=0)])  # no clock where no path shows it
    seen = [t for t in usable if t.robot_q is not None and t.base is None and t.force_on_arm is not None]
    if model.robot is None or not seen or not markers:
        return prior
    session = (dataset, tuple(seen), prior.elongation, sizes)
    misplaced = _fitted(session)
    others = sorted((_fitted(session, cause) for cause in _causes(model.n_joints, len(sizes))), key=lambda fit: fit.cost)
    if misplaced.possible and misplaced.cost - others[0].cost < _LEAST_GAIN:
        return _of(prior, misplaced)
    told = [fit for fit in others if fit.possible and fit.cost < others[0].cost + _UNDECIDED]
    apart = float(np.sqrt(np.mean(np.sum(np.concatenate([hand_off_handle(model, model.robot, t) for t in seen]) ** 2, axis=1))))
    causes = tuple(fit.named() for fit in told)
    arm = [fit for fit in told or others if fit.cause is not None and fit.cause.of_arm]
    if told and not arm:
        return dataclasses.replace(_of(prior, told[0]), contradicted=True, causes=causes, apart=apart)
    # What the arm's angles may be wrong by is an error of this session. The clock of the cameras depends on no zero.
    wrong, last = np.zeros((len(sizes), len(arm) + 1)), len(sizes) - 1
    for k, fit in enumerate(arm):
        wrong[fit.columns[0], k] = fit.solution[fit.columns[0]]
    shift = prior.shift
    if told:
        shift, wrong[last, -1] = shift + told[0].solution[last] * np.eye(len(sizes))[last], np.sqrt(told[0].covariance[last, last])
    factor = np.column_stack([prior.factor, wrong])
    factor = factor[:, factor.any(axis=0)]
    return dataclasses.replace(prior, shift=shift, factor=factor, contradicted=True, causes=causes, apart=apart)


@dataclass(frozen=True)
class Cause:
    """A single error that explains why the path of the handle contradicts the markers.

    Attributes
    ----------
    what : str
    size, std : tuple of float
        As the channel shows it [rad], or along y and z [m].
    of_arm : bool
        Whether it is one of the measured angles of the arm.
    columns : tuple of int
        Where it stands among the errors that are fitted.
    """

    what: str
    of_arm: bool
    columns: tuple[int, ...]
    size: tuple[float, ...] = ()
    std: tuple[float, ...] = ()

    def __str__(self) -> str:
        if len(self.size) == 1:
            return f"{self.what} that is off by {np.degrees(self.size[0]):+.1f} ± {np.degrees(self.std[0]):.1f}°"
        return f"{self.what} that is off by {1e3 * self.size[0]:+.0f} mm forward and {1e3 * self.size[1]:+.0f} mm up"


def _causes(n: int, free: int) -> list[Cause]:
    """Return what may be wrong besides the `free` errors of markers: they are followed by place, compliance and zeros of the robot."""
    zeros = [Cause(f"a zero of q{j + 1}", True, (4 * n + 2 + j,)) for j in range(n)]
    zeros += [Cause(f"a zero of qr{j + 1}", False, (free + 4 + j,)) for j in range(2)]
    return [*zeros, Cause("a place of the first joint relative to the robot", False, (free, free + 1))]


@dataclass(frozen=True, eq=False)
class _Fit:
    """A fit of errors to the path, with one cause more; `cost` is minus twice the log-likelihood, with the prior."""

    cause: Cause | None
    solution: np.ndarray
    covariance: np.ndarray
    sizes: np.ndarray
    cost: float

    @property
    def columns(self) -> tuple[int, ...]:
        return () if self.cause is None else self.cause.columns

    @property
    def possible(self) -> bool:
        """Whether misplaced markers can be what remains besides the cause."""
        relative = np.abs(self.solution[: len(self.sizes)]) / np.where(self.sizes > 0.0, self.sizes, np.inf)
        relative[[k for k in self.columns if k < len(self.sizes)]] = 0.0
        return bool(relative.max() <= _FURTHEST)

    def named(self) -> Cause:
        """Return the cause with its size."""
        assert self.cause is not None
        own = list(self.columns)
        sizes, stds = self.solution[own], np.sqrt(np.diag(self.covariance)[own])
        sign = -1.0 if len(own) == 2 else 1.0  # the hand of the markers is ahead where the first joint is behind
        return dataclasses.replace(self.cause, size=tuple(map(float, sign * sizes)), std=tuple(map(float, stds)))


def _of(prior: JointCentres, fit: _Fit) -> JointCentres:
    free = len(fit.sizes)
    spread, axes = np.linalg.eigh(fit.covariance[:free, :free])
    return JointCentres(fit.solution[:free], axes * np.sqrt(np.maximum(spread, 0.0)), prior.elongation, True)


def _sizes(dataset: Dataset, turns: np.ndarray, markers: bool) -> np.ndarray:
    """Return standard deviations: of markers along y and z or along and across segments, of skin, of constant angles, of the clock."""
    n = dataset.model.n_joints
    sizes = np.zeros(5 * n + 3)
    if markers:
        sizes[-1] = dataset.tolerance.time_delay_s
        sizes[: 2 * n + 2], sizes[2 * n + 2 : 4 * n + 2] = LENGTH_STD / np.sqrt(2.0), SKIN_STD
    by_markers = np.sum((_relative(turns) * sizes) ** 2, axis=2).mean(axis=0)
    sizes[4 * n + 2 : -1] = np.sqrt(np.maximum(Deviations.of(dataset).angle ** 2 - by_markers, 0.0))
    return sizes


def _relative(absolute: np.ndarray) -> np.ndarray:
    """Return angles relative to the segment before, joints along axis 1."""
    return np.diff(absolute, axis=1, prepend=0.0)


def _speed(trial: Trial) -> np.ndarray:
    """Return the speeds of a trial [rad/s], zero beside gaps."""
    return np.nan_to_num(np.gradient(trial.q, trial.t, axis=0), nan=0.0)


def _turns(model: Model, q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what each error does to the absolute angles [rad] and to the distances of neighbouring markers [m], (n, n_joints, n_errors).

    The first marker sits on the trunk, others on the segment that ends at them; skin carries a marker with the angle of its joint, from
    the hanging stretched arm on. The last sits at the handle, which has no skin.
    """
    n, absolute = model.n_joints, np.cumsum(q, axis=1)
    u = np.stack([np.cos(absolute), np.sin(absolute)], axis=2)
    v = np.stack([-u[:, :, 1], u[:, :, 0]], axis=2)
    frames = np.concatenate([np.tile(np.eye(2), (len(q), 1, 1, 1)), np.stack([u, v], axis=3)], axis=1)
    placed = np.zeros((len(q), n + 1, 2, 5 * n + 3))
    carried = q + 0.5 * np.pi * np.eye(1, n)
    for k in range(n + 1):
        placed[:, k, :, 2 * k : 2 * k + 2] = frames[:, k]
        if k < n:
            placed[:, k, :, 2 * (n + k) + 2 : 2 * (n + k) + 4] = frames[:, k] * carried[:, k, None, None]
    apart = np.diff(placed, axis=1)
    turns = np.einsum("tki,tkip->tkp", v, apart) / np.array([s.length for s in model.segments])[:, None]
    turns[:, :, 4 * n + 2 : -1] += np.tril(np.ones((n, n)))
    turns[:, :, -1] += np.cumsum(qd, axis=1)
    return turns, np.einsum("tki,tkip->tkp", u, apart)


def _fitted(session: tuple[Dataset, Sequence[Trial], np.ndarray, np.ndarray], cause: Cause | None = None) -> _Fit:
    """Return the most probable errors and their covariance, by least squares on the path of the handle with sizes as prior.

    `session`: data set, trials with the path, elongation and sizes of the errors. Those of the markers are followed by place, compliance
    and zeros of the robot.
    """
    dataset, trials, elongation, sizes = session
    repeats = Counter(t.configuration for t in trials)
    tolerance = dataset.tolerance
    scale = np.concatenate([sizes, [_BASE_STD] * 2, [_COMPLIANCE_STD] * 2, [0.0] * 2])
    own = [] if cause is None else list(cause.columns)
    scale[own] = _ZERO_STD if len(own) == 1 else _PLACE_STD
    scatter, solution, precision, cost = _PATH_STD, np.zeros(len(scale)), np.eye(len(scale)), 0.0
    # A wrong zero turns by degrees, which is not linear in it: the path is computed again with what is known of it.
    known = np.zeros(len(scale))
    for _ in range(_ITERATIONS):
        paths = []
        precision = np.eye(len(scale))
        moment: np.ndarray = -known / np.where(scale > 0.0, scale, 1.0)
        for trial in trials:
            beside, rows = _path(dataset.model_of(trial.configuration), trial, elongation, known)
            if len(beside):
                weight = _POSTURES / (repeats[trial.configuration] * len(beside))
                # The hand is displaced in the handle by the same in all samples of a trial.
                share = 1.0 / (1.0 + scatter**2 / (weight * len(beside) * tolerance.handle_placement_m**2 + 1e-300))
                paths.append((weight, rows * scale, beside, share))
        for weight, rows, distance, share in paths:
            mean, factor = rows.mean(axis=0), weight / scatter**2
            precision += factor * (np.einsum("tip,tiq->pq", rows, rows) - share * len(rows) * mean.T @ mean)
            moment = moment + factor * (np.einsum("tip,ti->p", rows, distance) - share * len(rows) * mean.T @ distance.mean(axis=0))
        solution = np.linalg.solve(precision, moment)
        left = [(d - rows @ solution, weight, share) for weight, rows, d, share in paths]
        count = sum(w * e.size for e, w, _ in left)
        variance = _variance(left, count)
        scatter = max(_PATH_STD, float(np.sqrt(variance)))
        cost = float(
            count * variance / scatter**2
            + 2.0 * count * np.log(scatter)
            + np.sum((solution + known / np.where(scale > 0.0, scale, 1.0)) ** 2)
        )
        known[own] += (scale * solution)[own]
    solution = np.where(np.isin(np.arange(len(scale)), own), known, scale * solution)
    return _Fit(cause, solution, scale[:, None] * np.linalg.inv(precision) * scale, sizes, cost)


def _variance(left: Sequence[tuple[np.ndarray, float, float]], count: float) -> float:
    """Return the variance of the distance in one posture [m²]: the mean over its samples, whose own noise second differences show.

    `left`: what is left of each trial, its weight, and the share of its mean that a displacement of the hand in the handle is; `count`: the
    number of independent coordinates of postures.
    """
    total = sum(w * float(np.sum((e - share * e.mean(axis=0)) ** 2)) for e, w, share in left) / max(count, 1e-300)
    seconds = [np.diff(e, 2, axis=0) for e, _, _ in left]
    noise = min(total, sum(float(np.sum(d**2)) for d in seconds) / (6.0 * max(sum(d.size for d in seconds), 1)))
    return total - noise + noise * min(1.0, count / max(sum(e.size for e, _, _ in left), 1))


def _path(model: Model, trial: Trial, elongation: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how far the hand of the markers is from that of the robot less what is known, and what errors do, (n, 2, errors) [m]."""
    assert model.robot is not None and trial.robot_q is not None and trial.force_on_arm is not None
    n, free = model.n_joints, elongation.shape[1]
    good = np.isfinite(trial.q).all(axis=1) & np.isfinite(trial.robot_q).all(axis=1) & np.isfinite(trial.force_on_arm).all(axis=1)
    there = np.flatnonzero(good)
    there = there[:: max(1, len(there) // (4 * _POSTURES))]
    q, robot_q = trial.q[there] - known[4 * n + 2 : free - 1], trial.robot_q[there] - known[free + 4 :]
    yielded = np.zeros((len(there), 2))
    if model.contact is not None:
        yielded = trial.force_on_arm[there] / np.array(model.contact.stiffness)
    turns, _ = _turns(model, q, _speed(trial)[there])
    absolute, lengths = np.cumsum(q, axis=1), np.array([s.length for s in model.segments])
    u = np.stack([np.cos(absolute), np.sin(absolute)], axis=1)
    v = np.stack([-u[:, 1], u[:, 0]], axis=1)
    own = u @ elongation + np.einsum("tik,tkp->tip", v * lengths, turns)
    arms = _turned(robot_q, np.array(model.robot.lengths))
    rows = [own, np.tile(np.eye(2), (len(q), 1, 1)), yielded[:, :, None] * np.eye(2), -arms]
    distance = hand_path(model, q) - handle_path(model.robot, robot_q) + yielded - known[free : free + 2]
    return distance, np.concatenate(rows, axis=2)


def _turned(q: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Return how a chain with angles q moves its end with each of them, (n, 2, joints) [m/rad]."""
    absolute = np.cumsum(q, axis=1)
    each = np.stack([-np.sin(absolute), np.cos(absolute)], axis=1) * lengths
    return np.asarray(np.cumsum(each[:, :, ::-1], axis=2)[:, :, ::-1])
