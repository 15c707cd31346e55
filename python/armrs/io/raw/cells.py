"""Numbers in the cells of a text."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...errors import BadInput

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
