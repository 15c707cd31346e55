"""How the estimated error of coupled runs compares with the true one, in the thirty systems of `tests/test_error_estimate.py`.

Prints a line for each system, and how many longer steps were called good with more error than was allowed. Some minutes.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from armrs.cosim.error_estimate import estimates, run_checked
from armrs.cosim.master import run_system
from armrs.cosim.system import System
from armrs.errors import CoupledError
from test_error_estimate import cases, made, truth

STEPS = (0.005, 0.01, 0.02, 0.03, 0.06)


def ratios(number: int) -> tuple[System, np.ndarray, np.ndarray]:
    """Return a system, and estimated over true error of its angles and of its forces."""
    joints, algorithm, step = cases()[number]
    (system, whole), (finer, _) = made(number, joints, algorithm, step), made(number, joints, algorithm, 0.5 * step)
    run, again = run_system(system), run_system(finer)
    expected = truth(whole, run.t, joints)
    found = {e.name: e.error / np.max(np.abs(run.columns[e.name] - expected[e.name])) for e in estimates(run, again) if e.name in expected}
    forces = [ratio for name, ratio in found.items() if ".F[" in name]
    return system, np.array([ratio for name, ratio in found.items() if ".F[" not in name]), np.array(forces)


def called_good(number: int, step: float) -> tuple[bool, bool]:
    """Return whether a run is called good, and whether some error of it is above what is allowed."""
    joints, algorithm, _ = cases()[number]
    system, whole = made(number, joints, algorithm, step)
    try:
        run = run_checked(system)
    except CoupledError:
        return False, False
    expected = truth(whole, run.t, joints)
    off = [np.max(np.abs(run.columns[e.name] - expected[e.name])) > e.allowed for e in run.estimates if e.name in expected]
    return run.verdict == "good", run.verdict == "good" and any(off)


def main() -> int:
    """Print the table; 1 where a factor is beyond two or a run is good and is not."""
    print("| system | joints | algorithm | step [ms] | estimated / true error, angles | forces |\n| --- | --- | --- | --- | --- | --- |")
    every = []
    for number, (joints, algorithm, step) in enumerate(cases()):
        _, angles, forces = ratios(number)
        every += [*angles, *forces]
        spans = [f"{r.min():.2f} to {r.max():.2f}" for r in (angles, forces)]
        print(f"| {number + 1} | {joints} | {algorithm} | {1e3 * step:g} | {spans[0]} | {spans[1]} |", flush=True)
    print(f"all {len(every)}: {min(every):.2f} to {max(every):.2f}")
    judged = np.array([called_good(number, step) for number in range(len(cases())) for step in STEPS])
    steps = ", ".join(f"{1e3 * s:g}" for s in STEPS)
    good, wrong = judged.sum(axis=0)
    print(f"{len(judged)} runs with steps of {steps} ms: {good} good, {wrong} of them wrongly")
    return int(min(every) < 0.5 or max(every) > 2.0 or judged[:, 1].any())


if __name__ == "__main__":
    sys.exit(main())
