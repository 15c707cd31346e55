"""A cohort of virtual subjects with two sessions each, in one command: whether norm bands hold the sessions of others.

    python bench/virtual_cohort.py [--cohorts 5] [--subjects 40] [--others 60] [--seed 68001]

The virtual laboratory records slow movements of the elbow of subjects whose stiffness and dry friction are drawn; in each session both
differ by a tenth of what they differ by between subjects. `armrs cohort FOLDER` reads the data sets; single sessions of other subjects,
through `armrs.passive_moments`, are compared with its bands.

Exit status: 0 when 90 to 98 of 100 are inside, for each quantity.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path

import numpy as np

import armrs
from armrs import cli
from armrs.io.dataset import Dataset
from armrs.workflows.experiment import load_experiment
from armrs.workflows.record import measure
from patients import PERSON

EXPERIMENT = """\
name = "{name}"
seed = {seed}

{person}spread = 0.0

[[joint]]
[[joint]]
stiffness = {stiffness}
rest = 1.2
coulomb = {dry}

[handle]
mass = 0.193

[variation]
moment_Nm = [0.2, 0.1]

[[movement]]
configuration = "slow"
waypoints_deg = [[-60, 40], [-60, 100], [-60, 40]]
speed_rad_s = 0.3
acceleration_rad_s2 = 1.0
shape = "smooth"
repeats = 3
"""
MIDDLE, BETWEEN, WITHIN = np.array([1.0, 0.25]), np.array([0.25, 0.06]), 0.1
"""Stiffness [N m/rad] and dry friction [N m]: mean, scatter between subjects, and the share of it between sessions of one."""
ASKED = ("stiffness in slow", "half_width in slow")


def session(name: str, values: np.ndarray, seed: int) -> Dataset:
    """Return a session of a subject with a stiffness and a dry friction."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "EXPERIMENT.toml"
        file.write_text(EXPERIMENT.format(person=PERSON, name=name, seed=seed, stiffness=values[0], dry=values[1]), encoding="utf-8")
        return measure(load_experiment(file)).dataset


def drawn(draw: np.random.Generator, sessions: int) -> list[np.ndarray]:
    """Return the values of the sessions of one subject."""
    own = MIDDLE + BETWEEN * draw.standard_normal(2)
    return [np.maximum(own + WITHIN * BETWEEN * draw.standard_normal(2), 0.01) for _ in range(sessions)]


def inside(seed: int, subjects: int, others: int) -> dict[str, list[bool]]:
    """Return, of one cohort, whether the sessions of others are inside its bands."""
    draw = np.random.default_rng(seed)
    with tempfile.TemporaryDirectory() as folder:
        for number in range(subjects):
            for visit, values in enumerate(drawn(draw, 2), start=1):
                name = f"S{number:02} 2026-0{visit}-03"
                armrs.write_dataset(session(name, values, 1000 * seed + 2 * number + visit), Path(folder) / "data" / name)
        if cli.main(["cohort", f"{folder}/data", "-o", f"{folder}/out", "--json", f"{folder}/cohort.json"]) not in (0, 1):
            raise SystemExit("armrs cohort was refused")
        result = json.loads(Path(f"{folder}/cohort.json").read_text(encoding="utf-8"))
    found: dict[str, list[bool]] = {name: [] for name in ASKED}
    for number in range(others):
        moments = armrs.passive_moments(session("other", drawn(draw, 1)[0], 1000 * seed + 500 + number))
        for e in moments.followed():
            bands = [q["norm"] for q in result["quantities"] if e.name in ASKED and e.name in q["name"] and "2" in q["name"]]
            found.get(e.name, []).extend(low <= e.value <= high for low, high in bands if e.joint == 2)
    return found


def main() -> int:
    """Run."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    for name, default in (("cohorts", 5), ("subjects", 40), ("others", 60), ("seed", 68001)):
        parser.add_argument(f"--{name}", type=int, default=default)
    options = parser.parse_args()
    total: dict[str, list[bool]] = {name: [] for name in ASKED}
    for number in range(options.cohorts):
        for name, held in inside(options.seed + number, options.subjects, options.others).items():
            total[name] += held
    for name, held in total.items():
        print(f"{name}: {sum(held)} of {len(held)} sessions of others inside, {np.mean(held):.1%}")
    return 0 if all(held and 0.9 <= np.mean(held) <= 0.98 for held in total.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
