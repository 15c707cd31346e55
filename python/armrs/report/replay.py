"""Figures and report of a device log that the estimator has processed."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from .. import formatting
from ..online.estimator import STATUSES
from ..online.log_replay import NO_REFUSAL, Replay
from ..workflows import result_data
from . import plotting
from .figures import Drawn, Figures
from .view import View

_MOST_BANDS = 400
"""Stretches of time in which a status is drawn, so that a long log stays a small picture."""


def replayed_data(result: Replay, command: str | None = None) -> dict[str, Any]:
    """Return a replay as it is written to JSON."""
    joints = [joint.name for joint in result.model.joints]
    data = {"name": f"{len(result.status) * result.settings.period:.4g} s", "joints": joints}
    return {"verb": "online replay", "data": data, **result.to_dict(), "made_by": result_data.origin(command)}


def figures(result: Replay) -> Figures:
    """Return the figures of a replay: health over time, estimates, and the torque that carries the arm."""
    if not len(result.t):
        return {}
    return {
        "health": partial(_health, result),
        "estimates": partial(_estimates, result),
        "support": partial(_support, result),
    }


def _health(result: Replay) -> Drawn:
    """Draw what became of the samples, the torque that is not explained, and the time since something was learned."""
    figure = plotting.figure(8.6, 5.6)
    samples, residual, age = figure.subplots(3, 1, sharex=True, height_ratios=(1.4, 1.0, 1.0))
    there = [name for name in STATUSES if name in result.counts]
    times = result.start + result.settings.period * np.arange(len(result.status))
    width = max(1, len(result.status) // _MOST_BANDS)
    for row, name in enumerate(there):
        seen = np.add.reduceat(result.status == name, np.arange(0, len(result.status), width)) > 0
        colour = plotting.GREEN if name in NO_REFUSAL else plotting.RED
        samples.plot(times[::width][seen], np.full(int(seen.sum()), row), "|", color=colour, ms=9)
    samples.set_yticks(range(len(there)), [f"{name}, {result.counts[name]}" for name in there])
    samples.set(title="what became of the samples", ylim=(-0.6, len(there) - 0.4))
    for joint, values in zip(result.model.joints, result.residual.T, strict=True):
        residual.plot(result.t, values, label=joint.name)
    residual.set(title="unexplained torque", ylabel="[N m]", ylim=(0.0, None))
    residual.legend(loc="upper right")
    age.plot(result.t, result.age, color=plotting.GREY)
    age.set(title="time since a sample was learned from", ylabel="[s]", xlabel="time [s]", ylim=(0.0, None))
    text = (
        "Above, when samples were learned from (green) and refused (orange), with their number. Limit the support by the torque that the "
        "estimate leaves unexplained and by the time since something was learned."
    )
    return Drawn("health", "Health of the estimator", text, figure)


def _estimates(result: Replay) -> Drawn:
    """Draw every unknown over time with twice its standard deviation."""
    rows, columns = plotting.grid(len(result.estimates))
    figure = plotting.figure(3.4 * columns, 2.1 * rows)
    axes = figure.subplots(rows, columns, squeeze=False, sharex=True).ravel()
    for k, e in enumerate(result.estimates):
        ax, values, std = axes[k], result.values[:, k], 2.0 * result.std[:, k]
        known = np.flatnonzero(result.decided_by[:, k] == "data")
        ax.fill_between(result.t, values - std, values + std, color=plotting.FAINT)
        ax.plot(result.t, values, color=plotting.GREY)
        if len(known):
            ax.plot(result.t[known], values[known], ".", ms=2.5, color=plotting.BLUE)
            # An unknown that nothing was known of starts with an interval that hides all that follows.
            low, high = np.min((values - std)[known]), np.max((values + std)[known])
            ax.set_ylim(low - 0.1 * (high - low), high + 0.1 * (high - low))
        ax.set_title(f"{formatting.symbol(e.name)}, joint {e.joint} [{formatting.unit(e.unit)}]", fontsize="small")
        if k >= len(result.estimates) - columns:
            ax.set_xlabel("time [s]")
            ax.tick_params(labelbottom=True)
    for ax in axes[len(result.estimates) :]:
        ax.remove()
    text = "Bands are twice the standard deviation. Blue where the data decide the value; grey where the model or a bound does."
    return Drawn("estimates", "What was learned", text, figure)


def _support(result: Replay) -> Drawn:
    """Draw the torque that carries the arm at the measured angles, with twice its standard deviation."""
    figure = plotting.figure(8.6, 1.9 * result.model.n_joints + 0.6)
    axes = figure.subplots(result.model.n_joints, 1, squeeze=False, sharex=True).ravel()
    for ax, joint, torque, sd in zip(axes, result.model.joints, result.torque.T, result.torque_sd.T, strict=True):
        ax.fill_between(result.t, torque - 2.0 * sd, torque + 2.0 * sd, color=plotting.SKY, alpha=0.4)
        ax.plot(result.t, torque, color=plotting.BLUE)
        ax.set(title=joint.name, ylabel="[N m]")
    axes[-1].set_xlabel("time [s]")
    text = (
        "Torque that carries the arm at rest, with twice its standard deviation. Where the line is broken the device would give none: the "
        "sample was missing, or the torque would leave the envelope."
    )
    return Drawn("support", "Torque that carries the arm", text, figure)


REPLAYED = View(replayed_data, lambda result, _: figures(result))
