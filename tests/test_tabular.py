"""Results in a notebook: one screen, escaped, and tidy data frames with units."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs.workflows.demo import true_model


@pytest.fixture(scope="module")
def run() -> armrs.Simulated:
    return armrs.simulate(true_model(), armrs.Movement(np.radians([[-60, 60], [-48, 60]]), speed=0.5, acceleration=2.0))


def test_a_run_is_a_data_frame_with_units(run: armrs.Simulated) -> None:
    frame = run.to_dataframe()
    assert list(frame.columns[:3]) == ["t", "q1", "q2"]
    assert frame.attrs["units"]["force_on_arm_y"] == "N"
    assert np.array_equal(frame["q2"], run.q[:, 1])


def test_estimates_are_a_tidy_frame_and_json(slow_arm: Path) -> None:
    result = armrs.identify(slow_arm)
    frame = result.to_dataframe()
    assert set(frame["group"]) >= {"parameter", "combination"}
    first = result.combinations[0]
    row = frame[(frame["group"] == "combination") & (frame["name"] == first.name)].iloc[0]
    assert (row["value"], row["low"], row["high"]) == (first.value, *first.interval)
    assert json.loads(result.to_json())["combinations"][0]["name"] == first.name


def test_a_notebook_shows_one_screen_and_no_markup_of_files(run: armrs.Simulated, slow_arm: Path) -> None:
    shown = run._repr_html_()
    assert shown.count("<tr>") == 31 and "more rows: to_dataframe()" in shown
    result = armrs.identify(slow_arm)
    named = result.dataset.replace(name="<script>alert(1)</script>")
    html = type(result)(**{**vars(result), "dataset": named})._repr_html_()
    assert "<script>" not in html and "&lt;script&gt;" in html
    assert len(html) < 20_000


def test_passive_curves_and_plans_are_tidy(slow_arm: Path) -> None:
    frame = armrs.passive_moments(slow_arm).to_dataframe()
    assert {"configuration", "joint", "angle", "half_width"} <= set(frame.columns)
    assert frame.attrs["units"]["angle"] == "rad"
