"""Alternative meanings of recorded columns: other angle conventions, units, signs and orders, as transformations."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import permutations

import numpy as np

_MOST_SWAPPED = 4
"""Joints up to which orders of columns are tried."""
_DEGREE = float(np.radians(1.0))
_SAME = 1e-3
"""Angles that differ by no more are read alike [rad]."""
TOO_SMALL, TOO_LARGE = "kN labelled as N, or N as mN?", "mN labelled as N, or N as kN?"
"""What makes forces a thousand times too small, or too large."""
_BESIDE = 30.0
"""A component of the force is read in another unit where it is so many times the other one, or so many times less."""


@dataclass(frozen=True, eq=False)
class AlternativeConvention:
    """One way to read angles and forces.

    Attributes
    ----------
    place, allowed : str
        Where it differs from the definition of the model, and that definition, as in a refusal.
    turn : ndarray, shape (n_joints, n_joints)
    shift : ndarray, shape (n_joints,)
        The angles of the model are `turn` @ q + `shift` [rad].
    force : ndarray, shape (2, 2)
        The force meant is `force` @ F.
    """

    place: str
    allowed: str
    turn: np.ndarray
    shift: np.ndarray
    force: np.ndarray = field(default_factory=lambda: np.eye(2))

    def angles(self, q: np.ndarray) -> np.ndarray:
        """Return the angles of the model, (n_samples, n_joints) [rad]."""
        return q @ self.turn.T + self.shift

    def differs(self, q: np.ndarray) -> bool:
        """Whether it reads these angles, (n_samples, n_joints) [rad], or forces otherwise; an angle that is always 0 has no side."""
        return not np.array_equal(self.force, np.eye(2)) or bool(np.abs(self.angles(q) - q).max() > _SAME)


def of_angles(n: int) -> Iterator[AlternativeConvention]:
    """Give angles in the other unit, of other conventions and in another order."""
    every, none, quarter = np.eye(n), np.zeros(n), np.zeros(n)
    quarter[0] = np.pi / 2
    yield from _other_unit("columns q1 …", n)
    relative = every - np.eye(n, k=-1)
    for angles, kind in ((every, ""), (relative, "absolute angles, "))[: min(n, 2)]:
        if kind:
            yield AlternativeConvention("columns q1 …", "angles relative to the segment before (absolute angles?)", angles, none)
        yield AlternativeConvention("columns q1 …", f"angles counter-clockwise ({kind}mirrored?)", -angles, none)
        yield AlternativeConvention("columns q1 …", f"y forward ({kind}seen from the other side?)", -angles, 2 * quarter)
        for sign, turned in ((1.0, ""), (-1.0, ", mirrored")):
            yield AlternativeConvention("column q1", f"q1 from +y ({kind}from the vertical downwards{turned}?)", sign * angles, -quarter)
            yield AlternativeConvention("column q1", f"q1 from +y ({kind}from the vertical upwards{turned}?)", sign * angles, quarter)
    for j in range(n) if n > 1 else ():
        yield from _of_one_joint(n, j)
    for order in permutations(range(n)) if n <= _MOST_SWAPPED else ():
        if order != tuple(range(n)):
            yield AlternativeConvention(
                "columns q1 …", "q1 of the first joint, the others outwards (swapped columns?)", every[list(order)], none
            )


def _of_one_joint(n: int, joint: int) -> Iterator[AlternativeConvention]:
    """Give the angle of one joint, from 0, turning the other way, and as a goniometer reads it, pi where the arm is straight."""
    turn, shift = np.eye(n), np.zeros(n)
    turn[joint, joint] = -1.0
    name = f"q{joint + 1}"
    yield AlternativeConvention(f"column {name}", f"{name} counter-clockwise like the others (this one mirrored?)", turn, shift)
    if joint > 0:
        between = f"{name} from the line of the segment before (the angle between both segments?)"
        yield AlternativeConvention(f"column {name}", between, turn, np.pi * np.eye(n)[joint])


def of_unit_of_one(q: np.ndarray) -> Iterator[AlternativeConvention]:
    """Give the angle of one joint of several in the other unit, where it exceeds a turn or hardly turns; `q` of shape (n, n_joints)."""
    n = q.shape[1]
    for j in range(n) if n > 1 else ():
        if not np.radians(3.6) < np.nanmax(np.abs(q[:, j])) < 2.0 * np.pi:
            yield from _other_unit(f"column q{j + 1}", n, j)


def of_robot_angles() -> Iterator[AlternativeConvention]:
    """Give the robot's angles in the other unit and in the other order."""
    yield from _other_unit("columns qr1, qr2", 2)
    swapped = "qr1 of the robot's first joint, qr2 of its second (swapped columns?)"
    yield AlternativeConvention("columns qr1, qr2", swapped, np.eye(2)[::-1], np.zeros(2))


def _other_unit(place: str, n: int, joint: int | None = None) -> Iterator[AlternativeConvention]:
    """Give the angles of all joints, or of one, from 0, in the other unit."""
    for factor, unit in ((_DEGREE, "degrees labelled as radians"), (1.0 / _DEGREE, "radians labelled as degrees")):
        factors = np.where([joint in (None, j) for j in range(n)], factor, 1.0)
        yield AlternativeConvention(place, f"angles in the unit of their column ({unit}?)", np.diag(factors), np.zeros(n))


def of_forces(n: int) -> Iterator[AlternativeConvention]:
    """Give forces in another unit, order or direction."""
    for place, allowed, force in (
        ("columns Fy, Fz", "Fy along the horizontal, Fz up (swapped columns?)", [[0.0, 1.0], [1.0, 0.0]]),
        ("columns Fy, Fz", f"forces in the unit of their column ({TOO_SMALL})", [[1e3, 0.0], [0.0, 1e3]]),
        ("columns Fy, Fz", f"forces in the unit of their column ({TOO_LARGE})", [[1e-3, 0.0], [0.0, 1e-3]]),
        ("force_on", '"arm" or "robot", whichever the force acts on (the other one?)', [[-1.0, 0.0], [0.0, -1.0]]),
        ("column Fy", "Fy along the horizontal, forward (a reversed axis?)", [[-1.0, 0.0], [0.0, 1.0]]),
        ("column Fz", "Fz up (a reversed axis?)", [[1.0, 0.0], [0.0, -1.0]]),
        ("columns Fy, Fz", "Fy along the horizontal, Fz up (axes turned by 90°?)", [[0.0, -1.0], [1.0, 0.0]]),
        ("columns Fy, Fz", "Fy along the horizontal, Fz up (axes turned by -90°?)", [[0.0, 1.0], [-1.0, 0.0]]),
    ):
        yield AlternativeConvention(place, allowed, np.eye(n), np.zeros(n), np.array(force))


def of_unit_of_one_force(force: np.ndarray, n: int) -> Iterator[AlternativeConvention]:
    """Give one component of forces, (n_samples, 2), in another unit, where it is very large or small beside the other; `n` joints."""
    less, more = np.argsort(sizes := np.sqrt(np.mean(force**2, axis=0)))
    if sizes[more] <= _BESIDE * sizes[less]:
        return
    # A component that is zero is so in every unit.
    for axis, factor, mistake in ((more, 1e-3, TOO_LARGE), (less, 1e3, TOO_SMALL))[: np.count_nonzero(sizes)]:
        name, scales = ("Fy", "Fz")[axis], np.ones(2)
        scales[axis] = factor
        yield AlternativeConvention(
            f"column {name}", f"{name} in the unit of its column ({mistake})", np.eye(n), np.zeros(n), np.diag(scales)
        )


def other_zero(n: int, joint: int, offset: float, *, still: bool = False) -> AlternativeConvention:
    """Return the angles with that of a joint, from 1, turned by `offset` [rad]; with `still` it never changes."""
    shift = np.zeros(n)
    shift[joint - 1] = offset
    size = f"{abs(offset):.2g} rad too {'large' if offset < 0.0 else 'small'}"
    if still:
        allowed = f"an angle that changes with the joint (a dead sensor? if the joint is held, q{joint} is {size})"
        return AlternativeConvention(f"column q{joint}", allowed, np.eye(n), shift)
    turned = ", or the axes of the force are turned by as much" if joint == 1 else ""
    return AlternativeConvention(
        f"column q{joint}", f"angles with the model's zero (another zero: q{joint} is {size}{turned}?)", np.eye(n), shift
    )
