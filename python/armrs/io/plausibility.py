"""What a data set cannot be, whatever the arm is: sensors that say nothing, and angles that contradict those of the robot.

It is asked before any physics, so that a wrong column is named as such and not as a poor fit.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..errors import BadInput, Text
from ..model import Model, Robot
from . import readings
from .chain import chain_points
from .dataset import Dataset
from .readings import Reading
from .trial import Trial, constant

_FAR = 0.3
"""Distance of hand and handle, relative to the arm, beyond which angles of arm and robot contradict each other."""
_SUSPECT = 0.02
"""The same, beyond which another reading of the columns is looked for: a mirrored wrist puts the hand that far off, a handle that slips
or a soft contact does not."""
_MET = 0.05
"""The same, up to which hand and handle meet: the angles of the arm are then taken as right."""
_MEETS = 0.2
"""Another reading explains the columns when it brings hand and handle this much nearer."""
_HELD = (0.002, 0.05)
"""An angle that never changes contradicts a handle that moves against the hand by more than this [m], and by this part of its path."""
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
                _refuse_apart(dataset.model, dataset.model.robot, trial)


def dead_forces(dataset: Dataset) -> Iterator[BadInput]:
    """Give the force channels that never change."""
    for trial in dataset.trials:
        if trial.force_on_arm is not None:
            for name, values in zip(("Fy", "Fz"), trial.force_on_arm.T, strict=True):
                level = constant(values)
                if level is not None:
                    found, allowed = Text(f"{level + 0.0:g} N in every sample"), "a force that changes with the movement"
                    yield BadInput(f"column {name}", found, allowed, file=trial.file, hint="a dead sensor?")


def _refuse_apart(model: Model, robot: Robot, trial: Trial) -> None:
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
    if own > _SUSPECT * reach:
        best, reading = _other_reading(model, robot, q, robot_q, base)
        if best >= min(_MEETS * own, 0.1 * reach):
            best, reading = _other_zero(model, q, handle)
        if reading is not None and best < min(_MEETS * own, 0.1 * reach):
            found = Text(f"angles that put the hand {own:.3g} m from the robot's handle")
            raise BadInput(reading.place, found, reading.allowed, file=trial.file)
    path = _rms(handle - handle.mean(axis=0))
    for j, angle in enumerate(q.T, start=1):
        level = constant(angle)
        if level is not None and _rms(gap - gap.mean(axis=0)) > max(_HELD[0], _HELD[1] * path):
            found = Text(f"{level:g} rad in every sample, while the robot's handle moves as it could not then")
            raise BadInput(f"column q{j}", found, "an angle that changes with the movement", file=trial.file, hint="a dead sensor?")
    if own >= _FAR * reach:
        found = Text(f"the hand {own:.3g} m from the robot's handle")
        allowed = "angles of arm and robot that meet: lengths, bases, elbow and units of the model?"
        raise BadInput("q1 …, qr1, qr2", found, allowed, file=trial.file)


def _other_reading(model: Model, robot: Robot, q: np.ndarray, robot_q: np.ndarray, base: np.ndarray) -> tuple[float, Reading | None]:
    """Return what the angles of arm or robot may be instead, and how far apart hand and handle are then [m]."""
    handle = handle_path(robot, robot_q) - base
    found: list[tuple[float, Reading | None]] = [
        (_rms(hand_path(model, reading.angles(q)) - handle), reading)
        for reading in (*readings.of_angles(q.shape[1]), *readings.of_unit_of_one(q))
    ]
    tip = hand_path(model, q) + base
    found += [(_rms(tip - handle_path(robot, reading.angles(robot_q))), reading) for reading in readings.of_robot_angles()]
    return min(found, key=lambda item: item[0])


def _other_zero(model: Model, q: np.ndarray, handle: np.ndarray) -> tuple[float, Reading | None]:
    """Return another zero of one joint's angle, and how far apart hand and handle are with it [m]; None where it is a small error."""
    n = q.shape[1]
    thin = slice(None, None, max(1, len(q) // 100))
    found = []
    for j in range(n):
        offset = np.zeros(n)
        for width in (np.pi, np.radians(2.0)):
            tried = offset[j] + np.linspace(-width, width, 181)
            sizes = []
            for value in tried:
                offset[j] = value
                sizes.append(_rms(hand_path(model, q[thin] + offset) - handle[thin]))
            offset[j] = tried[int(np.argmin(sizes))]
        found.append((min(sizes), j + 1, float(offset[j])))
    nearest = min(found)[0]
    best, joint, off = min((f for f in found if f[0] <= nearest + _PLAINER), key=lambda f: abs(f[2]))
    return best, readings.other_zero(n, joint, off) if abs(off) >= OTHER_ZERO else None


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
        if robot is None or trial.robot_q is None:
            continue
        good = np.isfinite(trial.q).all(axis=1) & np.isfinite(trial.robot_q).all(axis=1)
        if good.any():
            yield hand_path(model, trial.q[good]) + _displacement(model, trial)[good] - handle_path(robot, trial.robot_q[good])


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
