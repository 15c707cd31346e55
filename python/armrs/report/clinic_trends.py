"""Figures of the page for a clinician: quantities with their intervals, and their course over the sessions."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from . import html, plotting
from .clinic_lines import Line, best_known, counted, in_unit
from .clinic_quantities import QUANTITIES, SLOW

MOST_TRENDS, PANEL = 6, (2.5, 1.7)
"""Plots over the sessions that find room on a page, and the size of one [inch]."""
COURSES = "Each quantity over the sessions of this arm; bars are 95 % intervals. Orange: clearly different from the session before."


@dataclass(frozen=True)
class Panel:
    """The plot of one quantity: its name, the image as a data URI, and what it shows in words."""

    name: str
    source: str
    text: str


def panels(results: Sequence[Mapping[str, Any]], lines: Sequence[Line]) -> list[Panel]:
    """Draw what the table has over the sessions, where there are several: a plot each, which a narrow window puts below one another."""
    listed = [f"{line.joint}: {line.quantity.title.lower()}" for line in lines]
    known = sorted((c for c in followed(results) if c["name"] in listed), key=lambda c: not c["changed"])[:MOST_TRENDS]
    bands = {f"{line.joint}: {line.quantity.title.lower()}": line.norm_band() for line in lines}
    drawn = []
    with plotting.style():
        for course in known:
            figure = plotting.figure(*PANEL)
            ax = figure.subplots()
            place = range(len(course["dates"]))
            colour = plotting.ORANGE if course["changed"] else plotting.BLUE
            ax.errorbar(place, course["values"], [1.96 * std for std in course["stds"]], fmt="o-", color=colour, capsize=3)
            if (band := bands.get(course["name"])) is not None:
                ax.axhspan(*band, color=plotting.FAINT, zorder=0)
            ax.margins(y=0.15)
            ax.set_xticks(place, course["dates"], rotation=30, ha="right", fontsize="small")
            ax.set_ylabel(f"[{course['unit']}]", fontsize="small")
            image = io.BytesIO()
            plotting.write_png(figure, image)
            seen = ", ".join(f"{v:.3g} on {date}" for v, date in zip(course["values"], course["dates"], strict=True))
            text = f"{course['name']} [{course['unit']}] over the sessions of this arm: {seen}"
            drawn.append(Panel(course["name"], html.data_uri(image.getvalue()), text))
    return drawn


def followed(results: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return what is followed over the sessions with the names, the units and the zero of the table."""
    by_name = {(q.kind, q.parameter): q for q in (*QUANTITIES, *SLOW)}
    found = []
    for result in results:
        for course in result.get("history", ()):
            parameter, _, movement = str(course["name"]).partition(" in ")
            quantity = by_name.get((course["kind"], parameter))
            if quantity is None or parameter == "range" or len(course["dates"]) < 2:
                continue
            if movement and movement != (best_known(result, course["joint"]) or {}).get("configuration"):
                continue
            own = counted(result, course["joint"], quantity)
            said = f"{result['data']['joints'][course['joint'] - 1]}: {quantity.title.lower()}"
            values = [in_unit(value, quantity, own) for value in course["values"]]
            stds = [quantity.factor * std for std in course["stds"]]
            drawn = {"name": said, "joint": None, "unit": quantity.unit, "values": values, "stds": stds}
            found.append({**course, **drawn, "changed": course["before"]["clear"]})
    return found


def picture(lines: Sequence[Line], intervals: str) -> html.Picture | None:
    """Draw every quantity with its interval, one panel each, the usual range behind."""
    # How far a joint was moved was chosen: the table states it.
    shown = [
        q for q in (*QUANTITIES, *SLOW) if q.parameter != "range" and any(line.quantity is q and line.value is not None for line in lines)
    ]
    if not shown:
        return None
    with plotting.style():
        joints = list(dict.fromkeys(line.joint for line in lines))
        rows, columns = plotting.grid(len(shown))
        figure = plotting.figure(3.1 * columns + 0.8, (0.36 * len(joints) + 1.0) * rows)
        axes = figure.subplots(rows, columns, squeeze=False, sharey=True).ravel()
        for ax in axes[len(shown) :]:
            ax.remove()
        for ax, quantity in zip(axes, shown, strict=False):
            for line in lines:
                if line.quantity is not quantity or line.value is None:
                    continue
                row = joints.index(line.joint)
                band = line.norm_band()
                if band is not None:
                    ax.barh(row, band[1] - band[0], left=band[0], height=0.62, color=plotting.FAINT)
                if line.interval is not None:
                    low = max(line.interval[0], 0.0) if line.at_limit else line.interval[0]
                    ax.hlines(row, low, line.interval[1], color=plotting.BLUE, lw=2.6)
                ax.plot(line.value, row, "o", color=plotting.BLUE, ms=7)
            ax.set_title(quantity.title)
            ax.set_xlabel(f"[{quantity.unit}]")
            ax.grid(visible=False, axis="y")
            ax.locator_params(axis="x", nbins=4)
            if quantity.unit != "°":
                ax.set_xlim(left=min(0.0, ax.get_xlim()[0]))
        axes[0].set_yticks(range(len(joints)), joints)
        axes[0].set_ylim(len(joints) - 0.4, -0.6)
        image = io.BytesIO()
        plotting.write_png(figure, image)
    grey = " The grey bar is what is usual." if any(line.norm for line in lines) else ""
    text = f"Points are what was measured. The lines are {intervals}{grey}"
    return html.Picture("summary.png", "Each joint", text, html.data_uri(image.getvalue()))
