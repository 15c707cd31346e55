"""Clocks of forces that were recorded by another program, and the axes and the time stamps of their files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from armrs import Arm, Model
from armrs.io.raw import RawTable, read_raw
from armrs.io.raw.table import column
from armrs.workflows import demo
from armrs.workflows.importing import clock, columns

PERIOD = 2.0
"""Of the movement that repeats itself [s]."""


@pytest.fixture(scope="module")
def model() -> Model:
    return demo.true_model()


def recorded(model: Model, offset: float, missed: float, *, repeats: bool) -> clock.Recording:
    """Return a movement whose forces have a clock `offset` ahead; `missed` is the error of the first guess [s]."""
    t = np.arange(0.0, 8.0, 0.01)
    turn = 2.0 * np.pi * t / PERIOD
    slow = 0.0 if repeats else 0.35 * np.sin(0.21 * turn) + 0.1 * np.sin(0.62 * turn + 1.0)
    q = np.column_stack([-0.9 + 0.3 * np.sin(turn) + slow, 1.2 + 0.25 * np.cos(turn) - slow])
    speed = np.gradient(q, t, axis=0)
    arm = Arm.from_model(model)
    torque = arm.inverse_dynamics(q, speed, np.gradient(speed, t, axis=0)) + 0.2 * speed
    force = np.linalg.solve(np.swapaxes(arm.jacobian(q), 1, 2), torque[..., None])[..., 0]
    return clock.Recording(t, q, t + offset, force, missed - offset)


def test_a_movement_that_repeats_itself_is_not_taken_a_period_off(model: Model) -> None:
    """Each file by itself was 2.6 s off in a session of circles, and the other files, which knew better, were not asked."""
    recordings = [recorded(model, 0.4, 0.02, repeats=False), recorded(model, 0.4, -PERIOD, repeats=True)]
    shifts = clock.refine(model, recordings)
    assert shifts == pytest.approx([-0.4, -0.4], abs=2e-3)


def test_clocks_that_differ_are_not_made_one(model: Model) -> None:
    recordings = [recorded(model, 0.4, 0.02, repeats=False), recorded(model, 1.1, 0.02, repeats=False)]
    assert clock.refine(model, recordings) == pytest.approx([-0.4, -1.1], abs=5e-3)


def test_files_that_begin_and_end_together_are_on_one_clock(model: Model) -> None:
    one = recorded(model, 0.0, 0.1, repeats=True)
    assert clock.together(one.t, one.force_t) and one.one_clock
    assert not clock.together(one.t, one.force_t + 0.05)
    assert clock.refine(model, [one, recorded(model, 0.0, -0.1, repeats=False)]) == [0.0, 0.0]


NAMES = {
    "Messzeit / ms": ("t", "ms"), "Handkraft horizontal / kN": ("Fy", "kN"), "Winkel Ellenbogen / °": ("q2", "°"), "Force up, lbf": ("Fz", "lbf"),
    "elbow_deg/s": ("dq2", "deg/s"), "handle_force_vx": ("Fx", ""), "handle_force_px": (None, ""), "Mini45.Kx [N]": ("Fx", "N"),
    "t/s": ("t", "s"), "Kx [V]": ("emg_kx", "V"),
}  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_names_and_units_of_other_laboratories(name: str) -> None:
    """`Größe / Einheit` as DIN 1313 has it; its unit was not read, and newtons were taken for kilonewtons."""
    found = column(name, np.zeros(3))
    assert (columns.symbol_of(found), found.unit) == NAMES[name]


@pytest.mark.parametrize(
    ("sizes", "taken"),
    [((5.0, 20.0, 0.0), "xy"), ((5.0, 0.1, 20.0), "xz"), ((0.0, 5.0, 20.0), "yz"), ((3.0, 5.0, 20.0), "yz"), ((0.0, 0.0, 20.0), "yz")],
)
def test_of_three_components_the_one_without_force_points_sideways(sizes: tuple[float, ...], taken: str) -> None:
    """OpenSim has y up and z sideways."""
    wave = np.sin(np.arange(50.0))
    table = RawTable(Path("a.sto"), "a", tuple(column(f"force_v{axis} [N]", size * wave) for axis, size in zip("xyz", sizes, strict=True)))
    found, _ = columns.plane(columns.guess([table], {}, []), [table])
    assert {c.symbol: c.column[7] for c in found} == {"Fy": taken[0], "Fz": taken[1]}


def test_time_stamps_of_parquet_are_a_time(tmp_path: Path) -> None:
    """As pandas writes an index of dates; they were words, and no column of time was found."""
    stamps = np.datetime64("2026-03-03T09:12:00", "us") + np.arange(5) * np.timedelta64(5000, "us")
    pq.write_table(pa.table({"q1_deg": np.arange(5.0), "__index_level_0__": stamps}), tmp_path / "a.parquet")
    (table,) = read_raw(tmp_path / "a.parquet")
    (time,) = (c for c in table.columns if columns.symbol_of(c) == "t")
    assert time.unit == "s"
    np.testing.assert_allclose(time.values, 0.005 * np.arange(5), atol=1e-12)
