"""Cleaning of a raw table: one clock, no rows without a time, no codes for missing values."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ...io.raw import RawColumn, RawTable
from .column_guess import symbol_of

_CODES = (999.0, 9999.0, 99999.0, 999999.0, 9999.99, 32768.0, 1e10)
"""Magnitudes by which recorders mark a missing value."""
_FAR = 3.0
"""Such a value is so many times as large as every other of its column."""
_JUMP = 10.0
"""An angle that was lost jumps to zero by so many times the largest of its other steps."""


def cleaned(table: RawTable, rate: float | None, notes: list[str]) -> Iterator[RawTable]:
    """Give the tables in a table, one for each of its clocks, without rows that are no samples; what is left out is added to `notes`.

    Parameters
    ----------
    table : RawTable
    rate : float or None
        Sample rate of a table without a column of time [Hz].
    notes : list of str
    """
    if rate is not None and table.columns and not _clocks(table):
        time = RawColumn("time", "time", "s", np.arange(table.n_rows) / rate)
        table = replace(table, columns=(time, *table.columns))
        notes.append(f"time: samples at {rate:g} Hz, as stated: {table.path}")
    for part in _by_clock(table, notes):
        yield _without_codes(_with_times(part, notes), notes)


def _clocks(table: RawTable) -> list[int]:
    return [k for k, c in enumerate(table.columns) if symbol_of(c) == "t"]


def _by_clock(table: RawTable, notes: list[str]) -> list[RawTable]:
    """Return a table for each column of time: two devices side by side, each with its own."""
    starts = _clocks(table)
    if len(starts) < 2 or starts[0] != 0 or any(b - a < 2 for a, b in pairwise(starts)):
        return [table]
    notes.append(f"{len(starts)} columns of time, each with the columns after it: {table.path}")
    parts = []
    for a, b in zip(starts, [*starts[1:], len(table.columns)], strict=True):
        own = table.columns[a:b]
        forces = any((symbol_of(c) or "").startswith("F") for c in own)
        title = f"{table.title} {'force' if forces else a}" if a else table.title
        parts.append(replace(table, columns=own, title=title, remarks=() if a else table.remarks))
    return parts


def _with_times(table: RawTable, notes: list[str]) -> RawTable:
    """Return a table without rows that have no time, such as means below the samples, and without rows that are there twice."""
    clocks = _clocks(table)
    if not clocks:
        return table
    t = table.columns[clocks[0]].values
    timed = np.isfinite(t)
    every = np.column_stack([c.values for c in table.columns])
    rows, lost = every[timed], np.isfinite(every[~timed]).any(axis=1)
    same = np.zeros(len(rows), dtype=bool)
    if len(rows) > 1:
        same[1:] = ((rows[1:] == rows[:-1]) | (np.isnan(rows[1:]) & np.isnan(rows[:-1]))).all(axis=1)
    if same.sum() > 0.5 * len(same):  # a clock that stands still is another fault
        same[:] = False
    said = (
        (int(lost.sum()), "without a time", "without a time"),
        (int(same.sum()), "that repeat the row before", "that repeats the row before"),
    )
    for count, what, one in said:
        if count:
            notes.append(f"left out: {count} row{'s' * (count > 1)} {what if count > 1 else one}: {table.path}")
    if timed.all() and not same.any():
        return table
    kept = rows[~same]
    place = np.minimum(np.searchsorted(np.flatnonzero(timed)[~same], [remark.row for remark in table.remarks]), len(kept) - 1)
    return replace(
        table,
        columns=tuple(replace(c, values=kept[:, k].copy()) for k, c in enumerate(table.columns)),
        remarks=tuple(replace(remark, row=int(row)) for remark, row in zip(table.remarks, place, strict=True)),
    )


def _without_codes(table: RawTable, notes: list[str]) -> RawTable:
    """Return a table in which codes for missing values, such as -9999, are empty, and so are angles that were lost at zero."""
    columns = []
    for c in table.columns:
        symbol, cells = symbol_of(c) or "", c.values
        coded = np.isin(np.abs(cells), _CODES)
        others = np.abs(cells[np.isfinite(cells) & ~coded])
        if not (others.size and coded.any() and _FAR * float(others.max()) < float(np.abs(cells[coded]).min())):
            coded = _lost(cells) if symbol.startswith("q") else np.zeros(len(cells), dtype=bool)
        if coded.any() and symbol != "t":
            notes.append(f"{c.name}: {cells[coded][0]:g} counts as missing, {int(coded.sum())} times: {table.path}")
            cells = np.where(coded, np.nan, cells)
        columns.append(replace(c, values=cells))
    return replace(table, columns=tuple(columns))


def _lost(cells: np.ndarray) -> np.ndarray:
    """Return where values are exactly zero between jumps, as of a sensor or a marker that was lost.

    >>> _lost(np.array([1.0, 1.01, 0.0, 0.0, 1.02, 1.03])).tolist()
    [False, False, True, True, False, False]
    """
    zero = cells == 0.0
    steps = np.abs(np.diff(cells))
    border = np.diff(zero.astype(int)) != 0
    usual = float(np.nanmax(steps[~border], initial=0.0))
    jumps = border & (steps > _JUMP * usual)
    return zero if usual > 0.0 and border.any() and bool((jumps == border).all()) else np.zeros(len(cells), dtype=bool)
