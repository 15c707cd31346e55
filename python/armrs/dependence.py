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
    """

    angle: np.ndarray
    moment: np.ndarray
    adjacent: float


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
    scores. The coupling is the slope of those levels against the adjacent angle, over trials: Student's t, with a deviation that allows
    for configurations that scatter more than others, and the degrees of freedom that the ends of the line leave. The model without
    coupling is the one with that slope at zero.
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
    slope, offset, spread, p_value, edge = _line(held - mean, levels, level)
    coefficients += [
        Coefficient("coupling", slope[0], slope[1], (slope[0] - edge * slope[1], slope[0] + edge * slope[1]), "N m/rad"),
        Coefficient("moment", offset[0], offset[1], (offset[0] - edge * offset[1], offset[0] + edge * offset[1]), "N m"),
    ]
    return Dependence(
        joint=joint,
        adjacent=adjacent,
        coefficients=tuple(coefficients),
        steepness=k,
        range=ends,
        adjacent_mean=mean,
        trials=len(courses),
        p_value=p_value,
        level=level,
        residual_rms=float(np.sqrt(cost / len(target))),
        trial_std=spread,
    )


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


def _line(x: np.ndarray, y: np.ndarray, level: float) -> tuple[tuple[float, float], tuple[float, float], float, float, float]:
    """Return slope and mean with deviations, the scatter about the line, the probability of the slope by chance, and the t quantile."""
    from scipy.stats import t as student

    freedom = len(x) - 2
    slope = float(x @ y / (x @ x))
    mean = float(y.mean())
    rest = y - mean - slope * x
    spread = float(np.sqrt(np.sum(rest**2) / freedom))
    # Configurations scatter differently, those at the ends may most: HC3 of MacKinnon and White 1985.
    outer = rest / (1.0 - 1.0 / len(x) - x**2 / (x @ x))
    slope_std, mean_std = float(np.sqrt(np.sum((x * outer) ** 2)) / (x @ x)), float(np.sqrt(np.sum(outer**2))) / len(x)
    # That deviation rests on the ends of the line, and so on fewer trials than there are.
    ends = min(float(freedom), float((x @ x) ** 2 / np.sum(x**4)))
    p_value = float(2.0 * student.sf(abs(slope) / slope_std, ends)) if slope_std > 0.0 else float(slope == 0.0)
    return (slope, slope_std), (mean, mean_std), spread, p_value, float(student.ppf(0.5 + 0.5 * level, ends))


def _interval(value: float, half: float, least: float | None) -> tuple[float, float]:
    low = value - half
    return (low if least is None else max(low, least), value + half)
