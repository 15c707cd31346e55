"""Text exports of Vicon Nexus: a section for each kind of data (Devices, Model Outputs, Trajectories), each at its own rate."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import BadInput, Text
from ..markers import METRES, Markers
from .cell_values import grid, number
from .table import RawColumn, RawTable

_FRAMES = ("Frame", "Sub Frame")
_HEAD = 5
"""Lines of a section above its rows: title, rate, groups, names, units."""
_AXIS = re.compile(r"[FM][xyz]")
"""Names of the channels of a force plate that need no title of a group."""


@dataclass(frozen=True)
class _Section:
    title: str
    rate: float
    groups: list[str]
    """Of each column the name of the device or marker it belongs to."""
    names: list[str]
    units: list[str]
    values: np.ndarray

    @property
    def t(self) -> np.ndarray:
        """Time [s]; frames count from 1."""
        return self.values[:, 0]


def recognises(lines: Sequence[str]) -> bool:
    """Whether a text begins with a section: its title, its rate, and soon the columns `Frame` and `Sub Frame`."""
    return any(_cells(line)[:2] == list(_FRAMES) for line in lines[:_HEAD])


def read(path: Path, lines: Sequence[str]) -> RawTable:
    """Read markers, joint angles and channels of devices on the clock of the frames.

    A device has several samples a frame; the one at the frame is taken.

    Raises
    ------
    BadInput
        Without the file's name in it.
    """
    sections = _sections(lines)
    frames = min((s for s in sections if len(s.values)), key=lambda s: s.rate, default=None)
    if frames is None:
        raise BadInput("file", Text("no section with frames"), "an export with Trajectories, Model Outputs or Devices")
    markers, columns, said = None, [RawColumn("time", "time", "s", frames.t)], []
    for section in sections:
        said.append(f"{section.title} at {section.rate:g} Hz")
        if section.title == "Trajectories":
            markers = _markers(section)
        else:
            columns += _columns(section, frames.t)
    notes = [f"export of Vicon Nexus: {', '.join(said)}"]
    if any(s.rate > frames.rate for s in sections):
        notes.append(f"devices are taken at the {frames.rate:g} frames a second")
    return RawTable(path, path.stem, tuple(columns), tuple(notes), markers)


def _cells(line: str) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in re.split(r"\t" if "\t" in line else r"[,;]", line)]


def _sections(lines: Sequence[str]) -> list[_Section]:
    starts = [k - 3 for k, line in enumerate(lines) if k >= 3 and _cells(line)[:2] == list(_FRAMES)]
    sections = []
    for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        title, rate = _cells(lines[start])[0], number(_cells(lines[start + 1])[0])
        if not rate or not rate > 0.0:
            raise BadInput(f"section {title}", lines[start + 1][:40], "the rate in Hz below the title")
        groups, names, units = (_cells(line) for line in lines[start + 2 : start + _HEAD])
        # Sections of another kind, such as Events, may stand between this one's rows and the next.
        rows = [_cells(line) for line in lines[start + _HEAD : end]]
        stop = next((k for k, row in enumerate(rows) if number(row[0]) is None), len(rows))
        values = grid(rows[:stop], len(names))
        clock = (values[:, 0] - 1.0) / rate if title != "Devices" else None
        if clock is None:
            # Frames are those of the cameras: as many sub frames belong to each as the device has samples in it.
            per_frame = float(values[:, 1].max()) + 1.0 if len(values) else 1.0
            clock = ((values[:, 0] - 1.0) * per_frame + values[:, 1]) / rate
        whole = np.column_stack([clock, values[:, 2:]])
        sections.append(_Section(title, rate, _filled(groups, len(names)), names[2:], [*units, *[""] * len(names)][2 : len(names)], whole))
    return sections


def _filled(groups: Sequence[str], width: int) -> list[str]:
    """Return the group of each column: it stands above its first one only."""
    filled, last = [], ""
    for k in range(2, width):
        last = groups[k] if k < len(groups) and groups[k] else last
        filled.append(last)
    return filled


def _markers(section: _Section) -> Markers | None:
    unit = next((u for u in section.units if u), "mm")
    if unit not in METRES:
        raise BadInput("Trajectories, units", unit, " or ".join(METRES))
    first = [k for k in range(len(section.names) - 2) if section.names[k : k + 3] == ["X", "Y", "Z"]]
    if not first:
        return None
    positions = np.stack([section.values[:, 1 + k : 4 + k] for k in first], axis=1)
    return Markers([section.groups[k] for k in first], section.t, METRES[unit] * positions, up="z")


def _columns(section: _Section, frames: np.ndarray) -> list[RawColumn]:
    columns = []
    for k, (group, name, unit) in enumerate(zip(section.groups, section.names, section.units, strict=True)):
        values = np.interp(frames, section.t, section.values[:, 1 + k], left=np.nan, right=np.nan)
        full = f"{group} {name}".strip()
        columns.append(RawColumn(full, name if _AXIS.fullmatch(name) else full, unit, values))
    return columns
