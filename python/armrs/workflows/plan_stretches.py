"""Planning stretches of one joint at several speeds, and how well they determine its reflex."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from .. import checks
from .._armrs import Prediction
from ..analysis.stretch_reflex import UNITS, Stretch, spread
from ..analysis.stretch_sessions import LEAST_RANGE
from ..errors import BadInput, Text
from ..model import Model
from .movement import Movement
from .plan import Instruments, Limits, Plan, forecast
from .spasticity import DEFAULT_CUTOFF, low_pass

SLOWEST = np.radians(15.0)
"""Speed of the slowest stretch [rad/s]: below the threshold of most reflexes, so that it shows what is no reflex."""
PAUSE = 4.0
"""Rest before each stretch [s]: a reflex is weaker soon after another one (Hufschmidt and Mauritz 1985)."""
LEAST_VALUE = 1e-2
"""A number that is smaller than this counts as this beside its deviation [its SI unit]."""
_PEAK_SPEED, _PEAK_ACCELERATION = 1.875, 5.7735
"""Of a movement of least jerk, in units of way over time, and of way over time squared."""


def plan_stretches(
    model: Model, limits: Limits, joint: int, *, speeds: int = 5, repeats: int = 3, instruments: Instruments | None = None
) -> Plan:
    """Propose stretches of one joint at speeds from slow to as fast as the limits allow, and predict how well they will show its reflex.

    Parameters
    ----------
    model : Model
        Its `stretch_reflex` in this joint, where it has one, is what is expected; else one of 1 N m s/rad from 40 % of the fastest speed
        on, 40 ms late.
    limits : Limits
        The other joints are held in the middle of their ranges.
    joint : int
        From 1.
    speeds, repeats : int
        Speeds, in equal ratios, and stretches at each.
    instruments : Instruments

    Returns
    -------
    Plan
        With predictions of gain, threshold and latency from the data alone, by the linearised law; what the law misses is not in them.

    Raises
    ------
    BadInput
        For a range or limits that leave no two speeds, and a movement that the robot cannot make.
    """
    checks.instance("model", model, Model)
    checks.instance("limits", limits, Limits)
    instruments = instruments or Instruments()
    joint = checks.whole("joint", joint, least=1, most=model.n_joints)
    speeds, repeats = checks.whole("speeds", speeds, least=2, most=20), checks.whole("repeats", repeats, least=2, most=100)
    if len(limits.angles) != model.n_joints:
        raise BadInput("angles", Text(f"{len(limits.angles)} ranges"), f"{model.n_joints}, one a joint")
    low, high = limits.angles[joint - 1]
    if high - low < LEAST_RANGE:
        found, allowed = Text(f"{np.degrees(high - low):.3g}°"), f"at least {np.degrees(LEAST_RANGE):g}°: a stretch needs way"
        raise BadInput(f"range of joint {joint}", found, allowed)
    steepest = np.sqrt(limits.acceleration * (high - low) * _PEAK_SPEED**2 / _PEAK_ACCELERATION)
    fastest = min(limits.speed, float(steepest))
    if fastest < 3.0 * SLOWEST:
        allowed = f"limits that allow {np.degrees(3.0 * SLOWEST):g} °/s: three times the slowest stretch"
        raise BadInput("fastest stretch", Text(f"{np.degrees(fastest):.3g} °/s"), allowed)
    movements = tuple(_movement(limits, joint, float(v)) for v in np.geomspace(SLOWEST, fastest, speeds))
    own = next((e for e in model.effects if e.kind == "stretch_reflex" and e.joint == joint), None)
    usual = {"gain": 1.0, "threshold": 0.4 * fastest, "latency": 0.04, "direction": 1.0}
    expected = usual if own is None else usual | {"threshold": 0.3, "latency": 0.0} | dict(own.parameters)
    predictions = _predicted(model, movements, joint, repeats, expected, instruments)
    # What the robot can do, and the forces, are those of any planned movement.
    possible = forecast(model, movements, repeats=repeats, with_effects=(), instruments=instruments)
    worst = max(p.relative for p in predictions)
    return replace(possible, forecast=possible.forecast.replace(predictions=predictions, worst=worst))


def _movement(limits: Limits, joint: int, speed: float) -> Movement:
    rest = np.array([0.5 * (low + high) for low, high in limits.angles])
    there = rest.copy()
    rest[joint - 1], there[joint - 1] = limits.angles[joint - 1]
    way = there[joint - 1] - rest[joint - 1]
    acceleration = 1.02 * _PEAK_ACCELERATION * speed**2 / (_PEAK_SPEED**2 * way)
    return Movement(np.array([rest, there, rest]), speed=speed, acceleration=acceleration, pause=PAUSE, shape="smooth")


def _predicted(
    model: Model, movements: Sequence[Movement], joint: int, repeats: int, given: Mapping[str, float], instruments: Instruments
) -> tuple[Prediction, ...]:
    """Return the deviations that white noise of the force sensor leaves, by the linearised law."""
    direction = -1 if given["direction"] < 0.0 else 1
    shape = np.array([given["threshold"], given["latency"], 0.0, 0.0])
    made = [_stretch(m, joint - 1, instruments.rate) for m in movements for _ in range(repeats)]
    lever = sum(segment.length for segment in model.segments[joint - 1 :])
    deviations = instruments.force * lever * spread(made, direction, shape, given["gain"])
    predictions = []
    for name, std in zip(("gain", "threshold", "latency"), map(float, deviations), strict=True):
        value = float(given[name])
        predictions.append(Prediction(name, "stretch_reflex", joint, value, std, std, std / max(value, LEAST_VALUE), UNITS[name]))
    return tuple(predictions)


def _stretch(movement: Movement, joint: int, rate: float) -> Stretch:
    """Return the motion of one joint, there and back, of least jerk."""
    low, high = movement.waypoints[0, joint], movement.waypoints[1, joint]
    lasts = _PEAK_SPEED * (high - low) / movement.speed
    t = np.arange(0.0, 2.0 * lasts + 1.0, 1.0 / rate)
    q, qd, qdd = np.full(len(t), low), np.zeros(len(t)), np.zeros(len(t))
    for begin, way in ((0.25, high - low), (0.75 + lasts, low - high)):
        s = np.clip((t - begin) / lasts, 0.0, 1.0)
        q += way * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        qd += way / lasts * 30.0 * (s * (1.0 - s)) ** 2
        qdd += way / lasts**2 * 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)
    smooth, none = low_pass(rate, min(DEFAULT_CUTOFF, 0.4 * rate)), np.zeros((0, len(t)))
    return Stretch(t, q, qd, qdd, np.zeros(len(t)), q, qd, smooth, smooth, none, none, none)
