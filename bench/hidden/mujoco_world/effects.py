"""What can be hidden, and how large it is."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from engine import Burst, Cord, Law, Maxwell, Reflex, Rig, Tremor
from sizes import SIZES
from subject import Random, Subject, Trial, within


@dataclass
class Hidden:
    """An effect: how it changes the rig, what it does, and what is true of it."""

    kind: str
    parameters: dict[str, tuple[float, bool]]
    joint: int | None = None
    channel: int | None = None
    trial: int | None = None
    alter: Callable[[Rig], Rig] = lambda rig: rig
    motor: Callable[[Random], Callable[[float, np.ndarray, np.ndarray], float]] | None = None
    friction: Callable[[np.ndarray], np.ndarray] | None = None
    sense: Callable[[np.ndarray, np.ndarray, np.ndarray], None] | None = None
    """Changes angles and forces on the arm in place, of the time."""
    late: float = 0.0


# ---- what is hidden

FAMILY = {
    **dict.fromkeys(("viscous", "coulomb", "stribeck", "quadratic_drag"), "dissipation"),
    **dict.fromkeys(("elastic", "cubic_elastic", "relaxation", "constant_moment", "biarticular"), "elasticity"),
    **dict.fromkeys(("stretch_reflex", "tremor", "voluntary"), "muscle"),
    **dict.fromkeys(("motor_inertia", "added_mass"), "segment"),
    **dict.fromkeys(("gravity_tilt", "shoulder_heave"), "frame"),
    **dict.fromkeys(("force_bias", "force_drift", "force_gain", "force_misalignment"), "force"),
}
OUTSIDE = ("slack_tendon", "tendon_friction")
FURTHER = ("stretch_reflex", "contact_compliance", "gravity_tilt", "shoulder_heave", "force_bias", "tremor", "biarticular",
           "quadratic_drag", "relaxation", "voluntary", "force_misalignment", "time_delay")  # fmt: skip
"""Kinds beside the laws of little-known joints: none that a rest angle or a segment within its uncertainty could stand for."""


def in_joint(rig: Rig, j: int, **more: float) -> Rig:
    """Add to the laws of a joint."""
    own = rig.joints[j]
    changed = replace(own, **{name: getattr(own, name) + value for name, value in more.items()})
    return replace(rig, joints=(*rig.joints[:j], changed, *rig.joints[j + 1 :]))


def with_spring(rig: Rig, j: int, stiffness: float, rest: float) -> Rig:
    """Add a spring: two in one joint are one."""
    own = rig.joints[j]
    total = own.stiffness + stiffness
    changed = replace(own, stiffness=total, rest=(own.stiffness * own.rest + stiffness * rest) / total)
    return replace(rig, joints=(*rig.joints[:j], changed, *rig.joints[j + 1 :]))


def hide(kind: str, strength: str, who: Subject, fitted: list[tuple[int, Trial]], random: Random) -> Hidden:
    """Draw an effect of a kind."""
    n = len(who.posture)
    j = int(random.integers(1, n)) if kind == "biarticular" else int(random.integers(n))
    ranges = SIZES[kind][strength == "medium"]
    size = within(random, *ranges[min(j, len(ranges) - 1)])
    signed = size * float(random.choice([-1.0, 1.0]))
    at = float(who.posture[j]) + math.radians(within(random, -10.0, 25.0))
    rigged = _of_rig(kind, j, size, signed, at, who, random)
    return rigged or _of_muscle(kind, j, size, signed, fitted, random) or _of_sensor(kind, j, size, signed, random)


def _of_rig(kind: str, j: int, size: float, signed: float, at: float, who: Subject, random: Random) -> Hidden | None:
    match kind:
        case "viscous":
            return Hidden(kind, {"viscosity": (size, True)}, j, alter=lambda r: in_joint(r, j, viscosity=size))
        case "coulomb":
            return Hidden(kind, {"torque": (size, True)}, j, alter=lambda r: in_joint(r, j, friction=size))
        case "elastic":
            return Hidden(kind, {"stiffness": (size, True), "rest": (at, False)}, j, alter=lambda r: with_spring(r, j, size, at))
        case "motor_inertia":
            return Hidden(kind, {"inertia": (size, True)}, j, alter=lambda r: in_joint(r, j, rotor=size))
        case "biarticular":
            ratio = within(random, 0.7, 1.3)
            rest = float(who.posture[j] + ratio * who.posture[j - 1]) + within(random, -0.2, 0.2)
            parameters = {"stiffness": (size, True), "ratio": (ratio, True), "rest": (rest, False)}
            return Hidden(kind, parameters, j, alter=lambda r: replace(r, cords=(*r.cords, Cord(j, size, ratio, rest))))
        case "added_mass":
            return Hidden(kind, {"mass": (size, True)}, alter=lambda r: replace(r, hand_mass=size))
        case "gravity_tilt":
            down = (9.81 * math.sin(signed), -9.81 * math.cos(signed))
            return Hidden(kind, {"angle": (signed, True)}, alter=lambda r: replace(r, gravity=down))
        case "shoulder_heave":
            y, hertz, phase = size * within(random, -0.5, 0.5), within(random, 0.15, 0.4), within(random, -1.5, 1.5)
            parameters = {"y": (y, True), "z": (size, True), "frequency": (hertz, True), "phase": (phase, True)}
            return Hidden(kind, parameters, alter=lambda r: replace(r, heave=(y, size, hertz, phase)))
        case "contact_compliance":
            soft = ((size, size), (size, 0.0), (0.0, size))[int(random.integers(3))]

            def softer(r: Rig) -> Rig:
                y, z = (1.0 / (1.0 / k + more) for k, more in zip(r.stiffness, soft, strict=True))
                return replace(r, stiffness=(y, z))

            return Hidden(kind, {"y": (soft[0], True), "z": (soft[1], True)}, alter=softer)
    return None


def _of_muscle(kind: str, j: int, size: float, signed: float, fitted: list[tuple[int, Trial]], random: Random) -> Hidden | None:
    match kind:
        case "stribeck":
            half = within(random, 0.05, 0.12)

            def dry(v: np.ndarray) -> np.ndarray:
                torque = np.zeros(len(v))
                torque[j] = size * math.exp(-((v[j] / half) ** 2))
                return torque

            return Hidden(kind, {"torque": (size, False), "speed": (half, False)}, j, friction=dry)
        case "quadratic_drag":
            return Hidden(kind, {"drag": (size, True)}, j, motor=lambda _: Law(j, lambda q, v: -size * v * abs(v)))
        case "cubic_elastic":
            rest = within(random, -0.9, -0.7) if j == 0 else within(random, 0.9, 1.2) if j == 1 else within(random, -0.1, 0.2)
            parameters = {"stiffness": (size, True), "rest": (rest, False)}
            return Hidden(kind, parameters, j, motor=lambda _: Law(j, lambda q, v: -size * (q - rest) ** 3))
        case "relaxation":
            time = within(random, 0.5, 2.0)
            return Hidden(kind, {"stiffness": (size, True), "time": (time, True)}, j, motor=lambda _: Maxwell(j, size, time))
        case "constant_moment":
            return Hidden(kind, {"moment": (signed, True)}, j, motor=lambda _: Law(j, lambda q, v: -signed))
        case "stretch_reflex":
            threshold, late = within(random, 0.15, 0.35), within(random, 0.03, 0.05)
            direction = math.copysign(1.0, signed)
            parameters = {"gain": (size, False), "threshold": (threshold, False), "direction": (direction, False), "latency": (late, False)}
            return Hidden(kind, parameters, j, motor=lambda _: Reflex(j, size, threshold, direction, late))
        case "tremor":
            hertz = within(random, 4.0, 8.0)
            parameters = {"amplitude": (size, False), "frequency": (hertz, True)}
            same, in_phase = within(random, 0.0, 6.28), bool(random.uniform() < 1 / 3)

            def tremble(r: Random) -> Tremor:
                own, swell = within(r, 0.0, 6.28), within(r, 0.0, 6.28)
                return Tremor(j, size, hertz, (same if in_phase else own, swell))

            return Hidden(kind, parameters, j, motor=tremble)
        case "voluntary":
            number, trial = fitted[int(random.integers(len(fitted)))]
            width = within(random, 0.4, 0.9)
            start = within(random, 0.8, trial.duration - 0.8 - width)
            parameters = {"amplitude": (signed, False), "start": (start, False), "duration": (width, False)}
            return Hidden(kind, parameters, j, trial=number, motor=lambda _: Burst(j, signed, start, width))
    return None


def _of_sensor(kind: str, j: int, size: float, signed: float, random: Random) -> Hidden:
    c = 1 if kind == "force_gain" else int(random.integers(2))
    match kind:
        case "force_bias":
            return Hidden(kind, {"bias": (signed, True)}, channel=c, sense=lambda t, q, f: np.add(f[:, c], signed, out=f[:, c]))
        case "force_drift":
            return Hidden(kind, {"rate": (signed, True)}, channel=c, sense=lambda t, q, f: np.add(f[:, c], signed * t, out=f[:, c]))
        case "force_gain":
            return Hidden(kind, {"gain": (signed, True)}, channel=c, sense=lambda t, q, f: np.multiply(f[:, c], 1 + signed, out=f[:, c]))
        case "force_misalignment":
            turn = np.array([[math.cos(signed), -math.sin(signed)], [math.sin(signed), math.cos(signed)]])
            return Hidden(kind, {"angle": (signed, True)}, sense=lambda t, q, f: np.copyto(f, f @ turn.T))
        case "angle_offset":
            return Hidden(kind, {"offset": (signed, True)}, j, sense=lambda t, q, f: np.add(q[:, j], signed, out=q[:, j]))
        case "time_delay":
            return Hidden(kind, {"delay": (size, True)}, late=size)
    raise ValueError(f"--kind: found {kind}; allowed: {', '.join(SIZES)}")


def outside(kind: str, who: Subject, random: Random) -> Hidden:
    """Draw an effect that no catalogue has: a cord over two joints that is slack for a while, or that rubs."""
    j, ratio = int(random.integers(1, len(who.posture))), within(random, 0.7, 1.3)
    rest = float(who.posture[j] + ratio * who.posture[j - 1]) + 0.25
    if kind == "slack_tendon":
        cord = Cord(j, within(random, 4.0, 7.0), ratio, rest, slack=within(random, 0.15, 0.25))
    else:
        cord = Cord(j, 0.0, ratio, rest, friction=within(random, 0.15, 0.3))
    return Hidden(kind, {}, j, alter=lambda r: replace(r, cords=(*r.cords, cord)))


def laws(who: Subject, friction: Sequence[float]) -> list[Hidden]:
    """Return what little-known joints have, as the effects that the model lacks; the rig has them already."""
    found = []
    for j, own in enumerate(who.truth.joints):
        found.append(Hidden("elastic", {"stiffness": (own.stiffness, True), "rest": (own.rest, True)}, j))
        found.append(Hidden("viscous", {"viscosity": (own.viscosity, True)}, j))
        if friction[j]:
            found.append(Hidden("coulomb", {"torque": (friction[j], True)}, j))
    return found


def several(names: Sequence[str], count: int, strength: str, who: Subject, fitted: list[tuple[int, Trial]], random: Random) -> list[Hidden]:
    """Draw effects of different families."""
    chosen: list[str] = []
    for name in random.permutation(list(names)):
        if len(chosen) < count and FAMILY.get(name, name) not in [FAMILY.get(c, c) for c in chosen]:
            chosen.append(str(name))
    return [hide(name, strength, who, fitted, random) for name in chosen]
