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


def placements(
    model: Model, q: np.ndarray, force: np.ndarray | None, unknown: tuple[np.ndarray, np.ndarray], spring: tuple[int, float]
) -> np.ndarray:
    """Return the effect of misplaced markers on the moment of a joint at the angles from them, shape (n_errors, n) [N m].

    Lengths and angles follow from markers. A misread angle also moves the moment to another angle, by the slope of the moment.

    Parameters
    ----------
    model, q, force
        As for `moments`.
    unknown : (ndarray, ndarray)
        Errors of angles, (n_errors, n, n_joints) [rad], and of lengths, (n_errors, n_joints) [m], of one standard deviation.
    spring : (int, float)
        The joint, from 0, and the slope of its moment [N m/rad].
    """
    joint, stiffness = spring
    n = model.n_joints
    exact = np.zeros(4 * n + 4)
    here = moments(model, q, force, exact)[:, joint]
    found = []
    for turned, longer in zip(*unknown, strict=True):
        true = exact.copy()
        true[2 * n : 3 * n] = -longer
        found.append(here - moments(model, q - turned, force, true)[:, joint] - stiffness * turned[:, joint])
    return np.array(found).reshape(-1, len(q))


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
