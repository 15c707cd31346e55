"""Figures of a sweep: estimates against true values, and coverage of the intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import formatting
from ..report import plotting
from ..report.figures import Drawn, Figures, quantity_name
from .summary import Quantity, Summary

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_PANELS = 12
_ROUNDING = 1e-9
"""Relative difference of values that are equal but for rounding."""
_FEW = 50
"""Cases up to which a dot is drawn large."""


def sweep(summary: Summary, data: Mapping[str, Any]) -> Figures:
    """Return the figures of a sweep: every quantity over the cases, and the coverage of the intervals where the truth is known."""
    if not summary.quantities:
        return {}
    joints = data["data"]["joints"]
    values: Figures = {"estimates": partial(_values, summary.quantities, joints)}
    known = [q for q in data["quantities"] if q["coverage"] is not None]
    return {**values, "coverage": partial(_coverage, known, joints, data["level"])} if known else values


def _values(quantities: list[Quantity], joints: list[str]) -> Drawn:
    there = [q for q in quantities if q.value.n]
    there = [q for q in there if _varies(q)] or there
    shown = sorted(there, key=lambda q: q.decided_by["data"] / q.value.n, reverse=True)[:MOST_PANELS]
    rows, columns = plotting.grid(len(shown))
    figure = plotting.figure(3.6 * columns, 3.1 * rows)
    for ax, quantity in zip(figure.subplots(rows, columns, squeeze=False).ravel(), shown, strict=False):
        _panel(quantity, ax)
        ax.set_title(quantity_name({"name": quantity.name, "kind": quantity.kind, "joint": quantity.joint}, joints), fontsize="medium")
    for ax in figure.axes[len(shown) :]:
        ax.remove()
    _legend(figure, truth=any(ax.lines for ax in figure.axes), cases=any(len(ax.lines) > 1 for ax in figure.axes))
    left = len(quantities) - len(shown)
    text = "A dot is a case; on the line, what was found is the truth. Where no truth is known, or one for all cases: a histogram."
    return Drawn("estimates", "Found against the truth", text + (f" {left} more are in the tables." if left else ""), figure)


def _varies(quantity: Quantity) -> bool:
    """Whether cases differ by more than rounding: a value that is the same in all is not drawn."""
    values = np.concatenate(quantity.values)
    values = values[np.isfinite(values)]
    return len(values) == 1 or bool(np.ptp(values) > _ROUNDING * np.abs(values).max())


def _legend(figure: Figure, *, truth: bool, cases: bool) -> None:
    """Explain above all panels what a dot and the line are, where there are such."""
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=plotting.BLUE, marker=".", ls="", ms=9, label="a case")] * cases
    handles += [Line2D([], [], color=plotting.ORANGE, label="truth")] * truth
    if handles:
        figure.legend(handles=handles, loc="outside upper left", ncols=2)


def _panel(quantity: Quantity, ax: Any) -> None:
    value, truth = np.concatenate(quantity.values), np.concatenate(quantity.truths)
    there, unit = np.isfinite(value), formatting.unit(quantity.unit)
    held_in = f" [{unit}]" if unit else ""
    ax.locator_params(axis="x", nbins=5)
    known = there & np.isfinite(truth)
    if known.any() and np.ptp(truth[known]) > 0.0:
        ax.plot(
            truth[known],
            value[known],
            ".",
            color=plotting.BLUE,
            markersize=4 if known.sum() > _FEW else 8,
            alpha=max(0.15, min(1.0, 60.0 / known.sum())),
        )
        ends = [truth[known].min(), truth[known].max()]
        ax.plot(ends, ends, color=plotting.ORANGE)
        ax.set(xlabel=f"truth{held_in}", ylabel=f"found{held_in}")
        return
    ax.hist(value[there], bins=max(5, min(40, round(math.sqrt(there.sum())))), color=plotting.BLUE)
    if known.any():
        ax.axvline(float(truth[known][0]), color=plotting.ORANGE)
    ax.yaxis.get_major_locator().set_params(integer=True)
    ax.set(xlabel=f"found{held_in}", ylabel="cases")


def _coverage(known: list[dict[str, Any]], joints: list[str], level: float) -> Drawn:
    figure = plotting.figure(6.4, 0.34 * len(known) + 1.1)
    ax = figure.subplots()
    place = np.arange(len(known))[::-1]
    share = np.array([q["coverage"] for q in known])
    chance = np.array([2.0 * math.sqrt(level * (1.0 - level) / q["cases"]) for q in known])
    ax.barh(place, 200.0 * chance, left=100.0 * (level - chance), color="0.88", height=0.9)
    ax.axvline(100.0 * level, color=plotting.ORANGE, label="promised")
    ax.plot(100.0 * share, place, "o", color=plotting.BLUE, clip_on=False, label="intervals of the fit")
    again = [(k, q["bootstrap"]["coverage"]) for k, q in zip(place, known, strict=True) if q["bootstrap"] is not None]
    if again:
        ax.plot(
            [100.0 * c for _, c in again],
            [k for k, _ in again],
            "o",
            color=plotting.BLUE,
            mfc="white",
            clip_on=False,
            label="of the bootstrap",
        )
    ax.set_yticks(place, [quantity_name(q, joints) for q in known])
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.2)
    ax.set(xlabel="intervals that hold the truth [%]", xlim=(min(100.0 * share.min(), 100.0 * level) - 5.0, 101.0))
    text = (
        f"Share of the {100 * level:g} % intervals that hold the truth; the grey bar is what chance makes of so many cases, twice its "
        "standard deviation to each side." + (" Hollow: the intervals of the bootstrap." if again else "")
    )
    return Drawn("coverage", "Do the intervals hold?", text, figure)
