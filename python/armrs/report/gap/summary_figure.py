"""The opening figure of a gap report: the arm with the named effects at their places, and the gap before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..._armrs import ChannelGap, Missing
from ...catalogue import Kind, catalogue, title
from ...formatting import plus_minus, read_in, with_unit
from ...workflows.gap.gap_result import GapFound
from .. import plotting
from ..figures import Drawn
from ..sketch import sketch
from .headline import largest, left, only_near, place_of, rank, shown_in, still_open

if TYPE_CHECKING:
    from matplotlib.axes import Axes

STEPS = {
    "before": (plotting.GREY, "model as given"),
    "calibrated": (plotting.ORANGE, "calibrated"),
    "after": (plotting.BLUE, "with the named effects"),
}
"""The steps of a gap: colour and name."""
_LINES = 11
"""Effects that find room beside the sketch."""
_SIGNS = {"frame": "g", "base": "↔"}
"""How the sketch marks places that are neither a joint nor a segment; all others it marks at the hand."""


def summary(result: GapFound) -> Drawn:
    """Draw the arm with the named effects, and beside it the gap of every channel on the test trials in units of its floor."""
    gaps = {name: g for name, g in result.gap.items() if g.calibrated is not None}
    named = len(result.effects)
    figure = plotting.figure(10.6, max(3.9, 0.34 * len(gaps) + 1.7, 0.3 * min(named, _LINES) + 1.5))
    left, right = figure.subplots(1, 2, gridspec_kw={"width_ratios": (1.0, 1.05)})
    drawn_arm(result, left)
    text = "Left, the arm in the middle of its movements, with the named effects where they act"
    sized = any(parameter.std is not None for effect in result.effects for parameter in effect.parameters.values())
    text += "; ± is one standard deviation." if sized else "."
    if not named:
        text = "Left, the arm in the middle of its movements; no effect was named."
    if gaps:
        shrinking(result, gaps, right)
        one = "what repeats differ by" if all(g.floor for g in gaps.values()) else "what the calibrated model leaves"
        text += f" Right, the root mean square of simulated minus measured on test trials, in units of {one}."
        if result.effects:
            text += " The step from calibrated to the named effects is due to the named effects alone."
    else:
        right.set_axis_off()
        right.text(0.0, 0.5, "There is no test trial to measure the gap on.")
    if not named:
        caption = "The gap, with no effect named"
    elif only_near(result.to_dict()):
        caption = "What comes nearest to what is missing, and how much of the gap it closes"
    else:
        caption = "What is missing from the model, and how much of the gap it closes"
    return Drawn("summary", caption, text, figure, "first")


# ---- the arm


def drawn_arm(result: GapFound, ax: Axes) -> None:
    """Draw the arm, the robot where there is one, and the named effects, each with its place and its size."""
    dataset = result.dataset
    joints = [j.name for j in dataset.model.joints]
    marked = {place for effect in result.effects for place in marks(effect, catalogue()[effect.kind])}
    lines = []
    for effect in sorted(result.effects, key=lambda e: rank(e.joint)):
        named = f"{joints[effect.joint - 1]}: " if effect.joint else f"{effect.channel}: " if effect.channel else ""
        here = f"{effect.joint}  {named}" if effect.joint else f"{_SIGNS.get(catalogue()[effect.kind].where, '■')}  {named}"
        lines.append((here + _words(effect), plotting.INK if getattr(effect, "decided", True) is not False else plotting.RED))
    sketch(dataset.model, dataset.trials, marked, lines, ax)


def marks(effect: Missing, kind: Kind) -> list[tuple[str, int]]:
    """Return what of the sketch an effect marks: by where its kind acts, never by its name."""
    if kind.first_joint > 1 and effect.joint is not None:
        return [("joint", effect.joint - 2), ("joint", effect.joint - 1), ("across", effect.joint - 1)]
    if effect.joint is not None:
        return [("segment" if kind.where == "segment" else "joint", effect.joint - 1)]
    return [(kind.where if kind.where in _SIGNS else "hand", 0)]


def rivals(effect: Missing) -> list[str]:
    """Return what an effect may be instead, with its place where that is another one."""
    here = (effect.joint, effect.channel)
    places = [(a.kind, None, None) if (a.joint, a.channel) == here else (a.kind, a.joint, a.channel) for a in effect.alternatives]
    return list(dict.fromkeys(place_of(*place) for place in places))


def _words(effect: Missing) -> str:
    """Return an effect with its size, and with its rivals where the data do not decide."""
    text = title(effect.kind)
    if getattr(effect, "decided", True) is False:
        return f"{text} (or {', '.join(rivals(effect))})"
    name = largest({n: {"value": v.value, "std": v.std, "unit": v.unit} for n, v in effect.parameters.items()})
    value = None if name is None else effect.parameters[name]
    if value is not None and value.std is not None:
        factor, held_in = read_in(value.unit)
        text += f" {plus_minus(factor * value.value, factor * value.std)} {held_in}".rstrip()
    return text + (" (one trial)" if effect.trial else "")


# ---- the gap


def shrinking(result: GapFound, gaps: Mapping[str, ChannelGap], ax: Axes) -> None:
    """Draw the gap of every channel in units of its floor (without repeats: of the calibrated gap), step by step."""
    named = any(e.trial is None for e in result.effects)
    steps = list(STEPS) if named else ["before", "calibrated"]
    floors = all(g.floor for g in gaps.values())
    told = result.to_dict()
    opened = still_open(told | {"data": {"joints": []}})
    largest = 1.0
    for row, (name, gap) in enumerate(gaps.items()):
        one = (gap.floor if floors else gap.calibrated) or 1.0
        # Where nothing was named, the calibrated model is that of the last fit, as in the headline.
        last = gap.calibrated if named else left(told["gap"][name])
        values = [(step, last if step == "calibrated" else getattr(gap, step)) for step in steps]
        seen = [(step, value / one) for step, value in values if value is not None]
        largest = max(largest, *(value for _, value in seen))
        ax.hlines(row, min(v for _, v in seen), max(v for _, v in seen), color=plotting.SILVER, lw=2.4, zorder=1)
        doubt = getattr(gap, "floor_std", None)
        if floors and doubt:
            ax.fill_betweenx(
                [row - 0.36, row + 0.36], max(1.0 - doubt / one, 0.05), 1.0 + doubt / one, color=plotting.GREEN, alpha=0.25, lw=0
            )
        for step, value in seen:
            colour, _ = STEPS[step]
            ax.plot(
                value, row, marker="o", ms=9, color=colour, mfc="white" if step == "before" else colour, mew=1.8, zorder=3, clip_on=False
            )
        text, colour = _change(name, seen, one, opened=name in opened), plotting.RED if name in opened else plotting.INK
        right: dict[str, Any] = {"xycoords": ax.get_yaxis_transform(), "xytext": (6, 0), "textcoords": "offset points"}
        ax.annotate(text, (1.0, row), va="center", fontsize=9, color=colour, **right)
    if floors:
        ax.axvline(1.0, color=plotting.GREEN, lw=2.2, zorder=2)
    if largest > 4.0:
        ax.set_xscale("log")
        ax.set_xticks(ticks := [t for t in (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000) if t < 1.3 * largest], [str(t) for t in ticks])
        ax.minorticks_off()
        ax.set_xlim(right=1.25 * largest)
    else:
        ax.set_xlim(0.0, max(1.15 * largest, 1.5))
    ax.set_yticks(range(len(gaps)), [name.rsplit("_", 1)[0] for name in gaps])
    ax.set_ylim(len(gaps) - 0.4, -0.6)
    ax.grid(visible=False, axis="y")
    ax.tick_params(axis="y", length=0)
    ax.set_xlabel(
        "gap on test trials, times what repeats differ by" if floors else "gap on test trials, times that of the calibrated model"
    )
    _legend(ax, steps, floors=floors)


def _change(name: str, seen: Sequence[tuple[str, float]], one: float, *, opened: bool) -> str:
    """Return what is fitted and what is left, `2.4 → 0.16 N`; `seen` are the steps in units of `one`."""
    factor, held_in = shown_in(name)
    ends = [f"{v:.2g}" if v < 99.5 else f"{v:.0f}" for v in (value * one * factor for step, value in seen if step != "before")]
    return with_unit(" → ".join(ends), held_in) + ("  open" if opened else "")


def _legend(ax: Axes, steps: list[str], *, floors: bool) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D(
            [], [], color=STEPS[s][0], marker="o", ls="", ms=8, mew=1.8, mfc="white" if s == "before" else STEPS[s][0], label=STEPS[s][1]
        )
        for s in steps
    ]
    if floors:
        handles.append(Line2D([], [], color=plotting.GREEN, lw=2.2, label="repeats differ by"))
    ax.legend(handles=handles, loc="lower left", bbox_to_anchor=(-0.04, 1.0), ncols=2, fontsize=9, columnspacing=1.2, handletextpad=0.5)
