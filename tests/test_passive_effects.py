"""End ranges that move with the joint before, viscosity that depends on the angle: against MuJoCo, whose torques are written here anew."""

from __future__ import annotations

import numpy as np
import pytest

import armrs
from armrs import BadInput, Effect
from armrs.catalogue import catalogue

SEGMENTS = (armrs.Segment("upper arm", 0.322, 2.114, 0.186, 0.0165), armrs.Segment("forearm", 0.264, 1.264, 0.121, 0.0074))
ENDS = {"upper_moment": 1.5, "lower_moment": 2.0, "steepness": 3.0, "upper": 1.6, "lower": 0.2, "ratio": 0.4}
THICK = {"lower_viscosity": 0.05, "upper_viscosity": 0.5, "lower": 0.3, "range": 1.2}
MODEL = armrs.Model(
    SEGMENTS,
    (armrs.Joint("shoulder", viscosity=0.3), armrs.Joint("elbow")),
    effects=(Effect("biarticular_end_range", 2, parameters=ENDS), Effect("angle_viscosity", 2, parameters=THICK)),
)
START = (-1.2, 1.4)
WORLD = """
<mujoco><option timestep="0.0005" integrator="RK4" gravity="0 0 -9.81"/><worldbody>
  <body><joint name="q1" axis="1 0 0"/><inertial pos="0 0.186 0" mass="2.114" diaginertia="0.0165 0.001 0.0165"/>
    <body pos="0 0.322 0"><joint name="q2" axis="1 0 0"/><inertial pos="0 0.121 0" mass="1.264" diaginertia="0.0074 0.001 0.0074"/></body></body>
</worldbody></mujoco>
"""


def resisting(q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """Return what the joints resist with [N m]."""
    x = q[1] + ENDS["ratio"] * q[0]
    elastic = ENDS["upper_moment"] * np.exp(3.0 * (x - 1.6)) - ENDS["lower_moment"] * np.exp(-3.0 * (x - 0.2))
    share = min(max((q[1] - 0.3) / 1.2, 0.0), 1.0)
    return np.array([0.4 * elastic + 0.3 * qd[0], elastic + (0.05 + 0.45 * share) * qd[1]])


def test_a_swinging_arm_moves_as_in_mujoco() -> None:
    mujoco = pytest.importorskip("mujoco")
    world = mujoco.MjModel.from_xml_string(WORLD)
    data = mujoco.MjData(world)
    data.qpos[:] = START

    def passive(_: object, at: object) -> None:
        at.qfrc_passive[:] = -resisting(at.qpos, at.qvel)  # type: ignore[attr-defined]

    mujoco.set_mjcb_passive(passive)
    try:
        seen = [data.qpos.copy()]
        for _ in range(150):
            mujoco.mj_step(world, data, nstep=20)
            seen.append(data.qpos.copy())
    finally:
        mujoco.set_mjcb_passive(None)
    run = armrs.simulate(MODEL, None, duration=1.5, rate=100.0, start=np.array(START))
    assert np.ptp(run.q[:, 1]) > 0.4
    assert np.abs(run.q - np.array(seen)).max() < 1e-9


def test_moments_and_viscosities_are_identified() -> None:
    """From a movement of the closed chain, with the shapes as the model has them."""
    robot = armrs.Robot((0.45, 0.45), (1.05, -0.10))
    led = MODEL.replace(robot=robot)
    movement = armrs.Movement(np.radians([[-60, 30], [-30, 100], [-70, 60], [-40, 25], [-60, 95], [-60, 30]]), speed=1.2, acceleration=5.0)
    trials = []
    for repeat in (1, 2):
        run = armrs.simulate(led, movement, rate=100.0)
        draw = np.random.default_rng(repeat)
        force = run.force_on_arm + 0.05 * draw.standard_normal(run.force_on_arm.shape)
        trials.append(armrs.Trial(f"t{repeat}.csv", "one", repeat, "fit", run.t, run.q + 1e-4 * draw.standard_normal(run.q.shape), force))
    unknown = led.replace(effects=tuple(e.replace(parameters=dict(e.parameters) | dict.fromkeys(_amplitudes(e), 0.0)) for e in led.effects))
    result = armrs.identify(armrs.Dataset("d", unknown, tuple(trials), "arm"), with_effects=())
    true = {name: e.parameters[name] for e in led.effects for name in _amplitudes(e)}
    found = {e.name: e for e in result.parameters if e.name in true}
    assert set(found) == set(true)
    for name, value in true.items():
        assert found[name].value == pytest.approx(value, rel=0.05, abs=0.02), name


def _amplitudes(effect: Effect) -> list[str]:
    return [p.name for p in catalogue()[effect.kind].parameters if p.linear]


def test_the_search_does_not_ask_for_them_and_bad_values_are_refused() -> None:
    assert [name for name, kind in catalogue().items() if not kind.searched] == [
        "angle_viscosity",
        "active_viscosity",
        "active_stiffness",
        "biarticular_end_range",
    ]
    for change, message in (({"range": 0.0}, "range"), ({"lower_viscosity": -0.1}, "lower_viscosity")):
        with pytest.raises(BadInput, match=message):
            MODEL.replace(effects=(Effect("angle_viscosity", 2, parameters=THICK | change),))
    with pytest.raises(BadInput, match="joint"):
        MODEL.replace(effects=(Effect("biarticular_end_range", 1, parameters=ENDS),))
