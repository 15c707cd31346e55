"""Animations and series of simulated runs and of recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..io.trial import Trial
from ..model import Model
from ..workflows.simulate import Run, Simulated
from . import plotting
from .figures import TORQUES
from .interactive import Live
from .interactive_series import Line, Panel, series
from .stick_figures import film, points, robot_points

MOST_SAMPLES = 6000
"""Most samples of a run that are used; of a longer one every second, third …"""
AXES = ("forward, y", "up, z")
SERIES = "Interactive time series"


def simulated(run: Run, trial: Trial | None = None) -> Live:
    """Return the animation and the series of a run; a trial that drove it is shown beside it."""
    result = _strided(run)
    names = [joint.name for joint in run.model.joints]
    beside = None if trial is None else _interpolated(trial, result.t)
    panels = [
        Panel(
            f"{name}, angle",
            "°",
            (*_measured(beside, "q", j, 57.29577951308232), Line("simulated", plotting.RED, np.degrees(result.q[:, j]))),
        )
        for j, name in enumerate(names)
    ]
    if result.columns.get("handle") is not None:
        panels += [
            Panel(
                f"force on the arm, {axis}",
                "N",
                (*_measured(beside, "force", k), Line("simulated", plotting.RED, result.force_on_arm[:, k])),
            )
            for k, axis in enumerate(AXES)
        ]
    panels += [Panel(f"{name}, torques", "N m", _torques(result, j)) for j, name in enumerate(names)]
    text = "Angles, force, every torque of the equation of motion and every effect by itself; tick what is to be shown."
    return Live(
        film("Arm and robot", *_chains(run.model, result.t, {"arm": result.q}, result.columns.get("robot_q"))),
        series(SERIES, text, result.t, panels),
    )


def recorded(trial: Trial, model: Model) -> Live:
    """Return the animation and the series of a trial."""
    t = trial.t - trial.t[0]
    whole = trial.valid
    panels = [
        Panel(f"{joint.name}, angle", "°", (Line("measured", plotting.SILVER, np.where(whole, np.degrees(q), np.nan)),))
        for joint, q in zip(model.joints, trial.q.T, strict=True)
    ]
    if trial.force_on_arm is not None:
        panels += [
            Panel(f"force on the arm, {axis}", "N", (Line("measured", plotting.SILVER, np.where(whole, force, np.nan)),))
            for axis, force in zip(AXES, trial.force_on_arm.T, strict=True)
        ]
    return Live(
        film("Arm and robot", *_chains(model, t, {"arm": trial.q}, trial.robot_q)),
        series(SERIES, f"What the sensors read in {trial.file}.", t, panels),
    )


def _chains(
    model: Model, t: np.ndarray, arms: Mapping[str, np.ndarray], robot_q: np.ndarray | None
) -> tuple[str, np.ndarray, dict[str, tuple[str, np.ndarray]]]:
    """Return what a film is made of besides its title: text, times and chains."""
    colours = (plotting.RED, plotting.SILVER)
    drawn = {name: (colour, _whole(points(model, q))) for (name, q), colour in zip(arms.items(), colours, strict=False)}
    # The last one is drawn on top.
    chains = dict(reversed(drawn.items()))
    text = "The arm"
    if robot_q is not None and model.robot is not None:
        chains = {"robot": (plotting.BLUE, _whole(robot_points(model, np.asarray(robot_q))))} | chains
        text += " and the robot that leads its hand"
    return f"{text}, seen from the side.", t, chains


def compared(model: Model, t: np.ndarray, arms: Mapping[str, np.ndarray], robot_q: np.ndarray | None) -> Mapping[str, object]:
    """Return the film of several courses of one arm, the first in front."""
    return film("Arm and robot", *_chains(model, t, arms, robot_q))


def _whole(course: np.ndarray) -> np.ndarray:
    """Return points with the last known ones where samples are missing."""
    known = np.isfinite(course).all(axis=(1, 2))
    last = np.maximum.accumulate(np.where(known, np.arange(len(course)), 0))
    return np.nan_to_num(course[last])


def _strided(run: Run) -> Simulated:
    every = -(-run.samples // MOST_SAMPLES)
    kept: dict[str, list[np.ndarray]] = {}
    first: Simulated | None = None
    start = 0
    for piece in run.pieces():
        first = piece if first is None else first
        own = slice(-start % every, None, every)
        for name, values in piece.columns.items():
            if isinstance(values, np.ndarray) and values.ndim and len(values) == len(piece.t):
                kept.setdefault(name, []).append(values[own])
        start += len(piece.t)
    assert first is not None
    return first.with_columns({name: np.concatenate(parts) for name, parts in kept.items()} | {"effects": first.columns["effects"]})


def _interpolated(trial: Trial, t: np.ndarray) -> dict[str, np.ndarray]:
    """Return angles and force of a trial at the times of a run, from the start of the trial."""
    own = trial.t - trial.t[0]

    def at(values: np.ndarray) -> np.ndarray:
        return np.column_stack([np.interp(t, own, column) for column in values.T])

    found = {"q": at(trial.q)}
    return found if trial.force_on_arm is None else found | {"force": at(trial.force_on_arm)}


def _measured(beside: Mapping[str, np.ndarray] | None, quantity: str, column: int, factor: float = 1.0) -> tuple[Line, ...]:
    if beside is None or quantity not in beside:
        return ()
    return (Line("measured", plotting.SILVER, factor * beside[quantity][:, column]),)


def _torques(result: Simulated, joint: int) -> tuple[Line, ...]:
    """Return the torques of a joint that are anywhere different from zero, then the effects that act in it."""
    colours = plotting.BESIDE_RED
    visible = {key: label for key, label in TORQUES.items() if np.any(result.columns[f"torque.{key}"])}
    lines = [
        Line(label, colours[k % len(colours)], result.columns[f"torque.{key}"][:, joint]) for k, (key, label) in enumerate(visible.items())
    ]
    acting: Sequence[tuple[str, int]] = result.columns["effects"]
    resisting = result.columns.get("resisting")
    if resisting is None:
        return tuple(lines)
    # A kind has one colour, in whatever joint it acts.
    kinds = list(dict.fromkeys(kind for kind, _ in acting))
    for k, (kind, index) in enumerate(acting):
        if index == joint and np.any(resisting[:, k]):
            colour = colours[(len(visible) + kinds.index(kind)) % len(colours)]
            lines.append(Line(f"effect: {kind.replace('_', ' ')}", colour, resisting[:, k], shown=False))
    return tuple(lines)
