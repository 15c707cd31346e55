"""Changes between sessions, for the page for a clinician: size and certainty."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Protocol

from ..formatting import two_digits

NO_CHANGE = "no clear change"
CLEAR = ("higher", "lower")
"""How the words of a clear change begin."""
SURE = "How sure: if nothing had changed, each analysis would still report a change in 1 of 20 sessions."
EITHER_WAY = "The number behind ± is half of a 95 % interval."


class Titled(Protocol):
    """A quantity with a name and a unit."""

    @property
    def title(self) -> str:
        """For people."""

    @property
    def unit(self) -> str:
        """Of the value."""


class Row(Protocol):
    """A quantity of one joint with its trend."""

    @property
    def joint(self) -> str:
        """Name."""

    @property
    def quantity(self) -> Titled:
        """What it is."""

    @property
    def trend(self) -> str | None:
        """As in `trend`."""


def trend(change: float, either_way: float, before: float | None, *, clear: bool) -> str:
    """Describe a change: by how much, both with the digits of its uncertainty, and as a share of `before`, where that means something."""
    size = either_way if either_way > 0.0 and math.isfinite(either_way) else abs(change)
    decimals = two_digits(size) if size > 0.0 else 0
    width = f"{either_way:.{decimals}f}"
    if not clear:
        return f"{NO_CHANGE}: {change:+.{decimals}f} ± {width}".replace("-", "−")
    share = f" ({change / abs(before):+.0%})".replace("%", " %").replace("-", "−") if before else ""
    return f"{'higher' if change > 0.0 else 'lower'} by {abs(change):.{decimals}f} ± {width}{share}"


def change_lines(rows: Sequence[Row]) -> list[str]:
    """Return what changed since the session before, what did not, and how sure that is; nothing without a session before."""
    followed = [row for row in rows if row.trend is not None]
    clear = [row for row in followed if row.trend and row.trend.startswith(CLEAR)]
    lines = [f"{row.joint}: {row.quantity.title.lower()} is {_with_unit(row)}." for row in clear]
    same: dict[str, list[str]] = {}
    for row in followed:
        if row not in clear:
            same.setdefault(row.joint, []).append(row.quantity.title.lower())
    if clear:
        lines.append(SURE)
    unclear = "; ".join(f"{joint} ({', '.join(own)})" for joint, own in same.items())
    lines += [f"No clear change: {unclear}."] if same else []
    return [*lines, *([EITHER_WAY] if followed else [])]


def _with_unit(row: Row) -> str:
    told, _, share = str(row.trend).partition(" (")
    return f"{told} {row.quantity.unit}{share and f' ({share}'}"
