"""The elastic moment of a joint as two exponentials and a slope; the limits of the range may shift with the adjacent angle.

`f = upper·exp(k_u (q + r_u a − q_hi)) − lower·exp(−k_l (q + r_l a − q_lo)) + stiffness·(q − q_mid)`, a the adjacent angle from its mean.
The exponentials are those of Riener and Edrich 1999, in whose exponents the adjacent angle stands; with both ratios zero they are those of
Audu and Davy 1985. That the adjacent angle moves the limits is how Hatze 1997 describes articular boundaries, to first order.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

STEEPNESS, STEEPNESS_STD = 4.1, 0.7
"""Expected steepness [1/rad] and standard deviation of its logarithm: of the seven exponentials of Riener and Edrich 1999 (hip 4.3 and 1.7,
knee 2.0, 2.8 and 8.6, ankle 4.8 and 11.2)."""
RATIO_STD = 0.6
"""Standard deviation of a ratio, whose expected value is zero: root mean square of the eight of Riener and Edrich 1999 (−0.7 to 1.3)."""
FLATTEST, STEEPEST, FARTHEST = 1.0, 20.0, 3.0
"""Bounds of a steepness [1/rad], and of the size of a ratio."""
NAMES = ("upper", "lower", "stiffness", "upper_steepness", "lower_steepness", "upper_ratio", "lower_ratio")
UNITS = ("N m", "N m", "N m/rad", "1/rad", "1/rad", "1", "1")
_STARTS, _RATIO_STARTS = (1.5, 4.1, 9.0), (0.0, -1.5, 1.5)
"""Steepnesses [1/rad] and ratios from which the fit starts."""
_NEEDED = 0.01
"""Share of the residual that exponentials must take away to be needed."""
_SIZE = 1e-9
"""An amplitude below this share of the moments' scale is at its bound of zero."""
_FLIPS = 1999
"""Random sign flips of the test of the linear law."""


@dataclass(frozen=True, eq=False)
class MomentCurve:
    """The elastic moment of one trial against the angle.

    Attributes
    ----------
    angle, moment : ndarray, shape (k,)
        [rad, N m]
    adjacent : float
        Mean of the adjacent angle [rad].
    configuration : str
        Trials of one configuration hold the adjacent angle alike, and scatter alike.
    errors : ndarray, shape (k, n_errors)
        What errors that all trials share do to the moment, each of the size of its standard deviation [N m]: a mass that is wrong has a
        weight that depends on both angles, and would be taken for a coupling. None by default.
    """

    angle: np.ndarray
    moment: np.ndarray
    adjacent: float
    configuration: str
    errors: np.ndarray = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True, eq=False)
class Shape:
    """What was fitted within trials.

    Attributes
    ----------
    values : ndarray, shape (7,)
        In the order of `NAMES`; the steepness and ratio of an exponential that is not there are zero.
    covariances : ndarray, shape (2, 7, 7)
        By leaving out one trial at a time, and by the noise with the priors; of a steepness, of its logarithm.
    squares : float
        Sum of squares that is left within trials [N² m²].
    """

    values: np.ndarray
    covariances: np.ndarray
    squares: float

    @property
    def stds(self) -> np.ndarray:
        """Standard deviations of the values, shape (7,); of a steepness, of its logarithm."""
        return np.array([self.deviation(row) for row in np.eye(7)])

    def deviation(self, slopes: np.ndarray) -> float:
        """Return the standard deviation of what depends on the values with these slopes, (7,): the larger one of both covariances."""
        return float(np.sqrt(max(*np.einsum("i,kij,j->k", slopes, self.covariances, slopes), 0.0)))

    def interval(self, number: int, quantile: float) -> tuple[float, float]:
        """Return the interval of a value, with a quantile of its distribution."""
        value, half = float(self.values[number]), quantile * float(self.stds[number])
        if number in (3, 4):
            return value * float(np.exp(-half)), value * float(np.exp(half))
        return max(value - half, 0.0) if number < 2 else value - half, value + half


class Problem:
    """Moments of trials less their means, which differ from trial to trial and do not belong to the shape.

    Where shared errors count, what they may do is taken out of moments and law alike: with `Z` what they do and `σ` the noise,
    `‖W r‖² = min_b ‖r − Z b‖² + σ² ‖b‖²`.
    """

    def __init__(self, courses: Sequence[MomentCurve], *, with_errors: bool = False) -> None:
        self.q = np.concatenate([c.angle for c in courses])
        held = np.array([c.adjacent for c in courses])
        self.mean = float(held.mean())
        self.trial = np.repeat(np.arange(len(courses)), [len(c.angle) for c in courses])
        self.adjacent = (held - self.mean)[self.trial]
        self.ends = (float(self.q.min()), float(self.q.max()))
        self.count = len(courses)
        self.seen = self._less_means(np.concatenate([c.moment for c in courses]))
        self.shared = np.empty((len(self.q), 0)), np.empty(0)
        if with_errors:
            left, sizes, _ = np.linalg.svd(self._less_means(np.concatenate([c.errors for c in courses])), full_matrices=False)
            noise = _noise(courses)
            self.shared = left, 1.0 - noise / np.sqrt(sizes**2 + noise**2)
        self.moment = self._within(self.seen)

    @cached_property
    def linear(self) -> Shape:
        """The shape with both ratios zero."""
        return self._fitted(ratios=False)

    @cached_property
    def full(self) -> Shape:
        """The shape with ratios."""
        return self._fitted(ratios=True)

    def _fitted(self, *, ratios: bool) -> Shape:
        """Fit the shape, with ratios or with both zero; without exponentials where these take too little away."""
        plain = self._shape(np.zeros(7), np.array([False, False, True, *[False] * 4]))
        starts = (self._begun(k, r) for r in (_RATIO_STARTS if ratios else (0.0,)) for k in _STARTS)
        values, variance = min((self._refined(*start, ratios) for start in starts), key=lambda found: found[1])
        values, variance = self._refined(values, variance, ratios)
        present = values[:2] > _SIZE * float(np.abs(self.moment).max(initial=0.0))
        values[:2] *= present
        free = np.array([*present, True, *present, *(present & ratios)])
        found = self._shape(np.where(free, values, 0.0), free, variance)
        # Exponentials that take nothing away are not there: their steepness would be noise.
        return found if found.squares < (1.0 - _NEEDED) * plain.squares else plain

    def linear_law_p_value(self, shape: Shape) -> float:
        """Return the probability of what a shape without ratios leaves, if that is the law.

        The test of the scores of both ratios by flipping the signs of each trial's share (Hemerik, Goeman, Finos 2020), the scores freed
        from what the other numbers explain. It needs no model of the noise, and holds where trials scatter differently. An exponential that
        is not there is tested with the expected steepness.
        """
        values = shape.values.copy()
        absent = values[:2] == 0.0
        asked = values.copy()
        asked[:2][absent], asked[3:5][absent] = 1.0, STEEPNESS
        free = np.array([*~absent, True, *~absent])
        nuisance = self._jacobian(values)[:, :5][:, free]
        wanted = self._jacobian(asked)[:, 5:]
        wanted = wanted - nuisance @ np.linalg.lstsq(nuisance, wanted, rcond=None)[0]
        shares = wanted * (self.moment - self._model(values))[:, None]
        scores = np.stack([np.bincount(self.trial, weights=column) for column in shares.T], axis=1)
        weight = np.linalg.pinv(scores.T @ scores, hermitian=True)
        signs = np.random.default_rng(1).choice((-1.0, 1.0), size=(_FLIPS, self.count))
        sums = np.concatenate([scores.sum(axis=0)[None], signs @ scores])
        sizes = np.einsum("ni,ij,nj->n", sums, weight, sums)
        return float(np.mean(sizes >= sizes[0] * (1.0 - 1e-9)))

    def _begun(self, k: float, ratio: float) -> tuple[np.ndarray, float]:
        """Return the best values with a given steepness and ratio, and the variance that they leave."""
        from scipy.optimize import lsq_linear

        values = np.array([1.0, 1.0, 1.0, k, k, ratio, ratio])
        found = lsq_linear(self._columns(values), self.moment, bounds=([0.0, 0.0, -np.inf], np.inf), method="bvls")
        return np.array([*found.x, *values[3:]]), self._variance(2.0 * float(found.cost))

    def _variance(self, squares: float) -> float:
        return max(squares / max(len(self.q) - self.count - 7, 1), 1e-300)

    def _refined(self, start: np.ndarray, variance: float, ratios: bool) -> tuple[np.ndarray, float]:
        """Return the best values near a start and the variance that they leave; their priors are included."""
        from scipy.optimize import least_squares

        sd, wide = float(np.sqrt(variance)), FARTHEST if ratios else 1e-12
        low = np.array([-1e-12, -1e-12, -np.inf, *[np.log(FLATTEST)] * 2, -wide, -wide])
        high = np.array([np.inf, np.inf, np.inf, *[np.log(STEEPEST)] * 2, wide, wide])
        middle, weight = np.array([*[np.log(STEEPNESS)] * 2, 0.0, 0.0]), sd / np.array([*[STEEPNESS_STD] * 2, *[RATIO_STD] * 2])
        x = np.clip(np.array([*start[:3], *np.log(start[3:5]), *start[5:]]), low + 1e-13, high - 1e-13)

        def rest(x: np.ndarray) -> np.ndarray:
            return np.concatenate([self._model(_natural(x)) - self.moment, weight * (x[3:] - middle)])

        def slopes(x: np.ndarray) -> np.ndarray:
            return np.concatenate([self._jacobian(_natural(x)), np.eye(4, 7, 3) * weight[:, None]])

        found = least_squares(rest, x, slopes, bounds=(low, high), x_scale="jac", xtol=1e-10, ftol=1e-10, gtol=1e-10, max_nfev=200)
        values = _natural(found.x)
        return values, self._variance(float(np.sum((self._model(values) - self.moment) ** 2)))

    def _shape(self, values: np.ndarray, free: np.ndarray, variance: float = 0.0) -> Shape:
        """Return a shape with deviations; without exponentials, the slope is fitted here."""
        if not free[:2].any():
            line = self._columns(np.zeros(7))[:, 2]
            values = np.array([0.0, 0.0, line @ self.moment / (line @ line), 0.0, 0.0, 0.0, 0.0])
        residual = self.moment - self._model(values)
        covariances = np.zeros((2, 7, 7))
        own, others = np.ix_(free, free)
        covariances[:, own, others] = self._covariances(self._jacobian(values)[:, free], residual, variance, free)
        return Shape(values, covariances, float(residual @ residual))

    def _covariances(self, jacobian: np.ndarray, residual: np.ndarray, variance: float, free: np.ndarray) -> np.ndarray:
        """Return the covariances by leaving out one trial at a time, linearised, and by the noise and the priors."""
        known = variance * np.array([0.0, 0.0, 0.0, *[STEEPNESS_STD**-2] * 2, *[RATIO_STD**-2] * 2])[free]
        scale = np.linalg.norm(jacobian, axis=0) + 1e-300
        scaled = jacobian / scale
        whole = scaled.T @ scaled + np.diag(known / scale**2)
        parts = [(scaled[own], residual[own]) for own in (self.trial == trial for trial in range(self.count))]
        inverses = np.linalg.pinv(np.array([whole - part.T @ part for part, _ in parts]), hermitian=True)
        away = np.array([inverse @ (part.T @ rest) for inverse, (part, rest) in zip(inverses, parts, strict=True)])
        moved = away - away.mean(axis=0)
        jackknife = (self.count - 1) / self.count * moved.T @ moved
        return np.stack([jackknife, variance * np.linalg.pinv(whole, hermitian=True)]) / np.outer(scale, scale)

    def _columns(self, values: np.ndarray) -> np.ndarray:
        return self._within(columns(self.q, self.adjacent, values, self.ends))

    def _model(self, values: np.ndarray) -> np.ndarray:
        return np.asarray(self._columns(values) @ values[:3])

    def _jacobian(self, values: np.ndarray) -> np.ndarray:
        """Return what `derivatives` does, as far as it counts, shape (n, 7)."""
        return self._within(derivatives(self.q, self.adjacent, values, self.ends))

    def share(self, one: Shape, other: Shape) -> float:
        """Return by how much two shapes differ beyond what shared errors may be, relative to the moments, both as root mean squares."""
        first, second = (columns(self.q, self.adjacent, s.values, self.ends) @ s.values[:3] for s in (one, other))
        return float(np.linalg.norm(self._within(first - second)) / max(float(np.linalg.norm(self.seen)), 1e-300))

    def _within(self, values: np.ndarray) -> np.ndarray:
        """Return values, (n,) or (n, m), less their mean in each trial, and less what shared errors may be."""
        table = self._less_means(values).reshape(len(values), -1)
        left, shares = self.shared
        return np.asarray((table - (left * shares) @ (left.T @ table)).reshape(values.shape))

    def _less_means(self, values: np.ndarray) -> np.ndarray:
        """Return values, (n,) or (n, m), less their mean in each trial."""
        counts = np.bincount(self.trial)
        table = values.reshape(len(values), -1)
        means = np.stack([np.bincount(self.trial, weights=column) / counts for column in table.T], axis=1)
        return np.asarray((table - means[self.trial]).reshape(values.shape))


def columns(q: np.ndarray, adjacent: np.ndarray | float, values: np.ndarray, ends: tuple[float, float]) -> np.ndarray:
    """Return what upper, lower and stiffness are multiplied with, shape (n, 3); an exponential without steepness is not there."""
    (low, high), (k_u, k_l, r_u, r_l) = ends, values[3:]
    rising = np.exp(k_u * (q + r_u * adjacent - high)) if k_u > 0.0 else np.zeros_like(q)
    falling = -np.exp(-k_l * (q + r_l * adjacent - low)) if k_l > 0.0 else np.zeros_like(q)
    return np.stack([rising, falling, q - 0.5 * (low + high)], axis=-1)


def derivatives(q: np.ndarray, adjacent: np.ndarray | float, values: np.ndarray, ends: tuple[float, float]) -> np.ndarray:
    """Return the derivatives of a shape to all values, those of a steepness to its logarithm, shape (n, 7)."""
    upper, lower, _, k_u, k_l, r_u, r_l = values
    high, low, line = columns(q, adjacent, values, ends).T
    rising, falling = upper * k_u * high, lower * k_l * -low
    own = (rising * (q + r_u * adjacent - ends[1]), falling * (q + r_l * adjacent - ends[0]))
    return np.stack([high, low, line, *own, rising * adjacent, falling * adjacent], axis=1)


def _noise(courses: Sequence[MomentCurve]) -> float:
    """Return the noise of a moment [N m]: what a polynomial of degree 4 leaves in each configuration, each trial with its level."""
    squares, freedom = 1e-300, 0
    for name in dict.fromkeys(c.configuration for c in courses):
        own = [c for c in courses if c.configuration == name]
        powers = [np.vander(c.angle - own[0].angle.mean(), 5)[:, :4] for c in own]
        design = np.concatenate([p - p.mean(axis=0) for p in powers])
        target = np.concatenate([c.moment - c.moment.mean() for c in own])
        rest = target - design @ np.linalg.lstsq(design, target, rcond=None)[0]
        squares, freedom = squares + float(rest @ rest), freedom + len(target) - len(own) - 4
    return float(np.sqrt(squares / max(freedom, 1)))


def _natural(x: np.ndarray) -> np.ndarray:
    """Return values from those whose steepnesses are logarithms."""
    return np.array([max(x[0], 0.0), max(x[1], 0.0), x[2], *np.exp(x[3:5]), *x[5:]])
