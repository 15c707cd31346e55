"""Set-valued dry friction is solved for: against MuJoCo's `frictionloss`, against half the step, and what a run says of its own accuracy."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs.cli import main

LENGTHS, MASSES, COMS, INERTIAS = (0.322, 0.264), (2.114, 1.264), (0.186, 0.121), (0.0165, 0.0074)
FRICTION = (2.0, 0.5)
VISCOSITY = 0.05


def written(folder: Path, effects: str) -> Path:
    """Write a model of two segments with given effects."""
    segments = "".join(
        f'[[arm.segment]]\nname = "s{k}"\nlength = {LENGTHS[k]}\nmass = {MASSES[k]}\ncom = {COMS[k]}\ninertia = {INERTIAS[k]}\n'
        for k in range(2)
    )
    path = folder / "model.toml"
    path.write_text(f"[arm]\n{segments}[[arm.joint]]\n[[arm.joint]]\n{effects}")
    return path


def effect(kind: str, joint: int, **values: float) -> str:
    """Return the table of an effect."""
    return f'[[effect]]\nkind = "{kind}"\njoint = {joint}\n' + "".join(f"{name} = {value}\n" for name, value in values.items())


def mujoco_swing(start: tuple[float, float], duration: float, dt: float) -> np.ndarray:
    """Let MuJoCo's arm with `frictionloss` fall; angles every 10 ms."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install mujoco")

    def body(k: int, inside: str) -> str:
        at = "0 0 0" if k == 0 else f"{LENGTHS[0]} 0 0"
        inertia = f"{INERTIAS[k]} {INERTIAS[k]} {INERTIAS[k]}"
        return (
            f'<body pos="{at}"><joint type="hinge" axis="0 -1 0" frictionloss="{FRICTION[k]}" damping="{VISCOSITY}"'
            f' solimpfriction="0.9999 0.9999 0.001 0.5 2" solreffriction="{2 * dt} 1"/>'
            f'<inertial pos="{COMS[k]} 0 0" mass="{MASSES[k]}" diaginertia="{inertia}"/>{inside}</body>'
        )

    world = (
        f'<mujoco><option timestep="{dt}" integrator="implicitfast" gravity="0 0 -9.81" tolerance="1e-14" iterations="200"/>'
        f"<worldbody>{body(0, body(1, ''))}</worldbody></mujoco>"
    )
    model = mujoco.MjModel.from_xml_string(world)
    data = mujoco.MjData(model)
    data.qpos[:] = start
    every = round(0.01 / dt)
    angles = [data.qpos.copy()]
    for _ in range(round(duration / 0.01)):
        mujoco.mj_step(model, data, nstep=every)
        angles.append(data.qpos.copy())
    return np.array(angles)


def test_an_arm_falls_swings_and_sticks_as_in_mujoco(tmp_path: Path) -> None:
    """MuJoCo's friction is a soft constraint of first order: it comes nearer with its step."""
    start = (-0.4, 0.9)
    effects = "".join(
        effect("coulomb", k + 1, torque=FRICTION[k], smoothing=0.0) + effect("viscous", k + 1, viscosity=VISCOSITY) for k in range(2)
    )
    run = armrs.simulate(written(tmp_path, effects), None, start=np.array(start), start_speed=np.zeros(2), duration=4.0, rate=100.0)
    coarse, fine = (np.abs(mujoco_swing(start, 4.0, dt) - run.q).max() for dt in (1e-4, 2.5e-5))
    print(f"MuJoCo differs by {coarse:.2e} rad at 0.1 ms, {fine:.2e} rad at 0.025 ms")
    assert np.ptp(run.q[:, 0]) > 0.5
    assert np.all(run.qd[-1] == 0.0), "it sticks"
    assert fine < np.radians(0.05)
    assert fine < 0.5 * coarse


STRONG = {
    "load_friction": [("load_friction", 1, {"coefficient": 0.18}), ("load_friction", 2, {"coefficient": 0.18})],
    "load_friction bound": [("load_friction", 1, {"coefficient": 0.2}), ("load_friction", 2, {"coefficient": 0.2})],
    "coulomb": [("coulomb", 1, {"torque": 5.0}), ("coulomb", 2, {"torque": 5.0})],
    "stribeck": [("stribeck", 1, {"torque": 5.0}), ("stribeck", 2, {"torque": 5.0})],
    "thixotropy": [("thixotropy", 1, {"friction": 5.0}), ("thixotropy", 2, {"friction": 5.0})],
}


@pytest.mark.long
@pytest.mark.parametrize("name", STRONG)
@pytest.mark.parametrize("engine", ["native", "rapier"])
def test_strong_friction_does_not_depend_on_the_step(tmp_path: Path, name: str, engine: str) -> None:
    """The models that printed 891 N for 369 N: the default step against one of a tenth, or a refusal that says why."""
    path = written(tmp_path, "".join(effect(kind, joint, **values, smoothing=0.0) for kind, joint, values in STRONG[name]))
    movement = armrs.Movement(np.radians([[-60, 60], [-48, 60], [-60, 72]]), speed=1.0, acceleration=4.0)
    try:
        runs = [armrs.simulate(path, movement, engine=engine, dt=dt) for dt in (0.25e-3, 0.025e-3)]
    except armrs.SimulationError as error:
        assert "no unique solution" in str(error)
        return
    usual, fine = runs
    size = np.hypot(*fine.force_on_arm.T).max()
    force = np.hypot(*(usual.force_on_arm - fine.force_on_arm).T).max()
    angle = np.degrees(np.abs(usual.q - fine.q).max())
    print(f"{name}, {engine}: {force:.3g} of {size:.4g} N, {angle:.2g}°")
    if engine == "native":
        assert not usual.warnings
        assert force < 0.01 * size
        assert angle < 0.01
    else:
        assert any("rapier does not locate" in line for line in usual.warnings)


def test_rapier_with_set_valued_friction_is_compared_with_half_the_step(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its switches are of first order: the command compares with half the step without being asked."""
    path = written(tmp_path, "".join(effect(kind, joint, **values, smoothing=0.0) for kind, joint, values in STRONG["coulomb"]))
    movement = tmp_path / "movement.toml"
    movement.write_text("[movement]\nwaypoints_deg = [[-60, 60], [-48, 60], [-60, 72]]\nspeed_rad_s = 1.0\nacceleration_rad_s2 = 4.0\n")
    status = main(["simulate", str(path), "--movement", str(movement), "--engine", "rapier", "--json", "-"])
    printed = capsys.readouterr()
    halved = json.loads(printed.out)["half_step"]
    assert max(halved["angle_share"], halved["force_share"]) < 1e-3
    assert status == 0
    assert "rapier does not locate" in printed.err


@pytest.mark.parametrize("name", STRONG)
def test_smooth_friction_too_steep_for_the_step_ends_with_status_1(tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    """With a step that is asked for: the force was off by up to twice its size, with status 0."""
    path = written(tmp_path, "".join(effect(kind, joint, **values, smoothing=0.012) for kind, joint, values in STRONG[name]))
    movement = tmp_path / "movement.toml"
    movement.write_text("[movement]\nwaypoints_deg = [[-60, 60], [-48, 60], [-60, 72]]\nspeed_rad_s = 1.0\nacceleration_rad_s2 = 4.0\n")
    status = main(["simulate", str(path), "--movement", str(movement), "--dt", "0.00025", "--json", "-"])
    printed = capsys.readouterr()
    assert json.loads(printed.out)["half_step"]["force_share"] > 0.01
    assert status == 1
    assert "smoothing = 0" in printed.err


@pytest.mark.parametrize("name", ["coulomb", "stribeck", "thixotropy"])
def test_friction_too_steep_for_the_usual_step_sticks_by_default(tmp_path: Path, name: str) -> None:
    """It is chosen before the run, whatever the step, and the run says so; a sixteenth of the step and more was needed."""
    way = np.radians([[-60, 60], [-48, 60], [-60, 72]])
    movement = armrs.Movement(way, speed=1.0, acceleration=4.0)
    path = written(tmp_path, "".join(effect(kind, joint, **values) for kind, joint, values in STRONG[name]))
    usual, fine = (armrs.simulate(path, movement, dt=dt) for dt in (None, 0.25e-3 / 20))
    angle, force = judged(usual, fine)
    assert usual.settings["dt_s"] == 0.25e-3
    assert usual.model.effects[-1].parameters["smoothing"] == 0.0
    assert not usual.warnings
    assert angle < 0.01
    assert force < 0.01


def test_the_friction_that_a_joint_states_sticks_too(tmp_path: Path) -> None:
    """Only where it is too steep: the other joint keeps its key."""
    model = armrs.load_model(written(tmp_path, ""))
    first, second = model.joints
    stated = model.replace(joints=(first.replace(coulomb=0.02), second.replace(coulomb=5.0)))
    start = {"start": np.array([-0.4, 0.9]), "start_speed": np.zeros(2), "duration": 0.3}
    run = armrs.simulate(stated, None, **start)
    assert [joint.coulomb for joint in run.model.joints] == [0.02, 0.0]
    assert [(e.kind, e.joint, dict(e.parameters)) for e in run.model.effects] == [("coulomb", 2, {"torque": 5.0, "smoothing": 0.0})]
    assert np.all(run.q[:, 1] == 0.9)


def judged(run: armrs.Simulated, fine: armrs.Simulated) -> tuple[float, float]:
    """Return the largest difference of angles [deg] and of the force as a share of the largest."""
    angle = np.degrees(np.abs(run.q - fine.q).max())
    return float(angle), float(np.hypot(*(run.force_on_arm - fine.force_on_arm).T).max() / np.hypot(*fine.force_on_arm.T).max())


@pytest.mark.long
@pytest.mark.parametrize("name", STRONG)
def test_without_a_step_one_is_taken_that_follows_the_friction(tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str) -> None:
    """`armrs simulate` printed 1126 N for 336 N."""
    path = written(tmp_path, "".join(effect(kind, joint, **values, smoothing=0.012) for kind, joint, values in STRONG[name]))
    way = np.radians([[-60, 60], [-48, 60], [-60, 72]])
    usual = armrs.simulate(path, armrs.Movement(way, speed=1.0, acceleration=4.0))
    fine = armrs.simulate(path, armrs.Movement(way, speed=1.0, acceleration=4.0), dt=usual.settings["dt_s"] / 4)
    angle, force = judged(usual, fine)
    assert usual.settings["dt_s"] < 0.25e-3
    assert angle < 0.01
    assert force < 0.01
    movement = tmp_path / "movement.toml"
    movement.write_text("[movement]\nwaypoints_deg = [[-60, 60], [-48, 60], [-60, 72]]\nspeed_rad_s = 1.0\nacceleration_rad_s2 = 4.0\n")
    assert main(["simulate", str(path), "--movement", str(movement), "--json", "-"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["digest"] == usual.digest


def random_arm(rng: np.random.Generator, joints: int) -> tuple[str, armrs.Movement]:
    """Return a model whose smooth friction reaches the bounds of the catalogue, and a movement."""
    shrink = (1.0, 0.8, 0.35)
    text = "[arm]\n"
    for k in range(joints):
        length, mass = shrink[k] * rng.uniform(0.25, 0.36), shrink[k] * rng.uniform(1.0, 2.5)
        com, inertia = length * rng.uniform(0.4, 0.6), mass * length**2 * rng.uniform(0.06, 0.12)
        text += f'[[arm.segment]]\nname = "s{k}"\nlength = {length}\nmass = {mass}\ncom = {com}\ninertia = {inertia}\n'
    text += "[[arm.joint]]\n" * joints
    start = np.array([-60.0, 60.0, 5.0])[:joints] + rng.uniform(-15.0, 15.0, joints)
    path = np.radians([start, start + rng.uniform(-25.0, 25.0, joints)])

    def spread(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    for k in range(joints):
        rest = path[0, k]
        text += effect("viscous", k + 1, viscosity=rng.uniform(0.02, 0.3)) + effect(
            "elastic", k + 1, stiffness=rng.uniform(0.5, 4.0), rest=rest
        )
        text += (
            "",
            effect("coulomb", k + 1, torque=spread(0.02, 100.0)),
            effect("stribeck", k + 1, torque=spread(0.02, 100.0), speed=spread(0.01, 1.0)),
            effect("load_friction", k + 1, coefficient=spread(1e-3, 1.0)),
            effect("thixotropy", k + 1, friction=spread(0.02, 100.0), stiffness=rng.uniform(0.0, 2.0), rest=rest),
        )[rng.integers(5)]
    return text, armrs.Movement(path, speed=1.5, acceleration=6.0)


@pytest.mark.long
def test_no_run_with_smooth_friction_is_wrong_in_silence(tmp_path: Path) -> None:
    """Random arms without a step against a twentieth of 0.25 ms, or a quarter of what is taken; arms = 200: docs/conventions.md."""
    arms = 12
    counts = {"refused": 0, "wrong, warned": 0, "wrong, silent": 0, "right, warned": 0, "right, silent": 0}
    rng = np.random.default_rng(11)
    path = tmp_path / "model.toml"
    for k in range(arms):
        text, movement = random_arm(rng, 2 + k % 2)
        path.write_text(text)
        try:
            usual = armrs.simulate(path, movement)
            fine = armrs.simulate(path, movement, dt=min(0.25e-3 / 20, usual.settings["dt_s"] / 4))
        except armrs.SimulationError:
            counts["refused"] += 1
            continue
        angle, force = judged(usual, fine)
        wrong = "wrong" if angle > 0.01 or force > 0.01 else "right"
        counts[f"{wrong}, {'warned' if usual.warnings else 'silent'}"] += 1
    print(counts)
    assert counts["wrong, silent"] == 0
    assert counts["right, silent"] >= 0.7 * arms


def test_a_run_that_loses_energy_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Semi-implicit Euler at a coarse step: a warning, and status 1 from 1 %; half the step tells too."""
    path = written(tmp_path, effect("viscous", 1, viscosity=0.2) + effect("viscous", 2, viscosity=0.2))
    movement = tmp_path / "movement.toml"
    movement.write_text("[movement]\nwaypoints_deg = [[-60, 60], [-20, 110], [-60, 60]]\nspeed_rad_s = 3.0\nacceleration_rad_s2 = 30.0\n")
    asked = ["simulate", str(path), "--movement", str(movement), "--json", "-"]
    assert main([*asked, "--check-step"]) == 0
    good = json.loads(capsys.readouterr().out)
    assert good["energy"]["error_share"] < 1e-6
    assert good["half_step"]["angle_share"] < 1e-3
    status = main([*asked, "--integrator", "euler", "--dt", "0.005", "--check-step"])
    printed = capsys.readouterr()
    bad = json.loads(printed.out)
    assert bad["energy"]["error_share"] > 0.01 or bad["half_step"]["force_share"] > 0.01
    assert status == 1
    assert "take a shorter step" in printed.err


@pytest.mark.parametrize("motion", ["measured", "simulated"])
def test_a_joint_that_rests_under_load_does_not_bend_its_friction(tmp_path: Path, motion: str) -> None:
    """One joint moves and the other is held by its friction: rows that took this for no friction read 0.176 ± 0.003 N m for 0.161."""
    torques, viscosity, step = (0.139, 0.161), 0.05, np.radians(20.0)
    effects = "".join(
        effect("coulomb", k, torque=torque, smoothing=0.0) + effect("viscous", k, viscosity=viscosity)
        for k, torque in enumerate(torques, 1)
    )
    arm = armrs.load_model(written(tmp_path, effects)).replace(robot=armrs.Robot((0.45, 0.45), base=(1.0, -0.1)))
    trials = []
    for name, posture in (("low", (-60.0, 60.0)), ("high", (-20.0, 80.0))):
        way = np.radians(posture) + step * np.array([[0, 0], [1, 0], [0, 0], [-1, 0], [0, 0], [0, 1], [0, 0], [0, -1], [0, 0]])
        movement = armrs.Movement(way, speed=0.5, acceleration=2.0, pause=0.5, shape="smooth")
        run = armrs.simulate(arm, movement, rate=100.0, sensors=armrs.Sensors(rate=100.0), seeds=[0, 1])
        for repeat, read in enumerate(run.readings, start=1):
            columns = {column: getattr(read, column) for column in ("q", "force_on_arm", "robot_q")}
            trials.append(armrs.Trial(f"{name} {repeat}", name, repeat, "fit", read.time, **columns))
    halved = [
        e.replace(parameters={**e.parameters, next(iter(e.parameters)): 0.5 * next(iter(e.parameters.values()))}) for e in arm.effects
    ]
    guess = arm.replace(effects=tuple(halved), segment_uncertainty=0.05)
    found = armrs.identify(armrs.Dataset("one joint at a time", guess, tuple(trials), synthetic=True), motion=motion, with_effects=())
    friction = {e.joint: e for e in found.parameters if e.kind == "coulomb"}
    for joint, torque in enumerate(torques, start=1):
        assert friction[joint].value == pytest.approx(torque, rel=0.02)
        assert abs(friction[joint].value - torque) < 4.0 * friction[joint].std
    # At rest the friction takes whatever the model leaves: what is shown there is what was measured.
    assert found.residual_rms["fit"]["tau1_Nm"] < 0.02 * np.std(found.explained[0].measured[:, 0])
    assert np.abs(found.explained[0].measured[0]).max() > 1.0


def own(law: Callable[..., np.ndarray]) -> None:
    """Declare a law of one parameter."""
    armrs.own_effect(
        "for the test of friction",
        law,
        [armrs.Parameter("size", "N m", 0.0, 5.0, 0.0), armrs.Parameter("shape", "", 0.1, 2.0, 1.0, linear=False)],
    )


def swing(path: Path) -> armrs.Simulated:
    """Let the arm swing for a moment."""
    return armrs.simulate(path, None, start=np.array([-0.5, 0.2]), start_speed=np.zeros(2), duration=0.1, rate=100.0)


def test_a_law_that_failed_once_is_asked_again(tmp_path: Path) -> None:
    """A failure was kept as the answer for its shape until the process ended."""
    fails = [False]

    def law(q: np.ndarray, qd: np.ndarray, size: float, shape: float) -> np.ndarray:
        if fails[0]:
            raise ValueError("the data base is away")
        return size * np.tanh(qd / shape)

    own(law)
    path = written(tmp_path, effect("for the test of friction", 1, size=0.5, shape=0.7))
    fails[0] = True
    with pytest.raises(ValueError, match="the data base is away"):
        swing(path)
    fails[0] = False
    assert np.isfinite(swing(path).q).all()


def test_a_law_may_simulate_but_not_itself(tmp_path: Path) -> None:
    """The law of one arm from the run of another; with itself it would never end."""
    other = tmp_path / "other"
    other.mkdir()
    plain = written(other, effect("viscous", 1, viscosity=0.3))
    path = written(tmp_path, effect("for the test of friction", 1, size=0.5, shape=0.8))
    asked = [plain]

    def law(q: np.ndarray, qd: np.ndarray, size: float, shape: float) -> np.ndarray:
        return size * float(np.abs(swing(asked[0]).q).max()) * qd

    own(law)
    assert np.isfinite(swing(path).q).all()
    own(law)
    asked[0] = path
    with pytest.raises(armrs.BadInput, match="simulates an arm with this effect"):
        swing(path)


LABORATORY = """
[subject]
body_mass = 75.0
height = 1.75
sex = "male"

[[joint]]
coulomb = 0.05

[[joint]]
coulomb = {coulomb}

[[movement]]
waypoints_deg = [[-60, 60], [-50, 60], [-60, 60]]
speed_rad_s = 0.4
acceleration_rad_s2 = 2.0
repeats = 1
"""


@pytest.mark.parametrize(("coulomb", "says"), [(3.0, True), (0.05, False)])
def test_record_and_sweep_say_when_friction_is_set_valued(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], coulomb: float, says: bool
) -> None:
    """As `simulate` does: what is recorded has another law than the experiment states."""
    (tmp_path / "experiment.toml").write_text(LABORATORY.format(coulomb=coulomb), encoding="utf-8")
    (tmp_path / "sweep.toml").write_text('experiment = "experiment.toml"\ncases = 1\n', encoding="utf-8")
    for line in (["record", "experiment.toml"], ["sweep", "sweep.toml", "--jobs", "1"]):
        capsys.readouterr()
        assert main([line[0], str(tmp_path / line[1]), *line[2:], "-o", str(tmp_path / line[0])]) in (0, 1)
        said = capsys.readouterr().err
        assert ("coulomb in joint 2: with the default smoothing too steep" in said) == says, said
