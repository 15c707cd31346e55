"""Figures that several items share: arms in the plane, means with scatter over trials, bars beside a reference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from .. import formatting
from ..model import Model
from ..report import plotting
from ..report.stick_figures import points

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def stick(ax: Axes, model: Model, q: np.ndarray, *, poses: int = 6, title: str = "") -> None:
    """Draw an arm at several poses of a movement, first one in full; `q` has shape (n, n_joints) [rad]."""
    every = points(model, q[np.linspace(0, len(q) - 1, poses).astype(int)])
    for k, pose in enumerate(every):
        ax.plot(*pose.T, "-o", color=plotting.RED, ms=2.5, lw=2.0 if k == 0 else 1.0, alpha=1.0 if k == 0 else 0.35)
    ax.plot(*every[0, 0], "s", color=plotting.INK, ms=6)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set(title=title, xlabel="y [m]", ylabel="z [m]")


FORCES = {"Fy": plotting.RED, "Fz": plotting.INK}
JOINTS = {"shoulder": plotting.BLUE, "elbow": plotting.ORANGE, "wrist": plotting.GREEN}
"""Names and colours, which are others for forces, since these stand beside joints."""


def over_trials(ax: Axes, t: np.ndarray, values: np.ndarray, colours: Mapping[str, str]) -> None:
    """Draw means over trials and bars of one standard deviation every so often, those of one curve beside the other's.

    `values` has shape (trials, n, k), and the first k of `colours` name them.
    """
    mean, std = np.nanmean(values, axis=0), np.nanstd(values, axis=0, ddof=1)
    count, every = values.shape[2], max(1, len(t) // 12)
    for k, (label, colour) in enumerate(list(colours.items())[:count]):
        ax.plot(t, mean[:, k], plotting.DASHES[k], color=colour, lw=1.4, label=label)
        at = np.arange((every * (2 * k + 1)) // (2 * count + 2), len(t), every)
        ax.errorbar(t[at], mean[at, k], std[at, k], fmt="none", color=colour, capsize=2, lw=0.9)


def forces_and_torques(t: np.ndarray, force: np.ndarray, torque: np.ndarray) -> Figure:
    """Draw means over trials of the force on the robot, shape (trials, n, 2) [N], and of the torques that its reaction makes in the arm.

    The latter have the shape (trials, n, n_joints) [N m]. Forces are those on the robot as in the thesis; its τ_j is weight and passive
    moments, which is the torque of the force on the arm.
    """
    figure = plotting.figure(9.4, 3.8)
    left, right = figure.subplots(1, 2)
    over_trials(left, t, force, FORCES)
    over_trials(right, t, torque, JOINTS)
    left.set(title="contact force", xlabel="time [s]", ylabel="force on the robot [N]")
    right.set(title="joint torques τⱼ", xlabel="time [s]", ylabel="torque of the force on the arm [N m]")
    legend(figure, left, right)
    return figure


def legend(figure: Figure, *axes: Axes) -> None:
    """Explain the curves of several axes in one line above a figure."""
    entries = [entry for ax in axes for entry in zip(*ax.get_legend_handles_labels(), strict=True)]
    figure.legend(*zip(*entries, strict=True), loc="outside upper left", ncols=len(entries))


def bars(
    ax: Axes,
    names: Sequence[str],
    groups: Mapping[str, tuple[str, Sequence[float]]],
    *,
    ylabel: str,
    title: str = "",
    digits: int | None = None,
) -> None:
    """Draw bars side by side: label -> colour and one value for each name; NaN leaves a hole. `digits` puts values at them."""
    width = 0.8 / len(groups)
    for k, (label, (colour, values)) in enumerate(groups.items()):
        drawn = ax.bar(np.arange(len(names)) + (k - 0.5 * (len(groups) - 1)) * width, values, width, color=colour, label=label)
        if digits is not None:
            # A bar of nothing is seen as a number, and that has no sign.
            ax.bar_label(drawn, [formatting.minus(f"{round(v, digits) + 0.0:.{digits}f}") for v in values], padding=2, fontsize=7)
    if digits is not None:
        ax.margins(y=0.1)
    ax.axhline(0.0, color=plotting.INK, lw=0.8)
    ax.set_xticks(range(len(names)), names)
    ax.grid(visible=False, axis="x")
    ax.set(ylabel=ylabel, title=title)
