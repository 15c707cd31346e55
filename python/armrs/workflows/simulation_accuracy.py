"""Accuracy of a simulated run: its energy balance, and comparison with the same run at half the step."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .. import _armrs

WARNED = 1e-3
"""Share from which an error is warned of."""
WRONG = 1e-2
"""Share from which a run is no result: exit status 1."""
_ROUNDING = 1e-10
"""Share of the largest energy below which an error is rounding."""


class Piece(Protocol):
    """The part of a piece of a simulated run that accuracy is estimated from; see `armrs.Simulated`."""

    @property
    def columns(self) -> Mapping[str, np.ndarray]:
        """Every column by its name, energies and works among them."""

    @property
    def q(self) -> np.ndarray:
        """Joint angles [rad], shape (n_samples, n_joints)."""

    @property
    def force_on_arm(self) -> np.ndarray:
        """Contact force [N], shape (n_samples, 2)."""


@dataclass(frozen=True)
class EnergyBalance:
    """Energy that nothing explains, beside what was exchanged.

    Attributes
    ----------
    error : float
        Largest change of stored energy less the work that explains it [J].
    exchanged : float
        Sum of what every work and the kinetic energy changed by from sample to sample [J].
    stored : float
        Largest energy of any kind [J]; an error of 1e-10 of it is rounding.
    """

    error: float
    exchanged: float
    stored: float

    @property
    def share(self) -> float:
        """Error as a share of what was exchanged."""
        if self.error <= _ROUNDING * self.stored:
            return 0.0
        return self.error / self.exchanged if self.exchanged > 0.0 else np.inf

    @property
    def warnings(self) -> tuple[str, ...]:
        """A line from 0.1 % on."""
        if self.share < WARNED:
            return ()
        return (
            f"the run does not account for {self.error:.2g} J of the {self.exchanged:.3g} J that were exchanged ({_percent(self.share)}): "
            f"{'its numbers are wrong, take' if self.share >= WRONG else 'take'} a shorter step",
        )


def energy_balance(pieces: Iterable[Piece]) -> EnergyBalance:
    """Return the energy balance of a run from its pieces, in order."""
    error = exchanged = stored = 0.0
    last: Sequence[float] | None = None
    for piece in pieces:
        off, flowed, most, last = _armrs.energy_balance(piece.columns, last)
        error, exchanged, stored = max(error, off), exchanged + flowed, max(stored, most)
    return EnergyBalance(error, exchanged, stored)


@dataclass(frozen=True)
class StepError:
    """What half the step changes.

    Attributes
    ----------
    angle : float
        Largest change of an angle [rad].
    angle_share : float
        The same as a share of the range of that joint, which counts as 0.01 rad at least.
    force : float
        Largest change of the force on the arm [N].
    force_share : float
        The same as a share of the largest force, which counts as 0.1 N at least.
    """

    angle: float
    angle_share: float
    force: float
    force_share: float

    @property
    def share(self) -> float:
        """The larger share."""
        return max(self.angle_share, self.force_share)

    @property
    def warnings(self) -> tuple[str, ...]:
        """A line from 0.1 % on."""
        if self.share < WARNED:
            return ()
        return (
            f"with half the step angles change by up to {np.degrees(self.angle):.2g}° and the force by up to {self.force:.2g} N "
            f"({_percent(self.share)}): take a shorter step",
        )


def step_error(pieces: Iterable[Piece], halved: Iterable[Piece]) -> StepError:
    """Compare a run with the same run at half the step, sample by sample.

    Parameters
    ----------
    pieces, halved : iterable of Piece
        Of equal lengths, as `Simulated.pieces` gives them.
    """
    angle = force = largest = 0.0
    low = high = change = None
    for a, b in zip(pieces, halved, strict=True):
        apart = np.abs(a.q - b.q).max(axis=0)
        change = apart if change is None else np.maximum(change, apart)
        low = a.q.min(axis=0) if low is None else np.minimum(low, a.q.min(axis=0))
        high = a.q.max(axis=0) if high is None else np.maximum(high, a.q.max(axis=0))
        angle = max(angle, float(apart.max()))
        force = max(force, float(np.hypot(*(a.force_on_arm - b.force_on_arm).T).max()))
        largest = max(largest, float(np.hypot(*b.force_on_arm.T).max()))
    assert change is not None and low is not None and high is not None
    share = float((change / np.maximum(high - low, 0.01)).max())
    return StepError(angle, share, force, force / max(largest, 0.1))


def _percent(share: float) -> str:
    return f"{100 * share:.2g} %"
