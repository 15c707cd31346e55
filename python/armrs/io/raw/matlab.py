"""MATLAB files, version 5 (SciPy) and 7.3, and other HDF5 files: vectors by their names, matrices by name and column."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType

import numpy as np

from ...errors import ArmrsError, Text
from .. import reader_process
from .matlab_arrays import HDF5
from .table import NoTable, RawTable, column

SUFFIXES = (".mat", ".h5", ".hdf5")
_FEWEST = 3
_FORCE = re.compile(r"force|kraft|fuerza|forza|^f$", flags=re.IGNORECASE)
_AXES = {2: "yz", 3: "xyz"}
"""Columns of a matrix of forces -> their axes."""


def read_matlab(path: Path) -> list[RawTable]:
    """Read the numeric vectors and matrices of a MATLAB or HDF5 file that are as long as its longest.

    An array of structs, or a cell array of them, is a table for each.

    Raises
    ------
    BadInput
        When it is no such file, or holds no vectors of equal length. Without the file's name in it.
    ArmrsError
        When an HDF5 file, as of version 7.3, needs h5py, of the extra `files`.
    """
    head = path.read_bytes()[:520]
    if HDF5 in (head[:8], head[512:520]) and find_spec("h5py") is None:
        raise ArmrsError('HDF5 files and MATLAB files of version 7.3 need h5py: pip install "armrs[files]"')
    kind = "a MATLAB file of version 5 or 7.3" if path.suffix.lower() == ".mat" else "an HDF5 file"
    with reader_process.content("armrs.io.raw.matlab_arrays", path, kind) as arrays:
        names, units = (json.loads(str(arrays[key])) for key in ("names", "units"))
        return [table_of(path, title, {name: arrays[place] for name, place in of.items()}, units) for title, of in names]


def table_of(path: Path, title: str, arrays: dict[str, np.ndarray], units: Mapping[str, str] = MappingProxyType({})) -> RawTable:
    """Return the vectors among arrays, and the columns of matrices, that are as long as the longest.

    Raises
    ------
    BadInput
        Without one. Without the file's name in it.
    """
    # Samples are along the longer axis.
    tall = {name: (a if a.shape[0] >= a.shape[1] else a.T) for name, a in arrays.items()}
    long = max((len(a) for a in tall.values()), default=0)
    if long < _FEWEST:
        raise NoTable("file", Text(f"no numeric vector of {_FEWEST} samples or more"), "vectors of equal length, one element a sample")
    chosen = {name: a for name, a in tall.items() if len(a) == long}
    columns = []
    for name, a in chosen.items():
        axes = _AXES.get(a.shape[1], "") if _FORCE.search(name) else ""
        names = [name] if a.shape[1] == 1 else [f"{name} {axis}" for axis in axes] or [f"{name}{k}" for k in range(1, a.shape[1] + 1)]
        columns += [column(own, np.ascontiguousarray(values), units.get(name, "")) for own, values in zip(names, a.T, strict=True)]
    left = [name for name in tall if name not in chosen and tall[name].size > 1]
    notes = [f"left out, since they have another length than {long}: {', '.join(left)}"] if left else []
    return RawTable(path, title, tuple(columns), tuple(notes))
