"""Sessions of the virtual laboratory as a world of the judge: subjects drawn at random of whom a model of the literature is known.

    python bench/hidden/laboratory.py --seed 60001 --count 12 -o out/hidden/laboratory

What varies is read from `bench/sweep/little_known/SWEEP.toml`; `armrs record` makes each session. The simulator is the one under test,
behind a robot controller and sensors of its own, so this world shows whether a first day gives results, and whether intervals hold; not
whether another's laws are recognised.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import shutil
from pathlib import Path

from armrs.model import Model
from armrs.montecarlo.sweep_file import load_sweep
from armrs.workflows.record import record

LAWS = {"elastic": ("stiffness", "rest"), "viscous": ("viscosity",), "coulomb": ("coulomb",)}
"""Laws of a joint, by the values in the true model; the size of each is the first."""
NAMES = {"coulomb": "torque"}
"""What the parameter of an effect is called where a joint calls it otherwise."""
KEPT = ("dataset.toml", "model.toml", "trials")


def truth(model: Model) -> list[dict[str, object]]:
    """Return the laws that act in the joints of the true arm."""
    return [
        {
            "kind": kind,
            "joint": number,
            "channel": None,
            "trial": None,
            "parameters": {NAMES.get(name, name): {"value": getattr(joint, name), "exact": True} for name in names},
        }
        for number, joint in enumerate(model.joints, start=1)
        for kind, names in LAWS.items()
        if getattr(joint, names[0])
    ]


def main() -> None:
    """Make the sessions and a manifest of them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--count", type=int, required=True)
    parser.add_argument("-o", type=Path, required=True, dest="folder")
    options = parser.parse_args()
    sweep = load_sweep(Path(__file__).parents[1] / "sweep" / "little_known" / "SWEEP.toml")
    made = []
    for seed in range(options.seed, options.seed + options.count):
        experiment = dataclasses.replace(sweep, seed=seed).drawn(1)
        folder = options.folder / f"l{seed}"
        shutil.rmtree(folder, ignore_errors=True)
        record(experiment, folder / "all")
        (folder / "data").mkdir()
        for name in KEPT:
            shutil.move(folder / "all" / name, folder / "data" / name)
        shutil.rmtree(folder / "all")
        said = {
            "world": "laboratory",
            "seed": seed,
            "family": "little_known",
            "strength": "strong",
            "joints": len(experiment.truth.joints),
            "null": None,
            "friction": None,
            "effects": truth(experiment.truth),
            "noise": {"memory": 0.0},
        }
        (folder / "truth.json").write_text(json.dumps(said, indent=1) + "\n", encoding="utf-8")
        made.append({"folder": folder.name, "seed": seed, "family": "little_known"})
    (options.folder / "manifest.json").write_text(json.dumps({"sessions": made}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
