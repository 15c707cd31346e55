"""What surrounds recordings: folders with notes, workbooks beside their exports, positions of the handle, wrong statements, questions."""

from __future__ import annotations

import os
import pty
import re
import select
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import openpyxl
import pytest

import armrs
from armrs import cli
from armrs.errors import BadInput, BadInputs
from armrs.io.plausibility import handle_path
from test_import import KNOWN, SI, TRUE, Recording, recording, repeated, table, us_excel, write_text

__all__ = ["recording"]
LED = KNOWN.replace(robot=TRUE.robot)


def three(r: Recording, folder: Path) -> list[Path]:
    folder.mkdir(exist_ok=True)
    names, values = table(r, names=SI)
    return [write_text(folder / f"slow_{k}.csv", names, repeated(values, k)) for k in (1, 2, 3)]


def test_a_folder_may_hold_notes_and_other_files(recording: Recording, tmp_path: Path) -> None:
    raw = tmp_path / "raw"
    three(recording, raw)
    (raw / "notes.txt").write_text("Subject 7, right arm.\nStrap slipped in trial 2?\n", encoding="utf-8")
    (raw / "protocol.pdf").write_bytes(b"%PDF-1.4")
    write_text(raw / "weights.csv", ["segment", "mass [kg]"], np.column_stack([np.arange(1.0, 5.0), np.ones(4)]))
    done = armrs.import_recordings([raw], tmp_path / "set", model=KNOWN)
    assert len(done.recipe.trials) == 3
    left = [note for note in done.notes if note.startswith("left out")]
    assert len(left) == 3 and all(any(name in note for note in left) for name in ("notes.txt", "protocol.pdf", "weights.csv"))
    with pytest.raises(BadInput, match=r"notes\.txt: file: found no block of rows"):
        armrs.import_recordings([raw / "notes.txt"], tmp_path / "other", model=KNOWN)


def test_a_folder_without_recordings_says_what_it_holds(tmp_path: Path) -> None:
    (tmp_path / "raw" / "day 1").mkdir(parents=True)
    (tmp_path / "raw" / "day 1" / "slow_1.csv").write_text("t\n", encoding="utf-8")
    with pytest.raises(BadInput, match=r"a folder without recordings, .* \(name its folders: day 1\)"):
        armrs.import_recordings([tmp_path / "raw"], tmp_path / "set", model=KNOWN)


def test_one_folder_may_write_one_column_in_two_ways(recording: Recording, tmp_path: Path) -> None:
    """A workbook with a row of units, and text with the units in the names: eight lines for each file said that columns are missing."""
    book = openpyxl.Workbook()
    for number in (1, 2):
        sheet = book.active if number == 1 else book.create_sheet()
        assert sheet is not None
        sheet.title = f"slow {number}"
        sheet.append(["Zeit", "Schulter", "Ellbogen", "Kraft y", "Kraft z"])
        sheet.append(["s", "rad", "rad", "N", "N"])
        for row in np.column_stack([recording.t, recording.q - 0.01 * number, recording.force_on_robot]):
            sheet.append([float(x) for x in row])
    folder = tmp_path / "raw"
    folder.mkdir()
    book.save(folder / "Proband 07.xlsx")
    names = "Zeit [s],Schulter [rad],Ellbogen [rad],Kraft y [N],Kraft z [N]"
    for number in (1, 2):
        values = np.column_stack([recording.t, recording.q + 0.01 * number, recording.force_on_robot])
        np.savetxt(folder / f"fast {number}.csv", values, delimiter=",", header=names, comments="", fmt="%.9g")
    done = armrs.import_recordings([folder], tmp_path / "session", model=KNOWN)
    assert {(t.configuration, t.repeat) for t in done.recipe.trials} == {("slow", 1), ("slow", 2), ("fast", 1), ("fast", 2)}
    assert not any("not used" in note for note in done.notes)
    again = armrs.import_recordings([done.folder / "import.toml"], tmp_path / "again")
    first, second = (armrs.load_dataset(d.folder).trials for d in (done, again))
    assert all(np.array_equal(a.q, b.q) for a, b in zip(first, second, strict=True))


def test_a_workbook_beside_its_own_text_is_imported_once(recording: Recording, tmp_path: Path) -> None:
    """Each became a trial of its own: a test trial that had been fitted."""
    raw = tmp_path / "raw"
    raw.mkdir()
    book = us_excel(recording, raw)
    values = np.column_stack([recording.t, np.degrees(recording.q), recording.force_on_robot])
    names = ["Time (s)", "Shoulder (deg)", "Elbow (deg)", "Force Y (N)", "Force Z (N)"]
    write_text(raw / "slow_1_export.csv", names, np.round(values, 3))
    done = armrs.import_recordings([raw], tmp_path / "set", model=KNOWN)
    assert [t.file.rpartition("/")[2] for t in done.recipe.trials] == [book.name]
    assert any("holds the same samples as" in note and "slow_1_export.csv" in note for note in done.notes)


def test_positions_of_the_handle_become_angles_of_the_robot(recording: Recording, tmp_path: Path) -> None:
    """In millimetres, from an origin of the robot's own."""
    hand = np.cumsum(recording.q, axis=1)
    tip = 0.322 * np.column_stack([np.cos(hand[:, 0]), np.sin(hand[:, 0])]) + 0.264 * np.column_stack(
        [np.cos(hand[:, 1]), np.sin(hand[:, 1])]
    )
    values = np.column_stack([recording.t, recording.q, recording.force_on_robot, 1e3 * (tip - [0.8, -0.25])])
    path = write_text(tmp_path / "slow_1.csv", [*SI, "robot x [mm]", "robot y [mm]"], values)
    done = armrs.import_recordings([path], tmp_path / "set", model=LED)
    (trial,) = armrs.load_dataset(done.folder).trials
    assert trial.robot_q is not None and LED.robot is not None
    assert np.abs(handle_path(LED.robot, trial.robot_q) - tip).max() < 1e-3
    assert any("their origin lies at (0.800, -0.250) m" in note for note in done.notes)
    again = armrs.import_recordings([done.folder / "import.toml"], tmp_path / "again", model=LED)
    assert np.array_equal(armrs.load_dataset(again.folder).trials[0].robot_q, trial.robot_q)
    plain = armrs.import_recordings([path], tmp_path / "plain", model=KNOWN)
    assert any("the model has no [robot]" in note for note in plain.notes)
    with pytest.raises(BadInput, match=r"wherever their origin is.*--map Py=-COLUMN"):
        armrs.import_recordings([path], tmp_path / "turned", model=LED, columns_map="Py=-robot x [mm],Pz=robot y [mm]")


def test_a_wrong_statement_is_named_with_what_the_balance_says(recording: Recording, tmp_path: Path) -> None:
    """`--force-on arm` was answered with two conventions of which neither was right."""
    path = three(recording, tmp_path / "raw")[0]
    with pytest.raises(BadInput, match=r"^--force-on: found \d+ % of the contact torques unexplained .* forces on the robot"):
        armrs.import_recordings([path], tmp_path / "set", model=KNOWN, force_on="arm")
    assert armrs.import_recordings([path], tmp_path / "set", model=KNOWN, force_on="robot").recipe.convention.force_on == "robot"


def test_files_that_differ_are_all_named(recording: Recording, tmp_path: Path) -> None:
    """A later file in milliseconds, or with another name of a column: only the first was looked at."""
    one, two, three_ = three(recording, tmp_path / "raw")
    names, values = table(recording, names=SI, t=1e3)
    write_text(two, names, values)
    write_text(three_, ["t_s", "q1_rad", "elbow_rad", "Fy_N", "Fz_N"], table(recording, names=SI)[1])
    with pytest.raises(BadInputs) as refused:
        armrs.import_recordings([one, two, three_], tmp_path / "set", model=KNOWN)
    said = [str(problem) for problem in refused.value.problems]
    assert any(str(two) in line and "time in s, as in the first file" in line for line in said)
    assert any(str(three_) in line and "no column 'q2_rad'" in line for line in said)


def on_a_terminal(arguments: list[str], answers: bytes) -> str:
    """Run the command line on a terminal of its own, and answer its questions."""
    outer, inner = pty.openpty()
    command = [sys.executable, "-m", "armrs", *arguments]
    process = subprocess.Popen(command, stdin=inner, stdout=inner, stderr=inner, env={**os.environ, "TERM": "dumb"}, start_new_session=True)
    os.close(inner)
    os.write(outer, answers)
    said, end = b"", time.monotonic() + 60.0
    while time.monotonic() < end:
        if not select.select([outer], [], [], 0.2)[0]:
            if process.poll() is not None:
                break
            continue
        try:
            said += os.read(outer, 4096)
        except OSError:
            break
    process.wait(10.0)
    os.close(outer)
    return said.decode()


@pytest.mark.long
def test_columns_without_names_are_asked_for_with_a_guess(recording: Recording, tmp_path: Path) -> None:
    values = np.column_stack([recording.t, recording.q, recording.force_on_robot])
    path = write_text(tmp_path / "slow_1.csv", ["a", "b", "c", "d", "e"], values)
    KNOWN.write(tmp_path / "model.toml")
    arguments = ["import", str(path), "--model", str(tmp_path / "model.toml"), "-o", str(tmp_path / "set")]
    assert cli.main(arguments) == 2  # no terminal: no questions
    assert cli.main([*arguments, "--ask"]) == 2
    said = on_a_terminal(arguments, b"\n2\n\nf\nd\n5\n")
    assert "t, time (it increases in every sample) [a]" in said and "q1, angle of joint 1, shoulder" in said
    assert "found 'f', allowed a name or number of the list" in said
    (trial,) = armrs.load_dataset(tmp_path / "set").trials
    assert np.abs(trial.q - recording.q).max() < 1e-9 and trial.force_on_arm is not None


def test_one_clock_of_all_forces_is_one_line(recording: Recording, tmp_path: Path) -> None:
    """It was told once for each file."""
    (tmp_path / "raw").mkdir()
    for k in (1, 2, 3):
        _, values = table(recording, names=SI)
        q_and_f = repeated(values, k)
        write_text(tmp_path / "raw" / f"slow_{k}.csv", ["time [s]", "shoulder [rad]", "elbow [rad]"], q_and_f[:, :3])
        forces = np.column_stack([recording.t + 1.3, q_and_f[:, 3:]])
        write_text(tmp_path / "raw" / f"slow_{k}_force.csv", ["time [s]", "Fy [N]", "Fz [N]"], forces)
    done = armrs.import_recordings([tmp_path / "raw"], tmp_path / "session", model=KNOWN)
    [line] = [note for note in done.notes if "forces shifted by" in note]
    assert re.match(r"forces shifted by -1\.30\d s ± \S+ s \(.*slow_1_force\.csv and 2 more\)$", line), line
