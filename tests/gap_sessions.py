"""Synthetic sessions for the gap workflow."""

from __future__ import annotations

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


@cache
def session(*hidden: armrs.Effect, seed: int = 0, engine: str = "rapier") -> Dataset:
    """Return a session that an engine makes: two movements, three repeats to fit and one to test of each. It is frozen, and made once."""
    movements = {
        "slow": armrs.Movement(np.radians([[-60, 50], [-30, 50], [-30, 85], [-60, 50]]), speed=0.4, acceleration=1.6, shape="smooth"),
        "fast": armrs.Movement(np.radians([[-50, 80], [-20, 40], [-50, 80]]), speed=1.0, acceleration=4.0, shape="smooth"),
    }
    sensors = armrs.Sensors(angle=armrs.Channel(1e-3), force=armrs.Channel(0.1))
    trials = []
    for number, (name, movement) in enumerate(movements.items()):
        run = armrs.simulate(
            model(*hidden), movement, engine=engine, rate=100.0, sensors=sensors, seeds=range(seed + 4 * number, seed + 4 * number + 4)
        )
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
    return Dataset("hidden", model(), tuple(trials), force_on="arm", synthetic=True)
