"""How a passive moment depends on its own and on the adjacent angle: double exponential, slope and coupling, with intervals and a test."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

LEAST_HELD = np.radians(5.0)
"""The adjacent angle must differ by this much between configurations before a dependence on it can be told [rad]."""
STEEPNESS = np.array([1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 20.0])
"""Steepnesses of the exponentials that are tried [1/rad]: its bounds and its grid."""
_NEEDED = 0.01
"""Share of the residual that exponentials must take away to be needed."""
_SHARED = 5.0
"""Degrees of freedom with which the scatter of all configurations speaks for that of each: its own are few."""


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
    """The elastic moment of one joint as a function of its angle q and the adjacent angle q_adj.

    `R = upper·exp(k (q − q_hi)) − lower·exp(−k (q − q_lo)) + stiffness·(q − q_mid) + coupling·(q_adj − q_adj_mean) + moment`

    Attributes
    ----------
    joint, adjacent : int
        From 1.
    coefficients : tuple of Coefficient
        upper and lower (at least 0), stiffness, coupling, moment.
    steepness : float
        k [1/rad]; 0 where no exponential is needed.
    range : (float, float)
        q_lo and q_hi: the angles that were measured [rad].
    adjacent_mean : float
        [rad]
    trials : int
    p_value : float
        Of the coupling, against a model without it.
    level : float
        Probability of the intervals; 1 − level is the level of the test.
    residual_rms : float
        Within trials [N m].
    trial_std : float
        Of what differs from trial to trial [N m].
    freedom : float
        Degrees of freedom of the coupling's deviation.
    """

    joint: int
    adjacent: int
    coefficients: tuple[Coefficient, ...]
    steepness: float
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
        """Whether the moment depends on the adjacent angle."""
        return self.p_value < 1.0 - self.level

    def at(self, q: np.ndarray, adjacent: np.ndarray | float) -> np.ndarray:
        """Return the moment that was fitted [N m]."""
        columns = _columns(np.asarray(q), self.steepness, self.range)
        values = [self[name].value for name in ("upper", "lower", "stiffness")]
        own = columns @ np.array(values)
        return own + self["coupling"].value * (np.asarray(adjacent) - self.adjacent_mean) + self["moment"].value

    def to_dict(self) -> dict[str, Any]:
        """Return plain data with units in the names."""
        return {
            "joint": self.joint,
            "adjacent": self.adjacent,
            "coefficients": [dict(vars(c)) for c in self.coefficients],
            "steepness_1_rad": self.steepness,
            "range_deg": np.degrees(self.range),
            "adjacent_mean_deg": float(np.degrees(self.adjacent_mean)),
            "trials": self.trials,
            "p_value": self.p_value,
            "coupled": self.coupled,
            "residual_rms_Nm": self.residual_rms,
            "trial_std_Nm": self.trial_std,
        }


@dataclass(frozen=True, eq=False)
class Course:
    """The elastic moment of one trial against the angle.

    Attributes
    ----------
    angle, moment : ndarray, shape (k,)
        [rad, N m]
    adjacent : float
        Mean of the adjacent angle [rad].
    configuration : str
        Trials of one configuration hold the adjacent angle alike, and scatter alike.
    """

    angle: np.ndarray
    moment: np.ndarray
    adjacent: float
    configuration: str


@dataclass(frozen=True, eq=False)
class Coupling:
    """How much the elastic moments of two joints depend on the angle of the other, from both.

    Elastic moments come from an energy, so that ∂R_1/∂q_2 = ∂R_2/∂q_1: both joints measure the same number.

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


def fit(courses: Sequence[Course], joint: int, adjacent: int, level: float = 0.95) -> Dependence | None:
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
    So the shape is fitted within trials, each with a level of its own, under bounds; its intervals come from the scatter of the trials'
    scores. The coupling is the slope of those levels against the adjacent angle, over trials, each configuration weighted by its scatter;
    Student's t tells it from the model without coupling, where it is zero.
    """
    from scipy.optimize import lsq_linear
    from scipy.stats import t as student

    held = np.array([c.adjacent for c in courses])
    if len(courses) < 4 or np.ptp(held) < LEAST_HELD:
        return None
    ends = (min(float(c.angle.min()) for c in courses), max(float(c.angle.max()) for c in courses))
    target = np.concatenate([c.moment - c.moment.mean() for c in courses])

    def shape(k: float) -> tuple[np.ndarray, np.ndarray, float]:
        columns = np.concatenate([_within(_columns(c.angle, k, ends)) for c in courses])
        used = [0, 1, 2] if k > 0.0 else [2]
        low = np.array([0.0, 0.0, -np.inf])[used]
        solved = lsq_linear(columns[:, used], target, bounds=(low, np.inf), method="bvls")
        x = np.zeros(3)
        x[used] = solved.x
        return columns, x, 2.0 * float(solved.cost)

    plain = shape(0.0)
    tried = [(float(k), *shape(float(k))) for k in STEEPNESS]
    best = min(tried, key=lambda item: item[3])
    # An exponential that takes nothing away is not there: its steepness would be noise.
    k, columns, x, cost = best if best[3] < (1.0 - _NEEDED) * plain[2] else (0.0, *plain)
    residual = target - columns @ x
    stds = _shape_deviations(courses, columns, residual, (x, k))
    quantile = float(student.ppf(0.5 + 0.5 * level, len(courses) - 1))
    coefficients = [
        Coefficient(name, float(value), float(std), _interval(value, quantile * std, 0.0 if name != "stiffness" else None), unit)
        for name, value, std, unit in zip(("upper", "lower", "stiffness"), x, stds, ("N m", "N m", "N m/rad"), strict=True)
    ]
    levels = np.array([np.mean(c.moment - _columns(c.angle, k, ends) @ x) for c in courses])
    mean = float(held.mean())
    line = _line(held - mean, levels, [c.configuration for c in courses])
    edge = float(student.ppf(0.5 + 0.5 * level, line.freedom))
    coefficients += [
        Coefficient(name, value, std, (value - edge * std, value + edge * std), unit)
        for name, value, std, unit in (("coupling", line.slope, line.slope_std, "N m/rad"), ("moment", line.level, line.level_std, "N m"))
    ]
    return Dependence(
        joint=joint,
        adjacent=adjacent,
        coefficients=tuple(coefficients),
        steepness=k,
        range=ends,
        adjacent_mean=mean,
        trials=len(courses),
        p_value=_chance(line.slope, line.slope_std, line.freedom),
        level=level,
        residual_rms=float(np.sqrt(cost / len(target))),
        trial_std=line.spread,
        freedom=line.freedom,
    )


def together(first: Dependence, second: Dependence) -> Coupling:
    """Return the coupling of two joints that were each moved while the other was held at different angles."""
    from scipy.stats import t as student

    stds = np.array([first["coupling"].std, second["coupling"].std])
    values = np.array([first["coupling"].value, second["coupling"].value])
    known = (stds == 0.0).astype(float) if not stds.all() else stds**-2
    weights = known / known.sum()
    shares = (weights * stds) ** 2
    value, std = float(weights @ values), float(np.sqrt(shares.sum()))
    freedom = float(shares.sum() ** 2 / np.sum(shares**2 / np.array([first.freedom, second.freedom]))) if std > 0.0 else first.freedom
    half = float(student.ppf(0.5 + 0.5 * first.level, freedom)) * std
    pair = (min(first.joint, second.joint), max(first.joint, second.joint))
    return Coupling(pair, value, std, (value - half, value + half), _chance(value, std, freedom), first.level)


def _chance(value: float, std: float, freedom: float) -> float:
    """Return the probability of a value so far from zero by chance."""
    from scipy.stats import t as student

    return float(2.0 * student.sf(abs(value) / std, freedom)) if std > 0.0 else float(value == 0.0)


def _columns(q: np.ndarray, k: float, ends: tuple[float, float]) -> np.ndarray:
    """Return the columns of upper, lower and stiffness, shape (n, 3)."""
    low, high = ends
    rises = (np.exp(k * (q - high)), -np.exp(-k * (q - low))) if k > 0.0 else (np.zeros_like(q), np.zeros_like(q))
    return np.stack([*rises, q - 0.5 * (low + high)], axis=-1)


def _within(columns: np.ndarray) -> np.ndarray:
    return columns - columns.mean(axis=0)


def _shape_deviations(courses: Sequence[Course], columns: np.ndarray, residual: np.ndarray, fitted: tuple[np.ndarray, float]) -> np.ndarray:
    """Return deviations of the shape from the scores of the trials; those at a bound count as held."""
    x, k = fitted
    free = [j for j in range(3) if x[j] > 0.0 or j == 2] if k > 0.0 else [2]
    used = columns[:, free]
    bread = np.linalg.pinv(used.T @ used)
    parts = np.split(np.arange(len(residual)), np.cumsum([len(c.angle) for c in courses])[:-1])
    scores = np.array([used[p].T @ residual[p] for p in parts])
    count = len(courses)
    covariance = bread @ (scores.T @ scores) @ bread * count / max(count - len(free), 1)
    stds = np.zeros(3)
    stds[free] = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return stds


@dataclass(frozen=True)
class _Line:
    """A line through trials: slope and level at zero with deviations, scatter about it, degrees of freedom of the slope's deviation."""

    slope: float
    slope_std: float
    level: float
    level_std: float
    spread: float
    freedom: float


def _line(x: np.ndarray, y: np.ndarray, configurations: Sequence[str]) -> _Line:
    """Fit a line to trials, of which those of one configuration scatter alike; `x` has mean zero.

    The variance of a configuration is that within it, together with that about the common line with the weight of `_SHARED` degrees
    of freedom. Weights that are estimated make the variance of the slope look too small: the correction is that of Meier 1953, the
    degrees of freedom are those of Satterthwaite 1946.
    """
    _, place, counts = np.unique(np.array(configurations), return_inverse=True, return_counts=True)
    at, mean = (np.bincount(place, weights=v) / counts for v in (x, y))
    own = np.bincount(place, weights=(y - mean[place]) ** 2)
    about = y - y.mean() - (x @ y / (x @ x)) * x
    common = float(about @ about) / (len(x) - 2)
    variance = (_SHARED * common + own) / (_SHARED + counts - 1)
    if common == 0.0:
        return _Line(float(x @ y / (x @ x)), 0.0, float(y.mean()), 0.0, 0.0, float(len(x) - 2))
    weights = counts / variance
    centre = float(weights @ at / weights.sum())
    part = weights * (at - centre) / float(weights @ (at - centre) ** 2)
    shares = part**2 * variance / counts
    total = float(shares.sum())
    relative = shares / total
    meier = 1.0 + 4.0 * float(np.sum(relative * (1.0 - relative) * (counts - 1) / (_SHARED + counts - 1) ** 2))
    slope, slope_variance = float(part @ mean), total * meier
    level = float(weights @ mean / weights.sum()) - slope * centre
    level_variance = 1.0 / float(weights.sum()) + centre**2 * slope_variance
    freedom = min(1.0 / float(np.sum(relative**2 / (_SHARED + counts - 1))), float(len(x) - 2))
    return _Line(slope, float(np.sqrt(slope_variance)), level, float(np.sqrt(level_variance)), float(np.sqrt(common)), freedom)


def _interval(value: float, half: float, least: float | None) -> tuple[float, float]:
    low = value - half
    return (low if least is None else max(low, least), value + half)
