"""Every problem of a data set at once, each with its next step."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import armrs
import patients
from armrs import cli, demo
from armrs.workflows.check_dataset import Ability, Checked, Problem, check_dataset, grouped
from armrs.workflows.gap.data_checks import examine
from test_import import KNOWN, SI, Recording, recording, repeated, table, write_text

__all__ = ["recording"]


@pytest.fixture(scope="module")
def session(recording: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("checked")
    names, values = table(recording, names=SI)
    files = [write_text(folder / f"{name}_{k}.csv", names, repeated(values, seed)) for seed, (name, k) in enumerate(TRIALS)]
    return armrs.import_recordings(files, folder / "set", model=KNOWN).folder


TRIALS = [(name, k) for name in ("slow", "reach") for k in (1, 2, 3)]
Change = Callable[[np.ndarray], np.ndarray]


def changed(session: Path, folder: Path, changes: dict[str, Change], header: dict[str, str] | None = None) -> Path:
    """Return a copy of a session with other samples in some trials, and other names in their headers."""
    shutil.copytree(session, folder)
    for name, change in changes.items():
        path = folder / "trials" / f"{name}.csv"
        head = (header or {}).get(name, path.read_text(encoding="utf-8").splitlines()[0])
        write_text(path, head.split(","), change(np.genfromtxt(path, delimiter=",", skip_header=1)))
    return folder


def late(samples: np.ndarray, by: int = 30) -> np.ndarray:
    return np.column_stack([samples[:, :3], np.roll(samples[:, 3:], by, axis=0)])


def same(samples: np.ndarray) -> np.ndarray:
    return samples


NO_ROBOT = "no [robot] in the model and no robot angles (qr1, qr2): so all trials are compared by joint torques"
"""What is said of a session that is sound but for that."""


def besides(problems: Sequence[Problem]) -> list[str]:
    """Return what is said besides that no robot was recorded, which is said once."""
    robot, others = [[p.text for p in problems if p.text.startswith(NO_ROBOT) is about] for about in (True, False)]
    assert len(robot) == 1
    return others


def test_a_sound_session_has_no_problem_but_that_it_has_no_robot(session: Path) -> None:
    problems = check_dataset(session).problems
    assert besides(problems) == []
    assert [p.next_step for p in problems] == [
        "nothing if no robot leads the arm; otherwise add what is missing"
    ]  # to leave all of them out leaves none


def test_forces_on_another_clock_are_named(session: Path, tmp_path: Path) -> None:
    one = check_dataset(changed(session, tmp_path / "one", {"slow_2": late})).problems
    assert besides(one) == ["trials/slow_2.csv: forces are about 0.3 s late against the angles"]
    everything = {f"{name}_{k}": lambda s: late(s, -30) for name, k in TRIALS}
    [line] = besides(grouped(check_dataset(changed(session, tmp_path / "all", everything)).problems))
    assert line.endswith("and 5 more: forces are about 0.3 s early against the angles")


@pytest.mark.long
def test_a_robot_that_stands_elsewhere_than_the_model_says_is_told(tmp_path: Path) -> None:
    """Two centimetres were named as play of the handle."""
    dataset = demo.measure(demo.true_model())
    robot = dataset.model.robot
    assert robot is not None
    moved = dataset.model.replace(robot=robot.replace(base=(robot.base[0] + 0.02, robot.base[1])))
    told = [
        [p.text for p in check_dataset(armrs.write_dataset(dataset.replace(model=model), tmp_path / name)).problems if "handle" in p.text]
        for name, model in (("right", dataset.model), ("moved", moved))
    ]
    assert told[0] == [] and len(told[1]) == 1
    # The sensors of the demonstration are off by a millimetre.
    assert re.fullmatch(r"hand and handle: -2[01] mm forward and .[01] mm up from each other on average, allowed 10 mm", told[1][0])
    # `gap` begins with the same words: it alone would name an effect.
    assert told[1][0] in examine(dataset.replace(model=moved), led=True)


def test_forces_in_kilonewtons_are_not_a_wrong_body_mass_as_well(tmp_path: Path) -> None:
    dataset = demo.measure(demo.true_model())
    kilo = [replace(t, force_on_arm=None if t.force_on_arm is None else 1e-3 * t.force_on_arm) for t in dataset.trials]
    told = [p.text for p in check_dataset(armrs.write_dataset(dataset.replace(trials=tuple(kilo)), tmp_path / "kilo")).problems]
    assert sum("(kN labelled as N, or N as mN?)" in text for text in told) == 1
    assert not [text for text in told if "times the masses" in text]


def test_every_problem_is_listed_with_its_next_step(session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Only the first was told of a file, and one refusal hid the tests after it."""

    def in_milliseconds(samples: np.ndarray) -> np.ndarray:
        return samples * [1000.0, 60.0, 1.0, 1.0, 1.0]

    def dead(samples: np.ndarray) -> np.ndarray:
        return np.column_stack([samples[:, :3], np.ones((len(samples), 2))])

    limit = np.quantile(np.genfromtxt(session / "trials" / "slow_1.csv", delimiter=",", skip_header=1)[:, 3], 0.8)

    def cut(samples: np.ndarray) -> np.ndarray:
        return np.column_stack([samples[:, :3], np.minimum(samples[:, 3], limit), samples[:, 4]])

    folder = changed(
        session, tmp_path / "set",
        {"slow_1": in_milliseconds, "slow_2": dead, "reach_1": same, "reach_2": lambda s: s[::2]},
        {"reach_1": "t_s,q1_grad,q2_rad,Fy_N,Fzz_N"},
    )  # fmt: skip
    shutil.copy(folder / "trials" / "reach_2.csv", folder / "trials" / "reach_3.csv")
    problems = check_dataset(folder).problems
    assert all(p.next_step for p in problems)
    for words in (
        "slow_1.csv: time: found 10 s between samples", "slow_1.csv: line 2, column q1_rad", "reach_1.csv: header: found 'q1_grad'",
        "found unknown column 'Fzz_N'", "slow_2.csv: column Fy: found", "slow_2.csv: column Fz: found", "samples: found those of",
    ):  # fmt: skip
        assert any(words in p.text for p in problems), words
    assert cli.main(["check", str(folder)]) == 1
    assert capsys.readouterr().out.endswith(f"Next: correct the errors above, then armrs check {folder} again\n")
    lines = check_dataset(
        changed(session, tmp_path / "more", {f"{name}_{k}": cut for name, k in TRIALS} | {"reach_2": lambda s: cut(s)[::2]})
    ).problems
    # No step leaves every trial out.
    assert [p.next_step for p in lines if "Fy stays at" in p.text] == ["record with a larger range of the sensor"]
    assert any("50 samples a second, where others have 100" in p.text for p in lines)


def test_of_two_rates_in_halves_one_that_was_recorded_is_told(session: Path, tmp_path: Path) -> None:
    """It was: 25 and 50 samples a second, where most trials have 37.5."""
    halves: dict[str, Change] = {f"slow_{k}": lambda s: s[::2] for k in (1, 2, 3)}
    told = [p.text for p in check_dataset(changed(session, tmp_path / "halves", halves)).problems if "samples a second" in p.text]
    assert told and all("50 samples a second, where others have 100" in text for text in told)


def test_a_repeat_that_broke_off_is_named(session: Path, tmp_path: Path) -> None:
    assert besides(check_dataset(changed(session, tmp_path / "a", {"slow_2": lambda s: s[: int(0.75 * len(s))]})).problems) == []
    folder = changed(session, tmp_path / "set", {name: lambda s: s[: len(s) // 2] for name in ("slow_2", "reach_3")})
    problems = grouped(check_dataset(folder).problems)
    whole = np.genfromtxt(session / "trials" / "slow_1.csv", delimiter=",", skip_header=1)[:, 0]
    long, half = whole[-1] - whole[0], whole[len(whole) // 2 - 1] - whole[0]
    lines = [f"trials/{name}.csv lasts {half:.1f} s, its repeats {long:.1f} s" for name in ("slow_2", "reach_3")]
    assert sorted(besides(problems)) == sorted(lines)
    assert {p.next_step for p in problems if "lasts" in p.text} == {"record this repeat again, or nothing if it was ended on purpose"}


@pytest.mark.long
def test_of_stretches_the_reflex_is_asked_for_and_no_test_trial(session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nothing was said of `spasticity`, and that the gap cannot be measured was a warning."""
    stretches = patients.session(patients.Patient(), 7001, emg=True)

    def with_faults(t: armrs.Trial) -> armrs.Trial:
        biceps = t.emg["emg_biceps_uV"]
        return replace(t, emg={"emg_biceps_uV": biceps.clip(-12.0, 12.0), "emg_triceps_uV": 0.0 * biceps})

    folder = armrs.write_dataset(stretches.replace(trials=tuple(map(with_faults, stretches.trials))), tmp_path / "stretches").parent
    found = check_dataset(folder)
    assert found.verbs[0] == Ability("spasticity", True, f"{len(stretches.trials)} stretches of the elbow at several speeds")
    assert not [p for p in found.problems if "role" in p.text]
    assert "without trials with role" in next(v.why for v in found.verbs if v.verb == "gap")
    faults = [p.text for p in found.problems if "emg_" in p.text and "active" not in p.text]
    assert len(faults) == 2 and "emg_biceps_uV stays at" in faults[0] and "emg_triceps_uV is constant: a dead channel?" in faults[1]
    assert cli.main(["check", str(folder)]) == 0
    assert "Next: armrs spasticity" in capsys.readouterr().out
    for verb in ("spasticity", "passive", "identify", "gap"):
        assert cli.main([verb, str(folder)]) == 0
        told = capsys.readouterr()
        assert all(words in told.out + told.err for words in ("saturated?", "a dead channel?")), verb
    assert "spasticity" not in {v.verb for v in check_dataset(session).verbs}


def test_two_joints_are_not_one_problem_and_one_more() -> None:
    """It was: joint 1 moves by 0.0011 rad in the fit trials and 1 more: what holds it cannot be told."""
    of_joints = [Problem("warning", f"joint {k} moves by 0.00{k} rad: what holds it cannot be determined", "move it") for k in (1, 2)]
    assert grouped(of_joints) == of_joints
    of_files = [Problem("warning", f"trials/slow_{k}.csv: one cause", "look") for k in (1, 2)]
    assert [p.text for p in grouped(of_files)] == ["trials/slow_1.csv and 1 more: one cause"]


def test_angles_in_degrees_are_one_line(session: Path, tmp_path: Path) -> None:
    """Each trial and joint had a line of its own, with its own row and value."""
    degrees: dict[str, Change] = {f"{name}_{k}": lambda s: s * [1.0, 180.0 / np.pi, 180.0 / np.pi, 1.0, 1.0] for name, k in TRIALS}
    [problem] = grouped(check_dataset(changed(session, tmp_path / "set", degrees)).problems)
    assert re.search(
        r"_1\.csv and 5 more: line \d+, columns q1_rad, q2_rad: found -?[\d.]+, allowed .* \(looks like degrees\)$", problem.text
    )


def test_a_column_that_is_missing_is_not_to_be_removed(session: Path, tmp_path: Path) -> None:
    head = (session / "trials" / "slow_1.csv").read_text(encoding="utf-8").splitlines()[0]
    for name, (old, said) in {"angle": ("q2_rad", "no column for q2"), "force": ("Fz_N", "no column for Fz")}.items():
        folder = changed(session, tmp_path / name, {"slow_1": same}, {"slow_1": head.replace(old, "emg_x")})
        (problem,) = [p for p in check_dataset(folder).problems if said in p.text]
        assert problem.next_step == "add the column, or give this name to the one that holds it"


@pytest.mark.parametrize("model", [True, False])
def test_a_trial_that_is_missing_is_named_by_its_entry(model: bool, session: Path, tmp_path: Path) -> None:
    """Without a model, too, where the joints are counted in the header."""
    folder = changed(session, tmp_path / "set", {})
    trials = folder / "trials"
    (trials / "slow_2.csv").rename(trials / "slow-2.csv")
    if not model:
        (folder / "model.toml").unlink()
    number = [t.file for t in armrs.load_dataset(session).trials].index("trials/slow_2.csv") + 1
    said = f"slow_2.csv: [[trial]] {number} of dataset.toml: no such file (in that folder and in no entry: "
    (problem,) = [p for p in check_dataset(folder).problems if said in p.text]
    assert problem.text.endswith("slow-2.csv)") and problem.next_step == "correct the file, or its name in dataset.toml"
    for path in trials.iterdir():
        path.rename(path.with_suffix(".txt"))
    (problem,) = [p for p in grouped(check_dataset(folder).problems) if "[[trial]] 1 of dataset.toml" in p.text]
    assert problem.text.endswith("and 5 more: [[trial]] 1 of dataset.toml: no such file")


@pytest.mark.parametrize("role", ["fit", "test"])
def test_a_trial_without_samples_is_told(role: str, session: Path, tmp_path: Path) -> None:
    """It was passed over: a fit trial that every verb refuses, and a test trial that is left out."""
    folder = changed(session, tmp_path / "set", {})
    entry = next(t for t in armrs.load_dataset(folder).trials if t.role == role)
    path = folder / entry.file
    path.write_text(path.read_text(encoding="utf-8").splitlines()[0] + "\n", encoding="utf-8")
    [told] = [p for p in check_dataset(folder).problems if "no samples below the header" in p.text]
    assert told.level == ("error" if role == "fit" else "warning") and entry.file in told.text
    assert role == "fit" or told.next_step == "record this movement again, or remove its [[trial]]"


def test_a_folder_without_a_data_set_is_another_folder(tmp_path: Path) -> None:
    """The next step was to correct the file, or its name in a dataset.toml that is not there."""
    [told] = check_dataset(tmp_path).problems
    assert told.next_step == "give the folder that armrs import, record or demo wrote"


def test_the_next_step_fits_the_cell(session: Path, tmp_path: Path) -> None:
    """Of a decimal comma and of a column that stands twice it was: correct its unit, its sign, or its values."""
    folder = changed(session, tmp_path / "set", {"slow_1": same, "slow_2": same})
    first, second = folder / "trials" / "slow_1.csv", folder / "trials" / "slow_2.csv"
    head, _, rows = first.read_text(encoding="utf-8").partition("\n")
    quoted = "\n".join(",".join(f'"{cell.replace(".", ",")}"' for cell in row.split(",")) for row in rows.splitlines())
    first.write_text(f"{head}\n{quoted}\n", encoding="utf-8")
    head, _, rows = second.read_text(encoding="utf-8").partition("\n")
    second.write_text(f"{head},q1_rad\n" + "\n".join(f"{row},0.5" for row in rows.splitlines()) + "\n", encoding="utf-8")
    steps = {Path(p.text.partition(":")[0]).name: p.next_step for p in check_dataset(folder).problems if p.level == "error"}
    assert steps["slow_1.csv"] == "write decimal points, or import the recording again: armrs import reads decimal commas"
    assert steps["slow_2.csv"] == "rename or remove one of the two"


def test_one_cause_is_told_once(tmp_path: Path) -> None:
    """Once for each posture with its own distance, again by the balance, and as a wrong weight besides."""
    dataset = demo.measure(demo.true_model())
    for joint, factors, words in ((1, [np.pi / 180.0, 1.0], "(radians labelled as degrees?)"), (2, [1.0, -1.0], "(this one mirrored?)")):
        trials = tuple(replace(t, q=factors * t.q) for t in dataset.trials)
        told = grouped(check_dataset(armrs.write_dataset(dataset.replace(trials=trials), tmp_path / f"joint {joint}")).problems)
        assert len(told) == 1 and f"and 13 more: column q{joint}: " in told[0].text and words in told[0].text
        assert told[0].next_step.startswith("import the recordings again")


def test_worn_masses_keep_identify_and_gap_from_an_arm(session: Path, tmp_path: Path) -> None:
    """Both were said to be able to use it, and refused it."""
    folder = changed(session, tmp_path / "set", {})
    worn = '\n[[added]]\nsegment = 2\nmass = 0.2\nat = 0.1\nconfigurations = ["slow"]\n'
    with (folder / "dataset.toml").open("a", encoding="utf-8") as file:
        file.write(worn)
    found = check_dataset(folder)
    assert [v.able for v in found.verbs] == [False, True, False] and len(found.errors) == 1
    refused = f"{folder / 'dataset.toml'}: [[added]]: found masses worn in some configurations (slow), allowed one arm in all trials"
    assert found.errors[0].text.startswith(refused)


def test_a_report_is_made_of_the_json_of_a_check_and_an_import(session: Path, tmp_path: Path) -> None:
    """They are among the results that a report names, and theirs were refused: "not what a result holds ('data')"."""
    KNOWN.write(tmp_path / "model.toml")
    raw = [str(path) for path in sorted(session.glob("trials/*.csv"))]
    importing = ["import", *raw, "--model", str(tmp_path / "model.toml"), "-o", str(tmp_path / "set"), "--force-on", "robot"]
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "dataset.toml").write_text("name = 3\n", encoding="utf-8")
    for name, verb in (("check", ["check", str(session)]), ("unread", ["check", str(tmp_path / "broken")]), ("import", importing)):
        result = tmp_path / f"{name}.json"
        assert cli.main([*verb, "--json", str(result)]) == int(name == "unread")
        assert cli.main(["report", str(result), "-o", str(tmp_path / name)]) == 0
        assert f"armrs {verb[0]} " in (tmp_path / name / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", ["session", "pendulum_single", "pendulum_triple", "dfki_a0", "dfki_c1"])
def test_check_says_of_passive_what_passive_says(name: str, request: pytest.FixtureRequest) -> None:
    """Of free swings it said that passive can use them, which found nothing there; and whether a movement is slow had two rules."""
    folder: Path = request.getfixturevalue("session") if name == "session" else request.getfixturevalue("data") / name
    curves = armrs.passive_moments(folder).curves
    assert bool(curves) == (name in {"session", "dfki_a0"})
    [told] = [v for v in check_dataset(folder).verbs if v.verb == "passive"]
    assert told.able == bool(curves)
    slow, _, fast = told.why.partition("not slow")
    for c in curves:
        assert re.search(rf"joint {c.joint} \([^)]*{c.configuration}", slow if c.inertial_share <= 0.1 else fast), told.why


def test_lines_that_are_no_table_are_not_a_column_to_correct(session: Path, tmp_path: Path) -> None:
    folder = changed(session, tmp_path / "set", {})
    for name, content in (("slow_1", "# made by a tool\nt_s,q1_rad\n0,0\n"), ("slow_2", "\n"), ("slow_3", "t_s,q1_rad,q2_rad\n0,0\n")):
        (folder / "trials" / f"{name}.csv").write_text(content, encoding="utf-8")
    errors = [p for p in check_dataset(folder).problems if p.level == "error"]
    for words in (
        "line 1: found a comment, '# made by a tool', allowed the names of the columns; armrs import",
        "line 1: found nothing",
        "line 2: found 2",
    ):
        (problem,) = [p for p in errors if words in p.text]
        assert problem.next_step.startswith("write one row with the names of the columns")


def test_a_model_in_other_units_hides_nothing_and_brings_nothing_else(session: Path, tmp_path: Path) -> None:
    """Without a model each trial was said to have columns of joints that it does not have."""
    folder = changed(session, tmp_path / "set", {})
    model = folder / "model.toml"
    text = model.read_text(encoding="utf-8")
    for pattern, factor, level, said in (
        (r"(mass) = ([\d.]+)", 1000.0, "error", ["grams?"]),
        (r"(length|com) = ([\d.]+)", 100.0, "warning", ["[[arm.segment]] 1, length", "centimetres?"]),
    ):
        model.write_text(re.sub(pattern, lambda m, f=factor: f"{m[1]} = {f * float(m[2]):.6g}", text), encoding="utf-8")  # type: ignore[misc]
        told = [p.text for p in check_dataset(folder).problems if p.level == level]
        assert all(any(words in line for line in told) for words in said), told
        assert level == "warning" or len(told) == 1


def test_commands_end_with_the_next(session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["check", str(session)]) == 0
    assert capsys.readouterr().out.splitlines()[-1].startswith(f"Next: armrs identify {session} -o identified, then armrs gap")
    cli.main(["identify", str(session), "-o", str(tmp_path / "i")])
    assert capsys.readouterr().out.splitlines()[-1].startswith("Next: armrs ")


def test_a_subject_takes_the_place_of_a_model(session: Path, tmp_path: Path) -> None:
    folder = tmp_path / "set"
    shutil.copytree(session, folder)
    (folder / "model.toml").unlink()
    text = (folder / "dataset.toml").read_text(encoding="utf-8").replace('model = "model.toml"\n', "")
    subject = '\n[subject]\nbody_mass = 78.0\nheight = 1.80\nsex = "male"\nlengths_m = [0.322, 0.264]\n\n[[trial]]'
    (folder / "dataset.toml").write_text(text.replace("\n[[trial]]", subject, 1), encoding="utf-8")
    data = armrs.load_dataset(folder)
    made = armrs.initialise(tmp_path / "subject", body_mass=78.0, height=1.80, sex="male", lengths=(0.322, 0.264)).model
    assert data.model == made and data.digest() is not None
    assert any("no model is named" in line for line in data.warnings)
    assert [p.text for p in check_dataset(folder).problems if p.level == "error"] == []
    armrs.convert(folder, tmp_path / "parquet", to="parquet")
    assert armrs.load_dataset(tmp_path / "parquet").model == made


FAULTY = """
name = "x"
model = "model.toml"
force_onn = "robot"
sample_rate = -3

[subject]
body_mass = 7000
heigth = 1.8

[tolerance]
angle_offset_deg = -1

[[trial]]
file = "trials/slow_1.csv"
configuration = "slow"
repeat = 0
role = "fitt"

[[trial]]
file = "trials/slow_1.csv"
configuration = "slow"
repeat = 2
role = "fit"

[[trial]]
configuration = "reach"
repeat = 1
color = 3
"""


def test_every_fault_of_a_description_is_told(session: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One was told at a time."""
    folder = tmp_path / "set"
    shutil.copytree(session, folder)
    (folder / "dataset.toml").write_text(FAULTY, encoding="utf-8")
    said = [p.text.partition("dataset.toml: ")[2].partition(", allowed")[0] for p in check_dataset(folder).problems]
    assert said == [
        "found unknown key 'force_onn'", "[[trial]] 1, repeat: found 0", "[[trial]] 1, role: found 'fitt'",
        "[[trial]] 3: found unknown key 'color'", "`file` is missing in [[trial]] 3: the file of the samples", "`role` is missing in [[trial]] 3: fit or test",
        "[[trial]] 2, file: found 'trials/slow_1.csv'", "[subject]: found unknown key 'heigth'", "[subject], body_mass: found 7000.0",
        "sample_rate: found -3.0", "[tolerance], angle_offset_deg: found -1.0",
    ]  # fmt: skip
    assert cli.main(["identify", str(folder)]) == 2
    assert "and 10 more problems, which armrs check lists" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("x = [", ["found Invalid value"]),
        ("trial = 3", ["trial: found 3"]),
        ('model = "m"\ntrial = [{file = "a", configuration = "b", repeat = 1, role = "test"}]', ["[[trial]]: found no trial with role"]),
        ("[subject]\nheight = 18\n[[trial]]\nfile = 'a'\nconfiguration = 'b'\nrepeat = 1\nrole = 'fit'", ["[subject], height: found 18.0"]),
        (
            "[added]\n[[trial]]\nfile = 'a'\nconfiguration = 'b'\nrepeat = 1\nrole = 'fi'",
            ["role: found 'fi'", "model: found nothing", "added: found one"],
        ),
    ],
)
def test_what_follows_from_a_fault_is_none(tmp_path: Path, text: str, said: list[str]) -> None:
    (tmp_path / "dataset.toml").write_text(text, encoding="utf-8")
    problems = [p for p in check_dataset(tmp_path).problems if "dataset.toml: " in p.text]
    assert len(problems) == len(said) and all(part in p.text for part, p in zip(said, problems, strict=True)), problems
    assert all(p.next_step == "" and "->" not in str(p) for p in problems)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("[[trial]]", "color = 3\n\n[[trial]]", "found unknown key 'color'"),
        ('role = "fit"', 'role = "fitt"', "role: found 'fitt'"),
        ('force_on = "robot"', 'forceon = "robot"', "found unknown key 'forceon'"),
        ('model = "model.toml"', "model = 3", "model: found 3"),
        ('file = "trials/slow_1.csv"', 'file = ""', "[[trial]] "),
        ("[[trial]]", "[[added]]\nx = 3\n\n[[trial]]", "[[added]] 1: found unknown key 'x'"),
    ],
)
def test_a_fault_of_the_description_hides_none_of_model_and_trials(old: str, new: str, said: str, session: Path, tmp_path: Path) -> None:
    """Only the first of the three was listed."""
    folder = changed(session, tmp_path / "set", {})
    (folder / "trials" / "reach_2.csv").unlink()
    description, model = folder / "dataset.toml", folder / "model.toml"
    text = description.read_text(encoding="utf-8")
    assert old in text
    description.write_text(text.replace(old, new, 1), encoding="utf-8")
    model.write_text("colour = 3\n" + model.read_text(encoding="utf-8"), encoding="utf-8")
    expected = [said, "model.toml: found unknown key 'colour'", "reach_2.csv: [[trial]]"]
    if "model" in old:  # which file it is nobody knows
        del expected[1]
    told = check_dataset(folder).problems
    assert len(told) == len(expected) and all(part in p.text for part, p in zip(expected, told, strict=True)), told


def test_of_a_description_that_is_no_toml_only_that_is_said(session: Path, tmp_path: Path) -> None:
    folder = changed(session, tmp_path / "set", {})
    (folder / "model.toml").unlink()
    (folder / "dataset.toml").write_text("x = [", encoding="utf-8")
    [told] = check_dataset(folder).problems
    assert "dataset.toml: " in told.text


def test_a_single_problem_is_not_in_the_plural() -> None:
    wrong, odd = Problem("error", "wrong"), Problem("warning", "odd")
    assert repr(Checked((wrong, odd), (Ability("gap", False, "wrong"),))) == "Checked(1 error, 1 warning; usable by no verb)"
    assert repr(Checked((odd, odd), (Ability("gap", True, ""),))) == "Checked(0 errors, 2 warnings; usable by gap)"
