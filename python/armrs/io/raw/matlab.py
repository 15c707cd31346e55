"""MATLAB files, version 5 (SciPy) and 7.3 (HDF5): vectors by their names, matrices by name and column."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import ArmrsError, BadInput, Text
from .table import NoTable, RawTable, column

SUFFIXES = (".mat",)
_HDF5 = b"\x89HDF\r\n\x1a\n"
_FEWEST = 3
_FORCE = re.compile(r"force|kraft|fuerza|forza|^f$", flags=re.IGNORECASE)
_AXES = {2: "yz", 3: "xyz"}
"""Columns of a matrix of forces -> their axes."""
_DEEPEST = 4
"""Structs within structs that are looked into."""
_MOST = 100_000_000
"""Values of one array of a version 7.3 file, whose size is stated by the file whatever it holds."""


def read_matlab(path: Path) -> list[RawTable]:
    """Read the numeric vectors and matrices of a MATLAB file that are as long as its longest.

    An array of structs, or a cell array of them, is a table for each.

    Raises
    ------
    BadInput
        When it is no MATLAB file, or holds no vectors of equal length. Without the file's name in it.
    ArmrsError
        When a version 7.3 file needs h5py, of the extra `files`.
    """
    head = path.read_bytes()[:520]
    if head[:8] == _HDF5 or head[512:520] == _HDF5:
        return [table_of(path, path.stem, _version_7_3(path))]
    return [table_of(path, title, arrays) for title, arrays in _version_5(path)]


def table_of(path: Path, title: str, arrays: dict[str, np.ndarray]) -> RawTable:
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
        columns += [column(own, np.ascontiguousarray(values)) for own, values in zip(names, a.T, strict=True)]
    left = [name for name in tall if name not in chosen and tall[name].size > 1]
    notes = [f"left out, since they have another length than {long}: {', '.join(left)}"] if left else []
    return RawTable(path, title, tuple(columns), tuple(notes))


def _version_5(path: Path) -> list[tuple[str, dict[str, np.ndarray]]]:
    from scipy.io import loadmat

    try:
        content = loadmat(path, squeeze_me=False, struct_as_record=False)
    except Exception as error:  # the reader raises what its parts raise
        raise BadInput("file", Text(f"no readable MATLAB file ({error})"), "a MATLAB file of version 5 or 7.3") from None
    own = {name: value for name, value in content.items() if not name.startswith("__")}
    structs = next((list(v.flat) for v in own.values() if isinstance(v, np.ndarray) and v.dtype == object and v.size > 1), [])
    structs = [_struct(part) for part in structs]
    if structs and all(part is not None for part in structs):
        titled = []
        for k, part in enumerate(structs, start=1):
            arrays: dict[str, np.ndarray] = {}
            _collect("", part, arrays, 0)
            titled.append((f"{path.stem} {k}", arrays))
        return titled
    found: dict[str, np.ndarray] = {}
    for name, value in own.items():
        _collect(name, value, found, 0)
    return [(path.stem, found)]


def _struct(value: Any) -> Any:
    """Return the struct that a cell holds, None where it holds something else."""
    while isinstance(value, np.ndarray) and value.dtype == object and value.size == 1:
        value = value.flat[0]
    return value if hasattr(value, "_fieldnames") else None


def _collect(name: str, value: Any, found: dict[str, np.ndarray], depth: int) -> None:
    if depth > _DEEPEST:
        return
    if hasattr(value, "_fieldnames"):
        for part in value._fieldnames:
            _collect(part, getattr(value, part), found, depth + 1)
    elif isinstance(value, np.ndarray) and value.dtype == object and value.size == 1:
        _collect(name, value.flat[0], found, depth)
    else:
        _keep(name, np.asarray(value), found)


def _keep(name: str, value: np.ndarray, found: dict[str, np.ndarray]) -> None:
    if value.ndim == 1:
        value = value[:, None]
    if value.ndim == 2 and value.size > 1 and np.issubdtype(value.dtype, np.number) and not np.iscomplexobj(value):
        found.setdefault(name, value.astype(np.float64))


def _version_7_3(path: Path) -> dict[str, np.ndarray]:
    try:
        import h5py
    except ImportError:
        raise ArmrsError('MATLAB files of version 7.3 need h5py: pip install "armrs[files]"') from None
    found: dict[str, np.ndarray] = {}

    def visit(name: str, item: Any) -> None:
        # MATLAB keeps contents of cells and strings in groups of its own; it stores matrices column by column.
        if (
            isinstance(item, h5py.Dataset)
            and not name.startswith("#")
            and item.attrs.get("MATLAB_class", b"") != b"char"
            and item.ndim <= 2
        ):
            if item.size > _MOST:
                raise ValueError(f"{name} has {item.size} values, at most {_MOST} are read")
            value = np.asarray(item[()])
            if np.issubdtype(value.dtype, np.number):
                _keep(name.rsplit("/", 1)[-1], value.T, found)

    try:
        with h5py.File(path, "r") as file:
            file.visititems(visit)
    except Exception as error:  # h5py raises OSError, RuntimeError, KeyError and others for damaged files
        raise BadInput("file", Text(f"no readable MATLAB file ({error})"), "a MATLAB file of version 5 or 7.3") from None
    return found
