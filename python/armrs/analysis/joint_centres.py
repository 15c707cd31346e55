"""Functional joint centres: where the joints are, from the path on which a robot led the hand.

Markers are placed anew in every session, some millimetres beside the joints, and skin carries them along. The robot's encoders know the
path of the handle better. While a joint turns, the hand moves on a circle about it: lengths and angles of the markers are corrected until
they put the hand on the path of the handle (least squares with the expected errors as prior; Gamage and Lasenby 2002, Ehrig et al. 2006
for markers alone). What the path does not determine keeps its prior uncertainty.
"""

from __future__ import annotations

import dataclasses
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..io.dataset import Dataset
from ..io.plausibility import hand_path, handle_path
from ..io.trial import Trial
from ..model import Model
from .uncertainty import LENGTH_STD, Deviations

SKIN_STD = 0.002
"""Standard deviation of how far skin carries a marker along and across its segment, for each radian of the next joint [m/rad]."""
_PATH_STD = 0.0002
"""Least standard deviation of the distance of hand and handle in one posture about the fit, which every session shows itself [m]."""
_POSTURES = 10
"""Independent postures of one movement, whatever its rate and its repeats: errors of this distance are alike in neighbouring ones."""
_BASE_STD = 0.01
"""Standard deviation of the place of the first joint relative to the robot [m]."""
_COMPLIANCE_STD = 0.5
"""Standard deviation of the compliance of the contact of hand and handle, relative."""
_FURTHEST = 4.0
"""Errors of markers beyond this, in their standard deviations, are errors of another kind, such as a wrong model: nothing is corrected."""
_ITERATIONS = 3
"""In which the scatter of the path about the fit is estimated."""


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
        Whether it was not, since it contradicts the markers by more than misplaced markers can.
    """

    shift: np.ndarray
    factor: np.ndarray
    elongation: np.ndarray
    found: bool
    contradicted: bool = False

    def lines(self, model: Model) -> tuple[str, ...]:
        """Return where the joints were found, for the segments of the data set; nothing where no robot shows them."""
        if self.contradicted:
            return ("Angles of arm and robot differ by more than misplaced markers explain: joint centres are those of the markers.",)
        if not self.found:
            return ()
        lengths = [f"{s.length - e:.4f} m ({-1e3 * e:+.1f} mm)" for s, e in zip(model.segments, self.elongation @ self.shift, strict=True)]
        return (f"Joint centres are those about which the robot's handle turned: lengths {', '.join(lengths)}.",)

    def applied(self, dataset: Dataset) -> Dataset:
        """Return a data set with corrected lengths and angles."""
        if not self.found:
            return dataset
        model = dataset.model
        trials = tuple(dataclasses.replace(t, q=t.q - _relative(_turns(model, t.q)[0] @ self.shift)) for t in dataset.trials)
        return dataset.replace(model=lengthened(model, -self.elongation @ self.shift), trials=trials)

    def unknown(self, model: Model, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return independent errors that remain, of one standard deviation each: of the angles along a motion and of the lengths.

        Returns
        -------
        angles : ndarray, shape (n_unknown, n, n_joints)
            [rad]
        lengths : ndarray, shape (n_unknown, n_joints)
            [m]
        """
        angles = _relative(_turns(model, q)[0] @ self.factor)
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
    turns, along = _turns(model, q)
    sizes = _sizes(dataset, turns, markers)
    prior = JointCentres(np.zeros(len(sizes)), np.diag(sizes)[:, sizes > 0.0], along.mean(axis=0), False)
    seen = [t for t in usable if t.robot_q is not None and t.base is None and t.force_on_arm is not None]
    if model.robot is None or not seen or not markers:
        return prior
    shift, covariance = _fitted(dataset, seen, prior.elongation, sizes)
    if np.abs(shift / np.where(sizes > 0.0, sizes, np.inf)).max() > _FURTHEST:
        return dataclasses.replace(prior, contradicted=True)
    spread, axes = np.linalg.eigh(covariance)
    return JointCentres(shift, axes * np.sqrt(np.maximum(spread, 0.0)), prior.elongation, True)


def _sizes(dataset: Dataset, turns: np.ndarray, markers: bool) -> np.ndarray:
    """Return standard deviations: of each marker along y and z or along and across its segment, of skin, of constant angles beyond."""
    n = dataset.model.n_joints
    sizes = np.zeros(5 * n + 2)
    if markers:
        sizes[: 2 * n + 2], sizes[2 * n + 2 : 4 * n + 2] = LENGTH_STD / np.sqrt(2.0), SKIN_STD
    by_markers = np.sum((_relative(turns) * sizes) ** 2, axis=2).mean(axis=0)
    sizes[4 * n + 2 :] = np.sqrt(np.maximum(Deviations.of(dataset).angle ** 2 - by_markers, 0.0))
    return sizes


def _relative(absolute: np.ndarray) -> np.ndarray:
    """Return angles relative to the segment before, joints along axis 1."""
    return np.diff(absolute, axis=1, prepend=0.0)


def _turns(model: Model, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return what each error does to the absolute angles [rad] and to the distances of neighbouring markers [m], (n, n_joints, n_errors).

    The first marker sits on the trunk, others on the segment that ends at them; skin carries a marker with the angle of its joint, from
    the hanging stretched arm on. The last sits at the handle, which has no skin.
    """
    n, absolute = model.n_joints, np.cumsum(q, axis=1)
    u = np.stack([np.cos(absolute), np.sin(absolute)], axis=2)
    v = np.stack([-u[:, :, 1], u[:, :, 0]], axis=2)
    frames = np.concatenate([np.tile(np.eye(2), (len(q), 1, 1, 1)), np.stack([u, v], axis=3)], axis=1)
    placed = np.zeros((len(q), n + 1, 2, 5 * n + 2))
    carried = q + 0.5 * np.pi * np.eye(1, n)
    for k in range(n + 1):
        placed[:, k, :, 2 * k : 2 * k + 2] = frames[:, k]
        if k < n:
            placed[:, k, :, 2 * (n + k) + 2 : 2 * (n + k) + 4] = frames[:, k] * carried[:, k, None, None]
    apart = np.diff(placed, axis=1)
    turns = np.einsum("tki,tkip->tkp", v, apart) / np.array([s.length for s in model.segments])[:, None]
    turns[:, :, 4 * n + 2 :] += np.tril(np.ones((n, n)))
    return turns, np.einsum("tki,tkip->tkp", u, apart)


def _fitted(dataset: Dataset, trials: Sequence[Trial], elongation: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the most probable errors and their covariance, by least squares on the path of the handle with `sizes` as prior."""
    repeats = Counter(t.configuration for t in trials)
    tolerance, free = dataset.tolerance, len(sizes)
    scale = np.concatenate([sizes, [_BASE_STD] * 2, [_COMPLIANCE_STD] * 2, [tolerance.time_delay_s]])
    paths = []
    for trial in trials:
        beside, own, others = _path(dataset.model_of(trial.configuration), trial, elongation, 4 * _POSTURES)
        if len(beside):
            weight = _POSTURES / (repeats[trial.configuration] * len(beside))
            paths.append((weight, np.concatenate([own, others], axis=2) * scale, beside))
    scatter, solution, precision = _PATH_STD, np.zeros(len(scale)), np.eye(len(scale))
    for _ in range(_ITERATIONS):
        precision, moment = np.eye(len(scale)), np.zeros_like(scale)
        # The hand is displaced in the handle by the same in all samples of a trial.
        held = [1.0 / (1.0 + scatter**2 / (weight * len(d) * tolerance.handle_placement_m**2 + 1e-300)) for weight, _, d in paths]
        for (weight, rows, distance), share in zip(paths, held, strict=True):
            mean, factor = rows.mean(axis=0), weight / scatter**2
            precision += factor * (np.einsum("tip,tiq->pq", rows, rows) - share * len(rows) * mean.T @ mean)
            moment = moment + factor * (np.einsum("tip,ti->p", rows, distance) - share * len(rows) * mean.T @ distance.mean(axis=0))
        solution = np.linalg.solve(precision, moment)
        left = [d - rows @ solution for _, rows, d in paths]
        squares = sum(w * np.sum((e - share * e.mean(axis=0)) ** 2) for (w, _, _), share, e in zip(paths, held, left, strict=True))
        scatter = max(_PATH_STD, float(np.sqrt(squares / sum(w * d.size for w, _, d in paths))))
    covariance = np.linalg.inv(precision)
    return (scale * solution)[:free], (scale[:, None] * covariance * scale)[:free, :free]


def _path(model: Model, trial: Trial, elongation: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return how far the hand of the markers is from that of the robot, (n, 2), and what errors do to it, (n, 2, errors) [m].

    Errors of the markers are the first; those of base, compliance of the contact and time of the cameras are the second.
    """
    assert model.robot is not None and trial.robot_q is not None and trial.force_on_arm is not None
    good = np.isfinite(trial.q).all(axis=1) & np.isfinite(trial.robot_q).all(axis=1) & np.isfinite(trial.force_on_arm).all(axis=1)
    there = np.flatnonzero(good)
    there = there[:: max(1, len(there) // most)]
    q = trial.q[there]
    hand = handle_path(model.robot, trial.robot_q)
    speed = np.gradient(hand, trial.t, axis=0)[there]
    yielded = np.zeros((len(there), 2))
    if model.contact is not None:
        yielded = trial.force_on_arm[there] / np.array(model.contact.stiffness)
    turns, _ = _turns(model, q)
    absolute, lengths = np.cumsum(q, axis=1), np.array([s.length for s in model.segments])
    u = np.stack([np.cos(absolute), np.sin(absolute)], axis=1)
    v = np.stack([-u[:, 1], u[:, 0]], axis=1)
    own = u @ elongation + np.einsum("tik,tkp->tip", v * lengths, turns)
    others = np.concatenate([np.tile(np.eye(2), (len(q), 1, 1)), yielded[:, :, None] * np.eye(2), speed[:, :, None]], axis=2)
    return hand_path(model, q) - hand[there] + yielded, own, others
