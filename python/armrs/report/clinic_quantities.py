"""What a clinician reads of a joint: quantities in the units of the bedside."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Quantity:
    """A parameter of a joint as a clinician reads it."""

    kind: str
    parameter: str
    title: str
    meaning: str
    unit: str
    factor: float
    si: str


QUANTITIES = (
    Quantity(
        "elastic",
        "stiffness",
        "Stiffness",
        "how strongly the joint pulls back for every 10° away from its resting angle",
        "N m per 10°",
        math.pi / 18.0,
        "N m/rad",
    ),
    Quantity(
        "elastic", "rest", "Resting angle", "angle to which the relaxed joint returns by itself, gravity aside", "°", 180.0 / math.pi, "rad"
    ),
    Quantity("viscous", "viscosity", "Resistance to speed", "what turning at 90° per second adds", "N m", math.pi / 2.0, "N m s/rad"),
    Quantity("coulomb", "torque", "Friction", "resistance to any movement, however slow", "N m", 1.0, "N m"),
    Quantity(
        "stretch_reflex",
        "gain",
        "Reflex strength",
        "what every 90° per second of stretch beyond the reflex onset adds",
        "N m",
        math.pi / 2.0,
        "N m s/rad",
    ),
    Quantity(
        "stretch_reflex", "threshold", "Reflex onset", "speed of stretch above which the muscle resists", "°/s", 180.0 / math.pi, "rad/s"
    ),
    Quantity("stretch_reflex", "tonic", "Reflex angle", "angle beyond which the onset is lowest", "°", 180.0 / math.pi, "rad"),
    Quantity("stretch_reflex", "latency", "Reflex delay", "time from stretch to resistance", "ms", 1000.0, "s"),
)
HALF_WIDTH = Quantity(
    "passive",
    "half_width",
    "Resistance to slow movement",
    "half of the difference between both directions of movement; it contains friction and resistance to speed",
    "N m",
    1.0,
    "N m",
)
SLOW = (
    HALF_WIDTH,
    Quantity(
        "passive",
        "stiffness",
        "Stiffness in slow movement",
        "how much more the joint pulls back for every 10° further; errors in the assumed weight of the arm can make it negative",
        "N m per 10°",
        math.pi / 18.0,
        "N m/rad",
    ),
    Quantity(
        "passive",
        "range",
        "Range moved through",
        "how far the joint was moved in one movement; this is no test of how far it can go",
        "°",
        180.0 / math.pi,
        "rad",
    ),
)
"""Results of slow movements for a joint."""
Key = tuple[str, str, int]
"""Kind, parameter and joint of a quantity."""
AS_ARMRS = (1.0, 0.0)
"""How an angle is counted: sign, and the angle of armrs that is called zero [deg]."""
ANGLES = ("rest", "tonic")
"""Parameters that are angles."""
