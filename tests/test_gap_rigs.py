"""The gap workflow on measured rigs without a robot: free swings and arms that motors drive."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs.io.dataset import Dataset

DRY = ("coulomb", "load_friction")


def named(found: armrs.GapFound) -> set[tuple[str, int | None]]:
    return {(e.kind, e.joint) for e in found.effects}


def parted(dataset: Dataset, share: float) -> Dataset:
    """Return a data set whose first trial ends at a share of its length; what follows is a test trial."""
    first = dataset.trials[0]
    cut = int(share * len(first))

    def part(span: slice, role: str) -> armrs.Trial:
        assert first.dq is not None
        assert first.tau is not None
        return armrs.Trial(
            first.file, first.configuration, first.repeat, role, first.t[span].copy(), first.q[span].copy(), tau=first.tau[span].copy()
        )

    return dataset.replace(trials=(part(slice(0, cut), "fit"), part(slice(cut, None), "test")))


@pytest.mark.long
@pytest.mark.parametrize(("rig", "most", "farthest"), [("dfki_a0", 0.135, 0.08), ("dfki_c1", 0.105, 0.03)])
def test_dry_friction_at_both_joints_of_motor_driven_arms(data: Path, rig: str, most: float, farthest: float) -> None:
    found = armrs.find_gap(data / rig, separate=False, threads=2)
    assert {(kind in DRY, joint) for kind, joint in named(found)} == {(True, 1), (True, 2)}
    after = [found.gap[f"tau{j}_Nm"].after for j in (1, 2)]
    assert np.sqrt(np.mean(np.square(after))) <= most
    # The angles of a second of simulation with the measured torques are nearer as well.
    runs = [found.gap[f"q{j}_rad"] for j in (1, 2)]
    assert all(run.after < 0.4 * run.calibrated for run in runs)
    # One of them swings up: a start that is fitted to the whole second at once is not found, and the run is off by a radian.
    assert all(run.after < farthest for run in runs)


def test_dry_friction_and_drag_of_a_pendulum_are_told_together_and_foretell_its_swing(data: Path) -> None:
    found = armrs.find_gap(parted(armrs.load_dataset(data / "pendulum_single"), 0.75), separate=False, threads=2)
    assert named(found) == {("coulomb", 1), ("quadratic_drag", 1)}
    assert found.gap["q1_rad"].after < 0.010 < found.gap["q1_rad"].calibrated


@pytest.mark.long
def test_dry_friction_of_a_double_pendulum(data: Path) -> None:
    found = armrs.find_gap(data / "pendulum_double", separate=False, threads=2)
    assert any(kind in DRY for kind, _ in named(found))
    assert named(found) <= {(kind, joint) for kind in (*DRY, "viscous", "quadratic_drag") for joint in (1, 2)}
    assert found.gap["q1_rad"].after < 0.5 * found.gap["q1_rad"].calibrated


def swing(hidden: Callable[[float], float], seed: int) -> Dataset:
    """Return a pendulum of 0.3 m that rings down for 40 s, seen by an encoder of 0.1 mrad that sits 1.5 mrad off its shaft."""
    mass, com, inertia, rate, parts = 0.15, 0.15, 1e-4, 250.0, 4
    about, weight, step = inertia + mass * com**2, 9.81 * mass * com, 1.0 / rate / parts
    angle, speed, angles = -np.pi / 2 + 1.4, 0.0, []

    def rate_of(q: float, v: float) -> float:
        return float((-weight * np.cos(q) - hidden(v)) / about)

    for i in range(int(40.0 * rate) * parts):
        if i % parts == 0:
            angles.append(angle)
        # The midpoint rule.
        q, v = angle + 0.5 * step * speed, speed + 0.5 * step * rate_of(angle, speed)
        angle, speed = angle + step * v, speed + step * rate_of(q, v)
    q = np.array(angles)
    q += 1.5e-3 * np.sin(q) + np.random.default_rng(seed).normal(0.0, 1e-4, len(q))
    t = np.arange(len(q)) / rate
    model = armrs.Model(
        segments=(armrs.Segment("link", 0.3, mass, com, inertia),), joints=(armrs.Joint("pivot"),), segment_uncertainty=0.02
    )
    cut = int(0.75 * len(q))
    trials = [
        armrs.Trial(f"trials/{role}.csv", role, 1, role, t[part].copy(), q[part, None].copy(), tau=np.zeros((len(t[part]), 1)))
        for role, part in (("fit", slice(0, cut)), ("test", slice(cut, None)))
    ]
    return Dataset(name="swing", model=model, trials=tuple(trials))


@pytest.mark.parametrize(
    ("hidden", "kinds"),
    [
        (lambda v: 0.0, set()),
        (lambda v: 2e-4 * v, {"viscous"}),
        (lambda v: 5e-4 * np.tanh(v / 0.01), {"coulomb"}),
        (lambda v: 2e-5 * v * abs(v), {"quadratic_drag"}),
        (lambda v: 5e-4 * np.tanh(v / 0.01) + 1.4e-5 * v * abs(v), {"coulomb", "quadratic_drag"}),
    ],
    ids=["nothing", "viscous", "dry", "drag", "dry and drag"],
)
def test_losses_of_simulated_swings_are_told_apart(hidden: Callable[[float], float], kinds: set[str]) -> None:
    found = armrs.find_gap(swing(hidden, 1), separate=False, threads=2)
    assert {e.kind for e in found.effects} == kinds
    if kinds:
        assert found.gap["q1_rad"].after < 0.1 * found.gap["q1_rad"].calibrated
