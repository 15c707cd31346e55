"""Reflexes by the speed of stretch, in patients whose laws the tests write themselves (bench/patients.py)."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import armrs
import patients
from armrs import BadInput
from armrs.analysis.stretch_reflex import Estimated
from armrs.analysis.stretch_sessions import stretched_joint
from armrs.cli import main
from armrs.io import tomlfile
from armrs.io.muscle_activity import mark_activity, onset
from armrs.model import Effect, Model
from armrs.report import clinic_figures, plotting
from armrs.workflows.plan import Instruments, Limits
from armrs.workflows.plan_stretches import plan_stretches
from patients import Patient

SEED = 7001


def test_threshold_gain_and_latency_are_recovered() -> None:
    for number in range(4):
        patient = Patient.drawn(np.random.default_rng(SEED + number))
        found = armrs.spasticity(patients.session(patient, SEED + number)).joints[0].reflex
        assert found.found and found.direction == 1
        value = {name: p.value for name, p in found.parameters.items()}
        assert value["gain"] == pytest.approx(patient.gain, rel=0.1)
        assert value["threshold"] == pytest.approx(patient.threshold, rel=0.1)
        assert value["latency"] == pytest.approx(patient.latency, abs=5e-3)


@pytest.mark.long
def test_patients_of_the_virtual_laboratory_are_recovered() -> None:
    """With a robot, cameras, tone and a wrong model of the arm; `bench/virtual_patients.py --laboratory` has two hundred of them."""
    for number in range(3):
        patient = Patient.drawn(np.random.default_rng(SEED + 50 + number))
        joint = next(j for j in armrs.spasticity(patients.recorded(patient, SEED + number)).joints if j.joint == 2)
        found = joint.reflex
        # The extensor alone resists flexion.
        assert max(s.co_contraction for s in joint.stretches if s.speed > 2.0) < 0.2
        value = {name: p.value for name, p in found.parameters.items()}
        assert value["gain"] == pytest.approx(patient.gain, rel=0.1)
        assert value["threshold"] == pytest.approx(patient.threshold, rel=0.1)
        assert value["latency"] == pytest.approx(patient.latency, abs=5e-3)


@pytest.mark.long
@pytest.mark.parametrize("seed", [SEED, SEED + 1])
def test_a_burst_in_a_slow_stretch_moves_no_estimate_by_a_tenth_of_its_interval(seed: int) -> None:
    """It moved the onset by a third: the muscle is active at a speed at which no reflex acts, so what it does is its own."""
    data = patients.session(Patient(), seed, emg=True)
    place = next(k for k, trial in enumerate(data.trials) if trial.file == "v0_2.csv")
    calm, draw = data.trials[place], np.random.default_rng(seed)
    assert calm.tau is not None
    at = (calm.t > 4.0) & (calm.t < 4.6)
    push = np.where(at, np.sin(np.pi * (calm.t - 4.0) / 0.6) ** 2, 0.0)[:, None]
    emg = {name: np.where(at, 60.0 * draw.standard_normal(len(at)), values) for name, values in calm.emg.items()}
    trials = list(data.trials)
    trials[place] = dataclasses.replace(calm, tau=calm.tau + push, emg=emg)

    def found(trials: list[armrs.Trial]) -> dict[str, Estimated]:
        reflex = armrs.spasticity(data.replace(trials=tuple(mark_activity(trials)[0]))).joints[0].reflex
        return {**reflex.parameters, "viscosity": reflex.viscosity, "dry": reflex.dry}

    without, burst = found(list(data.trials)), found(trials)
    for name in ("gain", "threshold", "latency", "viscosity", "dry"):
        width = without[name].interval[1] - without[name].interval[0]
        assert abs(burst[name].value - without[name].value) < 0.1 * width, name


def test_without_a_reflex_none_is_found() -> None:
    found = armrs.spasticity(patients.session(dataclasses.replace(Patient(), gain=0.0), SEED))
    assert not found.joints[0].reflex.found and "no reflex" in found.warnings[0]
    assert not any(e.kind == "stretch_reflex" for e in found.followed())


def test_a_law_that_drives_the_joint_is_no_reflex() -> None:
    """A shoulder that moved by two degrees beside a stretched elbow had a reflex from 0 rad/s on, with a viscosity of -1.1 N m s/rad."""
    data = patients.session(Patient(), SEED, emg=True)
    driven = [
        dataclasses.replace(trial, tau=trial.tau - 2.0 * np.gradient(trial.q[:, 0], trial.t)[:, None])  # type: ignore[operator]
        for trial in data.trials
    ]
    found = armrs.spasticity(data.replace(trials=tuple(driven)))
    assert found.joints[0].reflex.viscosity.interval[1] < 0.0 and not found.joints[0].reflex.found
    assert "no reflex was found" in found.warnings[0] and "no passive joint drives itself" in found.warnings[0]
    # The table had a latency of muscle activity, from the threshold of the reflex that was not found.
    assert np.isnan([s.emg_latency for s in found.joints[0].stretches]).all()


def test_a_joint_that_moves_with_a_stretched_one_is_not_stretched() -> None:
    data = patients.session(Patient(), SEED)
    middle = np.mean(np.concatenate([trial.q for trial in data.trials]))
    nearly_held = [dataclasses.replace(trial, q=middle + 0.05 * (trial.q - middle)) for trial in data.trials]
    with pytest.raises(BadInput, match="no joint that is stretched"):
        armrs.spasticity(data.replace(trials=tuple(nearly_held)))


def test_an_angle_threshold_is_told() -> None:
    patient = dataclasses.replace(Patient(), threshold=0.3, tonic=np.radians(90.0), slope=2.0)
    found = armrs.spasticity(patients.session(patient, SEED)).joints[0].reflex
    assert found.parameters["tonic"].value == pytest.approx(patient.tonic, abs=0.15)
    assert found.parameters["slope"].value == pytest.approx(patient.slope, rel=0.2)
    assert "tonic" not in armrs.spasticity(patients.session(Patient(), SEED)).joints[0].reflex.parameters


def test_muscle_activity_precedes_the_torque() -> None:
    patient = Patient()
    data = patients.session(patient, SEED, emg=True)
    fast = [s for s in armrs.spasticity(data).joints[0].stretches if s.speed > 2.5]
    t, late = np.arange(0.0, 3.0, 1e-4), []
    for stretch in fast:
        trial = next(t for t in data.trials if t.file == stretch.file)
        # The motion is known in closed form, and so is when it passes the threshold.
        passed = t[np.argmax(patients.motion(t, patients.SPEEDS[int(trial.configuration[-1])])[1] > patient.threshold)]
        seen = onset(trial, "emg_biceps_uV", 0.4, 5.0)
        assert seen is not None
        assert stretch.emg_latency == pytest.approx(seen - passed, abs=0.008)
        late.append(seen - passed)
    # Torque 40 ms after the threshold is passed, activity 15 ms before the torque; noise hides its first 15 ms or so.
    assert 0.025 < np.mean(late) < 0.045
    slow = next(t for t in data.trials if t.configuration == "speed 0")
    assert onset(slow, "emg_biceps_uV", 0.4, 5.0) is None


def test_the_verb_writes_a_page_and_keeps_a_history(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for number, gain in enumerate((1.2, 1.8)):
        folder = patients.written(patients.session(dataclasses.replace(Patient(), gain=gain), SEED + number), tmp_path / f"s{number}")
        history = ["--history", str(tmp_path / "h.sqlite"), "--date", f"2026-0{number + 1}-03"]
        out = ["-o", str(tmp_path / f"o{number}"), "--json", str(tmp_path / f"{number}.json")]
        assert main(["spasticity", str(folder), *history, *out]) == 0
    said = capsys.readouterr().out
    assert "a stretch reflex resists where the angle grows faster than" in said and "since the session before" in said
    courses = json.loads((tmp_path / "1.json").read_text())["history"]
    changed = {c["name"] for c in courses if c["before"]["clear"]}
    assert "gain" in changed and "latency" not in changed
    page = (tmp_path / "o1" / "report.html").read_text()
    assert "Stretches of elbow" in page and "catch angle" in page
    assert main(["report", str(tmp_path / "1.json"), "--summary", "-o", str(tmp_path / "page")]) == 0
    summary = (tmp_path / "page" / "summary.html").read_text()
    assert "Reflex strength" in summary and "higher by" in summary and "What was not measured" in summary


def test_one_speed_is_refused() -> None:
    data = patients.session(Patient(), SEED)
    one = dataclasses.replace(data, trials=tuple(t for t in data.trials if t.configuration == "speed 2"))
    with pytest.raises(
        BadInput, match=r"no joint that is stretched at several speeds.*armrs plan MODEL .* proposes stretches at five speeds"
    ):
        armrs.spasticity(one)


@pytest.mark.long
def test_a_plan_of_stretches_expects_what_patients_scatter_by() -> None:
    limits = Limits(((patients.LOW, patients.HIGH),), speed=4.0, acceleration=40.0)
    patient = Patient()
    reflex = Effect("stretch_reflex", joint=1, parameters={"gain": patient.gain, "threshold": patient.threshold})
    arm = patients.arm()
    model = Model(arm.segments, arm.joints, effects=(reflex,))
    # A force of 0.05 / 0.3 N at the hand is the patients' 0.05 N m.
    planned = plan_stretches(model, limits, 1, instruments=Instruments(rate=200.0, force=0.05 / 0.3))
    speeds = [m.speed for m in planned.movements]
    assert speeds[0] == pytest.approx(np.radians(15.0)) and speeds[-1] == pytest.approx(4.0) and planned.repeats == 3
    found = [armrs.spasticity(patients.session(patient, SEED + k)).joints[0].reflex.parameters["gain"].value for k in range(12)]
    # Angles are noisy in the patients and not in the plan.
    assert 0.3 < planned.predictions[0].std / np.std(found, ddof=1) < 2.0
    with pytest.raises(BadInput, match="fastest stretch"):
        plan_stretches(model, dataclasses.replace(limits, speed=0.5), 1)


def test_planned_stretches_are_toml(tmp_path: Path) -> None:
    """Their accelerations are numbers of NumPy, which write their type."""
    limits = Limits(((patients.LOW, patients.HIGH),), speed=4.0, acceleration=40.0)
    arm, file = patients.arm(), tmp_path / "a.toml"
    for movement in plan_stretches(Model(arm.segments, arm.joints), limits, 1).movements:
        file.write_text(f"acceleration = {tomlfile.value(movement.acceleration)}\n", encoding="utf-8")
        assert tomlfile.read(file)["acceleration"] == movement.acceleration


def test_markers_at_the_axis_are_whole() -> None:
    """Of slow stretches the reflex is zero, and half of each marker lay below the axis."""
    slow = SimpleNamespace(speed=0.2, peak_moment=1.5, elastic=1.4, resisting=0.1, reflex=0.0, catch_angle=np.nan, catch_speed=np.nan)
    found = SimpleNamespace(joint=1, stretches=[slow], reflex=SimpleNamespace(found=False))
    with plotting.style():
        left = clinic_figures._stretches(None, found, "elbow").figure.axes[0]  # type: ignore[arg-type]
    assert min(float(line.get_ydata()[0]) for line in left.lines) == 0.0 == left.get_ylim()[0]
    assert not any(line.get_clip_on() for line in left.lines)


def test_a_session_of_stretches_is_told_from_others(slow_arm: Path) -> None:
    """After `armrs record` and `armrs check` of planned stretches, the next step was `armrs gap`."""
    stretches = patients.session(Patient(), SEED)
    assert stretched_joint(stretches.trials) == stretches.model.n_joints
    assert stretched_joint(stretches.trials[:3]) is None
    assert stretched_joint(armrs.load_dataset(slow_arm).trials) is None
    same = [t for t in stretches.trials if t.configuration == "speed 0"]
    assert stretched_joint([*same, *same]) is None
