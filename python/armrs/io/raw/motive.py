"""CSV exports of OptiTrack Motive: markers, with the type, name and component of each column above it."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...errors import BadInput, Text
from ..markers import Markers
from .cell_values import grid
from .table import RawColumn, RawTable

_METRES = {"Meters": 1.0, "Centimeters": 1e-2, "Millimeters": 1e-3}
_MARKER = "Marker"
"""The last word of the types of columns that hold markers: `Marker`, `Bone Marker`, `Rigid Body Marker`."""
_HEAD = 8
"""Lines in which the header ends."""


def recognises(lines: Sequence[str]) -> bool:
    """Whether a text begins as Motive writes it."""
    return bool(lines) and lines[0].lstrip('"').startswith("Format Version,") and "Take Name" in lines[0]


def read(path: Path, lines: Sequence[str]) -> RawTable:
    """Read the markers of an export; up is y, the default of Motive.

    Raises
    ------
    BadInput
        Without the file's name in it.
    """
    rows = list(csv.reader(lines[: _HEAD + 1]))
    said = dict(zip(rows[0][::2], rows[0][1::2], strict=False))
    unit = said.get("Length Units", "")
    if unit not in _METRES:
        raise BadInput("Length Units", unit or Text("nothing"), " or ".join(_METRES))
    last = next((k for k, row in enumerate(rows) if row and row[0] == "Frame"), None)
    if last is None:
        raise BadInput("file", Text("no row that begins with Frame"), "an export of tracking data")
    above = rows[1:last]
    # Versions differ by the column in which the words Type and Name stand, and by rows between them.
    types = next((row for row in above if any(cell.endswith(_MARKER) or cell == "Rigid Body" for cell in row)), [])
    component = above[-1] if above else []
    names = above[above.index(types) + 1] if types else []
    first = [
        k
        for k, kind in enumerate(types)
        if kind.endswith(_MARKER) and component[k : k + 3] == ["Position"] * 3 and rows[last][k : k + 3] == ["X", "Y", "Z"]
    ]
    if not first:
        raise BadInput(
            "file", Text("no positions of markers"), "an export with markers", hint="in Motive, export Markers or Rigid Body Markers"
        )
    values = grid(list(csv.reader(lines[last + 1 :])), len(rows[last]))
    t = values[:, 1]
    positions = _METRES[unit] * np.stack([values[:, k : k + 3] for k in first], axis=1)
    rate = said.get("Export Frame Rate", "")
    note = f"export of OptiTrack Motive: {len(first)} markers at {float(rate):g} Hz, y up" if rate else "export of OptiTrack Motive, y up"
    markers = Markers([names[k] for k in first], t, positions, up="y")
    return RawTable(path, path.stem, (RawColumn("time", "time", "s", t),), (note,), markers)
