"""Text tables of any program: encodings, separators, decimal commas, comment lines, rows of units, columns of remarks."""

from __future__ import annotations

import codecs
import csv as csv_cells
import io
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import BadInput, Text
from .cell_values import number, seconds
from .table import NoTable, RawColumn, RawTable, Remark, column, grouped, headed, remarks_of
from .units import unit

SUFFIXES = (".csv", ".txt", ".tsv", ".dat", ".asc", ".log", ".lvm", ".xls")
_WORKBOOK = b"\xd0\xcf\x11\xe0"
"""How a workbook of the old binary format begins; programs also give this suffix to text between tabs."""
_COMMENT = ("#", "%", "//", '"#')
_SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas", "|": "bars", " ": "blanks"}
_PROBED = 400
"""Lines in which header, separator and decimal mark are searched for."""
_NAMING = 3
"""Comment lines above the samples that may hold groups, names and units of the columns."""
_FEWEST = 3
"""Rows of numbers that make a table."""
_TWO_PARTS = ("ZeitInSec", "ZeitInNanoSec")
"""Columns that hold the time of KUKA's DataRecorder."""
MISSING = ["", "nan", "NaN", "NAN", "NA", "N/A", "#N/A", "#NV", "-", "--", "null", "None", "inf", "-inf"]
_NUMBER = {
    ".": re.compile(r"[-+]?(\d+\.?\d*|\.\d+|[1-9]\d{0,2}((,\d{3})+\.\d*|(,\d{3}){2,}))([eE][-+]?\d+)?"),
    ",": re.compile(r"[-+]?(\d+,?\d*|,\d+|[1-9]\d{0,2}((\.\d{3})+,\d*|(\.\d{3}){2,}))([eE][-+]?\d+)?"),
}
"""Numbers by their decimal mark; thousands are recognised as such where a decimal mark follows, or where the mark stands twice."""
_JAPANESE = re.compile(rb"([\x81-\x9f][\x40-\x7e\x80-\xfc]){2}")
"""Two characters of Shift-JIS in a row, of its kana and common kanji: no Western word has letters of these bytes side by side."""
_THOUSANDS = re.compile("(?<=\\d)[\u00a0\u202f\u2009'\u2019](?=\\d{3}(?!\\d))")
"""Marks for thousands that are no decimal mark: narrow and other blanks, and the Swiss apostrophe."""
_BAD_CELLS = 0.1
"""A column with more cells than this that are no numbers holds something else."""


@dataclass(frozen=True)
class _Layout:
    """How a text is divided into cells, and where its numbers begin."""

    separator: str
    decimal: str
    first: int
    """Index of the first line of numbers."""
    cells: int
    score: float


def decoded_lines(path: Path) -> tuple[list[str], str]:
    """Return the lines of a text that are not blank, and the name of its encoding."""
    raw = path.read_bytes()
    if raw.startswith(_WORKBOOK):
        raise BadInput("file", Text("a workbook of the old binary format"), "an Excel workbook (.xlsx), or text", hint="save it as .xlsx")
    content, encoding = _decoded(raw)
    # Form feeds and other separators of str.splitlines may stand in a remark.
    return [line for line in re.split(r"\r\n|\r|\n", content) if line.strip()], encoding


def table_of(path: Path, lines: list[str], encoding: str) -> RawTable:
    """Return the table in a text, from the lines and encoding of `decoded_lines`.

    Raises
    ------
    BadInput
        When no block of numbers is found. Without the file's name in it; the caller adds it.
    """
    leading = next((index for index, line in enumerate(lines) if not _is_comment(line)), len(lines))
    lines = [_THOUSANDS.sub("", line) for line in lines]
    lines = [line for index, line in enumerate(lines) if index == 0 or not _is_comment(line) or _may_name(index, leading, line)]
    layout = _layout(lines[:_PROBED])
    if layout is None:
        raise NoTable("file", Text(f"no block of rows with at least two numbers each, {_FEWEST} or more"), "a table with one row a sample")
    names, units = _header(lines, layout)
    notes = [f"text in {encoding}, cells between {_SEPARATORS[layout.separator]}, decimal {'comma' if layout.decimal == ',' else 'point'}"]
    columns, remarks = _columns(lines[layout.first :], names, units, layout, notes)
    return RawTable(path, path.stem, tuple(_one_clock(columns, notes)), tuple(notes), remarks=tuple(remarks))


def _one_clock(columns: list[RawColumn], notes: list[str]) -> list[RawColumn]:
    """Return columns in which seconds and nanoseconds of one clock, as KUKA's recorder writes them, are one column."""
    by_name = {c.name: c for c in columns}
    if not by_name.keys() >= set(_TWO_PARTS):
        return columns
    whole, part = (by_name[name] for name in _TWO_PARTS)
    notes.append(f"time: {whole.name} and {part.name} together")
    # The whole seconds are those since 1970: beside them a float64 keeps 0.2 µs, so they are counted from the first.
    together = (whole.values - whole.values[0]) + 1e-9 * part.values
    return [column("time", together, "s"), *(c for c in columns if c is not whole and c is not part)]


def _decoded(raw: bytes) -> tuple[str, str]:
    for mark, name, encoding in (
        (codecs.BOM_UTF8, "UTF-8", "utf-8-sig"), (codecs.BOM_UTF16_LE, "UTF-16", "utf-16"), (codecs.BOM_UTF16_BE, "UTF-16", "utf-16"),
    ):  # fmt: skip
        if raw.startswith(mark):
            try:
                return raw.decode(encoding), name
            except UnicodeDecodeError:
                raise BadInput("file", Text(f"a mark of {name}, and bytes that are not"), "text in one encoding") from None
    for k, encoding in ((1, "utf-16-le"), (0, "utf-16-be")):  # text whose every second byte is zero
        if len(raw) > 8 and raw[k:400:2].count(0) > 0.9 * len(raw[k:400:2]):
            return raw.decode(encoding, errors="replace"), "UTF-16"
    try:
        content, name = raw.decode("utf-8"), "UTF-8"
    except UnicodeDecodeError:
        codec, name = ("cp932", "Shift-JIS") if _JAPANESE.search(raw) else ("cp1252", "Windows-1252")
        content = raw.decode(codec, errors="replace")
    if "\0" in content:
        raise BadInput("file", Text("binary data"), "a text table")
    return content, name


def _is_comment(line: str) -> bool:
    return line.lstrip().startswith(_COMMENT)


def _may_name(index: int, leading: int, line: str) -> bool:
    """Whether a comment may hold names or units: it is one of the last above the first line that is none, and has no number."""
    return leading - _NAMING <= index < leading and not any(number(cell) is not None for cell in re.split(r"[;,|\s]+", line) if cell)


def split(line: str, separator: str) -> list[str]:
    """Return the cells of a line without blanks and quotes around them."""
    if separator == " ":
        return line.split()
    if '"' in line:
        return [cell.strip() for cell in next(csv_cells.reader([line], delimiter=separator))]
    return [cell.strip().strip('"').strip() for cell in line.split(separator)]


def rows_of(lines: list[str]) -> list[list[str]]:
    """Return the cells of a table of words and numbers below a row of names, from the lines of `decoded_lines`.

    The separator is the one that makes most cells of the names.

    >>> rows_of(["subject;value", "a;0,5"])
    [['subject', 'value'], ['a', '0,5']]
    """
    separator = max((s for s in _SEPARATORS if s != " "), key=lambda s: (len(split(lines[0], s)), s == ","))
    return [split(line, separator) for line in lines]


def decimal_of(cells: Sequence[str]) -> str:
    """Return the decimal mark of cells with numbers: a comma where one of them can be read in no other way.

    >>> decimal_of(["1", "0,25"]), decimal_of(["1", "0.25"]), decimal_of(["1.234,5"])
    (',', '.', ',')
    """
    return "," if any(_is_number(cell, ",") and not _is_number(cell, ".") for cell in cells) else "."


def number_in(cell: str, decimal: str) -> float | None:
    """Return the number in a cell with a decimal mark, None where there is none.

    >>> number_in("1.234,5", ","), number_in("0,5", "."), number_in("0.5", ",")
    (1234.5, None, None)
    """
    if not _is_number(cell, decimal):
        return number(cell) if decimal == "." else None
    return float(cell.replace("." if decimal == "," else ",", "").replace(decimal, "."))


def _is_number(cell: str, decimal: str) -> bool:
    return bool(_NUMBER[decimal].fullmatch(cell))


def _layout(lines: list[str]) -> _Layout | None:
    """Return the division into cells that makes the longest and widest block of numbers."""
    found = []
    for separator in _SEPARATORS:
        for decimal in ",.":
            if separator == decimal and not any('"' in line for line in lines):
                continue
            block = _block(lines, separator, decimal)
            if block is not None:
                found.append(block)
    return max(found, key=lambda b: b.score, default=None)


def _block(lines: list[str], separator: str, decimal: str) -> _Layout | None:
    rows = [split(line, separator) for line in lines]
    numbers = [sum(_is_number(cell, decimal) for cell in row) for row in rows]
    best: _Layout | None = None
    start = 0
    while start < len(rows):
        end = start
        while end < len(rows) and len(rows[end]) == len(rows[start]) and numbers[end] >= 2:
            end += 1
        if end - start >= _FEWEST:
            # A remark that stands in a column is a cell, not a reason for another division.
            share = sum(numbers[start:end]) / sum(len(row) for row in rows[start:end])
            score = (end - start) * share + 1e-3 * len(rows[start])
            if best is None or score > best.score:
                best = _Layout(separator, decimal, start, len(rows[start]), score)
        start = max(end, start + 1)
    return best


def _header(lines: list[str], layout: _Layout) -> tuple[list[str], list[str]]:
    """Return names and units of the columns from the lines above the numbers."""
    above = [split(line.lstrip("#%/ "), layout.separator) for line in lines[: layout.first]]
    # The name of a column of remarks may stand above rows that have none.
    rows = [row[: layout.cells] for row in above if len(row) in (layout.cells, layout.cells + 1) and any(row)]
    units = [""] * layout.cells
    if len(rows) > 1 and _is_units(rows[-1]):
        units = [cell.strip("[]() ") for cell in rows.pop()]
    elif len(rows) > 1 and rows[-1] == rows[-2]:
        rows.pop()
    groups, names = headed(rows, layout.cells)
    names, units = grouped(groups, names, units)
    return [name or f"column {k}" for k, name in enumerate(names, start=1)], units


def _is_units(row: list[str]) -> bool:
    cells = [cell.strip("[]() ") for cell in row if cell.strip("[]() ")]
    return bool(cells) and sum(unit(cell) is not None for cell in cells) >= 0.5 * len(cells)


def _columns(
    lines: list[str], names: list[str], units: list[str], layout: _Layout, notes: list[str]
) -> tuple[list[RawColumn], list[Remark]]:
    """Return the columns of numbers, and the contents of columns that hold words alone."""
    import pyarrow as pa
    from pyarrow import csv

    separator = layout.separator
    if separator == " ":
        lines, separator = ["\t".join(line.split()) for line in lines], "\t"
    places = [f"c{k}" for k in range(1, len(names) + 1)]
    skipped: list[int] = []

    def odd(row: csv.InvalidRow) -> str:
        skipped.append(row.number or 0)
        return "skip"

    data = csv.read_csv(
        io.BytesIO("\n".join(lines).encode("utf-8")),
        read_options=csv.ReadOptions(column_names=places, use_threads=False),
        parse_options=csv.ParseOptions(delimiter=separator, invalid_row_handler=odd),
        convert_options=csv.ConvertOptions(column_types={place: pa.string() for place in places}),
    )
    if len(skipped) > 0.01 * len(lines):
        found = Text(f"{len(skipped)} of {len(lines)} rows with another number of cells")
        raise BadInput("file", found, f"{len(names)} cells in every row")
    columns = []
    remarks: list[Remark] = []
    for place, name, stated in zip(places, names, units, strict=True):
        values, unit_of_clock = _numbers(data.column(place), layout.decimal)
        if values is not None and (odd_cells := _odd_cells(data.column(place), values)):
            notes.append(f"{name}: cells without a number, which count as missing: {odd_cells}")
        if values is not None:
            name = "time" if unit_of_clock and name == f"column {place[1:]}" else name
            columns.append(column(name, values, stated or unit_of_clock))
        elif any(said := ["" if cell.strip() in MISSING else cell.strip() for cell in data.column(place).to_pylist()]):
            remarks += remarks_of(name, said)
    return columns, remarks


def _numbers(cells: Any, decimal: str) -> tuple[np.ndarray | None, str]:
    """Return the numbers in the cells of a column, and the unit of one of times of day; None for a column of something else."""
    import pyarrow as pa
    import pyarrow.compute as pc

    plain = pc.utf8_trim_whitespace(cells)
    known = pc.if_else(pc.is_in(plain, pa.array(MISSING)), None, plain)
    dotted = pc.replace_substring(known, ",", ".") if decimal == "," else known
    if decimal == "," and any(pointed := pc.match_substring(known, ".").to_pylist()):
        marked = pc.match_substring_regex(known, r"^[-+]?[1-9]\d{0,2}(\.\d{3})+(,\d*)?$").to_pylist()
        if marked == pointed:  # points that are all marks for thousands: 12.345 is no fraction
            dotted = pc.replace_substring(pc.replace_substring(known, ".", ""), ",", ".")
    try:
        values = pc.cast(dotted, pa.float64()).to_numpy()
    except pa.ArrowInvalid:
        return _odd_numbers(known.to_pylist(), decimal)
    return (None if np.isnan(values).all() else np.ascontiguousarray(values)), ""


def _odd_cells(cells: Any, values: np.ndarray) -> int:
    """Return how many cells hold something that is neither a number nor a mark of a missing value."""
    return sum(cells[int(k)].as_py().strip() not in MISSING for k in np.flatnonzero(np.isnan(values)))


def _odd_numbers(cells: list[str | None], decimal: str) -> tuple[np.ndarray | None, str]:
    """Return numbers with marks for thousands and cells of errors among them, or times of day in seconds."""
    other = "." if decimal == "," else ","
    values = [number(cell.replace(other, "").replace(decimal, ".")) if cell else math.nan for cell in cells]
    wrong = sum(value is None for value in values)
    if wrong <= _BAD_CELLS * len(cells) and any(value is not None and math.isfinite(value) for value in values):
        return np.array([math.nan if value is None else value for value in values]), ""
    times = seconds(cells)
    return times, "" if times is None else "s"
