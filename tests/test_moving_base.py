"""A first joint that moves along a measured path: loads of an arm on a sliding base, computed by MuJoCo."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs import BadInput, Dataset, Trial, cli

mujoco = pytest.importorskip("mujoco")

SEGMENTS = (armrs.Segment("upper arm", 0.322, 2.114, 0.186, 0.0165), armrs.Segment("forearm", 0.264, 1.264, 0.121, 0.0074))
MODEL = armrs.Model(SEGMENTS, (armrs.Joint("shoulder"), armrs.Joint("elbow")))
WORLD = """
<mujoco><option gravity="0 0 -9.81"/><worldbody><body>
  <joint name="by" type="slide" axis="0 1 0"/><joint name="bz" type="slide" axis="0 0 1"/><inertial pos="0 0 0" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/>
  <body><joint name="q1" axis="1 0 0"/><inertial pos="0 0.186 0" mass="2.114" diaginertia="0.0165 0.001 0.0165"/>
    <body pos="0 0.322 0"><joint name="q2" axis="1 0 0"/><inertial pos="0 0.121 0" mass="1.264" diaginertia="0.0074 0.001 0.0074"/>
      <site name="hand" pos="0 0.264 0"/></body></body></body></worldbody></mujoco>
"""
VISCOSITY = (0.3, 0.2)


def trial(number: int, *, shift: float = 0.03, rate: float = 200.0, noise: float = 0.0) -> Trial:
    """Return a movement of 8 s whose torques hold the arm of MuJoCo, with viscous joints, while its base goes to and fro by `shift` [m]."""
    world = mujoco.MjModel.from_xml_string(WORLD)
    data = mujoco.MjData(world)
    t = np.arange(0.0, 8.0, 1.0 / rate)
    omega = 2.0 * np.pi * np.array([0.7, 0.5, 0.33 + 0.05 * number, 0.51 - 0.04 * number])
    size = np.array([shift, 0.7 * shift, 0.6, 0.7])
    phase = np.array([0.0, 1.0, 0.4 * number, 0.9])
    at = size * np.sin(np.outer(t, omega) + phase) + np.array([0.0, 0.0, -0.6, 1.1])
    speed = size * omega * np.cos(np.outer(t, omega) + phase)
    acceleration = -size * omega**2 * np.sin(np.outer(t, omega) + phase)
    tau = np.zeros((len(t), 2))
    for k in range(len(t)):
        data.qpos[:], data.qvel[:], data.qacc[:] = at[k], speed[k], acceleration[k]
        mujoco.mj_inverse(world, data)
        tau[k] = data.qfrc_inverse[2:] + VISCOSITY * speed[k, 2:]
    draw = np.random.default_rng(number)
    q, base = at[:, 2:] + noise * draw.standard_normal((len(t), 2)), at[:, :2] + noise * draw.standard_normal((len(t), 2))
    return Trial(f"trials/t{number}.csv", f"m{number}", 1, "fit", t, q, tau=tau, base=base)


def session(**given: float) -> Dataset:
    return Dataset("moving", MODEL, tuple(trial(k, **given) for k in range(3)))


def without(data: Dataset) -> Dataset:
    return data.replace(trials=tuple(dataclasses.replace(t, base=None) for t in data.trials))


def test_masses_and_viscosity_come_back_with_the_path_and_not_without() -> None:
    data = session()
    wrong = MODEL.replace(
        segment_uncertainty=0.2, segments=tuple(s.replace(mass=0.9 * s.mass, com=1.1 * s.com, inertia=1.2 * s.inertia) for s in SEGMENTS)
    )
    known, unknown = (armrs.identify(d.replace(model=wrong), with_effects=["viscous"]) for d in (data, without(data)))
    true = {"viscosity": VISCOSITY}
    found, blind = ([e.value for e in r.parameters if e.name in true] for r in (known, unknown))
    assert found == pytest.approx(VISCOSITY, abs=1e-3)
    assert np.abs(np.array(blind) - VISCOSITY).max() > 0.02
    moments = known.model.segments
    assert moments[1].mass * moments[1].com == pytest.approx(1.264 * 0.121, rel=2e-3)
    assert max(known.residual_rms["fit"].values()) < 0.01 < 0.1 < max(unknown.residual_rms["fit"].values())


def test_noise_of_the_path_leaves_intervals_that_hold() -> None:
    result = armrs.identify(session(noise=2e-4).replace(model=MODEL.replace(segment_uncertainty=0.1)), with_effects=["viscous"])
    for e, true in zip([e for e in result.parameters if e.name == "viscosity"], VISCOSITY, strict=True):
        assert e.interval[0] <= true <= e.interval[1]


def test_the_passive_moment_of_a_slow_movement_is_free_of_the_path() -> None:
    data = session()
    moments = [armrs.passive_moments(d, cutoff=4.0).trials[0] for d in (data, without(data))]
    viscous = moments[0].qd * VISCOSITY
    inside = slice(200, -200)
    left = [np.abs((m.moment - viscous)[inside]).max() for m in moments]
    assert left[0] < 0.02 and left[1] > 0.3


def test_a_hand_that_is_carried_along_meets_the_handle() -> None:
    """The robot's angles put the handle where the hand is in space."""
    robot = armrs.Robot((0.45, 0.45), (1.05, -0.10))
    data = session(shift=0.1)
    arm = armrs.Arm.from_model(MODEL)
    from armrs.io.plausibility import hand_meets_handle

    led = []
    for t in data.trials:
        assert t.base is not None
        hand = arm.forward_kinematics(t.q)[:, :2] + t.base
        y, z = (hand - robot.base).T
        reach = np.hypot(y, z)
        bend = np.arccos(np.clip((reach**2 - 0.405) / 0.405, -1.0, 1.0))
        first = np.arctan2(z, y) - np.arctan2(0.45 * np.sin(bend), 0.45 + 0.45 * np.cos(bend))
        led.append(dataclasses.replace(t, robot_q=np.column_stack([first, bend])))
    both = data.replace(model=MODEL.replace(robot=robot), trials=tuple(led))
    assert hand_meets_handle(both)
    assert not hand_meets_handle(without(both))


def test_the_columns_are_written_read_and_warned_of(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = session()
    armrs.write_dataset(data, tmp_path / "s")
    again = armrs.load_dataset(tmp_path / "s")
    assert again.trials[0].base is not None and np.allclose(again.trials[0].base, data.trials[0].base)  # type: ignore[arg-type]
    assert any("the first joint, and so the trunk, moves by 7" in line for line in again.warnings)
    assert cli.main(["identify", str(tmp_path / "s"), "-o", str(tmp_path / "i"), "--json", str(tmp_path / "i.json")]) in (0, 1)
    assert json.loads((tmp_path / "i.json").read_text())["parameters"]
    assert cli.main(["check", str(tmp_path / "s")]) in (0, 1)
    assert "the trunk, moves by" in capsys.readouterr().out


HEAVE = (0.01, -0.03, 0.31)
"""Amplitudes [m] and frequency [Hz]."""


STEP = 4e-4
"""Of MuJoCo [s]."""
CARRIED = 1e6
"""Mass of the base [kg], so large that the arm does not move it."""
ROBOT = armrs.Robot((0.45, 0.45), (1.05, -0.10))


def heaving(number: int, role: str) -> Trial:
    """Return a trial of an arm on springs of 4 kN/m in MuJoCo, on a base that heaves along a measured path."""
    world = mujoco.MjModel.from_xml_string(WORLD)
    world.opt.timestep, world.opt.integrator = STEP, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    world.dof_damping[2:], world.body_mass[1] = VISCOSITY, CARRIED
    data, site = mujoco.MjData(world), world.site("hand").id
    time = np.arange(-5000, 20_000) * STEP
    way = np.clip(time / 6.0, 0.0, 1.0)
    turn = np.sin(2.0 * np.pi * way**3 * (10.0 - 15.0 * way + 6.0 * way**2))
    angles = np.column_stack([-0.9 + 0.2 * turn * (1 + number % 2), 1.3 - 0.3 * turn])
    handle = armrs.Arm.from_model(MODEL).forward_kinematics(angles)[:, :2]
    speed = np.gradient(handle, STEP, axis=0)
    omega, amplitude = 2.0 * np.pi * HEAVE[2], np.array(HEAVE[:2])
    swing = np.sin(omega * time + 0.7 * number)[:, None] * amplitude
    swinging = omega * np.cos(omega * time + 0.7 * number)[:, None] * amplitude
    rows, jacobian = [], np.zeros((3, 4))
    data.qpos[2:] = angles[0]
    for k in range(len(time)):
        data.qpos[:2], data.qvel[:2] = swing[k], swinging[k]
        mujoco.mj_fwdPosition(world, data)
        mujoco.mj_jacSite(world, data, jacobian, None, site)
        force = 4000.0 * (handle[k] - data.site_xpos[site][1:]) + 30.0 * (speed[k] - (jacobian @ data.qvel)[1:])
        if time[k] >= 0.0 and k % 25 == 0:
            rows.append([time[k], *data.qpos[2:], *force, *data.qpos[:2], *handle[k]])
        data.qfrc_applied[:] = jacobian[1:].T @ force
        data.qfrc_applied[:2] = CARRIED * (-(omega**2) * swing[k] + [0.0, 9.81])
        mujoco.mj_step(world, data)
    table = np.array(rows)
    noise = np.random.default_rng(number).standard_normal((len(table), 6)) * [4e-4, 4e-4, 0.05, 0.05, 2e-4, 2e-4]
    y, z = (table[:, 7:9] - ROBOT.base).T
    bend = np.arccos((y**2 + z**2 - 0.405) / 0.405)
    first = np.arctan2(z, y) - np.arctan2(0.45 * np.sin(bend), 0.45 + 0.45 * np.cos(bend))
    seen = table[:, 1:7] + noise
    return Trial(
        f"trials/m{number % 2}_{number}.csv", f"m{number % 2}", number + 1, role, table[:, 0], seen[:, :2], force_on_arm=seen[:, 2:4],
        robot_q=np.column_stack([first, bend]), base=seen[:, 4:],
    )  # fmt: skip


@pytest.fixture(scope="module")
def led() -> Dataset:
    """Two movements, three times each to fit and once to test, of an arm of which all is known but the viscosity of its joints."""
    model = MODEL.replace(robot=ROBOT, contact=armrs.Contact(stiffness=(4000.0, 4000.0), damping=(30.0, 30.0)), segment_uncertainty=0.02)
    trials = tuple(heaving(k, "fit" if k < 6 else "test") for k in range(8))
    return Dataset("heaving", model, trials)


def test_a_led_arm_follows_the_path(led: Dataset) -> None:
    """The closed chain is simulated on the base as it moves: MuJoCo's arm within what its sensors scatter."""
    joints = tuple(j.replace(viscosity=v) for j, v in zip(MODEL.joints, VISCOSITY, strict=True))
    model, drive = led.model.replace(joints=joints), led.trials[0]
    off, blind = (
        np.column_stack([run.q - drive.q[: len(run.q)], run.force_on_arm - drive.force_on_arm[: len(run.q)]]).std(axis=0)  # type: ignore[index]
        for run in (armrs.simulate(model, d, rate=100.0) for d in (drive, dataclasses.replace(drive, base=None)))
    )
    assert (off[:2] < 6e-4).all() and (off[2:] < 0.08).all()
    assert (blind[:2] > 10.0 * off[:2]).all()


def test_the_gap_is_asked_on_the_base_as_it_moves(led: Dataset) -> None:
    found = armrs.find_gap(led, separate=False)
    assert sorted((e.kind, e.joint) for e in found.effects) == [("viscous", 1), ("viscous", 2)]
    assert found.verdict == "explained"
    for e in found.effects:
        value = e.parameters["viscosity"]
        assert value.interval[0] <= VISCOSITY[e.joint - 1] <= value.interval[1]


@pytest.mark.parametrize(
    "ask",
    [
        lambda d: armrs.identify(d, method="cascade"),
        lambda d: armrs.identify(d, motion="simulated"),
    ],
)
def test_who_cannot_follow_the_path_says_so(ask: object) -> None:
    with pytest.raises(BadInput, match="columns by, bz: found a first joint that moves"):
        ask(session())  # type: ignore[operator]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (",by_m,bz_m", ",by_m,bx_m", "bx_m"),
        (",by_m,bz_m", ",by_m,bz_km", "bz_m, bz_mm, bz_cm"),
        (",by_m,bz_m", ",by_m,emg_x", "both coordinates of the first joint or none"),
    ],
)
def test_bad_columns_are_refused(old: str, new: str, message: str, tmp_path: Path) -> None:
    armrs.write_dataset(session(), tmp_path)
    file = tmp_path / "trials" / "t0.csv"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    with pytest.raises(BadInput, match=message):
        armrs.load_dataset(tmp_path)
