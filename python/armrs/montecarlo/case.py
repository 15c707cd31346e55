"""One case: draw, simulate, measure, identify. Its rows depend only on the sweep and the number of the case."""

from __future__ import annotations

import dataclasses
import json
from typing import Any

import numpy as np

from ..analysis.quantity_expressions import value_in
from ..errors import ArmrsError, one_line
from ..io.dataset import Dataset
from ..model import Model
from ..workflows.identify import Estimate, Identified, identify
from ..workflows.record import measure
from .sweep_file import Question, Sweep

Row = dict[str, Any]
_LONGEST_REASON = 300


def compute(sweep: Sweep, first: int, last: int) -> tuple[list[Row], list[Row]]:
    """Compute the cases first to last.

    Returns
    -------
    cases, estimates : list of dict
        A row a case, and a row for each quantity of each case.
    """
    cases, estimates = [], []
    for number in range(first, last + 1):
        row, found = _case(sweep, number)
        cases.append(row)
        estimates.extend(found)
    return cases, estimates


def _case(sweep: Sweep, number: int) -> tuple[Row, list[Row]]:
    seed, draws = sweep.seed_of(number), sweep.draws(number)
    row: Row = {"case": number, "seed": seed, "status": "done"}
    for vary, value in zip(sweep.vary, draws, strict=True):
        row[vary.key] = float(value) if vary.numeric else json.dumps(value, ensure_ascii=False)
    try:
        if sweep.dataset is not None:
            dataset, truth = resampled(sweep.dataset, [seed, 0]), None
        else:
            experiment = sweep.drawn(number)
            measured = measure(experiment)
            dataset, truth = measured.dataset, experiment.truth
            row["stopped"] = sum(story["stop"] is not None for story in measured.trials)
        row |= _trial_statistics(dataset)
        if sweep.question is None:
            return row, []
        result = _identify(dataset, sweep.question)
        row |= _ended(result)
        return row, _estimates(number, result, truth, _bootstrap(dataset, sweep.question, seed))
    except ArmrsError as error:
        # A draw that makes no arm, a robot that was stopped, data that determine nothing: a finding about this case, no end of the sweep.
        return row | {"status": "failed", "reason": one_line(error)[:_LONGEST_REASON]}, []


def resampled(dataset: Dataset, seed: list[int]) -> Dataset:
    """Return a data set whose fit trials are drawn with replacement, within each configuration; test trials stay."""
    draw = np.random.default_rng(seed)
    by_configuration: dict[str, list[int]] = {}
    for k, trial in enumerate(dataset.trials):
        if trial.role == "fit":
            by_configuration.setdefault(trial.configuration, []).append(k)
    chosen = [members[i] for members in by_configuration.values() for i in draw.integers(len(members), size=len(members))]
    fit = [dataclasses.replace(dataset.trials[k], repeat=n) for n, k in enumerate(sorted(chosen), start=1)]
    return dataclasses.replace(dataset, trials=(*fit, *(t for t in dataset.trials if t.role != "fit")))


def _identify(dataset: Dataset, question: Question) -> Identified:
    return identify(
        dataset,
        method=question.method,
        with_effects=question.with_effects,
        cutoff=question.cutoff,
        motion=question.motion,
        level=question.level,
        threads=1,  # cases are what runs at a time
    )


def _trial_statistics(dataset: Dataset) -> Row:
    """Return the values of every case on its trials; forces [N]."""
    sizes = [np.hypot(*t.force_on_arm[np.isfinite(t.force_on_arm).all(axis=1)].T) for t in dataset.trials if t.force_on_arm is not None]
    row: Row = {"trials": len(dataset.trials)}
    if sizes:
        force = np.concatenate(sizes)
        row |= {"force_max_N": float(force.max()), "force_rms_N": float(np.sqrt(np.mean(force**2)))}
    return row


def _ended(result: Identified) -> Row:
    """Return how the identification of a case ended; residuals over all joints [N m]."""
    row: Row = {"solver": result.status, "sound": result.is_sound, "rank": result.rank, "unknowns": result.unknowns}
    for role, channels in result.residual_rms.items():
        row[f"residual_{role}_Nm"] = float(np.sqrt(np.mean(np.square(list(channels.values())))))
    return row


def _distinct(result: Identified) -> list[Estimate]:
    """Return combinations and parameters, each quantity once: what movements show may be both."""
    return list({(e.name, e.joint): e for e in (*result.parameters, *result.combinations)}.values())


def _bootstrap(dataset: Dataset, question: Question, seed: int) -> dict[tuple[str, int | None], np.ndarray]:
    """Return the values of every quantity over resamples of the trials of a case."""
    values: dict[tuple[str, int | None], list[float]] = {}
    for k in range(question.bootstrap):
        try:
            result = _identify(resampled(dataset, [seed, 2, k]), question)
        except ArmrsError:
            continue  # stated by the number of resamples beside the result
        for e in _distinct(result):
            values.setdefault((e.name, e.joint), []).append(e.value)
    return {key: np.array(found) for key, found in values.items()}


def _estimates(number: int, result: Identified, truth: Model | None, again: dict[tuple[str, int | None], np.ndarray]) -> list[Row]:
    rows = []
    for e in _distinct(result):
        row: Row = {
            "case": number,
            "name": e.name,
            "kind": e.kind,
            "joint": e.joint,
            "unit": e.unit,
            "truth": None if truth is None else value_in(truth, e.name, kind=e.kind, joint=e.joint),
            "given": value_in(result.dataset.model, e.name, kind=e.kind, joint=e.joint),
            "value": e.value,
            "std": e.std,
            "low": e.interval[0],
            "high": e.interval[1],
            "decided_by": e.decided_by,
        }
        values = again.get((e.name, e.joint), np.empty(0))
        if len(values) > 1:
            tail = 0.5 * (1.0 - result.level)
            low, high = np.quantile(values, [tail, 1.0 - tail])
            row |= {"bootstrap_std": float(np.std(values, ddof=1)), "bootstrap_low": float(low), "bootstrap_high": float(high)}
        rows.append(row | {"bootstraps": len(values)})
    return rows
