"""Excel workbooks: each sheet with a table of numbers is a recording."""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import ArmrsError, BadInput, Text
from .table import NoTable, RawTable, Remark, column, grouped, headed, remarks_of
from .units import unit

SUFFIXES = (".xlsx", ".xlsm")
_FEWEST = 3
_FIRST_DAY = datetime.datetime(2000, 1, 1)


def read_workbook(path: Path) -> list[RawTable]:
    """Read the sheets of a workbook that hold a table; a sheet without one is left out, and reported.

    Raises
    ------
    BadInput
        When it is no workbook, or no sheet holds a table. Without the file's name in it.
    ArmrsError
        When openpyxl, of the extra `files`, is missing.
    """
    try:
        import openpyxl
    except ImportError:
        raise ArmrsError('Excel files need openpyxl: pip install "armrs[files]"') from None
    try:
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        sheets = {sheet.title: [list(row) for row in sheet.iter_rows(values_only=True)] for sheet in book.worksheets}
        book.close()
    except Exception as error:  # openpyxl raises what zip, XML and its own parts raise
        raise BadInput("file", Text(f"no readable workbook ({error})"), "an Excel workbook (.xlsx)") from None
    tables = {title: table for title, rows in sheets.items() if (table := _table(path, rows)) is not None}
    if not tables:
        raise NoTable("file", Text(f"no table of numbers in {', '.join(sheets)}"), "a sheet with one row a sample")
    left = [repr(title) for title in sheets if title not in tables]
    said = f"{'sheets' if len(tables) > 1 else 'sheet'} {', '.join(map(repr, tables))}" + (
        f"; no table in {', '.join(left)}" if left else ""
    )
    titled = [(path.stem if len(tables) == 1 else f"{path.stem} {title}", table) for title, table in tables.items()]
    return [RawTable(path, title, table.columns, (said, *table.notes), remarks=table.remarks) for title, table in titled]


def _table(path: Path, rows: list[list[Any]]) -> RawTable | None:
    """Return the table of a sheet: the longest run of rows with two numbers or more, and the words above it."""
    numeric = [_is_sample(row) for row in rows]
    start, end = _longest(numeric)
    if end - start < _FEWEST:
        return None
    width = max(len(row) for row in rows[start:end])
    above = [row for row in rows[:start] if _named(row)]
    above = above[next((k for k, row in enumerate(above) if _named(row) >= 2), len(above)) :]
    units = [""] * width
    if len(above) > 1 and _is_units(above[-1]):
        units = _words(above.pop(), width)
    groups, names = headed([_words(row, width) for row in above], width)
    names, units = grouped(groups, names, units)
    columns = []
    remarks: list[Remark] = []
    for k, name in enumerate(names):
        cells = [row[k] if k < len(row) else None for row in rows[start:end]]
        values = np.array([_number(cell) for cell in cells])
        label = name or f"column {k + 1}"
        if np.isfinite(values).any():
            dated = any(isinstance(cell, (datetime.datetime, datetime.time, datetime.timedelta)) for cell in cells)
            # Beside the seconds since a first day a float64 keeps 0.1 µs: they are counted from the first row.
            values = np.round(values - values[np.isfinite(values)][0], 6) if dated else values
            columns.append(column(label, values, units[k].strip("[]() ") or ("s" if dated else "")))
        elif any(said := ["" if cell is None else str(cell).strip() for cell in cells]):
            remarks += remarks_of(label, said)
    return RawTable(path, path.stem, tuple(columns), remarks=tuple(remarks))


def _is_sample(row: list[Any]) -> bool:
    """Whether a row holds two numbers or more; numbers that are text count where the row begins with one."""
    if sum(isinstance(cell, (int, float)) and not isinstance(cell, bool) for cell in row) >= 2:
        return True
    filled = [_number(cell) for cell in row if cell is not None and cell != ""]
    return sum(np.isfinite(filled)) >= 2 and bool(np.isfinite(filled[0]))


def _words(row: list[Any], width: int) -> list[str]:
    return [str(row[k]).strip() if k < len(row) and row[k] is not None else "" for k in range(width)]


def _named(row: list[Any]) -> int:
    """Return the number of words in a row."""
    return sum(isinstance(cell, str) and bool(cell.strip()) for cell in row)


def _is_units(row: list[Any]) -> bool:
    cells = [str(cell).strip("[]() ") for cell in row if cell is not None and str(cell).strip("[]() ")]
    return bool(cells) and sum(unit(cell) is not None for cell in cells) >= 0.5 * len(cells)


def _number(cell: Any) -> float:
    if isinstance(cell, bool) or cell is None:
        return np.nan
    if isinstance(cell, (int, float)):
        try:
            return float(cell)
        except OverflowError:  # a whole number of a workbook has any size
            return np.inf
    if isinstance(cell, datetime.datetime):
        return (cell - _FIRST_DAY).total_seconds()
    if isinstance(cell, datetime.timedelta):
        return cell.total_seconds()
    if isinstance(cell, datetime.time):
        return 3600.0 * cell.hour + 60.0 * cell.minute + cell.second + 1e-6 * cell.microsecond
    if isinstance(cell, str):
        # A workbook of one language opened in another leaves numbers as text; of two marks, the last is the decimal one.
        decimal, other = (",", ".") if cell.rfind(",") > cell.rfind(".") else (".", ",")
        try:
            return float(cell.strip().replace(other, "" if decimal in cell else other).replace(decimal, "."))
        except ValueError:
            return np.nan
    return np.nan


def _longest(flags: list[bool]) -> tuple[int, int]:
    best = (0, 0)
    start = 0
    for index, flag in enumerate([*flags, False]):
        if not flag:
            best = max(best, (start, index), key=lambda run: run[1] - run[0])
            start = index + 1
    return best
