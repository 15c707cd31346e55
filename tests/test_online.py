"""A device's estimator, compensation and monitor in Python: the bits of the C interface, logs as they are, and refusals."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs import online
from armrs.demo import given_model, true_model
from armrs.io.samples import write_samples
from armrs.online.estimator import STATUSES
from test_export_c import BASE_FLAGS, ROOT, run

PERIOD = 1e-3
TRUTH = true_model()
MODEL = given_model(TRUTH).replace(joints=TRUTH.joints)
"""What the device is given: too heavy."""


@pytest.fixture(scope="module")
def log() -> online.Log:
    """Eight seconds of the demo's arm at 1 kHz with a sensor that loses samples, spikes, freezes and gives NaN."""
    movement = armrs.Movement(np.radians([[-60, 60], [-30, 20], [-70, 80]] * 4), speed=0.8, acceleration=4.0)
    moved = armrs.simulate(TRUTH, movement, rate=1.0 / PERIOD)
    random = np.random.default_rng(7)
    n = min(len(moved.t), 8000)
    q = moved.q[:n] + 1e-4 * random.normal(size=(n, 2))
    force = moved.force_on_arm[:n] + 0.05 * random.normal(size=(n, 2))
    q[1500], force[2000, 1], q[2500, 0] = np.nan, np.inf, q[2500, 0] + 1.0
    q[3000:3700, 1] = q[3000, 1]
    q[4000:4200, 0] += 2 * np.pi
    kept = np.r_[0:1000, 1003:1200, 1260:n]
    return online.Log(PERIOD * kept, q[kept], force[kept])


@pytest.fixture(scope="module")
def replayed(log: online.Log) -> online.Replay:
    return online.replay(log, MODEL, every=1)


@pytest.fixture(scope="module")
def replayed_single(log: online.Log) -> online.Replay:
    return online.replay(log, MODEL, settings=online.default_settings(MODEL, PERIOD, "single"), every=1)


def in_c(log: online.Log, folder: Path, precision: str) -> bytes:
    """Return what the C library makes of a log, with the arm that `armrs export-c` writes."""
    armrs.export_c(MODEL, precision=precision).write(folder)
    run(folder, f"host-{precision}")
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    library = target / "crosscheck" / f"host-{precision}-two" / "firmware" / "libarmrs_c.a"
    sources = [str(ROOT / "tests" / "online.c"), str(folder / "armrs_model.c")]
    flags = [*BASE_FLAGS, *(["-DARMRS_SINGLE"] if precision == "single" else [])]
    compiled = ["cc", "-std=c99", "-O1", "-ffp-contract=off", *flags, f"-I{folder}", *sources, str(library)]
    subprocess.run([*compiled, "-lm", "-lpthread", "-ldl", "-o", str(folder / "device")], check=True)
    places = log.places(PERIOD)
    rows = np.zeros((places[-1] + 1, 8))
    rows[places] = np.column_stack([~log.empty, log.q, log.torque, log.hand])
    given = np.concatenate([[len(rows), PERIOD], rows.ravel()]).astype("f4" if precision == "single" else "f8")
    return subprocess.run([folder / "device"], input=given.tobytes(), capture_output=True, check=True).stdout


@pytest.mark.parametrize("precision", ["double", "single"])
def test_python_has_the_bits_of_the_c_interface(log: online.Log, precision: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    if shutil.which("cc") is None:
        pytest.skip("no C compiler")
    replayed: online.Replay = request.getfixturevalue("replayed" if precision == "double" else "replayed_single")
    assert replayed.settings.precision == precision
    told = np.frombuffer(in_c(log, tmp_path, precision), "f8" if precision == "double" else "f4").astype(float)
    n = len(replayed.status)
    rows, end = told[: 9 * n].reshape(n, 9), told[9 * n :]
    assert np.array_equal(np.array(STATUSES)[rows[:, 0].astype(int)], replayed.status)
    assert {"taken", "settling", "missing", "not finite", "spike", "frozen", "not possible"} <= set(replayed.status)
    there = replayed.status != "missing"  # the device still holds the angles of an empty sample
    assert np.array_equal(rows[there, 1:3], replayed.torque[there], equal_nan=True)
    assert np.array_equal(rows[there, 3:5], replayed.torque_sd[there], equal_nan=True)
    carried = online.Compensation(MODEL, precision=precision).carry(log.q)
    assert np.array_equal(rows[log.places(PERIOD), 5:9], np.hstack([carried.torque, carried.sd]), equal_nan=True)
    unknowns = len(replayed.estimates)
    decided = np.array(["data", "prior", "bound"])
    for e, (value, sd, by) in zip(replayed.estimates, end[: 3 * unknowns].reshape(unknowns, 3), strict=True):
        assert (e.value, e.std, e.decided_by) == (value, sd, decided[int(by)])
    assert np.array_equal(end[3 * unknowns :][:5], [*replayed.residual[-1], replayed.excess[-1], replayed.age[-1], replayed.restarts])
    if precision == "single":
        return  # the monitor of Python computes in double precision
    channels = [online.Channel("angle", -2.0, 2.0, fastest=3.0, farthest=0.5, frozen_after=0.2)] * 2
    stop = online.watch(log.t, log.q, channels, period=0.1, oldest=0.002, moving=np.ones(len(log.t), dtype=bool))
    assert stop is not None and stop.reason == "not finite" and end[-5] == 1.0
    assert (stop.channel, round(stop.at * 1e6)) == (end[-4], end[-1])


def test_single_precision_learns_what_double_precision_does(replayed: online.Replay, replayed_single: online.Replay) -> None:
    """Within a tenth of a standard deviation: rounding is far below the noise of the sensors, and is there."""
    off = (replayed_single.values - replayed.values) / replayed.std
    assert 0.0 < np.abs(off).max() < 0.1
    assert np.mean(replayed_single.status == replayed.status) > 0.999


def test_a_precision_that_no_library_has_is_refused() -> None:
    for make in (lambda: online.default_settings(MODEL, PERIOD, "half"), lambda: online.Compensation(MODEL, precision="half")):
        with pytest.raises(armrs.BadInput, match="precision"):
            make()


def test_sample_by_sample_is_the_whole_log(log: online.Log, replayed: online.Replay) -> None:
    estimator = online.Estimator(MODEL, replayed.settings)
    rows = dict(zip(log.places(PERIOD).tolist(), range(len(log.t)), strict=True))
    for k in range(1600):
        row = rows.get(k)
        angles = None if row is None else log.q[row]
        force = (0.0, 0.0) if row is None else log.force_on_arm[row]  # type: ignore[index]
        assert estimator.update(angles, force_on_arm=force) == replayed.status[k]
    assert [e.value for e in estimator.estimates] == replayed.values[1599].tolist()
    assert estimator.health.age == replayed.age[1599]


def test_a_log_stored_by_columns_is_read_by_rows(log: online.Log, replayed: online.Replay) -> None:
    q, force = (np.asfortranarray(column[:900]) for column in (log.q, log.force_on_arm))
    again = online.replay(online.Log(log.t[:900], q, force), MODEL, every=1)
    assert np.array_equal(again.values, replayed.values[:900])
    assert np.array_equal(again.torque, replayed.torque[:900], equal_nan=True)


def test_the_estimator_learns_the_arm_that_made_the_log(replayed: online.Replay) -> None:
    """From segments that are 10 % too heavy: the first moments, which carry the arm, come back to those of the truth."""
    truth = armrs.Arm.from_model(TRUTH).first_moments
    given = armrs.Arm.from_model(MODEL).first_moments
    for e, true, wrong in zip(replayed.estimates[:2], truth, given, strict=True):
        assert e.decided_by == "data"
        assert abs(e.value - true) < min(3.0 * e.std, 0.5 * abs(wrong - true))


def test_results_are_tables_pictures_and_a_page(replayed: online.Replay, tmp_path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    assert "periods of 0.001 s" in repr(replayed)
    frame = replayed.to_dataframe()
    assert frame.attrs["units"]["X1"] == "kg m" and np.array_equal(frame["torque2"], replayed.torque[:, 1], equal_nan=True)
    assert replayed.to_xarray()["values"].dims == ("time", "unknown")
    assert "more rows" in replayed._repr_html_()
    for name in ("health", "estimates", "support"):
        assert len(replayed.plot(name)) >= 2
    page = replayed.report(tmp_path / "replay.html").read_text(encoding="utf-8")
    assert "Replay of a device log" in page and "not possible" in page
    from matplotlib import pyplot

    pyplot.close("all")


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_a_file_is_read_as_it_is(log: online.Log, suffix: str, tmp_path: Path) -> None:
    """Neither unwrapped nor resampled; forces on the robot change their sign; degrees are converted."""
    path = tmp_path / f"log{suffix}"
    force = np.where(np.isinf(log.force_on_arm), np.nan, log.force_on_arm)  # type: ignore[arg-type]
    write_samples(path, ["t_ms", "q1_deg", "q2_deg", "Fy_N", "Fz_N"], [1e3 * log.t, *np.degrees(log.q.T), *-force.T])
    read = online.load_log(path, 2, force_on="robot")
    assert np.allclose(read.q, log.q, rtol=1e-15, equal_nan=True) and np.array_equal(read.force_on_arm, force, equal_nan=True)
    np.savez(tmp_path / "log.npz", t=log.t, q=log.q, tau=0.0 * log.q)
    assert np.array_equal(online.Log(**np.load(tmp_path / "log.npz")).q, log.q, equal_nan=True)
    with pytest.raises(armrs.BadInput, match=r'force_on: found nothing.*"arm" or "robot"'):
        online.load_log(path, 2)


def test_errors_of_sensors_are_taken_out_of_a_log() -> None:
    """Those that the simulated sensors add, each by the formula of its effect. They were ignored without a word."""
    errors = (
        armrs.Effect("angle_offset", 2, parameters={"offset": 0.02}),
        armrs.Effect("force_bias", channel="Fz", parameters={"bias": 1.5}),
        armrs.Effect("force_gain", channel="Fy", parameters={"gain": 0.1}),
        armrs.Effect("force_misalignment", parameters={"angle": 0.05}),
    )
    model = TRUTH.replace(effects=(*TRUTH.effects, *errors))
    movement = armrs.Movement(np.radians([[-60, 60], [-30, 20]]), speed=0.8, acceleration=4.0)
    moved = armrs.simulate(model, movement, rate=1.0 / PERIOD, sensors=armrs.Sensors(rate=1.0 / PERIOD), seeds=[1])
    read = moved.readings[0]
    raw = online.Log(read.time, read.q, read.force_on_arm, read.moment_on_arm)
    clean = raw.calibrated(model)
    n = len(clean.t)
    assert np.abs(raw.q[:, 1] - moved.q[:n, 1]).min() > 0.01 and np.abs(raw.force_on_arm - moved.force_on_arm[:n]).max() > 1.0
    assert np.abs(clean.q - moved.q[:n]).max() < 1e-12
    assert np.abs(clean.force_on_arm - moved.force_on_arm[:n]).max() < 1e-10
    settings = online.default_settings(MODEL, PERIOD)
    given = MODEL.replace(effects=(*MODEL.effects, *errors))
    learned = online.replay(raw, given, settings=settings), online.replay(clean, MODEL, settings=settings)
    assert np.array_equal(learned[0].values, learned[1].values)


def test_what_cannot_be_is_refused(log: online.Log, tmp_path: Path) -> None:
    def refused(match: str, call: object, *arguments: object, **named: object) -> None:
        with pytest.raises(armrs.BadInput, match=match) as caught:
            call(*arguments, **named)  # type: ignore[operator]
        assert "\n" not in str(caught.value)

    settings = online.default_settings(MODEL, PERIOD)
    refused("period", online.default_settings, MODEL, 0.0)
    refused("period", online.default_settings, MODEL, np.nan)
    refused("noise", online.Estimator, MODEL, settings.replace(noise=(0.1, 0.1, 0.1)))
    refused("gate", online.Estimator, MODEL, settings.replace(gate=np.nan))
    refused("range", online.Estimator, MODEL, settings.replace(range=((1.0, -1.0), (0.0, 1.0))))
    refused("nearest.*cutoff|cutoff", settings.replace, cutof=10.0)
    refused("0.001 s between samples.*0.002", online.replay, log, MODEL, settings=online.default_settings(MODEL, 0.002))
    refused("2 joints.*3", online.replay, log, three_joints())
    refused("increase strictly", online.Log, log.t[::-1], log.q, log.force_on_arm)
    refused("t: found a value that is not finite", online.Log, np.full(2, np.nan), log.q[:2], log.force_on_arm)
    refused("q", online.Log, log.t, log.q[:-1], log.force_on_arm)
    refused("force_on_arm", online.Log, log.t, log.q)
    refused("two or more", online.Log, [0.0], [[0.0, 0.0]], [[0.0, 0.0]])
    refused("no such file", online.replay, tmp_path / "none.csv", MODEL, force_on="arm")
    refused("every", online.replay, log, MODEL, every=0)
    refused("q", online.Estimator(MODEL, PERIOD).update, [0.0])
    refused("q", online.Estimator(MODEL, PERIOD).carry, [[0.0]])
    refused("backlash", online.Estimator, MODEL.replace(effects=(armrs.Effect("backlash", parameters={"y": 1e-3, "z": 1e-3}),)), PERIOD)
    refused("segment_uncertainty", online.Estimator, TRUTH, PERIOD)
    refused("channels", online.Monitor, [], 0.1, 0.1)
    refused("quantity", online.Channel, "warmth")
    refused("limit of channel", online.Monitor, [online.Channel("angle", 1.0, -1.0)], 0.1, 0.1)
    refused("values", online.watch, [0.0, 0.1], [[0.0]], [online.Channel("angle")], period=0.2)
    refused("moving", online.watch, [0.0], [[0.0]], [online.Channel("angle")], period=0.2, moving=[1.0])


def three_joints() -> armrs.Model:
    segments = tuple(armrs.Segment(n, 0.3, 1.0, 0.15, 0.01) for n in ("a", "b", "c"))
    return armrs.Model(segments, tuple(armrs.Joint(s.name) for s in segments))
