"""Results over sessions: kept, tested, drawn, and files that are refused."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import signal
import sqlite3
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs import BadInput, Identified
from armrs.analysis.significance import CHANGE_LEVEL, holm
from armrs.cli import main
from armrs.workflows import courses
from armrs.workflows import history as sessions
from sessions import again, folder_again


@pytest.fixture(scope="module")
def identified(slow_arm: Path) -> Identified:
    return armrs.identify(armrs.load_dataset(slow_arm), with_effects=["coulomb"])


def moved(result: Identified, by: dict[str, float]) -> Identified:
    """The same result with some values changed, by name."""
    shifted = [tuple(_shifted(e, by.get(e.name, 0.0)) for e in part) for part in (result.parameters, result.combinations)]
    return dataclasses.replace(result, result=result.result.replace(parameters=shifted[0], combinations=shifted[1]))


def _shifted(e: armrs.Estimate, by: float) -> armrs.Estimate:
    return e.replace(value=e.value + by, interval=(e.interval[0] + by, e.interval[1] + by))


def test_a_change_is_found_and_the_rest_is_not(identified: Identified, tmp_path: Path) -> None:
    file = tmp_path / "subject.sqlite"
    std = next(sessions._deviation(e, 0.95) for e in identified.combinations if e.name == "m2*l2")
    for k, date in enumerate(("2026-01-05", "2026-02-03", "2026-03-04")):
        courses = sessions.add(file, again(moved(identified, {"m2*l2": 0.2 * k * std}), k), date).courses
        assert not any(c.changed for c in courses)
    courses = sessions.add(file, again(moved(identified, {"m2*l2": 8.0 * std}), 3), "2026-04-02").courses
    assert [c.label for c in courses if c.changed] == ["m2·l2"]
    course = next(c for c in courses if c.name == "m2*l2")
    assert course.dates == ("2026-01-05", "2026-02-03", "2026-03-04", "2026-04-02")
    # Three equal deviations: their mean is surer by the root of three.
    assert course.change == pytest.approx((8.0 - 0.2) * std) and course.change_std == pytest.approx(std * np.sqrt(4.0 / 3.0))


def test_no_more_than_one_in_fifty_is_called_changed() -> None:
    draw = np.random.default_rng(8)
    false = 0
    for _ in range(400):
        p_values = [courses.change([("d", draw.standard_normal(), 1.0, 0) for _ in range(3)])[2] for _ in range(8)]
        false += min(holm(p_values)) < CHANGE_LEVEL
    assert false / 400 < 0.02 + 3 * np.sqrt(0.02 * 0.98 / 400)


def test_sessions_compare_when_the_data_decided_the_same(identified: Identified, tmp_path: Path) -> None:
    file = tmp_path / "subject.sqlite"
    bound = tuple(e.replace(decided_by="bound") if (e.name, e.joint) == ("torque", 2) else e for e in identified.parameters)
    sessions.add(file, dataclasses.replace(identified, result=identified.result.replace(parameters=bound)), "2026-01-05")
    courses = sessions.add(file, again(identified, 1), "2026-02-03").courses
    alone = [(c.kind, c.joint) for c in courses if np.isnan(c.change)]
    assert ("coulomb", 2) in alone and ("coulomb", 1) not in alone and ("combination", None) not in alone


def test_the_same_session_replaces_itself_and_order_is_by_date(identified: Identified, tmp_path: Path) -> None:
    file = tmp_path / "subject.sqlite"
    assert not sessions.add(file, identified, "2026-03-01").warnings
    (line,) = sessions.add(file, identified, "2026-03-01").warnings
    assert "on 2026-03-01 is replaced" in line
    sessions.add(file, again(identified, 1), "2026-01-01")
    assert all(c.dates == ("2026-01-01", "2026-03-01") and c.change == 0.0 for c in sessions.read(file).courses)


def test_a_result_without_intervals_takes_no_place(identified: Identified, tmp_path: Path) -> None:
    file = tmp_path / "subject.sqlite"
    before = sessions.add(file, identified, "2026-03-01").courses
    without = {
        part: tuple(e.replace(interval=(np.nan, np.nan)) for e in getattr(identified, part)) for part in ("parameters", "combinations")
    }
    empty = dataclasses.replace(identified, result=identified.result.replace(**without))
    (line,) = sessions.add(file, empty, "2026-03-01").warnings
    assert "has an interval" in line
    assert [(c.label, c.dates) for c in sessions.read(file).courses] == [(c.label, c.dates) for c in before]


def test_a_session_in_another_unit_is_told(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A history whose units were altered was compared without these sessions, and nothing said so."""
    file = tmp_path / "s.sqlite"
    verb = ["--with", "coulomb", "--json", str(tmp_path / "r.json"), "--history", str(file), "--date"]
    assert main(["identify", str(slow_arm), *verb, "2026-01-01"]) == 0
    with contextlib.closing(sqlite3.connect(file)) as connection:
        connection.execute("UPDATE estimate SET unit = 'N mm' WHERE kind = 'coulomb' AND joint = 2")
        connection.commit()
    capsys.readouterr()
    assert main(["identify", str(folder_again(slow_arm, tmp_path / "again")), *verb, "2026-02-01"]) == 0
    said = "warning: history, coulomb torque of joint 2: found 'N mm' on 2026-01-01, allowed 'N m' as in the last session: not compared"
    assert [line for line in capsys.readouterr().err.splitlines() if "history" in line] == [said]
    courses = json.loads((tmp_path / "r.json").read_text())["history"]
    assert {(c["kind"], c["joint"]): len(c["dates"]) for c in courses if c["kind"] == "coulomb"} == {("coulomb", 1): 2, ("coulomb", 2): 1}


@pytest.mark.long
def test_the_verb(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "s.sqlite"
    for folder, date in ((slow_arm, "2026-01-01"), (folder_again(slow_arm, tmp_path / "again"), "2026-02-01")):
        out = ["-o", str(tmp_path / "out"), "--json", str(tmp_path / "r.json")]
        assert main(["identify", str(folder), "--with", "coulomb", "--history", str(file), "--date", date, *out]) == 0
    assert "Over the sessions" in capsys.readouterr().out
    history = json.loads((tmp_path / "r.json").read_text())["history"]
    assert {"m2*l2", "torque"} <= {h["name"] for h in history} and all(h["dates"] == ["2026-01-01", "2026-02-01"] for h in history)
    assert (tmp_path / "out/figures/history.png").stat().st_size > 10_000


def named(result: Identified, name: str, subject: str | None = None) -> Identified:
    """The same result of another recording of another name, or of a subject that is named."""
    other = again(result, len(name))
    return dataclasses.replace(other, dataset=other.dataset.replace(name=name, subject=armrs.Subject(name=subject)))


def test_the_history_of_another_subject_is_refused(identified: Identified, tmp_path: Path) -> None:
    file = tmp_path / "s1.sqlite"
    sessions.add(file, named(identified, "S1 2026-03-14"), "2026-03-14")
    assert len(sessions.add(file, named(identified, "2026-04-11 (S1)"), "2026-04-11").courses[0].dates) == 2
    assert len(sessions.add(file, named(identified, "follow-up", "S1"), "2026-05-09").courses[0].dates) == 3
    before = file.read_bytes()
    for other in (named(identified, "S2 2026-03-14"), named(identified, "S1 2026-03-14", "S2")):
        with pytest.raises(BadInput, match=r"s1\.sqlite: history: found the history of 'S1', allowed that of 'S2': one subject a file"):
            sessions.add(file, other, "2026-06-01")
    with pytest.raises(BadInput, match="found a data set '2026-06-01' that names no subject"):
        sessions.add(file, named(identified, "2026-06-01"), "2026-06-01")
    assert file.read_bytes() == before


def test_a_history_of_an_older_version_belongs_to_its_first_data_set(identified: Identified, tmp_path: Path) -> None:
    file = tmp_path / "old.sqlite"
    _written(file, "DROP TABLE subject", "UPDATE session SET name = 'S1 2026-01-01'")
    with pytest.raises(BadInput, match="found the history of 'S1', allowed that of 'S2'"):
        sessions.add(file, named(identified, "S2"), "2026-02-01")
    sessions.add(file, named(identified, "S1"), "2026-02-01")
    with sqlite3.connect(file) as kept:
        assert kept.execute("SELECT name FROM subject").fetchall() == [("S1",)]
    kept.close()


def test_the_verb_refuses_another_subject(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "s.sqlite"
    _written(file)
    before = file.read_bytes()
    assert main(["identify", str(slow_arm), "--history", str(file), "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert "s.sqlite: --history: found the history of 'a', allowed that of" in error and error.count("\n") == 1
    assert file.read_bytes() == before and not (tmp_path / "out").exists()


def test_the_date_is_in_the_name_or_today() -> None:
    assert sessions.session_date("S1 2026-03-14") == "2026-03-14"
    assert sessions.session_date("S1 2026-03-14", "2025-01-02") == "2025-01-02"
    assert len(sessions.session_date("S1")) == 10
    with pytest.raises(BadInput, match=r"date: found '2026-02-30', allowed a date such as"):
        sessions.session_date("S1", "2026-02-30")


def test_a_session_stays_only_if_everything_else_was_written(identified: Identified, tmp_path: Path) -> None:
    """When an output fails, a new file disappears and an old one keeps what it had."""
    with pytest.raises(OSError, match="full"), sessions.adding(tmp_path / "a" / "b" / "s.sqlite", identified, "2026-01-01"):
        raise OSError("full")
    assert not (tmp_path / "a").exists()
    file = tmp_path / "s.sqlite"
    sessions.add(file, identified, "2026-01-01")
    with pytest.raises(OSError, match="full"), sessions.adding(file, again(identified, 1), "2026-02-01") as followed:
        assert followed.courses[0].dates == ("2026-01-01", "2026-02-01")
        raise OSError("full")
    assert all(course.dates == ("2026-01-01",) for course in sessions.read(file).courses)


def test_refuses_other_files(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "text.sqlite").write_text("no database, but long enough to look like one " * 30)
    with sqlite3.connect(tmp_path / "other.sqlite") as other:
        other.execute("CREATE TABLE x (y)")
    other.close()
    with sqlite3.connect(tmp_path / "three.sqlite") as three:
        three.executescript(f"PRAGMA application_id = {sessions.APPLICATION}; {sessions._SCHEMA}")
        three.execute(
            "INSERT INTO session (name, date, method, joints) VALUES (?, '2026-01-01', 'joint', 3)", (armrs.load_dataset(slow_arm).name,)
        )
    three.close()
    cases = {
        "text.sqlite": "found file is not a database",
        "other.sqlite": "found a database of another program",
        "three.sqlite": "found the history of an arm of 3 joints, allowed one of 2",
        ".": "found a folder",
        "s.json": "found a name that ends with .json, allowed another, such as .sqlite",
    }
    for name, message in cases.items():
        before = (tmp_path / name).read_bytes() if (tmp_path / name).is_file() else b""
        assert main(["identify", str(slow_arm), "--history", str(tmp_path / name), "-o", str(tmp_path / "out")]) == 2
        error = capsys.readouterr().err
        assert message in error and error.count("\n") == 1, error
        assert not before or (tmp_path / name).read_bytes() == before
    assert main(["identify", str(slow_arm), "--date", "2026-01-01"]) == 2
    assert not (tmp_path / "out").exists()


def _written(file: Path, *changes: str) -> None:
    """Write a history with one estimate, and then change it by hand."""
    with sqlite3.connect(file) as made:
        made.executescript(f"PRAGMA application_id = {sessions.APPLICATION}; {sessions._SCHEMA} {sessions._WHOSE}")
        made.execute("INSERT INTO subject VALUES ('a')")
        made.execute("INSERT INTO session (name, date, method, joints) VALUES ('a', '2026-01-01', 'joint', 2)")
        made.execute("INSERT INTO estimate VALUES (1, 'm2*l2', 'combination', 0, 0.13, 0.001, 'kg m', 'data')")
        for change in changes:
            made.execute(change)
    made.close()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("DROP TABLE estimate", "a history with other tables than armrs makes"),
        ("DROP TABLE session", "a history with other tables than armrs makes"),
        ("ALTER TABLE session ADD COLUMN x", "a history with other tables than armrs makes"),
        ("CREATE TRIGGER t BEFORE INSERT ON session BEGIN SELECT raise(ABORT, 'no'); END", "a history with other tables than armrs makes"),
        ("UPDATE estimate SET value = 'abc'", "a history in which a value is invalid"),
        ("UPDATE estimate SET value = 9e999", "a history in which a value is invalid"),
        ("UPDATE estimate SET std = -1", "a history in which a value is invalid"),
        ("UPDATE session SET date = 'yesterday'", "a history in which a date is invalid"),
        ("UPDATE session SET joints = 'x'", "a history in which a number of joints is invalid"),
        ("INSERT INTO subject VALUES ('b')", "a history in which there are two subjects"),
        ("UPDATE subject SET name = ''", "a history in which a subject has no name"),
    ],
)
def test_refuses_a_history_that_was_changed_by_hand(tmp_path: Path, change: str, message: str) -> None:
    file = tmp_path / "s.sqlite"
    _written(file)
    sessions.check(file, 2, "a")
    file.unlink()
    _written(file, change)
    before = file.read_bytes()
    for ask in (lambda: sessions.check(file, 2, "a"), lambda: sessions.read(file)):
        with pytest.raises(BadInput, match=rf"s\.sqlite: history: found {message}, allowed a history that armrs wrote"):
            ask()
    assert file.read_bytes() == before


@pytest.mark.parametrize("keep", [1, 15, 50, 100, 4096, 8192])
def test_refuses_a_history_that_is_cut_off(tmp_path: Path, keep: int) -> None:
    file = tmp_path / "s.sqlite"
    _written(file)
    file.write_bytes(file.read_bytes()[:keep])
    with pytest.raises(BadInput, match=r"s\.sqlite: history: found "):
        sessions.check(file, 2, "a")
    assert file.stat().st_size == keep


@pytest.mark.parametrize("at", [20, 100, 4096, 8192, 12288])
def test_refuses_a_history_that_is_damaged(tmp_path: Path, at: int) -> None:
    file = tmp_path / "s.sqlite"
    _written(file)
    content = bytearray(file.read_bytes())
    content[at : at + 400] = bytes(range(200)) * 2
    file.write_bytes(bytes(content[: file.stat().st_size]))
    with pytest.raises(BadInput, match=r"s\.sqlite: history: found "):
        sessions.check(file, 2, "a")


def test_refuses_a_history_whose_damage_is_no_text(tmp_path: Path) -> None:
    """SQLite names what it cannot read, in bytes that are no UTF-8."""
    file = tmp_path / "s.sqlite"
    _written(file)
    content = file.read_bytes()
    assert content.count(b"CREATE TABLE subject ") == 1
    file.write_bytes(content.replace(b"CREATE TABLE subject ", b"CREATE TABLE\xff\xffsubject"))
    for ask in (lambda: sessions.check(file, 2, "a"), lambda: sessions.read(file)):
        with pytest.raises(BadInput, match=r"s\.sqlite: history: found "):
            ask()


@pytest.mark.parametrize("given", ["20260101", "2026-W01-1", "2026-1-1", " 2026-01-01", "", 3, b"2026-01-01"])
def test_a_date_has_one_form(given: object) -> None:
    with pytest.raises(BadInput, match="date: found "):
        sessions.session_date("S1", given)  # type: ignore[arg-type]


def test_a_place_that_cannot_be_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="found File name too long"):
        sessions.check(tmp_path / ("a" * 300), 2, "a")
    with pytest.raises(BadInput, match="history: found 3, allowed a path"):
        sessions.check(3, 2, "a")  # type: ignore[arg-type]


def test_additions_at_the_same_time_all_stay(identified: Identified, tmp_path: Path) -> None:
    file = tmp_path / "one.sqlite"
    dates = [f"2026-03-{day:02d}" for day in range(1, 13)]
    with ThreadPoolExecutor(max_workers=len(dates)) as pool:
        list(pool.map(lambda k: sessions.add(file, again(identified, k), dates[k]), range(len(dates))))
    assert set(sessions.read(file).courses[0].dates) == set(dates)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
@pytest.mark.parametrize("after", ["executescript", "_insert"])
def test_a_kill_while_a_history_is_made_leaves_one_that_is_accepted(identified: Identified, tmp_path: Path, after: str) -> None:
    file = tmp_path / "one.sqlite"
    child = os.fork()
    if child == 0:  # the process that is killed in the midst of its transaction
        connection = sqlite3.connect(file)
        connection.executescript(
            f"BEGIN IMMEDIATE; PRAGMA application_id = {sessions.APPLICATION}; {sessions._SCHEMA} {sessions._WHOSE} {sessions._ARM}"
        )
        if after == "_insert":
            sessions._insert(connection, identified, "2026-03-01")
        os.kill(os.getpid(), signal.SIGKILL)
    os.waitpid(child, 0)
    sessions.add(file, identified, "2026-03-02")
    assert sessions.read(file).courses[0].dates == ("2026-03-02",)


def test_a_session_that_is_added_later_is_compared_with_the_one_before_it(identified: Identified, tmp_path: Path) -> None:
    """The page of a session of January that was added in April stated the change of April."""
    file = tmp_path / "s.sqlite"
    std = next(sessions._deviation(e, 0.95) for e in identified.combinations if e.name == "m2*l2")
    for k, date in enumerate(("2026-01-05", "2026-03-04", "2026-04-02")):
        sessions.add(file, again(moved(identified, {"m2*l2": 10.0 * k * std}), k), date)
    found = sessions.add(file, again(moved(identified, {"m2*l2": 4.0 * std}), 3), "2026-02-03")
    course = next(c for c in found.courses if c.name == "m2*l2")
    assert (found.date, course.dates, found.later) == ("2026-02-03", ("2026-01-05", "2026-02-03"), ("2026-03-04", "2026-04-02"))
    assert course.before.date == course.first.date == "2026-01-05" and course.before.value == pytest.approx(4.0 * std)
    assert found.warnings == ("history: 2026-02-03 is compared with earlier sessions only, not with 2026-03-04, 2026-04-02",)
    last = next(c for c in sessions.read(file).courses if c.name == "m2*l2")
    assert (last.before.date, last.first.date) == ("2026-03-04", "2026-01-05")
    assert (last.before.value, last.first.value) == (pytest.approx(10.0 * std), pytest.approx(20.0 * std))


def of_side(result: Identified, side: str | None, number: int) -> Identified:
    """The result of another recording of one arm, by the same name."""
    other = again(result, number)
    return dataclasses.replace(other, dataset=other.dataset.replace(subject=other.dataset.subject.replace(side=side)))


def test_sessions_compare_with_those_of_the_same_arm_and_with_the_other_one(identified: Identified, tmp_path: Path) -> None:
    """Left and right of one day have the same name; the second took the place of the first."""
    file = tmp_path / "s.sqlite"
    std = next(sessions._deviation(e, 0.95) for e in identified.combinations if e.name == "m2*l2")
    number = 0
    for date, left, right in (("2026-01-05", 0.0, 20.0), ("2026-02-03", 9.0, 20.5)):
        for side, by in (("left", left), ("right", right)):
            number += 1
            found = sessions.add(file, of_side(moved(identified, {"m2*l2": by * std}), side, number), date)
    course = next(c for c in found.courses if c.name == "m2*l2")
    assert found.side == "right" and course.dates == ("2026-01-05", "2026-02-03") and not course.before.clear
    assert course.before.value == pytest.approx(0.5 * std)
    assert course.other_arm.date == "2026-02-03" and course.other_arm.value == pytest.approx(11.5 * std) and course.other_arm.clear
    left = sessions.add(file, of_side(moved(identified, {"m2*l2": 9.0 * std}), "left", 3), "2026-02-03")
    course = next(c for c in left.courses if c.name == "m2*l2")
    assert course.before.clear and course.before.value == pytest.approx(9.0 * std)
    assert "is replaced" in left.warnings[-1]


def test_a_side_that_is_stated_later_takes_the_place_of_none(identified: Identified, tmp_path: Path) -> None:
    file = tmp_path / "s.sqlite"
    sessions.add(file, identified, "2026-01-05")
    found = sessions.add(file, of_side(identified, "left", 1), "2026-02-03")
    assert all(np.isnan(c.before.value) for c in found.courses)
    (line,) = found.warnings
    assert line.startswith("history, side: found none on 2026-01-05, allowed left as in this session: not compared; state it in [subject]")
    (none,) = sessions.add(file, again(identified, 2), "2026-03-01").warnings
    assert none.startswith("history, side: found none in this session, allowed left as on 2026-02-03")
    sessions.add(
        file,
        dataclasses.replace(identified, dataset=identified.dataset.replace(subject=identified.dataset.subject.replace(side="left"))),
        "2026-01-05",
    )
    found = sessions.add(file, of_side(identified, "left", 1), "2026-02-03")
    assert all(c.dates == ("2026-01-05", "2026-02-03") for c in found.courses)


def test_one_recording_is_one_session(identified: Identified, slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The same files with another date counted as a second session, in which nothing had changed."""
    file = tmp_path / "s.sqlite"
    sessions.add(file, identified, "2026-01-05")
    said = r"found the recording that it has as 'slow arm' on 2026-01-05, sample for sample, allowed another recording for the session on"
    with pytest.raises(BadInput, match=said):
        sessions.add(file, identified, "2026-02-03")
    assert main(["passive", str(slow_arm), "--history", str(file), "--date", "2026-02-03", "-o", str(tmp_path / "out")]) == 2
    assert "(--date 2026-01-05 replaces that result)" in capsys.readouterr().err and not (tmp_path / "out").exists()
    sessions.add(tmp_path / "sides.sqlite", of_side(identified, "left", 0), "2026-01-05")
    with pytest.raises(
        BadInput, match="of the left arm, sample for sample, allowed another recording for the session on 2026-01-05 of the right"
    ):
        sessions.add(tmp_path / "sides.sqlite", of_side(identified, "right", 0), "2026-01-05")
    # By another name on the same day it is the same session.
    renamed = dataclasses.replace(identified, dataset=identified.dataset.replace(name="slow arm b", subject=armrs.Subject(name="slow arm")))
    found = sessions.add(file, renamed, "2026-01-05")
    assert all(c.dates == ("2026-01-05",) for c in found.courses)


def test_a_date_in_the_future_is_refused(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["identify", str(slow_arm), "--history", str(tmp_path / "s.sqlite"), "--date", "2226-03-14"]) == 2
    error = capsys.readouterr().err
    assert "--date: found 2226-03-14, which is in the future, allowed a date up to today, " in error and error.count("\n") == 1
    assert not (tmp_path / "s.sqlite").exists()


def test_the_range_of_a_protocol_is_not_tested_for_a_change() -> None:
    """It was chosen: it took part in the test of change, and in Holm's correction of the others."""
    from armrs.workflows import courses

    points = [("2026-01-05", 1.0, 0.1, 1), ("2026-02-03", 1.4, 0.1, 2)]
    keys = [(f"{name} in slow", "passive", 2, unit) for name, unit in (("half_width", "N m"), ("range", "rad"))]
    followed = dict.fromkeys(keys, points)
    half_width, moved = courses._courses(followed, [points] * 2, [points] * 2)
    assert half_width.p_value == pytest.approx(courses.change(points)[2]) and half_width.changed
    assert np.isnan([moved.p_value, moved.change, moved.before.p_value, moved.first.p_value, moved.other_arm.p_value]).all()
    assert not moved.changed and moved.values.tolist() == [1.0, 1.4]


def test_movements_of_other_speeds_are_not_compared() -> None:
    """What resists depends on the speed: a changed protocol looked like a change of the joint."""
    from armrs.workflows import courses

    def history_at(*speeds: float) -> courses.History:
        with contextlib.closing(sqlite3.connect(":memory:")) as file:
            file.executescript(f"{sessions._SCHEMA} {sessions._ARM}")
            for k, speed in enumerate(speeds, start=1):
                file.execute("INSERT INTO session VALUES (?, 's', ?, 'passive', 2)", (k, f"2026-0{k}-05"))
                for name, value, unit in (("half_width", 0.2 + 0.2 * speed, "N m"), ("speed", speed, "rad/s")):
                    row = (k, f"{name} in slow", "passive", 2, value, 0.003, unit, "data")
                    file.execute("INSERT INTO estimate VALUES (?, ?, ?, ?, ?, ?, ?, ?)", row)
            return courses.history_of(file, "passive", "anna")

    other = history_at(0.435, 0.43, 0.6)
    half_width, speed = other.courses
    assert np.isnan(half_width.change) and half_width.before.date is None and not speed.changed
    line = "history, slow: found another speed of joint 2 on 2026-01-05, 2026-02-05, allowed that of this session up to 10 %: not compared"
    assert other.warnings == (line,)
    alike = history_at(0.435, 0.43, 0.45)
    assert alike.courses[0].before.date == "2026-02-05" and alike.warnings == ()
    # A joint that is held creeps at any speed.
    assert history_at(0.012, 0.02, 0.03).warnings == ()
