"""Remarks of an import: decisions of the readers, and remarks recorded with the samples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...io.raw import RawTable

_SHOWN = 5
"""Remarks that a line holds at most."""
_MOST_KEPT = 200
"""Remarks of a table that are kept at most: a column with more holds states."""


def said(tables: Sequence[RawTable]) -> list[str]:
    """Return the remarks on tables, each line once, with the file where it does not hold for all."""
    by_note: dict[str, list[RawTable]] = {}
    for table in tables:
        for note in (*table.notes, *_columns_of_words(table)):
            by_note.setdefault(note, []).append(table)
    lines = []
    for note, those in by_note.items():
        more = f" and {len(those) - 1} more recording{'s' * (len(those) > 2)}" if len(those) > 1 else ""
        lines.append(note if len(those) == len(tables) else f"{note}: {those[0].called}{more}")
    return lines


def _columns_of_words(table: RawTable) -> Iterator[str]:
    """Give a line for each column of words: its text, each remark once with its first sample."""
    for name in dict.fromkeys(remark.column for remark in table.remarks):
        first = {r.text: r.row + 1 for r in reversed(table.remarks) if r.column == name}
        shown = [f"{text!r} in sample {sample}" for text, sample in sorted(first.items(), key=lambda item: item[1])]
        more = f" and {len(shown) - _SHOWN} more" if len(shown) > _SHOWN else ""
        yield f"{name}, a column of words, kept as remarks: {', '.join(shown[:_SHOWN])}{more}"
    if len(table.remarks) > _MOST_KEPT:
        yield f"only the first {_MOST_KEPT} of {len(table.remarks)} remarks are kept"


def timed(table: RawTable, t: np.ndarray) -> tuple[str, ...]:
    """Return the remarks of a table with their times.

    Parameters
    ----------
    table : RawTable
    t : ndarray, shape (n_rows,)
        Time of its samples [s].
    """
    return tuple(f"{t[remark.row]:.3f} s, {remark.column}: {remark.text}" for remark in table.remarks[:_MOST_KEPT])
