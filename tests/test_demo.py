"""The demonstration: known values come back, nothing comes from outside, and everything says that it is synthetic."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest

import armrs
import results
from armrs import cli, demo
from browser import faults_on_paper, faults_on_screens
from markup import unescaped
from test_docs import DOCS, blocks

WITHIN = 5.0
"""Largest relative error of what the data determine [%]; the thesis has 2 to 10 on the real arm."""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, armrs.Demonstration]:
    """What the command wrote, and what the function that it calls returned."""
    out = tmp_path_factory.mktemp("session") / "demo"
    status, returned = results.behind(demo, "run_demo", "demo", "-o", str(out), "--json", str(out / "copy.json"))
    assert status == 0
    return out, returned


@pytest.fixture(scope="module")
def folder(made: tuple[Path, armrs.Demonstration]) -> Path:
    return made[0]


def test_the_result_is_a_line_a_table_json_a_figure_and_a_page(made: tuple[Path, armrs.Demonstration], tmp_path: Path) -> None:
    assert results.faults(made[1], tmp_path) == []


@pytest.fixture(scope="module")
def result(folder: Path) -> dict:
    return json.loads((folder / "demo.json").read_text(encoding="utf-8"))


def test_what_the_data_determine_comes_back(result: dict) -> None:
    measured = {(row["name"], row["joint"]): row for row in result["comparison"] if row["decided_by"] == "data"}
    assert set(measured) == {("m1*l1 + a1*m2", 1), ("m2*l2", 2), ("torque", 1), ("torque", 2)}
    for row in measured.values():
        assert abs(row["error_percent"]) < WITHIN
        low, high = row["interval"]
        assert low < row["reference"] < high


def test_masses_are_said_to_rest_on_the_model(result: dict) -> None:
    by = {row["name"]: row["decided_by"] for row in result["comparison"]}
    assert by["m2"] == by["l2"] == by["m1*l1"] == "prior"


def test_the_known_values_are_those_of_table_4_3() -> None:
    truth = demo.true_model()
    assert [(s.length, s.com, s.mass) for s in truth.segments] == [(0.376, 0.184, 1.440), (0.239, 0.115, 1.160)]
    assert [j.coulomb for j in truth.joints] == [0.139, 0.161]
    given = demo.given_model(truth)
    assert [j.coulomb for j in given.joints] == [0.0, 0.0]
    assert [s.mass for s in given.segments] == pytest.approx([1.584, 1.276])


def test_the_data_set_is_labelled_and_the_truth_lies_apart(folder: Path) -> None:
    dataset = armrs.load_dataset(folder / "data")
    assert dataset.synthetic
    assert dataset.warnings == ()
    assert (len(dataset.fit_trials), len(dataset.test_trials)) == (10, 4)
    assert armrs.load_model(folder / "truth.toml") == demo.true_model()
    assert (folder / "truth.toml").read_text(encoding="utf-8").startswith("# SYNTHETIC")
    assert "coulomb = 0.0" in (folder / "data/model.toml").read_text(encoding="utf-8")
    assert max(np.abs(t.q - t.q[0]).max() for t in dataset.trials) < np.radians(15)


def test_the_search_finds_the_brakes_and_closes_the_gap(folder: Path, result: dict) -> None:
    gap = json.loads((folder / "gap/gap.json").read_text(encoding="utf-8"))
    assert {(e["kind"], e["joint"]) for e in gap["effects"]} == {("coulomb", 1), ("coulomb", 2)}
    for effect in gap["effects"]:
        torque = effect["parameters"]["torque"]
        assert abs(torque["value"] - demo.BRAKES[effect["joint"] - 1]) < 1.96 * torque["std"] < 0.05
        # Two speeds tell dry friction from viscosity.
        assert "viscous" not in [a["kind"] for a in effect["alternatives"]]
    for name in ("Fy_N", "Fz_N"):
        channel = gap["gap"][name]
        assert channel["after"] < 1.1 * channel["floor"] < 0.6 * channel["calibrated"]
    assert result["verdict"].startswith(
        "The search found both brakes (0.139 and 0.161 N m were hidden). Missing from the model are Coulomb friction in joint 1 (shoulder), torque 0.1"
    )
    assert "coulomb = 0.0" in (folder / "session/model.toml").read_text(encoding="utf-8")


def test_the_slow_movements_alone_cannot_tell_dry_friction_from_viscosity(result: dict) -> None:
    (shoulder,) = (line for line in result["slow_alone"]["lines"] if "joint 1 (shoulder)" in line)
    assert "cannot be distinguished from" in shoulder
    assert "viscous damping" in shoulder and "Coulomb friction" in shoulder
    # What is not separated comes first.
    torn = ["cannot be distinguished from" in line for line in result["slow_alone"]["lines"]]
    assert torn == sorted(torn, reverse=True)


def test_a_converted_data_set_is_still_synthetic(folder: Path, tmp_path: Path) -> None:
    armrs.convert(folder / "data", tmp_path, to="parquet")
    assert armrs.load_dataset(tmp_path).synthetic


def test_the_direction_of_motion_shows_the_friction_before_and_not_after(folder: Path, result: dict) -> None:
    assert "shoulder 0.1" in result["missing_text"]
    assert (folder / "figures/direction.png").stat().st_size > 20_000


def test_the_report_stands_alone_and_says_synthetic(folder: Path) -> None:
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert page.count("Synthetic data: simulated, not measured") == 4
    assert page.count("<img") == page.count('src="data:image/png;base64,') >= 14
    # It opens with one sentence and the picture of the gap.
    assert (
        page.index('class="verdict"')
        < page.index("What is missing from the model, and how much of the gap it closes")
        < page.index(">What was done</h2>")
    )
    assert (folder / "copy.json").read_text(encoding="utf-8") == (folder / "demo.json").read_text(encoding="utf-8")


def test_no_string_of_the_result_becomes_markup(folder: Path, tmp_path: Path) -> None:
    assert unescaped(folder / "demo.json", tmp_path) == []


def test_the_terminal_begins_with_the_result_and_the_report_and_ends_with_how_to_go_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Stub:
        files = (tmp_path / "data" / "dataset.toml", tmp_path / "report.html")

    plain = {
        "verb": "demo",
        "story": ["a"],
        "comparison": [],
        "comparison_text": "",
        "missing_text": "b",
        "verdict": "c",
        "slow_alone": {"lines": ["e"]},
        "data": {"name": "d", "joints": []},
        "level": 0.95,
    }
    monkeypatch.setattr(demo, "run_demo", lambda out, command, tell: Stub)
    (tmp_path / "demo.json").write_text(json.dumps(plain), encoding="utf-8")
    assert cli.main(["demo", "-o", str(tmp_path)]) == 0
    first, second, *_, go_on = capsys.readouterr().out.splitlines()
    assert (first, second) == ("c", str(tmp_path / "report.html"))
    assert f"armrs identify {tmp_path / 'data'} --with coulomb" in go_on
    assert f"armrs gap {tmp_path / 'data'}" in go_on


@pytest.mark.long
def test_the_page_is_read_on_every_screen_and_on_paper(folder: Path) -> None:
    assert faults_on_screens(folder / "report.html") == []
    assert faults_on_paper(folder / "report.html") == []


@pytest.mark.long
def test_the_tutorial_runs_and_prints_what_it_shows(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its first command is the one that the other tests here look at; it ran once."""
    monkeypatch.chdir(tmp_path)
    verbs, printed = [], ""
    for language, name, content in blocks(DOCS / "tutorial.md"):
        if language == "toml":
            Path(name).write_text(content, encoding="utf-8")
        elif language == "text":
            assert content in printed
        else:
            printed = ""
            for line in content.splitlines():
                program, *arguments = shlex.split(line, comments=True)
                assert program == "armrs"
                verbs.append(arguments[0])
                if arguments == ["demo", "-o", "demo"]:
                    shutil.copytree(folder, "demo")
                    continue
                status = cli.main(arguments)
                out, err = capsys.readouterr()
                assert status == ("# ends with status 1" in line), err
                printed += out
    assert set(verbs) == {"demo", "check", "passive", "identify", "simulate", "gap", "report"}
    text = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    found = json.loads(Path("identified/identified.json").read_text(encoding="utf-8"))
    reach = {e["name"]: (e["interval"][1] - e["value"]) / e["std"] for e in (*found["combinations"], *found["calibration"])}
    for said, name in re.findall(r"([\d.]+)(?: standard deviations)? \(`(m2·l2|time delay)`\)", text):
        assert f"{reach[name.replace('·', '*')]:.2f}" == said
    assert f"{min(reach.values()):.2f} {max(reach.values()):.2f}" == "1.96 2.16"
    for file in re.findall(r"`([a-z]+/[a-z./]+)`", text):
        if not file.startswith("examples/"):
            assert Path(file).exists(), file
