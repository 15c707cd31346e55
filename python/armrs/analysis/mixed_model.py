"""A linear mixed model with an intercept for each subject, by restricted maximum likelihood.

`y = X β + b_subject + e`, b normal with variance σ_b², e with σ_w² (Laird and Ware 1982). The ratio σ_b²/σ_w² is found by a search in one
dimension; everything else follows in closed form. Degrees of freedom of sums of variances are Satterthwaite's (1946).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class MixedModel:
    """What was fitted.

    Attributes
    ----------
    coefficients : ndarray, shape (p,)
    covariance : ndarray, shape (p, p)
        Of the coefficients.
    between, within : float
        Standard deviations between subjects and between sessions of one, in the unit of the values.
    subjects, samples : int
    levels : int
        Coefficients that means of subjects determine; the others are differences within subjects.
    """

    coefficients: np.ndarray
    covariance: np.ndarray
    between: float
    within: float
    subjects: int
    samples: int
    levels: int

    @property
    def between_freedom(self) -> float:
        """Degrees of freedom of what differs between subjects."""
        return max(float(self.subjects - self.levels), 1.0)

    @property
    def within_freedom(self) -> float:
        """Degrees of freedom of what differs between sessions of one subject; zero where each has one."""
        return max(float(self.samples - self.subjects - (len(self.coefficients) - self.levels)), 0.0)

    @property
    def total(self) -> float:
        """Standard deviation of a session of another subject."""
        return float(np.hypot(self.between, self.within))

    @property
    def total_freedom(self) -> float:
        """Satterthwaite's degrees of freedom of the square of `total`, from mean squares between and within subjects."""
        sessions = self.samples / self.subjects
        if self.within_freedom < 1.0:
            return self.between_freedom
        # Per session: total² = MS_between / n + MS_within (n − 1) / n.
        parts = [
            (self.between**2 + self.within**2 / sessions, self.between_freedom),
            (self.within**2 * (1.0 - 1.0 / sessions), self.within_freedom),
        ]
        bottom = sum(value**2 / freedom for value, freedom in parts)
        return float(self.total**4 / bottom) if bottom > 0.0 else self.between_freedom


def fit(values: np.ndarray, design: np.ndarray, subjects: Sequence[object]) -> MixedModel:
    """Fit values, shape (n,), with a design, shape (n, p) of full rank, and the subject of each.

    Examples
    --------
    >>> fit(np.array([1.0, 3.0, 2.0, 4.0]), np.ones((4, 1)), ["a", "b", "c", "d"]).coefficients
    array([2.5])
    """
    from scipy.optimize import minimize_scalar

    names = list(dict.fromkeys(subjects))
    member = np.array([[name == own for name in names] for own in subjects], dtype=float)
    n, p = design.shape

    def solved(ratio: float) -> tuple[np.ndarray, np.ndarray, float, float]:
        """Return coefficients, (X' V⁻¹ X)⁻¹, residual variance and the criterion at a ratio of the variances."""
        counts = member.sum(axis=0)
        shrink = ratio / (1.0 + ratio * counts)

        def inverse(columns: np.ndarray) -> np.ndarray:
            return columns - member @ (shrink[:, None] * (member.T @ columns))

        weighted = inverse(design)
        information = design.T @ weighted
        spread = np.linalg.inv(information)
        coefficients = spread @ (weighted.T @ values)
        left = values - design @ coefficients
        variance = max(float(left @ inverse(left[:, None])[:, 0]), 1e-300) / max(n - p, 1)
        determinant = float(np.sum(np.log1p(ratio * counts))) + float(np.linalg.slogdet(information)[1])
        return coefficients, spread, variance, (n - p) * float(np.log(variance)) + determinant

    ratio = 0.0
    if n > len(names):
        found = minimize_scalar(lambda log: solved(float(np.exp(log)))[3], bounds=(-12.0, 12.0), method="bounded", options={"xatol": 1e-6})
        ratio = float(np.exp(found.x)) if found.fun < solved(0.0)[3] else 0.0
    coefficients, spread, variance, _ = solved(ratio)
    counted = len(names), n, int(np.linalg.matrix_rank(member.T @ design))
    # With one session a subject, scatter between and within subjects cannot be separated.
    between, within = (1.0, 0.0) if n == len(names) else (float(np.sqrt(ratio)), 1.0)
    deviation = float(np.sqrt(variance))
    return MixedModel(coefficients, variance * spread, between * deviation, within * deviation, *counted)
