"""Conversion of marker trajectories to trials, and of OpenSim's MOT and STO files in both directions."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from .. import checks
from ..errors import BadInput, Text, unknown_name
from . import files
from .columns import ANGLE
from .markers import MARKER_SUFFIXES, Markers, PlanarMotion, planar_motion, read_c3d
from .opensim import MOTION_SUFFIXES, Motion, read_motion, read_trc, write_motion
from .samples import SUFFIXES, write_samples
from .table_conversion import read_table

Read = TypeVar("Read")
_FORMATS = tuple(suffix[1:] for suffix in (*SUFFIXES, *MOTION_SUFFIXES))


def read_markers(path: str | os.PathLike[str]) -> Markers:
    """Read marker trajectories from a C3D or TRC file; positions in metres, NaN where a marker was not seen.

    Parameters
    ----------
    path : path

    Returns
    -------
    Markers

    Raises
    ------
    BadInput
        Names the file, the place, the value found and the value allowed.
    """
    file = checks.path("file", path)
    suffix = file.suffix.lower()
    if suffix not in MARKER_SUFFIXES:
        raise BadInput("file", Text(f"suffix {file.suffix!r}"), " or ".join(MARKER_SUFFIXES), file=file)
    return _named(file, read_c3d if suffix == ".c3d" else read_trc)


def convert_markers(
    source: str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    to: str,
    points: Sequence[str],
    up: str | None = None,
    forward: str | None = None,
) -> tuple[Path, PlanarMotion, tuple[str, ...]]:
    """Convert marker trajectories to joint angles of a planar arm.

    Parameters
    ----------
    source : path
        C3D or TRC file.
    folder : path
        Where the angles go, under the name of the source.
    to : {"csv", "parquet", "mot", "sto"}
    points, up, forward
        As in `planar_motion`.

    Returns
    -------
    Path
        The file written: `t_s` and `q1_rad` …, with empty cells where a marker is missing.
    PlanarMotion
    tuple of str
        Remarks of the reader.

    Raises
    ------
    BadInput
        For a file that cannot be read, and points that it does not have.
    """
    path = checks.path("source", source)
    target = files.output_folder(folder) / path.with_suffix(f".{checks.choice('to', to, _FORMATS)}").name
    markers = read_markers(path)
    try:
        motion = planar_motion(markers, points, up=up, forward=forward)
    except BadInput as error:
        raise error.within(file=path) from None
    names = [f"q{j}_rad" for j in range(1, motion.q.shape[1] + 1)]
    _write(target, Motion(names, motion.t, motion.q, in_degrees=False))
    return target, motion, (*markers.warnings, *motion.warnings())


def convert_motion(source: str | os.PathLike[str], folder: str | os.PathLike[str], *, to: str, coordinates: Sequence[str] = ()) -> Path:
    """Convert a table over time between MOT, STO, CSV and Parquet; every value is kept to the bit.

    Parameters
    ----------
    source : path
        MOT or STO file; or CSV or Parquet with a column `t_s`.
    folder : path
        Where the result goes, under the name of the source.
    to : {"csv", "parquet", "mot", "sto"}
    coordinates : sequence of str
        Joint angles of a MOT or STO file, proximal first: they become `q1_deg` … and nothing else is taken.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    BadInput
        For a file that cannot be read, and coordinates that it does not have.
    """
    path = checks.path("source", source)
    target = files.output_folder(folder) / path.with_suffix(f".{checks.choice('to', to, _FORMATS)}").name
    coordinates = checks.instances("coordinates", coordinates, str)
    files.not_an_input([target], [path])
    if path.suffix.lower() in MOTION_SUFFIXES:
        motion = _named(path, read_motion)
        if coordinates:
            motion = _named(path, lambda _: _angles(motion, coordinates))
    else:
        if coordinates:
            raise BadInput("coordinates", Text(f"a {path.suffix} file"), f"coordinates of {' or '.join(MOTION_SUFFIXES)} files")
        motion = _named(path, _table_motion)
    _write(target, motion)
    return target


def _write(target: Path, motion: Motion) -> None:
    if target.suffix in MOTION_SUFFIXES:
        write_motion(target, motion)
    else:
        write_samples(target, ["t_s", *motion.names], [motion.t, *motion.values.T])


def _angles(motion: Motion, coordinates: Sequence[str]) -> Motion:
    for name in coordinates:
        if name not in motion.names:
            raise unknown_name("coordinates", name, motion.names, what="coordinate")
    if motion.in_degrees is None:
        raise BadInput("header", Text("no inDegrees"), "inDegrees=yes or inDegrees=no", hint="the unit of the angles is not known")
    unit = "deg" if motion.in_degrees else "rad"
    names = [f"q{j}_{unit}" for j in range(1, len(coordinates) + 1)]
    values = motion.values[:, [motion.names.index(name) for name in coordinates]]
    most = float(np.nanmax(np.abs(values), initial=0.0))
    if not motion.in_degrees and most > ANGLE.most:
        raise BadInput("header", Text(f"inDegrees=no and an angle of {most:.4g}"), f"angles up to {ANGLE.most:.3g} rad", hint=ANGLE.hint)
    return Motion(names, motion.t, values, motion.in_degrees)


def _table_motion(path: Path) -> Motion:
    import pyarrow as pa

    if path.is_dir():
        raise BadInput("file", Text("a folder"), "one file: data sets are CSV or Parquet")
    if path.suffix.lower() not in SUFFIXES:
        raise BadInput("file", Text(f"suffix {path.suffix!r}"), " or ".join((*SUFFIXES, *MOTION_SUFFIXES, *MARKER_SUFFIXES)))
    table = read_table(path)
    names = list(table.column_names)
    if "t_s" not in names:
        raise BadInput("header", Text("no column t_s"), "time in a column t_s")
    for name in names:
        if not pa.types.is_floating(table.column(name).type):
            raise BadInput(f"column {name}", Text(f"type {table.column(name).type}"), "numbers")
        if not name.isprintable() or "\t" in name or " " in name:
            raise BadInput("header", name, "a name without blanks")
    names.remove("t_s")
    if not names:
        raise BadInput("header", Text("nothing but time"), "columns beside t_s")
    units = {name.rpartition("_")[2] for name in names if name.startswith("q")} & {"deg", "rad"}
    if len(units) > 1:
        raise BadInput("header", Text("angles in degrees and in radians"), "one unit: a MOT file has no other way to say it")
    columns = {name: np.asarray(table.column(name).to_numpy(), dtype=float) for name in ("t_s", *names)}
    if np.isnan(columns["t_s"]).any():
        raise BadInput("column t_s", Text("an empty cell"), "a time stamp in every row")
    values = np.column_stack([columns[name] for name in names])
    return Motion(names, columns["t_s"], values, in_degrees="deg" in units if units else None)


def _named(path: Path, read: Callable[[Path], Read]) -> Read:
    try:
        return read(path)
    except BadInput as error:
        raise error.within(file=path) from None
