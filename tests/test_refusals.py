"""Bad input, one thing broken at a time in what is accepted: status 2, one line, nothing written.

The readers' own refusals stand in test_model.py and test_dataset.py; here every verb meets them, and its own options.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs import BadInput, cli
from armrs.demo import true_model
from armrs.workflows.passive import passive_moments


class Folder:
    """A copy of an accepted data set, to break one thing in."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def edit(self, name: str, old: str, new: str) -> None:
        file = self.path / name
        text = file.read_text(encoding="utf-8")
        assert old in text
        file.write_text(text.replace(old, new, 1), encoding="utf-8")

    def lines(self, change: Callable[[list[str]], list[str]], name: str = "trials/slow_1.csv") -> None:
        file = self.path / name
        file.write_text("\n".join(change(file.read_text(encoding="utf-8").splitlines())) + "\n", encoding="utf-8")

    def cell(self, line: int, column: int, text: str) -> None:
        def change(lines: list[str]) -> list[str]:
            cells = lines[line - 1].split(",")
            cells[column] = text
            lines[line - 1] = ",".join(cells)
            return lines

        self.lines(change)


def nothing(folder: Folder) -> None:
    """Break nothing: the arguments are what is wrong."""


IDENTIFY = ("identify", "data", "-o", "out")
PASSIVE = ("passive", "data", "-o", "out")
MOVE = ("simulate", "data/truth.toml", "--movement", "data/movement.toml", "-o", "out")
FOLLOW = ("simulate", "data/truth.toml", "--trial", "data/trials/slow_1.csv", "-o", "out")

CASES: dict[str, tuple[tuple[str, ...], Callable[[Folder], None], str]] = {
    # files
    "unknown key in the model": (IDENTIFY, lambda f: f.edit("model.toml", "gravity", "gravitiy"), "unknown key 'gravitiy'"),
    "unknown key in the data set": (IDENTIFY, lambda f: f.edit("dataset.toml", "force_on", "forces_on"), "nearest known: force_on"),
    "synthetic is no number": (IDENTIFY, lambda f: f.edit("dataset.toml", "synthetic = true", "synthetic = 1"), "synthetic: found 1, allowed true or false"),
    "mass of zero": (IDENTIFY, lambda f: f.edit("model.toml", "mass = 1.58", "mass = 0.0 #"), "[[arm.segment]] 1, mass: found 0.0"),
    "mass that is text": (MOVE, lambda f: f.edit("truth.toml", "mass = 1.44", 'mass = "x" #'), "[[arm.segment]] 1, mass: found 'x'"),
    "no trial file": (PASSIVE, lambda f: (f.path / "trials/slow_2.csv").unlink(), "slow_2.csv: [[trial]] 2 of dataset.toml: no such file"),
    "unknown unit": (IDENTIFY, lambda f: f.edit("trials/slow_1.csv", "q1_rad", "q1_grad"), "header: found 'q1_grad', allowed a known unit"),
    "degrees under radians": (IDENTIFY, lambda f: f.cell(9, 1, "-1000"), "line 9, column q1_rad: found -1000.0"),
    "text in a cell": (PASSIVE, lambda f: f.cell(9, 2, "abc"), "line 9, column q2_rad: found 'abc'"),
    "NaN in a cell": (IDENTIFY, lambda f: f.cell(9, 2, "nan"), "line 9, column q2_rad: found 'nan'"),
    "infinity in a cell": (IDENTIFY, lambda f: f.cell(9, 3, "inf"), "line 9, column Fy_N: found"),
    "time twice": (IDENTIFY, lambda f: f.cell(5, 0, "0.04"), "time: found 0.04 s twice"),
    "time that decreases": (IDENTIFY, lambda f: f.cell(9, 0, "0.0"), "line 9, time: found 0 s after"),
    "no time stamp": (IDENTIFY, lambda f: f.cell(9, 0, ""), "line 9, time: found an empty cell"),
    "a column is missing": (PASSIVE, lambda f: f.edit("trials/slow_1.csv", "q2_rad", "emg_x"), "header: found no column for q2"),
    "a file cut in a line": (IDENTIFY, lambda f: f.lines(lambda lines: [*lines[:50], lines[50][:4]]), "line 51: found 1 cells"),
    "too few samples": (IDENTIFY, lambda f: f.lines(lambda lines: lines[:10]), "file: found 9 samples, allowed at least 16"),
    "no samples": (FOLLOW, lambda f: f.lines(lambda lines: lines[:1]), "slow_1.csv: file: found no samples below the header"),
    "one complete gap": (IDENTIFY, lambda f: f.lines(lambda lines: [lines[0], *[x.split(",")[0] + "," * x.count(",") for x in lines[1:]]]), "no sample at all"),
    "model that is no TOML": (MOVE, lambda f: f.edit("truth.toml", "[arm]", "[arm"), "truth.toml: "),
    "model that is not there": (("simulate", "no.toml", "--movement", "data/movement.toml"), nothing, "no.toml: no such file"),
    "a folder as model": (("simulate", "data", "--movement", "data/movement.toml"), nothing, "data: file: found a folder"),
    "a model in UTF-16": (
        MOVE, lambda f: (f.path / "truth.toml").write_text((f.path / "truth.toml").read_text("utf-8"), "utf-16") and None,
        "truth.toml: line 1: found byte 0xff, allowed UTF-8 text (UTF-16 text? Save it as UTF-8)"),
    "a trial in UTF-16": (
        FOLLOW, lambda f: (f.path / "trials/slow_1.csv").write_text("t_s,q1_rad", "utf-16") and None,
        "slow_1.csv: line 1: found byte 0xff, allowed UTF-8 text (UTF-16 text? Save it as UTF-8)"),
    "a trial in Latin-1": (
        FOLLOW, lambda f: (f.path / "trials/slow_1.csv").write_text("t_s,q1_rad,Kraft_für_F", "latin-1") and None,
        "line 1: found byte 0xfc, allowed UTF-8 text (Latin-1 or Windows-1252 text? Save it as UTF-8)"),
    "a trial as a data set": (("identify", "data/trials/slow_1.csv"), nothing, "slow_1.csv: file: found a trial, allowed the folder of its data set, with dataset.toml (that is data)"),
    "a data set that is not there": (("identify", "nowhere", "-o", "out"), nothing, "nowhere: no such file"),
    # movements
    "movement with another number of joints": (
        MOVE, lambda f: f.edit("movement.toml", "[[-60, 60]", "[[-60, 60, 0]"), "movement.toml: movement.waypoints_deg: found"),
    "movement of three joints": (
        MOVE, lambda f: (f.path / "movement.toml").write_text("[movement]\nwaypoints_rad = [[0, 0, 0], [1, 1, 1]]\n", encoding="utf-8") and None,
        "movement.waypoints: found 'an array of shape (2, 3)', allowed rows of 2 angles"),
    "movement whose rows differ in length": (
        MOVE, lambda f: f.edit("movement.toml", "[[-60, 60]", "[[-60, 60, 1]"), "movement.toml: movement.waypoints_deg: found rows of 3 and of 2 values, allowed rows of one length"),
    "movement of one waypoint": (
        MOVE, lambda f: (f.path / "movement.toml").write_text("[movement]\nwaypoints_rad = [[0, 0]]\n", encoding="utf-8") and None, "two or more rows"),
    "movement with an unknown key": (MOVE, lambda f: f.edit("movement.toml", "speed_rad_s", "speed_rads"), "unknown key 'speed_rads'"),
    "movement of no speed": (MOVE, lambda f: f.edit("movement.toml", "speed_rad_s = 0.1", "speed_rad_s = 0.0"), "speed"),
    "movement that goes nowhere": (
        MOVE, lambda f: (f.path / "movement.toml").write_text("[movement]\nwaypoints_deg = [[-60, 60], [-60, 60]]\n", encoding="utf-8") and None,
        "length of the movement [s]: found 0, allowed a whole number of steps"),
    "movement of four hundred digits": (
        MOVE, lambda f: (f.path / "movement.toml").write_text(f"[movement]\nwaypoints_deg = [[{'9' * 400}, 0], [1, 1]]\n", encoding="utf-8") and None,
        "movement.waypoints_deg: found"),
    "movement of thirty years": (
        MOVE, lambda f: f.edit("movement.toml", "speed_rad_s = 0.1", "speed_rad_s = 1e-9"), "length of the movement [s]: found"),
    "movement with an unknown shape": (MOVE, lambda f: f.edit("movement.toml", '"smooth"', '"sine"'), "movement.shape: found 'sine'"),
    "handle out of the robot's reach": (MOVE, lambda f: f.edit("truth.toml", "base = [1.0, -0.1]", "base = [3.0, -0.1]"), "m from the robot's base"),
    # options
    "unknown effect": ((*IDENTIFY, "--with", "coulom"), nothing, "--with: found unknown joint effect 'coulom'"),
    "an effect of no joint": ((*IDENTIFY, "--with", "backlash"), nothing, "--with: found unknown joint effect 'backlash'"),
    "no effect at all": ((*IDENTIFY, "--with", ","), nothing, "--with: found ',', allowed kinds of effects with commas between them"),
    "an empty effect": ((*IDENTIFY, "--with", ""), nothing, "--with: found ''"),
    "an effect twice": ((*IDENTIFY, "--with", "coulomb,coulomb"), nothing, "--with: found coulomb twice, allowed each kind once"),
    "an effect of a plan twice": (("plan", "data/model.toml", "--angles-deg", "-60:60,0:90", "--with", "viscous, viscous"), nothing, "--with: found viscous twice"),
    "a date without a history": ((*IDENTIFY, "--date", "2026-01-01"), nothing, "--date: found no --history, allowed --date beside --history FILE"),
    "nothing to find": ((*IDENTIFY, "--with", "none"), lambda f: f.edit("model.toml", "segment_uncertainty = 0.1", "segment_uncertainty = 0.0 #"), "model.toml: [arm], segment_uncertainty: found 0.0, allowed above 0, or an effect to fit"),
    "unknown method": ((*IDENTIFY, "--method", "best"), nothing, "'best' is not one of"),
    "level of one": ((*IDENTIFY, "--level", "1"), nothing, "--level: found 1.0"),
    "level that is no number": ((*IDENTIFY, "--level", "nan"), nothing, "--level: found nan"),
    "cutoff of zero": ((*IDENTIFY, "--cutoff-hz", "0"), nothing, "--cutoff-hz: found 0.0"),
    "cutoff that is no number": ((*IDENTIFY, "--cutoff-hz", "nan"), nothing, "--cutoff-hz: found nan"),
    "cutoff above half the rate": ((*PASSIVE, "--cutoff-hz", "25"), nothing, "--cutoff-hz: found 25, allowed above 0 and below 25 Hz"),
    "negative cutoff": ((*PASSIVE, "--cutoff-hz", "-1"), nothing, "--cutoff-hz: found -1"),
    "one bin": ((*PASSIVE, "--bins", "1"), nothing, "--bins: found 1, allowed a whole number 2 to 1000"),
    "negative step": ((*MOVE, "--dt", "-0.001"), nothing, "--dt: found -0.001, allowed a finite number > 0 s"),
    "step that is no number": ((*MOVE, "--dt", "nan"), nothing, "--dt: found nan"),
    "more samples than steps": ((*MOVE, "--rate-hz", "7000"), nothing, "--dt, --rate-hz: found a step of 0.00025 s and 7000 Hz, allowed at least one step from sample to sample"),
    "steps longer than the sample interval": ((*MOVE, "--dt", "1"), nothing, "--dt, --rate-hz: found a step of 1 s and 50 Hz, allowed at least one step"),
    "step that does not divide the sample interval": ((*MOVE, "--dt", "0.0003"), nothing, "--dt, --rate-hz: found a step of 0.0003 s and 50 Hz, allowed a whole number of steps from sample to sample, not 66.6667"),
    "rate whose interval no step divides": ((*MOVE, "--rate-hz", "333"), nothing, "--dt, --rate-hz: found a step of 0.00025 s and 333 Hz, allowed a whole number of steps from sample to sample, not 12.012"),
    "an integrator for the engine that has its own": ((*MOVE, "--engine", "rapier", "--integrator", "euler"), nothing, "--integrator: found 'euler', allowed none beside the engine rapier"),
    "a format of samples that are not written": ((*MOVE[:-2], "--to", "parquet"), nothing, "--to: found no -o, allowed --to beside -o"),
    "sample rate of zero": ((*MOVE, "--rate-hz", "0"), nothing, "--rate-hz: found 0.0"),
    "negative duration": ((*MOVE, "--duration-s", "-1"), nothing, "--duration-s: found -1"),
    "a step too long for the contact": ((*MOVE, "--dt", "0.02"), nothing, "--dt: found 0.02 s, allowed at most 1.55e-2 s: the contact vibrates at 167.3003 rad/s"),
    "a duration beyond the trial": ((*FOLLOW, "--duration-s", "1000"), nothing, "--duration-s: found 1000.0, allowed at most 11.68 s, the length of the trial"),
    "duration of no sample": ((*MOVE, "--duration-s", "0.001"), nothing, "--duration-s: found 0.001, allowed 0.02 s (one interval between samples) to"),
    "duration between steps": ((*MOVE, "--duration-s", "1.0001"), nothing, "allowed a whole number of steps of 0.00025 s (nearest: 1 s)"),
    "duration that is no number": ((*MOVE, "--duration-s", "nan"), nothing, "--duration-s: found nan"),
    "step of a picosecond": ((*MOVE, "--dt", "1e-12"), nothing, "length of the movement [s]: found"),
    "unknown engine": ((*MOVE, "--engine", "bullet"), nothing, "'bullet' is not one of"),
    "unknown integrator": ((*MOVE, "--integrator", "rk5"), nothing, "'rk5' is not one of"),
    "neither movement nor trial": (("simulate", "data/truth.toml"), nothing, "--movement, --trial: found neither, allowed one of them"),
    "movement and trial": ((*MOVE, "--trial", "x.csv"), nothing, "--movement, --trial: found both"),
    "a trial without a robot": (
        FOLLOW, lambda f: f.edit("truth.toml", "[robot]\nlengths = [0.45, 0.45]\nbase = [1.0, -0.1]\nelbow = \"up\"\n", ""), "[robot]: found none in the model"),
    # output
    "output folder that is a file": (("passive", "data", "-o", "data/model.toml"), nothing, "model.toml: -o: found a file, allowed a folder"),
    "output below a file": (("passive", "data", "-o", "data/model.toml/x"), nothing, "Not a directory"),
    "JSON below a file": ((*PASSIVE, "--json", "data/model.toml/x.json"), nothing, "Not a directory"),
    "an empty name of a folder": (("convert", "data", "--to", "csv", "-o", ""), nothing, "'--out': found '', allowed the name of a file or folder"),
    "an empty name of a folder for what need not write": ((*PASSIVE[:-1], ""), nothing, "'--out': found ''"),
    "an empty name of a unit": (("fmu", "export", "data/model.toml", "-o", ""), nothing, "'--out': found ''"),
    "an empty name of a JSON file": ((*PASSIVE, "--json", ""), nothing, "'--json': found ''"),
    "demo into a file": (("demo", "-o", "data/model.toml"), nothing, "-o: found a file"),
    "JSON over a model": (("passive", "data", "--json", "data/model.toml"), nothing, "an existing file with suffix '.toml'"),
    "results and JSON over a model": ((*PASSIVE, "--json", "data/model.toml"), nothing, "an existing file with suffix '.toml'"),
    "demo and JSON over a model": (("demo", "-o", "out", "--json", "data/model.toml"), nothing, "an existing file with suffix '.toml'"),
    "JSON into a folder": ((*PASSIVE, "--json", "data"), nothing, "data: file: found a folder"),
    "report of nothing": (("report",), nothing, "Missing"),
    "report of a trial": (("report", "data/trials/slow_1.csv"), nothing, "slow_1.csv: file: found"),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_one_line_and_nothing_written(
    name: str, slow_arm: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments, breaks, message = CASES[name]
    shutil.copytree(slow_arm, tmp_path / "data")
    monkeypatch.chdir(tmp_path)
    breaks(Folder(tmp_path / "data"))
    before = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}
    status = cli.main(list(arguments))
    out, err = capsys.readouterr()
    assert (status, out) == (2, "")
    assert err.startswith("armrs: ")
    assert err.count("\n") == 1
    assert message in err
    assert "Traceback" not in err
    assert {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == before
    assert not (tmp_path / "out").exists()


def test_the_accepted_calls_are_accepted(slow_arm: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the table breaks works when it is not broken; otherwise its refusals would prove nothing."""
    shutil.copytree(slow_arm, tmp_path / "data")
    monkeypatch.chdir(tmp_path)
    for folder, arguments in enumerate((PASSIVE, MOVE, FOLLOW)):
        # Each verb has a folder of its own.
        own = [f"out-{folder}" if word == "out" else word for word in arguments]
        assert cli.main(own) == 0


def test_a_run_says_what_its_model_does_not(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bare = armrs.load_model(slow_arm / "truth.toml").replace(contact=None, robot=None)
    bare.write(tmp_path / "bare.toml")
    call = ["simulate", str(tmp_path / "bare.toml"), "--movement", str(slow_arm / "movement.toml"), "--duration-s", "0.1"]
    assert cli.main(call) == 0
    out = capsys.readouterr().out
    assert "no [contact]: 10000 N/m and 25 N s/m" in out
    assert "no [robot]: its angles were not computed" in out
    assert cli.main([*call, "--coupling", "rigid"]) == 0
    assert "[contact]" not in capsys.readouterr().out
    assert cli.main(["simulate", str(slow_arm / "truth.toml"), *call[2:]]) == 0
    assert "The model has no" not in capsys.readouterr().out


def test_passive_moments_say_that_effects_do_not_count(slow_arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["passive", str(slow_arm)]) == 0
    assert "its springs, friction and other effects remain in these moments" in capsys.readouterr().out


@pytest.mark.parametrize("exists", [False, True])
def test_a_folder_is_never_left_half_written(slow_arm: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, exists: bool) -> None:
    """The report is written last; when it fails, nothing else has changed."""
    from armrs.report import pages

    out = tmp_path / "out"
    if exists:
        out.mkdir()
        (out / "passive.json").write_text("old", encoding="utf-8")
        (out / "report.html").write_text('<meta name="generator" content="armrs passive">', encoding="utf-8")
        (out / "mine.txt").write_text("mine", encoding="utf-8")
    before = {p.name: p.read_bytes() for p in out.rglob("*") if p.is_file()}

    def fails(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(pages, "write_report", fails)
        assert cli.main(["passive", str(slow_arm), "-o", str(out)]) == 2
    assert {p.name: p.read_bytes() for p in out.rglob("*") if p.is_file()} == before
    assert [p for p in tmp_path.iterdir() if p != out] == []
    assert out.exists() == exists
    assert cli.main(["passive", str(slow_arm), "-o", str(out)]) == 0
    assert {"passive.json", "report.html", "figures"} <= {p.name for p in out.iterdir()}
    assert not exists or (out / "mine.txt").read_text(encoding="utf-8") == "mine"


def test_a_folder_with_something_else_under_a_name_is_left_alone(slow_arm: Path, tmp_path: Path) -> None:
    (tmp_path / "out" / "report.html").mkdir(parents=True)
    assert cli.main(["passive", str(slow_arm), "-o", str(tmp_path / "out")]) == 2
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["report.html"]


def test_a_full_disk_is_said_of_the_file_that_was_asked_for(
    slow_arm: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """What is written goes to a temporary folder first, whose name means nothing to the user."""

    def full(*_: object, **__: object) -> int:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_bytes", full)
        assert cli.main(["passive", str(slow_arm), "-o", str(tmp_path / "out")]) == 2
    err = capsys.readouterr().err
    assert err.startswith(f"armrs: {tmp_path / 'out'}")
    assert ".part" not in err
    assert err.endswith(": file: found No space left on device, allowed a place that can be written\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["identify", "nope"], "nope: no such file, allowed a folder with dataset.toml, or that file"),
        (["identify", "data", "--metod", "joint"], "(see armrs identify --help)"),
        (["fmu", "export", "data/model.toml", "--fmi", "1"], "'1' is not one of '2', '3' (see armrs fmu export --help)"),
        (["nonsense"], "(see armrs --help)"),
        (
            ["convert", "data/trials", "-o", "out"],
            "found a folder that holds no data set, allowed the folder of a data set, with dataset.toml (that is data)",
        ),
        (
            ["simulate", "data/truth.toml", "--trial", "data/trials/slow_1.csv", "--rate-hz", "1e-3"],
            "--rate-hz: found 0.001, allowed at least one sample interval in the 11.68 s of the trial",
        ),
    ],
)
def test_the_line_points_to_what_helps(
    arguments: list[str], line: str, slow_arm: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(slow_arm, tmp_path / "data")
    monkeypatch.chdir(tmp_path)
    assert cli.main(arguments) == 2
    assert capsys.readouterr().err.rstrip("\n").endswith(line)


def test_a_unit_like_no_other_gets_no_guess(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree(slow_arm, tmp_path / "data")
    Folder(tmp_path / "data").edit("trials/slow_1.csv", "Fy_N", "Fy_lbf")
    assert cli.main(["identify", str(tmp_path / "data")]) == 2
    err = capsys.readouterr().err
    assert "found 'Fy_lbf', allowed a known unit: Fy_N" in err
    assert "None" not in err


ARM = ([0.3, 0.25], [2.0, 1.0], [0.15, 0.12], [0.02, 0.01])


def four_segments() -> armrs.Model:
    return armrs.Model(tuple(armrs.Segment(f"s{k}", 0.2, 1.0, 0.1, 0.01) for k in range(4)), tuple(armrs.Joint(f"j{k}") for k in range(4)))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: armrs.Arm([0.3], [2.0, 1.0], [0.15], [0.02]), "masses: found 2 values, allowed 1"),
        (lambda: armrs.Arm([], [], [], []), "segments: found 0"),
        (lambda: armrs.Arm([0.3], [-1.0], [0.1], [0.01]), "mass"),
        (lambda: armrs.Arm([np.nan], [1.0], [0.1], [0.01]), "length"),
        (lambda: armrs.Arm(*ARM).gravity([0.0]), r"q: found an array of shape \[1\], allowed \(2,\) or \(n, 2\)"),
        (lambda: armrs.Arm(*ARM).gravity([[0.0, np.nan]]), r"q\[0, 1\]: found NaN"),
        (lambda: armrs.Arm(*ARM).coriolis(np.zeros((3, 2)), np.zeros((4, 2))), "qd: found 4 rows, allowed 3 rows"),
        (lambda: armrs.Movement(np.zeros(2)), "waypoints: found 'an array of shape"),
        (lambda: armrs.simulate(true_model(), coupling="loose"), 'coupling: found \'loose\', allowed "compliant" or "rigid"'),
        (lambda: armrs.simulate(true_model(), engine="bullet", duration=0.1), "engine: found 'bullet'"),
        (
            lambda: armrs.simulate(true_model(), engine="rapier", integrator="rk4", duration=0.1),
            "integrator: found 'rk4', allowed none beside",
        ),
        (lambda: armrs.simulate(true_model(), rate=7000.0), "dt, rate: found a step of 0.00025 s and 7000 Hz"),
        (lambda: armrs.simulate(true_model(), dt="fast"), "dt: found 'fast', allowed a finite number > 0 s"),
        (lambda: armrs.simulate(3), "model: found 3, allowed a Model or a path"),
        (lambda: armrs.simulate(true_model(), "fast"), "drive: found 'fast', allowed a Movement or a Trial"),
        (lambda: armrs.simulate(true_model(), duration=0.1, sensors=armrs.Sensors(), seeds=[-1]), r"seeds\[0\]: found -1"),
        (lambda: armrs.simulate(true_model(), duration=0.1, sensors=armrs.Sensors(), seeds=3), "seeds: found 3, allowed a list"),
        (lambda: armrs.simulate(true_model(), duration=0.1, start=["a", 0]), "start: found .* allowed finite numbers rad"),
        (lambda: armrs.Movement([[0.0], [1.0]], speed=-1), "speed: found -1.0, allowed a finite number > 0 rad/s"),
        (lambda: armrs.Movement([[0.0, 1.0], [0.0]]), "waypoints: found rows of 2 and of 1 values, allowed rows of one length"),
        (lambda: armrs.Movement([[0.0], [np.nan]]), "waypoints: found a value that is not finite"),
        (lambda: armrs.Channel("much"), "deviation: found 'much'"),
        (lambda: armrs.Channel(range=1.0, bits=53), "bits: found 53, allowed a whole number 1 to 52"),
        (lambda: armrs.identify(3), "dataset: found 3, allowed a Dataset or a path"),
        (lambda: armrs.simulate(true_model()), "duration: found none"),
        (
            lambda: armrs.simulate(four_segments(), duration=0.1),
            r"segment\]\]: found 4, allowed 1 to 3",
        ),
        (lambda: armrs.simulate(true_model(), duration=0.1, start=[0.0, 1e300]), r"start\[1\]: found 1e\+300, allowed .*-100 to 100 rad"),
        (lambda: armrs.simulate(true_model(), duration=0.1, dt=5e-324), "duration: found 0.1, allowed 0.02 s"),
        (lambda: armrs.simulate(true_model(), duration=0.1, rate=5e-324), "rate: found 5e-324, allowed a finite number >= 0.001 Hz"),
        (lambda: armrs.simulate(true_model(), duration=0.1, sensors=armrs.Sensors(), seeds=range(10**12)), "seeds: found 1000000000000"),
        (lambda: armrs.simulate(true_model(), duration=0.1, start=np.zeros(3)), "start angles: found 3 values, allowed 2"),
        (lambda: passive_moments("nowhere"), "nowhere: no such file"),
    ],
)
def test_functions_refuse_with_the_argument(call: Callable[[], object], message: str) -> None:
    with pytest.raises(BadInput, match=message) as caught:
        call()
    assert "\n" not in str(caught.value)
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize("segments", [4, 6])
def test_an_arm_of_more_than_three_segments_is_refused_by_name(segments: int) -> None:
    model = armrs.Model(
        tuple(armrs.Segment(f"segment {k}", 0.2, 1.0, 0.1, 0.004) for k in range(1, segments + 1)),
        tuple(armrs.Joint(f"joint {k}") for k in range(1, segments + 1)),
        robot=armrs.Robot((0.45, 0.45), (1.05, -0.10)),
    )
    noise = np.random.default_rng(0).standard_normal
    trials = tuple(
        armrs.Trial(f"{k}.csv", "slow", k, "fit", np.arange(100) / 50.0, 0.1 * noise((100, segments)), noise((100, 2))) for k in (1, 2)
    )
    dataset = armrs.Dataset("long", model, trials, "robot")
    movement = armrs.Movement(np.array([[0.0] * segments, [0.1] * segments]), speed=0.5, acceleration=2.0)
    for call in (lambda: armrs.identify(dataset), lambda: armrs.find_gap(dataset), lambda: armrs.simulate(model, movement)):
        with pytest.raises(BadInput, match=rf"\[\[arm.segment\]\]: found {segments}, allowed 1 to 3 segments; only kernels"):
            call()
