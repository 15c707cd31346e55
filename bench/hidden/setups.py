"""How often a wrong setup is named, and a right one refused.

    python bench/hidden/setups.py out/hidden/s70401 out/hidden/m70402 …

Each session is written in each wrong setup, with and without the angles of the robot, and asked as `armrs identify` and `armrs gap` do
before they begin: named is a setup whose own line stands in the refusal. It prints the rows of the table in docs/own-data.md.
"""

from __future__ import annotations

import dataclasses
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

import armrs
from armrs.io.dataset import Dataset
from armrs.io.plausibility import refuse_implausible
from armrs.io.trial import Trial
from armrs.workflows.setup_check import examine_setup

Change = Callable[[Trial], Trial]


def angles(of: Callable[[np.ndarray], np.ndarray]) -> Change:
    """Other angles of the arm, shape (n, n_joints)."""
    return lambda trial: dataclasses.replace(trial, q=of(trial.q))


def forces(of: Callable[[np.ndarray], np.ndarray]) -> Change:
    """Other forces on the arm, shape (n, 2)."""
    return lambda trial: dataclasses.replace(trial, force_on_arm=None if trial.force_on_arm is None else of(trial.force_on_arm))


def offset(joint: int, by: float) -> Change:
    """Another zero of a joint, counted from 0, -1 for the last [rad]."""
    return angles(lambda q: q + by * np.eye(q.shape[1])[joint])


SETUPS: dict[str, tuple[Change, str]] = {
    "right": (lambda trial: trial, ""),
    "mirrored": (angles(lambda q: -q), "(mirrored?)"),
    "absolute": (angles(lambda q: np.cumsum(q, axis=1)), "(absolute angles?)"),
    "from the vertical": (offset(0, np.pi / 2), "(from the vertical downwards?)"),
    "forces swapped": (forces(lambda force: force[:, ::-1]), "(swapped columns?)"),
    "kN": (forces(lambda force: 1e-3 * force), "(kN labelled as N, or N as mN?)"),
    "zero of the shoulder off by 0.3 rad": (offset(0, 0.3), "(another zero: q1 is "),
    "of the elbow by 0.5 rad": (offset(1, 0.5), "(another zero: q2 is "),
    "of the last joint by 1 rad": (offset(-1, 1.0), "(another zero: q"),
}
"""What is done to a session, and the refusal of it; the first is the right setup."""


def refusal(data: Dataset, change: Change, *, robot: bool) -> str:
    """Return the line that refuses a changed session, empty where it is accepted."""
    trials = [change(trial if robot else dataclasses.replace(trial, robot_q=None)) for trial in data.trials]
    changed = data.replace(trials=tuple(trials))
    try:
        refuse_implausible(changed)
        examine_setup(changed)
    except armrs.BadInput as error:
        return str(error)
    return ""


def main(folders: list[str]) -> None:
    """Print a row with and one without robot angles."""
    named: Counter[tuple[str, str]] = Counter()
    for folder in folders:
        data = armrs.load_dataset(Path(folder) / "data")
        for where in ("with", "without"):
            for name, (change, says) in SETUPS.items():
                said = refusal(data, change, robot=where == "with")
                right = says in said if says else not said
                named[where, name] += right
                if not right:
                    print(f"{Path(folder).name} {where} robot angles, {name}: {said or 'accepted'}", file=sys.stderr)
    print("| | " + " | ".join(SETUPS) + " |")
    for where in ("with", "without"):
        print(f"| {where} robot angles (of {len(folders)}) | " + " | ".join(str(named[where, name]) for name in SETUPS) + " |")


if __name__ == "__main__":
    main(sys.argv[1:])
