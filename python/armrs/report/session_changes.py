"""Differences between sessions and between arms, for the page for a clinician: size and certainty."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from ..analysis.significance import CHANGE_LEVEL
from ..formatting import two_digits

NO_CHANGE, PERHAPS = "no clear change", "perhaps"
SURE = {
    what: f"How sure: if {none}, each analysis would still report a {what} in 1 of {1.0 / CHANGE_LEVEL:.0f} sessions."
    for what, none in (("change", "nothing had changed"), ("difference", "the arms did not differ"))
}
EITHER_WAY = "The number after ± is half of a 95 % interval."


@dataclass(frozen=True)
class Change:
    """A quantity of this session less that of another one, in its unit.

    Attributes
    ----------
    value, either_way : float
        The difference, and half of its 95 % interval taken alone.
    share_of : float or None
        The other value, where a share of it means something.
    clear : bool
        Whether it is beyond chance over all quantities that were compared.
    date : str
        Of the other session.
    compared : int
        Quantities that were compared together.
    own_std : float
        Standard deviation of this session's value.
    """

    value: float
    either_way: float
    share_of: float | None
    clear: bool
    date: str
    compared: int
    own_std: float

    @property
    def perhaps(self) -> bool:
        """Whether it is beyond its own interval, but not beyond chance over all quantities."""
        return not self.clear and abs(self.value) > self.either_way

    @property
    def words(self) -> str:
        """Describe it: by how much, both with the digits of its uncertainty, and as a share, where that means something."""
        return trend(self.value, self.either_way, self.share_of, clear=self.clear)


class Titled(Protocol):
    """A quantity with a name and a unit."""

    @property
    def title(self) -> str:
        """For people."""

    @property
    def unit(self) -> str:
        """Of the value."""


class Row(Protocol):
    """A quantity of one joint."""

    @property
    def joint(self) -> str:
        """Name."""

    @property
    def quantity(self) -> Titled:
        """What it is."""

    @property
    def before(self) -> Change | None:
        """What it is compared with: the session before."""


def trend(change: float, either_way: float, before: float | None, *, clear: bool) -> str:
    """Describe a change: by how much, both with the digits of its uncertainty, and as a share of `before`, where that means something."""
    size = either_way if either_way > 0.0 and math.isfinite(either_way) else abs(change)
    decimals = two_digits(size) if size > 0.0 else 0
    if abs(change) > either_way:  # what is called more than its ± must read so
        decimals = next((d for d in range(decimals, 18) if f"{abs(change):.{d}f}" != f"{either_way:.{d}f}"), decimals)
    width = f"{either_way:.{decimals}f}"
    way = "higher" if change > 0.0 else "lower"
    if not clear:
        said = f"{PERHAPS} {way}" if abs(change) > either_way else NO_CHANGE
        return f"{said}: {change:+.{decimals}f} ± {width}".replace("-", "−")
    share = f" ({change / abs(before):+.0%})".replace("%", " %").replace("-", "−") if before else ""
    return f"{way} by {abs(change):.{decimals}f} ± {width}{share}"


def change_lines(
    rows: Sequence[Row], change_of: Callable[[Row], Change | None] = lambda row: row.before, what: str = "change", than: str = ""
) -> list[str]:
    """Return what differs, what does not, and how sure that is; nothing without anything to compare with.

    `what` is the word for a difference, `than` what it is compared with, behind `higher` and `lower`.
    """
    followed = [(row, change) for row in rows if (change := change_of(row)) is not None]
    date = max((change.date for _, change in followed), default="")
    lines = []
    for row, change in followed:
        if change.clear:
            told, _, share = change.words.partition(" (")
            way, _, rest = told.partition(" by ")
            since = "" if change.date == date else f", compared with {change.date}"
            lines.append(f"{_named(row)} is {way}{than} by {rest} {row.quantity.unit}{share and f' ({share}'}{since}.")
    if lines:
        lines.append(SURE[what])
    for row, change in followed:
        if change.perhaps:
            told = change.words.partition(": ")[2]
            many = f"but {change.compared} quantities were compared, and one of them may exceed it by chance"
            lines.append(f"Perhaps: {_named(row)} {told} {row.quantity.unit}. This is more than its ±, {many}.")
    same: dict[str, list[str]] = {}
    for row, change in followed:
        if not change.clear and not change.perhaps:
            same.setdefault(row.joint, []).append(row.quantity.title.lower())
    unclear = "; ".join(f"{joint} ({', '.join(own)})" for joint, own in same.items())
    lines += [f"No clear {what}: {unclear}."] if same else []
    return [*lines, *([EITHER_WAY] if followed else [])]


def _named(row: Row) -> str:
    return f"{row.joint}: {row.quantity.title.lower()}"
