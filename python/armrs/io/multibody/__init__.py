"""Models of other tools: URDF (ROS, Pinocchio), MJCF (MuJoCo) and OSIM (OpenSim).

Each format holds a part of what acts on an arm. What it cannot hold is listed, never dropped silently.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ... import checks
from ...errors import ArmrsWarning, BadInput, Text
from ...model import Model, load_model
from .. import files
from ..tomlfile import read_text
from . import mjcf, osim, urdf
from .chain import Imported
from .joints import Exported

_WRITERS: dict[str, Callable[[Model], Exported]] = {".urdf": urdf.write, ".xml": mjcf.write, ".osim": osim.write}
_READERS: dict[str, Callable[[str], Imported]] = {".urdf": urdf.read, ".xml": mjcf.read}
_LARGEST = 16 << 20


@dataclass(frozen=True)
class ExportedModel:
    """A model in the format of another tool.

    Attributes
    ----------
    path : Path
    lost : tuple of str
        What the format cannot hold, a line each.
    """

    path: Path
    lost: tuple[str, ...]


def export_model(model: Model | str | os.PathLike[str], path: str | os.PathLike[str]) -> ExportedModel:
    """Write a model for another tool.

    Parameters
    ----------
    model : Model or path
    path : path
        Its suffix is the format: `.urdf`, `.xml` (MJCF) or `.osim`.

    Returns
    -------
    ExportedModel

    Raises
    ------
    BadInput
        For another suffix.

    Examples
    --------
    >>> import armrs, tempfile
    >>> segment = armrs.Segment("arm", length=0.3, mass=1.0, com=0.15, inertia=0.0075)
    >>> model = armrs.Model((segment,), (armrs.Joint("shoulder", stiffness=1.0, coulomb=0.1),))
    >>> armrs.export_model(model, tempfile.gettempdir() + "/arm.urdf").lost
    ('joint 1: stiffness 1 N m/rad about 0 rad', 'gravity: set by the program that reads the file')
    """
    target = checks.path("path", path)
    loaded = model if isinstance(model, Model) else load_model(model)
    write = _WRITERS.get(target.suffix.lower())
    if write is None:
        raise BadInput("path", Text(f"suffix {target.suffix!r}"), f"one of {', '.join(_WRITERS)} (MJCF is .xml)", file=path)
    done = write(loaded)
    files.write_text(target, done.text, kind=target.suffix.lower())
    return ExportedModel(target, done.lost)


def import_model(path: str | os.PathLike[str]) -> Model:
    """Read a planar chain from URDF or MJCF.

    Parameters
    ----------
    path : path
        A `.urdf` or MJCF `.xml` file with one unbranched chain of hinges whose axes are parallel and horizontal.

    Returns
    -------
    Model
        Angles are counted as in the file, from the line of the segment before; of the first segment from forward. Where the file
        counts from elsewhere, or forward is not its +y, a warning states it.

    Raises
    ------
    BadInput
        For a chain that is not planar, that branches, or that has joints or elements without an equal here.
    """
    found = read_model(path)
    for note in found.notes:
        warnings.warn(note, ArmrsWarning, stacklevel=2)
    return found.model


def read_model(path: str | os.PathLike[str]) -> Imported:
    """Return what `import_model` does, with remarks for its user."""
    source = checks.path("path", path)
    read = _READERS.get(source.suffix.lower())
    if read is None:
        raise BadInput("path", Text(f"suffix {source.suffix!r}"), f"one of {', '.join(_READERS)} (MJCF is .xml)", file=path)
    try:
        return read(read_text(source, "an XML file", most=_LARGEST))
    except BadInput as error:
        raise error.within(file=path) from None
