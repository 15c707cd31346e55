"""Plots. Each function draws data that are given to it into `ax` (a new one when absent) and returns the Axes; nothing is computed here.

Angles come in radians and are shown in degrees. Colours are distinguishable for colour-blind readers, and lines and markers differ too.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from .. import formatting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BLUE, ORANGE, GREEN, RED, PURPLE, SKY, YELLOW = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#A6548B", "#56B4E9", "#C9B500"
"""The palette of Okabe and Ito, the two faintest darkened for thin lines."""
INK, GREY, SILVER, FAINT = "#222222", "#767676", "#B0B0B0", "#D9D9D9"
CYCLE = (BLUE, ORANGE, GREEN, RED, PURPLE, SKY, YELLOW, INK)
MANY = (*CYCLE, "#00365A", "#7A4B00", "#00523B", "#7F1D1D", "#4F1D6B", "#E377A2", "#8DB600", "#7F8FA6")
"""For more lines than the cycle has colours."""
BESIDE_RED = tuple(colour for colour in MANY if colour != RED)
"""For lines that are switched together with the simulated one."""

MARKERS = {"data": (BLUE, "full"), "prior": (GREY, "none"), "bound": (RED, "none")}
"""What decided a value -> colour and fill of its marker."""
_SHAPES = {"data": "o", "prior": "o", "bound": "D"}
_MEANING = {
    "data": "decided by the measurement",
    "prior": "determined by the model, not by these data alone",
    "bound": "at a physical limit",
}

_STYLE: dict[str, Any] = {
    "font.size": 10.0,
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 10.0,
    "axes.edgecolor": GREY,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.limits": (-4, 5),
    "grid.color": "#EAEAEA",
    "grid.linewidth": 0.8,
    "xtick.labelsize": 10.0,
    "ytick.labelsize": 10.0,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "text.color": INK,
    "axes.labelcolor": INK,
    "legend.frameon": False,
    "legend.fontsize": 9.0,
    "lines.linewidth": 1.5,
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "savefig.facecolor": "white",
    "text.parse_math": False,
}
"""Names of joints, movements and files are shown as they stand, whatever `$` they have in them. Tick labels of six digits would collide."""


def style() -> AbstractContextManager[None]:
    """Return a context in which plots have the common look."""
    import matplotlib
    from cycler import cycler

    look: Any = {**_STYLE, "axes.prop_cycle": cycler(color=CYCLE)}
    return matplotlib.rc_context(look)


_IN_PYPLOT = ContextVar("_IN_PYPLOT", default=False)


@contextmanager
def in_pyplot() -> Iterator[None]:
    """Make new figures known to pyplot, so that notebooks and windows show them."""
    before = _IN_PYPLOT.set(True)
    try:
        yield
    finally:
        _IN_PYPLOT.reset(before)


def grid(count: int) -> tuple[int, int]:
    """Return rows and columns of as many panels, at most three side by side; four are a square, which leaves no place empty."""
    columns = 2 if count == 4 else min(3, max(1, count))
    return -(-max(1, count) // columns), columns


def figure(width: float, height: float) -> Figure:
    """Return an empty figure [inches]; but for `in_pyplot`, it is in no window and no global state."""
    if _IN_PYPLOT.get():
        from matplotlib import pyplot

        return pyplot.figure(figsize=(width, height), layout="constrained")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    made = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(made)
    return made


Sheets = dict[tuple[int, float, float, float], tuple["Figure", np.ndarray]]
_SHEETS: ContextVar[Sheets | None] = ContextVar("_SHEETS", default=None)


@contextmanager
def same_sheet() -> Iterator[None]:
    """Draw figures of panels in `pairs` of one shape on the same sheet, each after the one before was written.

    Axes, ticks and measured labels remain: to make them anew takes longer than what changes.
    """
    before = _SHEETS.set({})
    try:
        yield
    finally:
        _SHEETS.reset(before)


_LEFT, _RIGHT, _TOP, _BOTTOM, _BETWEEN = 0.95, 0.15, 0.35, 0.5, 0.35
"""Margins around a panel for its labels, and between two of a column [inches]."""
_SHORT = 0.8
"""Width of a title beside which a legend of three stands in these margins [inches]."""


def text_width(text: str, size: float = _STYLE["ytick.labelsize"], weight: str = "normal") -> float:
    """Return the width of a text [inches], if nothing else is said that of the label of a tick."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextToPath

    font = FontProperties(weight=weight, size=size)
    return float(TextToPath().get_text_width_height_descent(text, font, ismath=False)[0] / 72.0)


def pairs(titles: Sequence[str], width: float, height: float, ratio: float) -> tuple[Figure, np.ndarray]:
    """Return a figure of panels side by side, each above another one of the same time or angle, and the Axes, shape (2, n).

    With short titles the margins are fixed: there is room for tick labels of seven letters, and for a title and a legend above each panel.
    To measure them would take longer than to draw.

    Parameters
    ----------
    titles : sequence of str
        What will stand above the upper panels.
    width, height : float
        Of two panels [inches].
    ratio : float
        Height of an upper panel over that of the lower one.
    """
    count = max(len(titles), 1)
    of_both: dict[str, Any] = {"squeeze": False, "sharex": "col", "height_ratios": (ratio, 1.0)}
    if any(text_width(title, _STYLE["axes.titlesize"], _STYLE["axes.titleweight"]) > _SHORT for title in titles):
        made = figure(width * count + 0.4, height)
        return made, made.subplots(2, count, **of_both)
    sheets, shape = _SHEETS.get(), (count, width, height, ratio)
    if sheets is not None and shape in sheets:
        return _emptied(*sheets[shape])
    made = figure(width * count, height)
    made.set_layout_engine("none")
    across, high = width - _LEFT - _RIGHT, height - _TOP - _BOTTOM - _BETWEEN
    margins = {
        "left": _LEFT / (width * count),
        "right": 1.0 - _RIGHT / (width * count),
        "top": 1.0 - _TOP / height,
        "bottom": _BOTTOM / height,
        "wspace": (_LEFT + _RIGHT) / across,
        "hspace": _BETWEEN / (0.5 * high),
    }
    axes = made.subplots(2, count, gridspec_kw=margins, **of_both)
    for ax in axes.ravel():
        ax.locator_params(nbins=6, steps=[1, 2, 5, 10])
        ax.yaxis.set_label_coords((0.18 - _LEFT) / across, 0.5)
        ax.xaxis.set_label_coords(0.5, (0.2 - _BOTTOM) * (1.0 + ratio) / high)
    if sheets is not None:
        sheets[shape] = made, axes
    return made, axes


def _emptied(sheet: Figure, axes: np.ndarray) -> tuple[Figure, np.ndarray]:
    """Remove what was plotted; titles and labels stay until others are set."""
    for ax in axes.ravel():
        for artist in (*ax.lines, *ax.collections, *filter(None, [ax.get_legend()])):
            artist.remove()
        ax.set_prop_cycle(None)
        ax.relim()
        ax.autoscale()
    return sheet, axes


def halo() -> list[Any]:
    """Return a white rim for words that stand on lines."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=3.0, foreground="white")]


_DPI = 130


def write_png(figure: Figure, target: Path | IO[bytes]) -> None:
    """Write a figure as the PNG image that stands in reports."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from PIL import Image

    with style():
        figure.set_dpi(_DPI)
        canvas: Any = figure.canvas if isinstance(figure.canvas, FigureCanvasAgg) else FigureCanvasAgg(figure)
        engine = figure.get_layout_engine()
        if figure.axes and engine is not None:
            engine.execute(figure)
            figure.set_layout_engine("none")
        # `savefig` would lay the figure out twice, and draw it once more to no end.
        canvas.draw()
    # Nothing is transparent: a fourth channel would take longer, and make the file larger.
    Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB").save(target, "png", compress_level=3, dpi=(_DPI, _DPI))


def torque(t: np.ndarray, measured: np.ndarray, fitted: np.ndarray, ax: Axes | None = None, *, title: str = "") -> Axes:
    """Plot the torque of one joint that follows from the measurement, and that of the fitted model.

    Parameters
    ----------
    t, measured, fitted : ndarray, shape (n,)
        [s], [N m].
    """
    ax = _axes(ax)
    ax.plot(*_broken(t, measured), color=SILVER, lw=2.4, label="measured")
    ax.plot(*_broken(t, fitted), color=RED, lw=1.3, label="fitted")
    ax.set(title=title, ylabel="torque [N m]", xlabel="time [s]")
    _legend(ax)
    return ax


def residual(trials: Sequence[tuple[np.ndarray, np.ndarray, str]], ax: Axes | None = None, *, title: str = "") -> Axes:
    """Plot residual torques of one joint over all repeats.

    Parameters
    ----------
    trials : sequence of (t, residual, role)
        Times [s], residuals [N m], and "fit" or "test".
    """
    ax = _axes(ax)
    looks: dict[str, dict[str, Any]] = {
        "fit": {"color": BLUE, "lw": 0.7, "alpha": 0.55},
        "test": {"color": ORANGE, "lw": 1.0, "alpha": 0.9},
    }
    for role, look in looks.items():
        for k, (t, values, _) in enumerate(item for item in trials if item[2] == role):
            ax.plot(*_broken(t, values), label=f"{role} trials" if k == 0 else None, **look)
    ax.axhline(0.0, color=INK, lw=0.8)
    ax.set(title=title, ylabel="residual [N m]", xlabel="time [s]")
    _legend(ax)
    return ax


def intervals(items: Sequence[Mapping[str, Any]], labels: Sequence[str], ax: Axes | None = None) -> Axes:
    """Plot estimates with intervals, one line each; what was not measured has a hollow marker.

    Parameters
    ----------
    items : sequence of mappings
        `value`, `interval`, `decided_by`, `unit`, and where there are such `given` (the model's own value) and `reference` (a known one).
    labels : sequence of str
        What stands at each line.
    """
    ax = _axes(ax)
    rows = list(enumerate(items))
    _markers(ax, rows, "reference", marker="|", ms=24, mew=2.4, color=GREEN)
    for key, (colour, fill) in MARKERS.items():
        own = [(row, item) for row, item in rows if item["decided_by"] == key]
        if own:
            ax.hlines([row for row, _ in own], *zip(*(item["interval"] for _, item in own), strict=True), color=colour, lw=2.2, alpha=0.9)
        _markers(ax, own, "value", marker=_SHAPES[key], ms=7, mew=1.7, color=colour, mfc=colour if fill == "full" else "white")
    _markers(ax, rows, "given", marker="x", ms=7, mew=1.5, color=INK, alpha=0.75)
    ax.set_yticks(range(len(items)), labels)
    ax.set_ylim(len(items) - 0.4, -0.6)
    ax.grid(visible=False, axis="y")
    ax.tick_params(axis="y", length=0)
    ax.locator_params(axis="x", nbins=6)
    ax.set_xlabel(f"[{formatting.unit(items[0]['unit']) or 'relative'}]" if items else "")
    return ax


def _markers(ax: Axes, rows: Sequence[tuple[int, Mapping[str, Any]]], key: str, **look: Any) -> None:
    """Mark a number of those items that have it, in their rows."""
    there = [(item[key], row) for row, item in rows if item.get(key) is not None]
    if there:
        ax.plot(*zip(*there, strict=True), ls="", **look)


_COLUMN, _ROW, _BELOW, _BESIDE, _ABOVE, _LINE = 5.4, 0.36, 0.52, 0.22, 0.15, 0.2
"""A column of panels of intervals: its width, one of its rows, what stands below a panel, right of it, above all, and a line of a legend
[inches]."""


def interval_panels(columns: Sequence[Sequence[tuple[Sequence[Mapping[str, Any]], Sequence[str]]]]) -> Figure:
    """Return a figure of `intervals`, panels above one another in columns, and what their markers mean.

    Margins follow from the widest label of each column: to lay the figure out by its parts would take longer than to draw it.

    Parameters
    ----------
    columns : sequence of sequences of (items, labels)
        The panels of each column, as `intervals` takes them.
    """
    rows = [[len(items) + 1.1 for items, _ in column] for column in columns]
    width, height = _COLUMN * len(columns), _ROW * max(map(sum, rows)) + 0.9
    made = figure(width, height)
    made.set_layout_engine("none")
    interval_legend(made, [item for column in columns for items, _ in column for item in items])
    lines = -(-len(made.legends[0].legend_handles) // _legend_columns(made))
    top = height - _ABOVE - _LINE * lines
    row = min((top - _BELOW * len(column)) / sum(column) for column in rows)
    for k, column in enumerate(columns):
        beside = min(0.12 + max(text_width(label) for _, labels in column for label in labels), 0.8 * _COLUMN)
        at = top
        for (items, labels), high in zip(column, rows[k], strict=True):
            at -= row * high
            place = (_COLUMN * k + beside) / width, at / height, (_COLUMN - beside - _BESIDE) / width, row * high / height
            intervals(items, labels, made.add_axes(place))
            at -= _BELOW
    return made


def _legend_columns(figure: Figure) -> int:
    return 4 if figure.get_figwidth() > 8.0 else 2


def interval_legend(figure: Figure, items: Sequence[Mapping[str, Any]]) -> None:
    """Explain the markers of `intervals` above a figure, those that occur."""
    from matplotlib.lines import Line2D

    handles = []
    for key in ("data", "prior", "bound"):
        if any(item["decided_by"] == key for item in items):
            colour, fill = MARKERS[key]
            face = colour if fill == "full" else "white"
            handles.append(Line2D([], [], color=colour, marker=_SHAPES[key], mfc=face, mew=1.7, ms=7, lw=2.2, label=_MEANING[key]))
    if any(item.get("given") is not None for item in items):
        handles.append(Line2D([], [], color=INK, marker="x", ls="", mew=1.5, ms=7, label="model as given"))
    if any(item.get("reference") is not None for item in items):
        handles.append(Line2D([], [], color=GREEN, marker="|", ls="", mew=2.4, ms=14, label="known value"))
    figure.legend(handles=handles, loc="outside upper left", ncols=_legend_columns(figure), fontsize=9)


def angles(t: np.ndarray, q: np.ndarray, names: Sequence[str], ax: Axes | None = None, *, measured: np.ndarray | None = None) -> Axes:
    """Plot joint angles, simulated and where they are given measured ones.

    Parameters
    ----------
    t : ndarray, shape (n,)
        [s]
    q, measured : ndarray, shape (n, n_joints)
        [rad]
    names : sequence of str
        Names of the joints.
    """
    ax = _axes(ax)
    for j, name in enumerate(names):
        if measured is not None:
            ax.plot(*_broken(t, np.degrees(measured[:, j])), color=SILVER, lw=3.2, label="measured" if j == 0 else None)
        ax.plot(t, np.degrees(q[:, j]), color=CYCLE[j % len(CYCLE)], ls=DASHES[j % len(DASHES)], label=name)
    ax.set(title="Joint angles", ylabel="angle [°]", xlabel="time [s]")
    _legend(ax)
    return ax


def force(t: np.ndarray, force_on_arm: np.ndarray, ax: Axes | None = None, *, measured: np.ndarray | None = None) -> Axes:
    """Plot the contact force on the arm, shape (n, 2) [N], simulated and where it is given measured."""
    ax = _axes(ax)
    for k, name in enumerate(("forward (y)", "up (z)")):
        if measured is not None:
            ax.plot(*_broken(t, measured[:, k]), color=SILVER, lw=3.2, label="measured" if k == 0 else None)
        ax.plot(t, force_on_arm[:, k], color=CYCLE[k], ls=DASHES[k], label=name)
    ax.set(title="Force on the arm", ylabel="force [N]", xlabel="time [s]")
    _legend(ax)
    return ax


def contributions(t: np.ndarray, torques: Mapping[str, np.ndarray], ax: Axes | None = None, *, title: str = "") -> Axes:
    """Plot every torque of one joint by itself, with the sign it has in the equation of motion.

    Parameters
    ----------
    t : ndarray, shape (n,)
        [s]
    torques : mapping of str to ndarray, shape (n,)
        Names and torques [N m].
    """
    ax = _axes(ax)
    for k, (name, values) in enumerate(torques.items()):
        ax.plot(t, values, color=BESIDE_RED[k % len(BESIDE_RED)], ls=DASHES[(k // 2) % len(DASHES)], label=name)
    ax.axhline(0.0, color=INK, lw=0.8)
    ax.set(title=title, ylabel="torque [N m]", xlabel="time [s]")
    _legend(ax)
    return ax


def hysteresis(
    rising: Sequence[tuple[np.ndarray, np.ndarray]],
    falling: Sequence[tuple[np.ndarray, np.ndarray]],
    ax: Axes | None = None,
    *,
    title: str = "",
) -> Axes:
    """Plot the passive moment of one joint against its angle, by direction of motion.

    Parameters
    ----------
    rising, falling : sequence of (angle, moment)
        Samples with growing and with shrinking angle, one pair a repeat [rad], [N m].
    """
    ax = _axes(ax)
    for pairs, colour, name in ((rising, RED, "rising"), (falling, BLUE, "falling")):
        for k, (q, moment) in enumerate(pairs):
            ax.plot(np.degrees(q), moment, color=colour, ls="", marker=".", ms=2.0, alpha=0.25, label=name if k == 0 else None)
    ax.set(title=title, xlabel="joint angle [°]", ylabel="passive moment [N m]")
    _legend(ax)
    return ax


def mean_and_spread(
    angle: np.ndarray, mean: np.ndarray, std: np.ndarray, ax: Axes | None = None, *, label: str, colour: str = INK, dashed: bool = False
) -> Axes:
    """Plot a mean against the joint angle with a band of one standard deviation, shapes (k,) [rad], [N m]; NaN leaves a hole."""
    ax = _axes(ax)
    there = np.where(np.isfinite(std), std, 0.0)
    ax.fill_between(np.degrees(angle), mean - there, mean + there, color=colour, alpha=0.22, lw=0)
    ax.plot(np.degrees(angle), mean, color=colour, lw=1.8, ls="--" if dashed else "-", marker="o", ms=3, label=label)
    ax.set(xlabel="joint angle [°]", ylabel="moment [N m]")
    _legend(ax)
    return ax


def by_direction(
    angle: np.ndarray,
    values: np.ndarray,
    direction: np.ndarray,
    ax: Axes | None = None,
    *,
    title: str = "",
    quantity: str = "residual [N m]",
) -> Axes:
    """Plot samples of one joint against its angle, coloured by the direction of its motion.

    Parameters
    ----------
    angle, values, direction : ndarray, shape (n,)
        [rad], unit of `quantity`, and -1, 0 or 1.
    """
    ax = _axes(ax)
    for sign, colour, name in ((0, SILVER, "neither"), (1, RED, "rising"), (-1, BLUE, "falling")):
        own = direction == sign
        if not own.any():
            continue
        ax.plot(np.degrees(angle[own]), values[own], color=colour, marker=".", ms=2.5, ls="", alpha=0.5, label=name)
    ax.axhline(0.0, color=INK, lw=0.8)
    ax.set(title=title, xlabel="joint angle [°]", ylabel=quantity)
    _legend(ax)
    return ax


_BESIDE_TITLE = 50
"""Letters of title and legend that stand beside each other above a panel."""
DASHES = ("-", "--", "-.", ":")


def _legend(ax: Axes) -> None:
    """Put the legend where no data are: right of the title when it is short, below the axis when it is long."""
    shown: list[Any] = ax.get_legend_handles_labels()[0]
    count = len(shown)
    if count == 0:
        return
    # A point needs no room for a line.
    look = {"columnspacing": 1.2, "handlelength": 1.6 if any(handle.get_linestyle() != "None" for handle in shown) else 0.7}
    words = len(ax.get_title(loc="left")) + sum(len(str(handle.get_label())) + 4 for handle in shown)
    if count <= 3 and words <= _BESIDE_TITLE:
        legend = ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2, ncols=count, **look)
    else:
        legend = ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.17), ncols=4, **look)
    handles: list[Any] = legend.legend_handles
    for handle in handles:
        handle.set_alpha(1.0)
        if handle.get_marker() == "." and handle.get_linestyle() == "None":
            handle.set_markersize(9)


def _axes(ax: Axes | None) -> Axes:
    if ax is not None:
        return ax
    from matplotlib import pyplot

    with style():
        return pyplot.subplots(figsize=(7.0, 4.0), layout="constrained")[1]


def _broken(t: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Break a line where samples are missing, rather than to draw across."""
    if len(t) < 3:
        return t, values
    wide = np.flatnonzero(np.diff(t) > 2.5 * np.median(np.diff(t))) + 1
    return np.insert(t, wide, np.nan), np.insert(values, wide, np.nan)


def shade(share: float) -> Any:
    """Return a colour for a place in an order, 0 to 1, that is distinguishable in grey."""
    import matplotlib

    return matplotlib.colormaps["viridis"](0.85 * share)
