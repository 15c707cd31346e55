"""The command line as a user meets it: exit status, one line on standard error, nothing written."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import armrs
from armrs import catalogue, cli
from armrs.errors import ArmrsError
from armrs.io import files as io_files
from conftest import Session


def run(*arguments: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    """Run `armrs` as a process of its own."""
    command = [sys.executable, "-m", "armrs", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, check=False, timeout=120)


def refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    """Run in this process, expect status 2, nothing on standard output and one line on standard error."""
    assert cli.main([str(a) for a in arguments]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert err.startswith("armrs: ")
    return err.removeprefix("armrs: ").rstrip("\n")


def test_version() -> None:
    done = run("--version")
    assert (done.returncode, done.stdout, done.stderr) == (0, f"armrs {armrs.__version__}\n", "")


def test_help_without_arguments() -> None:
    done = run()
    assert (done.returncode, done.stderr) == (0, "")
    assert "effects" in done.stdout
    assert "convert" in done.stdout


def test_effects_prints_every_kind(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["effects"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    for kind in catalogue.catalogue().values():
        assert f"{kind.kind} ({kind.where}" in out
        assert kind.formula in out
    assert "torque: 0 to 100 N m, default 0" in out


def test_effects_as_json(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert cli.main(["effects", "coulomb", "--json", "-"]) == 0
    (effect,) = json.loads(capsys.readouterr().out)["effects"]
    assert (effect["kind"], effect["where"], effect["address"]) == ("coulomb", "joint", "joint")
    assert effect["parameters"][0]["unit"] == "N m"
    assert cli.main(["effects", "--json", str(tmp_path / "effects.json")]) == 0
    assert len(json.loads((tmp_path / "effects.json").read_text(encoding="utf-8"))["effects"]) == len(catalogue.catalogue())
    assert "coulomb" in capsys.readouterr().out


def test_convert(session: Session, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["convert", str(session.folder), "-o", str(tmp_path / "out"), "--json", "-"]) == 0
    files = json.loads(capsys.readouterr().out)["files"]
    assert [Path(f).exists() for f in files] == [True] * 4
    assert cli.main(["convert", files[0], "--to", "csv", "-o", str(tmp_path / "back")]) == 0
    assert capsys.readouterr().out == f"{tmp_path / 'back' / 'slow_1.csv'}\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["effekts"], "No such command 'effekts'"),
        (["effects", "--jason", "x"], "--jason"),
        (["convert"], "Missing"),
        (["convert", "x", "--to", "c3d", "-o", "out"], "c3d"),
        (["effects", "coulom"], "KIND: found unknown kind of effect 'coulom', allowed"),
        (
            ["convert", "nothing", "-o", "out"],
            "nothing: no such file, allowed a data set's folder or dataset.toml, or a file of .csv, .parquet, .mot, ",
        ),
        (["convert", "nope.xyz", "-o", "out"], "nope.xyz: no such file, allowed a data set's folder"),
        (["convert", "nothing.csv", "-o", "out"], "nothing.csv: no such file"),
        (["convert", "nul\0l.csv", "-o", "out"], "embedded null"),
    ],
)
def test_refuses(
    arguments: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert message in refused(capsys, *arguments)
    assert list(tmp_path.iterdir()) == []


def test_bad_input_is_one_line_and_status_2_and_nothing_is_written(session: Session, tmp_path: Path) -> None:
    session.set_cell(7, "q2_rad", "abc")
    (session.folder / "trials/slow_2.csv").write_text("t_s\n1,2\n", encoding="utf-8")
    before = session.files()
    done = run("convert", "session", "-o", "out", "--json", "out.json", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "armrs: session/trials/slow_2.csv: line 2: found 2 cells, allowed 1 cells, one a column\n"
    assert session.files() == before
    assert [p.name for p in tmp_path.iterdir()] == ["session"]


def test_json_does_not_replace_a_model(session: Session, capsys: pytest.CaptureFixture[str]) -> None:
    before = session.files()
    text = refused(capsys, "effects", "--json", session.folder / "model.toml")
    assert text.endswith("file: found an existing file with suffix '.toml', allowed a new file, or a .json file to replace")
    assert session.files() == before


@pytest.mark.parametrize("place", ["out", "out/report.html", "./out/"])
def test_json_in_place_of_a_result_is_refused_before_anything_is_written(
    session: Session, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    monkeypatch.chdir(tmp_path)
    text = refused(capsys, "convert", session.folder, "-o", "out", "--json", place)
    assert text.startswith("--json: found ")
    assert not (tmp_path / "out").exists()


def test_json_to_a_device_leaves_the_device() -> None:
    done = run("effects", "--json", os.devnull)
    assert done.returncode == 0
    assert not Path(os.devnull).is_file()


def test_a_folder_that_cannot_be_made_is_refused(session: Session, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("x", encoding="utf-8")
    text = refused(capsys, "convert", session.folder, "-o", tmp_path / "file" / "out")
    assert text.endswith("file: found Not a directory, allowed a place that can be written")


@pytest.mark.parametrize(
    ("error", "status", "line"),
    [
        (ArmrsError("the data\ncannot say"), 1, "armrs: the data\\ncannot say\n"),
        (armrs.IdentificationError("no excitation"), 1, "armrs: no excitation\n"),
        (armrs.BadInput("q", "x", "y", file="f.csv"), 2, "armrs: f.csv: q: found 'x', allowed y\n"),
        (KeyboardInterrupt(), 130, "armrs: interrupted\n"),
    ],
)
def test_errors_become_a_line_and_a_status(
    error: BaseException, status: int, line: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail() -> None:
        raise error

    monkeypatch.setattr(catalogue, "catalogue", fail)
    assert cli.main(["effects"]) == status
    assert capsys.readouterr().err == line


def test_a_reader_that_leaves_early_is_no_error() -> None:
    done = subprocess.run(
        f'"{sys.executable}" -m armrs effects | head -n 1', shell=True, capture_output=True, text=True, check=False, timeout=120
    )
    assert done.stderr == ""
    assert done.stdout.count("\n") == 1


def test_without_the_compiled_module_the_line_says_so(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(catalogue, "catalogue", dict)
    assert cli.main(["effects"]) == 1
    assert "the compiled module armrs._armrs is missing" in capsys.readouterr().err


def test_no_verb_replaces_the_report_of_another(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The second was written over the first, whose figures stayed beside it; the same verb replaces its own."""
    out = tmp_path / "out"
    assert [cli.main(["identify", str(slow_arm), "-o", str(out)]) for _ in range(2)] == [0, 0]
    page = (out / "report.html").read_bytes()
    capsys.readouterr()
    for arguments in (
        ["simulate", str(slow_arm / "truth.toml"), "--trial", str(slow_arm / "trials" / "slow_1.csv")],
        ["report", str(out / "identified.json")],
    ):
        line = refused(capsys, *arguments, "-o", out)
        assert "report.html: this folder holds a report of armrs identify; choose another -o" in line
    assert (out / "report.html").read_bytes() == page and not (out / "simulated.json").exists()


def test_the_folder_of_another_verb_is_refused_before_any_work(
    slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """`gap` was refused after its search of many minutes."""
    out = tmp_path / "out"
    assert cli.main(["passive", str(slow_arm), "-o", str(out)]) == 0
    capsys.readouterr()
    monkeypatch.setattr("armrs.io.dataset.load_dataset", lambda source: pytest.fail("work was done"))
    for verb in ("gap", "identify", "spasticity"):
        assert "this folder holds a report of armrs passive" in refused(capsys, verb, str(slow_arm), "-o", out)


def test_a_result_is_replaced_whole(slow_arm: Path, tmp_path: Path) -> None:
    """Figures of the former result, and a third movement of a plan, stayed beside the new one."""
    out = tmp_path / "out"
    assert cli.main(["identify", str(slow_arm), "-o", str(out)]) == 0
    files = sorted(out.rglob("*"))
    (out / "figures" / "torques-of-another.png").write_bytes(b"")
    (out / "notes.txt").write_text("mine", encoding="utf-8")
    assert cli.main(["identify", str(slow_arm), "-o", str(out)]) == 0
    assert sorted(out.rglob("*")) == sorted([*files, out / "notes.txt"])

    def write(part: Path) -> list[Path]:
        names = ["report.html", "movement-1.toml"]
        (part / names[0]).write_text('<meta name="generator" content="armrs plan">', encoding="utf-8")
        (part / names[1]).write_text("", encoding="utf-8")
        return [part / name for name in names]

    plan = tmp_path / "plan"
    written = io_files.write_whole(plan, write)
    (plan / "movement-2.toml").write_text("", encoding="utf-8")
    assert io_files.write_whole(plan, write) == written and sorted(plan.iterdir()) == sorted(written)


def test_files_that_no_report_says_are_its_own_are_not_replaced(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mine = tmp_path / "out" / "identified.toml"
    mine.parent.mkdir()
    mine.write_text("# mine", encoding="utf-8")
    line = refused(capsys, "identify", str(slow_arm), "-o", mine.parent)
    assert "identified.toml: armrs identify did not write this file; choose another -o" in line
    assert mine.read_text(encoding="utf-8") == "# mine" and [mine] == list(mine.parent.iterdir())


def test_a_page_of_someone_else_is_not_replaced(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "out" / "report.html"
    page.parent.mkdir()
    page.write_text("<p>the laboratory's own page</p>", encoding="utf-8")
    assert (
        cli.main(["simulate", str(slow_arm / "truth.toml"), "--trial", str(slow_arm / "trials" / "slow_1.csv"), "-o", str(page.parent)])
        == 2
    )
    assert "report.html: this folder holds a page that armrs did not make; choose another -o" in capsys.readouterr().err
    assert page.read_text(encoding="utf-8") == "<p>the laboratory's own page</p>" and [page] == list(page.parent.iterdir())
