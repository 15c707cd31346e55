"""Sweeps: the same bytes however they are run, interrupted or shared, and what they come to."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pyarrow import parquet

import armrs
from armrs import BadInput
from armrs.cli import main
from armrs.montecarlo import figures, load_sweep
from armrs.montecarlo.case import compute, resampled
from armrs.montecarlo.summary import Moments, Quantity, Summary
from armrs.montecarlo.variation import vary_of
from armrs.report import plotting
from armrs.workflows.identify import identify
from armrs.workflows.record import measure
from markup import unescaped

EXPERIMENT = """\
[subject]
body_mass = 77.0
height = 1.80
sex = "male"

[[joint]]
coulomb = 0.15

[[joint]]
coulomb = 0.1

[handle]
mass = 0.193

[[movement]]
waypoints_deg = [[-60, 60], [-40, 60], [-60, 80], [-60, 60]]
speed_rad_s = 1.2
acceleration_rad_s2 = 4.0
shape = "smooth"
repeats = 2
tests = 1
"""

SWEEP = """\
name = "small"
cases = 5
seed = 5
experiment = "EXPERIMENT.toml"

[identify]
with = ["coulomb"]

[[vary]]
key = "subject.body_mass"
normal = [75.0, 10.0]
within = [50, 100]

[[vary]]
key = "segment[2].com"
range = [0.9, 1.1]
apply = "scale"

[[vary]]
key = "joint[2].coulomb"
range = [0.05, 0.3]

[[vary]]
key = "subject.sex"
values = ["male", "female"]

[[vary]]
key = "sensors.force_noise_N"
range = [0.1, 0.5]
"""
TABLES = ("cases.parquet", "estimates.parquet")


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sweep")
    (folder / "EXPERIMENT.toml").write_text(EXPERIMENT, encoding="utf-8")
    (folder / "SWEEP.toml").write_text(SWEEP, encoding="utf-8")
    return folder / "SWEEP.toml"


@pytest.fixture(scope="module")
def plain(source: Path) -> Path:
    """The sweep as one process computes it."""
    return armrs.sweep(source, source.parent / "plain").cases.parent


def tables(folder: Path) -> list[bytes]:
    return [(folder / name).read_bytes() for name in TABLES]


def wait_until(there: Callable[[], bool]) -> None:
    end = time.monotonic() + 60.0
    while not there():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_a_case_is_its_experiment_recorded_and_identified(source: Path, plain: Path, tmp_path: Path) -> None:
    """Written out and read back by the other verbs, the third case gives the same numbers."""
    spec = load_sweep(source)
    row = parquet.read_table(plain / "cases.parquet").to_pylist()[2]
    assert (row["case"], row["seed"], row["status"], row["sound"]) == (3, spec.seed_of(3), "done", True)
    changes = [(v, row[v.key] if v.numeric else json.loads(row[v.key])) for v in spec.vary]
    recorded = armrs.record(spec.experiment(row["seed"], changes), tmp_path)
    result = armrs.identify(recorded.dataset, with_effects="coulomb")
    found = {(e.name, e.joint): e for e in (*result.parameters, *result.combinations)}
    kept = [e for e in parquet.read_table(plain / "estimates.parquet").to_pylist() if e["case"] == 3]
    assert len(kept) == len(found)
    for e in kept:
        same = found[e["name"], e["joint"]]
        assert (e["value"], e["std"], (e["low"], e["high"])) == (same.value, same.std, same.interval)
    truth = armrs.load_model(tmp_path / "truth" / "truth.toml")
    friction = {e["joint"]: e["truth"] for e in kept if e["kind"] == "coulomb"}
    assert friction == {1: 0.15, 2: row["joint[2].coulomb"]} == {j: truth.joints[j - 1].coulomb for j in (1, 2)}


def test_what_is_drawn_reaches_the_arm_and_not_what_is_believed(source: Path) -> None:
    spec = load_sweep(source)
    heavy = spec.experiment(1, [(spec.vary[1], 1.1)])
    usual = spec.experiment(1, [])
    assert heavy.believed == usual.believed
    hand = usual.truth.segments[1]
    # The handle comes after the change: centre of mass of the forearm alone, from that of both.
    alone = (hand.com * hand.mass - 0.193 * hand.length) / (hand.mass - 0.193)
    assert heavy.truth.segments[1].com == pytest.approx((1.1 * alone * (hand.mass - 0.193) + 0.193 * hand.length) / hand.mass)


@pytest.mark.long
def test_processes_and_interruptions_change_no_byte(source: Path, plain: Path, tmp_path: Path) -> None:
    assert tables(armrs.sweep(source, tmp_path / "two", jobs=2).cases.parent) == tables(plain)

    class Enough(Exception):
        pass

    def stop(cases: int, seen: list[int] = []) -> None:  # noqa: B006
        seen.append(cases)
        if sum(seen) >= 3:
            raise Enough

    cut = tmp_path / "cut"
    with pytest.raises(Enough):
        armrs.sweep(source, cut, step=stop)
    assert not (cut / "cases.parquet").exists()
    parts = {p.name: p.stat().st_mtime_ns for p in (cut / "parts").iterdir()}
    assert len(parts) == 6
    (cut / "parts" / ".0000004-cases.parquet.x.part").write_bytes(b"half")
    again = armrs.sweep(source, cut)
    assert again.run["computed"] == 2
    assert tables(cut) == tables(plain) and not (cut / "parts").exists()
    assert [p.name for p in cut.iterdir() if p.name.startswith(".")] == []
    assert armrs.sweep(source, cut).run["computed"] == 0


def test_a_killed_process_is_said_and_the_rest_is_done_later(source: Path, plain: Path, tmp_path: Path) -> None:
    import multiprocessing

    def kill(cases: int) -> None:
        for child in multiprocessing.active_children():
            child.kill()

    with pytest.raises(armrs.ArmrsError, match="goes on where it stopped"):
        armrs.sweep(source, tmp_path / "out", jobs=2, step=kill)
    assert tables(armrs.sweep(source, tmp_path / "out").cases.parent) == tables(plain)


@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "killpg"), reason="groups of processes are POSIX")
def test_a_killed_command_leaves_no_process_and_goes_on(source: Path, plain: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [sys.executable, "-m", "armrs", "sweep", str(source), "-o", str(out), "--jobs", "2"]
    with subprocess.Popen(command, start_new_session=True) as run:
        wait_until(lambda: any(out.glob("parts/*-cases.parquet")))
        run.kill()

    def all_gone() -> bool:
        try:
            os.killpg(run.pid, 0)
        except ProcessLookupError:
            return True
        return False

    wait_until(all_gone)
    done = armrs.sweep(source, out)
    assert 0 < done.run["computed"] < 5 and tables(out) == tables(plain)


@pytest.mark.long
@pytest.mark.filterwarnings("default")
def test_a_cluster_that_loses_a_worker_gives_the_same_bytes(source: Path, plain: Path, tmp_path: Path) -> None:
    if os.environ.get("CI") != "true":
        pytest.importorskip("distributed")
    import distributed

    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        victims = list(client.run(os.getpid).values())

        def kill(cases: int) -> None:
            if cases and victims:
                os.kill(victims.pop(), 9)
                victims.clear()

        done = armrs.sweep(source, tmp_path / "out", cluster=cluster.scheduler_address, step=kill)
    assert not victims and done.run["computed"] == 5
    assert tables(tmp_path / "out") == tables(plain)


def test_a_folder_with_another_sweep_is_refused(source: Path, plain: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = tables(plain)
    other = source.with_name("other.toml")
    other.write_text(SWEEP.replace("seed = 5", "seed = 6"), encoding="utf-8")
    assert main(["sweep", str(other), "-o", str(plain)]) == 2
    assert "found results of another sweep, allowed the folder of this SWEEP.toml" in capsys.readouterr().err
    assert tables(plain) == before
    # Comments and the order of keys are no other sweep.
    other.write_text("# again\nseed = 5\n" + SWEEP.replace("seed = 5\n", ""), encoding="utf-8")
    assert armrs.sweep(other, plain).run["computed"] == 0


def test_the_command_says_what_came_out(source: Path, plain: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sweep", str(source), "-o", str(plain)]) == 0
    out = capsys.readouterr().out
    assert "5 cases simulated and identified." in out and "segment[2].com" in out and "Nothing was left to compute." in out
    assert main(["sweep", str(source), "-o", str(plain), "--json", "-"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["cases"] == 5 and data["failed"] == 0 and data["run"]["computed"] == 0
    rows = parquet.read_table(plain / "estimates.parquet").to_pylist()
    for q in data["quantities"]:
        own = [r for r in rows if (r["name"], r["joint"], r["kind"]) == (q["name"], q["joint"], q["kind"])]
        error = np.array([r["value"] - r["truth"] for r in own])
        assert q["error"]["mean"] == pytest.approx(error.mean(), abs=1e-12)
        assert q["error"]["rms"] == pytest.approx(np.sqrt(np.mean(error**2)), abs=1e-12)
        assert q["coverage"] == pytest.approx(np.mean([r["low"] <= r["truth"] <= r["high"] for r in own]))
    page = (plain / "report.html").read_text(encoding="utf-8")
    assert "Synthetic data" in page and "What was found" in page and page.count("<img") == 2
    assert main(["report", str(plain / "sweep.json"), "-o", str(plain / "again")]) == 0


def test_no_string_of_the_result_becomes_markup(plain: Path, tmp_path: Path) -> None:
    assert unescaped(plain / "sweep.json", tmp_path) == []


def test_moments_in_pieces_are_moments_of_the_whole() -> None:
    values = np.random.default_rng(1).normal(1e6, 1.0, 1000)
    moments = Moments()
    for piece in np.split(values, [1, 7, 500]):
        moments.add(np.append(piece, np.nan))
    assert moments.n == 1000
    assert moments.mean == pytest.approx(values.mean(), rel=1e-15)
    assert moments.std == pytest.approx(values.std(ddof=1), rel=1e-9)


def test_what_does_not_vary_has_no_spread_of_rounding() -> None:
    """A mass that nothing measures stood in the table as ± 6.2e-15 kg."""
    moments = Moments()
    moments.add(np.array([2.087, np.nextafter(2.087, 3.0), 2.087]))
    assert moments.std == 0.0


@pytest.mark.parametrize(
    ("table", "low", "high", "mean"),
    [
        ({"range": [2.0, 4.0]}, 2.0, 4.0, 3.0),
        ({"normal": [1.0, 0.5], "within": [0.5, 1.5]}, 0.5, 1.5, 1.0),
        ({"values": [1.0, 2.0]}, 1.0, 2.0, 1.5),
    ],
)
def test_draws_have_their_distribution(table: dict[str, object], low: float, high: float, mean: float) -> None:
    vary = vary_of("", {"key": "handle.mass", **table})
    drawn = np.array([vary.draw(seed, 0) for seed in range(1000)])
    assert low <= drawn.min() < low + 0.01 * (high - low) + 1e-9 and high - 0.01 * (high - low) - 1e-9 < drawn.max() <= high
    # Four standard deviations of the mean of a uniform distribution over the range, which is wider than the cut normal one.
    assert drawn.mean() == pytest.approx(mean, abs=4 * (high - low) / 2 / np.sqrt(1000))
    assert [vary.draw(3, k) for k in range(3)] != [vary.draw(3, 0)] * 3


def test_movements_and_effects_vary_too(source: Path) -> None:
    spec = load_sweep(source)
    waypoint = vary_of("", {"key": "movement[1].waypoints_deg[2][1]", "range": [-45, -35]})
    assert np.degrees(spec.experiment(1, [(waypoint, -41.0)]).runs[0].movement.waypoints[1, 0]) == pytest.approx(-41.0)
    stiff = vary_of("", {"key": "contact.stiffness[2]", "range": [0.5, 1.0], "apply": "scale"})
    assert spec.experiment(1, [(stiff, 0.5)]).truth.contact.stiffness == (10_000.0, 5_000.0)
    assert spec.experiment(1, [(stiff, 0.5)]).believed.contact.stiffness == (10_000.0, 10_000.0)


def test_a_case_that_cannot_be_is_a_finding(source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A normal distribution without limits may draw what no arm has; the others count all the same."""
    text = SWEEP.replace("cases = 5", "cases = 4").replace("range = [0.05, 0.3]", "normal = [0.05, 0.3]")
    bad = source.with_name("bad.toml")
    bad.write_text(text, encoding="utf-8")
    assert main(["sweep", str(bad), "-o", str(tmp_path), "--jobs", "1"]) == 1
    rows = parquet.read_table(tmp_path / "cases.parquet").to_pylist()
    failed = [r for r in rows if r["status"] == "failed"]
    assert {r["joint[2].coulomb"] < 0 for r in failed} == {True} and 0 < len(failed) < 4
    assert all("coulomb: found -" in r["reason"] for r in failed)
    out = capsys.readouterr().out
    assert f"{len(failed)} of them failed" in out
    # One reason, whatever was drawn.
    assert out.count("coulomb: found …") == 1 and f"{len(failed)} × " in out


def test_a_data_set_is_resampled(source: Path, tmp_path: Path) -> None:
    armrs.record(source.with_name("EXPERIMENT.toml"), tmp_path / "data")
    file = tmp_path / "SWEEP.toml"
    file.write_text('cases = 4\ndataset = "data"\n[identify]\nwith = ["coulomb"]\n', encoding="utf-8")
    done = armrs.sweep(file, tmp_path / "out")
    data = armrs.load_dataset(tmp_path / "data")
    drawn = [[t.file for t in resampled(data, [load_sweep(file).seed_of(k), 0]).trials] for k in range(1, 5)]
    assert all(len(names) == 3 and names[2].endswith("_3.csv") for names in drawn)
    assert len({tuple(names) for names in drawn}) > 1
    both = identify(resampled(data, [load_sweep(file).seed_of(1), 0]), with_effects="coulomb")
    first = [r for r in parquet.read_table(done.estimates).to_pylist() if r["case"] == 1]
    expected = {(e.name, e.joint): e.value for e in (*both.parameters, *both.combinations)}
    assert {(r["name"], r["joint"]): r["value"] for r in first} == expected
    assert all(r["truth"] is None for r in first)
    assert all(q["coverage"] is None for q in done.data["quantities"])


def test_without_identification_forces_are_left(source: Path, tmp_path: Path) -> None:
    file = source.with_name("simulated.toml")
    file.write_text('cases = 2\nexperiment = "EXPERIMENT.toml"\n', encoding="utf-8")
    done = armrs.sweep(file, tmp_path)
    rows = parquet.read_table(done.cases).to_pylist()
    force = measure(load_sweep(file).experiment(rows[1]["seed"], [])).dataset.trials
    sizes = np.concatenate([np.hypot(*t.force_on_arm.T) for t in force])
    assert rows[1]["force_max_N"] == sizes.max() and "solver" not in rows[0]
    assert done.data["quantities"] == [] and parquet.read_table(done.estimates).num_rows == 0


def test_the_bootstrap_of_a_case(source: Path) -> None:
    file = source.with_name("bootstrap.toml")
    file.write_text(SWEEP.replace("[identify]", "[identify]\nbootstrap = 6"), encoding="utf-8")
    _, estimates = compute(load_sweep(file), 1, 1)
    assert {e["bootstraps"] for e in estimates} == {6}
    assert all(e["bootstrap_low"] <= e["bootstrap_high"] and e["bootstrap_std"] >= 0 for e in estimates)
    # Two trials are not many to draw from: half of the resamples are one of them twice.
    friction = next(e for e in estimates if e["kind"] == "coulomb" and e["joint"] == 2)
    assert 0 < friction["bootstrap_std"] < 0.1 * friction["value"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("cases = 5", "cases = 0", "cases: found 0, allowed a whole number 1 to 1000000"),
        ("cases = 5", "cases = 2000000", "cases: found 2000000, allowed a whole number 1 to 1000000"),
        ("cases = 5", "case = 5", "found unknown key 'case'"),
        ("cases = 5", "cases = 5.0", "cases: found 5.0"),
        ("seed = 5", "seed = -1", "seed: found -1"),
        ('experiment = "EXPERIMENT.toml"', "", "found neither, allowed one of them"),
        ('experiment = "EXPERIMENT.toml"', 'experiment = "gone.toml"', "gone.toml: no such file"),
        ('experiment = "EXPERIMENT.toml"', 'experiment = "EXPERIMENT.toml"\ndataset = "."', "found both, allowed one of them"),
        ("range = [0.9, 1.1]", "range = [1.1, 0.9]", "range: found [1.1, 0.9], allowed low and high, low first"),
        ("range = [0.9, 1.1]", "range = [0.9, nan]", "range[1]: found nan"),
        ("range = [0.9, 1.1]", "range = [0.9, inf]", "range[1]: found inf"),
        ("range = [0.9, 1.1]", "range = [0.9]", "allowed two numbers, not 1"),
        ("range = [0.9, 1.1]", "rnage = [0.9, 1.1]", "unknown key 'rnage', allowed apply, key, normal, range, values, within"),
        ("range = [0.9, 1.1]", "range = [0.9, 1.1]\nnormal = [1, 1]", "found 2 distributions, allowed one of range, normal, values"),
        ("range = [0.9, 1.1]", "range = [0.9, 1.1]\nwithin = [0, 1]", "within: found [0, 1], allowed only beside normal"),
        ("range = [0.9, 1.1]", "range = [0.9, 9.0]", "[[vary]] 2 (segment[2].com)"),
        ("normal = [75.0, 10.0]", "normal = [75.0, -1.0]", "normal[1]: found -1.0, allowed a finite number > 0"),
        ("within = [50, 100]", "within = [100, 50]", "within: found [100.0, 50.0], allowed low and high"),
        ("within = [50, 100]", "within = [500, 600]", "limits that hold at least 0.001 of the distribution"),
        ('apply = "scale"', 'apply = "times"', 'apply: found \'times\', allowed "replace" or "scale" or "add"'),
        ('values = ["male", "female"]', "values = []", "values: found [], allowed a list of at least one value"),
        ('values = ["male", "female"]', 'values = ["male", "femal"]', "[[vary]] 4 (subject.sex)"),
        ('"segment[2].com"', '"segment[3].com"', "allowed a position [1] to [2]"),
        ('"segment[2].com"', '"segment[0].com"', "allowed a position [1] to [2]"),
        ('"segment[2].com"', '"segment[2].cmo"', "found unknown key 'cmo'"),
        ('"segment[2].com"', '"segment.com"', "allowed no com below a single value"),
        ('"segment[2].com"', '"segment[2]..com"', "key: found 'segment[2]..com', allowed names with points"),
        ('"segment[2].com"', '"effect[1].torque"', "allowed no position: the list is empty"),
        ('"segment[2].com"', '"sensors.rate_Hz"', "a value of sensors.rate_Hz in the experiment to scale"),
        ('"subject.body_mass"', '"subjects.body_mass"', "found unknown first name 'subjects'"),
        ('"sensors.force_noise_N"', '"joint[2].coulomb"', "[[vary]] 5, key: found 'joint[2].coulomb', allowed each key once"),
        ('"sensors.force_noise_N"', '"seed"', "found unknown first name 'seed'"),
        ('with = ["coulomb"]', 'with = ["coloumb"]', "[identify], with: found unknown joint effect 'coloumb'"),
        ('with = ["coulomb"]', 'with = "coulomb"', "[identify], with: found 'coulomb', allowed a list"),
        ('with = ["coulomb"]', 'with = ["stribeck"]\nmethod = "cascade"', "[identify], with: found 'stribeck'"),
        ('with = ["coulomb"]', "bootstrap = -1", "[identify], bootstrap: found -1"),
        ('with = ["coulomb"]', "level = 1.0", "[identify], level: found 1.0"),
    ],
)
def test_refused(source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, message: str) -> None:
    assert SWEEP.count(old) == 1
    file = source.with_name("refused.toml")
    file.write_text(SWEEP.replace(old, new), encoding="utf-8")
    assert main(["sweep", str(file), "-o", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1, error
    assert not (tmp_path / "out").exists()


def test_what_else_is_refused(source: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    (tmp_path / "file").write_text("x", encoding="utf-8")
    for arguments, message in (
        (["-o", str(tmp_path / "file")], "-o: found a file, allowed a folder"),
        (["-o", str(tmp_path / "file" / "below")], "Not a directory"),
        (["-o", str(out), "--jobs", "0"], "--jobs: found 0, allowed a whole number 1 to 1024"),
        (["-o", str(out), "--jobs", "2", "--cluster", "tcp://127.0.0.1:1"], "no --jobs beside --cluster"),
    ):
        assert main(["sweep", str(source), *arguments]) == 2
        error = capsys.readouterr().err
        assert message in error and error.count("\n") == 1
    assert not out.exists()


@pytest.mark.filterwarnings("default")
def test_no_cluster_is_refused(source: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if os.environ.get("CI") != "true":
        pytest.importorskip("distributed")
    from armrs.montecarlo import workers

    monkeypatch.setattr(workers, "_PATIENCE", 1)
    for address in ("tcp://127.0.0.1:1", "nonsense"):
        with pytest.raises(BadInput, match="allowed the address of a Dask scheduler"):
            armrs.sweep(source, tmp_path / "out", cluster=address)
    assert not (tmp_path / "out").exists()


def test_a_movement_beyond_the_robot_is_refused_before_anything_is_written(source: Path, tmp_path: Path) -> None:
    source.with_name("fast.toml").write_text(
        EXPERIMENT.replace("speed_rad_s = 1.2", "speed_rad_s = 9.0").replace("acceleration_rad_s2 = 4.0", "acceleration_rad_s2 = 90.0"),
        encoding="utf-8",
    )
    file = source.with_name("too-fast.toml")
    file.write_text(SWEEP.replace("EXPERIMENT.toml", "fast.toml"), encoding="utf-8")
    with pytest.raises(BadInput, match="of a joint of the robot"):
        armrs.sweep(file, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_sweep_of_files_md_is_read(tmp_path: Path) -> None:
    page = (Path(__file__).parents[1] / "docs" / "files.md").read_text(encoding="utf-8")
    for name in ("EXPERIMENT.toml", "SWEEP.toml"):
        content = page.split(f"```toml {name}\n")[1].split("```")[0]
        (tmp_path / name).write_text(content, encoding="utf-8")
    with pytest.raises(BadInput, match="masses worn in movement 'fixed elbow', allowed one arm in all trials"):
        load_sweep(tmp_path / "SWEEP.toml")
    whole = (tmp_path / "EXPERIMENT.toml").read_text(encoding="utf-8")
    (tmp_path / "EXPERIMENT.toml").write_text(whole.partition('[[movement]]\nconfiguration = "fixed elbow"')[0], encoding="utf-8")
    shown = load_sweep(tmp_path / "SWEEP.toml")
    assert (shown.cases, len(shown.vary), shown.question.with_effects) == (200, 5, ("coulomb",))
    text = page.partition("## SWEEP.toml")[2].partition("\n## ")[0]
    from armrs.montecarlo.store import _cases, _estimates

    for column in (*_cases(shown).names, *_estimates().names):
        assert f"`{column}`" in text or column in [v.key for v in shown.vary], column


def quantity(name: str, value: np.ndarray, truth: np.ndarray) -> Quantity:
    made = Quantity(name, "segment", 1, "kg")
    rows = {key: np.full(len(value), np.nan) for key in ("std", "bootstrap_std", "bootstrap_low", "bootstrap_high")}
    made.add(rows | {"value": value, "truth": truth, "low": value - 1.0, "high": value + 1.0}, ["data"] * len(value))
    return made


def test_the_figure_has_no_empty_panels_and_explains_its_line() -> None:
    truth = np.linspace(1.0, 2.0, 9)
    never = np.full(9, np.nan)
    same = 2.0867 * (1.0 + 1e-15 * np.arange(9))  # one value but for rounding was a panel without bars
    listed = [quantity(f"m{k}", truth + 0.01 * k, truth) for k in range(4)] + [quantity("I1", never, never), quantity("m9", same, same)]
    data = {"data": {"joints": ["shoulder"]}, "level": 0.95, "quantities": [q.to_dict(0.95) for q in listed[:4]]}
    with plotting.style():
        values, coverage = (draw().figure for draw in figures.sweep(Summary(listed, {}), data).values())
    assert [len(ax.lines) for ax in values.axes] == [2, 2, 2, 2]
    assert [text.get_text() for text in values.legends[0].get_texts()] == ["a case", "truth"]
    # Of intervals that all hold the truth the markers lie at the end of the axis.
    markers = [line for line in coverage.axes[0].lines if line.get_marker() == "o"]
    assert max(markers[0].get_xdata()) == 100.0 and not markers[0].get_clip_on()
    assert [text.get_text() for text in coverage.axes[0].get_legend().get_texts()] == ["promised", "intervals of the fit"]
