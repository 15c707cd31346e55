"""Figures of the gap workflow: before and after, maps of the missing torque, search trace, each effect alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..._armrs import Missing, Suspect
from ...formatting import read_in
from ...workflows.gap import residual_maps
from ...workflows.gap.core_input import channel_names, is_led
from ...workflows.gap.effect_curves import EffectCurve, effect_curve, telling_trial
from ...workflows.gap.gap_result import GapFound
from .. import plotting
from ..figures import Drawn, Figures, slug
from .headline import channel_label, place_of, rank
from .summary_figure import summary

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STEPS = {
    "given": (plotting.GREY, "model as given", 0.9, ":"),
    "calibrated": (plotting.ORANGE, "calibrated", 1.1, "--"),
    "amended": (plotting.BLUE, "with the named effects", 1.3, "-"),
}
"""The models that are compared: colour, name, width and dash of their lines."""

_ROUNDING = 1e-9
"""A channel [rad, N, N m] that changes by no more does not change."""


def gap(result: GapFound) -> Figures:
    """Return the figures of what the workflow found; `section` of each is the part of the report that it belongs to."""
    figures: dict[str, Callable[[], Drawn]] = {"summary": partial(summary, result)}
    if any(g.calibrated is not None for g in result.gap.values()):
        figures["before-and-after"] = partial(_before_and_after, result)
    missing = _missing_torques(result)
    if all(missing.values()):
        figures["maps"] = partial(missing_torque, [j.name for j in result.dataset.model.joints], missing)
    if result.search_trace:
        figures["search_trace"] = partial(_search_trace, result)
    by_joint = sorted(enumerate(result.effects), key=lambda numbered: rank(numbered[1].joint))
    return figures | {_name_of(k, e): partial(_effect, result, k, e) for k, e in by_joint}


def steps_of(result: GapFound) -> list[str]:
    """Return the models that differ: where nothing was named, the last is the one before it."""
    together = [e for e in result.effects if e.trial is None]
    return ["given", "calibrated", "amended"] if together else ["given", "calibrated"]


def _before_and_after(result: GapFound) -> Drawn:
    """Draw the test trial with the largest gap: each channel, and below it what simulation and measurement differ by."""
    names = channel_names(result.dataset, is_led(result.dataset))
    shown = telling_trial(result)
    trial, play = result.dataset.trials[shown], result.trials[shown]
    t, columns = trial.t - trial.t[0], 2 if len(names) in (2, 4) else min(len(names), 3)
    rows = -(-len(names) // columns)
    figure = plotting.figure(10.4, 3.4 * rows)
    outer = figure.add_gridspec(rows, columns)
    for c, name in enumerate(names):
        label, factor = channel_label(name)
        inner = outer[c // columns, c % columns].subgridspec(2, 1, height_ratios=(1.5, 1.0), hspace=0.04)
        above = figure.add_subplot(inner[0])
        below = figure.add_subplot(inner[1], sharex=above)
        measured = np.where(trial.valid, play.measured[:, c], np.nan) * factor
        above.plot(t, measured, color=plotting.SILVER, lw=3.2)
        for step in steps_of(result):
            course = play.shown[step]
            if course is None:
                continue
            colour, _, width, dash = STEPS[step]
            above.plot(t, course[:, c] * factor, color=colour, lw=width, ls=dash)
            below.plot(t, course[:, c] * factor - measured, color=colour, lw=width - 0.2, ls=dash if step == "given" else "-")
        below.axhline(0.0, color=plotting.INK, lw=0.8)
        above.tick_params(labelbottom=False)
        above.set_title(label)
        below.set(ylabel="difference", xlabel="time [s]")
    _time_legend(figure, steps_of(result))
    text = (
        f"The test trial with the largest gap, {trial.file}. Above, what was measured (broad, grey) and the closed-loop simulation of the "
        "models; below, simulated minus measured."
    )
    return Drawn("before-and-after", "Simulated against measured, before and after", text, figure, "gap")


def _time_legend(figure: Any, steps: Sequence[str]) -> None:
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], color=plotting.SILVER, lw=3.2, label="measured")]
    handles += [Line2D([], [], color=STEPS[s][0], lw=1.6, ls=STEPS[s][3], label=STEPS[s][1]) for s in steps]
    figure.legend(handles=handles, loc="outside upper left", ncols=4, fontsize=9)


def _missing_torques(result: GapFound) -> dict[str, list[residual_maps.Discrepancy]]:
    """Return what torque is missing in the fit trials, by model; nothing where that cannot be computed."""
    led, plays = is_led(result.dataset), result.trials
    versions = [s for s in steps_of(result) if s != "given"]
    return {v: [d for d in residual_maps.discrepancies(result.dataset, led, plays, v) if d.trial.role == "fit"] for v in versions}


def missing_torque(joints: Sequence[str], found: Mapping[str, Sequence[residual_maps.Discrepancy]]) -> Drawn:
    """Draw the torque that is missing over angle and speed, a row for each model."""
    versions = list(found)
    figure = plotting.figure(4.4 * len(joints) + 0.4, 2.9 * len(versions) + 0.2)
    axes = figure.subplots(len(versions), len(joints), squeeze=False, sharex="col", sharey="col")
    for j, name in enumerate(joints):
        own = [residual_maps.residual_map(found[v], j) for v in versions]
        sizes = np.abs(own[0].torque[np.isfinite(own[0].torque)])
        most = float(np.quantile(sizes, 0.95)) if sizes.size else 1e-9
        for row, (version, one) in enumerate(zip(versions, own, strict=True)):
            ax = axes[row, j]
            look: dict[str, Any] = {"cmap": "RdBu_r", "vmin": -most, "vmax": most}
            edges = np.degrees(one.angle), np.degrees(one.speed)
            ax.set_facecolor(plotting.FAINT)
            # Cells that were visited are at least white.
            ax.pcolormesh(*edges, np.where(np.isfinite(one.torque), 0.0, np.nan), cmap="Greys", vmin=0.0, vmax=1.0)
            ax.pcolormesh(*edges, np.where(one.clear, np.nan, one.torque), alpha=0.3, **look)
            mesh = ax.pcolormesh(*edges, np.where(one.clear, one.torque, np.nan), **look)
            ax.axhline(0.0, color=plotting.INK, lw=0.6)
            ax.grid(visible=False)
            ax.set_title(f"{name}, {STEPS[version][1]}")
            ax.set_ylabel("joint speed [°/s]" if j == 0 else "")
        axes[-1, j].set_xlabel("joint angle [°]")
        bar = figure.colorbar(mesh, ax=list(axes[:, j]), location="right", shrink=0.9, pad=0.02, extend="both")
        bar.set_label("missing torque [N m]")
        bar.outline.set_visible(False)
    text = (
        "Mean torque over all fit trials by which a joint resists a growing angle more (red) or less (blue) than the model says, by "
        "angle and speed; above the line the angle grows. Two halves of opposite colour are friction, a change of colour from left to"
        " right is a spring or a weight, and colours that deepen away from the line are a resistance that grows with speed. Pale cells do"
        " not stand out from the scatter between trials; grey cells were not visited."
    )
    return Drawn("maps", "Where the torque is missing", text, figure, "where")


def _search_trace(result: GapFound) -> Drawn:
    """Draw what the contenders of each round explained."""
    count = sum(len(step.tried) for step in result.search_trace)
    figure = plotting.figure(9.2, 0.36 * count + 0.45 * len(result.search_trace) + 0.9)
    ax = figure.subplots()
    y, ticks, labels = 0.0, [], []
    for number, step in enumerate(result.search_trace, start=1):
        ax.text(0.0, y, f"round {number}", transform=ax.get_yaxis_transform(), ha="left", va="center", fontsize=9, fontweight="bold")
        y += 0.85
        gains = [tried.gain for tried in step.tried]
        goes_on = min(range(len(gains)), key=lambda k, best=step.before - step.after, gains=gains: abs(gains[k] - best))  # type: ignore[misc]
        for k, tried in enumerate(step.tried):
            ax.barh(y, max(tried.gain, 0.0), height=0.62, color=plotting.BLUE if k == goes_on else plotting.SILVER)
            ax.text(max(tried.gain, 0.0), y, f"  {tried.gain:.0f}", va="center", fontsize=9, color=plotting.INK)
            ticks.append(y)
            labels.append(" + ".join(place_of(*e) for e in tried.effects))
            y += 1.0
        y += 0.35
    ax.set_yticks(ticks, labels)
    ax.set_ylim(y - 0.4, -0.7)
    ax.margins(x=0.12)
    ax.set_xlim(left=0.0)
    ax.grid(visible=False, axis="y")
    ax.tick_params(axis="y", length=0)
    ax.set_xlabel("explained, in units of twice the log-likelihood")
    ax.xaxis.set_major_formatter(lambda value, _: f"{value:.6g}")
    text = (
        "Each round tests the whole catalogue, with segments and calibration refitted; the best few candidates are refitted by simulation "
        "and drawn here. The blue one gains most beyond the gain that its parameters require, and is kept. Effects that no longer gain "
        "enough are removed again, so that fewer may be named in the end."
    )
    return Drawn("search_trace", "The evidence, round by round", text, figure, "evidence")


def _effect(result: GapFound, number: int, effect: Missing) -> Drawn:
    """Draw one effect by itself: its law along the movements with its interval, and what it changes in the channels."""
    seen = effect_curve(result, effect)
    rows = np.empty((0, 0)) if seen.changed is None else seen.changed
    changed = [c for c in range(rows.shape[1]) if np.abs(rows[:, c]).max() > _ROUNDING]
    names = channel_names(result.dataset, is_led(result.dataset))
    panels = int(seen.torque is not None) + len({names[c].rsplit("_", 1)[1] for c in changed})
    figure = plotting.figure(6.0 if panels < 2 else 10.6, 3.2)
    axes = list(figure.subplots(1, max(panels, 1), squeeze=False)[0])
    text = ""
    if seen.torque is not None:
        _law(axes.pop(0), seen, seen.torque)
        band = ", with the 95 % interval of its size (band)" if np.any(seen.high > seen.low) else ""
        text = (
            f"Left, its torque against the {seen.against} along the fit trials{band}, and what was measured beyond everything else "
            "(grey: mean and scatter of trials). "
        )
    for unit in dict.fromkeys(names[c].rsplit("_", 1)[1] for c in changed):
        ax = axes.pop(0)
        for k, c in enumerate(c for c in changed if names[c].endswith(f"_{unit}")):
            label, factor = channel_label(names[c])
            ax.plot(seen.t, rows[:, c] * factor, color=plotting.CYCLE[k], ls=plotting.DASHES[k], label=label.split(" ")[0])
            ax.set_ylabel(f"change {label.split(' ', 1)[1]}")
        ax.axhline(0.0, color=plotting.INK, lw=0.8)
        ax.set_xlabel("time [s]")
        if effect.span is not None:
            ax.axvspan(*effect.span, color=plotting.YELLOW, alpha=0.18, lw=0)
        ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, ncols=5, columnspacing=1.2, handlelength=1.6)
    if changed:
        start = "Right, w" if seen.torque is not None else "W"
        role = "test " if any(t.role == "test" for t in result.dataset.trials) else ""
        which = "the trial in which it was" if effect.trial is not None else f"the {role}trial in which it changes most"
        text += f"{start}hat it changes in {seen.trial}, {which}: simulated with it minus without it."
    if not panels:
        axes[0].set_axis_off()
        axes[0].text(0.0, 0.5, "not drawn: it cannot be simulated by itself")
    label = place_of(effect.kind, effect.joint, effect.channel)
    return Drawn(_name_of(number, effect), label[0].upper() + label[1:], text.strip(), figure, "effects")


def _name_of(number: int, effect: Missing) -> str:
    """Return the name of the figure of an effect; `number` counts from 0."""
    return f"effect-{number + 1}-{slug(place_of(effect.kind, effect.joint, effect.channel)).lower()}"


def _law(ax: Axes, seen: EffectCurve, torque: np.ndarray) -> None:
    factor, unit = read_in({"angle": "rad", "speed": "rad/s"}.get(seen.against, "s"))
    x = seen.x * factor
    there = np.isfinite(seen.data)
    grey: dict[str, Any] = {"ms": 4, "color": plotting.GREY, "ecolor": plotting.SILVER, "elinewidth": 3}
    if there.any():
        ax.errorbar(x[there], seen.data[there], seen.scatter[there], fmt="o", label="measured", zorder=1, **grey)
    ax.fill_between(x, seen.low, seen.high, color=plotting.BLUE, alpha=0.25, lw=0, zorder=2)
    ax.plot(x, torque, color=plotting.BLUE, lw=2.0, label="named effect", zorder=3)
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2, ncols=2, columnspacing=1.2, handlelength=1.6)
    ax.axhline(0.0, color=plotting.INK, lw=0.8)
    ax.set(xlabel=f"joint {seen.against} [{unit}]" if seen.against != "time" else "time [s]", ylabel="resisting torque [N m]")


_SUSPECTS = 12
"""Effects that are drawn of a screening."""


def first_look(suspects: Sequence[Suspect], joints: Sequence[str]) -> Drawn:
    """Draw what each effect alone would explain, relative to what it must explain to be named."""
    shown = sorted(suspects, key=lambda s: -s.gain / s.price)[:_SUSPECTS]
    figure = plotting.figure(7.6, 0.32 * len(shown) + 1.1)
    ax = figure.subplots()
    ratios = np.array([s.gain / s.price for s in shown])
    ax.barh(range(len(shown)), ratios, color=[plotting.BLUE if r > 1.0 else plotting.SILVER for r in ratios], height=0.7)
    ax.axvline(1.0, color=plotting.ORANGE, lw=1.6)
    ax.set_xscale("log")
    ax.set_xlim(left=min(0.1, 0.5 * max(float(ratios.min(initial=0.1)), 1e-3)))
    ax.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    ax.minorticks_off()
    places = [joints[s.joint - 1] if s.joint is not None else s.channel or "" for s in shown]
    ax.set_yticks(range(len(shown)), [f"{s.kind}, {place}" if place else s.kind for s, place in zip(shown, places, strict=True)])
    ax.set_ylim(len(shown) - 0.4, -0.6)
    ax.grid(visible=False, axis="y")
    ax.set_xlabel("explained, relative to what must be explained to be named")
    text = (
        "Each effect alone and to first order, after calibration. Beyond the line it may be missing. Several bars may have one cause; "
        "`find_gap` tells them apart."
    )
    return Drawn("first-look", "What may be missing", text, figure)
