"""Text exports of LabChart (ADInstruments): keys before an equals sign, among them the titles and units of the channels."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from .table import RawTable
from .text_table import table_of

_HEAD = 12
"""Lines in which the titles are searched for."""


def recognises(lines: Sequence[str]) -> bool:
    """Whether a line among the first names channels as LabChart does."""
    return any(line.startswith("ChannelTitle=") for line in lines[:_HEAD])


def read(path: Path, lines: Sequence[str]) -> RawTable:
    """Read the channels on their time.

    Raises
    ------
    BadInput
        Without the file's name in it.
    """
    keys = {line.partition("=")[0]: line.partition("=")[2].strip("\t").split("\t") for line in lines[:_HEAD] if "=" in line}
    titles, units = keys["ChannelTitle"], keys.get("UnitName", [])
    named = [f"{title} [{units[k]}]" if k < len(units) and units[k] not in ("", "*") else title for k, title in enumerate(titles)]
    rows = [line for line in lines if "=" not in line]
    table = table_of(path, ["\t".join(["Time [s]", *named]), *rows], "the encoding of the export")
    return RawTable(path, table.title, table.columns, ("export of LabChart", *table.notes[1:]), remarks=table.remarks)
