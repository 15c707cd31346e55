"""Animation of a gap report: the arm as measured and as simulated, and series with effects to switch on and off."""

from __future__ import annotations

import numpy as np

from ...catalogue import catalogue
from ...errors import BadInput, SimulationError
from ...io.trial import Trial
from ...workflows.gap.core_input import channel_names, is_led
from ...workflows.gap.effect_curves import telling_trial
from ...workflows.gap.gap_result import GapFound
from ...workflows.simulate import Simulated, simulate
from .. import plotting
from ..interactive import NOTHING, Live
from ..interactive_series import Line, Panel, series
from ..run_animation import SERIES, compared
from .figures import STEPS, steps_of
from .headline import channel_label, place_of


def moving(result: GapFound) -> Live:
    """Return the animation of the page: the most informative test trial, measured and simulated, also without each named effect."""
    if not is_led(result.dataset):
        return NOTHING
    shown = telling_trial(result)
    trial, play = result.dataset.trials[shown], result.trials[shown]
    steps = {step: course for step in steps_of(result) if (course := play.shown[step]) is not None}
    if not steps:
        return NOTHING
    t, n = trial.t - trial.t[0], result.dataset.model.n_joints
    without = _without(result, trial, steps["amended"]) if "amended" in steps else {}
    colours = [colour for colour in plotting.MANY if colour not in {STEPS[step][0] for step in steps}]
    panels = []
    for c, name in enumerate(channel_names(result.dataset, True)):
        label, factor = channel_label(name)
        title, _, unit = label.rstrip("]").partition(" [")
        lines = [Line("measured", plotting.SILVER, np.where(trial.valid, play.measured[:, c], np.nan) * factor)]
        lines += [Line(STEPS[step][1], STEPS[step][0], course[:, c] * factor, shown=step != "given") for step, course in steps.items()]
        lines += [
            Line(f"without {words}", colours[k % len(colours)], course[:, c] * factor, shown=False)
            for k, (words, course) in enumerate(without.items())
        ]
        panels.append(Panel(title, unit, tuple(lines)))
    text = f"The test trial with the largest gap, {trial.file}: measured, and simulated with each model. Switch single effects off."
    arms = {"arm as simulated": [*steps.values()][-1][:, :n], "arm as measured": trial.q}
    film = compared(result.dataset.model, t, arms, trial.robot_q)
    return Live(film, series(SERIES, text, t, panels))


def _without(result: GapFound, trial: Trial, amended: np.ndarray) -> dict[str, np.ndarray]:
    """Return the channels of a trial without each named effect: what its absence changes in a simulation, from the amended course.

    Effects of sensors change no simulated movement.
    """
    named = [e for e in result.effects if e.trial is None and "sensor" not in catalogue()[e.kind].where]
    joints = [joint.name for joint in result.dataset.model.joints]
    model = result.model
    found: dict[str, np.ndarray] = {}
    try:
        with_all = _channels(simulate(model, trial), trial)
        for effect in named:
            left = tuple(e for e in model.effects if (e.kind, e.joint) != (effect.kind, effect.joint))
            if len(left) < len(model.effects):
                changed = _channels(simulate(model.replace(effects=left), trial), trial) - with_all
                found[place_of(effect.kind, effect.joint, effect.channel, joints)] = amended + changed
    except (BadInput, SimulationError):
        # An arm that cannot be followed without an effect has no course to show.
        return found
    return found


def _channels(run: Simulated, trial: Trial) -> np.ndarray:
    """Return angles and forces at the samples of a trial."""
    columns = np.column_stack([run.q, run.force_on_arm]).T
    return np.column_stack([np.interp(trial.t - trial.t[0], run.t, column) for column in columns])
