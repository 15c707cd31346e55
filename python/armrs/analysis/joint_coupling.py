"""How a passive moment depends on its own and on the adjacent angle, with intervals and tests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from . import students_t
from .double_exponential import NAMES, UNITS, MomentCurve, Problem, Shape, columns, derivatives

LEAST_HELD = np.radians(5.0)
"""The adjacent angle must differ by this much between configurations before a dependence on it can be determined [rad]."""
LEAST_SHARE = 0.005
"""Share of the moment, as root mean squares within trials, that ratios must change before the linear law is called insufficient: the
low-pass and the bins of angles leave up to 0.004 (virtual subjects of `scripts/check_passive.py`)."""
_SHARED = 5.0
"""Prior degrees of freedom with which the scatter of all configurations enters that of each: its own are few."""


@dataclass(frozen=True, eq=False)
class Coefficient:
    """One fitted number.

    Attributes
    ----------
    name : str
    value, std : float
    interval : (float, float)
    unit : str
    """

    name: str
    value: float
    std: float
    interval: tuple[float, float]
    unit: str


@dataclass(frozen=True, eq=False)
class Dependence:
    """The elastic moment of one joint as a function of its angle q and the adjacent angle, a from its mean.

    `R = upper·exp(k_u (q + r_u a − q_hi)) − lower·exp(−k_l (q + r_l a − q_lo)) + stiffness·(q − q_mid) + coupling·a + moment`

    Attributes
    ----------
    joint, adjacent : int
        From 1.
    coefficients : tuple of Coefficient
        upper and lower (at least 0), stiffness, upper_steepness and lower_steepness (k), upper_ratio and lower_ratio (r), coupling, moment.
        An exponential that is not needed has zeros; the ratios are zero where the linear law is enough.
    linear_p_value : float
        Of the linear law, in which both ratios are zero, against one in which they are not.
    adjacent_share : float
        By how much the law with ratios differs within trials, relative to the moment; 0 where the p value refuses nothing.
    mean_coupling : Coefficient
        The coupling of the linear law: the slope of the moment against the adjacent angle, on average over what was measured.
    range : (float, float)
        q_lo and q_hi: the angles that were measured [rad].
    adjacent_mean : float
        [rad]
    trials : int
    p_value : float
        Of the mean coupling, against a model without it.
    level : float
        Probability of the intervals; 1 − level is the level of the tests.
    residual_rms : float
        Within trials [N m].
    trial_std : float
        Of what differs from trial to trial [N m].
    freedom : float
        Degrees of freedom of the mean coupling's deviation.
    """

    joint: int
    adjacent: int
    coefficients: tuple[Coefficient, ...]
    linear_p_value: float
    adjacent_share: float
    mean_coupling: Coefficient
    range: tuple[float, float]
    adjacent_mean: float
    trials: int
    p_value: float
    level: float
    residual_rms: float
    trial_std: float
    freedom: float

    def __getitem__(self, name: str) -> Coefficient:
        return next(c for c in self.coefficients if c.name == name)

    @property
    def coupled(self) -> bool:
        """Whether the moment depends on the adjacent angle on average."""
        return self.p_value < 1.0 - self.level

    @property
    def linear(self) -> bool:
        """Whether the linear law is enough: the shape of the moment does not depend on the adjacent angle, or by less than 0.5 %."""
        return self.linear_p_value >= 1.0 - self.level or self.adjacent_share < LEAST_SHARE

    def at(self, q: np.ndarray, adjacent: np.ndarray | float) -> np.ndarray:
        """Return the moment that was fitted [N m]."""
        values, away = np.array([self[name].value for name in NAMES]), np.asarray(adjacent) - self.adjacent_mean
        own = columns(np.asarray(q), away, values, self.range) @ values[:3]
        return np.asarray(own + self["coupling"].value * away + self["moment"].value)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data with units in the names."""
        return {
            "joint": self.joint,
            "adjacent": self.adjacent,
            "coefficients": [dict(vars(c)) for c in self.coefficients],
            "linear_p_value": self.linear_p_value,
            "adjacent_share": self.adjacent_share,
            "linear": self.linear,
            "mean_coupling": dict(vars(self.mean_coupling)),
            "range_deg": np.degrees(self.range),
            "adjacent_mean_deg": float(np.degrees(self.adjacent_mean)),
            "trials": self.trials,
            "p_value": self.p_value,
            "coupled": self.coupled,
            "residual_rms_Nm": self.residual_rms,
            "trial_std_Nm": self.trial_std,
        }


@dataclass(frozen=True, eq=False)
class Coupling:
    """How much the elastic moments of two joints depend on the angle of the other, from both.

    Elastic moments come from an energy, so that ∂R_1/∂q_2 = ∂R_2/∂q_1: both joints measure the same number, on average over what was
    measured.

    Attributes
    ----------
    joints : (int, int)
        From 1.
    value, std : float
        [N m/rad]
    interval : (float, float)
    p_value : float
        Against no coupling.
    level : float
        Probability of the interval; 1 − level is the level of the test.
    """

    joints: tuple[int, int]
    value: float
    std: float
    interval: tuple[float, float]
    p_value: float
    level: float

    @property
    def coupled(self) -> bool:
        """Whether there is a coupling."""
        return self.p_value < 1.0 - self.level

    def to_dict(self) -> dict[str, Any]:
        """Return plain data with units in the names."""
        return {
            "joints": list(self.joints),
            "value_Nm_rad": self.value,
            "std_Nm_rad": self.std,
            "interval_Nm_rad": list(self.interval),
            "p_value": self.p_value,
            "coupled": self.coupled,
        }


def fit_joints(courses: Mapping[tuple[int, int], Sequence[MomentCurve]], level: float = 0.95) -> tuple[Dependence, ...]:
    """Fit the joints, each by its courses and the adjacent joint, those left out that have too few data; see `fit`.

    Ends of a range that move with the adjacent angle belong to an energy `exp(k (q + r a))`, and so to the moments of both joints. Where
    each was moved while the other was held, both are tested together: twice the smaller p value (Bonferroni) is that of either. The weight
    of an arm known to 5 % hides them in the shoulder, and not in the elbow.
    """
    told = {key: _CouplingData.of(own) for key, own in courses.items() if _enough(own)}
    alone = {key: data.beside_errors.linear_law_p_value(data.beside_errors.linear) for key, data in told.items()}
    found = []
    for (joint, adjacent), data in told.items():
        both = [alone[key] for key in ((joint, adjacent), (adjacent, joint)) if key in alone]
        found.append(_fitted(data, joint, adjacent, level, min(len(both) * min(both), 1.0)))
    return tuple(found)


def fit(courses: Sequence[MomentCurve], joint: int, adjacent: int, level: float = 0.95) -> Dependence | None:
    """Fit the dependence of an elastic moment on both angles.

    Parameters
    ----------
    courses : sequence of Course
        One a trial; trials of one configuration hold the adjacent angle alike.
    joint, adjacent : int
        From 1.
    level : float
        Probability of the intervals.

    Returns
    -------
    Dependence or None
        None where the adjacent angle hardly differs, or with fewer than four trials.

    Notes
    -----
    What differs from trial to trial (tone, the day) shifts whole courses and is far larger than the noise within one.
    So the shape is fitted within trials, each with a level of its own (`double_exponential`). The coupling is the slope of those levels
    against the adjacent angle, over trials, each configuration weighted by its scatter; Student's t tells it from the model without
    coupling, where it is zero. Ratios are fitted where the test refuses the linear law.
    """
    return next(iter(fit_joints({(joint, adjacent): courses}, level)), None)


def _enough(courses: Sequence[MomentCurve]) -> bool:
    """Whether courses are enough to determine a dependence on the adjacent angle."""
    return len(courses) >= 4 and bool(np.ptp([c.adjacent for c in courses]) >= LEAST_HELD)


@dataclass(frozen=True)
class _CouplingData:
    """Courses, their moments, and these beside what shared errors may do, where any are known."""

    courses: Sequence[MomentCurve]
    moments: Problem
    beside_errors: Problem

    @classmethod
    def of(cls, courses: Sequence[MomentCurve]) -> _CouplingData:
        moments = Problem(courses)
        return cls(courses, moments, Problem(courses, with_errors=True) if all(c.errors.size for c in courses) else moments)


def _fitted(data: _CouplingData, joint: int, adjacent: int, level: float, linear_p_value: float) -> Dependence:
    courses, problem, beside = data.courses, data.moments, data.beside_errors
    share = 0.0 if linear_p_value >= 1.0 - level else beside.share(beside.full, beside.linear)
    mean = _levels(problem, courses, problem.linear)
    shape = problem.linear if share < LEAST_SHARE else problem.full
    line = mean if shape is problem.linear else _levels(problem, courses, shape)
    return Dependence(
        joint=joint,
        adjacent=adjacent,
        coefficients=(*_coefficients(shape, len(courses), level), _coupling(line, level), _level(line, level)),
        linear_p_value=linear_p_value,
        adjacent_share=share,
        mean_coupling=_coupling(mean, level),
        range=problem.ends,
        adjacent_mean=problem.mean,
        trials=len(courses),
        p_value=students_t.chance(mean.slope, mean.slope_std, mean.freedom),
        level=level,
        residual_rms=float(np.sqrt(shape.squares / len(problem.q))),
        trial_std=line.spread,
        freedom=mean.freedom,
    )


def _levels(problem: Problem, courses: Sequence[MomentCurve], shape: Shape) -> _Line:
    """Return the line of what a shape leaves of whole trials, against the adjacent angle.

    Where a joint moves through other angles while the adjacent one is held elsewhere, its own spring changes the levels as a coupling
    does: an error of the shape is one of the slope.
    """
    away = np.array([c.adjacent for c in courses]) - problem.mean
    own = [c.moment - columns(c.angle, a, shape.values, problem.ends) @ shape.values[:3] for c, a in zip(courses, away, strict=True)]
    line = _line(away, np.array([np.mean(values) for values in own]), [c.configuration for c in courses])
    by_shape = [derivatives(c.angle, a, shape.values, problem.ends).mean(axis=0) for c, a in zip(courses, away, strict=True)]
    slope, level = (shape.deviation(shares @ np.array(by_shape)) for shares in (line.slope_shares, line.level_shares))
    return line.with_more(slope, level, _freedom(shape, len(courses)))


def _freedom(shape: Shape, count: int) -> int:
    """Return the degrees of freedom of the deviations of a shape that was fitted to so many trials."""
    return max(count - int(np.count_nonzero(shape.stds)), 1)


def _coefficients(shape: Shape, count: int, level: float) -> list[Coefficient]:
    """Return the numbers of a shape; of a steepness, the deviation is that of its logarithm times it."""
    quantile = students_t.quantile(level, _freedom(shape, count))
    stds = shape.stds * np.where(np.char.endswith(NAMES, "steepness"), shape.values, 1.0)
    return [
        Coefficient(name, float(value), float(std), shape.interval(number, quantile), unit)
        for number, (name, value, std, unit) in enumerate(zip(NAMES, shape.values, stds, UNITS, strict=True))
    ]


def _coupling(line: _Line, level: float) -> Coefficient:
    return _of_line("coupling", line.slope, line.slope_std, "N m/rad", (line.freedom, level))


def _level(line: _Line, level: float) -> Coefficient:
    return _of_line("moment", line.level, line.level_std, "N m", (line.freedom, level))


def _of_line(name: str, value: float, std: float, unit: str, known: tuple[float, float]) -> Coefficient:
    """Return a number of a line, `known` being its degrees of freedom and the probability of its interval."""
    half = students_t.quantile(known[1], known[0]) * std
    return Coefficient(name, value, std, (value - half, value + half), unit)


def together(first: Dependence, second: Dependence) -> Coupling:
    """Return the coupling of two joints that were each moved while the other was held at different angles.

    Both are weighted by variances that are estimated, which underestimates that of their mean (Meier 1953).
    """
    stds = np.array([first.mean_coupling.std, second.mean_coupling.std])
    values = np.array([first.mean_coupling.value, second.mean_coupling.value])
    known = (stds == 0.0).astype(float) if not stds.all() else stds**-2
    weights = known / known.sum()
    shares = (weights * stds) ** 2
    own = np.array([first.freedom, second.freedom])
    meier = 1.0 + 4.0 * float(np.sum(weights * (1.0 - weights) / own))
    value, std = float(weights @ values), float(np.sqrt(shares.sum() * meier))
    freedom = float(shares.sum() ** 2 / np.sum(shares**2 / own)) if std > 0.0 else first.freedom
    half = students_t.quantile(first.level, freedom) * std
    pair = (min(first.joint, second.joint), max(first.joint, second.joint))
    return Coupling(pair, value, std, (value - half, value + half), students_t.chance(value, std, freedom), first.level)


@dataclass(frozen=True)
class _Line:
    """A line through trials: slope and level at zero with deviations, scatter about it, degrees of freedom of the slope's deviation.

    The shares, (n_trials,), are what the slope and the level are of the values of the trials.
    """

    slope_shares: np.ndarray
    level_shares: np.ndarray
    slope: float
    slope_std: float
    level: float
    level_std: float
    spread: float
    freedom: float

    def with_more(self, slope: float, level: float, freedom: float) -> _Line:
        """Return the line with more deviation of slope and level, of so many degrees of freedom (Satterthwaite 1946)."""
        variances = np.array([self.slope_std, slope]) ** 2
        total = float(variances.sum())
        joined = total**2 / float(np.sum(variances**2 / np.array([self.freedom, freedom]))) if total > 0.0 else self.freedom
        return replace(self, slope_std=float(np.sqrt(total)), level_std=float(np.hypot(self.level_std, level)), freedom=joined)


def _line(x: np.ndarray, y: np.ndarray, configurations: Sequence[str]) -> _Line:
    """Fit a line to trials, of which those of one configuration scatter alike; `x` has mean zero.

    The variance of a configuration is that within it, together with that about the common line with the weight of `_SHARED` degrees
    of freedom. Estimated weights underestimate the variance of the slope: the correction is that of Meier 1953, the
    degrees of freedom are those of Satterthwaite 1946.
    """
    _, place, counts = np.unique(np.array(configurations), return_inverse=True, return_counts=True)
    at, mean = (np.bincount(place, weights=v) / counts for v in (x, y))
    own = np.bincount(place, weights=(y - mean[place]) ** 2)
    about = y - y.mean() - (x @ y / (x @ x)) * x
    common = float(about @ about) / (len(x) - 2)
    variance = (_SHARED * common + own) / (_SHARED + counts - 1)
    if common == 0.0:
        shares = x / (x @ x), np.full(len(x), 1.0 / len(x))
        return _Line(*shares, float(shares[0] @ y), 0.0, float(y.mean()), 0.0, 0.0, float(len(x) - 2))
    weights = counts / variance
    centre = float(weights @ at / weights.sum())
    part = weights * (at - centre) / float(weights @ (at - centre) ** 2)
    variances = part**2 * variance / counts
    total = float(variances.sum())
    relative = variances / total
    meier = 1.0 + 4.0 * float(np.sum(relative * (1.0 - relative) * (counts - 1) / (_SHARED + counts - 1) ** 2))
    slope, slope_variance = float(part @ mean), total * meier
    even = weights / weights.sum() - centre * part
    level = float(even @ mean)
    level_variance = 1.0 / float(weights.sum()) + centre**2 * slope_variance
    freedom = min(1.0 / float(np.sum(relative**2 / (_SHARED + counts - 1))), float(len(x) - 2))
    shares = (part / counts)[place], (even / counts)[place]
    return _Line(*shares, slope, float(np.sqrt(slope_variance)), level, float(np.sqrt(level_variance)), float(np.sqrt(common)), freedom)
