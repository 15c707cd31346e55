"""Movements that distinguish a named effect from its alternatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ... import _armrs, interruptible
from ..._armrs import Alternative, Missing, Separation
from ...errors import ArmrsError, SimulationError
from ...io.trial import Trial, bridged
from ...model import Model
from ..movement import Movement
from ..simulate import Sensors, simulate
from .core_input import core_settings, core_trials, is_led
from .gap_result import GapFound

SPEEDS = (0.15, 1.2)
"""Largest joint speeds of the movements that are tried, as far as the limits allow [rad/s]."""
BEYOND = 0.15
"""How far beyond the angles that were measured a movement may go [rad]."""
LARGEST = 0.7
"""Largest amplitude of a movement [rad]."""
STRONGER = 2.0
"""Largest force of a movement, relative to the largest measured one."""
FASTER = 1.5
"""How many times the largest measured joint speed."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """A movement of the family, as it would be recorded, and what it is in words."""

    movement: Movement
    words: str
    trial: Trial


def separate(result: GapFound, *, threads: int | None = None, progress: Callable[[str, float], None] | None = None) -> GapFound:
    """Propose for every alternative the movement that distinguishes it best from the named effect.

    Parameters
    ----------
    result : GapFound
    threads : int, optional
    progress : callable, optional

    Returns
    -------
    GapFound
        The same result; alternatives have `separating_movement` and `separation`.

    Notes
    -----
    The movements that are tried: each joint alone, all together, and neighbours against each other; out, through the middle to the
    other side and back; in two postures; slow and fast. They stay within 0.15 rad of the measured angles, 1.5 times the measured
    speed and twice the measured force. Every one is simulated with the named effect; then the rival is fitted to what was measured and
    to one such trial together, with segments, known effects and calibration refitted, to first order. What is left, in standard
    deviations of the noise, is the distance. Led arms only.
    """
    asked = [e for e in result.effects if e.trial is None and any(a.worse == a.worse and a.likeness == a.likeness for a in e.alternatives)]
    if not asked or not is_led(result.dataset):
        return result
    if progress:
        progress("looking for movements that separate", 0.92)
    family = _family(result)
    if not family:
        return result
    effects = tuple(_separated(result, e, family, threads) if e in asked else e for e in result.effects)
    return replace(result, result=result.result.replace(effects=effects))


def _separated(result: GapFound, effect: Missing, family: Sequence[Candidate], threads: int | None) -> Missing:
    """Return an effect whose alternatives carry the movement that separates them best."""
    model = result.result.lasting()
    there = [k for k, e in enumerate(model.all_effects) if (e.kind, e.joint, e.channel) == (effect.kind, effect.joint, effect.channel)]
    if not there or any(a.simulated is None for a in effect.alternatives):
        return effect
    own, others = model.all_effects[there[-1]], [e for k, e in enumerate(model.all_effects) if k != there[-1]]
    try:
        rows = interruptible.call(
            _armrs.distances,
            _armrs.Rig(model, [*others, own]),
            core_trials(result.dataset),
            core_settings(result.dataset, True, threads),
            [bridged(c.trial) for c in family],
            effect.alternatives,
        )
    except SimulationError:
        # Of an arm that cannot be simulated no movement can be proposed.
        return effect
    now = rows[0] or []
    # What no choice explains counts as noise, as it does in the search.
    noise = float(np.sqrt(max(result.result.scale, 1.0)))
    listed: list[Alternative] = []
    for k, alternative in enumerate(effect.alternatives):
        found = [(row[k], c) for row, c in zip(rows[1:], family, strict=True) if row is not None and np.isfinite(row[k])]
        if not found:
            listed.append(alternative)
            continue
        distance, best = max(found, key=lambda pair: pair[0])
        expected, then = float(now[k]) / noise, float(distance) / noise
        # What was expected of the fit trials to first order is known by now, whichever of the two it favours.
        seen = min(expected, float(np.sqrt(abs(alternative.worse))))
        separation = Separation(
            waypoints_deg=tuple(tuple(float(v) for v in np.round(np.degrees(row), 1)) for row in best.movement.waypoints),
            speed_rad_s=best.movement.speed,
            acceleration_rad_s2=best.movement.acceleration,
            shape=best.movement.shape,
            now=seen,
            then=float(np.sqrt(seen**2 + max(then**2 - expected**2, 0.0))),
        )
        listed.append(alternative.replace(separating_movement=best.words, separation=separation))
    return effect.replace(alternatives=listed)


def _family(result: GapFound) -> list[Candidate]:
    """Return the movements that are tried, simulated with the amended model."""
    data, model = result.dataset, result.result.lasting()
    trials = [t for t in data.trials if t.force_on_arm is not None]
    q = np.concatenate([t.q[t.valid] for t in trials])
    low, high = q.min(axis=0), q.max(axis=0)
    force = max(float(np.abs(t.force_on_arm[t.valid]).max()) for t in trials if t.force_on_arm is not None)
    fastest = max(float(np.abs(np.gradient(t.q, 1.0 / t.rate, axis=0))[t.valid].max()) for t in trials)
    fastest = max(FASTER * min(fastest, 10.0), SPEEDS[0])
    amplitude = np.minimum(0.5 * (high - low) + BEYOND, LARGEST)
    middle = 0.5 * (low + high)
    aside = low + np.where(np.arange(len(low)) % 2 == 0, 0.2, 0.8) * (high - low)
    names = [j.name for j in model.joints]
    family = []
    for where, centre in (("", middle), (" in a second posture", aside)):
        for pattern, words in _patterns(names):
            away = np.clip(centre + amplitude * pattern, low - BEYOND, high + BEYOND)
            back = np.clip(centre - amplitude * pattern, low - BEYOND, high + BEYOND)
            for speed in dict.fromkeys(min(s, fastest) for s in SPEEDS):
                movement = Movement(np.array([centre, away, back, centre]), speed=speed, acceleration=4.0 * speed, shape="smooth")
                made = _recorded(model, movement, trials[0].rate, STRONGER * force)
                if made is not None:
                    said = f"{words}{where}, {_ends(names, pattern, centre, away, back)}, at {speed:.2g} rad/s"
                    family.append(Candidate(movement, said, made))
    return family


def _patterns(names: Sequence[str]) -> list[tuple[np.ndarray, str]]:
    n = len(names)
    patterns = [(np.eye(n)[j], f"lead the {name} alone") for j, name in enumerate(names)]
    if n > 1:
        patterns.append((np.ones(n), "lead all joints the same way"))
        patterns.append((np.where(np.arange(n) % 2 == 0, 1.0, -1.0), "lead neighbouring joints against each other"))
    return patterns


def _ends(names: Sequence[str], pattern: np.ndarray, *points: np.ndarray) -> str:
    """Describe the angles of the joints."""
    moved = [j for j in range(len(names)) if pattern[j]]
    return "; ".join(f"{names[j]} {', '.join(f'{np.degrees(p[j]):.0f}°' for p in (*points, points[0]))}" for j in moved)


def _recorded(model: Model, movement: Movement, rate: float, force: float) -> Trial | None:
    """Return a movement as it would be recorded without noise; None where robot or arm cannot make it within the limits."""
    step = 1.0 / (rate * max(int(np.ceil(2000.0 / rate)), 1))
    try:
        run = simulate(model, movement, dt=step, rate=rate, sensors=Sensors(rate=rate), seeds=[0])
    except ArmrsError:
        return None
    read = run.readings[0]
    if read.force_on_arm is None or read.robot_q is None or np.abs(read.force_on_arm).max() > force:
        return None
    return Trial(
        file="planned",
        configuration="planned",
        repeat=1,
        role="fit",
        t=read.time,
        q=read.q,
        force_on_arm=read.force_on_arm,
        robot_q=read.robot_q,
    )
