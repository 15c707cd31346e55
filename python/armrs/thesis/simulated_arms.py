"""The simulated arms and robots: the mechanical arm, virtual subjects, and how their trials are measured.

The thesis prints no measured samples. Where an item needs some, they come from the closed-chain simulation of these arms, read by the
sensors of section 3; every number that the thesis does not give is chosen here and marked as chosen.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .. import _armrs, demo
from ..anthropometry import JOINTS, literature_arm
from ..io.trial import Trial
from ..model import Effect, Joint, Model, Robot, Segment, Subject
from ..workflows.experiment import THESIS_CONTACT
from ..workflows.movement import Movement
from ..workflows.simulate import Sensors, Simulated, simulate

HANDLE = (0.277, 0.0844)
"""Mass of the handle [kg] and its place from the wrist [m]; section 3.1 prints 0.844 m, which is longer than the hand."""
ORTHOSIS = ((1, 0.200, 0.091), (2, 0.191, 0.066))
"""Upper and lower part: segment, mass [kg], distance from the elbow [m] (section 3.4.1)."""
LENGTHS = (0.322, 0.264, 0.093)
"""Upper arm, forearm, hand to handle [m], table 4.10."""
WORKING_ROBOT = Robot(lengths=(0.6, 0.6), base=(1.05, -0.1))
"""The robot of the passive moments, whose lengths the thesis does not give; this one reaches every configuration."""
RATE = 50.0
SUBJECT_ONE = Subject(77.0, 1.80, "male")
"""Body mass as section 4.2.2 prints it [kg]; the height is chosen [m]."""
WRIST = Joint("wrist", stiffness=12.0, viscosity=0.05, coulomb=0.03)
"""A hand strapped to the handle: the wrist stays within a few degrees, as in section 3.4.1."""


def mechanical(brakes: bool) -> Model:
    """Return the mechanical arm of table 4.3, with its brakes on or off."""
    truth = demo.true_model()
    return truth if brakes else truth.replace(joints=tuple(Joint(j.name) for j in truth.joints))


def literature(subject: Subject, lengths: tuple[float, ...] = LENGTHS) -> tuple[Segment, ...]:
    """Return a subject's segments by de Leva's tables, the hand with the handle."""
    segments, _ = literature_arm(subject, list(lengths))
    return Model(segments, tuple(Joint(name) for name in JOINTS)).with_mass(3, *HANDLE).segments


def transverse(lengths: tuple[float, ...] = LENGTHS) -> tuple[float, ...]:
    """Return moments of inertia of subject one after de Leva for segments of these lengths, the hand with the handle [kg m²].

    About the axis of the joints, through each segment's centre of mass. The handle counts as a point.
    """
    return tuple(segment.inertia for segment in literature(SUBJECT_ONE, lengths))


TABLE_4_10 = tuple(
    Segment(name, length, mass, com, inertia)
    for name, length, mass, com, inertia in zip(
        ("upper arm", "forearm", "hand and handle"), LENGTHS, (2.114, 1.264, 0.753), (0.186, 0.121, 0.081), transverse(), strict=True
    )
)
"""Table 4.10; moments of inertia, which it does not have, after de Leva."""


def arm(segments: tuple[Segment, ...], joints: Sequence[Joint] = (), effects: Sequence[Effect] = (), robot: Robot = WORKING_ROBOT) -> Model:
    """Return an arm that a robot leads; without joints nothing passive acts but the wrist's strap."""
    given = tuple(joints) or (*(Joint(name) for name in JOINTS[: len(segments) - 1]), WRIST)
    return Model(segments, given, segment_uncertainty=0.05, robot=robot, contact=THESIS_CONTACT, effects=tuple(effects))


def with_tone(model: Model, moments: Sequence[float]) -> Model:
    """Return an arm with a constant moment in its first joints [N m]: what differs between trials."""
    extra = tuple(Effect("constant_moment", j, parameters={"moment": float(m)}) for j, m in enumerate(moments, 1) if m)
    return model.replace(effects=(*model.effects, *extra))


def run(model: Model, movement: Movement, seeds: Sequence[int]) -> Simulated:
    """Simulate a movement and read it with the sensors of the thesis, once for every seed."""
    return simulate(model, movement, rate=RATE, sensors=Sensors.realistic(), seeds=list(seeds))


def trials(made: Simulated, configuration: str, first: int = 1, role: str = "fit") -> list[Trial]:
    """Return what the sensors read as trials, counted from `first`."""
    return [
        Trial(
            file=f"trials/{configuration}_{k}.csv",
            configuration=configuration,
            repeat=k,
            role=role,
            t=read.time,
            q=read.q,
            force_on_arm=read.force_on_arm,
            robot_q=read.robot_q,
        )
        for k, read in enumerate(made.readings, start=first)
    ]


def static_torque(model: Model, trial: Trial) -> np.ndarray:
    """Return Jᵀ F of the force on the arm, shape (n, n_joints): τ_j of equations 3.23 to 3.25, weight and passive moments [N m]."""
    assert trial.force_on_arm is not None
    return _armrs.Arm.from_model(model).static_torque(trial.q, trial.force_on_arm)
