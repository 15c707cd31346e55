"""Files that released versions wrote are read by this one: `tests/written/VERSION`, made with the commands in its README."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

import armrs
from armrs.cli import main
from armrs.workflows import history
from armrs.workflows.experiment import load_experiment
from sessions import again

VERSIONS = sorted((Path(__file__).parent / "written").iterdir())


@pytest.fixture(params=VERSIONS, ids=[path.name for path in VERSIONS])
def written(request: pytest.FixtureRequest) -> Path:
    return Path(request.param)


def test_a_session_is_read(written: Path) -> None:
    data = armrs.load_dataset(written / "data")
    assert [trial.configuration for trial in data.trials] == ["slow"] * 3 + ["fast"] * 2
    assert [trial.role for trial in data.trials] == ["fit", "fit", "test", "fit", "fit"]
    assert all(trial.q.shape == trial.force_on_arm.shape == (trial.t.size, 2) for trial in data.trials)


def test_an_identified_model_has_the_values_of_its_result(written: Path) -> None:
    stated = {p["name"]: p["value"] for p in json.loads((written / "identified.json").read_text(encoding="utf-8"))["parameters"]}
    model = armrs.load_model(written / "identified.toml")
    assert model.segments[1].mass == pytest.approx(stated["m2"], rel=1e-9)


def test_results_become_a_page(written: Path, tmp_path: Path) -> None:
    results = [str(written / f"{verb}.json") for verb in ("identified", "passive", "simulated")]
    assert main(["report", *results, "-o", str(tmp_path / "page")]) == 0
    assert (tmp_path / "page" / "report.html").is_file()


def test_a_history_goes_on(written: Path, tmp_path: Path) -> None:
    file = tmp_path / "history.sqlite"
    shutil.copy(written / "history.sqlite", file)
    first = history.read(file)
    found = armrs.identify(armrs.load_dataset(written / "data"), with_effects=["coulomb", "viscous"])
    # Another recording of the same: a copy is refused where the history knows its samples.
    longer = history.add(file, again(found, 1), "2030-01-01")
    assert {course.dates for course in first.courses} == {("2026-11-25",)}
    assert {course.dates for course in longer.courses} >= {("2026-11-25", "2030-01-01")}


def test_plans_of_work_are_read(written: Path) -> None:
    assert armrs.load_movement(written / "swing.toml").waypoints.shape == (3, 2)
    assert [run.configuration for run in load_experiment(written / "EXPERIMENT.toml").runs] == ["slow", "fast"]
    assert armrs.load_sweep(written / "SWEEP.toml").cases == 4
