"""Recordings with names and time: Parquet, OpenSim motion files, markers in TRC, markers and analog channels in C3D files."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from .. import c3d
from ..markers import markers_of
from ..opensim import read_motion, read_trc
from ..samples import parquet_table
from .table import RawColumn, RawTable, Remark, column, remarks_of

PARQUET_SUFFIXES = (".parquet",)
MOTION_SUFFIXES = (".mot", ".sto")
C3D_SUFFIXES = (".c3d",)
TRC_SUFFIXES = (".trc",)
_NO_ANGLE = re.compile(r"force|moment|torque|emg|_[vp][xyz]$|_t[xyz]$|_f[xyz]$|^[fm][xyz](_|$)|^tau\d", flags=re.IGNORECASE)
"""Names of columns that the header's unit of angles does not concern."""

_SPEED = re.compile(r"/speed$|_u$|^dq\d")
"""Names of speeds, in a file of states and as in a trial."""


def read_parquet(path: Path) -> RawTable:
    """Read the numeric columns of a Parquet file, and time stamps as the time since the first [s]."""
    import pyarrow as pa

    table = parquet_table(path)
    columns = []
    remarks: list[Remark] = []
    for name in table.column_names:
        kind = table.schema.field(name).type
        if pa.types.is_floating(kind) or pa.types.is_integer(kind):
            values = table.column(name).cast(pa.float64()).to_numpy()
            columns.append(column(name, np.ascontiguousarray(values, dtype=np.float64)))
        elif pa.types.is_timestamp(kind) or pa.types.is_duration(kind):
            columns.append(RawColumn(name, "timestamp", "s", _seconds(table.column(name).to_numpy())))
        else:
            remarks += remarks_of(name, ["" if cell is None else str(cell) for cell in table.column(name).to_pylist()])
    return RawTable(path, path.stem, tuple(columns), remarks=tuple(remarks))


def _seconds(stamps: np.ndarray) -> np.ndarray:
    """Return the time since the first stamp [s]; NaN where there is none."""
    known = stamps[~np.isnat(stamps)]
    return (stamps - known[0]) / np.timedelta64(1, "s") if len(known) else np.full(len(stamps), np.nan)


def read_motion_table(path: Path) -> RawTable:
    """Read an OpenSim MOT or STO file; its header states whether angles are in degrees."""
    motion = read_motion(path)
    unit = {True: "deg", False: "rad", None: ""}[motion.in_degrees]
    notes = (f"angles in {unit}, as the header says",) if unit else ()
    columns = [column("time", motion.t, "s")]
    per_second = f"{unit}/s" if unit else ""
    for k, name in enumerate(motion.names):
        own = "" if _NO_ANGLE.search(name) else per_second if _SPEED.search(name) else unit
        columns.append(column(name, motion.values[:, k], own))
    return RawTable(path, path.stem, tuple(columns), notes)


def read_trc_table(path: Path) -> RawTable:
    """Read the markers of a TRC file."""
    markers = read_trc(path)
    return RawTable(path, path.stem, (), markers.warnings, markers)


def read_c3d_table(path: Path) -> RawTable:
    """Read the analog channels of a C3D file on their clock, and its points as markers."""
    content = c3d.read(path)
    columns = [column("time", np.arange(len(content.analog)) / content.analog_rate, "s")] if len(content.analog) else []
    for k, label in enumerate(content.analog_labels[: content.analog.shape[1] if content.analog.size else 0]):
        stated = content.analog_units[k] if k < len(content.analog_units) else ""
        columns.append(column(label, np.ascontiguousarray(content.analog[:, k]), stated))
    notes = (
        f"{len(content.labels)} points at {content.rate:g} Hz, {len(content.analog_labels)} analog channels at {content.analog_rate:g} Hz",
    )
    return RawTable(path, path.stem, tuple(columns), notes, markers_of(content) if content.points.size else None)
