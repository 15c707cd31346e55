"""Marker trajectories: joint angles and segment lengths of a planar arm.

A plane is fitted to the directions of all segments over the whole movement; the joints are points on markers or half way between them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import checks
from ..errors import BadInput, Text, unknown_name
from . import c3d
from .trial import MOVED

METRES = {"mm": 1e-3, "m": 1.0, "cm": 1e-2}
MARKER_SUFFIXES = (".c3d", ".trc")
PLANAR = math.radians(5.0)
"""Root mean square angle between segments and plane up to which a movement counts as planar [rad]."""
_SEGMENT = (0.005, 10.0)
"""Mean length of a segment of any arm [m]."""
_LEAST_SPREAD = 1e-3
"""Segments that turn less than this, relative to their length, do not span a plane."""
_AXES = {"x": 0, "y": 1, "z": 2}


@dataclass(frozen=True, eq=False)
class Markers:
    """Marker trajectories.

    Attributes
    ----------
    names : list of str
        Labels; what stands before a colon names the subject.
    t : ndarray, shape (n,)
        [s]
    positions : ndarray, shape (n, len(names), 3)
        [m]; NaN where a marker was not seen.
    up : str
        Default of the axis that points up: `x`, `y`, `z`.
    warnings: tuple of str
        Remarks of the reader.
    """

    names: list[str]
    t: np.ndarray
    positions: np.ndarray
    up: str
    warnings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        names, n = list(checks.instances("names", self.names, str)), None
        t = checks.samples("t", self.t, "s", shape=(n,))
        shape = (len(t), len(names), 3)
        positions = checks.samples("positions", self.positions, "m", shape=shape)
        for name, value in (("names", names), ("t", t), ("positions", positions), ("up", checks.text("up", self.up))):
            object.__setattr__(self, name, value)

    def point(self, text: str) -> np.ndarray:
        """Return the trajectory of a marker, or of the mean of several written `A+B`, shape (n, 3) [m]; NaN where any is missing.

        Many programs write a marker that is not seen at exactly 0 0 0: one that is elsewhere in other samples is missing there.
        """
        return np.mean([self._position(part.strip()) for part in text.split("+")], axis=0)

    def _position(self, name: str) -> np.ndarray:
        at = self.positions[:, self._index(name)]
        lost = (at == 0.0).all(axis=1)
        elsewhere = np.isfinite(at).all(axis=1) & ~lost
        return np.where(lost[:, None], np.nan, at) if elsewhere.any() else at

    def _index(self, name: str) -> int:
        found = [k for k, label in enumerate(self.names) if name in (label, label.rpartition(":")[2])]
        if not found:
            raise unknown_name("points", name, [label.rpartition(":")[2] for label in self.names], what="marker")
        if len(found) > 1:
            labels = list(dict.fromkeys(self.names[k] for k in found))
            allowed = f"one of {', '.join(labels)}" if len(labels) > 1 else f"a name that the file has once, not {len(found)} times"
            raise BadInput("points", name, allowed)
        return found[0]


@dataclass(frozen=True, eq=False)
class PlanarMotion:
    """Joint angles and segment lengths that markers show.

    Attributes
    ----------
    t : ndarray, shape (n,)
        [s]
    q : ndarray, shape (n, n_joints)
        Joint angles in the plane [rad]; NaN where a marker was missing.
    lengths, length_stds : ndarray, shape (n_joints,)
        Mean distance of neighbouring points over the samples that show both, and its standard deviation [m].
    flexion : ndarray, shape (n_joints - 1, 2)
        Smallest and largest angle between neighbouring segments in space [rad].
    normal, forward, upward : ndarray, shape (3,)
        Unit vectors of the plane in the frame of the file.
    out_of_plane : float
        Root mean square angle between the segments and the plane [rad].
    out_of_plane_most : float
        The largest such angle [rad].
    tilt : float
        Angle between the plane and the vertical [rad].
    base_motion : float
        Root mean square motion of the first point [m].
    base : ndarray, shape (n, 2)
        Path of the first point, forward and up from the origin of the file [m]: the `base` of a trial whose shoulder moves.
    """

    t: np.ndarray
    q: np.ndarray
    lengths: np.ndarray
    length_stds: np.ndarray
    flexion: np.ndarray
    normal: np.ndarray
    forward: np.ndarray
    upward: np.ndarray
    out_of_plane: float
    out_of_plane_most: float
    tilt: float
    base_motion: float
    base: np.ndarray

    @property
    def is_planar(self) -> bool:
        """Whether the movement may be taken for one in a plane."""
        return bool(self.out_of_plane <= PLANAR)

    @property
    def missing(self) -> float:
        """Share of samples at which a marker was missing."""
        return float(np.mean(~np.isfinite(self.q).all(axis=1)))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data with units in the names."""
        return {
            "lengths_m": self.lengths,
            "length_stds_m": self.length_stds,
            "flexion_deg": np.degrees(self.flexion),
            "q_range_deg": np.degrees([np.nanmin(self.q, axis=0), np.nanmax(self.q, axis=0)]).T,
            "plane": {
                "normal": self.normal,
                "forward": self.forward,
                "upward": self.upward,
                "out_of_plane_rms_deg": math.degrees(self.out_of_plane),
                "out_of_plane_most_deg": math.degrees(self.out_of_plane_most),
                "tilt_deg": math.degrees(self.tilt),
                "planar": self.is_planar,
            },
            "base_motion_rms_m": self.base_motion,
            "samples": len(self.t),
            "missing_share": self.missing,
        }

    def warnings(self) -> list[str]:
        """Return remarks for the user, one line each."""
        lines = []
        if not self.is_planar:
            angle = f"{np.degrees(self.out_of_plane):.3g}° (rms) and up to {np.degrees(self.out_of_plane_most):.3g}°"
            lines.append(f"not a planar movement: the segments leave the plane by {angle}; the angles are those of their shadows in it")
        if self.tilt > PLANAR:
            lines.append(
                f"the plane leans {np.degrees(self.tilt):.3g}° from the vertical: gravity in it is {np.cos(self.tilt):.3g} of 9.81 m/s²"
            )
        if self.base_motion > MOVED:
            moved = f"{1e3 * self.base_motion:.2g} mm (rms)"
            lines.append(f"the first point, and so the trunk, moves by {moved}: its path can be given as columns by_m and bz_m")
        if self.missing > 0.0:
            lines.append(f"markers are missing in {100 * self.missing:.2g} % of the samples: their cells stay empty")
        return lines


def read_c3d(path: Path) -> Markers:
    """Read the points of a C3D file.

    Raises
    ------
    BadInput
        Without the file's name in it.
    ArmrsError
        When ezc3d is not installed.
    """
    return markers_of(c3d.read(path))


def markers_of(content: c3d.C3D) -> Markers:
    """Return the points of a C3D file that was read; errors as in `read_c3d`."""
    if content.unit not in METRES:
        raise BadInput("POINT:UNITS", content.unit or Text("nothing"), " or ".join(METRES))
    if not content.points.size:
        raise BadInput(
            "file", Text(f"{len(content.labels)} labels and data of shape {content.points.shape}"), "points with labels and samples"
        )
    notes: tuple[str, ...] = ()
    if content.y_screen.lower().lstrip("+") not in ("", "z"):
        notes = (f"POINT:Y_SCREEN of the file is {content.y_screen}, which may be what points up; z is taken unless --up names another",)
    t = np.arange(len(content.points)) / content.rate
    return Markers(content.labels, t, METRES[content.unit] * content.points, up="z", warnings=notes)


def _check_places(points: Sequence[str], at: np.ndarray, lengths: np.ndarray) -> None:
    """Refuse points, (n, k, 3), that were never seen or are no joints of an arm; lengths of the segments, (n, k - 1) [m]."""
    if lengths.min() < 1e-6:
        raise BadInput("points", Text("two neighbours at one place"), "points that lie apart")
    for k, length in enumerate(lengths.mean(axis=0), start=1):
        if not at[:, k].any():
            raise BadInput("points", Text(f"{points[k]} at 0 0 0 in all samples"), "markers that were seen")
        if not _SEGMENT[0] <= length <= _SEGMENT[1]:
            found = Text(f"{length:.3g} m from {points[k - 1]} to {points[k]}")
            raise BadInput("points", found, f"{_SEGMENT[0]:g} to {_SEGMENT[1]:g} m", hint="is the unit of the file right?")


def planar_motion(markers: Markers, points: Sequence[str], *, up: str | None = None, forward: str | None = None) -> PlanarMotion:
    """Turn marker trajectories into joint angles and segment lengths of a planar arm.

    Parameters
    ----------
    markers : Markers
    points : sequence of str
        Joints from the proximal one to the handle: a marker, or `A+B` for the point half way, which is missing where one of them is.
    up, forward : str, optional
        Axis of the file that points up (that of the format when absent) and one that points forward, such as `z` or `-y`. Without
        `forward`, the end of the arm is forward of its base on average.

    Returns
    -------
    PlanarMotion

    Raises
    ------
    BadInput
        For markers that are not there, points that do not move apart, and a plane that lies flat.

    Notes
    -----
    The plane is spanned by the directions of all segments at all times, whatever the base does: its normal is the direction in which
    they reach least (singular value decomposition). Lengths and flexion are taken in space, angles from shadows in the plane.
    """
    checks.instance("markers", markers, Markers)
    points = checks.instances("points", points, str)
    if len(points) < 2:
        raise BadInput("points", Text(f"{len(points)} points"), "two or more, from the first joint to the handle")
    at = np.stack([markers.point(text) for text in points], axis=1)
    there = np.isfinite(at).all(axis=(1, 2))
    if there.sum() < 2:
        raise BadInput("points", Text("no two samples at which all of them are seen"), "samples with all markers")
    segments = np.diff(at, axis=1)
    distances = np.linalg.norm(segments, axis=2)
    seen, lengths = segments[there], distances[there]
    _check_places(points, at[there], lengths)
    scatter = np.einsum("nki,nkj->ij", seen, seen) / seen.shape[0]
    spread, axes = np.linalg.eigh(scatter)
    if np.sqrt(max(spread[1], 0.0) / spread[2]) < _LEAST_SPREAD:
        raise BadInput("points", Text("points on one line at all times"), "a movement that spans a plane")
    normal = axes[:, 0]
    vertical = _axis(markers.up if up is None else up, "up")
    upward = vertical - normal * (normal @ vertical)
    if np.linalg.norm(upward) < 0.1:
        raise BadInput(
            "up", Text("a plane that lies flat"), "a plane of movement along the vertical, or another axis", hint="up may be x, y or z"
        )
    upward /= np.linalg.norm(upward)
    ahead = np.cross(upward, normal)
    reach = np.mean(at[there, -1] - at[there, 0], axis=0) if forward is None else _axis(forward, "forward")
    if ahead @ reach < 0.0:
        ahead, normal = -ahead, -normal
    absolute = np.arctan2(segments @ upward, segments @ ahead)
    q = np.column_stack([_unwrapped(a) for a in np.diff(absolute, axis=1, prepend=0.0).T])
    lean = np.arcsin(np.clip((seen @ normal) / lengths, -1.0, 1.0))
    unit = seen / lengths[:, :, None]
    between = np.arccos(np.clip(np.sum(unit[:, 1:] * unit[:, :-1], axis=2), -1.0, 1.0))
    base = at[there, 0]
    return PlanarMotion(
        t=markers.t,
        q=q,
        lengths=np.nanmean(distances, axis=0),
        length_stds=np.nanstd(distances, axis=0),
        flexion=np.column_stack([between.min(axis=0), between.max(axis=0)]),
        normal=normal,
        forward=ahead,
        upward=upward,
        out_of_plane=float(np.sqrt(np.mean(lean**2))),
        out_of_plane_most=float(np.abs(lean).max()),
        tilt=float(np.arcsin(min(1.0, abs(float(normal @ vertical))))),
        base=at[:, 0] @ np.column_stack([ahead, upward]),
        base_motion=float(np.sqrt(np.mean(np.sum((base - base.mean(axis=0)) ** 2, axis=1)))),
    )


def _axis(text: str, place: str) -> np.ndarray:
    name = checks.text(place, text).lower().lstrip("+-")
    if name not in _AXES or len(text) - len(name) > 1:
        raise BadInput(place, text, "x, y, z, -x, -y or -z")
    result = np.zeros(3)
    result[_AXES[name]] = -1.0 if text.startswith("-") else 1.0
    return result


def _unwrapped(angle: np.ndarray) -> np.ndarray:
    """Return angles that begin between -180° and 180° and do not jump by whole turns."""
    there = np.isfinite(angle)
    result = np.full_like(angle, np.nan)
    wrapped = np.arctan2(np.sin(angle[there]), np.cos(angle[there]))
    result[there] = np.unwrap(wrapped)
    return result
