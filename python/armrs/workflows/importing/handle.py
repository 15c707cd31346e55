"""Positions of the handle that a robot's controller recorded, as joint angles of the robot of the model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...errors import BadInput, Text
from ...io.plausibility import hand_path
from ...model import Model, Robot

_APART = 0.05
"""Largest distance of hand and handle, relative to the arm's length: positions farther away have another origin."""


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
    if _rms(away) <= _APART * reach:
        return 0.0, 0.0
    middle = away.mean(axis=0)
    if _rms(away - middle) > _APART * reach:
        found = Text(f"positions of the handle that leave the hand by {_rms(away - middle):.2g} m, wherever their origin is")
        hint = "another axis or direction? --map Py=-COLUMN turns one; a model with other lengths?"
        raise BadInput("columns", found, f"at most {_APART * reach:.2g} m", hint=hint)
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
    >>> robot = armrs.Robot((0.45, 0.45), (1.05, -0.10))
    >>> q = np.array([[2.5, -1.2]])
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


def _rms(distance: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(distance**2, axis=1)))) if len(distance) else 0.0
