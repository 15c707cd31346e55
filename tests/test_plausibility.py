"""Data that cannot be what they say: dead sensors, swapped columns, other units. Each is named before any physics, with its file."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armrs
from armrs import BadInput
from armrs.cli import main
from armrs.demo import true_model
from armrs.io import column_conventions
from armrs.io.plausibility import hand_path, refuse_implausible
from armrs.workflows.check_dataset import grouped
from armrs.workflows.importing.handle_positions import robot_angles

FIRST = "trials/slow_1.csv"


def changed(data: armrs.Dataset, every: bool = False, **changes: Callable[[np.ndarray], np.ndarray]) -> armrs.Dataset:
    """Return a data set with columns of the first trial, or of all, put through functions."""

    def of(trial: armrs.Trial) -> armrs.Trial:
        arrays: dict[str, Any] = {name: np.array(change(np.array(getattr(trial, name)))) for name, change in changes.items()}
        return dataclasses.replace(trial, **arrays)

    return data.replace(trials=tuple(of(trial) if every or trial is data.trials[0] else trial for trial in data.trials))


def refusal(asked: Callable[[], object]) -> str | None:
    """Return what a call is refused with; None where it is accepted."""
    try:
        asked()
    except BadInput as error:
        return str(error)
    return None


def held(column: int) -> Callable[[np.ndarray], np.ndarray]:
    def change(values: np.ndarray) -> np.ndarray:
        values[:, column] = values[0, column]
        return values

    return change


FORCES: dict[str, tuple[dict[str, Callable[[np.ndarray], np.ndarray]], str]] = {
    "force of zero": ({"force_on_arm": lambda f: 0.0 * f}, "column Fy: found 0 N in every sample, allowed a force that changes"),
    "stuck force": ({"force_on_arm": held(1)}, "column Fz: found "),
}
ANGLES: dict[str, tuple[dict[str, Callable[[np.ndarray], np.ndarray]], str]] = {
    "angles that no reading explains": ({"q": lambda q: 10.0 * q}, "q1 …, qr1, qr2: found the hand 0."),
    "swapped angles": ({"q": lambda q: q[:, ::-1]}, "columns q1 …: found angles that put the hand "),
    "swapped robot angles": ({"robot_q": lambda q: q[:, ::-1]}, "columns qr1, qr2: found "),
    "angles in degrees": ({"q": np.degrees}, "degrees labelled as radians"),
    "robot angles in degrees": ({"robot_q": np.degrees}, "columns qr1, qr2: found "),
}
STILL: dict[str, tuple[dict[str, Callable[[np.ndarray], np.ndarray]], str]] = {
    "still angle": ({"q": held(0)}, "column q1: found -1.0"),
    "still angles": ({"q": lambda q: 0.0 * q + q[0]}, "columns q1, q2: found -1.0"),
    "shoulder at zero": ({"q": lambda q: q * [0.0, 1.0]}, "column q1: found 0 rad in every sample, while the robot's handle moves"),
    "elbow at zero": ({"q": lambda q: q * [1.0, 0.0]}, "column q2: found 0 rad in every sample, while the robot's handle moves"),
}


@pytest.mark.parametrize("verb", [armrs.identify, armrs.find_gap, armrs.passive_moments])
@pytest.mark.parametrize("name", [*FORCES, *ANGLES, *STILL])
def test_what_is_wrong_is_named_with_its_file(verb: Callable[..., object], name: str, slow_arm: Path) -> None:
    changes, message = {**FORCES, **ANGLES, **STILL}[name]
    with pytest.raises(BadInput) as refused:
        verb(changed(armrs.load_dataset(slow_arm), **changes))
    assert str(refused.value).startswith(f"{FIRST}: ")
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("verb", [armrs.identify, armrs.passive_moments])
def test_no_angle_that_changes_is_refused_without_a_robot_too(verb: Callable[..., object], slow_arm: Path) -> None:
    data = armrs.load_dataset(slow_arm)
    data = data.replace(model=data.model.replace(robot=None), trials=tuple(dataclasses.replace(t, robot_q=None) for t in data.trials))
    with pytest.raises(BadInput, match="angles: found none that changes in any trial"):
        verb(changed(data, every=True, q=lambda q: 0.0 * q))


def test_one_joint_that_is_still_may_be_held(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = armrs.load_dataset(slow_arm)
    data = data.replace(model=data.model.replace(robot=None), trials=tuple(dataclasses.replace(t, robot_q=None) for t in data.trials))
    armrs.write_dataset(changed(data, every=True, q=lambda q: np.column_stack([q[:, 0], 0.0 * q[:, 1]])), tmp_path / "held")
    assert main(["passive", str(tmp_path / "held")]) == 0
    assert "q2 is 0 rad in every sample of every trial: a joint that is held, or a dead sensor?" in capsys.readouterr().err


def splinted(data: armrs.Dataset, level: float, shown: float) -> armrs.Dataset:
    """Return a data set of which the elbow is held at an angle, where its sensor shows another, and the robot follows the hand."""
    model, robot = data.model, data.model.robot
    assert robot is not None

    def of(trial: armrs.Trial) -> armrs.Trial:
        q = np.column_stack([trial.q[:, 0], np.full(len(trial), level)])
        shows = np.column_stack([trial.q[:, 0], np.full(len(trial), shown)])
        return dataclasses.replace(trial, q=shows, robot_q=robot_angles(robot, hand_path(model, q)))

    return data.replace(trials=tuple(map(of, data.trials)))


def test_a_splinted_joint_is_no_dead_sensor(slow_arm: Path) -> None:
    """Its angle never changes either; and where its zero is another one, that is what is wrong."""
    data = armrs.load_dataset(slow_arm)
    assert refusal(lambda: refuse_implausible(splinted(data, 1.0, 1.0))) is None
    assert "(another zero: q2 is 1 rad too small?)" in str(refusal(lambda: refuse_implausible(splinted(data, 1.0, 0.0))))


def test_a_dead_sensor_is_one_problem(slow_arm: Path, tmp_path: Path) -> None:
    """It was told as another zero of the angle, beside a joint that is held and a hand that is apart from the handle."""
    data = armrs.load_dataset(slow_arm)
    armrs.write_dataset(changed(data, every=True, q=lambda q: q * [1.0, 0.0]), tmp_path / "dead")
    problems = grouped(armrs.check_dataset(tmp_path / "dead").problems)
    assert [p.text.partition(":")[2][:16] for p in problems if "q2" in p.text or "hand" in p.text] == [" column q2: foun"]
    assert problems[0].next_step.startswith("repair the sensor")


def test_without_a_robot_another_zero_of_an_angle_that_never_changes_may_be_a_dead_sensor() -> None:
    allowed = column_conventions.other_zero(2, 2, -0.9, still=True).allowed
    assert "a dead sensor?" in allowed and "if the joint is held, q2 is 0.9 rad too large" in allowed
    mirrored = next(r for r in column_conventions.of_angles(2) if r.place == "column q2" and "mirrored" in r.allowed)
    angles = np.array([[0.1, 0.0], [0.2, 0.0]])
    assert mirrored.differs(angles + 0.1) and not mirrored.differs(angles)  # 0 has no side


def test_sound_data_pass(slow_arm: Path) -> None:
    data = armrs.load_dataset(slow_arm)
    assert refusal(lambda: refuse_implausible(data)) is None


def test_grams_are_not_kilograms() -> None:
    for mass in (2114.0, 380.0):
        with pytest.raises(BadInput, match=r"mass: found .*, allowed at most .* kg for a segment of .* m \(grams\?\)"):
            armrs.Segment("upper arm", length=0.322, mass=mass, com=0.186, inertia=0.0165)
    boom = ("boom of an excavator", 5.0, 2000.0, 2.0, 4000.0)
    assert refusal(lambda: armrs.Segment(*boom)) is None


@pytest.mark.parametrize("stiffness", [10.0, 1.0])
def test_stiffness_in_kilonewtons_is_named(stiffness: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = true_model()
    with pytest.raises(BadInput, match=r"\[contact\], stiffness: found .* \(kN/m or N/mm\? 10 kN/m is 10000\)"):
        model.replace(contact=armrs.Contact((stiffness, stiffness)))
    file = tmp_path / "model.toml"
    file.write_text(model.to_toml().replace("stiffness = [10000.0, 10000.0]", f"stiffness = [{stiffness}, {stiffness}]"), encoding="utf-8")
    assert main(["simulate", str(file), "--movement", "none.toml"]) == 2
    assert capsys.readouterr().err.startswith(f"armrs: {file}: [contact], stiffness: found {stiffness}, allowed >= ")


def test_a_soft_contact_is_a_contact() -> None:
    model, softest = true_model(), armrs.Contact((1.0, 1.0))
    assert refusal(lambda: model.replace(contact=armrs.Contact((300.0, 300.0)))) is None
    assert refusal(lambda: model.replace(contact=softest)) is not None
    assert refusal(lambda: model.replace(gravity=0.0, contact=softest)) is None  # nothing presses it in


def test_the_core_counts_trials_and_the_message_names_the_file(slow_arm: Path) -> None:
    data = armrs.load_dataset(slow_arm)
    stiff = data.model.replace(contact=armrs.Contact((1e13, 1e13), (0.0, 0.0)))
    with pytest.raises(armrs.ArmrsError) as refused:
        armrs.identify(data.replace(model=stiff), motion="simulated")
    assert str(refused.value).startswith(f"{FIRST}: ")
    assert "trial 1" not in str(refused.value)
