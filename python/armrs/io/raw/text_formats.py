"""The reader of each text file, by the program that wrote it; tables of other programs go to `text_table`."""

from __future__ import annotations

from pathlib import Path

from . import biodex, delsys, labchart, motive, qualisys, text_table, vicon
from .table import RawTable

_PROGRAMS = (vicon, qualisys, motive, biodex, labchart, delsys)
"""Each `recognises` a text by its first lines, and `read`s it. A new one is one module and one name here."""


def read_text(path: Path) -> list[RawTable]:
    """Read a text file, by the layout of the program that wrote it; nothing where it is read with another file.

    Raises
    ------
    BadInput
        Names what was expected in the file, without the file's name.
    """
    lines, encoding = text_table.decoded_lines(path)
    for program in _PROGRAMS:
        if program.recognises(lines):
            found = program.read(path, lines)
            return [found] if found else []
    return [text_table.table_of(path, lines, encoding)]
