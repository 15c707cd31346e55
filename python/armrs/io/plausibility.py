"""Data that no arm can produce: dead sensors, and angles that contradict those of the robot.

It is checked before any fit, so that a wrong column is named as such and not as a poor fit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from ..errors import BadInput, Text
from ..model import Model, Robot
from . import column_conventions
from .column_conventions import AlternativeConvention
from .dataset import Dataset
from .joint_positions import chain_points
from .trial import Trial, constant

_FAR = 0.3
"""Distance of hand and handle, relative to the arm, beyond which angles of arm and robot contradict each other."""
_SUSPECT = 0.02
"""The same, beyond which another reading of the columns is searched for: a mirrored wrist puts the hand that far off, a handle that slips
or a soft contact does not."""
_MET = 0.05
"""The same, up to which hand and handle meet: the angles of the arm are then taken as right."""
_MEETS = 0.2
"""Another reading explains the columns when it brings hand and handle this much nearer."""
_FOLLOWS = (0.002, 0.05)
"""The hand follows the handle where their distance changes by at most this [m], or this part of the handle's path."""
_AS_WELL = 1.5
"""A small error of an angle's zero is preferred to another convention that brings hand and handle at most this much nearer."""
OTHER_ZERO = 0.2
"""A smaller error of an angle's zero [rad] may be a poor calibration, which `angle_offset` of the catalogue names."""
_PLAINER = 0.005
"""A smaller error of zero is preferred while hand and handle are at most this much farther apart [m]: how well a handle is held."""


def refuse_implausible(dataset: Dataset) -> None:
    """Refuse a data set in which a sensor is dead, or angles of arm and robot cannot belong together.

    Raises
    ------
    BadInput
        Names the trial's file and the column.
    """
    for dead in dead_forces(dataset):
        raise dead
    if all(constant(angle) is not None for trial in dataset.trials for angle in trial.q.T):
        raise BadInput("angles", Text("none that changes in any trial"), "an arm that moves", hint="dead sensors?")
    if dataset.model.robot is not None:
        for trial in dataset.trials:
            if trial.robot_q is not None:
                _refuse_hand_off_handle(dataset.model, dataset.model.robot, trial)


def dead_forces(dataset: Dataset) -> Iterator[BadInput]:
    """Give the force channels that never change."""
    for trial in dataset.trials:
        if trial.force_on_arm is not None:
            for name, values in zip(("Fy", "Fz"), trial.force_on_arm.T, strict=True):
                level = constant(values)
                if level is not None:
                    found, allowed = Text(f"{level + 0.0:g} N in every sample"), "a force that changes with the movement"
                    yield BadInput(f"column {name}", found, allowed, file=trial.file, hint="a dead sensor?")


def _refuse_hand_off_handle(model: Model, robot: Robot, trial: Trial) -> None:
    """Compare where the measured angles put the hand with where the robot's put its handle."""
    assert trial.robot_q is not None
    good = np.isfinite(trial.q).all(axis=1) & np.isfinite(trial.robot_q).all(axis=1)
    if not good.any():
        return
    q, robot_q, base = trial.q[good], trial.robot_q[good], _displacement(model, trial)[good]
    reach = sum(s.length for s in model.segments)
    handle = handle_path(robot, robot_q) - base
    gap = hand_path(model, q) - handle
    own = _rms(gap)
    dead = _dead_angles(model, q, handle)
    if own > _SUSPECT * reach:
        explained = min(_MEETS * own, 0.1 * reach, _follows(handle) if dead else np.inf)
        best, reading = _other_reading(model, robot, q, robot_q, base)
        left, zero = (np.inf, None) if dead else _other_zero(model, q, handle)
        small = zero is None and left < _AS_WELL * best  # a poor calibration, not another convention
        if best >= explained or left < _MEETS * best or small:  # in one posture, another convention may come near
            best, reading = left, zero
        if reading is not None and best < explained:
            found = Text(f"angles that put the hand {own:.3g} m from the robot's handle")
            raise BadInput(reading.place, found, reading.allowed, file=trial.file)
    if dead:
        place = f"column{'s' * (len(dead) > 1)} {', '.join(f'q{j + 1}' for j in dead)}"
        levels = ", ".join(f"{q[0, j] + 0.0:g}" for j in dead)
        found = Text(f"{levels} rad in every sample, while the robot's handle moves as it could not then")
        raise BadInput(place, found, "an angle that changes with the movement", file=trial.file, hint="a dead sensor?")
    if own >= _FAR * reach:
        found = Text(f"the hand {own:.3g} m from the robot's handle")
        allowed = "angles of arm and robot that meet: lengths, bases, elbow and units of the model?"
        raise BadInput("q1 …, qr1, qr2", found, allowed, file=trial.file)


def _follows(handle: np.ndarray) -> float:
    """Return by how much a hand may depart from the path of the handle that it follows, but for a constant distance [m]."""
    return max(_FOLLOWS[0], _FOLLOWS[1] * _rms(handle - handle.mean(axis=0)))


def _dead_angles(model: Model, q: np.ndarray, handle: np.ndarray) -> list[int]:
    """Return the joints, from 0, whose angles never change though the hand follows the handle with no constant angles of these joints.

    A joint that is held contradicts no path, wherever the zero of its angle is.
    """
    still = [j for j, angle in enumerate(q.T) if constant(angle) is not None]
    thin = slice(None, None, max(1, len(q) // 100))
    angles = q.copy()

    def departs(tried: np.ndarray) -> float:
        gap = hand_path(model, tried) - handle[thin]
        return _rms(gap - gap.mean(axis=0))

    for j in still:
        angles[:, j] += _best_zero(angles[thin], j, departs)[1]
    return still if still and departs(angles[thin]) > _follows(handle) else []


def _best_zero(q: np.ndarray, joint: int, apart: Callable[[np.ndarray], float]) -> tuple[float, float]:
    """Return how far apart hand and handle are with the best zero of one joint, from 0, and what is added to its angle then [rad]."""
    best, turned = 0.0, np.eye(q.shape[1])[joint]
    for width in (np.pi, np.radians(2.0)):
        tried = best + np.linspace(-width, width, 181)
        sizes = [apart(q + offset * turned) for offset in tried]
        best = float(tried[int(np.argmin(sizes))])
    return min(sizes), best


def _other_reading(
    model: Model, robot: Robot, q: np.ndarray, robot_q: np.ndarray, base: np.ndarray
) -> tuple[float, AlternativeConvention | None]:
    """Return what the angles of arm or robot may be instead, and how far apart hand and handle are then [m]."""
    handle = handle_path(robot, robot_q) - base
    found: list[tuple[float, AlternativeConvention | None]] = [
        (_rms(hand_path(model, reading.angles(q)) - handle), reading)
        for reading in (*column_conventions.of_angles(q.shape[1]), *column_conventions.of_unit_of_one(q))
    ]
    tip = hand_path(model, q) + base
    found += [(_rms(tip - handle_path(robot, reading.angles(robot_q))), reading) for reading in column_conventions.of_robot_angles()]
    return min(found, key=lambda item: item[0])


def _other_zero(model: Model, q: np.ndarray, handle: np.ndarray) -> tuple[float, AlternativeConvention | None]:
    """Return another zero of one joint's angle, and how far apart hand and handle are with it [m]; None where it is a small error."""
    thin = slice(None, None, max(1, len(q) // 100))
    found = [(_best_zero(q[thin], j, lambda tried: _rms(hand_path(model, tried) - handle[thin])), j + 1) for j in range(q.shape[1])]
    nearest = min(found)[0][0]
    (best, off), joint = min((f for f in found if f[0][0] <= nearest + _PLAINER), key=lambda f: abs(f[0][1]))
    return best, column_conventions.other_zero(q.shape[1], joint, off) if abs(off) >= OTHER_ZERO else None


def hand_meets_handle(dataset: Dataset) -> bool:
    """Whether the measured angles put the hand where the robot's put its handle, within 5 % of the arm's length, in every trial."""
    model = dataset.model
    if model.robot is None or any(trial.robot_q is None for trial in dataset.trials):
        return False
    reach = sum(s.length for s in model.segments)
    return all(_rms(gap) <= _MET * reach for gap in _gaps(dataset))


def mean_gap(dataset: Dataset) -> np.ndarray | None:
    """Return how far the hand by the angles of the arm is from the handle by those of the robot on average, (2,) [m], if both are known."""
    gaps = list(_gaps(dataset))
    return np.concatenate(gaps).mean(axis=0) if gaps else None


def _gaps(dataset: Dataset) -> Iterator[np.ndarray]:
    """Give how far the hand is from the handle in each trial whose robot angles are known, (n, 2) [m]."""
    model, robot = dataset.model, dataset.model.robot
    for trial in dataset.trials:
        if robot is not None and trial.robot_q is not None and len(gap := hand_off_handle(model, robot, trial)):
            yield gap


def hand_off_handle(model: Model, robot: Robot, trial: Trial) -> np.ndarray:
    """Return how far the hand is from the handle in a trial with robot angles, where all angles are known, (n, 2) [m]."""
    assert trial.robot_q is not None
    good = np.isfinite(trial.q).all(axis=1) & np.isfinite(trial.robot_q).all(axis=1)
    return hand_path(model, trial.q[good]) + _displacement(model, trial)[good] - handle_path(robot, trial.robot_q[good])


def _displacement(model: Model, trial: Trial) -> np.ndarray:
    """Return how far the first joint is from where the model has it, (n, 2) [m]."""
    return np.zeros((len(trial.q), 2)) if trial.base is None else trial.base - np.array(model.base)


def handle_path(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return where a robot with angles q, (n, 2) [rad], the second relative to the first, has its handle, (n, 2) [m]."""
    return chain_points(robot.base, robot.lengths, q)[:, -1]


def hand_path(model: Model, q: np.ndarray) -> np.ndarray:
    """Return where an arm with angles q, (n, n_joints) [rad], has its hand, (n, 2) [m]."""
    return chain_points(model.base, [s.length for s in model.segments], q)[:, -1]


def _rms(distance: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(distance**2, axis=1))))
