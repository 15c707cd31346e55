"""The numeric arrays of a MATLAB file (version 5, 7.3) or of another HDF5 file: `python -m armrs.io.raw.matlab_arrays FILE OUT.npz`.

Damaged files crash both libraries, so that a process of its own reads them (`reader_process`).
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from .. import reader_process

HDF5 = b"\x89HDF\r\n\x1a\n"
_DEEPEST = 4
"""Deepest nesting of structs that is read."""
_MOST = 100_000_000
"""Values of one array of a version 7.3 file, whose size is stated by the file whatever it holds."""


def arrays_of(path: Path) -> dict[str, np.ndarray]:
    """Return the arrays of all tables of a file under numbers; in JSON, under `names` their titles and names, under `units` their units."""
    head = path.read_bytes()[:520]
    units: dict[str, str] = {}
    if HDF5 in (head[:8], head[512:520]):
        tables = _tables(path.stem, _placed(path, units))
    elif path.suffix.lower() == ".mat":
        tables = _version_5(path)
    else:
        raise ValueError("no HDF5 file")
    found: dict[str, np.ndarray] = {}
    names: list[tuple[str, dict[str, str]]] = []
    for title, arrays in tables:
        places = {name: str(len(found) + k) for k, name in enumerate(arrays)}
        found |= {places[name]: value for name, value in arrays.items()}
        names.append((title, places))
    return {"names": np.array(json.dumps(names)), "units": np.array(json.dumps(units)), **found}


def _version_5(path: Path) -> list[tuple[str, dict[str, np.ndarray]]]:
    from scipy.io import loadmat

    try:
        content = loadmat(path, squeeze_me=False, struct_as_record=False)
    except Exception as error:  # the reader raises what its parts raise
        raise ValueError(f"no readable MATLAB file ({error})") from None
    own = {name: value for name, value in content.items() if not name.startswith("__")}
    structs = next((list(v.flat) for v in own.values() if isinstance(v, np.ndarray) and v.dtype == object and v.size > 1), [])
    structs = [_struct(part) for part in structs]
    if structs and all(part is not None for part in structs):
        titled = []
        for k, part in enumerate(structs, start=1):
            placed: dict[str, np.ndarray] = {}
            _collect("", part, placed, 0)
            titled += _tables(f"{path.stem} {k}", placed)
        return titled
    found: dict[str, np.ndarray] = {}
    for name, value in own.items():
        _collect(name, value, found, 0)
    return _tables(path.stem, found)


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
            _collect(f"{name}/{part}" if name else part, getattr(value, part), found, depth + 1)
    elif isinstance(value, np.ndarray) and value.dtype == object and value.size == 1:
        _collect(name, value.flat[0], found, depth)
    else:
        _keep(name, np.asarray(value), found)


def _keep(name: str, value: np.ndarray, found: dict[str, np.ndarray]) -> None:
    if value.ndim == 1:
        value = value[:, None]
    if value.ndim == 2 and value.size > 1 and np.issubdtype(value.dtype, np.number) and not np.iscomplexobj(value):
        found.setdefault(name, value.astype(np.float64))


def _unit_of(item: Any) -> str:
    """Return the attribute `units` of an HDF5 dataset, as h5py, PyTables, netCDF-4 and NWB write it; empty without one."""
    stated = next((item.attrs[key] for key in item.attrs if key.lower() in ("unit", "units")), "")
    stated = stated.flat[0] if isinstance(stated, np.ndarray) and stated.size else stated
    return stated.decode("utf-8", "replace") if isinstance(stated, bytes) else stated if isinstance(stated, str) else ""


def _tables(title: str, placed: dict[str, np.ndarray]) -> list[tuple[str, dict[str, np.ndarray]]]:
    """Return arrays by name; where groups or structs hold arrays of the same names, as those of trials do, each is a table."""
    whole: dict[str, np.ndarray] = {}
    together: dict[str, np.ndarray] = {}
    groups: dict[str, dict[str, np.ndarray]] = {}
    for place, value in placed.items():
        whole.setdefault(place.rsplit("/", 1)[-1], value)
        group, _, inside = place.partition("/")
        if inside:
            groups.setdefault(group, {})[inside] = value
        else:
            together[place] = value
    if len(whole) == len(placed):
        return [(title, whole)]
    if len(groups) == 1:
        return [table for inside in groups.values() for table in _tables(title, inside | together)]
    return [table for group, inside in groups.items() for table in _tables(f"{title} {group}", together | inside)]


def _placed(path: Path, units: dict[str, str]) -> dict[str, np.ndarray]:
    """Return the numeric arrays of an HDF5 file and the fields of its tables by their places, and add to `units` by their names."""
    import h5py

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
            fields = value.dtype.names
            for place, part in [(name, value)] if fields is None else [(f"{name}/{field}", value[field]) for field in fields]:
                if np.issubdtype(part.dtype, np.number):
                    units.setdefault(place.rsplit("/", 1)[-1], _unit_of(item))
                    _keep(place, part.T, found)

    try:
        with h5py.File(path, "r") as file:
            file.visititems(visit)
    except Exception as error:  # h5py raises OSError, RuntimeError, KeyError and others for damaged files
        raise ValueError(f"no readable {'MATLAB' if path.suffix.lower() == '.mat' else 'HDF5'} file ({error})") from None
    return found


if __name__ == "__main__":
    reader_process.serve(arrays_of)
