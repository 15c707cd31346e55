"""TSV exports of Qualisys Track Manager: markers in one file, forces of each plate and analog channels in files beside it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...errors import BadInput, Text
from ..markers import Markers
from .cell_values import grid, number
from .table import RawColumn, RawTable, column
from .text_table import decoded_lines

_BESIDE = re.compile(r"^(?P<name>.+)_(?:f_\d+|a)$")
_PROGRAM = "Qualisys Track Manager"
_UNITS = {"force": "N", "moment": "Nm", "cop": "mm"}
"""Units in which QTM exports what a plate measures; the file does not state them."""
_HEAD = 100
"""Lines in which the header ends; a plate has about thirty."""
_AXES = re.compile(r"(?P<what>force|moment|cop)_(?P<axis>[xyz])", flags=re.IGNORECASE)


def recognises(lines: Sequence[str]) -> bool:
    """Whether a text begins with the number of frames, or of samples, and their rate."""
    keys = [line.split("\t")[0].strip() for line in lines[:12]]
    return bool(keys) and keys[0] in ("NO_OF_FRAMES", "NO_OF_SAMPLES") and "FREQUENCY" in keys


def read(path: Path, lines: Sequence[str]) -> RawTable | None:
    """Read markers with the channels that stand beside them: `walk_f_1.tsv` and `walk_a.tsv` belong to `walk.tsv`.

    All start with the first frame. Markers at exactly 0, 0, 0 were not seen. For a file that belongs to one beside it, None.

    Raises
    ------
    BadInput
        Without the file's name in it.
    """
    head, names, values = _content(lines)
    rate = _rate(head)
    if "MARKER_NAMES" not in head:
        main = _belongs_to(path)
        if main and path.with_name(main + path.suffix).is_file():
            return None
        return RawTable(path, path.stem, tuple(_channels(names, values, rate)), (f"export of {_PROGRAM}",))
    return _with_beside(path, head, values)


def _with_beside(path: Path, head: dict[str, list[str]], values: np.ndarray) -> RawTable:
    """Return the markers with the channels of the files beside theirs, on the clock of the frames."""
    rate = _rate(head)
    labels = [name for name in head["MARKER_NAMES"] if name]
    first = values.shape[1] - 3 * len(labels)
    if first not in (0, 2):
        found = Text(f"{values.shape[1]} columns for {len(labels)} markers")
        raise BadInput("file", found, "three a marker, with frame and time before them or without")
    positions = 1e-3 * values[:, first:].reshape(len(values), len(labels), 3)
    positions[(positions == 0.0).all(axis=2)] = np.nan
    t = values[:, 1] if first else np.arange(len(values)) / rate
    columns, said = [RawColumn("time", "time", "s", t)], [f"{len(labels)} markers at {rate:g} Hz"]
    for file in sorted(p for p in path.parent.iterdir() if p.suffix == path.suffix and _belongs_to(p) == path.stem):
        lines_beside, _ = decoded_lines(file)
        if recognises(lines_beside):
            own, own_names, own_values = _content(lines_beside)
            clock, *channels = _channels(own_names, own_values, _rate(own))
            said.append(f"{file.name} at {_rate(own):g} Hz")
            columns += [RawColumn(c.name, c.label, c.unit, np.interp(t, clock.values + t[0], c.values)) for c in channels]
    note = f"export of {_PROGRAM}: {', '.join(said)}"
    return RawTable(path, path.stem, tuple(columns), (note,), Markers(labels, t, positions, up="z"))


def _belongs_to(path: Path) -> str | None:
    """Return the stem of the file that a file belongs to by its name."""
    match = _BESIDE.match(path.stem)
    return match["name"] if match else None


def _content(lines: Sequence[str]) -> tuple[dict[str, list[str]], list[str], np.ndarray]:
    """Return the header by its keys, the names above the columns where they stand, and the rows."""
    rows = [line.rstrip("\t ").split("\t") for line in lines]
    # The first cell of a row of numbers is empty where its marker was not seen.
    start = 1 + max((k for k, row in enumerate(rows[:_HEAD]) if row[0][:1].isalpha()), default=-1)
    width = max((len(row) for row in rows[start:]), default=0)
    if not width:
        raise BadInput("file", Text("no rows of numbers"), "one row a frame")
    head = {row[0].strip(): [cell.strip() for cell in row[1:]] for row in rows[:start]}
    names = [cell.strip() for cell in rows[start - 1]] if len(rows[start - 1]) == width else [""] * width
    return head, names, grid([[cell.strip() for cell in row] for row in rows[start:]], width)


def _rate(head: dict[str, list[str]]) -> float:
    said = next(iter(head.get("FREQUENCY", [])), "")
    rate = number(said)
    if rate is None or not rate > 0.0:
        raise BadInput("FREQUENCY", said or Text("nothing"), "frames a second")
    return rate


def _channels(names: Sequence[str], values: np.ndarray, rate: float) -> list[RawColumn]:
    """Return the time and the channels of a plate or of analog inputs; time counts from the first sample."""
    columns = [RawColumn("time", "time", "s", np.arange(len(values)) / rate)]
    for k, name in enumerate(names):
        if name.upper() in ("SAMPLE", "TIME", "FRAME"):
            continue
        axis = _AXES.fullmatch(name)
        if axis and axis["what"].lower() == "cop":
            continue
        columns.append(column(name or f"column {k + 1}", np.ascontiguousarray(values[:, k]), _UNITS[axis["what"].lower()] if axis else ""))
    return columns
