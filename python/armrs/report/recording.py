"""A recording before any computation: the arm at five instants with gravity and contact force, and each channel over time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..io import files
from ..io.dataset import Dataset
from ..io.trial import Trial
from ..model import Model
from . import plotting
from .figures import Drawn, shown, slug

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_INSTANTS = 5
_ARROW = 0.35
"""Length of the largest force's arrow, relative to the arm."""
_SAME = 0.06
"""Hands that are nearer than this, relative to the arm, share a label."""


def recording(trial: Trial, model: Model | None = None) -> Drawn:
    """Draw a trial: with a model also the arm as a stick figure in five instants."""
    if model is None:
        return channels(trial)
    panels = _panels(trial, _names(trial, model))
    tall = _height(panels)
    figure = plotting.figure(10.4, tall + 4.2)
    grid = figure.add_gridspec(2, 1, height_ratios=(4.2, tall))
    postures(trial, model, figure.add_subplot(grid[0]))
    _over_time(trial, panels, grid[1].subgridspec(*_shape(panels)).subplots(squeeze=False, sharex=True).ravel())
    return Drawn(_file("recording", trial), "What was recorded", f"{_CHANNELS.format(trial.file)} Above, {_ARM}", figure)


def arm(trial: Trial, model: Model, section: str = "") -> Drawn:
    """Draw the arm of a trial in five instants."""
    figure = plotting.figure(10.4, 3.0)
    postures(trial, model, figure.subplots())
    return Drawn(_file("arm", trial), "How the arm stood", f"{trial.file}: {_ARM}", figure, section)


def channels(trial: Trial, model: Model | None = None, section: str = "") -> Drawn:
    """Draw each channel of a trial over time, under the names of the joints of a model."""
    panels = _panels(trial, _names(trial, model))
    figure = plotting.figure(10.4, _height(panels))
    _over_time(trial, panels, figure.subplots(*_shape(panels), squeeze=False, sharex=True).ravel())
    return Drawn(_file("recording", trial), "What was recorded", _CHANNELS.format(trial.file), figure, section)


_CHANNELS = "{}: each channel as it was read, in the units and directions of armrs."
_ARM = (
    "the arm in five instants, pale to dark, with the force on it (blue) and gravity (grey). If the posture is not that of the "
    "laboratory, an angle convention is wrong. At rest, the force on a carried arm points up."
)
_Panel = tuple[str, np.ndarray, str]
"""Label, values and colour of a channel."""


def _file(what: str, trial: Trial) -> str:
    return f"{what}-{slug(trial.configuration)}-{trial.repeat}"


def _names(trial: Trial, model: Model | None) -> list[str]:
    return [f"q{j}" for j in range(1, trial.q.shape[1] + 1)] if model is None else [joint.name for joint in model.joints]


def _shape(panels: list[_Panel]) -> tuple[int, int]:
    """Return rows and columns."""
    columns = 2 if len(panels) <= 4 else 3
    return -(-len(panels) // columns), columns


def _height(panels: list[_Panel]) -> float:
    return 1.9 * _shape(panels)[0] + 0.4


def _over_time(trial: Trial, panels: list[_Panel], axes: np.ndarray) -> None:
    """Draw the channels, row by row; the lowest of each column has the numbers of the axis of time."""
    columns = _shape(panels)[1]
    for k, (ax, (label, values, colour)) in enumerate(zip(axes, panels, strict=False)):
        ax.plot(trial.t - trial.t[0], values, color=colour, lw=1.2)
        ax.set_title(label, fontsize="medium")
        if k >= len(panels) - columns:
            ax.set_xlabel("time [s]")
            ax.tick_params(labelbottom=True)
    for ax in axes[len(panels) :]:
        ax.remove()


def plot(trial: Trial, model: Model | None) -> np.ndarray:
    """Draw a trial where pyplot shows it, and return the Axes."""
    return shown(lambda: recording(trial, model))


def write_recording(dataset: Dataset, folder: Path) -> Path:
    """Write `recording.png` below a folder: the trial of a data set whose joints move most."""
    trial = dataset.most_moving
    target = folder / "recording.png"
    files.may_replace(target, ".png")
    with plotting.style():
        drawn = recording(trial, dataset.model)
        drawn.figure.suptitle(trial.file)
    with files.replacing(target) as temporary:
        plotting.write_png(drawn.figure, temporary)
    return target


def postures(trial: Trial, model: Model, ax: Axes) -> None:
    """Draw the arm in five instants at equal distances, with the contact force on it and the direction of gravity."""
    complete = np.flatnonzero(trial.valid)
    picked = complete[np.linspace(0, len(complete) - 1, _INSTANTS).astype(int)]
    lengths = np.array([s.length for s in model.segments])
    reach = float(lengths.sum())
    base = np.asarray(model.base)
    forces = trial.force_on_arm
    most = 0.0 if forces is None else float(np.nanmax(np.hypot(*forces[picked].T)))
    times: dict[tuple[float, ...], list[str]] = {}
    for shade, k in zip(np.linspace(0.25, 1.0, _INSTANTS), picked, strict=True):
        directions = np.cumsum(trial.q[k])
        steps = lengths[:, None] * np.column_stack([np.cos(directions), np.sin(directions)])
        points = np.vstack([base, base + np.cumsum(steps, axis=0)])
        ax.plot(*points.T, color=plotting.INK, alpha=shade, lw=3.0, marker="o", ms=5, solid_capstyle="round")
        if forces is not None and most > 0.0:
            _arrow(ax, points[-1], _ARROW * reach / most * forces[k], plotting.BLUE, alpha=shade)
        near = next((place for place in times if np.hypot(*(points[-1] - place)) < _SAME * reach), tuple(points[-1]))
        times.setdefault(near, []).append(f"{trial.t[k] - trial.t[0]:.3g} s")
    for place, said in times.items():
        ax.annotate(
            ", ".join(said),
            (place[0], place[1]),
            xytext=(8, -6),
            textcoords="offset points",
            fontsize=9,
            va="top",
            path_effects=plotting.halo(),
        )
    ax.plot(*base, marker="s", ms=11, color=plotting.INK, zorder=3)
    down = base + np.array([-0.25 * reach, 0.0])
    _arrow(ax, down, np.array([0.0, -0.25 * reach * np.sign(model.gravity)]), plotting.GREY)
    ax.annotate("gravity", (down[0], down[1]), xytext=(0, 4), textcoords="offset points", ha="center", fontsize=9, color=plotting.GREY)
    if most > 0.0:
        ax.set_title(f"Arm in five instants; largest arrow {most:.3g} N on the arm", fontsize="medium")
    else:
        ax.set_title("Arm in five instants", fontsize="medium")
    ax.set(xlabel="forward, y [m]", ylabel="up, z [m]")
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.12)


def _arrow(ax: Axes, start: np.ndarray, along: np.ndarray, colour: str, alpha: float = 1.0) -> None:
    end = start + along
    style: dict[str, Any] = {"arrowstyle": "-|>", "color": colour, "alpha": alpha, "lw": 1.8, "shrinkA": 0, "shrinkB": 0}
    ax.annotate("", (end[0], end[1]), (start[0], start[1]), arrowprops=style)
    ax.plot(*end, alpha=0.0)  # what is annotated does not widen the axes


def _panels(trial: Trial, names: list[str]) -> list[_Panel]:
    """Return each channel that was measured."""
    blue, orange, green, grey = plotting.BLUE, plotting.ORANGE, plotting.GREEN, plotting.GREY
    panels = [(f"{name}, angle [°]", np.degrees(q), blue) for name, q in zip(names, trial.q.T, strict=True)]
    if trial.force_on_arm is not None:
        panels += [(f"force on the arm, {axis} [N]", f, orange) for axis, f in zip(("forward", "up"), trial.force_on_arm.T, strict=True)]
    if trial.moment_on_arm is not None:
        panels.append(("moment on the arm [N m]", trial.moment_on_arm, orange))
    if trial.tau is not None:
        panels += [(f"{name}, measured torque [N m]", tau, green) for name, tau in zip(names, trial.tau.T, strict=True)]
    if trial.robot_q is not None:
        panels += [(f"robot's joint {k}, angle [°]", np.degrees(q), grey) for k, q in enumerate(trial.robot_q.T, start=1)]
    return panels + [(f"EMG {name[4:].replace('_uV', ' [µV]').replace('_', ' ')}", emg, grey) for name, emg in trial.emg.items()]
