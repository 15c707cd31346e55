"""Recordings that are wrong as those of a clinic are: reflexes and passive moments are right, or a warning names what is wrong."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import armrs
import patients
from armrs.analysis import passivity_checks
from armrs.analysis.robot_motion import with_robot_motion
from armrs.cli import main
from armrs.workflows import history, setup_check

PATIENT = patients.Patient(stiffness=1.2)


@functools.cache
def session() -> armrs.Dataset:
    data = patients.recorded(PATIENT, 7101)
    return data.replace(tolerance=armrs.Tolerance())


@functools.cache
def reflexes() -> armrs.Spasticity:
    return armrs.spasticity(session())


def with_trials(change: Callable[[armrs.Trial], dict[str, object]]) -> armrs.Dataset:
    return session().replace(trials=tuple(dataclasses.replace(t, **change(t)) for t in session().trials))


def off_by(degrees: tuple[float, float], channel: str = "q") -> armrs.Dataset:
    """Return the session with zeros of angles that are wrong."""
    return with_trials(lambda t: {channel: getattr(t, channel) + np.radians(degrees)})


def in_unit(newtons: float) -> armrs.Dataset:
    """Return the session with forces that are taken for another unit."""
    return with_trials(lambda t: {"force_on_arm": newtons * t.force_on_arm})


def changed(first: armrs.Spasticity, second: armrs.Spasticity, folder: Path) -> set[str]:
    """Return what a history of two sessions calls changed."""
    history.add(folder / "h.sqlite", first, "2026-01-03")
    return {c.name for c in history.add(folder / "h.sqlite", second, "2026-02-03").courses if c.before.clear and c.joint == 2}


def elbow(found: armrs.Spasticity) -> dict[str, float]:
    return {e.name: e.value for e in found.followed() if e.joint == 2}


def test_a_right_session_is_not_warned_of() -> None:
    assert not [line for line in reflexes().warnings if line.startswith("angles of arm") or "masses" in line or "swapped" in line]


@pytest.mark.long
@pytest.mark.parametrize("degrees", [2.0, 5.0])
def test_robot_angles_with_another_zero_change_nothing_and_are_named(degrees: float, tmp_path: Path) -> None:
    """The path of the handle was followed where the arm cannot reach: moments of 10⁶ N m, and no line about it."""
    found = armrs.spasticity(off_by((degrees, 0.0), "robot_q"))
    said = next(line for line in found.warnings if line.startswith("angles of arm and robot contradict each other"))
    assert "a zero of qr1 that is off by" in said and "mm apart" in said
    right = elbow(reflexes())
    for name, value in elbow(found).items():
        assert value == pytest.approx(right[name], rel=0.05, abs=2e-3), name
    assert not changed(reflexes(), found, tmp_path)


def test_the_fast_motion_does_not_depend_on_the_zeros_of_the_robot() -> None:
    data = session()
    fast = max(data.trials, key=lambda t: float(np.ptp(np.gradient(t.q[:, 1], t.t))))
    wrong = dataclasses.replace(fast, robot_q=fast.robot_q + np.radians([5.0, 0.0]))
    right, other = (with_robot_motion(trial, data.model, 12.0) for trial in (fast, wrong))
    assert right is not None and other is not None
    assert np.abs(right.q - other.q).max() < np.radians(0.2)


@pytest.mark.long
def test_a_wrong_zero_of_the_elbow_is_named_and_no_change_is_made_of_it(tmp_path: Path) -> None:
    """`armrs check` named it, and a history of reflexes called gain, latency, viscosity and friction changed."""
    wrong = off_by((0.0, 5.0))
    found, passive = armrs.spasticity(wrong), armrs.passive_moments(wrong)
    for warnings in (found.warnings, passive.warnings):
        (said,) = (line for line in warnings if line.startswith("angles of arm and robot contradict each other"))
        assert "a zero of q2 that is off by" in said and "intervals allow for" in said
    assert not changed(reflexes(), found, tmp_path)
    name = "stiffness in stretch 0"
    before, after = (next(e for e in r.followed() if e.name == name and e.joint == 2) for r in (armrs.passive_moments(session()), passive))
    assert after.value - before.value > 0.1 and abs(after.value - before.value) < 1.96 * np.hypot(after.std, before.std)


def test_the_warning_is_on_the_page_for_a_clinician(tmp_path: Path) -> None:
    data = off_by((0.0, 5.0)).replace(subject=armrs.Subject(77.0, 1.80, "male"))
    folder = armrs.write_dataset(data, tmp_path / "data").parent
    folder = folder if (folder / "dataset.toml").exists() else tmp_path / "data"
    assert main(["spasticity", str(folder), "--json", str(tmp_path / "r.json")]) == 0
    assert main(["report", str(tmp_path / "r.json"), "--summary", "-o", str(tmp_path / "page")]) == 0
    assert "angles of arm and robot contradict each other" in (tmp_path / "page" / "summary.html").read_text()


@pytest.mark.parametrize(("unit", "newtons"), [("lbf", 4.4482216), ("kgf", 1.0 / 9.80665), ("kN", 1e-3)])
def test_forces_in_another_unit_are_named_by_every_verb(unit: str, newtons: float) -> None:
    lines = setup_check.setup_warnings(in_unit(newtons))
    assert any("times the masses" in line and unit in line for line in lines), lines
    if unit == "lbf":
        for result in (armrs.spasticity(in_unit(newtons)), armrs.passive_moments(in_unit(newtons))):
            assert any("forces stated in lbf that are N" in line for line in result.warnings)


def test_a_moment_that_nothing_exerts_is_refused() -> None:
    """Moments of 10⁶ N m were reported."""
    trial = session().trials[0]
    moment = np.full(len(trial), 2.0)
    passivity_checks.refuse_absurd(session(), [(trial, moment)])
    moment[5] = 1e5
    with pytest.raises(armrs.BadInput, match=rf"{trial.file}.*a joint moment of 1e\+05 N m"):
        passivity_checks.refuse_absurd(session(), [(trial, moment)])


def test_swapped_channels_of_antagonists_are_asked_about() -> None:
    pair = ["emg_elbow_flexor_uV", "emg_elbow_extensor_uV"]
    data = with_trials(lambda t: {"emg": {**t.emg, pair[0]: t.emg[pair[1]], pair[1]: t.emg[pair[0]]}})
    said = [line for line in armrs.spasticity(data).warnings if "swapped" in line]
    assert len(said) == 1 and f"{pair[0]} becomes active, and {pair[1]}, the stretched muscle, in none" in said[0]
