"""A chain of hinges in space as a planar arm: any parallel horizontal axes, any direction of the segments at zero.

Offsets along the axes do not change how the chain moves, and are left out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...errors import BadInput, Text
from ...model import Joint, Model, Segment
from .joints import numbers

_UP = np.array([0.0, 0.0, 1.0])
_PARALLEL = 1e-4
"""Sine of the angle up to which axes are parallel: files write turns with four digits."""
_LEAST = 1e-9
"""Hinges closer than this are at one place [m]."""
_SEGMENT = 1e-3
"""A fixed frame closer to the last hinge than this is no hand [m]."""


@dataclass(frozen=True)
class Body:
    """Mass [kg], centre of mass [m] and inertia about it [kg m²], in the axes of the file where all joints are at zero."""

    mass: float
    com: np.ndarray
    inertia: np.ndarray


@dataclass
class Hinge:
    """A hinge and what turns with it; places are counted from the hinge, in the axes of the file where all joints are at zero."""

    name: str
    """Of the segment."""
    joint: Joint
    axis: np.ndarray
    place: np.ndarray
    """From the hinge before; of the first from the origin of the file."""
    bodies: list[Body] = field(default_factory=list)


@dataclass(frozen=True)
class Imported:
    """A model, remarks for its user, a line each, and what is added to the angles of the file [rad]."""

    model: Model
    notes: tuple[str, ...]
    zeros: tuple[float, ...]

    def without_stops(self, joints: Sequence[str]) -> Imported:
        """Return which joints of the file have a range: a chain of segments has no stops."""
        if not joints:
            return self
        note = f"{', '.join(joints)}: the range of motion is left out; effect end_range gives a joint stiffness at the ends of one"
        return replace(self, notes=(*self.notes, note))


def planar(hinges: Sequence[Hinge], tip: np.ndarray | None, gravity: float = 9.81) -> Imported:
    """Return a chain as an arm in the plane across its axes. Without a tip, the last segment ends at its centre of mass."""
    forward, normal = _plane(hinges)
    bodies = [_whole(hinge) for hinge in hinges]
    notes = []
    if tip is None or np.linalg.norm(tip) < _SEGMENT:
        tip = bodies[-1].com
        notes.append("nothing says where the last segment ends: it ends at its centre of mass; a fixed joint at the hand would say it")
    ends = [*(hinge.place for hinge in hinges[1:]), tip]
    at = np.array([[end @ forward, end @ _UP] for end in ends])
    lengths = [math.hypot(*end) for end in at]
    for hinge, length in zip(hinges, lengths, strict=True):
        if length < _LEAST:
            raise BadInput(f"<joint {hinge.joint.name!r}>", Text("the next joint at the same place"), "segments with a length in the plane")
    absolute = np.arctan2(at[:, 1], at[:, 0])
    zeros = [math.remainder(turn, 2.0 * math.pi) for turn in np.diff(absolute, prepend=0.0)]
    segments, joints = [], []
    for hinge, body, length, angle, zero in zip(hinges, bodies, lengths, absolute, zeros, strict=True):
        y, z = body.com @ forward, body.com @ _UP
        # Of a segment that ends at its centre of mass rounding may put that beyond.
        along, aside = y * math.cos(angle) + z * math.sin(angle), z * math.cos(angle) - y * math.sin(angle)
        along = length if math.isclose(along, length, rel_tol=1e-12) else along
        segments.append(Segment(hinge.name, length, body.mass, along, float(normal @ body.inertia @ normal), com_normal=aside))
        joints.append(hinge.joint.replace(rest=hinge.joint.rest + zero) if hinge.joint.stiffness else hinge.joint)
    first = hinges[0].place
    if abs(forward[1] - 1.0) > _PARALLEL:
        notes.append(f"forward is {numbers(*np.round(forward, 4) + 0.0)} of the file: the arm is seen against its first axis")
    for joint, zero in zip(joints, zeros, strict=True):
        if abs(zero) > _PARALLEL:
            notes.append(f"{joint.name}: its angle is that of the file {'+' if zero > 0.0 else '−'} {abs(math.degrees(zero)):.4g}°")
    model = Model(tuple(segments), tuple(joints), gravity=gravity, base=(float(first @ forward), float(first @ _UP)))
    return Imported(model, tuple(notes), tuple(zeros))


def _plane(hinges: Sequence[Hinge]) -> tuple[np.ndarray, np.ndarray]:
    """Return the directions forward and along the axes."""
    if not hinges:
        raise BadInput("joints", Text("none that turns"), "a chain of hinges")
    normal = hinges[0].axis
    if abs(normal @ _UP) > _PARALLEL:
        raise BadInput(
            f"<joint {hinges[0].joint.name!r}> axis", Text(numbers(*normal)), "a horizontal axis: the arm moves in a vertical plane"
        )
    for hinge in hinges:
        if np.linalg.norm(hinge.axis - normal) > _PARALLEL:
            allowed = (
                f"{numbers(*np.round(normal, 4) + 0.0)}, as of the first joint: the arm moves in one plane, and angles are counted one way"
            )
            raise BadInput(f"<joint {hinge.joint.name!r}> axis", Text(numbers(*np.round(hinge.axis, 4) + 0.0)), allowed)
    return np.cross(_UP, normal), normal


def _whole(hinge: Hinge) -> Body:
    """Return what turns with a hinge as one body."""
    heavy = [body for body in hinge.bodies if body.mass != 0.0]
    if not heavy:
        raise BadInput(f"<joint {hinge.joint.name!r}>", Text("no mass or inertia of what turns with it"), "an <inertial> with both")
    if len(heavy) == 1:
        return heavy[0]
    mass = sum(body.mass for body in heavy)
    com = sum((body.mass * body.com for body in heavy), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for body in heavy:
        d = body.com - com
        inertia += body.inertia + body.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return Body(mass, com, inertia)
