"""Virtual sessions of section 4.1: six subjects, each in five configurations with a moving elbow and five with a moving shoulder."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from ..formatting import minus
from ..io.dataset import Dataset
from ..model import AddedMass, Effect, Joint, Model, Segment, Subject
from ..workflows.movement import Movement
from ..workflows.passive import PassiveMoments, passive_moments
from ..workflows.simulate import Simulated
from . import simulated_arms

SHOULDER_HELD = (-68.0, -40.0, -16.0, 10.0, 36.0)
ELBOW_HELD = (27.0, 40.0, 50.0, 60.0, 70.0)
ELBOW_STD = (0.7, 1.1, 1.0, 0.4, 1.1)
"""Table 4.1 [N m]."""
SHOULDER_STD = (4.4, 3.6, 2.7, 3.0, 2.2)
"""Table 4.2 [N m]."""
MASSES = (77.0, 64.0, 66.0, 68.0, 70.0, 76.0)
"""Body masses of the subjects: the first is the thesis', the others lie in its range and have its mean of 70.2 kg."""
HEIGHTS = (1.80, 1.72, 1.76, 1.74, 1.78, 1.82)
REPEATS = (6, 2, 2, 2, 2, 2)
SEED = 2004


def elbow_movement(held: float) -> Movement:
    """Return the elbow's movement with the shoulder held [deg]."""
    return Movement(np.radians([[held, 25.0, 0.0], [held, 85.0, 0.0], [held, 25.0, 0.0]]), speed=0.3, acceleration=0.6, shape="smooth")


def shoulder_movement(held: float) -> Movement:
    """Return the shoulder's movement with the elbow held [deg]."""
    return Movement(np.radians([[-65.0, held, 0.0], [-15.0, held, 0.0], [-65.0, held, 0.0]]), speed=0.2, acceleration=0.6, shape="smooth")


def holding(joint: str, angle: float) -> str:
    """Return the name of a configuration, by the joint that is held and where [deg]."""
    return f"{joint} at {minus(f'{angle:g}')}"


def configurations() -> list[tuple[str, int, Movement, float]]:
    """Return name, moving joint, movement and the printed deviation over trials, the pairs of figures 4.1 to 4.5 after one another."""
    found = []
    for shoulder, elbow, elbow_std, shoulder_std in zip(SHOULDER_HELD, ELBOW_HELD, ELBOW_STD, SHOULDER_STD, strict=True):
        found.append((holding("shoulder", shoulder), 2, elbow_movement(shoulder), elbow_std))
        found.append((holding("elbow", elbow), 1, shoulder_movement(elbow), shoulder_std))
    return found


@dataclass(frozen=True, eq=False)
class Session:
    """What was simulated of one subject, and what came of it.

    Attributes
    ----------
    number : int
        Of the subject, from 1.
    runs : dict of str to Simulated
        The first trial of each configuration as it was, by name.
    dataset : Dataset
    moments : PassiveMoments
    """

    number: int
    runs: dict[str, Simulated]
    dataset: Dataset
    moments: PassiveMoments


@functools.cache
def session(number: int, tone: bool = True) -> Session:
    """Simulate and evaluate the ten configurations of a subject; without `tone` trials differ by the noise of the sensors alone."""
    truth = subject(number)
    worn = [(segment, mass, (truth.segments[0].length - at) if segment == 1 else at) for segment, mass, at in simulated_arms.ORTHOSIS]
    dressed = truth
    for segment, mass, place in worn:
        dressed = dressed.with_mass(segment, mass, place)
    draw = np.random.default_rng([SEED, number])
    runs, trials = {}, []
    for index, (name, joint, movement, std) in enumerate(configurations()):
        arm, seed, count = dressed if joint == 1 else truth, SEED + 1000 * number + 10 * index, REPEATS[number - 1]
        moments = std * draw.standard_normal(count if tone else 0)
        if not tone:
            runs[name] = simulated_arms.run(arm, movement, range(seed, seed + count))
            trials += simulated_arms.trials(runs[name], name)
        for repeat, moment in enumerate(moments, 1):
            made = simulated_arms.run(
                simulated_arms.with_tone(arm, (moment, 0.0) if joint == 1 else (0.0, moment)), movement, [seed + repeat]
            )
            runs.setdefault(name, made)
            trials += simulated_arms.trials(made, name, first=repeat)
    names = tuple(name for name, joint, _, _ in configurations() if joint == 1)
    dataset = Dataset(
        f"virtual subject {number}",
        simulated_arms.arm(truth.segments),
        tuple(trials),
        "robot",
        sample_rate=simulated_arms.RATE,
        synthetic=True,
        added=tuple(AddedMass(*item, configurations=names) for item in worn),
    )
    return Session(number, runs, dataset, passive_moments(dataset))


def subject_one() -> Session:
    """Return the subject who was measured six times."""
    return session(1)


def subject(number: int) -> Model:
    """Return a virtual subject with segments by the literature."""
    return passive_arm(simulated_arms.literature(Subject(MASSES[number - 1], HEIGHTS[number - 1], "male")), number)


def passive_arm(segments: tuple[Segment, ...], number: int) -> Model:
    """Return an arm with passive joints drawn about a healthy arm's; the first has these themselves.

    A shoulder that is stiffer than the elbow, both stiffer towards the ends, dry friction in both, and a spring over both joints for
    the muscles that span them. All of these are chosen; the thesis prints curves, and no numbers of them.
    """
    size = np.ones(10) if number == 1 else np.exp(0.3 * np.random.default_rng([SEED, 100 + number]).standard_normal(10))
    joints = (
        Joint("shoulder", stiffness=5.0 * size[0], rest=-0.7, viscosity=0.1, coulomb=0.6 * size[1]),
        Joint("elbow", stiffness=0.8 * size[2], rest=0.9, viscosity=0.05, coulomb=0.25 * size[3]),
        simulated_arms.WRIST,
    )
    ends = (
        {"upper_moment": 2.0 * size[4], "lower_moment": 1.5 * size[5], "steepness": 4.0, "upper": 0.8, "lower": -1.3},
        {"upper_moment": 1.2 * size[6], "lower_moment": 0.8 * size[7], "steepness": 4.0, "upper": 1.5, "lower": 0.4},
    )
    effects = [Effect("end_range", j, parameters=p) for j, p in enumerate(ends, 1)]
    effects.append(Effect("biarticular", 2, parameters={"stiffness": 1.2 * size[8], "ratio": 1.0, "rest": 0.3}))
    return simulated_arms.arm(segments, joints, effects)
