"""How far above the least that could be seen the hidden effects of some sessions are.

    python bench/hidden/limits.py out/hidden/s110000 out/hidden/s110001 …

For each session with one effect of the catalogue: the change that it makes in the angles and forces of the trials to fit, whitened with
the true noise, less what segments within their uncertainty, calibration within its tolerance and the placing of the handle could make
of it; in units of five standard deviations. It is the best possible for a method that is given the noise and searches for this one effect
only. The changes are those of the native engine with the catalogue's law.
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np

import armrs
from armrs.io.trial import Trial
from armrs.model import Effect, Model, Segment
from armrs.workflows.simulate import Sensors

STEP = 0.5e-3
"""Of the simulations [s]."""
SLIPPED = 0.5e-3 / math.sqrt(2.0)
"""Standard deviation of each coordinate of a misplaced handle [m]."""


def shown(model: Model, trial: Trial) -> np.ndarray:
    """Angles and forces as they are read, shape (n, n_joints + 2)."""
    reading = armrs.simulate(model, trial, sensors=Sensors(), seeds=[0], dt=STEP).readings[0]
    return np.column_stack([reading.q, reading.force_on_arm])


def white(change: np.ndarray, noise: dict[str, Any], n_joints: int) -> np.ndarray:
    """Return a change in units of the innovations of the noise."""
    scaled = change / np.array([noise["angle_rad"]] * n_joints + [noise["force_N"]] * 2)
    memory = noise["memory"]
    scaled[1:] = (scaled[1:] - memory * scaled[:-1]) / math.sqrt(1.0 - memory**2)
    return scaled.ravel()


def segments_off(model: Model) -> list[tuple[Model, float]]:
    """Models with one property of one segment off, and by how many standard deviations."""
    result = []
    for j, segment in enumerate(model.segments):
        for name, part in (("mass", 0.5), ("com", -0.5), ("inertia", 0.5)):
            changed = {name: getattr(segment, name) * (1.0 + part * model.segment_uncertainty)}
            others = list(model.segments)
            others[j] = segment.replace(**changed)
            result.append((model.replace(segments=tuple(others)), part))
    return result


def sensors_off(still: np.ndarray, tolerance: armrs.Tolerance, n_joints: int) -> list[np.ndarray]:
    """Return what one standard deviation of each error of the calibration changes: half of the tolerance, as `src/sensor.rs` draws them."""
    columns = []

    def add(where: int | slice, change: Any) -> None:
        column = np.zeros_like(still)
        column[:, where] = change
        columns.append(column)

    for j in range(n_joints):
        add(j, 0.5 * tolerance.angle_offset)
    for c in range(n_joints, n_joints + 2):
        add(c, 0.5 * tolerance.force_bias_N)
        add(c, 0.5 * tolerance.force_gain * still[:, c])
    forces = slice(n_joints, None)
    add(forces, -0.5 * tolerance.time_delay_s * np.gradient(still[:, forces], 0.02, axis=0))
    return columns


def above_limit(folder: Path) -> float:
    """Return the size of the effect of a session in units of the limit."""
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    (hidden,) = truth["effects"]
    data = armrs.load_dataset(folder / "data")
    noise, n = truth["noise"], truth["joints"]
    names = [segment.name for segment in data.model.segments]
    base = data.model.replace(segments=tuple(Segment(name, **s) for name, s in zip(names, truth["segments"], strict=True)))
    values = {name: stated["value"] for name, stated in hidden["parameters"].items()}
    effect = Effect(hidden["kind"], joint=hidden["joint"], channel=hidden["channel"], parameters=values)
    # Repeats show the same; a burst has none.
    trials = [trial for trial in data.fit_trials if trial.repeat == 1]
    repeats = max(trial.repeat for trial in data.fit_trials)
    if hidden["trial"]:
        trials, repeats = [trial for trial in data.fit_trials if trial.file == hidden["trial"]], 1
    misplaced = any(any(p["in_hand_m"] + p["in_room_m"]) for p in truth["placement"])
    rows, changes = [], []
    for k, trial in enumerate(trials):
        still = shown(base, trial)
        columns = [(shown(model, trial) - still) / part for model, part in segments_off(base)]
        columns += sensors_off(still, data.tolerance, n)
        common = np.column_stack([white(column, noise, n) for column in columns]) * math.sqrt(repeats)
        placing = np.zeros((len(common), 2 * len(trials)))
        for axis in range(2 * misplaced):
            assert base.robot is not None
            place = list(base.robot.base)
            place[axis] += SLIPPED
            moved = base.replace(robot=base.robot.replace(base=tuple(place)))
            placing[:, 2 * k + axis] = white(shown(moved, trial) - still, noise, n)
        rows.append(np.hstack([common, placing]))
        changes.append(white(shown(base.replace(effects=(effect,)), trial) - still, noise, n) * math.sqrt(repeats))
    nuisances = np.vstack(rows)
    # A row for each nuisance: it is zero give or take one standard deviation.
    nuisances = np.vstack([nuisances, np.eye(nuisances.shape[1])])
    change = np.concatenate([*changes, np.zeros(nuisances.shape[1])])
    basis, _ = np.linalg.qr(nuisances)
    return float(np.linalg.norm(change - basis @ (basis.T @ change))) / 5.0


def main() -> int:
    """Print a line a session, and medians."""
    found: dict[str, list[float]] = {}
    for folder in map(Path, sys.argv[1:]):
        truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
        if truth["family"] != "single":
            continue
        try:
            size = above_limit(folder)
        except armrs.SimulationError as wrong:
            print(f"{folder.name} {truth['effects'][0]['kind']}: {wrong}", flush=True)
            continue
        found.setdefault(truth["strength"], []).append(size)
        print(f"{folder.name} {truth['strength']:6} {truth['effects'][0]['kind']:18} {size:7.1f}", flush=True)
    for strength, sizes in found.items():
        print(f"{strength}: {len(sizes)} sessions, median {np.median(sizes):.0f}, from {min(sizes):.1f} to {max(sizes):.0f}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
