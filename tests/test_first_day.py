"""The way of a newcomer: raw German exports of an arm that MuJoCo moved, through init and import to a data set that knows its robot."""

from __future__ import annotations

import csv
import dataclasses
import io
import json
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import armrs
from armrs import anthropometry, cli, demo
from armrs.analysis import torque_balance
from armrs.errors import BadInput
from armrs.io.raw import RawTable, read_raw
from armrs.io.raw.table import Remark, column, remarks_of
from armrs.report import console, html, plotting, run_animation
from armrs.workflows import setup_check
from armrs.workflows.gap import data_checks
from armrs.workflows.importing import clock_offset, handle_positions, offset_search
from armrs.workflows.importing.column_guess import symbol_of
from armrs.workflows.importing.file_remarks import timed
from armrs.workflows.importing.recipe import load_recipe
from armrs.workflows.importing.sample_cleaning import cleaned
from armrs.workflows.residuals import residuals
from test_import_sources import on_a_terminal

ROOT = Path(__file__).resolve().parents[1]
PERSON = ["--body-mass-kg", "63", "--height-m", "1.75", "--sex", "male"]
GERMAN = {
    "t_s": ("Zeit [ms]", 1000.0, 0.0),
    "q1_rad": ("Winkel Oberarm zur Senkrechten [°]", np.degrees(1.0), 90.0),
    "q2_rad": ("Winkel Ellenbogen [°]", np.degrees(1.0), 0.0),
    "q3_rad": ("Winkel Handgelenk [°]", np.degrees(1.0), 0.0),
    "Fy_N": ("Kraft vorwärts [N]", 1.0, 0.0),
    "Fz_N": ("Kraft nach oben [N]", 1.0, 0.0),
    "qr1_rad": ("Roboter Gelenk 1 [°]", np.degrees(1.0), 0.0),
    "qr2_rad": ("Roboter Gelenk 2 [°]", np.degrees(1.0), 0.0),
}
"""Columns of a data set -> name in the export, factor and what is added."""


@pytest.fixture(scope="module")
def world(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session that MuJoCo made, with a slipped sensor in one of its trials, and its exports beside it."""
    pytest.importorskip("mujoco")
    folder = tmp_path_factory.mktemp("world")
    made = [
        str(ROOT / "bench" / "hidden" / "mujoco_world"),
        "--family",
        "little_known",
        "--seed",
        "60310",
        "--count",
        "1",
        "-o",
        str(folder),
    ]
    subprocess.run([sys.executable, *made], check=True, timeout=300)
    (folder / "raw").mkdir()
    for path in (folder / "m060310" / "data" / "trials").glob("*.csv"):
        export(path, folder / "raw" / f"{path.stem.replace('_', ' ')}.csv")
    return folder


def export(path: Path, to: Path) -> None:
    """Write a trial as a German laboratory program does: semicolons, decimal commas, Windows-1252, a title and a column of remarks."""
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    used = [name for name in GERMAN if name in rows[0]]
    lines = ["Messplatz 3;Proband 07", ";".join([*(GERMAN[name][0] for name in used), "Bemerkung"])]
    for k, row in enumerate(rows):
        cells = [f"{float(row[n]) * GERMAN[n][1] + GERMAN[n][2]:.6f}".replace(".", ",") if row[n] else "" for n in used]
        lines.append(";".join([*cells, "hustet" if k == 7 else ""]))
    to.write_bytes("\r\n".join(lines).encode("cp1252"))


@pytest.fixture(scope="module")
def imported(world: Path) -> Path:
    """The data set of `init` and `import`, run as a newcomer would."""
    subject = world / "subject"
    assert cli.main(["init", str(subject), *PERSON, "--lengths-m", "0.283,0.270,0.087"]) == 0
    text = (subject / "dataset.toml").read_text(encoding="utf-8")
    stated = text.replace("# [tolerance]", "[tolerance]").replace("# angle_offset_deg = 0.3", "angle_offset_deg = 0.5")
    (subject / "dataset.toml").write_text(stated, encoding="utf-8")
    assert cli.main(["import", str(world / "raw"), "--model", str(subject / "model.toml"), "-o", str(world / "session")]) == 0
    return world / "session"


@pytest.mark.long
def test_german_exports_become_the_recorded_samples(world: Path, imported: Path) -> None:
    truth = {(t.configuration, t.repeat): t for t in armrs.load_dataset(world / "m060310" / "data").trials}
    found = armrs.load_dataset(imported)
    assert len(found.trials) == len(truth) == 16
    for trial in found.trials:
        true = truth[trial.configuration, trial.repeat]
        assert np.nanmax(np.abs(trial.q - true.q)) < 1e-6
        assert np.nanmax(np.abs(trial.force_on_arm - true.force_on_arm)) < 1e-6
        assert np.nanmax(np.abs(trial.robot_q - true.robot_q)) < 1e-6


@pytest.mark.long
def test_what_init_wrote_about_the_subject_is_kept(imported: Path) -> None:
    found = armrs.load_dataset(imported)
    assert (found.subject.body_mass, found.subject.height, found.subject.sex) == (63.0, 1.75, "male")
    assert found.tolerance.angle_offset == pytest.approx(np.radians(0.5))


@pytest.mark.long
def test_the_robot_is_read_off_its_angles(world: Path, imported: Path) -> None:
    """A slipped sensor and a contact that gives way by a millimetre made links 2 mm too short; tape lengths are 0.4 mm off here."""
    true, found = (armrs.load_model(folder / "model.toml").robot for folder in (world / "m060310" / "data", imported))
    assert true is not None and found is not None and found.elbow == true.elbow
    assert np.abs(np.subtract(found.lengths, true.lengths)).max() < 1e-3
    assert np.abs(np.subtract(found.base, true.base)).max() < 2e-3
    checked = armrs.check_dataset(imported)
    assert {v.verb: v.able for v in checked.verbs} == {"identify": True, "passive": True, "gap": True}
    assert next(v.why for v in checked.verbs if v.verb == "gap") == "by angles and forces, arm and robot simulated together"


@pytest.mark.long
def test_a_missing_robot_is_told(imported: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    dataset = armrs.load_dataset(imported)
    out = armrs.write_dataset(dataset.replace(model=dataset.model.replace(robot=None)), tmp_path / "set").parent
    told = [p for p in armrs.check_dataset(out).problems if p.text.startswith("[robot]")]
    assert len(told) == 1 and told[0].level == "warning" and "gap compares joint torques only" in told[0].text


@pytest.mark.long
def test_import_toml_alone_repeats_an_import_anywhere(imported: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It needed --model, and named raw files by the folder in which the command ran."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "deep" / "er").mkdir(parents=True)
    assert cli.main(["import", str(imported / "import.toml"), "-o", "deep/er/again"]) == 0
    assert cli.main(["import", "deep/er/again/import.toml", "-o", "third"]) == 0
    for name in ("model.toml", *(t.file for t in armrs.load_dataset(imported).trials)):
        assert (tmp_path / "third" / name).read_bytes() == (imported / name).read_bytes()
    with pytest.raises(BadInput, match="as armrs init writes it"):
        armrs.import_recordings([imported / "trials"], tmp_path / "none")


@pytest.mark.long
@pytest.mark.parametrize(("apart", "within"), [(0.0, 0.015), (0.7, 0.035)])
def test_forces_on_their_own_clock_share_the_laws_of_the_arm(world: Path, apart: float, within: float) -> None:
    """Started by one trigger, or each at another time; of another session of this world each trial by itself was up to 0.2 s off."""
    data = armrs.load_dataset(world / "m060310" / "data")
    offsets = 1.3 + apart * np.sin(np.arange(len(data.trials)))
    recordings = []
    for trial, offset in zip(data.trials, offsets, strict=True):
        assert trial.force_on_arm is not None
        found = offset_search.together([offset_search.Match.of(trial.t, trial.q, trial.t + offset, trial.force_on_arm)])[0]
        near = min(found, key=lambda seconds, at=offset: abs(seconds + at))
        recordings.append(clock_offset.Recording(trial.t, trial.q, trial.t + offset, trial.force_on_arm, near))
    shifts = np.array(clock_offset.refine(data.model, recordings))
    assert np.abs(shifts + offsets).max() < within
    assert (np.ptp(shifts) == 0.0) == (apart == 0.0)


@pytest.mark.long
def test_a_column_of_remarks_is_told(world: Path, imported: Path, tmp_path: Path) -> None:
    """One remark among numbers' empty cells was a column of missing numbers, and was offered as an angle; then it was printed and lost."""
    done = armrs.import_recordings([world / "raw"], tmp_path / "set", model=imported / "model.toml")
    assert "Bemerkung, a column of words, kept as remarks: 'hustet' in sample 8" in done.notes
    assert not [note for note in done.notes if note.startswith("not used")]
    t = armrs.load_dataset(done.folder).trials[0].t
    for recipe in (done.recipe, load_recipe(imported / "import.toml"), load_recipe(done.folder / "import.toml")):
        assert {trial.remarks for trial in recipe.trials} == {(f"{t[7]:.3f} s, Bemerkung: hustet",)}
    assert json.loads(done.to_json())["trials"][0]["remarks"] == [f"{t[7]:.3f} s, Bemerkung: hustet"]


def test_a_remark_keeps_its_sample_where_rows_are_left_out(tmp_path: Path) -> None:
    """Remarks of a workbook, a Parquet file and a text; two rows without a time stand before the second remark."""
    words = [""] * 12
    words[2], words[3], words[9] = "start", "start", 'he said "ouch"'
    t = np.array([0.0, 0.1, 0.2, 0.3, np.nan, np.nan, *np.arange(0.4, 1.0, 0.1)])
    found = cleaned(RawTable(Path("a.csv"), "a", (column("t_s", t), column("q1", t)), remarks=remarks_of("note", words)), None, [])
    assert [timed(table, table.columns[0].values) for table in found] == [("0.200 s, note: start", '0.700 s, note: he said "ouch"')]


def test_remarks_of_every_kind_of_table_are_kept(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    rows = [[0.01 * k, 0.1 * k, "cough" if k == 4 else None] for k in range(9)]
    book = openpyxl.Workbook()
    for row in (["t_s", "q1_rad", "note"], *rows):
        book.active.append(row)
    book.save(tmp_path / "a.xlsx")
    t, q, words = (list(cells) for cells in zip(*rows, strict=True))
    pq.write_table(pa.table({"t_s": t, "q1_rad": q, "note": words}), tmp_path / "a.parquet")
    lines = ["t_s,q1_rad,note", *(",".join("" if cell is None else str(cell) for cell in row) for row in rows)]
    (tmp_path / "a.csv").write_text("\n".join(lines), encoding="utf-8")
    for name in ("a.xlsx", "a.parquet", "a.csv"):
        (table,) = read_raw(tmp_path / name)
        assert table.remarks == (Remark("note", 4, "cough"),), name


def some(dataset: armrs.Dataset, *configurations: str) -> armrs.Dataset:
    return dataset.replace(trials=tuple(t for t in dataset.trials if t.configuration in configurations))


def in_pounds(dataset: armrs.Dataset) -> armrs.Dataset:
    """Newtons that were read as pounds."""
    return dataset.replace(trials=tuple(dataclasses.replace(t, force_on_arm=4.4482216 * t.force_on_arm) for t in dataset.trials))


@pytest.mark.long
def test_forces_in_another_unit_and_another_body_are_told(imported: Path, tmp_path: Path) -> None:
    """The springs took up what the weight of the arm left, and nothing was said."""
    dataset = armrs.load_dataset(imported)
    assert setup_check.other_weight(dataset) is None
    wrong = in_pounds(dataset)
    found = setup_check.other_weight(wrong)
    assert found is not None and found.factor == pytest.approx(4.8, abs=0.3) and found.apart > 10.0
    said = "times the masses and first moments of the model"
    small = armrs.identify(some(wrong, "elbow", "reach", "raised"), with_effects="elastic,viscous")
    assert not small.is_sound and any(said in line and "forces stated in lbf that are N" in line for line in small.contradictions)
    checked = armrs.check_dataset(armrs.write_dataset(wrong, tmp_path / "pounds"))
    assert [p.next_step for p in checked.problems if said in p.text] == [
        "correct the unit of the forces and import again, or body mass (armrs init) or masses (model.toml)"
    ]
    lengths = [s.length for s in dataset.model.segments]
    heavy = anthropometry.literature_model(armrs.Subject(93.0, 1.75, "male"), lengths).replace(robot=dataset.model.robot)
    found = setup_check.other_weight(dataset.replace(model=heavy))
    assert found is not None and found.factor == pytest.approx(0.74, abs=0.05) and found.apart > 2.0
    assert "a wrong body mass" in str(found) and "lbf" not in str(found)
    assert setup_check.other_weight(dataset.replace(model=heavy.replace(gravity=0.0))) is None
    assert torque_balance.weight_of(dataset.model, [still(dataset)]) is None


@pytest.mark.long
def test_another_weight_that_the_named_effects_explain_is_taken_back(imported: Path) -> None:
    """A relaxation of the shoulder was named correctly, but a warning about a sixth of the weight remained that the fit did not confirm."""
    wrong = in_pounds(armrs.load_dataset(imported))
    model = wrong.model

    def fitted(factor: float) -> armrs.Model:
        return model.replace(segments=[s.replace(mass=factor * s.mass) for s in model.segments])

    within, beyond = 1.0 + 0.9 * model.segment_uncertainty, 1.0 + 1.1 * model.segment_uncertainty
    (line,) = data_checks.refuted(wrong, fitted(within))
    assert line == str(setup_check.other_weight(wrong))
    assert data_checks.refuted(wrong, fitted(1.0 / beyond)) == [line]
    assert data_checks.refuted(wrong, fitted(beyond)) == []


def still(dataset: armrs.Dataset) -> torque_balance.Motion:
    """An arm that stands: its weight and a constant moment are the same then."""
    trial = dataset.trials[0]
    n = len(trial.t)
    motion = torque_balance.motion_of([(trial.t, np.tile(trial.q[:1], (n, 1)), np.tile([1.0, 2.0], (n, 1)), None)])
    assert motion is not None
    return motion


@pytest.mark.long
def test_one_trial_says_what_it_cannot_tell(imported: Path) -> None:
    """Its intervals were as those of repeats, and nothing was said."""
    dataset = armrs.load_dataset(imported)
    one = armrs.identify(dataset.replace(trials=some(dataset, "reach").trials[:1]))
    (line,) = [line for line in one.warnings if line.startswith("one fit trial")]
    data = [e for e in one.parameters if e.kind != "segment" and e.decided_by == "data"]
    wide = {f"{e.name} of joint {e.joint}" for e in data if e.std > 0.25 * abs(e.value)}
    assert wide and all(name in line for name in wide) and line.endswith("record repeats of each movement")


@pytest.mark.long
def test_a_fit_at_the_noise_is_not_called_poor(imported: Path) -> None:
    """28 % of the variation were left in a wrist that hardly resists: noise, as the repeats say."""
    dataset = some(armrs.load_dataset(imported), "elbow", "reach", "raised")
    found = armrs.identify(dataset)
    left = residuals(found.explained)
    assert max(r.share for r in left) > 0.2 > max(r.lacking for r in left)
    assert not [line for line in found.warnings if "of the variation" in line]
    poor = armrs.identify(dataset, with_effects=())
    assert [line for line in poor.warnings if "of the variation" in line and "alike in all repeats: the model does not describe" in line]


def test_robot_angles_that_do_not_hold_the_hand_are_told(tmp_path: Path) -> None:
    dataset = demo.measure(demo.true_model())
    pairs = [(t.q, t.robot_q, t.force_on_arm) for t in dataset.trials if t.robot_q is not None]
    robot, apart = handle_positions.robot_of(dataset.model, pairs)
    true = dataset.model.robot
    assert robot is not None and true is not None and apart < 2e-3
    assert np.abs(np.subtract(robot.lengths + robot.base, true.lengths + true.base)).max() < 5e-3
    none, apart = handle_positions.robot_of(dataset.model, [(q, -qr, force) for q, qr, force in pairs])
    assert none is None and apart > 0.02
    still = [(q[:1].repeat(len(q), axis=0), qr[:1].repeat(len(q), axis=0), force) for q, qr, force in pairs[:1]]
    assert handle_positions.robot_of(dataset.model, still)[0] is None
    assert handle_positions.robot_of(dataset.model, [(np.full_like(q, np.nan), qr, force) for q, qr, force in pairs])[0] is None


def test_init_takes_a_robot(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given = ["--robot-lengths-m", "0.47,0.45", "--robot-base-m=1.03,-0.12", "--robot-elbow", "down"]
    assert cli.main(["init", str(tmp_path / "a"), *PERSON, *given]) == 0
    assert armrs.load_model(tmp_path / "a" / "model.toml").robot == armrs.Robot((0.47, 0.45), (1.03, -0.12), "down")
    assert "armrs import then reads" not in capsys.readouterr().out
    assert cli.main(["init", str(tmp_path / "b"), *PERSON]) == 0
    assert "no robot leads the hand, unless recordings hold its angles" in capsys.readouterr().out
    for options, said in (
        (given[:2], "--robot-base-m: found nothing"),
        (["--robot-lengths-m", "0.47"], "--robot-lengths-m: found '0.47'"),
        ([*given[2:3], "--robot-lengths-m", "0.47,-1"], "found -1"),
    ):
        assert cli.main(["init", str(tmp_path / "c"), *PERSON, *options]) == 2
        assert said in capsys.readouterr().err and not (tmp_path / "c").exists()


def test_init_asks_on_a_terminal_and_nowhere_else(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["init", str(tmp_path / "a"), "--height-m", "1.75"]) == 2
    said = "--body-mass-kg, --sex: found nothing, allowed these options, or a terminal to ask on"
    assert said in capsys.readouterr().err and not (tmp_path / "a").exists()
    said = on_a_terminal(["init", str(tmp_path / "a"), "--height-m", "1.75"], b"heavy\n63\nm\nmale\n0.283,0.270,0.087\n")
    assert "Height" not in said and "found 'm', allowed male or female" in said
    assert cli.main(["init", str(tmp_path / "b"), *PERSON, "--lengths-m", "0.283,0.270,0.087"]) == 0
    assert (tmp_path / "a" / "model.toml").read_bytes() == (tmp_path / "b" / "model.toml").read_bytes()


NAMES = {
    "Winkel Oberarm": "q1", "Winkel Oberarm zur Senkrechten [°]": "q1", "upper arm angle (deg)": "q1", "Winkel Unterarm [Grad]": "q2",
    "avant-bras (deg)": "q2", "Kraft vorwärts [N]": "Fy", "Kraft vorwaerts": "Fy", "Kraft nach oben (N)": "Fz", "Kraft senkrecht [N]": "Fz",
    "Handkraft oben [N]": "Fz", "Kraft seitlich [N]": None, "Griff vorwärts [mm]": "Py", "Winkelgeschwindigkeit Oberarm [°/s]": "dq1",
    "Umfang Oberarm [mm]": None, "Bemerkung": None, "Winkel Hand [°]": "q3", "Handwinkel": "q3", "hand angle (deg)": "q3",
    "angle main (deg)": "q3", "angle bras (deg)": "q1", "angle avant-bras (deg)": "q2", "Hand z [mm]": "Pz", "Hand": None,
    "Handkraft vorwärts [N]": "Fy", "Grip force [N]": None, "Force up (lbs)": "Fz", "F horiz. [N]": "Fy", "main [mm]": None,
}  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_a_name_is_recognised(name: str) -> None:
    assert symbol_of(column(name, np.zeros(3))) == NAMES[name]


@pytest.mark.long
def test_a_force_downward_is_turned(imported: Path, tmp_path: Path) -> None:
    raw = tmp_path / "raw"
    raw.mkdir()
    for path in sorted((imported / "trials").glob("elbow_*.csv")):
        head, *rows = path.read_text(encoding="utf-8").splitlines()
        at = head.split(",").index("Fz_N")
        cells = [row.split(",") for row in rows]
        turned = [",".join([*row[:at], f"{-float(row[at]):.9g}" if row[at] else "", *row[at + 1 :]]) for row in cells]
        (raw / path.name).write_text("\n".join([head.replace("Fz_N", "Kraft nach unten [N]"), *turned]), encoding="utf-8")
    done = armrs.import_recordings([raw], tmp_path / "set", model=imported / "model.toml", force_on="robot")
    assert next(c.sign for c in done.recipe.channels if c.symbol == "Fz") == -1
    again, first = ({t.file: t for t in armrs.load_dataset(folder).trials}["trials/elbow_1.csv"] for folder in (done.folder, imported))
    assert np.nanmax(np.abs(again.force_on_arm - first.force_on_arm)) < 1e-6


def test_work_that_no_terminal_shows_says_what_it_does(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(console, "FIRST_LINE", 0.05)
    with console.stages("checking") as tell:
        tell("conventions", 0.4)
        time.sleep(0.1)
    with console.progress("coupling"):
        pass
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["armrs: conventions, 40 %, after 0 s"]


def test_no_colour_stands_for_two_lines() -> None:
    """With ten torques and effects, the colours of the cycle began again, and an effect had that of gravity."""
    effects = tuple(
        armrs.Effect(kind, 2, parameters=values)
        for kind, values in (
            ("viscous", {"viscosity": 0.2}),
            ("coulomb", {"torque": 0.2}),
            ("elastic", {"stiffness": 1.0, "rest": 0.9}),
            ("relaxation", {"stiffness": 0.5, "time": 0.5}),
            ("quadratic_drag", {"drag": 0.1}),
        )
    )
    model = demo.true_model()
    n = model.n_joints
    rest = np.array([-0.8, 0.9, 0.0])[:n]
    path = armrs.Movement(np.array([rest, rest + 0.3, rest]), speed=0.5, acceleration=2.0)
    live = run_animation.simulated(armrs.simulate(model.replace(effects=effects), path, rate=100.0))
    assert live.series is not None
    by_name: dict[str, set[str]] = {}
    for panel in live.series["panels"]:
        for line in panel["lines"]:
            by_name.setdefault(line["name"], set()).add(line["colour"])
    assert all(len(colours) == 1 for colours in by_name.values())
    assert len(set.union(*by_name.values())) == len(by_name) >= 10


@pytest.mark.parametrize(("size", "shape"), [((4.0, 3.0), ""), ((8.0, 3.0), "broad"), ((4.0, 6.0), "tall"), ((8.0, 12.0), "broad tall")])
def test_a_picture_knows_its_shape(size: tuple[float, float], shape: str) -> None:
    image = io.BytesIO()
    plotting.write_png(plotting.figure(*size), image)
    assert html.Picture("x.png", "x", "x", html.data_uri(image.getvalue())).shape == shape
    assert html.Picture("x.png", "x", "x", None).shape == ""


@pytest.mark.long
def test_a_data_set_is_a_table_of_its_trials(imported: Path) -> None:
    """`pd.DataFrame(dataset)` ended with a TypeError, where it works for every result."""
    pandas = pytest.importorskip("pandas")
    dataset = armrs.load_dataset(imported)
    frame = pandas.DataFrame(dataset)
    pandas.testing.assert_frame_equal(frame, dataset.to_dataframe())
    assert list(frame["file"]) == [trial.file for trial in dataset.trials]
