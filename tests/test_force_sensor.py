"""The six-axis force sensor of the virtual laboratory: its physics against MuJoCo and by hand, and what a laboratory makes of its readings."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armrs
from armrs import BadInput, Robot
from armrs.cli import main
from armrs.workflows.experiment import load_experiment
from armrs.workflows.force_sensor import CHANNELS, RobotMotion, SixAxis
from armrs.workflows.record import Measured, measure
from test_docs import DOCS, blocks

ROBOT = Robot(lengths=(0.45, 0.40), base=(1.05, -0.10))
RIG = (ROBOT, 9.81)
SILENT: dict[str, Any] = {"noise_N": (0.0,) * 3, "noise_Nm": (0.0,) * 3, "bits": 52}
"""Of a sensor that adds nothing: its bits are 5e-14 N."""
TOOL: dict[str, Any] = {"handle_m": (0.10, 0.02), "tool_mass_kg": 0.5, "tool_com_m": (0.06, -0.01), "tool_inertia_kg_m2": 0.002}


def motion(seed: int, n: int = 20) -> RobotMotion:
    draw = np.random.default_rng(seed)
    return RobotMotion(np.arange(n) / 50.0, *(scale * draw.standard_normal((n, 2)) for scale in (1.0, 3.0, 20.0)))


def resting(*q: float) -> RobotMotion:
    return RobotMotion(np.arange(2) / 50.0, np.tile(q, (2, 1)), np.zeros((2, 2)), np.zeros((2, 2)))


def read(sensor: SixAxis, moved: RobotMotion, force: Any) -> np.ndarray:
    return sensor.read(RIG, moved, np.broadcast_to(force, (len(moved.t), 2)), np.random.default_rng(7))


def test_a_moving_tool_under_load_reads_as_in_mujoco() -> None:
    """MuJoCo's sensors of force and torque at a site between two bodies, of which the tool is accelerated and pulled at its handle."""
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install mujoco")
    sensor, moved = SixAxis(**TOOL, **SILENT), motion(3)
    force = 20.0 * np.random.default_rng(4).standard_normal((20, 2))
    (h_x, h_y), (c_x, c_y), link = sensor.handle_m, sensor.tool_com_m, '<inertial pos="0.2 0 0" mass="3" diaginertia="0.1 0.1 0.1"/>'
    model = mujoco.MjModel.from_xml_string(f"""
        <mujoco><option gravity="0 -9.81 0"/><worldbody><body pos="{ROBOT.base[0]} {ROBOT.base[1]} 0"><joint axis="0 0 1"/>{link}
        <body pos="{ROBOT.lengths[0]} 0 0"><joint axis="0 0 1"/>{link}
        <body name="tool" pos="{ROBOT.lengths[1] - h_x} {-h_y} 0"><site name="sensor"/>
        <inertial pos="{c_x} {c_y} 0" mass="0.5" diaginertia="0.002 0.002 0.002"/></body></body></body></worldbody>
        <sensor><force site="sensor"/><torque site="sensor"/></sensor></mujoco>""")
    data, tool = mujoco.MjData(model), mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, "tool")
    expected = []
    for q, qd, qdd, (f_x, f_y) in zip(moved.q, moved.qd, moved.qdd, force, strict=True):
        data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q, qd, 0.0
        mujoco.mj_forward(model, data)
        arm = data.xmat[tool].reshape(3, 3)[:2, :2] @ [h_x - c_x, h_y - c_y]
        data.xfrc_applied[tool] = [f_x, f_y, 0.0, 0.0, 0.0, arm[0] * f_y - arm[1] * f_x]
        mujoco.mj_forward(model, data)
        moved_by = np.zeros(2)
        mujoco.mj_mulM(model, data, moved_by, qdd - data.qacc)
        data.qfrc_applied[:] = moved_by
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(data.qacc, qdd, atol=1e-9)
        expected.append(data.sensordata.copy())
    assert np.abs(expected).max(axis=0)[[0, 1, 5]].min() > 2.0
    # MuJoCo tells what the link does to the tool.
    np.testing.assert_allclose(read(sensor, moved, force), -np.array(expected), atol=1e-9)


@pytest.mark.parametrize(
    ("q", "force", "expected"),
    [
        # The last link forward: weight and force act across it, at 0.06 m and 0.10 m.
        ((0.7, -0.7), (0.0, -20.0), [0.0, -20.0 - 4.905, 0.0, 0.0, 0.0, -0.10 * 20.0 - 0.06 * 4.905]),
        # Upwards: both along it, and a force forward is on its other side.
        ((0.7, np.pi / 2 - 0.7), (5.0, -20.0), [-20.0 - 4.905, -5.0, 0.0, 0.0, 0.0, -0.10 * 5.0]),
    ],
)
def test_a_resting_tool_by_hand(q: tuple[float, float], force: tuple[float, float], expected: list[float]) -> None:
    sensor = SixAxis((0.10, 0.0), 0.5, (0.06, 0.0), **SILENT)
    np.testing.assert_allclose(read(sensor, resting(*q), force), [expected] * 2, atol=1e-12)


def test_a_tool_that_turns_pulls_outwards() -> None:
    """At 2 rad/s, 0.45 + 0.40 − 0.10 + 0.06 m from the first axis: m ω² r of its 0.5 kg."""
    turning = RobotMotion(np.zeros(1), np.zeros((1, 2)), np.array([[2.0, 0.0]]), np.zeros((1, 2)))
    wrench = SixAxis((0.10, 0.0), 0.5, (0.06, 0.0), **SILENT).read((ROBOT, 0.0), turning, np.zeros((1, 2)), np.random.default_rng(1))
    np.testing.assert_allclose(wrench, [[0.5 * 4.0 * 0.81, 0.0, 0.0, 0.0, 0.0, 0.0]], atol=1e-12)


def test_an_exact_tool_gives_the_contact_force_back() -> None:
    sensor, moved = SixAxis(**TOOL, **SILENT), motion(5)
    force = 20.0 * np.random.default_rng(6).standard_normal((20, 2))
    np.testing.assert_allclose(sensor.force_on_robot(RIG, moved, read(sensor, moved, force)), force, atol=1e-9)


def test_crosstalk_bias_and_drift_by_hand() -> None:
    """A moment of 2.2 N m is a fifth of its range: 2 % of that of Fy are 0.44 N, and half of the gain error of Mz 0.11 N m."""
    crosstalk = np.zeros((6, 6))
    crosstalk[1, 5], crosstalk[5, 5], crosstalk[2, 1] = 0.02, 0.05, 0.01
    errors = {"crosstalk": crosstalk.tolist(), "bias_N": (0.0, 0.0, 0.3), "drift_Nm_s": (0.5, 0.0, 0.0)}
    sensor = SixAxis((0.10, 0.0), 0.0, (0.0, 0.0), **SILENT, **errors)
    wrench = read(sensor, resting(0.0, 0.0), (0.0, 22.0))
    np.testing.assert_allclose(wrench[0], [0.0, 22.44, 0.3 + 0.22, 0.0, 0.0, 2.2 + 0.11], atol=1e-12)
    np.testing.assert_allclose(wrench[1] - wrench[0], [0.0, 0.0, 0.0, 0.5 / 50.0, 0.0, 0.0], atol=1e-12)


def test_noise_bits_and_range_of_each_channel() -> None:
    still = RobotMotion(np.arange(20_000) / 50.0, *(np.zeros((20_000, 2)) for _ in range(3)))
    noise = {"noise_N": (0.1, 0.2, 0.3), "noise_Nm": (0.01, 0.02, 0.03)}
    wrench = read(SixAxis((0.1, 0.0), 0.0, (0.0, 0.0), **noise, bits=16), still, (0.0, 0.0))
    # A deviation of 20 000 samples is known to 0.5 %; 3 % are six of those.
    np.testing.assert_allclose(wrench.std(axis=0), [0.1, 0.2, 0.3, 0.01, 0.02, 0.03], rtol=0.03)
    steps = wrench / (2.0 * np.array([110.0] * 3 + [11.0] * 3) / 2**16)
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6)
    sensor = SixAxis((0.1, 0.0), 0.0, (0.0, 0.0), **SILENT)
    over = read(sensor, resting(0.0, 0.0), (0.0, -150.0))
    assert over[0].tolist() == [0.0, -110.0, 0.0, 0.0, 0.0, -11.0]
    assert sensor.saturated(over) == {"Fy_N": 2, "Mz_Nm": 2}


EXPERIMENT = """\
seed = 3

[subject]
body_mass = 77.0
height = 1.80
sex = "male"

[sensors]
rate_Hz = 100.0

[sensors.six_axis]
handle_m = [0.10, 0.02]
tool_mass_kg = 0.5
tool_com_m = [0.06, -0.01]

[[movement]]
configuration = "slow"
waypoints_deg = [[-60, 60], [-48, 60], [-60, 72], [-60, 60]]
speed_rad_s = 0.4
pause_s = 0.5
shape = "smooth"
repeats = 2
tests = 1
"""
NO_NOISE = "noise_N = [0, 0, 0]\nnoise_Nm = [0, 0, 0]\nbits = 52\n"


@pytest.fixture
def experiment(tmp_path: Path) -> Path:
    path = tmp_path / "EXPERIMENT.toml"
    path.write_text(EXPERIMENT, encoding="utf-8")
    return path


def measured(path: Path, *lines: str) -> Measured:
    """Measure the experiment with more lines in the table of the sensor."""
    path.write_text(EXPERIMENT.replace("[[movement]]", "".join(lines) + "\n[[movement]]"), encoding="utf-8")
    return measure(load_experiment(path))


def test_the_files_are_what_the_force_was_made_of(experiment: Path, tmp_path: Path) -> None:
    """From the raw file, the trial's robot angles and the tool as it was stated, with matrices."""
    armrs.record(experiment, tmp_path / "out")
    trial = armrs.load_dataset(tmp_path / "out").trials[0]
    rows = np.loadtxt(tmp_path / "out" / "wrench" / "slow_1.csv", delimiter=",", skiprows=1)
    head = (tmp_path / "out" / "wrench" / "slow_1.csv").read_text(encoding="utf-8").partition("\n")[0]
    assert head.replace('"', "") == ",".join(["t_s", *CHANNELS])
    np.testing.assert_array_equal(rows[:, 0], trial.t)
    assert trial.robot_q is not None and trial.force_on_arm is not None
    model = load_experiment(experiment).truth
    assert model.robot is not None
    angle = trial.robot_q.sum(axis=1)
    turn = np.stack([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]).transpose(2, 0, 1)
    elbow = model.robot.lengths[0] * np.column_stack([np.cos(trial.robot_q[:, 0]), np.sin(trial.robot_q[:, 0])])
    com = elbow + turn @ np.array([model.robot.lengths[1] - 0.10 + 0.06, -0.02 - 0.01])
    acceleration = np.gradient(np.gradient(com, trial.t, axis=0), trial.t, axis=0)
    force_on_robot = np.einsum("nij,nj->ni", turn, rows[:, 1:3]) - 0.5 * (np.array([0.0, -9.81]) - acceleration)
    # Differences of positions are those of angles up to the third order in 10 ms; nothing else differs.
    np.testing.assert_allclose(-trial.force_on_arm, force_on_robot, atol=2e-3)


def test_an_exact_sensor_reads_the_contact_force(experiment: Path) -> None:
    """But for what differences of the robot's angles at 100 Hz miss of the acceleration of 0.5 kg; other devices read the same bits."""
    trial = measured(experiment, NO_NOISE).dataset.trials[0]
    plain = EXPERIMENT.partition("[sensors.six_axis]")[0] + "force_noise_N = 0.0\nforce_bits = 52\n\n"
    experiment.write_text(plain + EXPERIMENT[EXPERIMENT.index("[[movement]]") :], encoding="utf-8")
    contact = measure(load_experiment(experiment))
    other = contact.dataset.trials[0]
    assert contact.wrench_on_robot == {} and "six_axis" not in contact.trials[0]
    for name in ("t", "q", "robot_q"):
        np.testing.assert_array_equal(getattr(trial, name), getattr(other, name))
    assert trial.force_on_arm is not None and other.force_on_arm is not None
    # 20 mN are 0.04 m/s², an eighth of what the handle is accelerated with.
    np.testing.assert_allclose(trial.force_on_arm, other.force_on_arm, atol=0.02)


def test_a_wrong_mass_of_the_tool_shows_in_the_force(experiment: Path) -> None:
    """100 g too much are 0.981 N at rest: the force on the robot points up by them, that on the arm down."""
    right, wrong = (measured(experiment, NO_NOISE, line).dataset.trials[0] for line in ("", "stated_mass_kg = 0.6\n"))
    assert right.force_on_arm is not None and wrong.force_on_arm is not None and right.robot_q is not None
    still = np.abs(np.gradient(right.robot_q, right.t, axis=0)).max(axis=1) == 0.0
    assert still.sum() > 20
    beside = (wrong.force_on_arm - right.force_on_arm)[still]
    np.testing.assert_allclose(np.median(beside, axis=0), [0.0, -0.981], atol=1e-9)


def test_crosstalk_shows_in_the_force(experiment: Path) -> None:
    rows = "crosstalk = [[0,0,0,0,0,0.03], [0,0.02,0,0,0,0], [0,0,0,0,0,0], [0,0,0,0,0,0], [0,0,0,0,0,0], [0,0,0,0,0,0]]\n"
    right, wrong = measured(experiment, NO_NOISE), measured(experiment, NO_NOISE, rows)
    trials = [session.dataset.trials[0] for session in (right, wrong)]
    assert all(t.force_on_arm is not None and t.robot_q is not None for t in trials)
    true = right.wrench_on_robot["trials/slow_1.csv"]
    angle = trials[0].robot_q.sum(axis=1)  # type: ignore[union-attr]
    along, across = 0.03 * true[:, 5] / 11.0 * 110.0, 0.02 * true[:, 1]
    expected = np.column_stack([along * np.cos(angle) - across * np.sin(angle), along * np.sin(angle) + across * np.cos(angle)])
    assert np.abs(expected).max() > 0.1
    np.testing.assert_allclose(trials[0].force_on_arm - trials[1].force_on_arm, expected, atol=1e-9)  # type: ignore[operator]


def test_a_saturated_channel_is_told(experiment: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    experiment.write_text(EXPERIMENT.replace("[[movement]]", "range_N = [10, 110, 110]\n\n[[movement]]"), encoding="utf-8")
    assert main(["record", str(experiment), "-o", str(tmp_path / "out"), "--json", str(tmp_path / "r.json")]) == 0
    trial = json.loads((tmp_path / "r.json").read_text(encoding="utf-8"))["trials"][0]
    count = trial["six_axis"]["saturated"]["Fx_N"]
    assert list(trial["six_axis"]["saturated"]) == ["Fx_N"]
    line = f"slow 1: the force sensor is at the end of its range: Fx in {count} samples."
    assert line in capsys.readouterr().out
    assert line in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_the_table_of_files_md_is_read_and_its_defaults_are_those_of_the_code(experiment: Path) -> None:
    shown = next(content for _, name, content in blocks(DOCS / "files.md") if name == "of EXPERIMENT.toml")
    head, _, tail = EXPERIMENT.partition("[sensors.six_axis]")
    experiment.write_text(head + shown + tail[tail.index("[[movement]]") :], encoding="utf-8")
    sensor = load_experiment(experiment).devices.six_axis
    assert sensor is not None and (sensor.stated_mass_kg, sensor.stated_com_m) == (0.52, sensor.tool_com_m)
    assert np.array(sensor.crosstalk).nonzero()[0].tolist() == [0, 1]
    text = (DOCS / "files.md").read_text(encoding="utf-8")
    for name in ("noise", "range"):
        force, moment = getattr(sensor, f"{name}_N"), getattr(sensor, f"{name}_Nm")
        assert f"| `{name}_N`, `{name}_Nm` | N, N m | {force[0]:g}, {moment[0]:g} each |" in text
    assert f"| `bits` | | {sensor.bits} |" in text


def test_a_recording_without_the_sensor_replaces_one_with_it(experiment: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    armrs.record(experiment, out)
    assert sorted(path.name for path in (out / "wrench").iterdir()) == [f"slow_{k}.csv" for k in (1, 2, 3)]
    head, _, tail = EXPERIMENT.partition("[sensors.six_axis]")
    experiment.write_text(head + tail[tail.index("[[movement]]") :], encoding="utf-8")
    armrs.record(experiment, out)
    assert not list((out / "wrench").iterdir())


def test_a_handle_that_yields_has_the_sensor_too(experiment: Path) -> None:
    found = measured(experiment, NO_NOISE, '[interaction]\nlaw = "impedance"\nhold_s = 1.0\n')
    trial, (run,) = found.dataset.trials[0], found.interacted["trials/slow_1.csv"]
    contact = np.column_stack([np.interp(trial.t, run.t, c) for c in run.force_on_arm.T])
    assert trial.force_on_arm is not None
    off = np.abs(trial.force_on_arm - contact).max(axis=1)
    assert off[-50:].max() < 5e-3 and off.max() < 0.05
    assert np.abs(found.wrench_on_robot["trials/slow_1.csv"][-1, [0, 1, 5]]).min() > 0.1


def test_such_a_session_is_identified_and_searched(experiment: Path, tmp_path: Path) -> None:
    armrs.record(experiment, tmp_path / "out")
    data = armrs.load_dataset(tmp_path / "out")
    assert armrs.identify(data).status == "solved"
    found = armrs.find_gap(data)
    assert (found.verdict, found.effects) == ("nothing_missing", ())


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("handle_m = [0.10, 0.02]\n", "", r"`handle_m` is missing in \[sensors\.six_axis\]"),
        ("tool_mass_kg", "tool_mass", r"\[sensors\.six_axis\]: found unknown key 'tool_mass', .*nearest known: tool_mass_kg"),
        ("mass_kg = 0.5", "mass_kg = -0.5", r"\[sensors\.six_axis\], tool_mass_kg: found -0\.5, allowed a finite number 0 to 20 kg"),
        ("[0.06, -0.01]", "[60, -10]", r"\[sensors\.six_axis\], tool_com_m\[0\]: found 60\.0, allowed a finite number -1 to 1 m"),
        ("[0.06, -0.01]", "[0.06, -0.01]\nnoise_N = 0.2", r"six_axis\], noise_N: found 0\.2, allowed three numbers: along x, y and z"),
        ("[0.06, -0.01]", "[0.06, -0.01]\nrange_Nm = [1, 1, 0]", r"range_Nm\[2\]: found 0\.0, allowed a finite number 0\.01 to 10000 N m"),
        ("[0.06, -0.01]", "[0.06, -0.01]\nbits = 0", r"six_axis\], bits: found 0, allowed a whole number 1 to 52"),
        (
            "[0.06, -0.01]",
            "[0.06, -0.01]\ncrosstalk = [[0.1]]",
            r"six_axis\], crosstalk: found an array of shape \(1, 1\), allowed shape \(6, 6",
        ),
        (
            "rate_Hz = 100.0",
            "force_bits = 12",
            r"\[sensors\], force_bits: found a value beside six_axis, allowed none: \[sensors\.six_axis\]",
        ),
        (
            "[[movement]]",
            '[[effect]]\nkind = "gravity_tilt"\nangle = 0.1\n\n[[movement]]',
            r"\[sensors\.six_axis\]: found the effect gravity_tilt, allowed none of the frame",
        ),
    ],
)
def test_refuses_a_sensor_that_cannot_be(experiment: Path, old: str, new: str, message: str) -> None:
    assert EXPERIMENT.count(old) == 1
    experiment.write_text(EXPERIMENT.replace(old, new), encoding="utf-8")
    with pytest.raises(BadInput, match=message):
        load_experiment(experiment)
