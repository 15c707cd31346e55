"""Recordings in the formats of laboratories: any table, workbook or motion file becomes named columns with units."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ...errors import NO_FILE, BadInput, Text
from . import matlab, numpy_files, self_describing, text_formats, text_table, workbook
from .table import NoTable as NoTable
from .table import RawColumn as RawColumn
from .table import RawTable as RawTable

_READERS: dict[tuple[str, ...], Callable[[Path], RawTable | list[RawTable]]] = {
    text_table.SUFFIXES: text_formats.read_text,
    workbook.SUFFIXES: workbook.read_workbook,
    matlab.SUFFIXES: matlab.read_matlab,
    numpy_files.SUFFIXES: numpy_files.read_archive,
    self_describing.PARQUET_SUFFIXES: self_describing.read_parquet,
    self_describing.MOTION_SUFFIXES: self_describing.read_motion_table,
    self_describing.C3D_SUFFIXES: self_describing.read_c3d_table,
    self_describing.TRC_SUFFIXES: self_describing.read_trc_table,
}
"""By suffix. A new format is one module and one line here."""

_INSTEAD = {
    (".ods", ".xlsb", ".numbers"): "save it as .xlsx or .csv",
    (".gz", ".zip", ".bz2", ".xz", ".7z"): "unpack it first",
    (".tdms", ".acq", ".adicht", ".bag", ".mcap", ".tdf", ".slx"): "export it as text, .mat or C3D from its program",
}
"""What to do with files of other formats."""

SUFFIXES = tuple(suffix for suffixes in _READERS for suffix in suffixes)


def read_raw(path: Path) -> list[RawTable]:
    """Read every table of a recording.

    Parameters
    ----------
    path : Path
        By its suffix: text (`.csv`, `.txt`, `.tsv`, `.dat`, `.asc`, `.log`, `.lvm`, `.xls` between tabs), also as Vicon,
        Qualisys, OptiTrack, LabChart and Biodex export it;
        Excel, MATLAB, HDF5, NumPy, Parquet, OpenSim motion (`.mot`, `.sto`), TRC or C3D.

    Raises
    ------
    BadInput
        Names the file, and what was expected in it.
    """
    for suffixes, read in _READERS.items():
        if path.suffix.lower() in suffixes:
            if not path.is_file():
                if path.exists():
                    raise BadInput("file", Text("no regular file"), "a file that exists", file=path)
                raise BadInput("file", NO_FILE, "a file that exists", file=path, kind="missing_file")
            try:
                found = read(path)
            except BadInput as error:
                raise error.within(file=error.file or path) from None
            except (OSError, ValueError) as error:
                raise BadInput("file", Text(str(error).splitlines()[0]), "a file that can be read", file=path) from None
            return found if isinstance(found, list) else [found]
    hint = next((step for suffixes, step in _INSTEAD.items() if path.suffix.lower() in suffixes), None)
    raise BadInput("file", Text(f"suffix {path.suffix!r}"), f"one of {', '.join(SUFFIXES)}", file=path, hint=hint)
