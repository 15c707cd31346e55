"""Conversion between file formats; every column and every value is preserved to the bit."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import checks
from ..errors import BadInput, Sentence, Text, unreadable
from . import files
from .dataset import FILE, describe, described_model, name_of, output_names
from .samples import NUMBER, SUFFIXES, csv_place, explain_csv, header_of, parquet_table, write_table

_EXACT = 2.0**53
"""Below it a float holds every whole number."""


@dataclass(frozen=True)
class _Job:
    """One file to be written: its content is read and checked before anything is."""

    target: Path
    table: Any


def convert(source: str | os.PathLike[str], folder: str | os.PathLike[str], *, to: str) -> list[Path]:
    """Convert a trial file, or all trials of a data set.

    Parameters
    ----------
    source : path
        A `.csv` or `.parquet` file, a data set folder or its `dataset.toml`.
    folder : path
        Where the result goes: the file under its own name, a data set with its `dataset.toml` and `model.toml`.
    to : {"csv", "parquet"}
        The format to write.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    BadInput
        When something cannot be read, or has no form in the other format that gives it back; nothing is written then.

    Notes
    -----
    Numbers are float64, or int64 where float64 would not hold them. A missing sample is an empty cell in CSV and null in Parquet; NaN in
    Parquet counts as missing too.

    Examples
    --------
    >>> import armrs
    >>> armrs.convert("session", "parquet", to="parquet")[0].name
    'slow_1.parquet'
    """
    suffix = "." + checks.choice("to", to, tuple(s[1:] for s in SUFFIXES))
    path = checks.path("source", source)
    out = files.output_folder(folder)
    if path.suffix.lower() in SUFFIXES and not path.is_dir():
        target = out / path.with_suffix(suffix).name
        files.not_an_input([target], [path])
        return [_write(_job(path, target))]
    described, description = describe(path)
    described_model(described.parent, description)  # a data set without a sound model is not worth converting
    named = [] if description.model is None else [described.parent / description.model]
    names = output_names([entry.file for entry in description.trials], suffix)
    sources = [described.parent / entry.file for entry in description.trials]
    targets = [out / name for name in names]
    files.not_an_input([*targets, out / FILE, out / "model.toml"], [*sources, described, *named])
    models = [path.read_text(encoding="utf-8") for path in named]
    entries = [entry.replace(file=name) for entry, name in zip(description.trials, names, strict=True)]
    content = description.replace(name=name_of(described, description), model="model.toml" if named else None, trials=entries).to_toml()

    if (out / FILE).exists() and (out / FILE).read_bytes() != content.encode("utf-8"):
        raise BadInput("folder", Sentence("this folder holds another data set"), files.ANOTHER, file=out)

    def write(part: Path) -> list[Path]:
        written = [_write(_job(source, part / name)) for source, name in zip(sources, names, strict=True)]
        for model in models:
            files.write_text(part / "model.toml", model, kind=".toml")
        files.write_text(part / FILE, content, kind=".toml")
        return [*written, *(part / "model.toml" for _ in models), part / FILE]

    return files.write_whole(out, write)


def read_table(path: Path) -> Any:
    """Return a file as an Arrow table of float64, int64 and text columns.

    Raises
    ------
    BadInput
        Without the file's name in it.
    """
    try:
        return _csv_table(path) if path.suffix.lower() == ".csv" else _plain_parquet(path)
    except OSError as error:
        raise unreadable(error) from None


def _job(source: Path, target: Path) -> _Job:
    try:
        if source.suffix.lower() not in SUFFIXES:
            raise BadInput("file", Text(f"suffix {source.suffix!r}"), " or ".join(SUFFIXES))
        return _Job(target, read_table(source))
    except BadInput as error:
        raise error.within(file=source) from None


def _write(job: _Job) -> Path:
    """Write one file and read it back before it takes its place, so that a value that got lost cannot pass unseen."""
    import pyarrow as pa

    def verify(written: Path) -> None:
        is_text = job.target.suffix == ".csv"
        back = _text_table(written) if is_text else parquet_table(written)
        for name in job.table.column_names:
            wanted, found = job.table.column(name), back.column(name)
            if is_text and pa.types.is_string(wanted.type):
                found = _typed(found, written, name)
            if not _same(wanted, found):
                raise BadInput(f"column {name}", Text("values that do not come back"), "values both formats can hold", file=job.target)

    write_table(job.target, job.table, verify)
    return job.target


def _same(wanted: Any, found: Any) -> bool:
    import pyarrow as pa

    if pa.types.is_string(wanted.type):
        return bool(wanted.to_pylist() == found.to_pylist())
    if found.type != wanted.type:
        found = _trimmed(found).cast(wanted.type)
    if not wanted.is_null().equals(found.is_null()):
        return False
    bits, back = (np.asarray(column.drop_null().to_numpy()).view(np.int64) for column in (wanted, found))
    return bool(np.array_equal(bits, back))


def _csv_table(path: Path) -> Any:
    import pyarrow as pa

    text = _text_table(path)
    columns = [_typed(text.column(name), path, name) for name in text.column_names]
    return pa.table(columns, names=text.column_names)


def _text_table(path: Path) -> Any:
    """Read a CSV file with every cell as text, an empty cell as null and a quoted empty one as empty text."""
    import pyarrow as pa
    from pyarrow import csv as arrow_csv

    names = header_of(path)
    try:
        return arrow_csv.read_csv(
            path,
            read_options=arrow_csv.ReadOptions(column_names=names, skip_rows=1),
            convert_options=arrow_csv.ConvertOptions(
                column_types={name: pa.string() for name in names},
                null_values=[""],
                strings_can_be_null=True,
                quoted_strings_can_be_null=False,
            ),
        )
    except pa.ArrowInvalid as error:
        if "Empty CSV" in str(error):
            return pa.table([pa.array([], pa.string()) for _ in names], names=names)
        explain_csv(path, names, numbers=False)
        raise BadInput("file", Text(str(error).splitlines()[0]), "CSV, one line a row") from None


def _typed(column: Any, path: Path, name: str) -> Any:
    """Turn a column of text into numbers, where all of it is numbers; 007 is a name."""
    import pyarrow as pa
    from pyarrow import compute as pc

    if pc.any(pc.match_substring_regex(column, r"^\s*[+-]?0[0-9]")).as_py():
        return column
    try:
        numbers = _trimmed(column).cast(pa.float64())
    except pa.ArrowInvalid:
        return column
    values = numbers.to_numpy()
    odd = np.flatnonzero(~np.isfinite(values) & ~np.asarray(numbers.is_null().to_numpy()))
    if odd.size:
        place = f"{csv_place(path)(int(odd[0]))}, column {name}"
        raise BadInput(place, column[int(odd[0])].as_py(), NUMBER)
    if (pc.max(pc.abs(numbers)).as_py() or 0.0) < _EXACT:
        return numbers
    try:
        return _trimmed(column).cast(pa.int64())
    except pa.ArrowInvalid:
        return numbers


def _trimmed(column: Any) -> Any:
    from pyarrow import compute as pc

    trimmed = pc.utf8_trim_whitespace(column)
    return pc.if_else(pc.equal(trimmed, ""), None, trimmed)


def _plain_parquet(path: Path) -> Any:
    """Return a Parquet file with all numbers as float64 or int64 and NaN as null."""
    import pyarrow as pa
    from pyarrow import compute as pc

    table = parquet_table(path)
    columns = []
    for name in table.column_names:
        column = table.column(name)
        kind = column.type
        if pa.types.is_dictionary(kind) or pa.types.is_large_string(kind):
            column, kind = column.cast(pa.string()), pa.string()
        if pa.types.is_floating(kind):
            column = column.cast(pa.float64())
            column = pc.if_else(pc.is_nan(column), None, column)
        elif pa.types.is_integer(kind) and kind != pa.uint64():
            column = column.cast(pa.int64())
        elif not pa.types.is_string(kind):
            raise BadInput(f"column {name}", Text(f"type {kind}"), "numbers or text")
        columns.append(column)
    return pa.table(columns, names=table.column_names)
