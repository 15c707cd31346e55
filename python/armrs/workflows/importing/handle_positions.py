"""Joint angles of the robot from positions of the handle, by inverse kinematics."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...errors import BadInput, Text
from ...io.plausibility import hand_path
from ...model import Model, Robot

_LARGEST_DISTANCE = 0.05
"""Largest distance of hand and handle, relative to the arm's length: positions farther away have another origin."""

_HELD = 0.02
"""The same, up to which a robot is taken from the angles: slips, soft contact and tape measures leave millimetres."""
_STIFFNESS = 10_000.0
"""Of a contact that the model does not state, as everywhere [N/m]."""
_SLIPPED = 2.0
"""A trial that leaves so many times what the middle one does is not used."""
_RANK_TOLERANCE = 1e-3
"""Smallest singular value, relative to the largest, with which movements determine lengths and base of a robot."""


def origin(model: Model, trials: Sequence[tuple[np.ndarray, np.ndarray]]) -> tuple[float, float]:
    """Return where the origin of recorded positions lies, seen from that of the model [m]: (0, 0) where they meet the hand as they are.

    Parameters
    ----------
    model : Model
        Lengths and base of the arm.
    trials : sequence of (q, position)
        Joint angles in the convention of armrs (n, n_joints) [rad], and positions forward and upward (n, 2) [m].

    Raises
    ------
    BadInput
        When no origin makes the positions follow the hand.
    """
    reach = sum(s.length for s in model.segments)
    away = np.concatenate([hand_path(model, q) - position for q, position in trials])
    away = away[np.isfinite(away).all(axis=1)]
    if _rms(away) <= _LARGEST_DISTANCE * reach:
        return 0.0, 0.0
    middle = away.mean(axis=0)
    if _rms(away - middle) > _LARGEST_DISTANCE * reach:
        found = Text(f"positions of the handle that leave the hand by {_rms(away - middle):.2g} m, wherever their origin is")
        hint = "another axis or direction? --map Py=-COLUMN turns one; a model with other lengths?"
        raise BadInput("columns", found, f"at most {_LARGEST_DISTANCE * reach:.2g} m", hint=hint)
    return float(middle[0]), float(middle[1])


def robot_angles(robot: Robot, position: np.ndarray) -> np.ndarray:
    """Return the joint angles at which a robot has its handle at positions (n, 2) [m], as (n, 2) [rad]; NaN where there is no position.

    Raises
    ------
    BadInput
        For a position that the robot cannot reach.

    Examples
    --------
    >>> import armrs, numpy as np
    >>> from armrs.io.plausibility import handle_path
    >>> robot = armrs.Robot((0.45, 0.45), (1.05, -0.10))
    >>> q = np.array([[2.5, 1.2]])
    >>> bool(np.allclose(robot_angles(robot, handle_path(robot, q)), q))
    True
    """
    a, b = robot.lengths
    y, z = (position - np.asarray(robot.base)).T
    distance = np.hypot(y, z)
    beyond = np.nanmax(np.maximum(distance - (a + b), abs(a - b) - distance), initial=-np.inf)
    if beyond > 0.0:
        found = Text(f"the handle {beyond:.2g} m out of reach of the robot")
        raise BadInput("columns", found, f"{abs(a - b):g} to {a + b:g} m from its base", hint="base and lengths of [robot] in the model?")
    bend = 2.0 * np.arctan2(np.sqrt((a + b) ** 2 - distance**2), np.sqrt(distance**2 - (a - b) ** 2))
    # The elbow is above or below the line from the base to the handle; behind the base its direction is taken around π.
    ahead = np.where(y < 0.0, -1.0, 1.0)
    second = (-ahead if robot.elbow == "up" else ahead) * bend
    direction = np.where(y < 0.0, np.pi, 0.0) + ahead * np.arctan2(z, np.abs(y))
    first = direction - np.arctan2(b * np.sin(second), a + b * np.cos(second))
    return np.column_stack([first, second])


def robot_of(model: Model, trials: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray | None]]) -> tuple[Robot | None, float]:
    """Return the robot that holds the hand all the time, None where there is none, and how far hand and handle are then apart [m].

    Parameters
    ----------
    model : Model
        Lengths and base of the arm, and the contact.
    trials : sequence of (q, qr, force)
        Joint angles of the arm (n, n_joints) and of the robot (n, 2), in the conventions of armrs [rad], and the force on the arm (n, 2)
        [N], where it was measured: it holds the hand off the handle, by a millimetre where the contact is soft.

    Notes
    -----
    The handle is `base + a e(qr1) + b e(qr1 + qr2)`, with `e` the unit vector at an angle: linear in base and lengths, which follow by
    least squares. An error in the lengths of the arm goes into them, by about its own size.
    """
    stiffness = _STIFFNESS if model.contact is None else np.array(model.contact.stiffness)
    systems = []
    for q, qr, force in trials:
        rows = _handle_system(hand_path(model, q) + (0.0 if force is None else force / stiffness), qr)
        systems += [rows] if len(rows) else []
    if not systems:
        return None, float("inf")
    found, rank, apart = _solved(systems)
    steady = float(np.median(apart))
    # A sensor or the handle may have slipped in some of the trials.
    found, rank, apart = _solved([system for system, far in zip(systems, apart, strict=True) if far <= _SLIPPED * steady])
    left = float(np.sqrt(np.mean(apart**2)))
    y, z, a, b = (round(float(value), 4) for value in found)
    if rank < len(found) or left > _HELD * sum(s.length for s in model.segments) or min(a, b) <= 0.0:
        return None, left
    ahead = np.nanmean(np.concatenate([hand_path(model, q) for q, _, _ in trials])[:, 0]) > y
    bend = np.nanmean(np.concatenate([qr[:, 1] for _, qr, _ in trials]))
    return Robot((a, b), (y, z), "up" if (bend < 0.0) == ahead else "down"), left


def _handle_system(hand: np.ndarray, qr: np.ndarray) -> np.ndarray:
    """Return the rows of the equations of a trial: factors of both coordinates of the base and both lengths, and what they add up to."""
    first, both = qr[:, 0], qr.sum(axis=1)
    one, none = np.ones(len(hand)), np.zeros(len(hand))
    forward = np.column_stack([one, none, np.cos(first), np.cos(both), hand[:, 0]])
    upward = np.column_stack([none, one, np.sin(first), np.sin(both), hand[:, 1]])
    known = np.isfinite(forward).all(axis=1) & np.isfinite(upward).all(axis=1)
    return np.concatenate([forward[known], upward[known]])


def _solved(systems: Sequence[np.ndarray]) -> tuple[np.ndarray, int, np.ndarray]:
    """Return the least squares of all trials, the number of determined parameters, and the distance (RMS) left in each trial [m]."""
    rows = np.concatenate(systems)
    found, _, rank, _ = np.linalg.lstsq(rows[:, :-1], rows[:, -1], rcond=_RANK_TOLERANCE)
    left = [np.sqrt(2.0 * np.mean((s[:, :-1] @ found - s[:, -1]) ** 2)) for s in systems]
    return found, int(rank), np.array(left)


def _rms(distance: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(distance**2, axis=1)))) if len(distance) else 0.0
