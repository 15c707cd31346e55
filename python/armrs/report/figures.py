"""Whole figures of results with their captions."""

from __future__ import annotations

import io
import itertools
import re
import unicodedata
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import formatting
from ..analysis.joint_coupling import LEAST_HELD, Dependence
from ..io.trial import Trial
from ..model import Model
from ..workflows.identify import Explained, Identified
from ..workflows.passive import PassiveMoments
from ..workflows.plan import MOST_UNCERTAIN
from ..workflows.simulate import Run, Simulated
from . import plotting, tables
from .sketch import sketch
from .stick_figures import points

if TYPE_CHECKING:
    from matplotlib.figure import Figure


MOST_CONFIGURATIONS = 8
"""So many movements are drawn; with more, a report would be too long to read."""


Part = tuple[np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Drawn:
    """A figure with the name of its file, its title and what it shows in words; `section` is the part of a report it belongs to."""

    name: str
    title: str
    text: str
    figure: Figure
    section: str = ""


Figures = Mapping[str, Callable[[], Drawn]]
"""The figures of a result by their names, each drawn when it is called."""


@dataclass(frozen=True)
class Image:
    """A figure that was drawn, as PNG, with the words of `Drawn`."""

    name: str
    title: str
    text: str
    section: str
    png: bytes


def draw(figures: Figures) -> list[Image]:
    """Draw all figures of a result, each to its end before the next."""
    with plotting.style(), plotting.same_sheet():
        return [_image(one()) for one in figures.values()]


def _image(drawn: Drawn) -> Image:
    png = io.BytesIO()
    plotting.write_png(drawn.figure, png)
    return Image(drawn.name, drawn.title, drawn.text, drawn.section, png.getvalue())


def shown(one: Callable[[], Drawn]) -> np.ndarray:
    """Draw a figure where pyplot shows it, and return its Axes."""
    with plotting.style(), plotting.in_pyplot():
        figure = one().figure
        # Ticks and layout take the style that is in force when they are made.
        figure.draw_without_rendering()
    axes = np.empty(len(figure.axes), dtype=object)
    axes[:] = figure.axes
    return axes


def identified(result: Identified, data: Mapping[str, Any]) -> Figures:
    """Return the figures of an identification: parameters with intervals, and torques measured and fitted for every movement."""
    joints = data["data"]["joints"]
    names = list(dict.fromkeys(e.trial.configuration for e in result.explained))[:MOST_CONFIGURATIONS]
    first: Figures = {
        "arm": partial(arm, result.model, [e.trial for e in result.explained], _measured_in_joints(data, joints)),
        "parameters": partial(parameters, [*data["parameters"], *data["combinations"]], joints, data["level"]),
    }
    return {**first, **{f"torques-{slug(name)}": partial(_torques, result, name, joints) for name in names}}


def _measured_in_joints(data: Mapping[str, Any], joints: Sequence[str]) -> list[tuple[int, str]]:
    """Return the result of the measurement for each joint: its number, and words."""
    items = [p for p in data["parameters"] if p["joint"] and p["kind"] not in ("segment", "combination") and p["decided_by"] == "data"]
    return [
        (p["joint"], f"{joints[p['joint'] - 1]}: {tables.label(p)} {formatting.plus_minus(p['value'], p['std'])} "
         f"{formatting.unit(p['unit'])}") for p in items
    ]  # fmt: skip


def arm(model: Model, trials: Sequence[Trial], measured: Sequence[tuple[int, str]]) -> Drawn:
    """Draw the arm with what was measured where it acts: numbers of joints, and words."""
    figure = plotting.figure(7.0, 3.2 + 0.2 * min(len(measured), 11))
    marked = {("joint", joint - 1) for joint, _ in measured}
    sketch(model, trials, marked, [(f"{joint}  {said}", plotting.INK) for joint, said in measured], figure.subplots())
    seen = "; ".join(said for _, said in measured[:MOST_CONFIGURATIONS]) or "no law of a joint is determined by the measurement"
    more = len(measured) - MOST_CONFIGURATIONS
    seen += f"; and {more} more, in the tables" if more > 0 else ""
    text = f"The arm in the middle of its movements, g is the direction of gravity. Marked joints are those with a measured law: {seen}."
    return Drawn("arm", "The arm", text, figure, "first")


def parameters(items: Sequence[Mapping[str, Any]], joints: Sequence[str], level: float) -> Drawn:
    """Draw estimates with intervals, one panel a unit."""
    unique = list({(tables.label(item), item.get("joint")): item for item in reversed(items)}.values())[::-1]
    units = list(dict.fromkeys(item["unit"] for item in unique))
    panels = [[item for item in unique if item["unit"] == unit] for unit in units]
    split = _balanced([len(panel) + 1.1 for panel in panels], 2 if len(panels) > 1 else 1)
    columns = [[(panels[k], [quantity_name(item, joints) for item in panels[k]]) for k in column] for column in split]
    figure = plotting.interval_panels(columns)
    text = (
        f"Bars are {100 * level:g} % intervals. A value with a full marker is determined by the measurement. One with a hollow marker is "
        "not: where the movements leave a value open it is that of the model as given, moved only as far as the combinations that are "
        "measured ask for."
    )
    return Drawn("parameters", "Parameters with intervals", text, figure)


def history(courses: Sequence[Mapping[str, Any]], panel: tuple[float, float] = (3.6, 2.4)) -> Figures:
    """Return the figure of a history, each panel of a size [inch]; nothing where no parameter was followed over two sessions."""
    return {"history": partial(_history, courses, panel)} if any(len(c["dates"]) > 1 for c in courses) else {}


def _history(courses: Sequence[Mapping[str, Any]], panel: tuple[float, float]) -> Drawn:
    """Draw every parameter over sessions, with twice its standard deviation."""
    rows, columns = plotting.grid(len(courses))
    figure = plotting.figure(panel[0] * columns, panel[1] * rows)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for ax, course in zip(axes, courses, strict=False):
        place = np.arange(len(course["dates"]))
        colour = plotting.ORANGE if course["changed"] else plotting.BLUE
        factor, held_in = formatting.read_followed(course["unit"])
        values, bars = (factor * np.asarray(course[name]) for name in ("values", "stds"))
        ax.errorbar(place, values, 2.0 * bars, fmt="o-", color=colour, capsize=3)
        ax.margins(y=0.15)
        ax.set_xticks(place, course["dates"], rotation=30, ha="right", fontsize="small")
        ax.set(title=f"{formatting.typeset(formatting.parameter_label(course))}{', changed' if course['changed'] else ''}", ylabel=held_in)
        ax.title.set_fontsize("small")
    for ax in axes[len(courses) :]:
        ax.remove()
    text = (
        "Parameters that the data decided, over the sessions; bars are twice the standard deviation. "
        "An orange one differs in the last session."
    )
    return Drawn("history", "Over the sessions", text, figure)


def planned(data: Mapping[str, Any], model: Model) -> Figures:
    """Return the figures of a plan: how well each parameter will be known, and the movements."""
    return {
        "predictions": partial(_planned, data["predictions"], data["data"]["joints"], data.get("compared")),
        "movements": partial(_movements, data["movements"], model),
    }


def _movements(movements: Sequence[Mapping[str, Any]], model: Model) -> Drawn:
    """Draw the arm at the waypoints of every movement, and the path of the hand."""
    rows, columns = plotting.grid(len(movements))
    figure = plotting.figure(3.7 * columns, 4.4 * rows)
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True).ravel()
    for number, (ax, movement) in enumerate(zip(axes, movements, strict=False), start=1):
        waypoints = np.radians(np.asarray(movement["waypoints_deg"], dtype=float))
        legs = [np.linspace(a, b, 25) for a, b in itertools.pairwise(waypoints)]
        hand = points(model, np.concatenate(legs))[:, -1]
        poses = points(model, waypoints)
        for k, pose in enumerate(poses):
            shade = plotting.shade(k / max(1, len(waypoints) - 1))
            ax.plot(*pose.T, color=shade, lw=2.2, marker="o", ms=4, solid_capstyle="round")
            here = [n for n, other in enumerate(poses) if np.hypot(*(other[-1] - pose[-1])) < 0.01]
            if k == here[0]:
                numbers = ", ".join(str(n + 1) for n in here)
                ax.annotate(numbers, pose[-1], xytext=(5, 3), textcoords="offset points", fontsize=9, path_effects=plotting.halo())
        ax.plot(*hand.T, color=plotting.GREY, lw=1.0, ls="--")
        ax.set(title=f"movement {number}", xlabel="forward, y [m]", ylabel="up, z [m]" if (number - 1) % columns == 0 else "")
        ax.set_aspect("equal", adjustable="box", anchor="C")
        ax.margins(0.1)
    for ax in axes[len(movements) :]:
        ax.remove()
    text = (
        "The arm at the waypoints of each movement, numbered in their order, from dark to bright; the dashed line is the way of the hand. "
        "Joints move together between two waypoints."
    )
    return Drawn("movements", "The movements", text, figure, "first")


def _planned(predictions: Sequence[Mapping[str, Any]], joints: Sequence[str], compared: Mapping[str, Any] | None) -> Drawn:
    """Draw the relative standard deviation to be expected of every parameter."""
    from matplotlib.ticker import LogLocator

    figure = plotting.figure(7.4, 0.34 * len(predictions) + 1.2)
    ax = figure.subplots()
    place = np.arange(len(predictions))
    ax.plot([100.0 * p["relative"] for p in predictions], place, "o", color=plotting.BLUE, ms=8, label="these movements")
    if compared is not None:
        ax.plot(
            [100.0 * p["relative"] for p in compared["predictions"]], place, "o", color=plotting.GREY, mfc="white", ms=8, label="compared"
        )
    ax.axvline(100.0 * MOST_UNCERTAIN, color=plotting.ORANGE, label="uncertain by half its value")
    ax.set_xscale("log")
    low, high = ax.get_xlim()
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 300.0 * low else (1.0,)))
    ax.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    ax.minorticks_off()
    ax.set_yticks(place, [quantity_name(p, joints) for p in predictions])
    ax.set_ylim(len(predictions) - 0.4, -0.6)
    ax.set_xlabel("standard deviation from the data alone [% of the value]")
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, borderaxespad=0.2)
    text = (
        "How well each parameter will be known from the data alone, relative to its value; a small parameter of an effect counts as "
        "0.05. Simulated before the experiment: what the model lacks is not in it."
    )
    return Drawn("predictions", "How well each parameter will be known", text, figure)


def quantity_name(item: Mapping[str, Any], joints: Sequence[str]) -> str:
    """Name a quantity beside an axis."""
    if item["kind"] in ("segment", "combination"):
        return formatting.typeset(item["name"])
    return f"{tables.label(item)} {tables.where(item, joints)}".strip()


def _balanced(sizes: Sequence[float], columns: int) -> list[list[int]]:
    """Share panels among columns so that these become about equally high; the order stays within each."""
    split: list[list[int]] = [[] for _ in range(columns)]
    for k in sorted(range(len(sizes)), key=lambda k: -sizes[k]):
        min(split, key=lambda column: sum(sizes[i] for i in column)).append(k)
    return sorted(sorted(column) for column in split)


def _torques(result: Identified, configuration: str, joints: Sequence[str]) -> Drawn:
    """Draw torques of a trial, and what is left in all repeats of its movement."""
    own = [e for e in result.explained if e.trial.configuration == configuration]
    shown = next((e for e in own if e.trial.role == "test"), own[0])
    figure, axes = plotting.pairs(joints, 5.0, 4.6, 2.0)
    for j, name in enumerate(joints):
        plotting.torque(_elapsed(shown), shown.measured[:, j], shown.fitted[:, j], axes[0, j], title=name)
        plotting.residual([(_elapsed(e), e.measured[:, j] - e.fitted[:, j], e.trial.role) for e in own], axes[1, j])
        axes[0, j].set_xlabel("")
    text = (
        f"Above, joint torques of {shown.trial.file} ({shown.trial.role} trial): what the measured forces and motion ask for, and what "
        f"the fitted model gives. Below, what is left in all {len(own)} repeats."
    )
    return Drawn(f"torques-{slug(configuration)}", f"Torques of the movement {configuration}", text, figure)


def _elapsed(explained: Explained) -> np.ndarray:
    """Return times since the start of the trial, so that repeats are superposed on any clock."""
    return explained.t - explained.trial.t[0]


TORQUES = {
    "inertial": "inertia",
    "centrifugal": "centrifugal",
    "coriolis": "Coriolis",
    "gravity": "gravity",
    "frame": "moving base",
    "resisting": "resisting",
    "drive": "motor",
    "contact": "contact",
}
"""Torque columns of a recording, and how a legend names them."""
_MOST_DRAWN = 20_000
"""Samples of a curve; more fall on the same pixels."""
_VISIBLE = 5e-3
"""A torque below this part of the largest would be a line on the axis."""


def outline(run: Run) -> Simulated:
    """Return a run that looks the same when it is drawn: of a long one, the lowest and highest values of every few samples."""
    together = 1 if run.samples <= _MOST_DRAWN else -(-2 * run.samples // _MOST_DRAWN)
    parts = [_extremes(piece, together) for piece in run.pieces()]
    return parts[0].with_columns({name: np.concatenate([part.columns[name] for part in parts]) for name in parts[0].columns})


def _extremes(piece: Simulated, together: int) -> Simulated:
    """Return what is drawn of a piece: two samples for every so many, of each column the lowest value and the highest."""
    starts = np.arange(0, len(piece.t), together)
    middles = np.minimum(starts + together // 2, len(piece.t) - 1)

    def of(name: str, values: np.ndarray) -> np.ndarray:
        if together == 1:
            return values
        both = (
            (values[starts], values[middles])
            if name == "time"
            else (np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts))
        )
        return np.stack(both, axis=1).reshape(-1, *values.shape[1:])

    kept = ["time", "q", "qd", "qdd", "force_on_arm", *(name for name in piece.columns if name.startswith("torque."))]
    return piece.with_columns({name: of(name, piece.columns[name]) for name in kept})


def simulated(result: Simulated, trial: Trial | None = None) -> Figures:
    """Return the figure of a run: angles, force and every torque of each joint. A trial that drove it is drawn behind the angles."""
    return {"simulated": partial(_simulated, result, trial)}


def _simulated(result: Simulated, trial: Trial | None) -> Drawn:
    names = [joint.name for joint in result.model.joints]
    n = len(names)
    columns = max(n, 2)
    figure = plotting.figure(4.6 * columns, 6.4)
    grid = figure.add_gridspec(2, 2 * columns)
    top = [figure.add_subplot(grid[0, k * columns : (k + 1) * columns]) for k in range(2)]
    measured = None if trial is None else np.column_stack([np.interp(result.t, trial.t - trial.t[0], q) for q in trial.q.T])
    plotting.angles(result.t, result.q, names, top[0], measured=measured)
    beside = None
    if trial is not None and trial.force_on_arm is not None:
        beside = np.column_stack([np.interp(result.t, trial.t - trial.t[0], f) for f in trial.force_on_arm.T])
    plotting.force(result.t, result.force_on_arm, top[1], measured=beside)
    largest = {key: np.abs(result.columns[f"torque.{key}"]).max(axis=0) for key in TORQUES}
    limit = _VISIBLE * np.max(list(largest.values()), axis=0)
    visible = {key: label for key, label in TORQUES.items() if (largest[key] > limit).any()}
    for j, name in enumerate(names):
        share = 2 * columns // n
        ax = figure.add_subplot(grid[1, j * share : (j + 1) * share])
        shown = {label: result.columns[f"torque.{key}"][:, j] for key, label in visible.items()}
        plotting.contributions(result.t, shown, ax, title=f"Torques: {name}")
    text = (
        "Inertial, centrifugal, Coriolis, gravity and resisting torques stand on the left of the equation of motion, those of motors and "
        "contact on the right. Torques that would be a line on the axis are left out."
    )
    if trial is not None:
        text += f" The broad lines are what was measured in {trial.file}."
    return Drawn("simulated", "Angles, force and torques", text, figure)


def passive(result: PassiveMoments) -> Figures:
    """Return the figures of passive moments: one a configuration, and one for each joint that depends on its neighbour."""
    names = [joint.name for joint in result.dataset.model.joints]
    configurations = list(dict.fromkeys(c.configuration for c in result.curves))[:MOST_CONFIGURATIONS]
    widths: dict[int, list[float]] = {}
    for c in result.curves:
        widths.setdefault(c.joint, []).append(float(np.nanmean(c.half_width)))
    said = [(j, f"{names[j - 1]}: half width of the hysteresis {_from_to(own)} N m") for j, own in sorted(widths.items())]
    first: Figures = {"arm": partial(arm, result.dataset.model, [m.trial for m in result.trials], said)} if said else {}
    first = {**first, **{f"passive-{slug(name)}": partial(_hysteresis, result, name, names) for name in configurations}}
    return {**first, **{f"dependence-{d.joint}": partial(_dependence, result, d, names) for d in result.dependence}}


def _from_to(values: Sequence[float]) -> str:
    low, high = formatting.digits(min(values)), formatting.digits(max(values))
    return low if low == high else f"{low} to {high}"


def _hysteresis(result: PassiveMoments, configuration: str, names: Sequence[str]) -> Drawn:
    """Draw the samples of a configuration by direction of motion, elastic mean and half width."""
    curves = [c for c in result.curves if c.configuration == configuration]
    own = [m for m in result.trials if m.trial.configuration == configuration]
    figure, axes = plotting.pairs([names[c.joint - 1] for c in curves], 4.9, 5.6, 1.7)
    for (above, below), curve in zip(axes.T, curves, strict=True):
        j = curve.joint - 1
        rising, falling = ([(m.q[d, j], m.moment[d, j]) for m in own for d in [m.direction[:, j] == sign]] for sign in (1, -1))
        plotting.hysteresis(rising, falling, above, title=names[j])
        plotting.mean_and_spread(curve.angle, curve.elastic, curve.elastic_std, above, label="elastic mean")
        plotting.mean_and_spread(
            curve.angle, curve.half_width, curve.half_width_std, below, label="half width (dissipative)", colour=plotting.PURPLE
        )
        above.set(ylabel="passive moment [N m]", xlabel="")
        below.set_ylim(bottom=min(0.0, below.get_ylim()[0]))
    text = (
        f"Above, samples of {len(own)} repeats by direction of motion and the mean of both directions. Below, half the difference "
        "of both directions. Bands are one standard deviation over the repeats."
    )
    return Drawn(f"passive-{slug(configuration)}", f"Passive moments of the movement {configuration}", text, figure)


def _dependence(result: PassiveMoments, fitted: Dependence, names: Sequence[str]) -> Drawn:
    """Draw elastic moments of one joint in all configurations, and what was fitted to them."""
    figure = plotting.figure(6.4, 4.2)
    ax = figure.subplots()
    moved = [c for c in result.curves if c.joint == fitted.joint and np.ptp(c.angle) > LEAST_HELD]
    own = sorted(moved, key=lambda c: float(c.held[:, fitted.adjacent - 1].mean()))
    for number, curve in enumerate(own):
        held = float(curve.held[:, fitted.adjacent - 1].mean())
        colour = plotting.shade(number / max(len(own) - 1, 1))
        ax.plot(np.degrees(curve.angle), curve.elastic, ".", color=colour, label=f"{names[fitted.adjacent - 1]} at {np.degrees(held):.0f}°")
        ax.plot(np.degrees(curve.angle), fitted.at(curve.angle, held), "-", color=colour)
    ax.set(title=names[fitted.joint - 1], xlabel="joint angle [°]", ylabel="elastic moment [N m]")
    ax.legend(fontsize="small")
    text = "Points are elastic means over the repeats of each configuration, lines the fitted law."
    return Drawn(f"dependence-{fitted.joint}", f"{names[fitted.joint - 1]}: own and adjacent angle", text, figure)


def direction_of_motion(before: Sequence[Part], after: Sequence[Part], joints: Sequence[str]) -> Drawn:
    """Draw what is left of the torques against the angle, without and with friction.

    A part holds angle, unexplained torque and direction of motion of one trial, each of shape (n, n_joints).
    """
    n = len(joints)
    with plotting.style():
        figure = plotting.figure(4.9 * n + 0.4, 6.4)
        axes = figure.subplots(2, n, squeeze=False, sharex="col", sharey="col")
        for row, (parts, which) in zip(axes, ((before, "no friction"), (after, "with friction")), strict=True):
            angle, left, sign = (np.concatenate(items) for items in zip(*parts, strict=True))
            for j, ax in enumerate(row):
                title = f"{joints[j]}, {which}"
                plotting.by_direction(angle[:, j], left[:, j], sign[:, j], ax, title=title, quantity="not explained [N m]")
        for ax in axes[0]:
            ax.set_xlabel("")
    text = (
        "Joint torque of the test trials that the model does not explain, after masses and calibration were fitted. Above, without "
        "friction; below, with dry friction at both joints. Colours say whether the angle rises or falls; grey samples rest or turn. A gap "
        "between both directions is what friction looks like."
    )
    return Drawn("direction", "What is left, by direction of motion", text, figure)


def known(rows: Sequence[Mapping[str, Any]], joints: Sequence[str], level: float) -> Drawn:
    """Draw estimates beside known values."""
    with plotting.style():
        drawn = parameters(rows, joints, level)
    return Drawn("known", "Identified and known", f"{drawn.text} The green line is the value that was simulated.", drawn.figure)


def slug(name: str) -> str:
    """Turn a name into one that every file system takes."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    # Of other scripts nothing is left: names stay apart by their sums.
    return re.sub(r"[^A-Za-z0-9_.-]+", "-", plain).strip("-.") or f"figure-{zlib.crc32(name.encode()):08x}"
