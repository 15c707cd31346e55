"""Synthetic sessions for the gap workflow."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

import armrs
from armrs.io.dataset import Dataset

ROBOT = armrs.Robot((0.5, 0.45), (1.0, -0.1), "up")


def model(*effects: armrs.Effect) -> armrs.Model:
    segments = (armrs.Segment("upper arm", 0.32, 2.0, 0.15, 0.02), armrs.Segment("forearm", 0.28, 1.3, 0.13, 0.012))
    joints = (armrs.Joint("shoulder", viscosity=0.1), armrs.Joint("elbow", viscosity=0.1))
    contact = armrs.Contact((1e4, 1e4), (25.0, 25.0))
    return armrs.Model(segments, joints, segment_uncertainty=0.02, robot=ROBOT, contact=contact, effects=effects)


def three_joints(*effects: armrs.Effect) -> armrs.Model:
    """The same with a hand, whose joints have springs."""
    springs = [
        armrs.Effect("elastic", j, parameters={"stiffness": k, "rest": r}) for j, k, r in ((1, 1.1, -1.1), (2, 0.7, 1.1), (3, 1.0, 0.1))
    ]
    both = model()
    hand, wrist = armrs.Segment("hand", 0.08, 0.4, 0.05, 0.001), armrs.Joint("wrist", viscosity=0.1)
    return both.replace(segments=(*both.segments, hand), joints=(*both.joints, wrist), effects=(*springs, *effects))


MOVEMENTS = {
    "slow": (((-60, 50), (-30, 50), (-30, 85), (-60, 50)), 0.4),
    "fast": (((-50, 80), (-20, 40), (-50, 80)), 1.0),
}
"""Corners of shoulder and elbow [°], and the speed [rad/s]."""


@cache
def session(*hidden: armrs.Effect, seed: int = 0, engine: str = "rapier") -> Dataset:
    """Return a session that an engine makes: two movements, three repeats to fit and one to test of each. It is frozen, and made once."""
    return _session(model, hidden, armrs.Sensors(angle=armrs.Channel(1e-3), force=armrs.Channel(0.1)), 100.0, seed, engine)


def session_of_three_joints(*hidden: armrs.Effect) -> Dataset:
    """Return the same session of an arm of three joints, with coarse angles, at 50 Hz."""
    return _session(three_joints, hidden, armrs.Sensors(angle=armrs.Channel(2e-3), force=armrs.Channel(0.1)), 50.0, 0, "native")


def _session(
    arm: Callable[..., armrs.Model], hidden: tuple[armrs.Effect, ...], sensors: armrs.Sensors, rate: float, seed: int, engine: str
) -> Dataset:
    wrist = (5,) * (len(arm().joints) - 2)
    trials = []
    for number, (name, (corners, speed)) in enumerate(MOVEMENTS.items()):
        movement = armrs.Movement(
            np.radians([(*corner, *wrist) for corner in corners]), speed=speed, acceleration=4.0 * speed, shape="smooth"
        )
        seeds = range(seed + 4 * number, seed + 4 * number + 4)
        run = armrs.simulate(arm(*hidden), movement, engine=engine, rate=rate, sensors=sensors, seeds=seeds)
        for repeat, read in enumerate(run.readings, start=1):
            trials.append(
                armrs.Trial(
                    file=f"{name}_{repeat}.csv",
                    configuration=name,
                    repeat=repeat,
                    role="test" if repeat == 4 else "fit",
                    t=read.time,
                    q=read.q,
                    force_on_arm=read.force_on_arm,
                    robot_q=read.robot_q,
                )
            )
    return Dataset("hidden", arm(), tuple(trials), force_on="arm", synthetic=True)
