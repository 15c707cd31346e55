"""Student's t: intervals and probabilities from few repeats.

From `scipy.special`, as importing `scipy.stats` takes a second longer.
"""

from __future__ import annotations

import numpy as np


def quantile(level: float, freedom: float) -> float:
    """Return the half width of a two-sided interval in standard deviations.

    Parameters
    ----------
    level : float
        Probability of the interval.
    freedom : float
        Degrees of freedom.
    """
    from scipy.special import stdtrit

    return float(stdtrit(freedom, 0.5 + 0.5 * level))


def chance(value: float, std: float, freedom: float) -> float:
    """Return the probability of a value so far from zero, on either side, where the true one is zero."""
    from scipy.special import stdtr

    return float(2.0 * stdtr(freedom, -abs(value) / std)) if std > 0.0 else float(value == 0.0)


def half_width(level: float, scatter: float, freedom: float, known: float) -> float:
    """Return half an interval from a deviation that is estimated and one that is known, independent of each other.

    The degrees of freedom of their sum are those of Welch (1947) and Satterthwaite, as in the guide to the expression of uncertainty, G.4.
    """
    std = float(np.hypot(scatter, known))
    return std * quantile(level, freedom * (std / max(scatter, 1e-3 * std)) ** 4) if std > 0.0 else 0.0
