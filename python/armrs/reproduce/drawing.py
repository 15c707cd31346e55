"""Pictures that several items share: arms in the plane, means with their spread over trials, bars beside a reference."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from .. import plotting
from ..model import Model
from .people import points

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


def over_trials(ax: Axes, t: np.ndarray, values: np.ndarray, label: str, colour: str) -> None:
    """Draw the mean over trials and bars of one standard deviation every so often; `values` has shape (trials, n)."""
    mean, std = np.nanmean(values, axis=0), np.nanstd(values, axis=0, ddof=1)
    ax.plot(t, mean, color=colour, lw=1.3, label=label)
    at = np.arange(len(t) // 24, len(t), max(1, len(t) // 12))
    ax.errorbar(t[at], mean[at], std[at], fmt="none", color=colour, capsize=2, lw=0.9)


def forces_and_torques(t: np.ndarray, force: np.ndarray, torque: np.ndarray, joints: Sequence[str]) -> Figure:
    """Draw means over trials of the force on the robot, shape (trials, n, 2) [N], and of its joint torques, shape (trials, n, n_joints)."""
    figure = plotting.figure(9.4, 3.6)
    left, right = figure.subplots(1, 2)
    for ax, values, labels in ((left, force, ("$F_y$", "$F_z$")), (right, torque, joints)):
        for k, label in enumerate(labels):
            over_trials(ax, t, values[:, :, k], label, plotting.CYCLE[k])
        ax.legend(fontsize=8)
    left.set(title="contact force", xlabel="time [s]", ylabel="force on the robot [N]")
    right.set(title="joint torque of the force", xlabel="time [s]", ylabel="torque [N m]")
    return figure


def bars(ax: Axes, names: Sequence[str], groups: Mapping[str, tuple[str, Sequence[float]]], *, ylabel: str, title: str = "") -> None:
    """Draw bars side by side: label -> colour and one value for each name; NaN leaves a hole."""
    width = 0.8 / len(groups)
    for k, (label, (colour, values)) in enumerate(groups.items()):
        ax.bar(np.arange(len(names)) + (k - 0.5 * (len(groups) - 1)) * width, values, width, color=colour, label=label)
    ax.axhline(0.0, color=plotting.INK, lw=0.8)
    ax.set_xticks(range(len(names)), names)
    ax.grid(visible=False, axis="x")
    ax.set(ylabel=ylabel, title=title)
