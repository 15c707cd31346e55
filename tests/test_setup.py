"""Wrong setups are named in one line, by `identify` and `gap` alike, with and without the angles of the robot."""

from __future__ import annotations

import dataclasses
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armrs
from armrs.analysis.torque_balance import motion_of, unexplained
from armrs.cli import main
from armrs.io import column_conventions
from armrs.io.samples import read_samples, write_samples
from armrs.workflows.setup_check import examine_setup, first_wrong

Table = dict[str, np.ndarray]

MOVEMENT = """\
[movement]
waypoints_deg = [[-60, 60, 5], [-35, 60, 5], [-60, 60, 5], [-60, 95, 5], [-45, 75, 25], [-60, 60, 5]]
speed_rad_s = 0.5
acceleration_rad_s2 = 2.0
shape = "smooth"
"""
SEGMENTS = ((0.30, 2.0, 0.14, 0.012), (0.25, 1.3, 0.11, 0.007), (0.09, 0.5, 0.06, 0.0009))
LAWS = ((1.2, -0.9, 0.2), (0.8, 1.2, 0.15), (1.5, 0.1, 0.1))


def arm(laws: bool) -> armrs.Model:
    """Return an arm of three segments: with springs and viscosity, or as a laboratory has it on its first day, off by 5 %."""
    off = 1.0 if laws else 1.05
    segments = tuple(armrs.Segment(f"segment {k}", a, off * m, c, off * inertia) for k, (a, m, c, inertia) in enumerate(SEGMENTS, start=1))
    springs = (armrs.Joint(f"joint {k}", stiffness=s, rest=r, viscosity=v) for k, (s, r, v) in enumerate(LAWS, start=1))
    joints = tuple(springs) if laws else tuple(armrs.Joint(f"joint {k}") for k in (1, 2, 3))
    model = armrs.Model(segments, joints, segment_uncertainty=0.1)
    return model.replace(robot=armrs.Robot((0.45, 0.45), (1.05, -0.10)), contact=armrs.Contact((10000.0, 10000.0), (25.0, 25.0)))


@pytest.fixture(scope="module", params=["with", "without"])
def session(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session of an arm whose springs its model lacks, with or without robot angles."""
    folder = tmp_path_factory.mktemp(request.param)
    (folder / "movement.toml").write_text(MOVEMENT, encoding="utf-8")
    movement = armrs.load_movement(folder / "movement.toml", 3)
    run = armrs.simulate(arm(True), movement, sensors=armrs.Sensors.realistic(), seeds=range(3))
    trials = tuple(
        armrs.Trial(
            f"trials/round_{k}.csv", "round", k, "fit" if k < 3 else "test", r.time, r.q, r.force_on_arm,
            None, r.robot_q if request.param == "with" else None,
        )
        for k, r in enumerate(run.readings, start=1)
    )  # fmt: skip
    armrs.write_dataset(armrs.Dataset("round", arm(False), trials, "robot", synthetic=True), folder / "session")
    return folder / "session"


def angles(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Table], Table]:
    """Return what puts the three angle columns through a function."""
    names = ["q1_rad", "q2_rad", "q3_rad"]
    return lambda table: table | dict(zip(names, change(np.column_stack([table[n] for n in names])).T, strict=True))


WRONG: dict[str, tuple[Callable[[Table], Table], str]] = {
    "mirrored": (angles(lambda q: -q), "(mirrored?)"),
    "absolute": (angles(lambda q: np.cumsum(q, axis=1)), "(absolute angles?)"),
    "from the vertical": (angles(lambda q: q + np.array([np.pi / 2, 0.0, 0.0])), "(from the vertical downwards?)"),
    "another zero": (angles(lambda q: q + np.array([0.0, 0.6, 0.0])), "(another zero: q2 is 0."),
    "forces swapped": (lambda t: t | {"Fy_N": t["Fz_N"], "Fz_N": t["Fy_N"]}, "(swapped columns?)"),
    "kN": (lambda t: t | {"Fy_N": 1e-3 * t["Fy_N"], "Fz_N": 1e-3 * t["Fz_N"]}, "(kN labelled as N, or N as mN?)"),
    "ms": (lambda t: t | {"t_s": 1e3 * t["t_s"]}, "(milliseconds?)"),
    "seconds as ms": (
        lambda t: {"t_ms" if name == "t_s" else name: values for name, values in t.items()},
        "(seconds labelled as milliseconds?)",
    ),
    "other side": (lambda t: t | {"Fy_N": -t["Fy_N"], "Fz_N": -t["Fz_N"]}, "force_on: found "),
}


def rewritten(session: Path, folder: Path, change: Callable[[Table], Table]) -> Path:
    """Return a copy of a session with the columns of every trial changed."""
    shutil.copytree(session, folder)
    for file in (folder / "trials").glob("*.csv"):
        samples = read_samples(file)
        table = change(dict(zip(samples.names, samples.values, strict=True)))
        write_samples(file, list(table), list(table.values()))
    return folder


@pytest.mark.parametrize("verb", ["identify", "gap"])
@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_setup_is_named_in_one_line(
    name: str, verb: str, session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    change, says = WRONG[name]
    wrong = rewritten(session, tmp_path / "wrong", change)
    assert main([verb, str(wrong), "-o", str(tmp_path / "out")]) == 2
    out, err = capsys.readouterr()
    assert out == "" and not (tmp_path / "out").exists()
    assert err.startswith("armrs: ") and err.count("\n") == 1
    assert "trials/round_1.csv" in err and ": found " in err and "allowed " in err and says in err


def test_the_right_setup_is_not_questioned(session: Path) -> None:
    examine_setup(armrs.load_dataset(session))
    assert [p.text for p in armrs.check_dataset(session).problems if p.level == "error"] == []


def test_check_names_a_wrong_setup_and_the_one_trial_that_is_wrong(session: Path, tmp_path: Path) -> None:
    wrong = rewritten(session, tmp_path / "wrong", WRONG["forces swapped"][0])
    assert [p.level for p in armrs.check_dataset(wrong).problems if "swapped columns" in p.text] == ["error"]
    shutil.copy(wrong / "trials" / "round_2.csv", tmp_path / "swapped.csv")
    shutil.copytree(session, tmp_path / "one")
    shutil.copy(tmp_path / "swapped.csv", tmp_path / "one" / "trials" / "round_2.csv")
    texts = [p.text for p in armrs.check_dataset(tmp_path / "one").problems if "swapped columns" in p.text]
    assert [text.partition(":")[0] for text in texts] == ["trials/round_2.csv"]


@pytest.mark.parametrize("session", ["without"], indirect=True)
@pytest.mark.parametrize("wrong", [(2,), (1, 2, 3)])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize(("factor", "says"), [(1e3, "(mN labelled as N, or N as kN?)"), (1e-3, "(kN labelled as N, or N as mN?)")])
def test_one_component_in_another_unit_is_named(session: Path, wrong: tuple[int, ...], axis: int, factor: float, says: str) -> None:
    """Kilonewtons in one column of one trial passed `check`, and `identify` ended with a residual of 718 N m and status 0."""
    data = armrs.load_dataset(session)
    trials = list(data.trials)
    assert len(trials) == 3
    for number in wrong:
        force = trials[number - 1].force_on_arm
        assert force is not None
        scaled = force * np.where(np.arange(2) == axis, factor, 1.0)
        trials[number - 1] = dataclasses.replace(trials[number - 1], force_on_arm=scaled)
    found = first_wrong(data.model, trials, met=False)
    name = ("Fy", "Fz")[axis]
    assert found is not None and f"trials/round_{wrong[0]}.csv" in str(found)
    assert f"column {name}: found " in str(found) and f"{name} in the unit of its column {says}" in str(found)


def every_reading() -> Iterator[column_conventions.AlternativeConvention]:
    yield from column_conventions.of_angles(3)
    yield from column_conventions.of_forces(3)
    yield column_conventions.other_zero(3, 2, 0.6)


@pytest.mark.parametrize("session", ["without"], indirect=True)
def test_passive_moments_warn_of_a_wrong_setup(session: Path, tmp_path: Path) -> None:
    assert not any("if read otherwise" in line for line in armrs.passive_moments(session).warnings)
    wrong = rewritten(session, tmp_path / "wrong", WRONG["forces swapped"][0])
    assert "(swapped columns?)" in armrs.passive_moments(wrong).warnings[0]


@pytest.mark.parametrize("session", ["without"], indirect=True)
def test_newtons_labelled_as_kilonewtons_are_named(session: Path, tmp_path: Path) -> None:
    wrong = rewritten(session, tmp_path / "wrong", lambda t: {n.replace("_N", "_kN"): 10.0 * v if n[0] == "F" else v for n, v in t.items()})
    with pytest.raises(armrs.BadInput, match=r"_kN: found .*, allowed -10 to 10 kN \(N labelled as kN\?"):
        armrs.load_dataset(wrong)


@pytest.mark.parametrize("session", ["without"], indirect=True)
def test_every_reading_is_undone_by_itself(session: Path) -> None:
    """Columns that were written by the inverse of a reading balance the arm only in that reading."""
    data = armrs.load_dataset(session)
    recordings: list[Any] = [(t.t, t.q, t.force_on_arm, None) for t in data.trials]
    motion = motion_of(recordings)
    assert motion is not None
    right = unexplained(data.model, motion)
    assert right < 0.02
    for reading in every_reading():
        turn = np.linalg.inv(reading.turn)
        undone = column_conventions.AlternativeConvention("", "", turn, -turn @ reading.shift, np.linalg.inv(reading.force))
        # The forces depend little on the angle of the hand: there a warning has to do.
        least = 1.2 if reading.place == "column q3" else 2.0
        assert unexplained(data.model, motion.read_as(undone)) > least * right
        assert unexplained(data.model, motion.read_as(undone).read_as(reading)) == pytest.approx(right, rel=1e-6)
