"""Residual torques of an identified model, and the part that all repeats of a movement share."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..io.trial import Trial

_POOR = 0.2
"""A residual above this share of the variation of a torque is a poor fit, where it is alike in repeats."""
_NO_FIT = 0.5
"""And above this, no fit at all."""
_SAME_MOVEMENT = 0.2
"""Repeats whose angles differ by more than this part of their variation do not show the same movement at the same time."""


@dataclass(frozen=True, eq=False)
class Explained:
    """How a fitted model explains one trial, after the common low-pass.

    Attributes
    ----------
    trial : Trial
    t : ndarray, shape (m,)
        Times of the samples that were used [s].
    measured, fitted : ndarray, shape (m, n_joints)
        Joint torques that follow from the measurement, and those of the fitted model [N m].
    """

    trial: Trial
    t: np.ndarray
    measured: np.ndarray
    fitted: np.ndarray


@dataclass(frozen=True)
class Residual:
    """What is left of a joint's torque over the fit trials, as shares of the variation of that torque.

    Attributes
    ----------
    joint : int
    share : float
        All of it.
    alike : float or None
        The part that is the same in all repeats of a movement, which the model lacks; None without repeats. The rest is noise.
    """

    joint: int
    share: float
    alike: float | None

    @property
    def lacking(self) -> float:
        """What no noise explains."""
        return self.share if self.alike is None else self.alike

    def __str__(self) -> str:
        same = "" if self.alike is None else f", {self.alike:.0%} alike in all repeats"
        return (
            f"the residual of joint {self.joint} is {self.share:.0%} of the variation of its torque{same}: the model does not describe "
            "these data"
        )


def residuals(explained: Sequence[Explained]) -> tuple[Residual, ...]:
    """Return what is left of the torque of every joint."""
    fit = [e for e in explained if e.trial.role == "fit" and len(e.measured)]  # of a short trial nothing may be left
    spread = np.std(np.concatenate([e.measured for e in fit]), axis=0)
    left = np.std(np.concatenate([e.measured - e.fitted for e in fit]), axis=0)
    products = list(_products(fit))
    alike = np.sqrt(np.maximum(np.concatenate(products).mean(axis=0), 0.0)) if products else None
    return tuple(
        Residual(j + 1, float(left[j] / spread[j]), None if alike is None else float(min(alike[j], left[j]) / spread[j]))
        for j in range(len(spread))
        if spread[j] > 0.0
    )


def _products(fit: Sequence[Explained]) -> Iterator[np.ndarray]:
    """Give the residuals of every two repeats multiplied, (m, n_joints): on average the square of what both have in common."""
    for a, b in combinations(fit, 2):
        n = min(len(a.t), len(b.t))
        if a.trial.configuration == b.trial.configuration and _same_movement(a, b, n):
            yield (a.measured - a.fitted)[:n] * (b.measured - b.fitted)[:n]


def _same_movement(a: Explained, b: Explained, n: int) -> bool:
    """Whether the first samples of two repeats were taken in the same postures."""
    first, second = (np.column_stack([np.interp(e.t[:n], e.trial.t, q) for q in e.trial.q.T]) for e in (a, b))
    known = np.isfinite(first - second).all(axis=1)
    moved = np.std(first[known], axis=0) if known.any() else np.zeros(1)
    return bool(known.any() and np.sqrt(np.mean((first - second)[known] ** 2)) <= _SAME_MOVEMENT * np.sqrt(np.mean(moved**2)))


def without_fit(left: Sequence[Residual]) -> tuple[str, ...]:
    """Return the joints whose torque is not described at all, a line each."""
    return tuple(str(one) for one in left if one.lacking > _NO_FIT)


def poor_fits(left: Sequence[Residual]) -> tuple[str, ...]:
    """Return the joints whose torque is described poorly, a line each."""
    return tuple(str(one) for one in left if _POOR < one.lacking <= _NO_FIT)
