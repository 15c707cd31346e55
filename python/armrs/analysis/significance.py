"""Tests of several quantities together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

CHANGE_LEVEL = 0.02
"""Probability of calling any parameter of an analysis changed when none is; two analyses of a session then stay below 5 %."""


def holm(p_values: Sequence[float]) -> list[float]:
    """Return probabilities over all tests together (Holm 1979); NaN stays."""
    order = [int(k) for k in np.argsort(p_values) if np.isfinite(p_values[k])]
    adjusted, largest = [float("nan")] * len(p_values), 0.0
    for place, k in enumerate(order):
        largest = max(largest, min(1.0, (len(order) - place) * p_values[k]))
        adjusted[k] = largest
    return adjusted
