"""NumPy archives: vectors by their names, matrices by name and column."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...errors import BadInput, Text
from .matlab import table_of
from .table import RawTable

SUFFIXES = (".npz",)


def read_archive(path: Path) -> RawTable:
    """Read the numeric arrays of an archive that are as long as its longest.

    Raises
    ------
    BadInput
        When it is no archive of numbers. Without the file's name in it.
    """
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as content:
            arrays = {name: np.asarray(content[name]) for name in content.files}
    except Exception as error:  # zip, zlib and numpy raise what their parts raise
        raise BadInput("file", Text(f"no readable NumPy archive ({str(error).splitlines()[0]})"), "arrays of numbers (.npz)") from None
    kept = {
        name: (a[:, None] if a.ndim == 1 else a).astype(np.float64)
        for name, a in arrays.items()
        if a.ndim in (1, 2) and a.size > 1 and np.issubdtype(a.dtype, np.number) and not np.iscomplexobj(a)
    }
    return table_of(path, path.stem, kept)
