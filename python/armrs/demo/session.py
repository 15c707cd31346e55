"""The sessions of the demonstration: the mechanical arm of the thesis, the model without its brakes, and the simulated movements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._armrs import Readings
from ..io.dataset import Dataset
from ..io.trial import Trial
from ..model import Contact, Joint, Model, Robot, Segment
from ..workflows.movement import Movement
from ..workflows.simulate import Sensors, simulate

BRAKES = (0.139, 0.161)
"""Dry friction of the brakes in shoulder and elbow, by their load cells [N m] (table 4.3)."""
POSTURES_DEG = {"low": (-60.0, 60.0), "high": (-20.0, 60.0), "between": (-42.0, 72.0)}
SWING_DEG = 6.0
SPEED = 0.04
"""Of the slow session [rad/s]."""
FIT_REPEATS = {"low": 5, "high": 5, "between": 0}
TEST_REPEATS = {"low": 1, "high": 1, "between": 2}
SEEDS = {"low": 1000, "high": 2000, "between": 3000}
"""Seed of the sensor noise of the first repeat; the next ones count on."""
PATH_OF_ONE = ((0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 0.0), (0.0, 1.0), (0.0, -1.0), (0.0, 0.0))
"""Each joint to both sides and back while the other is held."""
PATH_OF_BOTH = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0), (1.0, 0.3), (-0.3, -0.6), (0.0, 0.0))
"""Both joints together."""


@dataclass(frozen=True)
class SessionMovement:
    """A movement of the session with two speeds: posture and swing [deg], speed [rad/s], seed of the noise of its first repeat."""

    posture_deg: tuple[float, float]
    swing_deg: float
    way: tuple[tuple[float, float], ...]
    speed: float
    seed: int


TWO_SPEEDS = {
    "slow-low": SessionMovement((-60.0, 60.0), SWING_DEG, PATH_OF_ONE, 0.1, 5000),
    "slow-high": SessionMovement((-20.0, 60.0), SWING_DEG, PATH_OF_ONE, 0.1, 6000),
    "quick": SessionMovement((-45.0, 65.0), 22.0, PATH_OF_BOTH, 0.6, 7000),
}
"""Dry friction and viscosity resist alike at one speed: the search needs two."""
REPEATS = 4
"""Of each of these movements; the last is the test trial."""
SLOW_BELOW = 0.2
"""Movements below are slow [rad/s]."""
MASS_FACTOR = 1.1
"""The model handed to the identification has all masses and inertias too large by this factor, and no brakes."""


def true_model() -> Model:
    """Return the mechanical arm of table 4.3 with its brakes, held by a robot that reaches the whole path."""
    # The thesis gives no inertias: those of uniform rods.
    return Model(
        segments=(
            Segment("upper arm", length=0.376, mass=1.440, com=0.184, inertia=1.440 * 0.376**2 / 12.0),
            Segment("forearm", length=0.239, mass=1.160, com=0.115, inertia=1.160 * 0.239**2 / 12.0),
        ),
        joints=(Joint("shoulder", coulomb=BRAKES[0]), Joint("elbow", coulomb=BRAKES[1])),
        segment_uncertainty=0.0,
        robot=Robot(lengths=(0.45, 0.45), base=(1.0, -0.1)),
        contact=Contact(stiffness=(10_000.0, 10_000.0), damping=(25.0, 25.0)),
    )


def given_model(truth: Model) -> Model:
    """Return the model that the identification starts from: too heavy, and without brakes."""
    segments = tuple(Segment(s.name, s.length, MASS_FACTOR * s.mass, s.com, MASS_FACTOR * s.inertia) for s in truth.segments)
    return truth.replace(segments=segments, joints=tuple(Joint(j.name) for j in truth.joints), segment_uncertainty=MASS_FACTOR - 1.0)


def measure(truth: Model) -> Dataset:
    """Return the data set that the simulated experiment gives: slow movements, one joint at a time, read by realistic sensors."""
    trials = []
    for name, posture in POSTURES_DEG.items():
        count = FIT_REPEATS[name] + TEST_REPEATS[name]
        movement = Movement(_one_joint_at_a_time(posture), speed=SPEED, acceleration=0.2, pause=0.5, shape="smooth")
        run = simulate(truth, movement, sensors=Sensors.realistic(), seeds=range(SEEDS[name], SEEDS[name] + count))
        for repeat, read in enumerate(run.readings, start=1):
            trials.append(_trial(name, repeat, "fit" if repeat <= FIT_REPEATS[name] else "test", read))
    return Dataset(
        name="Mechanical arm of table 4.3, brakes on",
        model=given_model(truth),
        trials=tuple(trials),
        force_on="robot",
        sample_rate=Sensors.realistic().rate,
        synthetic=True,
    )


def measure_two_speeds(truth: Model) -> Dataset:
    """Return the data set of a second session on the same arm: slow movements of one joint at a time, and quick ones of both."""
    trials = []
    for name, course in TWO_SPEEDS.items():
        waypoints = np.radians(np.array(course.posture_deg) + course.swing_deg * np.array(course.way))
        movement = Movement(waypoints, speed=course.speed, acceleration=5.0 * course.speed, pause=0.3, shape="smooth")
        run = simulate(truth, movement, sensors=Sensors.realistic(), seeds=range(course.seed, course.seed + REPEATS))
        trials += [_trial(name, repeat, "test" if repeat == REPEATS else "fit", read) for repeat, read in enumerate(run.readings, start=1)]
    return Dataset(
        name="Mechanical arm of table 4.3, brakes on, two speeds",
        model=given_model(truth),
        trials=tuple(trials),
        force_on="robot",
        sample_rate=Sensors.realistic().rate,
        synthetic=True,
    )


def slow_movements(session: Dataset) -> Dataset:
    """Return the slow movements of the session with two speeds."""
    return session.replace(trials=tuple(t for t in session.trials if TWO_SPEEDS[t.configuration].speed < SLOW_BELOW))


def _trial(name: str, repeat: int, role: str, read: Readings) -> Trial:
    return Trial(
        file=f"trials/{name}_{repeat}.csv", configuration=name, repeat=repeat, role=role, t=read.time, q=read.q,
        force_on_arm=read.force_on_arm, moment_on_arm=None, robot_q=read.robot_q,
    )  # fmt: skip


def _one_joint_at_a_time(posture_deg: tuple[float, float]) -> np.ndarray:
    """Return waypoints: each joint to both sides and back while the other is held [rad]."""
    return np.radians(np.array(posture_deg) + SWING_DEG * np.array(PATH_OF_ONE))
