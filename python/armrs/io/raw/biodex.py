"""Text exports of Biodex dynamometers: time, torque, position and velocity of one joint."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from ...errors import BadInput, Text
from .cell_values import grid, number
from .table import RawColumn, RawTable
from .units import unit

_NAMES = {"TIME": "time", "TORQUE": "torque 1", "POSITION": "position 1", "POS (ANAT)": "POS (ANAT)", "VELOCITY": "velocity 1"}
"""What Biodex calls a column -> the name by which it is recognised. `POS (ANAT)` is the position with another zero."""
_NAME = re.compile(r"POS \(ANAT\)|\S+")
_HEAD = 12
"""Lines in which the names of the columns are searched for."""


def recognises(lines: Sequence[str]) -> bool:
    """Whether a line among the first names time, torque and position as Biodex does."""
    return _names(lines) is not None


def read(path: Path, lines: Sequence[str]) -> RawTable:
    """Read the one joint that a dynamometer moves: its angle, speed and torque.

    Raises
    ------
    BadInput
        Without the file's name in it.
    """
    place = _names(lines) or 0
    names = _NAME.findall(lines[place])
    units = lines[place + 1].split()
    rows = [line.split() for line in lines[place + 2 :] if number(line.split()[0]) is not None]
    if not rows or len(units) != len(names):
        raise BadInput(
            "file", Text(f"{len(names)} names, {len(units)} units and {len(rows)} rows"), "names, their units, and one row a sample"
        )
    values = grid(rows, len(names))
    columns = []
    for k, (name, stated) in enumerate(zip(names, units, strict=True)):
        if name not in _NAMES or name == "POS (ANAT)":
            continue
        if unit(stated) is None:
            raise BadInput(f"unit of {name}", stated, "mSec, N-M or FT-LBS, DEGREES, DEG/SEC")
        columns.append(RawColumn(name, _NAMES[name], stated, values[:, k].copy()))
    note = "export of a Biodex dynamometer: one joint; its torque is taken as that on the arm, in the direction of the position"
    return RawTable(path, path.stem, tuple(columns), (note,))


def _names(lines: Sequence[str]) -> int | None:
    """Return the line that names the columns."""
    return next((k for k, line in enumerate(lines[:_HEAD]) if {"TIME", "TORQUE", "POSITION"} <= set(line.split())), None)
