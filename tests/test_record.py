"""The virtual laboratory: what it measures, what it hides, and the supervisor that stops it."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs import BadInput
from armrs.cli import main
from armrs.workflows.experiment import Controller, load_experiment
from armrs.workflows.record import measure
from conftest import Session

EXPERIMENT = """\
name = "virtual S1"
seed = 3

[subject]
body_mass = 77.0
height = 1.80
sex = "male"
lengths_m = [0.322, 0.30]
spread = 0.5

[[joint]]
coulomb = 0.15

[[joint]]
stiffness = 0.6
rest = 0.9
coulomb = 0.1

[handle]
mass = 0.193

[sensors]
marker_gaps = 0.01
emg = true

[variation]
moment_Nm = [0.05, 0.02]

[[movement]]
configuration = "slow"
waypoints_deg = [[-60, 60], [-48, 60], [-60, 72], [-60, 60]]
speed_rad_s = 0.4
acceleration_rad_s2 = 2.0
shape = "smooth"
repeats = 2
tests = 1
"""


@pytest.fixture
def experiment(tmp_path: Path) -> Path:
    path = tmp_path / "EXPERIMENT.toml"
    path.write_text(EXPERIMENT, encoding="utf-8")
    return path


def test_writes_a_data_set_that_hides_the_truth(experiment: Path, tmp_path: Path) -> None:
    done = armrs.record(experiment, tmp_path / "out")
    data = armrs.load_dataset(tmp_path / "out")
    assert [(t.configuration, t.repeat, t.role) for t in data.trials] == [("slow", 1, "fit"), ("slow", 2, "fit"), ("slow", 3, "test")]
    assert data.synthetic and not done.stopped
    assert [s.length for s in data.model.segments] == pytest.approx([0.322, 0.30], abs=1e-4)
    truth = armrs.load_model(tmp_path / "out" / "truth" / "truth.toml")
    assert [j.coulomb for j in truth.joints] == [0.15, 0.1]
    assert [j.coulomb for j in data.model.joints] == [0.0, 0.0] and data.model.effects == ()
    assert all(abs(a.mass / b.mass - 1) > 1e-3 for a, b in zip(truth.segments, data.model.segments, strict=True))
    story = json.loads((tmp_path / "out" / "truth" / "truth.json").read_text())
    assert story["trials"][0]["moment_Nm"] != story["trials"][1]["moment_Nm"]
    assert max(t["tracking_error_rad"] for t in done.trials) < 2e-4


def test_a_measured_data_set_is_never_replaced(experiment: Path, session: Session, capsys: pytest.CaptureFixture[str]) -> None:
    """It wrote its own dataset.toml and model.toml over those of the laboratory."""
    before = {path: path.read_bytes() for path in session.folder.rglob("*") if path.is_file()}
    assert main(["record", str(experiment), "-o", str(session.folder)]) == 2
    assert "this folder holds a data set that armrs record did not write; choose another -o" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in session.folder.rglob("*") if path.is_file()} == before


def test_a_recording_replaces_the_former_one_whole(experiment: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    armrs.record(experiment, out)
    experiment.write_text(EXPERIMENT.replace('configuration = "slow"', 'configuration = "other"'), encoding="utf-8")
    armrs.record(experiment, out)
    for folder, suffix in (("trials", ".csv"), ("markers", ".trc")):
        assert sorted(path.name for path in (out / folder).iterdir()) == [f"other_{k}{suffix}" for k in (1, 2, 3)]


def test_the_markers_written_show_the_angles_recorded(experiment: Path, tmp_path: Path) -> None:
    done = armrs.record(experiment, tmp_path / "out")
    markers = armrs.read_markers(tmp_path / "out" / "markers" / "slow_1.trc")
    assert np.isnan(markers.positions).any()
    motion = armrs.planar_motion(markers, ["shoulder", "elbow", "handle"], up="z", forward="y")
    np.testing.assert_allclose(motion.q, done.dataset.trials[0].q, atol=1e-12)


def test_markers_move_with_their_segments_and_the_skin_of_the_next_joint(experiment: Path) -> None:
    """They were shifted in the laboratory's frame, as no marker is."""
    asked = load_experiment(experiment)

    def seen(**devices: float) -> tuple[np.ndarray, np.ndarray]:
        exact = dataclasses.replace(asked.devices, **({"marker_noise_m": 0.0, "marker_gaps": 0.0} | devices))
        markers = measure(dataclasses.replace(asked, devices=exact)).markers["trials/slow_1.csv"]
        at = markers.positions[:, :, 1] + 1j * markers.positions[:, :, 2]
        return at, np.angle(np.diff(at, axis=1))

    there, angle = seen()
    # In the frames of trunk, upper arm and forearm.
    turned = np.exp(-1j * np.column_stack([np.zeros(len(angle)), angle]))
    placed, carried = ((seen(**d)[0] - there) * turned for d in ({"marker_offset_m": 0.01}, {"marker_skin_m_rad": 0.01}))
    assert np.abs(placed - placed[0]).max() < 1e-12 < 1e-3 < np.abs(placed[0]).min()
    bent = np.column_stack([angle[:, 0] + 0.5 * np.pi, angle[:, 1] - angle[:, 0]])
    slopes = carried[:, :2] / bent
    assert np.abs(slopes - slopes[0]).max() < 1e-9 < 1e-3 < np.abs(slopes[0]).min() and np.abs(carried[:, 2]).max() < 1e-12


def test_the_same_seed_gives_the_same_bytes(experiment: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        armrs.record(experiment, tmp_path / name)
    files = sorted(p.relative_to(tmp_path / "a") for p in (tmp_path / "a").rglob("*") if p.is_file())
    assert all((tmp_path / "a" / f).read_bytes() == (tmp_path / "b" / f).read_bytes() for f in files)
    other = experiment.with_name("other.toml")
    other.write_text(EXPERIMENT.replace("seed = 3", "seed = 4"), encoding="utf-8")
    armrs.record(other, tmp_path / "c")
    assert (tmp_path / "a" / "trials/slow_1.csv").read_bytes() != (tmp_path / "c" / "trials/slow_1.csv").read_bytes()


def test_clocks_apart_delay_the_angles(experiment: Path, tmp_path: Path) -> None:
    late = experiment.with_name("late.toml")
    late.write_text(EXPERIMENT.replace("emg = true", "clock_offset_s = 0.04").replace("marker_gaps = 0.01\n", ""), encoding="utf-8")
    plain = experiment.with_name("plain.toml")
    plain.write_text(EXPERIMENT.replace("marker_gaps = 0.01\n", ""), encoding="utf-8")
    a, b = (armrs.record(path, tmp_path / path.stem).dataset.trials[0] for path in (late, plain))
    np.testing.assert_array_equal(a.force_on_arm, b.force_on_arm)
    ahead = np.interp(b.t + 0.04, b.t, b.q[:, 0])
    assert np.abs(a.q[:-3, 0] - ahead[:-3]).max() < 5e-3 < np.abs(a.q[:-3, 0] - b.q[:-3, 0]).max()


def test_load_cells_read_the_brakes_and_muscles_their_activity(experiment: Path, tmp_path: Path) -> None:
    text = EXPERIMENT.replace("emg = true", "emg = true\nbrake_noise_Nm = 0.001")
    burst = '[[effect]]\nkind = "voluntary"\njoint = "elbow"\namplitude = 1.0\nstart = 0.5\nduration = 0.4\n\n[[movement]]'
    experiment.write_text(text.replace("[[movement]]", burst), encoding="utf-8")
    trial = armrs.record(experiment, tmp_path / "out").dataset.trials[0]
    assert trial.tau is not None
    assert np.abs(trial.tau).max(axis=0) == pytest.approx([0.15, 0.1], abs=0.01)
    sides = [trial.emg[f"emg_elbow_{side}_uV"] for side in ("flexor", "extensor")]
    during = (trial.t > 0.6) & (trial.t < 0.8)
    assert max(s[during].mean() for s in sides) > 10.0
    assert max(s[~during & ((trial.t < 0.4) | (trial.t > 1.0))].max() for s in sides) < 8.0


def test_load_cells_read_every_dry_law(experiment: Path, tmp_path: Path) -> None:
    """Thixotropy resists beside Coulomb's torque where a movement sets out after a rest, before its structure has broken down."""
    text = EXPERIMENT.replace("emg = true", "brake_noise_Nm = 0.001")
    friction = '[[effect]]\nkind = "thixotropy"\njoint = 1\nfriction = 0.3\nbreakdown = 0.05\nrecovery = 100.0\n\n[[movement]]'
    experiment.write_text(text.replace("[[movement]]", friction), encoding="utf-8")
    trial = armrs.record(experiment, tmp_path / "out").dataset.trials[0]
    assert trial.tau is not None
    # Of the 0.3 N m a part has broken down before the speed is beyond the smoothing; without them there are 0.15 N m.
    assert 0.25 < np.abs(trial.tau[:, 0]).max() < 0.45
    assert np.abs(trial.tau[:, 1]).max() == pytest.approx(0.1, abs=0.01)
    # The structure has gone when the joint is 0.2 rad away, four times the angle of breakdown: e^-4 of 0.3 N m are 0.005.
    assert np.abs(trial.tau[-1, 0]) < 0.16


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ('kind = "runaway"\njoint = 1', "beyond the limit"),
        ('kind = "nan"\njoint = 2', "not finite"),
        ('kind = "late"\ndelay_s = 0.002', "clock runs backwards"),
        ('kind = "force"\nforce_N = [0.0, 140.0]', "beyond the limit"),
        ('kind = "frozen"\njoint = 1', ""),
    ],
)
def test_a_fault_stops_the_trial(experiment: Path, tmp_path: Path, fault: str, reason: str, capsys: pytest.CaptureFixture[str]) -> None:
    experiment.write_text(EXPERIMENT + f"\n[[fault]]\nat_s = 0.3\nrepeat = 2\n{fault}\n", encoding="utf-8")
    assert main(["record", str(experiment), "-o", str(tmp_path / "out"), "--json", str(tmp_path / "r.json")]) == 1
    result = json.loads((tmp_path / "r.json").read_text())
    (stop,) = [t["stop"] for t in result["trials"] if t["stop"]]
    assert reason in stop["reason"] and stop["periods_after_fault"] <= 2 and stop["way_after_stop_m"] < 0.01
    assert len(armrs.load_dataset(tmp_path / "out").trials) == 2
    assert "stopped at 0.3" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("body_mass = 77.0", "", r"\[subject\], body_mass: found nothing, allowed a value"),
        ("body_mass = 77.0", "body_mas = 77.0", r"unknown key 'body_mas', .*nearest known: body_mass"),
        ("height = 1.80", "height = 180.0", r"height: found 180\.0, .*centimetres"),
        ("lengths_m = [0.322, 0.30]", "lengths_m = [0.322]", r"lengths_m: found \[0\.322\], allowed 2 lengths"),
        ("coulomb = 0.15", "coulomb = -1", r"\[\[joint\]\] 1, coulomb: found -1\.0"),
        ("moment_Nm = [0.05, 0.02]", "moment_Nm = [nan, 0.02]", r"\[variation\], moment_Nm: found nan"),
        ("marker_gaps = 0.01", "marker_gaps = 2", r"\[sensors\], marker_gaps: found 2\.0, allowed a finite number 0 to 0\.5"),
        ("emg = true", "force_noise_N = 1e300", r"\[sensors\], force_noise_N: found 1e\+300, allowed a finite number 0 to 100 N"),
        (
            "acceleration_rad_s2 = 2.0",
            "acceleration_rad_s2 = 1e-9",
            r"\[\[movement\]\] 1 \(slow\): found .* s and more, allowed at most 3600 s",
        ),
        ("repeats = 2", "repeats = 0", r"\[\[movement\]\]: found no repeats"),
        (
            'configuration = "slow"',
            'configuration = "../slow"',
            r"\[\[movement\]\] 1, configuration: found '\.\./slow', allowed a name that files",
        ),
        ("seed = 3", "seed = -3", r"seed: found -3, allowed a whole number 0 to"),
        ("[[-60, 60], [-48, 60]", "[[-60, 60], [-48]", r"\[\[movement\]\] 1, movement.waypoints_deg"),
        ("[[-60, 60], [-48, 60]", "[[-60, 60], [90, 0]", r"from the robot's base, allowed"),
        ("[handle]", '[[fault]]\nkind = "fire"\nat_s = 1\n[handle]', r"\[\[fault\]\] 1, kind: found 'fire', allowed \"runaway\" or"),
        ("[handle]", "[safety]\nforce_N = 0\n[handle]", r"\[safety\], force_N: found 0\.0, allowed a finite number > 0"),
        (
            "speed_rad_s = 0.4\nacceleration_rad_s2 = 2.0",
            "speed_rad_s = 30\nacceleration_rad_s2 = 300.0",
            r"\[\[movement\]\] 1 \(slow\): found .* rad/s of a joint of the robot, allowed at most \[safety\] speed",
        ),
        ("[subject]", 'model = "absent.toml"\n[subject]', r"lengths_m: found a value beside model"),
    ],
)
def test_refuses_what_cannot_be_recorded(experiment: Path, tmp_path: Path, old: str, new: str, message: str) -> None:
    assert EXPERIMENT.count(old) == 1
    experiment.write_text(EXPERIMENT.replace(old, new), encoding="utf-8")
    with pytest.raises(BadInput, match=message):
        armrs.record(experiment, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_experiment_of_the_documents_loads() -> None:
    text = (Path(__file__).parents[1] / "docs" / "files.md").read_text(encoding="utf-8")
    block = text.partition("```toml EXPERIMENT.toml\n")[2].partition("```")[0]
    assert block
    for name, value in vars(Controller()).items():
        assert f"{name} = {value}" in block


def test_what_was_worn_is_in_the_truth_and_named(experiment: Path, tmp_path: Path) -> None:
    worn = "worn = [{ segment = 2, mass = 0.191, at = 0.066 }]\nconfiguration"
    experiment.write_text(EXPERIMENT.replace("configuration", worn), encoding="utf-8")
    armrs.record(experiment, tmp_path / "out")
    data = armrs.load_dataset(tmp_path / "out")
    assert [(a.segment, a.mass, a.at, a.configurations) for a in data.added] == [(2, 0.191, 0.066, ("slow",))]
    with pytest.raises(BadInput, match="masses worn in some configurations"):
        armrs.identify(data)
    assert load_experiment(experiment).runs[0].worn[0].mass == 0.191


def test_nobody_has_a_centre_of_mass_beyond_the_segment(experiment: Path) -> None:
    """Three standard deviations from the literature, that of a hand may be; such a draw ends at its end."""
    far = EXPERIMENT.replace("spread = 0.5", "spread = 3.0\nsegments = 3").replace("lengths_m = [0.322, 0.30]\n", "")
    far = far.replace("waypoints_deg = [[-60, 60], [-48, 60], [-60, 72], [-60, 60]]", "waypoints_deg = [[-60, 60, 0], [-48, 60, 0]]")
    far = far.replace("moment_Nm = [0.05, 0.02]", "moment_Nm = [0.05, 0.02, 0.0]").replace("[handle]", "[[joint]]\n\n[handle]")
    ended = 0
    for seed in range(30):
        experiment.write_text(far.replace("seed = 3", f"seed = {seed}").replace("mass = 0.193", "mass = 0.0"), encoding="utf-8")
        hand = load_experiment(experiment).truth.segments[2]
        ended += hand.com == hand.length
    assert 0 < ended < 30


def test_a_session_that_the_supervisor_stopped_is_one_line(experiment: Path, tmp_path: Path) -> None:
    experiment.write_text(EXPERIMENT.replace("acceleration_rad_s2 = 2.0", "acceleration_rad_s2 = 1e12"), encoding="utf-8")
    with pytest.raises(armrs.ArmrsError, match=r"the first after \d.* s: acceleration 1 beyond the limit, -?\d.* where -?60 is allowed$"):
        armrs.record(experiment, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_sensors_read_as_fast_as_1_khz(experiment: Path) -> None:
    """The run is recorded at 500 Hz, unless they are faster."""
    short = EXPERIMENT.replace("[[-60, 60], [-48, 60], [-60, 72], [-60, 60]]", "[[-60, 60], [-48, 60]]").replace(
        "repeats = 2", "repeats = 1"
    )
    angles = []
    for rate in (500, 1000):
        experiment.write_text(short.replace("emg = true", f"rate_Hz = {rate}.0"), encoding="utf-8")
        trial = measure(load_experiment(experiment)).dataset.trials[0]
        assert trial.rate == pytest.approx(rate)
        angles.append(trial.robot_q)
    assert np.array_equal(angles[1][::2], angles[0])


def test_a_movement_of_a_few_samples_is_refused(tmp_path: Path) -> None:
    """It ended with a traceback: no supervisor had stopped it."""
    path = tmp_path / "experiment.toml"
    subject = '[subject]\nbody_mass = 75.0\nheight = 1.75\nsex = "male"\n'
    movement = "waypoints_deg = [[-60, 60], [-59, 60]]\nspeed_rad_s = 1.0\nacceleration_rad_s2 = 4.0\nrepeats = 1\n"
    path.write_text(f"{subject}[[movement]]\n{movement}", encoding="utf-8")
    with pytest.raises(armrs.BadInput, match=r"\[\[movement\]\] 1: found a recording of less than [0-9]+ samples at [0-9.]+ Hz"):
        armrs.record(load_experiment(path), tmp_path / "out")
    assert not (tmp_path / "out").exists()
