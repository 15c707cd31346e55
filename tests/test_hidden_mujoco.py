"""The MuJoCo world of the hidden-effect cases beside the simulator that it judges: two engines that share no code."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import armrs
from armrs import Sensors, Trial

pytest.importorskip("mujoco", reason="the MuJoCo world needs `pip install mujoco`")

FOLDER = Path(__file__).parents[1] / "bench" / "hidden" / "mujoco_world"
ROBOT = ((0.47, 0.45), (1.03, -0.05))
RATE = 100.0


@pytest.fixture(scope="module")
def world() -> Any:
    """The modules of the world, which lie beside each other in a folder."""
    sys.path.insert(0, str(FOLDER))
    try:
        import effects
        import engine
        import subject
    finally:
        sys.path.remove(str(FOLDER))
    return SimpleNamespace(effects=effects, engine=engine, subject=subject)


@pytest.fixture(scope="module")
def who(world: Any) -> Any:
    """A person with three joints and an exact model."""
    people = (world.subject.subject(np.random.default_rng(seed), little_known=False, exact=True) for seed in range(1, 20))
    return replace(next(p for p in people if len(p.posture) == 3), robot=ROBOT)


def path(world: Any, who: Any) -> np.ndarray:
    """A loop of 4 s of shoulder and elbow."""
    t = np.arange(round(4.0 / world.engine.STEP) + 1) * world.engine.STEP
    s = np.clip((t - 0.5) / 3.0, 0.0, 1.0)
    way = s**3 * (10 - 15 * s + 6 * s**2)
    turn = np.column_stack([np.sin(2 * np.pi * way), 1 - np.cos(2 * np.pi * way), 0 * way])
    return np.asarray(who.model.tip(who.posture + turn * [0.3, 0.3, 0.0]))


def in_mujoco(world: Any, who: Any, hidden: Any = None) -> Any:
    """A trial in MuJoCo."""
    rig, motor, rubbing = who.truth, None, None
    if hidden is not None:
        rig, rubbing = hidden.alter(rig), hidden.friction
        if hidden.motor is not None:
            act = hidden.motor(np.random.default_rng(0))
            motor = lambda time, q, v: np.eye(3)[hidden.joint] * act(time, q, v)  # noqa: E731
    return world.engine.run(rig, path(world, who), who.posture, 50.0, None, motor, rubbing)


def native(world: Any, who: Any, truth: Any, *effects: armrs.Effect) -> np.ndarray:
    """The same trial by armrs, led by the robot's angles: angles of the arm and force on it."""
    every = round(1.0 / RATE / world.engine.RECORD)
    q, force = truth.q[::every], truth.force[::every]
    trial = Trial(
        file="trials/loop_1.csv", configuration="loop", repeat=1, role="fit", t=np.arange(len(q)) / RATE, q=q, force_on_arm=force,
        moment_on_arm=None, robot_q=world.subject.robot_angles(truth.handle[::every], *ROBOT),
    )  # fmt: skip
    rig = who.truth
    model = armrs.Model(
        segments=tuple(armrs.Segment(f"s{i}", s.length, s.mass, s.com, s.inertia) for i, s in enumerate(rig.segments)),
        joints=tuple(armrs.Joint(f"j{i}", stiffness=j.stiffness, rest=j.rest, viscosity=j.viscosity) for i, j in enumerate(rig.joints)),
        robot=armrs.Robot(lengths=ROBOT[0], base=ROBOT[1]),
        contact=armrs.Contact(stiffness=rig.stiffness, damping=rig.damping),
        effects=effects,
    )
    read = armrs.simulate(model, trial, sensors=Sensors(rate=RATE), seeds=[0]).readings[0]
    return np.column_stack([read.q - q, read.force_on_arm - force])


def test_both_engines_agree_where_nothing_is_hidden(world: Any, who: Any) -> None:
    apart = native(world, who, in_mujoco(world, who))
    # Beyond what the finest sensors of the sessions read: 3.5e-4 rad and 0.05 N.
    assert np.abs(apart[:, :3]).max() < 1e-4
    assert np.abs(apart[:, 3:]).max() < 0.05


KINDS = ["viscous", "coulomb", "elastic", "quadratic_drag", "cubic_elastic", "relaxation", "constant_moment", "biarticular"]
KINDS += ["motor_inertia", "added_mass", "gravity_tilt", "shoulder_heave", "contact_compliance", "stretch_reflex"]

LEFT = {"coulomb": 0.2, "stretch_reflex": 0.02}
"""Largest part that may be left, for kinds with another one than the rest."""


@pytest.mark.parametrize("kind", KINDS)
def test_what_the_truth_says_is_what_acts(world: Any, who: Any, kind: str) -> None:
    """The catalogue's effect with the values of the truth explains what MuJoCo's shows."""
    # The wrist hardly turns here: a reflex is one of the elbow.
    seed = 6 if kind == "stretch_reflex" else 4
    hidden = world.effects.hide(kind, "strong", who, [], np.random.default_rng(seed))
    truth = in_mujoco(world, who, hidden)
    effect = armrs.Effect(
        kind,
        joint=None if hidden.joint is None else hidden.joint + 1,
        parameters={name: value for name, (value, _) in hidden.parameters.items()},
    )
    scale = np.array([1e-3] * 3 + [0.1] * 2)
    shown, left = (np.sqrt(np.mean((native(world, who, truth, *e) / scale) ** 2)) for e in ((), (effect,)))
    # Where a joint rests, dry friction holds it with any torque up to its own; the catalogue's law is a function of the speed.
    assert left < LEFT.get(kind, 0.1) * shown
