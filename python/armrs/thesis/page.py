"""The page of `armrs reproduce`: every item with the printed value, our value, and why they differ."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import formatting
from ..report import html, tables
from ..report.stick_figures import drawn

TEMPLATES = Path(__file__).with_name("templates")
_NEGATIVE = re.compile(r"-\d")


def write(path: Path, data: Mapping[str, Any], folder: Path) -> None:
    """Write the page of plain data, its figures taken from below a folder."""
    engine = html.environment(TEMPLATES)
    values = {"data": data, "signed": _signed, "drawn": drawn, "picture": lambda entry: html.picture(entry, folder)}
    part = html.render(engine, "thesis.html.j2", values)
    html.write_page(
        engine, path, [part], title="The thesis, computed again", maker="reproduce", styles=["thesis.css"], scripts=["film.js", "thesis.js"]
    )


def _signed(sheet: Mapping[str, Any]) -> tables.Table:
    """Return a table of plain data, its numbers with a minus as wide as a plus."""
    rows = [[_with_minus(cell) for cell in row] for row in sheet["rows"]]
    return tables.Table(sheet["head"], rows, sheet["left"])


def _with_minus(cell: Any) -> str | None:
    text = None if cell is None else str(cell)
    return formatting.minus(text) if text and _NEGATIVE.match(text) else text
