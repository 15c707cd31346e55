"""The estimator and the gravity compensation of the C interface, sample by sample."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from .. import _armrs, checks
from ..errors import BadInput, Text
from ..model import Model, load_model
from ..workflows.firmware import covariance_of, unknowns_of
from .settings import PRECISIONS, Settings, default_settings

STATUSES = tuple(_armrs.SAMPLE_STATUSES)
"""What may become of a sample, by the numbers of the C interface: the first three are no refusals."""


@dataclass(frozen=True)
class OnlineEstimate:
    """What is known of one unknown.

    Attributes
    ----------
    name : str
        `X1` (first moment of all from joint 1 on, as it enters gravity), `J1` (second moment), or kind and parameter of an effect.
    joint : int
        From 1.
    value, std : float
    unit : str
    decided_by : {"data", "prior", "bound"}
        Until it is "data" the value is an assumption, not a measurement.
    """

    name: str
    joint: int
    value: float
    std: float
    unit: str
    decided_by: str


@dataclass(frozen=True)
class Health:
    """How well an estimator does.

    Attributes
    ----------
    residual : tuple of float
        Usual size of the torque that the estimate does not explain, by joint [N m].
    excess : float
        How much larger the standard deviations are than the declared noise would make them; at least 1.
    age : float
        Time since a sample was last learned from [s].
    restarts : int
        How often the state was not finite, and was started anew.
    """

    residual: tuple[float, ...]
    excess: float
    age: float
    restarts: int


@dataclass(frozen=True, eq=False)
class Carried:
    """Torques that carry the arm.

    Attributes
    ----------
    torque, sd : ndarray, shape (n_joints,) or (n, n_joints)
        With standard deviations [N m]; NaN where a device gives none: the torque is not reliable, or something is not finite.
    """

    torque: np.ndarray
    sd: np.ndarray


class _Carries:
    """What carries an arm."""

    model: Model
    _inner: _armrs.OnlineEstimator | _armrs.OnlineCompensation

    def carry(self, q: ArrayLike, qd: ArrayLike | None = None) -> Carried:
        """Return the torques that carry the arm: its weight, and what its effects resist with at these speeds.

        Parameters
        ----------
        q : array_like, shape (n_joints,) or (n, n_joints)
            Angles [rad].
        qd : array_like of the same shape, optional
            Speeds [rad/s]; at rest when absent.
        """
        joints = self.model.n_joints
        angles = checks.samples("q", q, "rad")
        if angles.ndim not in (1, 2) or angles.shape[-1] != joints:
            raise BadInput("q", Text(f"an array of shape {angles.shape}"), f"({joints},) or (n, {joints})")
        speeds = np.zeros(angles.shape) if qd is None else checks.samples("qd", qd, "rad/s", shape=angles.shape)
        rows = [np.ascontiguousarray(np.atleast_2d(a)) for a in (angles, speeds)]
        torque, sd = self._inner.carry(np.zeros(len(rows[0])), *rows)
        return Carried(torque.reshape(angles.shape), sd.reshape(angles.shape))


class Estimator(_Carries):
    """The online estimator of the C interface with its bits, in the precision of its settings. `update` changes it.

    Parameters
    ----------
    model : Model or path
        Two or three segments; effects that a device cannot apply are refused by name.
    settings : Settings or float
        Those of `default_settings` for this control period, where a number is given [s].

    Examples
    --------
    >>> from armrs.demo import given_model, true_model
    >>> estimator = Estimator(given_model(true_model()), 1e-3)
    >>> estimator.update([-0.5, 0.4], force_on_arm=[0.0, 12.0])
    'settling'
    >>> estimator.update(None)
    'missing'
    """

    _inner: _armrs.OnlineEstimator

    def __init__(self, model: Model | str | os.PathLike[str], settings: Settings | float) -> None:
        self.model = checks.loaded("model", model, Model, load_model)
        if not self.model.segment_uncertainty > 0.0:
            raise BadInput(
                "segment_uncertainty", self.model.segment_uncertainty, "above 0: an arm that is known exactly leaves nothing to learn"
            )
        if not isinstance(settings, Settings):
            settings = default_settings(self.model, checks.number("settings", settings, above=0.0, unit="s"))
        self.settings = settings
        self._inner = _armrs.OnlineEstimator(_armrs.Rig(self.model), self.model.segment_uncertainty, dict(vars(settings)))

    def __repr__(self) -> str:
        by_data = sum(e.decided_by == "data" for e in self.estimates)
        return f"Estimator({self.settings.period:.6g} s; {by_data} of {len(self.estimates)} unknowns by data, age {self.health.age:.4g} s)"

    def update(
        self,
        q: ArrayLike | None,
        *,
        force_on_arm: ArrayLike = (0.0, 0.0),
        moment_on_arm: float = 0.0,
        tau: ArrayLike | None = None,
        lead: ArrayLike | None = None,
    ) -> str:
        """Take one control period in and return what became of its sample, one of `STATUSES`.

        Parameters
        ----------
        q : array_like, shape (n_joints,), or None
            Angles [rad]; None where the sample is missing. NaN is a value that is none: the device refuses it.
        force_on_arm : array_like, shape (2,)
            At the tip, y and z [N].
        moment_on_arm : float
            There [N m].
        tau, lead : array_like, shape (n_joints,), optional
            Torques of motors [N m]; angles from which speeds are taken [rad].
        """
        shape = (self.model.n_joints,)
        row = partial(checks.samples, shape=shape)
        angles = np.full(shape, np.nan) if q is None else row("q", q, "rad")
        torque = np.zeros(shape) if tau is None else row("tau", tau, "N m")
        force = checks.samples("force_on_arm", force_on_arm, "N", shape=(2,))
        moment = checks.samples("moment_on_arm", moment_on_arm, "N m", shape=())
        hand = np.array([[*force, float(moment)]])
        ahead = None if lead is None else np.atleast_2d(row("lead", lead, "rad")).copy()
        told = self.run(np.zeros(1), np.atleast_2d(angles).copy(), np.atleast_2d(torque).copy(), hand, ahead, np.array([q is None]), 2)
        return STATUSES[int(told["status"][0])]

    def run(
        self,
        t: np.ndarray,
        q: np.ndarray,
        tau: np.ndarray,
        hand: np.ndarray,
        lead: np.ndarray | None,
        missing: np.ndarray,
        every: int,
    ) -> _armrs._Replayed:
        """Take many control periods in, as `replay` lays them out, and return the state after every so many of them."""
        return self._inner.run((t, q, tau, hand, missing), lead, every)

    @property
    def estimates(self) -> tuple[OnlineEstimate, ...]:
        """What is known now of every unknown in use."""
        found = zip(unknowns_of(self.model), self._inner.estimates(), strict=True)
        return tuple(OnlineEstimate(name, joint, value, std, unit, by) for (name, joint, unit), (value, std, by) in found)

    @property
    def health(self) -> Health:
        """How well it does: limit the support, or end it, by these."""
        residual, excess, age, restarts = self._inner.health()
        return Health(tuple(residual), excess, age, restarts)


class Compensation(_Carries):
    """Compensation of an identified arm on a device without an estimator: `armrs_compensation` as `armrs export-c` fills it.

    Parameters
    ----------
    model : Model or path
        As identified.
    identified : path, optional
        `identified.json`, for standard deviations and correlations; without it those of the segments follow from `segment_uncertainty`,
        and effects count as exact.
    precision : {"double", "single"}
        In which the device computes.
    """

    _inner: _armrs.OnlineCompensation

    def __init__(
        self,
        model: Model | str | os.PathLike[str],
        identified: str | os.PathLike[str] | None = None,
        *,
        precision: str = "double",
    ) -> None:
        checks.choice("precision", precision, PRECISIONS)
        self.model = checks.loaded("model", model, Model, load_model)
        covariance = covariance_of(self.model, identified).tolist()
        self._inner = _armrs.OnlineCompensation(_armrs.Rig(self.model), covariance, precision)

    def __repr__(self) -> str:
        return f"Compensation({self.model.n_joints} joints)"
