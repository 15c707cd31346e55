"""Virtual patients whose arm motors carry by the model that was identified of it: how much force the robot at the hand is spared.

    python bench/closed_loop.py [--patients 50] [--seed 71001] [--json FILE]

Each patient is a person of the literature with masses of their own, passive joints and dry friction; a third have a stretch reflex, a
third a tremor. The virtual laboratory records a session with a robot that leads stiffly; `armrs identify` makes a model of it from the
masses of the literature; then a robot whose handle yields (impedance and admittance in turn) leads another movement, with motors that
carry the arm by that model and without. The share by which the RMS force at the hand is lower is compared with `STATED`.

Exit status: 0 when every patient reaches the stated share and came to rest, 1 when one does not.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import armrs
from armrs.model import Model
from armrs.workflows.experiment import experiment_of
from armrs.workflows.record import Measured, measure

STATED = 0.75
"""Share by which the support lowers the RMS force at the hand of every patient."""
STATED_MEDIAN = 0.85
"""That of the median patient."""
SESSION = {
    "slow": ([[-70, 40], [-30, 40], [-30, 95], [-70, 95], [-70, 40]], 0.35, 2.0),
    "fast": ([[-65, 45], [-35, 90], [-65, 45], [-35, 45], [-65, 90], [-65, 45]], 1.2, 8.0),
}
"""Waypoints [°], largest speed [rad/s] and acceleration [rad/s²] of the movements from which the arm is identified."""
THERAPY = ([[-60, 50], [-35, 75], [-60, 90], [-60, 50]], 0.6, 3.0)
"""The movement that is supported; it is none of the session."""


def person(draw: np.random.Generator, number: int) -> dict[str, Any]:
    """Return what is true of a patient, as tables of an experiment."""
    passive = [
        {
            "stiffness": draw.uniform(0.3, 2.0),
            "rest": float(np.radians(draw.uniform(*rest))),
            "viscosity": draw.uniform(0.1, 0.5),
            "coulomb": draw.uniform(0.0, 0.2),
        }
        for rest in ((-60.0, -20.0), (40.0, 90.0))
    ]
    effects = []
    if number % 3 == 1:
        effects = [{"kind": "stretch_reflex", "joint": 2, "gain": draw.uniform(0.3, 1.2), "threshold": 0.8, "latency": 0.04}]
    if number % 3 == 2:
        effects = [{"kind": "tremor", "joint": 2, "amplitude": draw.uniform(0.05, 0.3), "frequency": draw.uniform(4.0, 7.0)}]
    height = draw.uniform(1.55, 1.95)
    subject = {"body_mass": draw.uniform(20.0, 30.0) * height**2, "height": height, "sex": ("female", "male")[number % 2], "spread": 1.0}
    return {"subject": subject, "joint": passive, "effect": effects, "handle": {"mass": 0.193}}


def movement(name: str, waypoints: list[list[float]], speed: float, acceleration: float, repeats: int, tests: int = 0) -> dict[str, Any]:
    """Return a movement as a table of an experiment."""
    limits = {"speed_rad_s": speed, "acceleration_rad_s2": acceleration, "shape": "smooth", "pause_s": 0.3}
    return {"configuration": name, "waypoints_deg": waypoints, "repeats": repeats, "tests": tests, **limits}


def recorded(tables: dict[str, Any], seed: int) -> Measured:
    """Record an experiment in memory."""
    variation = {"variation": {"moment_Nm": [0.05, 0.05]}, "sensors": {"rate_Hz": 50.0}}
    with tempfile.TemporaryDirectory() as folder:
        return measure(experiment_of({"seed": seed, **tables, **variation}, Path(folder) / "EXPERIMENT.toml"))


def supported(truth: dict[str, Any], model: Model, seed: int, law: str) -> dict[str, Any]:
    """Return how a run with support went, and the same without."""
    tables = truth | {
        "interaction": {"law": law},
        "support": {"model": model},
        "movement": [movement("therapy", *THERAPY, repeats=1)],
    }
    story: dict[str, Any] = recorded(tables, seed).trials[0]["interaction"]
    return story


def patient(number: int, seed: int) -> dict[str, Any]:
    """Return what support does for a patient."""
    draw = np.random.default_rng(seed)
    truth = person(draw, number)
    session = recorded(truth | {"movement": [movement(name, *how, repeats=1) for name, how in SESSION.items()]}, seed)
    model = armrs.identify(session.dataset).model
    law = ("impedance", "admittance")[number % 2]
    identified = supported(truth, model, seed, law)
    believed = supported(truth, session.dataset.model, seed, law)
    return {
        "law": law,
        "kind": ("passive", "reflex", "tremor")[number % 3],
        "without_N": identified["without_support"]["force_rms_N"],
        "with_N": identified["run"]["force_rms_N"],
        "lowered": identified["lowered"],
        "lowered_by_the_literature": believed["lowered"],
        "stable": identified["run"]["stable"],
        "speed_at_end_m_s": identified["run"]["speed_at_end_m_s"],
    }


def main() -> int:
    """Run."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--patients", type=int, default=50)
    parser.add_argument("--seed", type=int, default=71001)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    rows = []
    for number in range(options.patients):
        rows.append(row := patient(number, options.seed + number))
        shares = f"{row['lowered']:6.1%} lower (by the literature {row['lowered_by_the_literature']:6.1%})"
        end = "" if row["stable"] else ", not at rest"
        print(
            f"{number + 1:3d} {row['law']:10s} {row['kind']:7s} {row['without_N']:6.2f} N -> {row['with_N']:5.2f} N, {shares}{end}",
            flush=True,
        )
    lowered = np.array([row["lowered"] for row in rows])
    literature = np.array([row["lowered_by_the_literature"] for row in rows])
    unstable = sum(not row["stable"] for row in rows)
    for name, share in (("identified", lowered), ("the literature", literature)):
        print(f"{len(rows)} patients, {name}: RMS force lower by {np.median(share):.1%} (median), {share.min():.1%} (least)")
    print(f"not at rest: {unstable}")
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0 if lowered.min() >= STATED and np.median(lowered) >= STATED_MEDIAN and not unstable else 1


if __name__ == "__main__":
    raise SystemExit(main())
