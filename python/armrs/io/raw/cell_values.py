"""Numbers and times in the cells of a text table."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from ...errors import BadInput

_CLOCK = re.compile(
    r"(?:(?P<date>\d+[-./]\d+[-./]\d+|\d+ days?)[ T])?(?:(?P<h>\d{1,2}):)?(?P<m>\d{1,2}):(?P<s>\d{1,2}(?:[.,:]\d+)?)(?:Z|[+-]\d\d:?\d\d)?"
)
"""A time of day, with a date or days before it or none: 10:15:02.020, 2026-03-14 10:15:02,020, 0 days 00:00:01, 15:02.5.

Without hours only with a fraction."""
_UNREADABLE = 0.1
"""Largest share of cells without a time in a column of times."""
_EMPTY = {"", "nan", "null", "none", "-", "--", "n/a"}


def number(cell: str) -> float | None:
    """Return the number in a cell, None where there is none.

    >>> number("1.5"), number("Frame")
    (1.5, None)
    """
    try:
        return float(cell)
    except ValueError:
        return None


def grid(rows: Sequence[Sequence[str]], width: int) -> np.ndarray:
    """Return rows of cells as numbers, shape (len(rows), width); NaN where a cell is empty or a row ends early.

    Raises
    ------
    BadInput
        For a cell that holds something else; without the file's name in it.
    """
    values = np.full((len(rows), width), np.nan)
    for k, row in enumerate(rows):
        for j, cell in enumerate(row[:width]):
            if cell.lower() in _EMPTY:
                continue
            found = number(cell)
            if found is None:
                raise BadInput(f"row {k + 1} of the numbers, cell {j + 1}", cell[:40], "a number, or an empty cell")
            values[k, j] = found
    return values


def seconds(cells: Sequence[str | None]) -> np.ndarray | None:
    """Return times of day as seconds from the first one, NaN where there is none; None where most cells are no times.

    A day begins where the date changes.

    >>> seconds(["2026-03-14 23:59:59.5", "2026-03-15 00:00:00.5"]).tolist()
    [0.0, 1.0]
    """
    found = np.full(len(cells), np.nan)
    day, before = 0, None
    for k, cell in enumerate(cells):
        match = _CLOCK.fullmatch(cell) if cell else None
        if match is None or (match["h"] is None and not re.search(r"[.,]", match["s"])):
            continue
        day += before is not None and match["date"] != before
        before = match["date"]
        second = float(re.sub(r"[,:]", ".", match["s"]))
        found[k] = 86400.0 * day + 3600.0 * int(match["h"] or 0) + 60.0 * int(match["m"]) + second
    known = np.isfinite(found)
    if known.sum() < (1.0 - _UNREADABLE) * len(cells) or not known.any():
        return None
    return np.round(found - found[known][0], 9)
