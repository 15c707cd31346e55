"""Uncertainty of passive moments due to masses, lengths, angles and forces (appendix A of the thesis): Jacobian and Monte Carlo."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .. import _armrs
from ..io.dataset import Dataset
from ..model import Model

LENGTH_STD = 0.002
"""Standard deviation of a segment's length from markers above its joints [m]."""
_STEP = 1e-4
"""Step of the difference quotients, in standard deviations of each quantity."""


@dataclass(frozen=True)
class Deviations:
    """Standard deviations of what the moments are computed from; each is the same error in every sample.

    Attributes
    ----------
    segment : float
        Of each mass and of each centre of mass, relative.
    length : float
        Of each segment [m].
    angle : float
        Of the offset of each joint angle [rad].
    bias : float
        Of the bias of each force channel [N].
    gain : float
        Of the gain of each force channel, relative.
    """

    segment: float
    length: float
    angle: float
    bias: float
    gain: float

    @classmethod
    def of(cls, dataset: Dataset) -> Deviations:
        """Return what a data set declares of its model and its calibration."""
        tolerance = dataset.tolerance
        return cls(dataset.model.segment_uncertainty, LENGTH_STD, tolerance.angle_offset, tolerance.force_bias_N, tolerance.force_gain)

    def vector(self, n: int) -> np.ndarray:
        """Return one deviation for each quantity that `moments` takes, for an arm of n joints."""
        return np.repeat([self.segment, self.segment, self.length, self.angle, self.bias, self.gain], [n, n, n, n, 2, 2])


def moments(model: Model, q: np.ndarray, force: np.ndarray | None, errors: np.ndarray) -> np.ndarray:
    """Return the passive moments of a still arm with small errors in what they are computed from.

    Parameters
    ----------
    model : Model
    q : ndarray, shape (n, n_joints)
        [rad]
    force : ndarray, shape (n, 2), or None
        Force on the arm [N].
    errors : ndarray
        In the order of `Deviations.vector`.

    Returns
    -------
    ndarray, shape (n, n_joints)
        `J(q)^T F - G(q)` [N m].
    """
    n = model.n_joints
    mass, com, length, angle, bias, gain = np.split(errors, np.cumsum([n, n, n, n, 2]))
    s = model.segments
    arm = _armrs.Arm(
        [a.length + e for a, e in zip(s, length, strict=True)],
        [a.mass * (1.0 + e) for a, e in zip(s, mass, strict=True)],
        [a.com * (1.0 + e) for a, e in zip(s, com, strict=True)],
        [a.inertia for a in s],
        com_normals=[a.com_normal for a in s],
        gravity=model.gravity,
    )
    moved = q + angle
    torque = -arm.gravity(moved)
    return torque if force is None else torque + arm.static_torque(moved, force * (1.0 + gain) + bias)


def sensitivity(model: Model, q: np.ndarray, force: np.ndarray | None, deviations: Deviations) -> np.ndarray:
    """Return the moments' derivatives to each error, times its deviation, shape (n_errors, n, n_joints) [N m]."""
    sizes = deviations.vector(model.n_joints)
    rows = []
    for k, size in enumerate(sizes):
        step = np.zeros(len(sizes))
        step[k] = _STEP * size
        rows.append((moments(model, q, force, step) - moments(model, q, force, -step)) / (2.0 * _STEP))
    return np.array(rows)


def angle_errors(model: Model, q: np.ndarray, deviations: Deviations, *, markers: bool) -> np.ndarray:
    """Return what errors of one standard deviation do to the angles along a motion, shape (n_errors, n, n_joints) [rad].

    A marker that sits beside its joint by `LENGTH_STD` along y or z turns the line to the next one by `(cos θ δz − sin θ δy) / length`,
    θ the angle of the segment from +Y: it misreads speeds as well as angles. What the declared offset of an angle has beyond that is
    constant.
    """
    absolute, n = np.cumsum(q, axis=1), model.n_joints
    errors = np.zeros((3 * n, *q.shape))
    for k, segment in enumerate(model.segments if markers else ()):
        for row, turned in ((2 * k, -np.sin(absolute[:, k])), (2 * k + 1, np.cos(absolute[:, k]))):
            errors[row, :, k] = turned * LENGTH_STD / segment.length
            if k + 1 < n:
                errors[row, :, k + 1] = -errors[row, :, k]
    beyond = np.sqrt(np.maximum(deviations.angle**2 - np.sum(errors**2, axis=0).mean(axis=0), 0.0))
    errors[2 * n :] = (beyond * np.eye(n))[:, None]
    return errors


def placements(
    model: Model, q: np.ndarray, force: np.ndarray | None, deviations: Deviations, declared: np.ndarray, spring: tuple[int, float]
) -> np.ndarray:
    """Return the effect of misplaced markers on the moment of a joint at the angles from them, shape (4 n_joints, n) [N m].

    Lengths and angles follow from markers. A misread angle also moves the moment to another angle, by the slope of the moment.

    Parameters
    ----------
    model, q, force, deviations
        As for `sensitivity`.
    declared : ndarray
        What that returned.
    spring : (int, float)
        The joint, from 0, and the slope of its moment [N m/rad].
    """
    joint, stiffness = spring
    n, none = model.n_joints, np.zeros(len(declared))
    turned = angle_errors(model, q, deviations, markers=force is not None)
    here = moments(model, q, force, none)[:, joint]
    misread = [here - moments(model, q - e, force, none)[:, joint] - stiffness * e[:, joint] for e in turned]
    return np.concatenate([declared[2 * n : 3 * n, :, joint], misread])


def by_jacobian(parts: np.ndarray) -> np.ndarray:
    """Return standard deviations from derivatives times deviations, which stand along axis 0."""
    return np.sqrt(np.sum(parts**2, axis=0))


def by_monte_carlo(
    model: Model, q: np.ndarray, force: np.ndarray | None, deviations: Deviations, *, draws: int, seed: int,
    reduce: Callable[[np.ndarray], np.ndarray] = lambda moment: moment,
) -> np.ndarray:  # fmt: skip
    """Return standard deviations of `reduce(moments)` over errors drawn from normal distributions."""
    sizes = deviations.vector(model.n_joints)
    random = np.random.default_rng(seed)
    values = [reduce(moments(model, q, force, sizes * random.standard_normal(len(sizes)))) for _ in range(draws)]
    return np.std(values, axis=0, ddof=1)
