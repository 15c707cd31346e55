"""C3D files, read by ezc3d in a process of its own, because a damaged file can crash that library or block it.

Run as a module (`python -m armrs.io.c3d FILE OUT.npz`) it is that process.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ArmrsError, BadInput, Text, unreadable
from . import reader_process

_BLOCK = 512


@dataclass(frozen=True, eq=False)
class C3D:
    """The content of a C3D file.

    Attributes
    ----------
    labels : list of str
        Names of the points.
    points : ndarray, shape (n_frames, n_points, 3)
        In `unit`; NaN where a point was not seen.
    unit : str
    rate : float
        Frames a second [Hz].
    y_screen : str
        Axis that points up on the screen of the program that wrote it, such as `+Z`; empty where it is not stated.
    analog_labels, analog_units : list of str
        Of the analog channels (force plates, EMG).
    analog : ndarray, shape (n_samples, n_channels)
        In the units above.
    analog_rate : float
        [Hz]
    """

    labels: list[str]
    points: np.ndarray
    unit: str
    rate: float
    y_screen: str
    analog_labels: list[str]
    analog_units: list[str]
    analog: np.ndarray
    analog_rate: float


def read(path: Path) -> C3D:
    """Read a C3D file.

    Raises
    ------
    BadInput
        For a file that is damaged, or that the reader does not survive. Without the file's name in it.
    ArmrsError
        When ezc3d, of the extra `files`, is not installed.
    """
    if find_spec("ezc3d") is None:
        raise ArmrsError('C3D files need ezc3d: pip install "armrs[files]"')
    _check_header(path)
    with reader_process.content("armrs.io.c3d", path, "a whole C3D file") as arrays:
        return _checked(arrays)


def _checked(content: Any) -> C3D:
    points, rate = content["points"], float(content["rate"])
    labels = [str(name) for name in content["labels"]]
    if not (np.isfinite(rate) and rate > 0.0):
        raise BadInput("POINT:RATE", rate, "a rate above 0 Hz")
    if points.ndim != 3 or len(labels) < points.shape[1]:
        raise BadInput("file", Text(f"{len(labels)} labels for {points.shape[1]} points"), "a label for every point")
    points[~np.isfinite(points).all(axis=2)] = np.nan
    return C3D(
        labels=labels[: points.shape[1]],
        points=points,
        unit=str(content["unit"]),
        rate=rate,
        y_screen=str(content["y_screen"]),
        analog_labels=[str(name) for name in content["analog_labels"]],
        analog_units=[str(name) for name in content["analog_units"]],
        analog=content["analog"],
        analog_rate=float(content["analog_rate"]),
    )


def _check_header(path: Path) -> None:
    """Refuse a file that is no C3D, or shorter than by its header, before a reader uses its counts."""
    try:
        with path.open("rb") as stream:
            head = stream.read(_BLOCK)
            size = stream.seek(0, 2)
            if len(head) < _BLOCK or head[1] != 0x50 or head[0] == 0:
                raise BadInput("file", Text("no C3D mark at its start"), "a C3D file")
            stream.seek(_BLOCK * (head[0] - 1) + 3)
            processor = stream.read(1)
    except OSError as error:
        raise unreadable(error) from None
    if processor not in (b"\x54", b"\x55", b"\x56"):
        raise BadInput("file", Text("no parameters where the header says"), "a whole C3D file")
    if processor != b"\x54":  # other byte orders are left to the reader
        return
    points, analog, first, last, _, scale, start = struct.unpack_from("<5HfH", head, 2)
    frames = last - first + 1
    needed = _BLOCK * (start - 1) + frames * (points * 4 + analog) * (4 if scale < 0 else 2)
    if points + analog == 0 or frames <= 0:
        raise BadInput(
            "header", Text(f"{points} points, {analog} analog samples, {max(frames, 0)} frames"), "points or channels with samples"
        )
    if last != 0xFFFF and size < needed:
        raise BadInput("file", Text(f"{size} bytes"), f"{needed} bytes, as its header says", hint="the file is cut off")


def _texts(group: Any, name: str) -> list[str]:
    return [str(text).strip() for text in group[name]["value"]] if name in group else []


def _first(group: Any, name: str, default: float) -> float:
    value = group[name]["value"] if name in group else []
    return float(value[0]) if len(value) else default


def _arrays(path: Path) -> dict[str, Any]:
    import ezc3d

    content = ezc3d.c3d(str(path))
    parameters = content["parameters"]
    point, analog = parameters["POINT"], parameters.get("ANALOG", {})
    points = np.asarray(content["data"]["points"], dtype=float)
    samples = np.asarray(content["data"]["analogs"], dtype=float)
    units, y_screen = _texts(point, "UNITS"), _texts(point, "Y_SCREEN")
    return {
        "labels": np.array(_texts(point, "LABELS"), dtype=str),
        "points": np.transpose(points[:3], (2, 1, 0)),
        "unit": units[0] if units else "",
        "rate": _first(point, "RATE", 0.0),
        "y_screen": y_screen[0] if y_screen else "",
        "analog_labels": np.array(_texts(analog, "LABELS"), dtype=str),
        "analog_units": np.array(_texts(analog, "UNITS"), dtype=str),
        "analog": samples.reshape(samples.shape[-2], -1).T if samples.size else np.empty((0, 0)),
        "analog_rate": _first(analog, "RATE", 0.0),
    }


if __name__ == "__main__":
    reader_process.serve(_arrays)
