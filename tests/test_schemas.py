"""The JSON Schemas are those of the core, take what the readers take, and refuse what they refuse."""

from __future__ import annotations

import json
import runpy
from pathlib import Path
from typing import Any

import pytest

from armrs.io import tomlfile
from conftest import DATASET, MODEL
from test_docs import DOCS, blocks

jsonschema = pytest.importorskip("jsonschema")
SCRIPT = Path(__file__).parent.parent / "scripts" / "schemas.py"
FOLDER = SCRIPT.parents[1] / "docs" / "schemas"


def errors(name: str, text: str, tmp_path: Path) -> list[Any]:
    path = tmp_path / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    schema = json.loads((FOLDER / f"{name}.schema.json").read_text(encoding="utf-8"))
    return list(jsonschema.Draft202012Validator(schema).iter_errors(tomlfile.read(path)))


def test_the_schemas_are_those_of_the_core() -> None:
    for path, text in runpy.run_path(str(SCRIPT))["texts"]().items():
        assert path.read_text(encoding="utf-8") == text, f"{path.name} is old: run scripts/schemas.py"


SHOWN = {name: text for _, name, text in blocks(DOCS / "files.md")}
MOVEMENT, EXPERIMENT, SWEEP = (SHOWN[name] for name in ("swing.toml", "EXPERIMENT.toml", "SWEEP.toml"))
TEXTS = {"model": MODEL, "dataset": DATASET, "movement": MOVEMENT, "experiment": EXPERIMENT, "sweep": SWEEP}


BY_NAME = MODEL.replace("joint = 2", 'joint = "elbow"')


@pytest.mark.parametrize(("name", "text"), [*TEXTS.items(), ("model", BY_NAME)])
def test_what_the_readers_take_is_valid(name: str, text: str, tmp_path: Path) -> None:
    assert errors(name, text, tmp_path) == []


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("model", "torque = 0.161", "torque = -1.0"),
        ("model", 'kind = "coulomb"', 'kind = "coulom"'),
        ("model", "joint = 2", "joint = 0"),
        ("model", "viscosity = 0.25", "viskosity = 0.25"),
        ("model", "lengths = [0.45, 0.45]", "lengths = [0.45]"),
        ("dataset", 'role = "fit"', 'role = "train"'),
        ("movement", "waypoints_deg", "waypoints"),
        ("movement", "speed_rad_s = 0.1", "speed_rad_s = 0.1\nspeed_deg_s = 5.0"),
        ("experiment", "force_bits = 12", "force_bits = 12.5"),
        ("experiment", "bandwidth_rad_s", "bandwith_rad_s"),
        ("experiment", "repeats = 2", "repeats = -1"),
        ("sweep", 'experiment = "EXPERIMENT.toml"', ""),
        ("sweep", "range = [0.9, 1.1]", "range = [0.9, 1.1]\nvalues = [1.0]"),
    ],
)
def test_what_the_readers_refuse_is_not(name: str, old: str, new: str, tmp_path: Path) -> None:
    text = TEXTS[name]
    assert old in text
    assert errors(name, text.replace(old, new, 1), tmp_path)


def test_a_six_axis_force_sensor_is_valid_in_an_experiment(tmp_path: Path) -> None:
    table = SHOWN["of EXPERIMENT.toml"]
    assert errors("experiment", EXPERIMENT + table, tmp_path) == []
    assert errors("experiment", EXPERIMENT + table.replace("[0.2, 0.0, 0.1]", "[0.2, 0.0]"), tmp_path)


def test_examples_and_measured_rigs_are_valid(data: Path, tmp_path: Path) -> None:
    for folder in ("dfki_a0", "dfki_c1", "pendulum_double"):
        for name in ("model", "dataset"):
            assert errors(name, (data / folder / f"{name}.toml").read_text(encoding="utf-8"), tmp_path) == [], (folder, name)
