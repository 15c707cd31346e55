"""OpenSim's text files: marker trajectories (TRC), coordinates and forces over time (MOT, STO)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..errors import BadInput, Text, not_later
from . import files, tomlfile
from .markers import METRES, Markers
from .trial import SAME_RATE

MOTION_SUFFIXES = (".mot", ".sto")
_LARGEST = 1 << 30
_FIRST_ROW = 6
"""Line of a TRC file at which samples may begin."""


@dataclass(frozen=True, eq=False)
class Motion:
    """A table over time.

    Attributes
    ----------
    names : list of str
        Of all columns but time.
    t : ndarray, shape (n,)
        [s]
    values : ndarray, shape (n, len(names))
        As in the file; NaN where missing.
    in_degrees : bool or None
        The unit of angles, where the file states it.
    """

    names: list[str]
    t: np.ndarray
    values: np.ndarray
    in_degrees: bool | None


_KEYS = {"nrows", "datarows", "ncolumns", "datacolumns", "indegrees"}
"""Keys of a header that are read."""


def read_motion(path: Path) -> Motion:
    """Read a MOT or STO file.

    Raises
    ------
    BadInput
        Without the file's name in it.
    """
    lines = _lines(path)
    try:
        end = next(k for k, line in enumerate(lines) if line.strip().lower() == "endheader")
    except StopIteration:
        raise BadInput("header", Text("no line endheader"), "a MOT or STO file") from None
    header = _header(lines[:end])
    start = end + 1
    while start < len(lines) and not lines[start].strip():
        start += 1
    names = _labels(lines[start]) if start < len(lines) else []
    if len(names) < 2 or names[0].lower() != "time":
        raise BadInput(
            f"line {start + 1}", Text(f"columns {', '.join(names[:3]) or 'without names'}"), "time first, and other columns after it"
        )
    for k, name in enumerate(names):
        if name in names[:k]:
            raise BadInput(f"line {start + 1}", Text(f"column {name} twice"), "each column once")
    rows = [(k, line.split()) for k, line in enumerate(lines[start + 1 :], start + 2) if line.strip()]
    table = _numbers(rows, names)
    for keys, count, what in ((("nrows", "datarows"), len(table), "rows"), (("ncolumns", "datacolumns"), len(names), "columns")):
        for key in keys:
            if key in header and header[key] != str(count):
                short = what == "rows" and header[key].isdecimal() and count < int(header[key][:18])
                hint = "the file is cut off" if short else None
                raise BadInput("file", Text(f"{count} {what}"), f"{header[key] or 'no'} {what}, as its header says", hint=hint)
    _increasing(table[:, 0], [k for k, _ in rows])
    return Motion(names[1:], table[:, 0], table[:, 1:], _in_degrees(header, lines[:end]))


def write_motion(path: Path, motion: Motion) -> None:
    """Write a MOT or STO file; every value is written with all the digits that reading it back needs."""
    head = [path.stem, "version=1", f"nRows={len(motion.t)}", f"nColumns={1 + len(motion.names)}"]
    head += [] if motion.in_degrees is None else [f"inDegrees={'yes' if motion.in_degrees else 'no'}"]
    table = np.column_stack([motion.t, motion.values])
    rows = ["\t".join("nan" if math.isnan(v) else repr(v) for v in row) for row in table.tolist()]
    names = "\t".join(["time", *motion.names])
    files.write_text(path, "\n".join([*head, "endheader", names, *rows, ""]), kind=path.suffix.lower())


def read_trc(path: Path) -> Markers:
    """Read marker trajectories; an empty cell, or `nan`, is a sample that is missing.

    Raises
    ------
    BadInput
        Without the file's name in it.
    """
    lines = _lines(path)
    if not lines or not lines[0].startswith("PathFileType") or len(lines) < _FIRST_ROW - 1:
        raise BadInput("line 1", Text("no PathFileType, or too few lines"), "a TRC file")
    header = _trc_header(lines[1], lines[2])
    unit = header.get("units", "")
    if unit not in METRES:
        raise BadInput("line 3, Units", unit or Text("nothing"), " or ".join(METRES))
    names = [cell.strip() for cell in lines[3].split("\t")[2:] if cell.strip()]
    if not names:
        raise BadInput("line 4", Text("no marker"), "the names of the markers, separated by tabs")
    columns = ["Frame#", "Time", *(f"{name}.{axis}" for name in names for axis in "XYZ")]
    rows = []
    for number, line in enumerate(lines[_FIRST_ROW - 1 :], _FIRST_ROW):
        if not line.strip():
            continue
        cells = line.rstrip("\r\n").split("\t")
        while len(cells) > len(columns) and not cells[-1].strip():
            cells.pop()
        rows.append((number, cells))
    table = _numbers(rows, columns)
    _increasing(table[:, 1], [k for k, _ in rows])
    _same_rate(header.get("datarate", ""), table[:, 1])
    announced = header.get("numframes", "")
    notes = [] if announced == str(len(table)) else [f"the header announces {announced or 'no'} frames, {len(table)} are there"]
    if (markers := header.get("nummarkers", str(len(names)))) != str(len(names)):
        notes.append(f"the header announces {markers} markers, {len(names)} are there")
    positions = METRES[unit] * table[:, 2:].reshape(len(table), len(names), 3)
    return Markers(names, table[:, 1], positions, up="y", warnings=tuple(notes))


def _trc_header(keys: str, values: str) -> dict[str, str]:
    """Return the header of a TRC file, keys in lower case; between tabs a value may be blank."""
    cells = [[cell.strip() for cell in line.rstrip("\r\n").split("\t")] for line in (keys, values)]
    if len(cells[0]) != len(cells[1]):  # written with blanks, or with tabs behind the last cell
        cells = [keys.split(), values.split()]
    return {key.lower(): value for key, value in zip(*cells, strict=False)}


def write_trc(path: Path, markers: Markers) -> Path:
    """Write marker trajectories in metres; a sample that is missing is an empty cell."""
    rate = (len(markers.t) - 1) / float(markers.t[-1] - markers.t[0])
    count = len(markers.t)
    head = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate:.10g}\t{rate:.10g}\t{count}\t{len(markers.names)}\tm\t{rate:.10g}\t1\t{count}",
        "Frame#\tTime\t" + "\t\t\t".join(markers.names),
        "\t\t" + "\t".join(f"{axis}{k}" for k in range(1, len(markers.names) + 1) for axis in "XYZ"),
    ]
    rows = [
        "\t".join([str(k), repr(t), *("" if math.isnan(v) else repr(v) for v in row)])
        for k, (t, row) in enumerate(zip(markers.t.tolist(), markers.positions.reshape(count, -1).tolist(), strict=True), 1)
    ]
    files.write_text(path, "\n".join([*head, *rows, ""]), kind=".trc")
    return path


def _lines(path: Path) -> list[str]:
    try:
        lines = tomlfile.read_text(path, "a text file", most=_LARGEST).splitlines()
    except BadInput as error:
        raise BadInput(error.place, error.found, error.allowed, kind=error.kind) from None
    # A spreadsheet program leaves commas between the cells.
    saved_again = any(line.startswith("PathFileType,") or line.strip().lower().startswith("endheader,") for line in lines)
    return [line.replace(",", "\t").rstrip("\t") for line in lines] if saved_again else lines


def _header(lines: Sequence[str]) -> dict[str, str]:
    """Return the keys of a header, old (`datarows 121`) and new (`nRows=121`)."""
    pairs = [line.partition("=")[::2] if "=" in line else [*line.split(None, 1), "", ""][:2] for line in lines]
    found: dict[str, str] = {}
    for key, value in ((key.strip().lower(), value.strip()) for key, value in pairs):
        if key in _KEYS and found.get(key, value) != value:
            raise BadInput(f"header, {key}", Text(f"{found[key]} and {value}"), "one of them")
        found[key] = value
    return found


def _in_degrees(header: dict[str, str], lines: Sequence[str]) -> bool | None:
    if "indegrees" in header:
        said = header["indegrees"].lower()
        if said not in ("yes", "true", "1", "no", "false", "0"):
            raise BadInput("header, inDegrees", header["indegrees"], "yes or no")
        return said in ("yes", "true", "1")
    return True if any("SIMM" in line for line in lines) else None  # motions of SIMM are in degrees


def _labels(line: str) -> list[str]:
    return [cell.strip() for cell in line.split("\t") if cell.strip()] if "\t" in line else line.split()


def _numbers(rows: Sequence[tuple[int, list[str]]], columns: list[str]) -> np.ndarray:
    """Return a table of numbers with NaN where a cell is empty; refuse what is neither, naming line and column."""
    if not rows:
        raise BadInput("file", Text("no samples below the header"), "samples")
    table = np.empty((len(rows), len(columns)))
    for k, (line, cells) in enumerate(rows):
        if len(cells) != len(columns):
            raise BadInput(f"line {line}", Text(f"{len(cells)} cells"), f"{len(columns)} cells, one a column")
        try:
            table[k] = [float(cell) if cell.strip() else math.nan for cell in cells]
        except ValueError:
            bad = next(j for j, cell in enumerate(cells) if cell.strip() and not _is_number(cell))
            raise BadInput(f"line {line}, column {columns[bad]}", cells[bad], "a number") from None
        if np.isinf(table[k]).any():
            bad = int(np.argmax(np.isinf(table[k])))
            raise BadInput(f"line {line}, column {columns[bad]}", cells[bad], "a finite number")
    return table


def _same_rate(stated: str, t: np.ndarray) -> None:
    """Refuse a DataRate that is none, or that the time stamps have neither from one to the next nor, rounded as they may be, on average."""
    place = "line 3, DataRate"
    if not (_is_number(stated) and 0.0 < float(stated) < math.inf):
        raise BadInput(place, stated or Text("nothing"), "a rate above 0 Hz")
    if len(t) < 2:
        return
    seen = (1.0 / float(np.median(np.diff(t))), (len(t) - 1) / float(t[-1] - t[0]))
    if all(abs(float(stated) / rate - 1.0) > SAME_RATE for rate in seen):
        raise BadInput(place, Text(f"{stated} Hz"), f"{seen[1]:.6g} Hz, as the time stamps have", hint="time stamps in seconds?")


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _increasing(t: np.ndarray, lines: Sequence[int]) -> None:
    if np.isnan(t).any():
        raise BadInput(f"line {lines[int(np.argmax(np.isnan(t)))]}, time", Text("an empty cell"), "a time stamp in every row")
    back = np.flatnonzero(np.diff(t) <= 0.0)
    if back.size:
        k = int(back[0]) + 1
        raise not_later(f"line {lines[k]}, time", t[k - 1], t[k])
