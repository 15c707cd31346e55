"""Settings of the estimator: `armrs_settings` of the C interface."""

from __future__ import annotations

import dataclasses
import os
from dataclasses import dataclass
from typing import Any

from .. import _armrs, checks
from ..errors import unknown_name
from ..model import Model, load_model

PerJoint = tuple[float, ...]
PRECISIONS = ("double", "single")
"""Of the libraries for C."""


@dataclass(frozen=True)
class Settings:
    """How an estimator works; `default_settings` fills all of it for an arm. An infinite value switches a guard off.

    Attributes
    ----------
    period : float
        Control period [s].
    cutoff : float
        Of the low-pass from which speeds and accelerations come [Hz].
    window : float
        Time over which the equation of motion is averaged before it counts [s].
    noise : tuple of float
        Standard deviation of such an average, by joint [N m].
    dead_band : float
        Speed below which a joint counts as at rest [rad/s].
    range : tuple of (float, float)
        Smallest and largest angle of each joint [rad]; beyond it a sample is refused.
    fastest : float
        Fastest that a joint can move [rad/s].
    steepest : float
        Fastest that a force [N/s] or torque [N m/s] can change.
    largest_force, largest_torque : float
        At the hand [N]; in a joint, and moment at the hand [N m].
    gate : float
        Unexplained torques beyond this many times the usual ones are not learned from.
    frozen_after : float
        How long a sensor may show the same bits while the arm moves [s].
    envelope : tuple of float
        Farthest that the carrying torque may be from that of the arm as given, by joint [N m].
    forgetting : float
        Time in which what was learned fades while the arm moves [s].
    precision : {"double", "single"}
        In which the device computes.
    """

    period: float
    cutoff: float
    window: float
    noise: PerJoint
    dead_band: float
    range: tuple[tuple[float, float], ...]
    fastest: float
    steepest: float
    largest_force: float
    largest_torque: float
    gate: float
    frozen_after: float
    envelope: PerJoint
    forgetting: float
    precision: str = "double"

    def __post_init__(self) -> None:
        checks.choice("precision", self.precision, PRECISIONS)
        numbers = ("period", "cutoff", "window", "dead_band", "fastest", "steepest", "largest_force", "largest_torque", "gate")
        for name in (*numbers, "frozen_after", "forgetting"):
            value = checks.samples(name, getattr(self, name), shape=())
            object.__setattr__(self, name, float(value))
        for name in ("noise", "envelope"):
            object.__setattr__(self, name, tuple(checks.samples(name, getattr(self, name), shape=(None,)).tolist()))
        pairs = checks.samples("range", self.range, shape=(None, 2))
        object.__setattr__(self, "range", tuple((low, high) for low, high in pairs.tolist()))

    def replace(self, **changes: Any) -> Settings:
        """Return the settings with some of them changed; a name that is none is refused with the nearest known one."""
        known = [f.name for f in dataclasses.fields(self)]
        for name in changes:
            if name not in known:
                raise unknown_name("settings", name, known)
        return dataclasses.replace(self, **changes)


def default_settings(model: Model | str | os.PathLike[str], period: float, precision: str = "double") -> Settings:
    """Return the settings that `armrs_estimator_settings` gives for an arm and a control period: every guard is on.

    Parameters
    ----------
    model : Model or path
        Two or three segments.
    period : float
        Control period [s].
    precision : {"double", "single"}
        In which the device computes: "single" for a Cortex-M4F, with the bits that it has.

    Examples
    --------
    >>> from armrs.demo import true_model
    >>> default_settings(true_model(), period=1e-3).gate
    8.0
    """
    loaded = checks.loaded("model", model, Model, load_model)
    period = checks.number("period", period, above=0.0, unit="s")
    checks.choice("precision", precision, PRECISIONS)
    told = _armrs.online_settings(_armrs.Rig(loaded), period, precision)
    return Settings(**told, precision=precision)  # type: ignore[arg-type]
