"""The methods `plot` and `report` of results."""

from __future__ import annotations

import os
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .. import checks
from ..errors import BadInput, Text, unknown_name
from . import html, interactive, pages
from .figures import Figures, draw, shown


@dataclass(frozen=True)
class View:
    """How results of one kind are shown.

    Attributes
    ----------
    data : callable
        Makes plain data of a result, as it is written to JSON.
    figures : callable
        Makes figures of a result and its plain data.
    moving : callable
        Makes what moves in the page of a result.
    """

    data: Callable[[Any], dict[str, Any]]
    figures: Callable[[Any, Mapping[str, Any]], Figures]
    moving: Callable[[Any], interactive.Live] = lambda result: interactive.NOTHING

    def plot(self, result: object, name: str | None) -> np.ndarray:
        """Draw one figure where pyplot shows it, and return its Axes."""
        figures = self.figures(result, self.data(result))
        if not figures:
            raise BadInput("plot", Text("nothing to draw in this result"), "a result with values")
        if name is not None and checks.text("name", name) not in figures:
            raise unknown_name("name", name, figures, what="figure")
        return shown(figures[next(iter(figures)) if name is None else name])

    def report(self, result: object, path: str | os.PathLike[str]) -> Path:
        """Write the report as one HTML page with its figures in it."""
        target = checks.path("path", path)
        if target.suffix.lower() != ".html":
            raise BadInput("path", str(target), "the name of a file that ends with .html")
        data = self.data(result)
        pictures = defaultdict(list)
        for drawn in draw(self.figures(result, data)):
            picture = html.Picture(f"{drawn.name}.png", drawn.title, drawn.text, html.data_uri(drawn.png))
            pictures[drawn.section].append(picture)
        return pages.write_page_of(data, pictures, target, self.moving(result))
