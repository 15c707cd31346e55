"""Recompute every item and write the page, its figures and the same as JSON."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..io import files
from ..report import plotting
from ..workflows.result_data import origin
from . import (
    elbow_torques,
    equations,
    error_propagation,
    human_arm,
    mechanical_arm,
    movements,
    not_recomputed,
    page,
    passive_moments,
    simulation_comparison,
    six_subjects,
)
from .report_item import Found, Item

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GROUPS = (
    movements.GROUP,
    elbow_torques.GROUP,
    passive_moments.GROUP,
    six_subjects.GROUP,
    mechanical_arm.GROUP,
    human_arm.GROUP,
    simulation_comparison.GROUP,
    error_propagation.GROUP,
)
"""The parts of the page, in the order of the thesis."""


@dataclass(frozen=True, eq=False)
class Reproduced:
    """What was recomputed.

    Attributes
    ----------
    data : dict
        The contents of the page, as plain data.
    files : tuple of Path
        What was written, the page last.
    """

    data: dict[str, Any]
    files: tuple[Path, ...]


def run_reproduce(
    folder: str | os.PathLike[str], *, command: str | None = None, tell: Callable[[str, float], None] = lambda stage, share: None
) -> Reproduced:
    """Recompute every table and figure of the thesis that a machine can.

    Parameters
    ----------
    folder : path
        Gets `report.html`, which needs nothing else, `reproduced.json` and `figures/`.
    command : str, optional
        For the page: how to repeat this.
    tell : callable
        Called with what is being done and the share that is done, 0 to 1.
    """
    made: list[dict[str, Any]] = []

    def write(out: Path) -> list[Path]:
        count, done, parts, written = sum(len(g.items) for g in GROUPS), 0, [], []
        for group in GROUPS:
            items = []
            for item in group.items:
                tell(item.title, done / count)
                with plotting.style():
                    found = item.make()
                written += _draw(found, out, item.virtual)
                items.append(_plain(item, found))
                done += 1
            parts.append({"key": group.key, "title": group.title, "items": items})
        data = _data(parts, command)
        made.append(data)
        files.write_json(out / "reproduced.json", data)
        page.write(out / "report.html", data, out)
        return [*written, out / "reproduced.json", out / "report.html"]

    written = files.write_whole(folder, write)
    return Reproduced(made[0], tuple(written))


def _draw(found: Found, out: Path, virtual: bool) -> list[Path]:
    """Write the figures; one of virtual data is marked, since it may be shown away from the page."""
    paths = []
    for drawn in found.figures:
        path = out / "figures" / f"{drawn.name}.png"
        files.may_replace(path, ".png")
        if virtual:
            _stamp(drawn.figure)
        with files.replacing(path) as temporary:
            plotting.write_png(drawn.figure, temporary)
        paths.append(path)
    return paths


def _stamp(figure: Figure) -> None:
    """Write at the foot of a figure that its data are virtual, in a separate strip."""
    foot = 0.16 / figure.get_figheight()
    layout: Any = figure.get_layout_engine()
    layout.set(rect=(0.0, foot, 1.0, 1.0 - foot))
    figure.text(0.998, 0.02 / figure.get_figheight(), "virtual data", ha="right", va="bottom", fontsize=7, color=plotting.GREY)


def _plain(item: Item, found: Found) -> dict[str, Any]:
    return {
        "key": item.key,
        "title": item.title,
        "place": item.place,
        "virtual": item.virtual,
        "printed": item.printed,
        "ours": found.ours,
        "why": found.why,
        "values": dict(found.values),
        "tables": [
            {"title": s.title, "head": list(s.table.head), "rows": [list(row) for row in s.table.rows], "left": s.table.left}
            for s in found.sheets
        ],
        "figures": [{"file": f"figures/{d.name}.png", "title": d.title, "text": d.text} for d in found.figures],
        "animations": [dict(a) for a in found.animations],
    }


def _data(parts: list[dict[str, Any]], command: str | None) -> dict[str, Any]:
    items = [item for part in parts for item in part["items"]]
    virtual = sum(item["virtual"] for item in items)
    return {
        "verb": "reproduce",
        "verdict": (
            f"{len(items)} items of chapters 3 and 4 and the appendices with {sum(len(i['tables']) for i in items)} tables and "
            f"{sum(len(i['figures']) + len(i['animations']) for i in items)} figures. The thesis prints no measured samples: {virtual} "
            "items rest on virtual experiments, which say how the methods behave, not what these subjects were like."
        ),
        "parts": parts,
        "thesis": not_recomputed.THESIS,
        "left_out": not_recomputed.table(),
        "equations": equations.rows(),
        "made_by": origin(command),
    }
