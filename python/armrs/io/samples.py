"""Reading the numbers of a trial from CSV or Parquet, strictly.

Nothing is inferred: a cell is a finite number, or empty where the sample is missing. What is refused is named by line and column.
"""

from __future__ import annotations

import csv
import io
import itertools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import NO_FILE, BadInput, Text, not_utf8, show, unreadable
from .files import may_replace, replacing

SUFFIXES = (".csv", ".parquet")
MOST_COLUMNS = 4096
NUMBER = "a finite number, or an empty cell where the sample is missing"


@dataclass(frozen=True)
class Samples:
    """The columns of one file.

    Attributes
    ----------
    names : list of str
        Column names, in the order of the file.
    values : list of ndarray, shape (n_rows,)
        float64; NaN where the sample is missing.
    place_of : callable
        Turns the index of a row into words for a message.
    """

    names: list[str]
    values: list[np.ndarray]
    place_of: Callable[[int], str]

    @property
    def n_rows(self) -> int:
        """Number of rows below the header."""
        return len(self.values[0]) if self.values else 0


def read_samples(path: Path) -> Samples:
    """Read a trial file.

    Parameters
    ----------
    path : Path
        CSV or Parquet, by its suffix.

    Returns
    -------
    Samples

    Raises
    ------
    BadInput
        Without the file's name in it; the caller adds it.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise BadInput("file", Text(f"suffix {path.suffix!r}"), " or ".join(SUFFIXES))
    try:
        if not path.is_file():
            if path.is_dir():
                raise BadInput("file", Text("a folder"), "a file that exists")
            raise BadInput("file", NO_FILE, "a file that exists", kind="missing_file")
        samples = _read_csv(path) if suffix == ".csv" else _read_parquet(path)
    except OSError as error:
        raise unreadable(error) from None
    except ValueError as error:
        if isinstance(error, BadInput):
            raise
        raise BadInput("file", Text(str(error)), "a file that can be read") from None
    for name, column in zip(samples.names, samples.values, strict=True):
        bad = np.flatnonzero(np.isinf(column))
        if bad.size:
            place = f"{samples.place_of(int(bad[0]))}, column {name}"
            raise BadInput(place, float(column[bad[0]]), NUMBER)
    return samples


def header_of(path: Path) -> list[str]:
    """Return the column names of a CSV file."""
    with path.open("rb") as stream:
        raw = stream.readline(1_000_000)
    if not raw.strip():
        raise BadInput("line 1", Text("nothing"), "a header with the names of the columns")
    if b"\r" in raw.rstrip(b"\r\n"):
        raise BadInput("line 1", Text("line ends of carriage returns alone"), "line feeds; armrs import reads such files")
    if raw.count(b",") >= MOST_COLUMNS:
        raise BadInput("line 1", Text(f"{raw.count(b',') + 1} cells"), f"at most {MOST_COLUMNS} columns")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise not_utf8("line 1", raw, error) from None
    if "\0" in text:
        raise BadInput("line 1", Text("binary data"), "CSV text")
    if text.lstrip().startswith("#"):
        found = f"a comment, {show(text.strip())}"
        raise BadInput("line 1", Text(found), "the names of the columns; armrs import reads files with comment lines")
    names = [name.strip() for name in next(csv.reader([text]))]
    if len(names) == 1:
        for separator, word in ((";", "semicolons"), ("\t", "tabs")):
            if separator in text:
                raise BadInput("line 1", Text(word), "commas between the cells, and a point as decimal mark")
    _check_names("line 1", names)
    return names


def _check_names(place: str, names: list[str]) -> None:
    """Refuse column names that are absent, stand twice, or would not come back from a file."""
    for position, name in enumerate(names, start=1):
        if not name.strip():
            raise BadInput(f"{place}, column {position}", Text("no name"), "a name for each column")
        if name != name.strip() or not name.isprintable():
            raise BadInput(f"{place}, column {position}", name, "a name without line ends and blanks around it")
        if name in names[: position - 1]:
            raise BadInput(place, Text(f"column {name} twice"), "each column once")


def _read_csv(path: Path) -> Samples:
    import pyarrow as pa
    from pyarrow import csv as arrow_csv

    names = header_of(path)
    try:
        table = arrow_csv.read_csv(
            path,
            read_options=arrow_csv.ReadOptions(column_names=names, skip_rows=1),
            convert_options=arrow_csv.ConvertOptions(
                column_types={name: pa.float64() for name in names}, null_values=[""], quoted_strings_can_be_null=True
            ),
        )
    except pa.ArrowInvalid as error:
        if "Empty CSV" in str(error):
            return Samples(names, [np.empty(0) for _ in names], csv_place(path))
        explain_csv(path, names)
        raise BadInput("file", Text(str(error).splitlines()[0]), "CSV with one number a cell") from None
    columns = [table.column(name) for name in names]
    values = [_numbers(column) for column in columns]
    # A NaN that was written out, rather than left empty.
    if any(int(np.isnan(v).sum()) > c.null_count for v, c in zip(values, columns, strict=True)):
        explain_csv(path, names)
    return Samples(names, values, csv_place(path))


def _numbers(column: Any) -> np.ndarray:
    """Return an Arrow column of float64 with NaN where it is null.

    Numbers are taken from the buffers: Arrow's own conversion loads pandas where that is installed, which takes longer than a short verb.
    """
    found = np.empty(len(column))
    done = 0
    for chunk in filter(len, column.chunks):
        valid, data = chunk.buffers()
        of, to = slice(chunk.offset, chunk.offset + len(chunk)), slice(done, done + len(chunk))
        found[to] = np.frombuffer(data, dtype=np.float64)[of]
        if chunk.null_count:
            found[to][np.unpackbits(np.frombuffer(valid, dtype=np.uint8), bitorder="little")[of] == 0] = np.nan
        done += len(chunk)
    return found


def explain_csv(path: Path, names: list[str], *, numbers: bool = True) -> None:
    """Go through a CSV file cell by cell and refuse the first line that has not one cell a column.

    With `numbers`, also refuse the first cell that is not a finite number.
    """
    with path.open("rb") as stream:
        for line, raw in enumerate(stream, start=1):
            try:
                text = raw.decode("utf-8-sig" if line == 1 else "utf-8")
            except UnicodeDecodeError as error:
                raise not_utf8(f"line {line}", raw, error) from None
            if "\0" in text:
                raise BadInput(f"line {line}", Text("a null byte"), "CSV text")
            if line == 1 or not text.strip("\r\n"):
                continue
            try:
                cells = next(csv.reader([text], strict=True))
            except csv.Error as error:
                raise BadInput(f"line {line}", Text(str(error)), "CSV") from None
            if len(cells) != len(names):
                raise BadInput(f"line {line}", Text(f"{len(cells)} cells"), f"{len(names)} cells, one a column")
            for name, cell in zip(names, cells, strict=True):
                if numbers and cell and not _is_number(cell):
                    raise BadInput(f"line {line}, column {name}", cell, NUMBER)


def _is_number(cell: str) -> bool:
    try:
        return bool(np.isfinite(float(cell))) and "_" not in cell
    except ValueError:
        return False


def csv_place(path: Path) -> Callable[[int], str]:
    """Return what turns the index of a row of a CSV file into words for a message."""

    def place(index: int) -> str:
        """Count the lines as an editor does, blank ones included."""
        rows = -1
        with path.open("rb") as stream:
            for line, raw in enumerate(stream, start=1):
                if line > 1 and raw.strip(b"\r\n"):
                    rows += 1
                    if rows == index:
                        return f"line {line}"
        return f"row {index + 1}"

    return place


def _read_parquet(path: Path) -> Samples:
    import pyarrow as pa

    table = parquet_table(path)
    names = table.column_names
    for name in names:
        kind = table.schema.field(name).type
        if not (pa.types.is_floating(kind) or pa.types.is_integer(kind)):
            raise BadInput(f"column {name}", Text(f"type {kind}"), "numbers")
    values = [_numbers(table.column(name).cast(pa.float64())) for name in names]
    return Samples(names, values, lambda index: f"row {index + 1}")


def parquet_table(path: Path) -> Any:
    """Return the Arrow table of a Parquet file, each column once."""
    import pyarrow as pa
    from pyarrow import parquet

    content = path.read_bytes()
    if content[:4] != b"PAR1":
        raise BadInput("file", Text("no Parquet mark at its start"), "a Parquet file")
    try:
        table = parquet.read_table(io.BytesIO(content))
        names = table.column_names
    except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
        raise BadInput("file", Text(str(error).splitlines()[0]), "a whole Parquet file") from None
    _check_names("header", names)
    return table


def write_samples(path: Path, names: list[str], values: list[np.ndarray]) -> None:
    """Write columns of numbers as CSV or Parquet, by the suffix; NaN becomes an empty cell. Every finite value is kept to the bit."""
    write_table(path, _table(names, values))


def write_pieces(path: Path, pieces: Iterable[Mapping[str, np.ndarray]]) -> None:
    """Write columns that come some rows at a time, as `write_samples` does; in Parquet, each piece is a row group."""
    _write_tables(path, (_table(list(piece), piece.values()) for piece in pieces))


def _table(names: list[str], values: Iterable[np.ndarray]) -> Any:
    import pyarrow as pa

    return pa.table([_arrow(np.ascontiguousarray(column)) for column in values], names=names)


def _arrow(column: np.ndarray) -> Any:
    """Return numbers as an Arrow array that is null where they are NaN; see `_numbers` for why from their buffers."""
    import pyarrow as pa

    if column.dtype != np.float64:
        return pa.array(column, from_pandas=True)
    there = np.packbits(~np.isnan(column), bitorder="little")
    return pa.Array.from_buffers(pa.float64(), len(column), [pa.py_buffer(there), pa.py_buffer(column)])


def write_table(path: Path, table: Any, verify: Callable[[Path], None] | None = None) -> None:
    """Write an Arrow table as CSV or Parquet, by the suffix. `verify` may refuse what was written before it takes its place."""
    _write_tables(path, [table], verify)


def _write_tables(path: Path, tables: Iterable[Any], verify: Callable[[Path], None] | None = None) -> None:
    from pyarrow import csv as arrow_csv
    from pyarrow import parquet

    may_replace(path, path.suffix.lower())
    rest = iter(tables)
    first = next(rest)
    with replacing(path) as temporary:
        if path.suffix.lower() == ".parquet":
            with parquet.ParquetWriter(temporary, first.schema) as writer:
                for table in itertools.chain([first], rest):
                    writer.write_table(table)
        else:
            header = io.StringIO()
            csv.writer(header, lineterminator="\n").writerow(first.column_names)
            with temporary.open("wb") as stream:
                stream.write(header.getvalue().encode("utf-8"))
                for table in itertools.chain([first], rest):
                    arrow_csv.write_csv(table, stream, arrow_csv.WriteOptions(include_header=False))
        if verify is not None:
            verify(temporary)
