"""The smallest effects that a planned session would detect."""

from __future__ import annotations

from collections.abc import Sequence

from ... import _armrs, checks, interruptible
from ..._armrs import Limit
from ...catalogue import catalogue
from ...errors import BadInput, Text
from ...io.dataset import Dataset
from ...io.trial import Trial
from ...model import Model
from ..movement import Movement
from ..plan import Instruments
from ..simulate import Channel, Sensors, simulate
from .core_input import core_settings, core_trials

_STEP = 0.5e-3
"""Largest step of the simulation [s]."""


def detectable(
    model: Model,
    movements: Sequence[Movement],
    *,
    repeats: int = 3,
    instruments: Instruments | None = None,
    seed: int = 1,
    threads: int | None = None,
) -> tuple[Limit, ...]:
    """Return the smallest effect of every kind and place that planned movements would show.

    Parameters
    ----------
    model : Model
        The assumed arm, with its robot.
    movements : sequence of Movement
    repeats : int
        Trials of each movement, at least two: the noise is read off what they differ by, as `find_gap` does.
    instruments : Instruments
    seed : int
        Of the simulated noise.
    threads : int, optional

    Raises
    ------
    BadInput
        For a model without a robot, and for movements that the robot cannot make.

    Notes
    -----
    The session is simulated with white noise of the sensors and nothing hidden in it, calibrated, and every candidate is tested to first
    order, as on measured data. Tone, slips and whatever else differs between trials of a living arm make the limits larger.
    """
    checks.instance("model", model, Model)
    checks.instance("instruments", instruments, Instruments, type(None))
    instruments = instruments or Instruments()
    movements = checks.instances("movements", movements, Movement)
    checks.whole("repeats", repeats, least=2)
    checks.whole("seed", seed, least=0, most=2**32)
    if model.robot is None:
        raise BadInput("[robot]", Text("none"), "a robot: what a session shows depends on how the arm is led")
    sensors = Sensors(rate=instruments.rate, angle=Channel(instruments.angle), force=Channel(instruments.force))
    step = 1.0 / (instruments.rate * -(-1.0 // (instruments.rate * _STEP)))
    trials = []
    for number, movement in enumerate(movements):
        seeds = range(seed + repeats * number, seed + repeats * (number + 1))
        run = simulate(model, movement, dt=step, rate=instruments.rate, sensors=sensors, seeds=seeds)
        for repeat, read in enumerate(run.readings, start=1):
            columns = {name: getattr(read, name) for name in ("q", "force_on_arm", "robot_q")}
            trials.append(Trial(f"planned {number + 1}, {repeat}", f"planned {number + 1}", repeat, "fit", read.time, **columns))
    data = Dataset("planned", model, tuple(trials), force_on="arm", synthetic=True, tolerance=instruments.tolerance)
    seen = interruptible.call(_armrs.look, _armrs.Rig(model, model.all_effects), core_trials(data), core_settings(data, True, threads))
    limits = [
        Limit(s.kind, s.joint, s.channel, next(iter(s.parameters)), s.smallest, s.unit, s.gain, s.price)
        for s in seen.suspects
        if s.smallest == s.smallest and s.smallest != float("inf")
    ]
    order = list(catalogue())
    return tuple(sorted(limits, key=lambda w: (order.index(w.kind), w.joint or 0, w.channel or "")))
