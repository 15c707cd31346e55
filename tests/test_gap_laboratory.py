"""The gap workflow on little-known arms of the virtual laboratory."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import pytest

import armrs
from armrs.montecarlo.sweep_file import load_sweep
from armrs.workflows.record import measure

SWEEP = Path(__file__).parents[1] / "bench" / "sweep" / "little_known" / "SWEEP.toml"


@pytest.mark.long
def test_no_second_dry_law_stands_for_how_joints_creep() -> None:
    """Dry friction in three joints creeps below 0.01 rad/s: a joint for which another speed was chosen showed a load friction as well."""
    experiment = dataclasses.replace(load_sweep(SWEEP), seed=1396007).drawn(1)
    found = armrs.find_gap(measure(experiment).dataset, separate=False, threads=2)
    laws = {(kind, joint) for kind in ("elastic", "viscous", "coulomb") for joint in (1, 2, 3)}
    assert {(e.kind, e.joint) for e in found.effects} == laws
    for joint, true in enumerate(experiment.truth.joints, start=1):
        effect = next(e for e in found.effects if (e.kind, e.joint) == ("coulomb", joint))
        low, high = effect.parameters["torque"].interval
        assert low < true.coulomb < high
