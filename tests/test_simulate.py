"""`armrs simulate`: what it writes, and that it is the run of `armrs.simulate`."""

from __future__ import annotations

import dataclasses
import errno
import io
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow
import pyarrow.csv
import pytest
from pyarrow import parquet

import armrs
from armrs import cli
from armrs.demo import true_model
from armrs.errors import BadInput
from armrs.io.files import json_text
from armrs.io.samples import write_samples
from armrs.report import figures
from armrs.report.result_files import simulated_columns
from armrs.workflows.result_data import simulated_data
from armrs.workflows.simulate import PIECE
from armrs.workflows.streamed_simulation import stream
from conftest import MODEL


def run(*arguments: object) -> int:
    return cli.main([str(a) for a in arguments])


def test_writes_every_column_with_its_unit(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert run("simulate", slow_arm / "truth.toml", "--movement", slow_arm / "movement.toml", "-o", out) == 0
    printed, err = capsys.readouterr()
    assert "warning" not in err
    assert printed.splitlines()[-1] == str(out / "report.html")
    table = pyarrow.csv.read_csv(out / "simulated.csv")
    expected = armrs.simulate(slow_arm / "truth.toml", armrs.load_movement(slow_arm / "movement.toml", 2))
    assert expected.digest in printed
    columns = {name: table.column(name).to_numpy() for name in table.column_names}
    assert np.array_equal(columns["q2_rad"], expected.q[:, 1])
    assert np.array_equal(columns["force_on_arm_z_N"], expected.force_on_arm[:, 1])
    assert np.array_equal(columns["resisting_coulomb_joint2_Nm"], expected.columns["resisting"][:, 1])
    units = ("_s", "_rad", "_rad_s", "_rad_s2", "_m", "_N", "_Nm", "_J")
    assert all(name.endswith(units) for name in columns)
    # The equation of motion, from the file alone: B q̈ + C q̇ + G + R = τ + Jᵀ F.
    for j in (1, 2):
        left = sum(columns[f"{part}{j}_Nm"] for part in ("inertial", "centrifugal", "coriolis", "gravity", "frame", "resisting"))
        assert np.allclose(left, columns[f"drive{j}_Nm"] + columns[f"contact{j}_Nm"], atol=1e-9)


def test_a_step_found_for_an_accuracy_keeps_it(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Against a run of a step eight times shorter; command and function find the same step and have the same bits."""
    model, movement = slow_arm / "truth.toml", slow_arm / "movement.toml"
    path = armrs.load_movement(movement, 2)
    for accuracy in (1e-4, 1e-7):
        found = armrs.simulate(model, path, accuracy=accuracy)
        fine = armrs.simulate(model, path, dt=found.settings["dt_s"] / 8)
        assert np.abs(found.q - fine.q).max() <= accuracy
        assert found.settings["angle_error_rad"] <= found.settings["accuracy_rad"] == accuracy
    assert run("simulate", model, "--movement", movement, "--accuracy-rad", "1e-7", "-o", tmp_path / "out") == 0
    assert "angles right to about" in capsys.readouterr().out
    written = json.loads((tmp_path / "out" / "simulated.json").read_text())
    assert (written["digest"], written["dt_s"]) == (found.digest, found.settings["dt_s"])


@pytest.mark.parametrize(
    "options",
    [
        {"accuracy": 0.0},
        {"accuracy": float("nan")},
        {"accuracy": 1e-6, "dt": 1e-3},
        {"accuracy": 1e-6, "engine": "rapier"},
        {"accuracy": 1e-6, "integrator": "euler"},
    ],
)
def test_an_accuracy_that_cannot_be_kept_is_refused(slow_arm: Path, options: dict[str, Any]) -> None:
    with pytest.raises(BadInput, match="accuracy"):
        armrs.simulate(slow_arm / "truth.toml", duration=1.0, **options)


def test_an_accuracy_beyond_rounding_is_refused(slow_arm: Path) -> None:
    with pytest.raises(armrs.SimulationError, match="steps shorter than 1e-6 s are not tried"):
        armrs.simulate(slow_arm / "truth.toml", duration=0.2, accuracy=1e-22)


def test_json_accounts_for_the_energy(slow_arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("simulate", slow_arm / "truth.toml", "--movement", slow_arm / "movement.toml", "--json", "-") == 0
    result = json.loads(capsys.readouterr().out)
    energy = result["energy"]
    balance = energy["handle_J"] + energy["drive_J"] - energy["resisted_J"] - energy["damped_J"]
    assert energy["stored_J"] == pytest.approx(balance, abs=max(2 * energy["error_J"], 1e-12))
    assert energy["error_J"] < 1e-4 * energy["handle_J"]
    assert {"verb", "digest", "engine", "dt_s", "duration_s", "samples", "largest_force_N", "made_by"} <= set(result)


def test_a_trial_drives_the_arm_along_its_robot_angles(slow_arm: Path, tmp_path: Path) -> None:
    trial = slow_arm / "trials" / "slow_1.csv"
    assert run("simulate", slow_arm / "truth.toml", "--trial", trial, "--to", "parquet", "-o", tmp_path) == 0
    table = parquet.read_table(tmp_path / "simulated.parquet")
    measured = armrs.load_dataset(slow_arm).trials[0]
    simulated = np.column_stack([table.column(f"q{j}_rad").to_numpy() for j in (1, 2)])
    assert np.degrees(np.abs(simulated - measured.q[: len(simulated)]).max()) < 1.0
    assert json.loads((tmp_path / "simulated.json").read_text(encoding="utf-8"))["file"] == "simulated.parquet"


LONG = ("--duration-s", 12, "--rate-hz", 4000)
"""48 001 samples: two whole pieces, and a part of a third."""


def long_run(folder: Path) -> armrs.Simulated:
    return armrs.simulate(folder / "truth.toml", armrs.load_movement(folder / "movement.toml", 2), duration=12.0, rate=4000.0)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_long_run_is_written_as_if_at_once(slow_arm: Path, tmp_path: Path, suffix: str) -> None:
    out = tmp_path / "out"
    command = ("simulate", slow_arm / "truth.toml", "--movement", slow_arm / "movement.toml", *LONG, "--to", suffix[1:], "-o", out)
    assert run(*command) == 0
    whole = long_run(slow_arm)
    assert 2 * PIECE < len(whole.t) < 3 * PIECE
    expected = tmp_path / f"whole{suffix}"
    columns = simulated_columns(whole)
    if suffix == ".csv":
        write_samples(expected, list(columns), list(columns.values()))
    else:
        table = pyarrow.table(columns)
        with parquet.ParquetWriter(expected, table.schema) as writer:
            writer.write_table(table, row_group_size=PIECE)
    assert (out / f"simulated{suffix}").read_bytes() == expected.read_bytes()
    found = json.loads((out / "simulated.json").read_text(encoding="utf-8"))
    at_once = json.loads(json_text(simulated_data(whole, found["data"]["name"], found["made_by"]["command"])))
    assert {key: found[key] for key in at_once} == at_once and found["file"] == f"simulated{suffix}"
    assert found["samples"] == 48_001 and found["digest"] == whole.digest
    # Nothing is left of what was kept on the way.
    assert {p.name for p in out.iterdir()} == {"figures", "report.html", f"simulated{suffix}", "simulated.json"}
    assert [p.name for p in tmp_path.iterdir() if p.name.startswith(".")] == []


def test_pieces_of_a_whole_run_are_its_samples(slow_arm: Path) -> None:
    whole = long_run(slow_arm)
    pieces = list(whole.pieces(20_000))
    assert [p.samples for p in pieces] == [20_000, 20_000, 8001]
    for name, values in whole.columns.items():
        if isinstance(values, np.ndarray):
            assert np.array_equal(np.concatenate([p.columns[name] for p in pieces]), values), name


def test_what_is_drawn_of_a_long_run_has_its_extremes(slow_arm: Path) -> None:
    whole = long_run(slow_arm)
    drawn = figures.outline(whole)
    assert 5000 < drawn.samples <= 20_000
    for a, b in (
        (drawn.q, whole.q),
        (drawn.force_on_arm, whole.force_on_arm),
        (drawn.columns["torque.gravity"], whole.columns["torque.gravity"]),
    ):
        assert np.array_equal(a.max(axis=0), b.max(axis=0)) and np.array_equal(a.min(axis=0), b.min(axis=0))
    assert (np.diff(drawn.t) > 0).all() and drawn.t[0] == 0.0
    # Each drawn point is one of the samples near its time.
    near = np.abs(np.interp(drawn.t, whole.t, whole.q[:, 0]) - drawn.q[:, 0])
    assert near.max() < 8 / 4000 * np.abs(whole.qd).max()
    short = armrs.simulate(slow_arm / "truth.toml", armrs.load_movement(slow_arm / "movement.toml", 2))
    assert np.array_equal(figures.outline(short).q, short.q)


MEMORY = """
import resource, sys
from armrs.cli import main
assert main(sys.argv[1:]) == 0
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, file=sys.stderr)
"""


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux", reason="memory is told in other units")
def test_memory_does_not_grow_with_the_run(slow_arm: Path, tmp_path: Path) -> None:
    """Beyond a few pieces; 200 000 samples more would be 90 MB, and were twice that."""
    largest = []
    for seconds in (20, 70):
        command = ["simulate", slow_arm / "truth.toml", "--movement", slow_arm / "movement.toml", "--integrator", "euler"]
        command += ["--duration-s", seconds, "--rate-hz", 4000, "--to", "parquet", "-o", tmp_path / str(seconds)]
        done = subprocess.run([sys.executable, "-c", MEMORY, *map(str, command)], capture_output=True, text=True, check=True)
        largest.append(int(done.stderr.split()[-1]) * 1024 / 1e6)
    assert largest[1] - largest[0] < 25.0, largest


def test_what_is_kept_on_disk_has_no_name(slow_arm: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that nothing is left of a run that is killed."""
    usual, used = tempfile.TemporaryFile, []
    monkeypatch.setattr("armrs.io.files.tempfile.TemporaryFile", lambda dir: used.append((dir, usual(dir=dir))) or used[-1][1])
    movement = armrs.load_movement(slow_arm / "movement.toml", 2)
    with stream(armrs.load_model(slow_arm / "truth.toml"), movement, tmp_path / "a" / "b", duration=12.0, rate=4000.0) as run:
        assert run.samples == 48_001 and used[0][0] == tmp_path
        assert list(tmp_path.iterdir()) == [] and used[0][1].tell() > 48_001 * 8 * 40
    assert [file.closed for _, file in used] == [True]


@pytest.mark.parametrize("start", ["new", "there"])
def test_a_full_disk_is_said_and_nothing_is_left(
    slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, start: str
) -> None:
    out = tmp_path / "out"
    if start == "there":
        out.mkdir()

    class Full(io.BytesIO):
        def write(self, data: Any) -> int:
            if self.tell() > PIECE * 8:
                raise OSError(errno.ENOSPC, "No space left on device")
            return super().write(data)

    monkeypatch.setattr("armrs.io.files.tempfile.TemporaryFile", lambda dir: Full())
    assert run("simulate", slow_arm / "truth.toml", "--movement", slow_arm / "movement.toml", *LONG, "-o", out) == 2
    error = capsys.readouterr().err
    assert "No space left on device" in error and error.count("\n") == 1
    assert list(tmp_path.iterdir()) == ([out] if start == "there" else []) and not list(tmp_path.glob("out/*"))


def test_an_arm_that_runs_away_is_called_out(slow_arm: Path, data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Measured torques without a controller drive a model without friction anywhere."""
    led = armrs.simulate(slow_arm / "truth.toml", armrs.load_movement(slow_arm / "movement.toml", 2))
    assert led.warnings == ()
    assert run("simulate", data / "dfki_a0" / "model.toml", "--trial", data / "dfki_a0" / "trials" / "track_2.csv") == 0
    assert "warning: the arm runs away: from " in capsys.readouterr().err


@pytest.mark.parametrize("lost", [slice(0, 100), slice(200, 300)])
def test_a_gap_in_what_drives_the_arm_is_refused(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], lost: slice) -> None:
    head, *rows = (slow_arm / "trials" / "slow_1.csv").read_text(encoding="utf-8").splitlines()
    robot = [k for k, name in enumerate(head.split(",")) if name.startswith("qr")]
    cells = [row.split(",") for row in rows]
    for row in cells[lost]:
        for k in robot:
            row[k] = ""
    trial, out = tmp_path / "gap.csv", tmp_path / "out"
    trial.write_text("\n".join([head, *map(",".join, cells)]) + "\n", encoding="utf-8")
    assert run("simulate", slow_arm / "truth.toml", "--trial", trial, "-o", out) == 2
    found = capsys.readouterr().err.splitlines()[-1]
    assert "gap.csv: robot angles: found none at " in found and "without a gap" in found
    assert not out.exists()


def test_both_integrators_and_couplings_run(slow_arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    common = ("simulate", slow_arm / "truth.toml", "--movement", slow_arm / "movement.toml", "--duration-s", 0.2, "--json", "-")
    digests = set()
    for options in ([], ["--integrator", "euler"], ["--coupling", "rigid"], ["--dt", 0.0005]):
        assert run(*common, *options) == 0
        digests.add(json.loads(capsys.readouterr().out)["digest"])
    assert len(digests) == 4


def test_reprs_say_units(slow_arm: Path) -> None:
    run = armrs.simulate(slow_arm / "truth.toml", armrs.load_movement(slow_arm / "movement.toml", 2), duration=0.2)
    assert "N; digest" in repr(run)
    assert "2 joints" in repr(run)


def test_the_digest_stands_for_every_column(slow_arm: Path) -> None:
    movement = armrs.load_movement(slow_arm / "movement.toml", 2)
    run = armrs.simulate(slow_arm / "truth.toml", movement, duration=0.2)
    recorded = {name: values for name, values in run.columns.items() if name not in ("effects", "energy_error") and values is not None}
    assert {"time", "q", "tip", "force_on_arm", "torque.contact"} <= set(recorded)
    for name, values in recorded.items():
        other = dataclasses.replace(run, columns={**run.columns, name: np.nextafter(values, np.inf)})
        assert other.digest != run.digest, name
    assert dataclasses.replace(run).digest == run.digest


def test_a_model_without_a_robot_can_follow_a_movement(tmp_path: Path, slow_arm: Path) -> None:
    without = MODEL[: MODEL.index("[robot]")] + MODEL[MODEL.index("[contact]") :]
    (tmp_path / "model.toml").write_text(without, encoding="utf-8")
    assert run("simulate", tmp_path / "model.toml", "--movement", slow_arm / "movement.toml", "--duration-s", 0.1) == 0


def test_what_rounding_leaves_is_not_called_stored_energy(slow_arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The movement ends where it began, at rest, and a rigid coupling has no spring."""
    assert run("simulate", slow_arm / "truth.toml", "--movement", slow_arm / "movement.toml", "--coupling", "rigid") == 0
    assert "changed by 0 J" in capsys.readouterr().out


def test_both_engines_come_to_the_same(slow_arm: Path, tmp_path: Path) -> None:
    command = ("simulate", slow_arm / "truth.toml", "--movement", slow_arm / "movement.toml", "--duration-s", 1)
    tables = {}
    for engine in ("native", "rapier"):
        assert run(*command, "--engine", engine, "-o", tmp_path / engine) == 0
        tables[engine] = pyarrow.csv.read_csv(tmp_path / engine / "simulated.csv")
        result = json.loads((tmp_path / engine / "simulated.json").read_text(encoding="utf-8"))
        assert (result["engine"], result["integrator"]) == (engine, "rk4" if engine == "native" else None)
    assert tables["native"].column_names == tables["rapier"].column_names
    for name, tolerance in (("q1_rad", 1e-5), ("q2_rad", 1e-5), ("force_on_arm_y_N", 0.02), ("force_on_arm_z_N", 0.02)):
        native, rapier = (tables[engine].column(name).to_numpy() for engine in ("native", "rapier"))
        assert np.abs(native - rapier).max() < tolerance


def test_a_movement_file_knows_its_joints(slow_arm: Path, tmp_path: Path) -> None:
    assert np.array_equal(
        armrs.load_movement(slow_arm / "movement.toml").waypoints, armrs.load_movement(slow_arm / "movement.toml", 2).waypoints
    )
    (tmp_path / "flat.toml").write_text("[movement]\nwaypoints_deg = [10, 20]\n", encoding="utf-8")
    with pytest.raises(BadInput, match=r"movement\.waypoints: found 'an array of shape \(2,\)', allowed rows of angles"):
        armrs.load_movement(tmp_path / "flat.toml")


def test_sensors_that_read_faster_than_the_run_is_recorded_are_refused() -> None:
    with pytest.raises(BadInput, match="rate: found 50 Hz, allowed at least the 100 Hz of the sensors, which read what is recorded"):
        armrs.simulate(true_model(), duration=0.1, rate=50.0, sensors=armrs.Sensors(rate=100.0), seeds=[1])
    run = armrs.simulate(true_model(), duration=0.1, sensors=armrs.Sensors(rate=100.0), seeds=[1])
    assert np.array_equal(run.readings[0].q, run.q)


def test_sensors_and_seeds_belong_together() -> None:
    with pytest.raises(BadInput, match="seeds: found none, allowed a seed for each reading of the sensors"):
        armrs.simulate(true_model(), duration=0.1, sensors=armrs.Sensors())
    with pytest.raises(BadInput, match=r"seeds: found \[1\], allowed none without sensors"):
        armrs.simulate(true_model(), duration=0.1, seeds=[1])


def test_an_arm_is_made_of_a_model() -> None:
    model = true_model()
    lists = ([getattr(s, name) for s in model.segments] for name in ("length", "mass", "com", "inertia"))
    q = np.radians([[-60.0, 30.0], [-30.0, 60.0]])
    assert np.array_equal(armrs.Arm.from_model(model).gravity(q), armrs.Arm(*lists).gravity(q))


def test_a_trial_without_forces_leads_an_arm(slow_arm: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = pyarrow.csv.read_csv(slow_arm / "trials/slow_1.csv")
    pyarrow.csv.write_csv(source.drop_columns(["Fy_N", "Fz_N"]), tmp_path / "path.csv")
    digests = []
    for trial in (slow_arm / "trials/slow_1.csv", tmp_path / "path.csv"):
        assert cli.main(["simulate", str(slow_arm / "model.toml"), "--trial", str(trial), "--json", str(tmp_path / "out.json")]) == 0
        digests.append(json.loads((tmp_path / "out.json").read_text(encoding="utf-8"))["digest"])
    assert digests[0] == digests[1]
    pyarrow.csv.write_csv(source.select(["t_s", "q1_rad", "q2_rad"]), tmp_path / "angles.csv")
    assert cli.main(["simulate", str(slow_arm / "model.toml"), "--trial", str(tmp_path / "angles.csv")]) == 2
    assert "neither robot angles nor joint torques" in capsys.readouterr().err
