"""What a data set cannot be, whatever the arm is: sensors that say nothing, and angles that contradict those of the robot.

It is asked before any physics, so that a wrong column is named as such and not as a poor fit.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations
from typing import TYPE_CHECKING

import numpy as np

from ..errors import BadInput, Text

if TYPE_CHECKING:
    from ..model import Model, Robot
    from .dataset import Dataset
    from .trial import Trial

STILL = 1e-9
"""A channel that varies by no more than this says nothing: noise alone is more."""
_DEGREE = float(np.radians(1.0))
_FAR = 0.3
"""Distance of hand and handle, relative to the arm, beyond which angles of arm and robot contradict each other."""
_SUSPECT = 0.05
"""The same, beyond which another reading of the columns is looked for."""
_MEETS = 0.2
"""Another reading explains the columns when it brings hand and handle this much nearer."""
_HELD = (0.002, 0.05)
"""An angle that never changes contradicts a handle that moves against the hand by more than this [m], and by this part of its path."""
_MOST_SWAPPED = 4
"""Joints up to which orders of columns are tried."""


def refuse_implausible(dataset: Dataset, *, robot_matters: bool = True) -> None:
    """Refuse a data set in which a sensor is dead, or angles of arm and robot cannot belong together.

    Where the robot does not matter, its angles are only asked whether columns are swapped or in another unit.

    Raises
    ------
    BadInput
        Names the trial's file and the column.
    """
    for trial in dataset.trials:
        if trial.force_on_arm is not None:
            for name, values in zip(("Fy", "Fz"), trial.force_on_arm.T, strict=True):
                level = constant(values)
                if level is not None:
                    found, allowed = Text(f"{level:g} N in every sample"), "a force that changes with the movement"
                    raise BadInput(f"column {name}", found, allowed, file=trial.file, hint="a dead sensor?")
    if all(constant(angle) is not None for trial in dataset.trials for angle in trial.q.T):
        raise BadInput("angles", Text("none that changes in any trial"), "an arm that moves", hint="dead sensors?")
    if dataset.model.robot is not None:
        for trial in dataset.trials:
            if trial.robot_q is not None:
                _refuse_apart(dataset.model, dataset.model.robot, trial, robot_matters)


def constant(values: np.ndarray) -> float | None:
    """Return the value that a channel has throughout, or None for one that varies."""
    there = values[np.isfinite(values)]
    return float(there[0]) if len(there) and np.ptp(there) <= STILL else None


def still_angles(trials: tuple[Trial, ...]) -> list[str]:
    """Return the joints whose angle is the same in every sample of every trial, a line each: held, or not measured."""
    lines = []
    for j in range(trials[0].q.shape[1] if trials else 0):
        levels = [constant(trial.q[:, j]) for trial in trials]
        if all(level is not None and level == levels[0] for level in levels):
            lines.append(f"q{j + 1} is {levels[0]:g} rad in every sample of every trial: a joint that is held, or a dead sensor?")
    return lines


def _refuse_apart(model: Model, robot: Robot, trial: Trial, robot_matters: bool) -> None:
    """Compare where the measured angles put the hand with where the robot's put its handle."""
    assert trial.robot_q is not None
    good = np.isfinite(trial.q).all(axis=1) & np.isfinite(trial.robot_q).all(axis=1)
    if not good.any():
        return
    q, robot_q = trial.q[good], trial.robot_q[good]
    reach = sum(s.length for s in model.segments)
    handle = _handle(robot, robot_q)
    gap = _tip(model, q) - handle
    own = _rms(gap)
    if own > _SUSPECT * reach:
        others = [(_rms(_tip(model, a) - _handle(robot, b)), place, words) for place, words, a, b in _readings(q, robot_q)]
        best, place, words = min(others)
        if best < min(_MEETS * own, 0.1 * reach):
            raise BadInput(place, Text(f"angles that put the hand {own:.3g} m from the robot's handle"), words, file=trial.file)
        best, joint, offset = _other_zero(model, q, handle)
        if best < min(_MEETS * own, 0.1 * reach):
            words = f"angles with the model's zero (that of q{joint} is off by {offset:.3g} rad?)"
            raise BadInput(
                f"column q{joint}", Text(f"angles that put the hand {own:.3g} m from the robot's handle"), words, file=trial.file
            )
    if not robot_matters:
        return
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


def _readings(q: np.ndarray, robot_q: np.ndarray) -> Iterator[tuple[str, str, np.ndarray, np.ndarray]]:
    """Give what the columns may be instead: their place, what is allowed there, and the angles that they would then hold."""
    for place, wrong in (("columns q1 …", "q"), ("columns qr1, qr2", "qr")):
        for factor, unit in ((_DEGREE, "degrees labelled as radians"), (1.0 / _DEGREE, "radians labelled as degrees")):
            a, b = (q * factor, robot_q) if wrong == "q" else (q, robot_q * factor)
            yield place, f"angles in the unit of their column ({unit}?)", a, b
    yield "columns qr1, qr2", "qr1 of the robot's first joint, qr2 of its second (swapped columns?)", q, robot_q[:, ::-1]
    yield from ((place, words, a, robot_q) for place, words, a in _conventions(q))
    n = q.shape[1]
    for order in permutations(range(n)) if n <= _MOST_SWAPPED else ():
        if order != tuple(range(n)):
            yield "columns q1 …", "q1 of the first joint, the others outwards (swapped columns?)", q[:, order], robot_q


def _conventions(q: np.ndarray) -> Iterator[tuple[str, str, np.ndarray]]:
    """Give angles of other conventions as those of the model: counter-clockwise, the first from +y, the others from the segment before."""
    relative = np.column_stack([q[:, :1], np.diff(q, axis=1)])
    quarter = np.zeros(q.shape[1])
    quarter[0] = np.pi / 2
    for angles, kind in ((q, ""), (relative, "absolute angles, ")):
        if kind:
            yield "columns q1 …", "angles relative to the segment before (absolute angles?)", angles
        yield "columns q1 …", f"angles counter-clockwise ({kind}mirrored?)", -angles
        yield "columns q1 …", f"y forward ({kind}seen from the other side?)", 2 * quarter - angles
        for sign, turned in ((1.0, ""), (-1.0, ", mirrored")):
            yield "column q1", f"q1 from +y ({kind}from the vertical downwards{turned}?)", sign * angles - quarter
            yield "column q1", f"q1 from +y ({kind}from the vertical upwards{turned}?)", sign * angles + quarter


def _other_zero(model: Model, q: np.ndarray, handle: np.ndarray) -> tuple[float, int, float]:
    """Return how near one joint's other zero brings hand and handle: the distance [m], the joint from 1, its angle there [rad]."""
    thin = slice(None, None, max(1, len(q) // 100))
    found = []
    for j in range(q.shape[1]):
        offset = np.zeros(q.shape[1])
        for width, centre in ((np.pi, 0.0), (np.radians(2.0), None)):
            middle = offset[j] if centre is None else centre
            tried = middle + np.linspace(-width, width, 181)
            sizes = []
            for value in tried:
                offset[j] = value
                sizes.append(_rms(_tip(model, q[thin] + offset) - handle[thin]))
            offset[j] = tried[int(np.argmin(sizes))]
        found.append((min(sizes), j + 1, float(offset[j])))
    return min(found)


def hand_meets_handle(dataset: Dataset) -> bool:
    """Whether the measured angles put the hand where the robot's put its handle, within 5 % of the arm's length, in every trial."""
    model, robot = dataset.model, dataset.model.robot
    if robot is None:
        return False
    for trial in dataset.trials:
        if trial.robot_q is None:
            return False
        good = np.isfinite(trial.q).all(axis=1) & np.isfinite(trial.robot_q).all(axis=1)
        if good.any():
            gap = _tip(model, trial.q[good]) - _handle(robot, trial.robot_q[good])
            if _rms(gap) > _SUSPECT * sum(s.length for s in model.segments):
                return False
    return True


def _handle(robot: Robot, q: np.ndarray) -> np.ndarray:
    first, second = q[:, 0], q[:, 0] + q[:, 1]
    near, far = robot.lengths
    return np.column_stack(
        [robot.base[0] + near * np.cos(first) + far * np.cos(second), robot.base[1] + near * np.sin(first) + far * np.sin(second)]
    )


def _tip(model: Model, q: np.ndarray) -> np.ndarray:
    angles = np.cumsum(q, axis=1)
    lengths = np.array([s.length for s in model.segments])
    return np.column_stack([model.base[0] + np.cos(angles) @ lengths, model.base[1] + np.sin(angles) @ lengths])


def _rms(distance: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(distance**2, axis=1))))
