"""What the gap workflow found, as plain data and as files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .. import files
from ..results import data_of, origin
from .found import GapFound


def gap_data(result: GapFound, command: str | None = None) -> dict[str, Any]:
    """Return the result as it is written to JSON: that of `GapFound.to_dict`, and what it rests on."""
    return {"verb": "gap", **result.to_dict(), "data": data_of(result.dataset), "made_by": origin(command)}


def write_gap(result: GapFound, data: dict[str, Any], folder: Path) -> list[Path]:
    """Write `amended.toml` and `gap.json` below a folder; return the files."""
    model, document = folder / "amended.toml", folder / "gap.json"
    files.not_an_input([model], [result.dataset.model_path] if result.dataset.model_path else [])
    result.model.write(model)
    files.write_json(document, data)
    return [model, document]
