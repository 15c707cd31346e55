"""Figures of runs with a compliant handle: the force on the arm with and without support, and the stiffness at the hand."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from . import plotting
from .figures import Drawn, Figures, slug
from .tables import RUNS, run_named

if TYPE_CHECKING:
    from ..workflows.interaction import Interacted
    from ..workflows.record import Recorded


def figures(result: Recorded) -> Figures:
    """Return the forces of the first trial of each movement, and the stiffness of the tip where it was perturbed."""
    made: dict[str, Any] = {}
    stories = {f"trials/{t['configuration']}_{t['repeat']}.csv": t for t in result.trials}
    for file, runs in result.interacted.items():
        story = stories[file]
        if story["repeat"] > 1:
            continue
        name = story["configuration"]
        made[f"{name}, force"] = partial(_forces, name, runs)
        if "endpoint_stiffness_N_m" in story["interaction"]["run"]:
            made[f"{name}, stiffness"] = partial(_stiffness, name, story["interaction"])
    return made


def _forces(name: str, runs: tuple[Interacted, ...]) -> Drawn:
    figure = plotting.figure(8.6, 4.6)
    axes = figure.subplots(2, 1, sharex=True)
    for key, run, colour in zip(RUNS, runs, (plotting.BLUE, plotting.ORANGE), strict=False):
        axes[0].plot(run.t, np.hypot(*run.force_on_arm.T), color=colour, label=run_named(key, len(runs)))
    for k, torque in enumerate(runs[0].support.T, start=1):
        axes[1].plot(runs[0].t, torque, color=(plotting.GREEN, plotting.PURPLE, plotting.GREY)[k - 1], label=f"joint {k}")
    axes[0].set(ylabel="force [N]", title="Force of the robot on the arm")
    axes[1].set(ylabel="torque [N m]", title="Torque of the motors that carry the arm", xlabel="time [s]")
    for ax in axes:
        ax.legend(loc="center right")
    text = f"Movement {name}, first repeat. The rest at the end is the hold."
    return Drawn(f"interaction-{slug(name)}", "Force at the hand", text, figure)


def _stiffness(name: str, story: Mapping[str, Any]) -> Drawn:
    """Draw the force at a displacement of 1 cm in every direction (Mussa-Ivaldi, Hogan and Bizzi 1985)."""
    figure = plotting.figure(5.2, 4.6)
    ax = figure.subplots()
    around = np.linspace(0.0, 2.0 * np.pi, 181)
    circle = 0.01 * np.stack([np.cos(around), np.sin(around)])
    count = sum(story[key] is not None for key in RUNS)
    for key, colour in zip(RUNS, (plotting.BLUE, plotting.ORANGE), strict=True):
        found = (story[key] or {}).get("endpoint_stiffness_N_m")
        if found is not None:
            ax.plot(*(np.array(found) @ circle), color=colour, label=run_named(key, count))
    ax.set(xlabel="force forward, y [N]", ylabel="force up, z [N]")
    ax.set_aspect("equal", adjustable="datalim")
    ax.legend()
    text = f"Movement {name}, first repeat: the force that answers 1 cm of the hand in every direction, fitted to the perturbation."
    return Drawn(f"stiffness-{slug(name)}", "Stiffness at the hand", text, figure)
