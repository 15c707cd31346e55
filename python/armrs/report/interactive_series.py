"""Series over time that a reader can zoom and switch: plain data, and the markup that a script draws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

MOST_SAMPLES = 1500
"""Samples of a line in a page; of a longer run, the lowest and the highest value of every few."""
DIGITS = 5


@dataclass(frozen=True)
class Line:
    """A line of a panel.

    Attributes
    ----------
    name : str
        Lines of one name, in whatever panel, are switched together.
    colour : str
    values : ndarray, shape (n,)
        In the unit of the panel; NaN leaves a hole.
    shown : bool
        Whether it is there before a reader switches.
    """

    name: str
    colour: str
    values: np.ndarray
    shown: bool = True


@dataclass(frozen=True)
class Panel:
    """Lines that share an axis, with its unit."""

    title: str
    unit: str
    lines: tuple[Line, ...]


def series(title: str, text: str, t: np.ndarray, panels: Sequence[Panel]) -> dict[str, Any]:
    """Return series as plain data.

    Parameters
    ----------
    title, text : str
    t : ndarray, shape (n,)
        Times [s].
    panels : sequence of Panel
    """
    together = 1 if len(t) <= MOST_SAMPLES else -(-2 * len(t) // MOST_SAMPLES)
    return {
        "title": title,
        "text": text,
        "t_s": _thin_times(np.asarray(t, dtype=float), together),
        "panels": [
            {
                "title": panel.title,
                "unit": panel.unit,
                "lines": [
                    {"name": line.name, "colour": line.colour, "shown": line.shown, "values": _thin(line.values, together)}
                    for line in panel.lines
                ],
            }
            for panel in panels
        ],
    }


def drawn(data: dict[str, Any]) -> dict[str, Any]:
    """Return series as the template needs them: the names that can be switched, each with its colour, in the order of the panels.

    Raises
    ------
    ValueError
        For lines of another length than the times.
    """
    count = len(data["t_s"])
    names: dict[str, dict[str, Any]] = {}
    for panel in data["panels"]:
        for line in panel["lines"]:
            if len(line["values"]) != count:
                raise ValueError(f"{line['name']}: {len(line['values'])} values at {count} times")
            names.setdefault(str(line["name"]), {"name": str(line["name"]), "colour": str(line["colour"]), "shown": bool(line["shown"])})
    return {"title": data["title"], "text": data["text"], "names": list(names.values()), "data": data}


def _thin_times(t: np.ndarray, together: int) -> list[float]:
    if together > 1:
        starts = np.arange(0, len(t), together)
        t = np.column_stack([t[starts], t[np.minimum(starts + together // 2, len(t) - 1)]]).ravel()
    return np.round(t, 4).tolist()


def _thin(values: np.ndarray, together: int) -> list[float | None]:
    values = np.asarray(values, dtype=float)
    if together > 1:
        starts = np.arange(0, len(values), together)
        values = np.column_stack([np.fmin.reduceat(values, starts), np.fmax.reduceat(values, starts)]).ravel()
    return [None if not np.isfinite(v) else float(f"{v:.{DIGITS}g}") for v in values]
