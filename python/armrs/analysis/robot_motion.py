"""Fast motion of an arm of two segments, computed from the robot's angles: encoders have less noise than cameras.

Slow motion is that of the cameras, as the handle may be displaced from the markers, and the zeros of the robot's angles may be wrong. What
is faster than a cutoff is that of the robot: angles at which the hand stands at `x(LP q) + (1 − LP)(x_r − x(LP q))`, with x the hand by the
angles of the arm, and x_r where the robot holds it, less the yield of the contact.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from .. import _armrs
from ..io.plausibility import hand_path, handle_path
from ..io.trial import Trial
from ..model import Model

_STEPS = 4
"""Steps of Newton from the measured angles to those of the robot: quadratic from some millimetres."""
_LEAST_SINE = 0.2
"""Of the angle between the segments, below which the hand hardly determines the elbow."""
_FASTEST_PART = 0.3
"""Fast motion beyond this is no part of a led movement [rad]: the path of the robot is of something else."""


def with_robot_motion(trial: Trial, model: Model, cutoff: float) -> Trial | None:
    """Return a trial whose angles above a cutoff [Hz] are those of the robot; None where the robot does not determine them.

    It does for two segments, forces and angles that are measured without a gap, an arm that is bent, and a path that the arm can follow.
    """
    robot, angles, force = model.robot, trial.robot_q, trial.force_on_arm
    if robot is None or angles is None or force is None or model.n_joints != 2 or trial.base is not None:
        return None
    if not (trial.valid.all() and np.isfinite(trial.q).all() and np.isfinite(angles).all() and np.isfinite(force).all()):
        return None
    slow = _low_passed(trial.q, trial.rate, cutoff)
    if float(np.abs(np.sin(slow[:, 1])).min()) < _LEAST_SINE:
        return None
    hand = handle_path(robot, angles)
    if model.contact is not None:
        hand = hand - force / np.array(model.contact.stiffness)
    measured = hand_path(model, slow)
    # Slow differences are those of another zero, base or length, which a path of the hand shows many times as large.
    beside = hand - measured
    fast = _inverse(model, slow, measured + beside - _low_passed(beside, trial.rate, cutoff)) - slow
    if not np.abs(fast).max() < _FASTEST_PART:
        return None
    return dataclasses.replace(trial, q=slow + fast - _low_passed(fast, trial.rate, cutoff))


def _low_passed(values: np.ndarray, rate: float, cutoff: float) -> np.ndarray:
    return np.asarray(_armrs.smooth(np.ascontiguousarray(values), rate, cutoff)[0])


def _inverse(model: Model, q: np.ndarray, hand: np.ndarray) -> np.ndarray:
    """Return the angles near `q` at which the hand is there (Newton)."""
    arm = _armrs.Arm.from_model(model)
    for _ in range(_STEPS):
        if not np.isfinite(q).all():
            break
        q = q + np.linalg.solve(arm.jacobian(q)[:, :2, :], (hand - hand_path(model, q))[:, :, None])[:, :, 0]
    return q
