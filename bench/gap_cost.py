"""How the cost of the gap workflow grows: processor and wall time over trials, their length, the sampling rate and the number of joints.

    python bench/gap_cost.py SESSION [SESSION ...] [--threads N]

Sessions are folders with a data set, for example of `hidden-world generate` (bench/hidden). Each is analysed as it is, and with less of one
thing: every second sample, the first half of every trial, two repeats of each movement, and as `armrs gap --quick` does. The first row of a
session names its joints, fit trials, seconds of a trial and rate. Importing and reading are not counted.
"""

from __future__ import annotations

import argparse
import dataclasses
import time
from collections import Counter
from collections.abc import Callable

import numpy as np

from armrs.io.dataset import Dataset, load_dataset
from armrs.io.trial import Trial
from armrs.workflows.gap import calibrate, find_gap


def cut(trial: Trial, kept: slice) -> Trial:
    """Return some of the samples of a trial."""
    fields = {f.name: getattr(trial, f.name) for f in dataclasses.fields(trial)}
    n = len(trial)
    return dataclasses.replace(trial, **{k: v[kept] for k, v in fields.items() if isinstance(v, np.ndarray) and len(v) == n})


def fewer_repeats(trials: tuple[Trial, ...], most: int = 2) -> tuple[Trial, ...]:
    """Return test trials, and the first fit trials of each movement."""
    count: Counter[str] = Counter()
    kept = []
    for trial in trials:
        count[trial.configuration] += trial.role == "fit"
        if trial.role != "fit" or count[trial.configuration] <= most:
            kept.append(trial)
    return tuple(kept)


def variants(data: Dataset) -> dict[str, tuple[Dataset, bool]]:
    """Return the data sets that are analysed, by what is less, and whether only the screening is run."""
    halves = tuple(cut(t, slice(0, len(t) // 2)) for t in data.trials)
    return {
        "as it is": (data, False),
        "half of the rate": (data.replace(trials=tuple(cut(t, slice(None, None, 2)) for t in data.trials)), False),
        "half of every trial": (data.replace(trials=halves), False),
        "two repeats": (data.replace(trials=fewer_repeats(data.trials)), False),
        "--quick": (data, True),
    }


def timed(job: Callable[[], object]) -> tuple[float, float]:
    """Return processor and wall time of a job [s]."""
    cpu, wall = time.process_time(), time.perf_counter()
    job()
    return time.process_time() - cpu, time.perf_counter() - wall


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sessions", nargs="+")
    parser.add_argument("--threads", type=int, default=2)
    asked = parser.parse_args()
    print("| session | joints | fit trials | s | Hz | what is less | processor s | wall s |", "| --- " * 8 + "|", sep="\n")
    for folder in asked.sessions:
        data = load_dataset(folder)
        for less, (dataset, quick) in variants(data).items():
            fit = [t for t in dataset.trials if t.role == "fit"]
            length = float(np.median([t.t[-1] for t in fit]))
            rate = (len(fit[0]) - 1) / (fit[0].t[-1] - fit[0].t[0])
            ask = calibrate if quick else find_gap
            cpu, wall = timed(lambda ask=ask, dataset=dataset: ask(dataset, threads=asked.threads))
            row = [dataset.name, data.model.n_joints, len(fit), f"{length:.0f}", f"{rate:.0f}", less, f"{cpu:.1f}", f"{wall:.1f}"]
            print("|", " | ".join(map(str, row)), "|", flush=True)


if __name__ == "__main__":
    main()
