"""The passive moment of one joint against its angle, over the repeats of a movement."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import students_t

LEVEL = 0.95
"""Probability of the intervals, and one minus the level of the tests."""


_COLUMNS = (
    "rising", "falling", "elastic", "elastic_std", "elastic_systematic", "half_width", "half_width_std", "half_width_systematic",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class PassiveCurve:
    """Passive moment of one joint against its angle, over the repeats of one configuration.

    Shapes are (k,). Means and deviations stand at angles that all repeats share, where there are such, and are NaN elsewhere.

    Attributes
    ----------
    configuration : str
    joint : int
        From 1.
    repeats : int
    angle : ndarray
        Centres of the bins [rad].
    rising, falling : ndarray
        Mean moment while the angle grows and shrinks [N m].
    elastic, elastic_std : ndarray
        Mean of both directions, and its standard deviation over repeats [N m]; the deviation is NaN for a single repeat.
    half_width, half_width_std : ndarray
        Half the difference of both directions: the dissipative part [N m].
    inertial_share : float
        Root mean square of the inertial torque that was taken off, relative to that of the moment.
    bandwidth : float
        Of the movement, by `motion_direction.bandwidth` [Hz]; NaN for a joint that was only held.
    slow : bool
        Whether inertial torques are small and the bandwidth is below the cutoff of the low-pass.
    elastic_repeats, half_width_repeats : ndarray, shape (repeats, k)
        The same of every repeat [N m].
    held : ndarray, shape (repeats, n_joints)
        Mean angle of every joint in every repeat [rad].
    elastic_systematic, half_width_systematic : ndarray
        Standard deviations from the declared uncertainty of masses, lengths, angles and forces, the same error in all repeats [N m].
    elastic_errors, half_width_errors : ndarray, shape (n_errors, k)
        What each of these errors does to them, of the size of its standard deviation [N m].
    placed_errors : ndarray, shape (2, n_placed, k)
        What markers that every session places anew do to the elastic mean and to the half width, likewise [N m].
    """

    configuration: str
    joint: int
    repeats: int
    angle: np.ndarray
    rising: np.ndarray
    falling: np.ndarray
    elastic: np.ndarray
    elastic_std: np.ndarray
    half_width: np.ndarray
    half_width_std: np.ndarray
    inertial_share: float
    bandwidth: float
    slow: bool
    elastic_repeats: np.ndarray = field(repr=False)
    half_width_repeats: np.ndarray = field(repr=False)
    held: np.ndarray = field(repr=False)
    elastic_systematic: np.ndarray
    half_width_systematic: np.ndarray
    elastic_errors: np.ndarray = field(repr=False)
    half_width_errors: np.ndarray = field(repr=False)
    placed_errors: np.ndarray = field(repr=False)

    def interval(self, part: str) -> tuple[float, float]:
        """Return the interval of the mean over angles of `elastic` or `half_width`, from the scatter of the repeats [N m].

        Student's t over the repeats, on angles that all of them cover. Errors that are the same in all repeats are not in it.
        """
        return interval_of(self.means(part))

    def stiffness(self) -> np.ndarray:
        """Return the slope of the straight line through the elastic mean of every repeat [N m/rad], on angles that all of them cover."""
        angle, values = self._shared("elastic")
        return np.polyfit(angle, values.T, 1)[0] if len(angle) > 1 else np.full(len(values), np.nan)

    def placed(self) -> dict[str, float]:
        """Return the standard deviations of `half_width` [N m] and `stiffness` [N m/rad] from markers that every session places anew."""
        return self._from(self.placed_errors)

    def systematic(self) -> dict[str, float]:
        """Return the same from all errors that the repeats share: those that are declared, and the markers."""
        return self._from(np.concatenate([np.stack([self.elastic_errors, self.half_width_errors]), self.placed_errors], axis=1))

    def _from(self, errors: np.ndarray) -> dict[str, float]:
        there = np.isfinite(errors).all(axis=(0, 1))
        if there.sum() < 2:
            return {}
        elastic, half_width = errors[:, :, there]
        slopes = np.polyfit(self.angle[there], elastic.T, 1)[0]
        return {"half_width": float(np.linalg.norm(half_width.mean(axis=1))), "stiffness": float(np.linalg.norm(slopes))}

    def means(self, part: str) -> np.ndarray:
        """Return the mean of every repeat over the angles that all of them cover, none where there is no such angle."""
        _, values = self._shared(part)
        return np.asarray(values.mean(axis=1)) if values.size else np.empty(0)

    def _shared(self, part: str) -> tuple[np.ndarray, np.ndarray]:
        """Return the angles that all repeats cover, (k,), and the values there, (repeats, k)."""
        repeats = getattr(self, f"{part}_repeats")
        there = np.isfinite(repeats).all(axis=0)
        return self.angle[there], repeats[:, there]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data with units in the names."""
        there, shared = np.isfinite(self.half_width), self.systematic()
        return {
            "configuration": self.configuration,
            "joint": self.joint,
            "repeats": self.repeats,
            "inertial_share": self.inertial_share,
            "bandwidth_Hz": self.bandwidth,
            "slow": self.slow,
            "half_width_mean_Nm": float(np.mean(self.half_width[there])),
            "elastic_mean_Nm": float(np.mean(self.elastic[there])),
            "elastic_std_most_Nm": float(np.max(self.elastic_std[np.isfinite(self.elastic_std)], initial=0.0)),
            "half_width_interval_Nm": list(self.interval("half_width")),
            "elastic_interval_Nm": list(self.interval("elastic")),
            "half_width_whole_interval_Nm": list(interval_of(self.means("half_width"), shared.get("half_width", 0.0))),
            "stiffness_whole_interval_Nm_rad": list(interval_of(self.stiffness(), shared.get("stiffness", 0.0))),
            "held_deg": np.degrees(self.held.mean(axis=0)),
            "angle_deg": np.degrees(self.angle),
            **{f"{n}_Nm": getattr(self, n) for n in _COLUMNS},
        }


def interval_of(values: np.ndarray, shared: float = 0.0) -> tuple[float, float]:
    """Return the interval of the mean of repeats, with a standard deviation that they share; NaN for fewer than two."""
    if len(values) < 2:
        return (float("nan"), float("nan"))
    mean, scatter = float(values.mean()), float(values.std(ddof=1)) / np.sqrt(len(values))
    half = students_t.half_width(LEVEL, scatter, len(values) - 1, shared)
    return (mean - half, mean + half)
