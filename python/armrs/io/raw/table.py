"""One raw table: columns as the file names them, nothing interpreted but numbers and units."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from ...errors import BadInput
from ..markers import Markers
from .units import UNITS

_IN_BRACKETS = re.compile(r"^(?P<name>.*?)\s*[\[(<]\s*(?P<unit>[^\])>]*)\s*[\])>]\s*$")
_AFTER_IN = re.compile(r"^(?P<name>.*\S)\s+in\s+(?P<unit>\S+)$", flags=re.IGNORECASE)
_SAYS_LITTLE = re.compile(r"[xyzlr]|\d+", flags=re.IGNORECASE)
"""Names that need the title of their group."""
_BEFORE_UNIT = re.compile(r"\s*[/,]\s*|[_\s]+")


class NoTable(BadInput):
    """A file that can be read and holds no table of numbers, such as notes."""

    def within(self, *, file: str | os.PathLike[str] | None = None, place: str | None = None) -> NoTable:
        """Return this error with the file, or with the table that holds the place."""
        seen = super().within(file=file, place=place)
        return NoTable(seen.place, seen.found, seen.allowed, file=seen.file, hint=seen.hint)


@dataclass(frozen=True, eq=False)
class RawColumn:
    """One column.

    Attributes
    ----------
    name : str
        As in the file, with its unit.
    label : str
        The name without its unit.
    unit : str
        As in the file; empty where none is stated.
    values : ndarray, shape (n_rows,)
        float64; NaN where the cell is empty.
    """

    name: str
    label: str
    unit: str
    values: np.ndarray


@dataclass(frozen=True)
class Remark:
    """Words that were recorded with a sample: the name of their column, the row from 0, the text."""

    column: str
    row: int
    text: str


@dataclass(frozen=True, eq=False)
class RawTable:
    """The numeric columns of one recording.

    Attributes
    ----------
    path : Path
        The file.
    title : str
        The file's name without its suffix; the sheet is appended where a workbook has several.
    columns : tuple of RawColumn
    notes : tuple of str
        What the reader decided: encoding, separator, decimal mark.
    markers : Markers or None
        Trajectories of markers, where the recording has them; the columns may be on another clock.
    remarks : tuple of Remark
        Contents of the columns of words.
    plane : ndarray, shape (2, 3), or None
        Unit vectors forward and up in the plane of the movement, in the axes of the markers, where the angles are those of markers.
    """

    path: Path
    title: str
    columns: tuple[RawColumn, ...]
    notes: tuple[str, ...] = field(default=())
    markers: Markers | None = None
    remarks: tuple[Remark, ...] = ()
    plane: np.ndarray | None = None

    @property
    def called(self) -> str:
        """The file, with the title where it holds several recordings."""
        return f"{self.path}" if self.title == self.path.stem else f"{self.path} ({self.title})"

    @property
    def n_rows(self) -> int:
        """Number of samples."""
        return len(self.columns[0].values) if self.columns else 0

    def find(self, name: str) -> RawColumn | None:
        """Return the column of this name, or else the only one that differs from it in how its unit is written: `Zeit`, `Zeit [ms]`."""
        named = next((c for c in self.columns if c.name == name), None)
        if named is not None:
            return named
        labels = {name, column(name, np.empty(0)).label}
        alike = [c for c in self.columns if labels & {c.label, column(c.name, np.empty(0)).label}]
        return alike[0] if len(alike) == 1 else None


def column(name: str, values: np.ndarray, unit: str = "") -> RawColumn:
    """Return a column; without `unit`, the unit is split off its name where one is recognised. What is infinite is missing.

    >>> [(one.label, one.unit) for one in (column(name, np.empty(0)) for name in ("Kraft / kN", "omega rad/s", "q1_deg", "Zeit [ms]"))]
    [('Kraft', 'kN'), ('omega', 'rad/s'), ('q1', 'deg'), ('Zeit', 'ms')]
    """
    text, values = " ".join(name.split()), np.where(np.isinf(values), np.nan, values)
    if unit:
        return RawColumn(name, text, unit, values)
    if match := _IN_BRACKETS.match(text):
        return RawColumn(name, match["name"], match["unit"].strip(), values)
    if (match := _AFTER_IN.match(text)) and match["unit"].lower() in UNITS:
        return RawColumn(name, match["name"], match["unit"], values)
    for match in _BEFORE_UNIT.finditer(text):  # the first that leaves a unit: deg/s, not s
        if match.start() and text[match.end() :].lower() in UNITS:
            return RawColumn(name, text[: match.start()], text[match.end() :], values)
    return RawColumn(name, text, "", values)


def headed(rows: Sequence[Sequence[str]], width: int) -> tuple[list[str], list[str]]:
    """Return groups and names of columns from the rows above the samples, each as wide as they.

    A cell over both rows, merged in a workbook, stands in the upper one. Where pandas writes columns of several levels, the name of
    the index stands in a row below them.

    >>> headed([["", "Force", "Force"], ["", "y", "z"], ["t [s]", "", ""]], 3)
    (['', 'Force', 'Force'], ['t [s]', 'y', 'z'])
    >>> headed([["t [s]", "Force", ""], ["", "y", "z"]], 3)[1]
    ['t [s]', 'y', 'z']
    """
    kept = [list(row) for row in rows]
    if len(kept) > 1 and any(kept[-1]) and not any(a and b for a, b in zip(kept[-1], kept[-2], strict=False)):
        below = kept.pop()
        kept[-1] = [a or b for a, b in zip(below, kept[-1], strict=False)]
    if len(kept) > 1:
        return kept[-2], [name or above for name, above in zip(kept[-1], kept[-2], strict=False)]
    return [], kept[0] if kept else [""] * width


def grouped(groups: Sequence[str], names: Sequence[str], units: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return names and units of columns that stand in groups: a word above several of them, as `Force [N]` above `y` and `z`.

    A name that needs that, or stands there twice, takes the word of its group before it, and its unit.

    >>> grouped(["", "Force [N]", ""], ["t", "y", "z"], ["s", "", ""])
    (['t', 'Force y', 'Force z'], ['s', 'N', 'N'])
    """
    names, units = list(names), list(units)
    filled = sum(map(bool, groups))
    if not filled or filled >= sum(map(bool, names)) or (filled == 1 and groups[0]):  # the last is a title
        return names, units
    twice = [names.count(name) > 1 for name in names]
    word = ""
    for k, name in enumerate(list(names)):
        word = groups[k] if k < len(groups) and groups[k] else word
        if not word or not name or not (_SAYS_LITTLE.fullmatch(name) or twice[k]):
            continue
        own = column(word, np.empty(0))
        names[k], units[k] = f"{own.label} {name}", units[k] or own.unit
    return names, units


def remarks_of(name: str, cells: Sequence[str]) -> tuple[Remark, ...]:
    """Return what stands in a column of words, once where consecutive rows are the same; empty cells are skipped.

    >>> [(remark.row, remark.text) for remark in remarks_of("note", ["", "cough", "cough", "", "cough"])]
    [(1, 'cough'), (4, 'cough')]
    """
    return tuple(Remark(name, row, text) for row, (before, text) in enumerate(pairwise(["", *cells])) if text and text != before)
