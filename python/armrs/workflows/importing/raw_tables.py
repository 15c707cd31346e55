"""The raw tables of an import, without files that are no recordings and without duplicates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from dataclasses import replace as changed
from pathlib import Path

import numpy as np

from ...errors import BadInput, Text
from ...io.markers import planar_motion
from ...io.raw import SUFFIXES, NoTable, RawColumn, RawTable, read_raw
from . import column_guess, joint_markers

_AXES = ("x", "y", "z")
_PROJECTED = {"Fy": "force forward", "Fz": "force upward", "Mx": "moment about the normal"}
"""Names of the columns of what is projected onto the plane of the movement."""
_AXES_STATED = {"F": "forward is {}, up is {}", "M": "the normal of the plane is {}"}
_MOST = 5
"""Files that a line names at most."""


@dataclass
class Sources:
    """What an import reads.

    Attributes
    ----------
    tables : list of RawTable
    in_folders : set of Path
        Files that were found in a folder: one without a table is left out, one that was named is refused.
    notes : list of str
        What was left out, and why.
    points : tuple of str
        Markers of the joints: those that were named, or inferred from the names in the first file with markers.
    """

    tables: list[RawTable] = field(default_factory=list)
    in_folders: set[Path] = field(default_factory=set)
    notes: list[str] = field(default_factory=list)
    points: tuple[str, ...] = ()


def read_all(
    paths: Sequence[Path],
    points: tuple[str, ...],
    n_joints: int,
    problems: list[BadInput],
    tell: Callable[[str, float], None] = lambda stage, share: None,
) -> Sources:
    """Read files, and the recordings in folders by the order of their names; what cannot be read is added to `problems`.

    `tell` is called with the file that is read and the share of files that were read.
    """
    found = Sources(points=points)
    listed = [file for path in paths for file in _files(path, found, problems)]
    for k, file in enumerate(listed):
        tell(f"reading {file.name}", k / len(listed))
        try:
            tables = read(file)
            _guess_points(tables, n_joints, found)
            found.tables += [_with_angles(table, found.points) for table in tables]
        except NoTable as error:
            if file in found.in_folders:
                found.notes.append(f"left out, since it holds no table: {file}")
            else:
                problems.append(error)
        except BadInput as error:
            problems.append(error.within(file=error.file or file))
    found.tables = _once(found.tables, found.notes)
    return found


def _files(path: Path, found: Sources, problems: list[BadInput]) -> list[Path]:
    if not path.is_dir():
        return [path]
    inside = sorted(file for file in path.iterdir() if file.is_file() and not file.name.startswith((".", "~$")))
    recordings = [file for file in inside if file.suffix.lower() in SUFFIXES]
    others = [file.name for file in inside if file.suffix.lower() not in (*SUFFIXES, ".toml")]
    if not recordings:
        below = sorted(
            folder.name for folder in path.iterdir() if folder.is_dir() and any(f.suffix.lower() in SUFFIXES for f in folder.iterdir())
        )
        hint = f"name its folders: {', '.join(below[:_MOST])}" if below else f"it holds {', '.join(others[:_MOST])}" if others else None
        problems.append(BadInput("RAW", Text("a folder without recordings"), f"files of {', '.join(SUFFIXES)}", file=path, hint=hint))
    elif others:
        more = f" and {len(others) - _MOST} more" if len(others) > _MOST else ""
        found.notes.append(f"left out, by their suffixes: {', '.join(others[:_MOST])}{more}")
    found.in_folders.update(recordings)
    return recordings


def _guess_points(tables: Sequence[RawTable], n_joints: int, found: Sources) -> None:
    """Take the markers of the joints from their names in the first table with markers and no angles, unless they were named."""
    if found.points:
        return
    for table in tables:
        if table.markers is not None and not any((column_guess.symbol_of(c) or "").startswith("q") for c in table.columns):
            found.points = joint_markers.guess(table.markers.names, n_joints)
            if found.points:
                found.notes.append(f"joints and handle are the markers {', '.join(found.points)}, by their names; --points names others")
            return


def read(path: Path, points: tuple[str, ...] = ()) -> list[RawTable]:
    """Return the tables of a file; markers become angles where `points` names those of the joints."""
    try:
        return [_with_angles(table, points) for table in read_raw(path)]
    except BadInput as error:
        raise error.within(file=error.file or path) from None


def _once(tables: Sequence[RawTable], notes: list[str]) -> list[RawTable]:
    """Return tables without those that hold the samples of another, such as a workbook beside the text exported from it."""
    kept: list[RawTable] = []
    for table in tables:
        same = next((other for other in kept if _same_samples(table, other)), None)
        if same is None:
            kept.append(table)
        else:
            notes.append(f"left out, since it holds the same samples as {same.called}: {table.called}")
    return kept


def _same_samples(a: RawTable, b: RawTable) -> bool:
    """Whether two tables hold the same numbers, to the rounding of the coarser."""
    if a.n_rows != b.n_rows or len(a.columns) != len(b.columns) or a.n_rows == 0:
        return False
    return all(_same(one.values, other.values) for one, other in zip(a.columns, b.columns, strict=True))


def _same(a: np.ndarray, b: np.ndarray) -> bool:
    known = np.isfinite(a)
    if not np.array_equal(known, np.isfinite(b)) or not known.any():
        return bool(np.array_equal(known, np.isfinite(b)))
    within = 0.5 * max(_step(a[known]), _step(b[known])) + 1e-9 * float(np.abs(a[known]).max())
    return bool(np.abs(a[known] - b[known]).max() <= within)


def _step(values: np.ndarray) -> float:
    """Return the smallest difference between different values, at least the unit of their last digit; 0 where all are equal."""
    steps = np.diff(np.unique(values))
    return float(steps.min()) if steps.size else 0.0


def _with_angles(table: RawTable, points: tuple[str, ...]) -> RawTable:
    """Return a table with the angles that its markers show, on their clock, and its forces in the plane of the movement."""
    if table.markers is None or not points:
        return table
    motion = planar_motion(table.markers, points)
    found = [RawColumn("time", "time", "s", motion.t)]
    found += [RawColumn(f"q{j}", f"q{j}", "rad", np.ascontiguousarray(q)) for j, q in enumerate(motion.q.T, start=1)]
    clock = next((c.values for c in table.columns if column_guess.symbol_of(c) == "t"), motion.t)
    others = [
        changed(c, values=np.interp(motion.t, clock, c.values))
        for c in table.columns
        if not (symbol := column_guess.symbol_of(c) or "").startswith(("q", "dq")) and symbol != "t"
    ]
    plane = np.array([motion.forward, motion.upward])
    others, notes = _projected(others, plane)
    notes = [*table.notes, f"angles from the markers {', '.join(points)}", *motion.warnings(), *notes]
    return RawTable(table.path, table.title, (*found, *others), tuple(notes), plane=plane)


def in_plane(forces: RawTable, angles: RawTable) -> RawTable:
    """Return a table of forces in the plane of the movement that the markers of another recording show, as it is without markers."""
    if angles.plane is None:
        return forces
    found, notes = _projected(forces.columns, angles.plane)
    return changed(forces, columns=tuple(found), notes=(*forces.notes, *notes))


def _projected(own: Sequence[RawColumn], plane: np.ndarray) -> tuple[list[RawColumn], list[str]]:
    """Return columns with a force of three components in the plane, and a moment about its normal; remarks on that.

    `plane` are the directions forward and up, (2, 3), in the axes of force and moment.
    """
    kept, notes = list(own), []
    for kind, said, names, directions in (
        ("F", "forces", ("Fy", "Fz"), plane),
        ("M", "moments", ("Mx",), np.cross(plane[:1], plane[1:])),
    ):
        axes = {symbol: c for c in own if (symbol := column_guess.symbol_of(c) or "") in {kind + axis for axis in "xyz"}}
        several = sum((column_guess.symbol_of(c) or "") in axes for c in own) > len(axes)
        if len(axes) < len(_AXES) or several or len({c.unit for c in axes.values()}) > 1:
            continue
        parts = [axes[kind + axis] for axis in _AXES]
        in_file = np.column_stack([c.values for c in parts])
        kept = [c for c in kept if not any(c is part for part in parts)]
        kept += [RawColumn(_PROJECTED[n], n, parts[0].unit, in_file @ d) for n, d in zip(names, directions, strict=True)]
        words = (f"({' '.join(f'{value + 0.0:+.3f}' for value in np.round(d, 3) + 0.0)})" for d in directions)
        names_of = ", ".join(sorted(c.name for c in parts))
        notes.append(f"{said}: {names_of} are taken in the axes of the markers; {_AXES_STATED[kind].format(*words)}")
    return kept, notes
