"""The sketch at the top of a report: the arm in the middle of its movements, with marked effects."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..io.trial import Trial
from ..model import Model
from . import plotting

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LINES = 11
"""Names that find room above the sketch."""
_LINE = 15.0
"""Height of a name [pt]."""
_MOST_OF_THE_HEIGHT = 0.6


def sketch(model: Model, trials: Sequence[Trial], marked: Collection[tuple[str, int]], lines: Sequence[tuple[str, str]], ax: Axes) -> None:
    """Draw the arm at the median of its joint angles, the robot where its angles are known, and names above.

    Parameters
    ----------
    model : Model
    trials : sequence of Trial
    marked : collection of (str, int)
        What is drawn in blue: a `segment` or `joint` by its index from 0, `across` both joints of the segment that ends in a joint, the
        `hand`, the `frame` or the `base` with 0.
    lines : sequence of (str, str)
        What is written, and its colour.
    ax : Axes
    """
    q = np.median(np.concatenate([t.q[t.valid] for t in trials]), axis=0)
    directions = np.cumsum(q)
    steps = np.array([s.length for s in model.segments])[:, None] * np.column_stack([np.cos(directions), np.sin(directions)])
    points = np.vstack([model.base, np.asarray(model.base) + np.cumsum(steps, axis=0)])
    reach = float(np.ptp(points, axis=0).max())
    everything = np.vstack([points, _robot(model, trials, points[-1], ax)])
    for k in range(len(steps)):
        colour = plotting.BLUE if ("segment", k) in marked else plotting.INK
        ax.plot(*points[k : k + 2].T, color=colour, lw=6.0, solid_capstyle="round", zorder=2)
    for k, point in enumerate(points[:-1]):
        on = ("joint", k) in marked
        ax.plot(*point, marker="o", ms=15 if on else 9, mfc=plotting.BLUE if on else "white", mec=plotting.INK, mew=1.8, zorder=4)
        if on:
            ax.text(point[0], point[1], str(k + 1), color="white", ha="center", va="center", fontsize=9, fontweight="bold", zorder=5)
    hand = ("hand", 0) in marked
    ax.plot(*points[-1], marker="s", ms=11, mfc=plotting.BLUE if hand else "white", mec=plotting.INK, mew=1.8, zorder=4)
    _down(points, reach, ("frame", 0) in marked, ax)
    if ("base", 0) in marked:
        _shaken(points[0], reach, ax)
    for first, last in ((k - 1, k) for place, k in marked if place == "across"):
        _bow(points, first, last, reach, ax)
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.06)
    ax.set_axis_off()
    _labels(lines, everything, ax)


def _beside(text: str, at: tuple[float, float], offset: tuple[float, float], ax: Axes, **look: Any) -> None:
    ax.annotate(text, at, xytext=offset, textcoords="offset points", **({"fontsize": 9} | look))


def _robot(model: Model, trials: Sequence[Trial], tip: np.ndarray, ax: Axes) -> np.ndarray:
    """Draw the robot where it is known, and return its points."""
    robot = model.robot
    angles = [t.robot_q[t.valid] for t in trials if t.robot_q is not None]
    if robot is None or not angles:
        return np.empty((0, 2))
    first = float(np.median(np.concatenate(angles), axis=0)[0])
    base = np.asarray(robot.base)
    elbow = base + robot.lengths[0] * np.array([np.cos(first), np.sin(first)])
    line = np.vstack([base, elbow, tip])
    ax.plot(*line.T, color=plotting.SILVER, lw=4.0, solid_capstyle="round", zorder=1)
    ax.plot(*base, marker="s", ms=10, color=plotting.SILVER, zorder=1)
    # On the side that the link does not leave to.
    below = bool(elbow[1] >= base[1])
    _beside(
        "robot", (base[0], base[1]), (0.0, -9.0 if below else 9.0), ax, color=plotting.GREY, ha="center", va="top" if below else "bottom"
    )
    return line


def _down(points: np.ndarray, reach: float, marked: bool, ax: Axes) -> None:
    """Draw the weight's direction at the base."""
    colour = plotting.BLUE if marked else plotting.SILVER
    at = points[0] - [0.12 * reach, 0.0]
    ax.plot([at[0], at[0]], [at[1], at[1] - 0.2 * reach], color=colour, lw=2.2 if marked else 1.4)
    ax.plot(at[0], at[1] - 0.2 * reach, marker="v", ms=8, color=colour)
    ax.text(at[0], at[1] - 0.26 * reach, "g", color=colour, ha="center", va="top", fontsize=10)


def _shaken(base: np.ndarray, reach: float, ax: Axes) -> None:
    """Draw that the first joint does not stay in place."""
    style = {"arrowstyle": "-|>", "color": plotting.BLUE, "lw": 2.2, "shrinkA": 0.0, "shrinkB": 0.0}
    for y, z in ((0.16, 0.0), (-0.16, 0.0), (0.0, 0.16), (0.0, -0.16)):
        end = (base[0] + y * reach, base[1] + z * reach)
        ax.annotate("", end, xytext=(base[0], base[1]), arrowprops=style, zorder=3)


def _bow(points: np.ndarray, first: int, last: int, reach: float, ax: Axes) -> None:
    """Draw a cord over two joints, beside the segment between them."""
    along = points[last] - points[first]
    normal = np.array([-along[1], along[0]]) / max(float(np.hypot(*along)), 1e-9)
    s = np.linspace(-0.25, 1.25, 40)
    path = points[first] + s[:, None] * along + (0.1 * reach * (0.4 + np.sin(np.pi * np.clip(s, 0, 1))))[:, None] * normal
    ax.plot(*path.T, color=plotting.BLUE, lw=2.0, ls=(0, (2, 1.2)), zorder=3)


def _labels(lines: Sequence[tuple[str, str]], points: np.ndarray, ax: Axes) -> None:
    """Write names above everything that is drawn."""
    if len(lines) > _LINES:
        lines = [*lines[: _LINES - 1], (f"and {len(lines) - _LINES + 1} more", plotting.GREY)]
    for k, (line, colour) in enumerate(lines):
        _beside(line, (0.0, 1.0), (0.0, -_LINE * k), ax, xycoords="axes fraction", color=colour, va="top", fontsize=9.5)
    if lines:
        box = ax.get_window_extent()
        height = 72.0 * box.height / ax.figure.dpi
        taken = min((_LINE * len(lines) + 12.0) / height, _MOST_OF_THE_HEIGHT)
        # Limits keep one scale in both directions, so that only data move them.
        low, high = points[:, 1].min(), points[:, 1].max()
        ax.plot(points[0, 0], low + (high - low + 0.05) / (1.0 - taken), alpha=0.0)
