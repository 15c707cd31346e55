"""Clocks of forces that were recorded by another program, and the axes and the time stamps of their files."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import armrs
from armrs import Arm, Model, cli, demo
from armrs.io.raw import RawTable, read_raw
from armrs.io.raw.table import column
from armrs.workflows.importing import clock_offset, column_guess

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "scripts"))
import check_clock

PERIOD = 2.0
"""Of the movement that repeats itself [s]."""


@pytest.fixture(scope="module")
def model() -> Model:
    return demo.true_model()


def recorded(model: Model, offset: float, missed: float, *, repeats: bool) -> clock_offset.Recording:
    """Return a movement whose forces have a clock `offset` ahead; `missed` is the error of the first guess [s]."""
    t = np.arange(0.0, 8.0, 0.01)
    turn = 2.0 * np.pi * t / PERIOD
    slow = 0.0 if repeats else 0.35 * np.sin(0.21 * turn) + 0.1 * np.sin(0.62 * turn + 1.0)
    q = np.column_stack([-0.9 + 0.3 * np.sin(turn) + slow, 1.2 + 0.25 * np.cos(turn) - slow])
    speed = np.gradient(q, t, axis=0)
    arm = Arm.from_model(model)
    torque = arm.inverse_dynamics(q, speed, np.gradient(speed, t, axis=0)) + 0.2 * speed
    force = np.linalg.solve(np.swapaxes(arm.jacobian(q), 1, 2), torque[..., None])[..., 0]
    return clock_offset.Recording(t, q, t + offset, force, missed - offset)


def test_a_movement_that_repeats_itself_is_not_taken_a_period_off(model: Model) -> None:
    """Each file by itself was 2.6 s off in a session of circles, and the other files, which knew better, were not asked."""
    recordings = [recorded(model, 0.4, 0.02, repeats=False), recorded(model, 0.4, -PERIOD, repeats=True)]
    shifts = clock_offset.refine(model, recordings)
    assert shifts == pytest.approx([-0.4, -0.4], abs=2e-3)


def test_clocks_that_differ_are_not_made_one(model: Model) -> None:
    recordings = [recorded(model, 0.4, 0.02, repeats=False), recorded(model, 1.1, 0.02, repeats=False)]
    assert clock_offset.refine(model, recordings) == pytest.approx([-0.4, -1.1], abs=5e-3)


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(20112, id="fast movements, which were refused"),
        pytest.param(20115, id="clocks of their own, which were up to 6 s off"),
        pytest.param(20102, id="circles without beginning, one clock, which were a period off"),
        pytest.param(20120, id="one slow movement"),
    ],
)
def test_clocks_of_a_session_are_found_together(seed: int, tmp_path: Path) -> None:
    for case, error, _ in check_clock.found(seed, tmp_path):
        assert abs(error) <= max(case.step, 0.02)


@pytest.mark.long
def test_a_period_that_nothing_tells_is_in_doubt(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Circles without beginning, each on a clock of its own: every period explains the forces as well."""
    results = check_clock.found(20142, tmp_path)
    assert max(abs(error) for _, error, _ in results) > check_clock.PERIOD_OFF
    assert all(doubted for _, error, doubted in results if abs(error) > check_clock.PERIOD_OFF)
    with pytest.warns(armrs.errors.ArmrsWarning, match=r"forces shifted by [-+]\d+\.\d{3} s, but .* explain them about as well"):
        again = armrs.import_recordings([tmp_path / "raw"], tmp_path / "again", model=tmp_path / "session" / "model.toml")
    repeated = ["import", str(again.folder / "import.toml"), "-o", str(tmp_path / "decided")]
    assert cli.main(repeated) == 0, "import.toml decides the clocks"
    monkeypatch.setattr("armrs.workflows.importing.import_recordings", lambda *_, **__: again)
    assert cli.main(repeated) == 1 and "  in doubt: " in capsys.readouterr().out
    page = again.report(tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count("explain them about as well") >= len(again.warnings) - 1 > 0


def test_one_offset_in_doubt_is_that_of_all(model: Model) -> None:
    """One movement that repeats itself says nothing of the period; a second one on the same clock does."""
    periodic, other = (recorded(model, 0.4, 0.0, repeats=r) for r in (True, False))
    others = {"others": (-0.4 - PERIOD, -0.4, -0.4 + PERIOD)}
    (alone,) = clock_offset.certain(model, [dataclasses.replace(periodic, **others)], [-0.4])
    assert any(abs(s + 0.4 - PERIOD) < 0.05 or abs(s + 0.4 + PERIOD) < 0.05 for s in alone.others)
    both = clock_offset.certain(model, [dataclasses.replace(r, **others) for r in (periodic, other)], [-0.4, -0.4])
    assert [f.others for f in both] == [(), ()]
    assert all(f.seconds == pytest.approx(-0.4, abs=1e-9) and f.std < 1e-3 for f in both)


def test_of_a_short_recording_the_lateness_is_found_as_well(model: Model) -> None:
    """1.7 s, as fast movements are; its ends were all that was compared, and then nothing."""
    whole = recorded(model, 0.0, 0.0, repeats=False)
    for late in (0.0, 0.1):
        force = np.roll(whole.force_on_arm, round(100 * late), axis=0)[100:270]
        found, _ = clock_offset.lateness(model, whole.t[100:270], whole.q[100:270], force)
        assert found == pytest.approx(late, abs=0.01)
    assert clock_offset.lateness(model, whole.t[:60], whole.q[:60], whole.force_on_arm[:60]) == (0.0, 1.0)


def test_files_that_begin_and_end_together_are_on_one_clock(model: Model) -> None:
    one = recorded(model, 0.0, 0.1, repeats=True)
    assert clock_offset.together(one.t, one.force_t) and one.one_clock
    assert not clock_offset.together(one.t, one.force_t + 0.05)
    assert clock_offset.refine(model, [one, recorded(model, 0.0, -0.1, repeats=False)]) == [0.0, 0.0]


NAMES = {
    "Messzeit / ms": ("t", "ms"), "Handkraft horizontal / kN": ("Fy", "kN"), "Winkel Ellenbogen / °": ("q2", "°"), "Force up, lbf": ("Fz", "lbf"),
    "elbow_deg/s": ("dq2", "deg/s"), "handle_force_vx": ("Fx", ""), "handle_force_px": (None, ""), "Mini45.Kx [N]": ("Fx", "N"),
    "t/s": ("t", "s"), "Kx [V]": ("emg_kx", "V"),
}  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_names_and_units_of_other_laboratories(name: str) -> None:
    """`Größe / Einheit` as DIN 1313 has it; its unit was not read, and newtons were taken for kilonewtons."""
    found = column(name, np.zeros(3))
    assert (column_guess.symbol_of(found), found.unit) == NAMES[name]


@pytest.mark.parametrize(
    ("sizes", "taken"),
    [((5.0, 20.0, 0.0), "xy"), ((5.0, 0.1, 20.0), "xz"), ((0.0, 5.0, 20.0), "yz"), ((3.0, 5.0, 20.0), "yz"), ((0.0, 0.0, 20.0), "yz")],
)
def test_of_three_components_the_one_without_force_points_sideways(sizes: tuple[float, ...], taken: str) -> None:
    """OpenSim has y up and z sideways."""
    wave = np.sin(np.arange(50.0))
    table = RawTable(Path("a.sto"), "a", tuple(column(f"force_v{axis} [N]", size * wave) for axis, size in zip("xyz", sizes, strict=True)))
    found, _ = column_guess.plane(column_guess.guess([table], {}, []), [table])
    assert {c.symbol: c.column[7] for c in found} == {"Fy": taken[0], "Fz": taken[1]}


def test_time_stamps_of_parquet_are_a_time(tmp_path: Path) -> None:
    """As pandas writes an index of dates; they were words, and no column of time was found."""
    stamps = np.datetime64("2026-03-03T09:12:00", "us") + np.arange(5) * np.timedelta64(5000, "us")
    pq.write_table(pa.table({"q1_deg": np.arange(5.0), "__index_level_0__": stamps}), tmp_path / "a.parquet")
    (table,) = read_raw(tmp_path / "a.parquet")
    (time,) = (c for c in table.columns if column_guess.symbol_of(c) == "t")
    assert time.unit == "s"
    np.testing.assert_allclose(time.values, 0.005 * np.arange(5), atol=1e-12)
