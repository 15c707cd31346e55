"""Animations and zoomable series of a page."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import BadInput, Text
from ..io import files, jsonfile
from . import interactive_series, stick_figures

FILE = "figures/live.json"
"""Where it stands beside a result that is written to a folder."""


@dataclass(frozen=True)
class Live:
    """Plain data of an animation (`animation.film`) and of series (`series.series`); what is absent is not shown."""

    animation: Mapping[str, Any] | None = None
    series: Mapping[str, Any] | None = None

    def __bool__(self) -> bool:
        return self.animation is not None or self.series is not None

    def shown(self) -> dict[str, Any]:
        """Return what the templates draw."""
        return {
            "film": None if self.animation is None else stick_figures.drawn(self.animation),
            "series": None if self.series is None else interactive_series.drawn(dict(self.series)),
        }


NOTHING = Live()


def write(live: Live, folder: Path) -> str:
    """Write it below a folder; return its name there."""
    text = json.dumps({"animation": live.animation, "series": live.series}, separators=(",", ":"), allow_nan=False)
    files.write_text(folder / FILE, text + "\n", kind=".json")
    return FILE


def read(name: object, folder: Path) -> Live:
    """Read what a result names, from below its folder; nothing where the file is gone.

    Raises
    ------
    BadInput
        For a file outside the folder, or one that is no such data.
    """
    if name is None:
        return NOTHING
    path = folder / str(name)
    try:
        if not path.resolve().is_relative_to(folder.resolve()):
            raise BadInput("live", Text(f"{name}, which is outside the folder of the result"), "a file below it", file=path)
        if not path.is_file():
            return NOTHING
        data = jsonfile.read(path)
        return Live(data["animation"], data["series"])
    except (OSError, ValueError, RuntimeError, RecursionError, KeyError, TypeError) as error:
        raise BadInput("live", Text(f"no animation and series ({error})"), "a file that armrs wrote", file=path) from None
