"""Fast motion of an arm of two segments, computed from the robot's angles: encoders have less noise than cameras.

Slow motion is that of the cameras, as the handle may be displaced from the markers; what is faster than a cutoff is that of the robot:
`q + (1 − LP)(q_r − LP q)`, with q_r the angles at which the hand stands where the robot holds it, less the yield of the contact.
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


def with_robot_motion(trial: Trial, model: Model, cutoff: float) -> Trial | None:
    """Return a trial whose angles above a cutoff [Hz] are those of the robot; None where the robot does not determine them.

    It does for two segments, forces and angles that are measured without a gap, and an arm that is bent.
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
    beside = _inverse(model, slow, hand) - slow
    if not np.isfinite(beside).all():
        return None
    return dataclasses.replace(trial, q=slow + beside - _low_passed(beside, trial.rate, cutoff))


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
