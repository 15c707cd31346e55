"""Sessions of the virtual laboratory as a world of the judge: subjects drawn at random of whom a model of the literature is known.

    python bench/hidden/laboratory.py [--family little_known|single|double] [--strength strong|medium] --seed 60001 --count 12 -o FOLDER

What varies is read from `bench/sweep/little_known/SWEEP.toml`; `armrs record` makes each session. In the families single and double the
laws of the joints are known, without dry friction, and one effect or two more act that are not. The simulator is the one under test,
behind a robot controller and sensors of its own, so this world shows whether a first day gives results, and whether intervals hold; not
whether another's laws are recognised.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import shutil
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np
from mujoco_world.sizes import SIZES

from armrs.io.dataset import load_dataset
from armrs.model import Effect, Model
from armrs.montecarlo.sweep_file import load_sweep
from armrs.workflows.experiment import Experiment
from armrs.workflows.record import record

FAMILIES = {"single": 1, "double": 2}
"""Families of arms that are otherwise known, and how many effects are hidden."""

LAWS = {"elastic": ("stiffness", "rest"), "viscous": ("viscosity",), "coulomb": ("coulomb",)}
"""Laws of a joint, by the values in the true model; the size of each is the first."""
NAMES = {"coulomb": "torque"}
"""What the parameter of an effect is called where a joint calls it otherwise."""
KINDS = ("coulomb", "quadratic_drag", "cubic_elastic", "relaxation", "constant_moment", "biarticular", "stretch_reflex")
"""Hidden effects, of the sizes of the MuJoCo world."""
POSTURE = (-1.05, 1.05, 0.0)
"""About which the movements lead the arm [rad]."""
KEPT = ("dataset.toml", "model.toml", "trials")
FASTER = 1.5
"""A reflex acts where its joint moves this many times as fast as its threshold."""


def told(kind: str, joint: int | None, parameters: Mapping[str, float], exact: Collection[str]) -> dict[str, object]:
    """Return an effect as `truth.json` has it; other parameters than the exact ones are of a shape that need not be met."""
    own = {name: {"value": value, "exact": name in exact} for name, value in parameters.items()}
    return {"kind": kind, "joint": joint, "channel": None, "trial": None, "parameters": own}


def truth(model: Model) -> list[dict[str, object]]:
    """Return the laws that act in the joints of the true arm."""
    return [
        told(kind, number, own := {NAMES.get(name, name): getattr(joint, name) for name in names}, own)
        for number, joint in enumerate(model.joints, start=1)
        for kind, names in LAWS.items()
        if getattr(joint, names[0])
    ]


def hidden(kind: str, strength: str, draw: np.random.Generator) -> Effect:
    """Draw an effect of a kind."""
    joint = int(draw.integers(1 if kind == "biarticular" else 0, 3))
    size = float(draw.uniform(*SIZES[kind][strength == "medium"][joint]))
    near = POSTURE[joint] + float(draw.uniform(-0.2, 0.4))
    others: dict[str, dict[str, float]] = {
        "coulomb": {"torque": size, "smoothing": 0.0},
        "quadratic_drag": {"drag": size},
        "cubic_elastic": {"stiffness": size, "rest": near},
        "relaxation": {"stiffness": size, "time": float(draw.uniform(0.3, 1.5))},
        "constant_moment": {"moment": size * float(draw.choice([-1.0, 1.0]))},
        "biarticular": {"stiffness": size, "ratio": float(draw.uniform(0.7, 1.3)), "rest": near + POSTURE[joint - 1]},
        "stretch_reflex": {"gain": size, "threshold": float(draw.uniform(0.1, 0.4)), "direction": float(draw.choice([-1.0, 1.0]))},
    }
    return Effect(kind, joint + 1, parameters=others[kind])


def acts(effects: Sequence[Effect], folder: Path) -> bool:
    """Return whether every reflex acts in some trial of a session: where no joint moves faster than its threshold, nothing is hidden."""
    reflexes = [effect for effect in effects if effect.kind == "stretch_reflex"]
    trials = load_dataset(folder).trials if reflexes else ()

    def fastest(effect: Effect) -> float:
        """Return the fastest mean speed over a quarter of a second in its direction [rad/s]."""
        apart = [max(1, round(0.25 * trial.rate)) for trial in trials]
        moved = [
            (t.q[k:, (effect.joint or 1) - 1] - t.q[:-k, (effect.joint or 1) - 1]) * t.rate / k for t, k in zip(trials, apart, strict=True)
        ]
        return max(float((effect.parameters["direction"] * speed).max()) for speed in moved)

    return all(fastest(effect) > FASTER * effect.parameters["threshold"] for effect in reflexes)


def recorded(experiment: Experiment, folder: Path) -> None:
    """Record a session and keep what a laboratory hands over."""
    shutil.rmtree(folder, ignore_errors=True)
    record(experiment, folder / "all")
    (folder / "data").mkdir()
    for name in KEPT:
        shutil.move(folder / "all" / name, folder / "data" / name)
    shutil.rmtree(folder / "all")


def prepared(experiment: Experiment, effects: Sequence[Effect]) -> Experiment:
    """Return an experiment with an arm whose joints are known and frictionless, but for some effects."""
    truth = experiment.truth.replace(joints=[joint.replace(coulomb=0.0) for joint in experiment.truth.joints])
    return dataclasses.replace(
        experiment, truth=truth.replace(effects=(*truth.effects, *effects)), believed=experiment.believed.replace(joints=truth.joints)
    )


def main() -> None:
    """Make the sessions and a manifest of them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--family", choices=["little_known", *FAMILIES], default="little_known")
    parser.add_argument("--strength", choices=["strong", "medium"], default="strong")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("-o", type=Path, required=True, dest="folder")
    options = parser.parse_args()
    sweep = load_sweep(Path(__file__).parents[1] / "sweep" / "little_known" / "SWEEP.toml")
    made = []
    for seed in range(options.seed, options.seed + options.count):
        experiment, folder = dataclasses.replace(sweep, seed=seed).drawn(1), options.folder / f"l{seed}"
        if options.family in FAMILIES:
            draw = np.random.default_rng(seed)
            # Numbers that follow each other go round all kinds.
            own = [KINDS[(seed + 3 * k) % len(KINDS)] for k in range(FAMILIES[options.family])]
            while True:
                added = [hidden(kind, options.strength, draw) for kind in own]
                recorded(prepared(experiment, added), folder)
                if acts(added, folder / "data"):
                    break
            effects = [told(e.kind, e.joint, e.parameters, [*e.parameters][:1]) for e in added]
        else:
            recorded(experiment, folder)
            effects = truth(experiment.truth)
        said = {
            "world": "laboratory",
            "seed": seed,
            "family": options.family,
            "strength": options.strength,
            "joints": len(experiment.truth.joints),
            "null": None,
            "friction": None,
            "effects": effects,
            "noise": {"memory": 0.0},
        }
        (folder / "truth.json").write_text(json.dumps(said, indent=1) + "\n", encoding="utf-8")
        made.append({"folder": folder.name, "seed": seed, "family": options.family})
    (options.folder / "manifest.json").write_text(json.dumps({"sessions": made}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
