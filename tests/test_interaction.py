"""A robot whose handle yields: what is refused, what perturbs it, how stiff the arm is at the hand, and what support spares it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armrs
from armrs import BadInput
from armrs.cli import main
from armrs.workflows.experiment import load_experiment
from armrs.workflows.interaction import CONTROL_RATE, PERIOD, Perturbation, endpoint_impedance, endpoint_stiffness
from armrs.workflows.record import measure

TRUTH = """\
[arm]
segment_uncertainty = 0.05

[[arm.segment]]
name = "upper arm"
length = 0.322
mass = 2.1
com = 0.15
inertia = 0.02

[[arm.segment]]
name = "forearm"
length = 0.30
mass = 1.5
com = 0.16
inertia = 0.015

[[arm.joint]]
name = "shoulder"
stiffness = 2.0
rest = -0.8
viscosity = 0.3

[[arm.joint]]
name = "elbow"
stiffness = 1.2
rest = 1.0
viscosity = 0.2
"""
EXPERIMENT = """\
model = "truth.toml"
seed = 5

[interaction]
law = "impedance"
hold_s = 8.0

[[movement]]
configuration = "reach"
waypoints_deg = [[-60, 60], [-45, 75]]
speed_rad_s = 0.5
acceleration_rad_s2 = 3.0
shape = "smooth"
repeats = 1
"""
SUPPORT = '\n[support]\nmodel = "truth.toml"\n'
PERTURBATION = '\n[perturbation]\nkind = "{}"\namplitude_N = 4.0\n'


@pytest.fixture
def written(tmp_path: Path) -> Any:
    """Write an experiment with more tables, some text replaced."""

    def write(more: str = "", old: str = "", new: str = "") -> Path:
        (tmp_path / "truth.toml").write_text(TRUTH, encoding="utf-8")
        path = tmp_path / "EXPERIMENT.toml"
        path.write_text((EXPERIMENT + more).replace(old, new) if old else EXPERIMENT + more, encoding="utf-8")
        return path

    return write


@pytest.mark.parametrize("law", ["impedance", "admittance"])
def test_support_takes_the_weight_off_the_hand(written: Any, law: str) -> None:
    (story,) = measure(load_experiment(written(SUPPORT, '"impedance"', f'"{law}"'))).trials
    told = story["interaction"]
    assert told["run"]["stable"] and told["without_support"]["stable"]
    assert told["without_support"]["force_rms_N"] > 5.0
    assert told["lowered"] == pytest.approx(1.0 - told["run"]["force_rms_N"] / told["without_support"]["force_rms_N"], rel=1e-12)
    assert told["lowered"] > 0.9
    # What is left of the sag of the handle, which yields to the weight without support.
    assert told["run"]["handle_off_m"] < 0.5 * told["without_support"]["handle_off_m"]


def test_a_support_of_more_than_the_arm_is_told_not_to_be_stable(written: Any) -> None:
    with pytest.raises(armrs.ArmrsError, match="the supervisor stopped every trial to be fitted"):
        measure(load_experiment(written(SUPPORT + "share = 5.0\n")))


def test_a_trial_under_support_has_its_torques_and_can_be_identified(written: Any, tmp_path: Path) -> None:
    moving = "waypoints_deg = [[-60, 60], [-30, 60], [-30, 90], [-60, 90], [-60, 60]]"
    path = written(SUPPORT + "\n[sensors]\nrate_Hz = 100\n", "waypoints_deg = [[-60, 60], [-45, 75]]", moving)
    done = armrs.record(path, tmp_path / "out")
    (trial,) = armrs.load_dataset(tmp_path / "out").trials
    assert trial.tau is not None and np.abs(trial.tau).max() > 2.0
    found = armrs.identify(tmp_path / "out")
    truth = armrs.Arm.from_model(armrs.load_model(tmp_path / "truth.toml")).first_moments
    by_name = {e.name: e for e in found.combinations}
    for e, true in zip([e for e in by_name.values() if e.unit == "kg m"], truth, strict=True):
        assert abs(e.value - true) < 4.0 * e.std + 0.02 * true
    assert len(done.interacted["trials/reach_1.csv"]) == 2


def test_the_stiffness_of_the_hand_is_that_of_the_model(written: Any, tmp_path: Path) -> None:
    """Fitted to a perturbation of the simulated arm, against the derivative of the force that holds the model."""
    measured = measure(load_experiment(written(PERTURBATION.format("multisine"))))
    (runs,) = measured.interacted.values()
    tip = runs[0].endpoint(8.0)
    model = armrs.load_model(tmp_path / "truth.toml")
    expected = endpoint_stiffness(model, runs[0].q[-4000:].mean(axis=0))
    assert np.abs(tip.stiffness - expected).max() < 0.05 * np.abs(expected).max()
    largest, smallest, direction = tip.ellipse
    assert largest > smallest and 0.0 <= direction < np.pi
    # The effective mass at the hand, J^-T B J^-1, is positive in every direction.
    assert np.linalg.eigvalsh(0.5 * (tip.inertia + tip.inertia.T)).min() > 0.0


def test_a_carried_arm_is_not_stiff(written: Any) -> None:
    (story,) = measure(load_experiment(written(SUPPORT + PERTURBATION.format("multisine")))).trials
    carried, alone = (np.array(story["interaction"][k]["endpoint_stiffness_N_m"]) for k in ("run", "without_support"))
    assert np.abs(carried).max() < 0.25 * np.abs(alone).max()


@pytest.mark.parametrize("kind", ["multisine", "prbs", "ramps"])
def test_a_perturbation_has_its_size_and_its_seed(kind: str) -> None:
    p = Perturbation(kind, amplitude_N=3.0)
    force = p.force(np.random.default_rng(1))
    assert force.shape == (round(PERIOD * CONTROL_RATE), 2)
    assert np.abs(force).max(axis=0).min() > 1.0 and np.abs(force).max() <= 3.0 + 1e-12
    assert np.array_equal(force, p.force(np.random.default_rng(1))) and not np.array_equal(force, p.force(np.random.default_rng(2)))
    if kind == "multisine":
        spectrum = np.abs(np.fft.rfft(force[:, 0]))
        lines = np.flatnonzero(spectrum > 1e-6 * spectrum.max()) / PERIOD
        assert lines.min() == 0.5 and lines.max() == 5.0
    if kind == "prbs":
        assert set(np.abs(force).ravel()) == {3.0} and np.abs(force.mean(axis=0)).max() < 1e-12


def test_impedance_is_recovered_from_motion_in_closed_form() -> None:
    stiffness, damping, inertia = (
        np.array([[90.0, 20.0], [20.0, 40.0]]),
        np.array([[8.0, 1.0], [1.0, 5.0]]),
        np.array([[2.0, 0.3], [0.3, 1.0]]),
    )
    rate, t = 500.0, np.arange(3000) / 500.0
    x, v, a = np.zeros((3, len(t), 2))
    for k, line in enumerate((0.5, 1.0, 1.5, 2.5, 4.0)):
        w, phase = 2 * np.pi * line, np.array([0.7 * k, 2.0 - 1.3 * k])
        x += 0.01 * np.cos(w * t[:, None] + phase)
        v -= 0.01 * w * np.sin(w * t[:, None] + phase)
        a -= 0.01 * w**2 * np.cos(w * t[:, None] + phase)
    found = endpoint_impedance(rate, x, x @ stiffness.T + v @ damping.T + a @ inertia.T)
    np.testing.assert_allclose(found.stiffness, stiffness, atol=1e-9)
    np.testing.assert_allclose(found.damping, damping, atol=1e-9)
    np.testing.assert_allclose(found.inertia, inertia, atol=1e-9)
    with pytest.raises(BadInput, match="two periods of the perturbation"):
        endpoint_impedance(rate, x[:1500], x[:1500])


def test_the_report_says_what_support_does(written: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert main(["record", str(written(SUPPORT + PERTURBATION.format("ramps"))), "-o", str(out), "--json", str(tmp_path / "r.json")]) == 0
    printed = capsys.readouterr().out
    assert "less by at least" in printed and "1 of 1 came to rest" in printed
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "not carried" in page and ">Interaction</h2>" in page
    assert {"interaction-reach.png", "stiffness-reach.png"} <= {p.name for p in (out / "figures").iterdir()}
    assert json.loads((tmp_path / "r.json").read_text())["trials"][0]["interaction"]["lowered"] > 0.8


@pytest.mark.parametrize(
    ("more", "old", "new", "message"),
    [
        ("", 'law = "impedance"', 'law = "stiff"', r"\[interaction\], law: found 'stiff', allowed \"impedance\" or \"admittance\""),
        ("", "hold_s = 8.0", "hold_s = 0.1", r"\[interaction\], hold_s: found 0\.1"),
        ("", "hold_s = 8.0", "stiffness_N_m = -1", r"\[interaction\], stiffness_N_m: found -1"),
        ("", "hold_s = 8.0", "link_masses_kg = [1]", r"\[interaction\], link_masses_kg: found \[1\], allowed two numbers"),
        ("\n[support]\nshare = 1.0\n", "", "", r"\[support\], model: found nothing"),
        (SUPPORT + "share = 0\n", "", "", r"\[support\], share: found 0"),
        (PERTURBATION.format("noise"), "", "", r"\[perturbation\], kind: found 'noise'"),
        (PERTURBATION.format("prbs"), "hold_s = 8.0", "hold_s = 5.0", r"hold_s: found 5\.0, allowed at least 6 s with a perturbation"),
        (
            PERTURBATION.format("prbs"),
            '[interaction]\nlaw = "impedance"\nhold_s = 8.0',
            "",
            r"\[perturbation\]: found a value without \[interaction\]",
        ),
        ("\n[sensors]\nemg = true\n", "", "", r"\[sensors\], emg: found a value beside \[interaction\]"),
        ('\n[[fault]]\nkind = "late"\nat_s = 1\n', "", "", r"fault: found a value beside \[interaction\]"),
    ],
)
def test_what_cannot_be_is_refused(written: Any, more: str, old: str, new: str, message: str) -> None:
    with pytest.raises(BadInput, match=message) as caught:
        load_experiment(written(more, old, new))
    assert "\n" not in str(caught.value)


def test_an_arm_of_three_joints_has_no_stiffness_at_the_hand() -> None:
    segment = armrs.Segment("a", 0.3, 1.0, 0.15, 0.01)
    model = armrs.Model((segment,) * 3, tuple(armrs.Joint(n) for n in "abc"))
    with pytest.raises(BadInput, match="model: found 3 segments, allowed 2"):
        endpoint_stiffness(model, np.zeros(3))
