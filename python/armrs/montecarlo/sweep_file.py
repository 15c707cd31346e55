"""`SWEEP.toml`: what is repeated, what varies from case to case, whether each case is identified."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .. import _armrs, checks
from ..errors import BadInput, Text
from ..io import tomlfile
from ..io.dataset import Dataset, load_dataset
from ..model import Model
from ..workflows.experiment import Experiment, experiment_of, model_at
from ..workflows.identify import LEVELS, cascade_can, effects_of
from .variation import Vary, vary_of

MOST_CASES = 1_000_000
MOST_RESAMPLES = 10_000


@dataclass(frozen=True)
class Question:
    """How each case is identified; see `armrs.identify`.

    Attributes
    ----------
    method, motion : str
    with_effects : tuple of str, optional
    cutoff : float, optional
        [Hz]
    level : float
    bootstrap : int
        Resamples of the trials of each case; 0 for none.
    """

    method: str = "joint"
    with_effects: tuple[str, ...] | None = None
    cutoff: float | None = None
    motion: str = "auto"
    level: float = 0.95
    bootstrap: int = 0


@dataclass(frozen=True, eq=False)
class Sweep:
    """Everything that `sweep` needs; it holds no paths, so that it can be sent to another machine.

    Attributes
    ----------
    name : str
    seed : int
    cases : int
    document : dict
        `EXPERIMENT.toml` with its models loaded; empty for a data set.
    path : Path
        What `document` was read from.
    dataset : Dataset, optional
        The measured session that is resampled in place of an experiment.
    vary : tuple of Vary
    question : Question, optional
        None when nothing is identified.
    digest : str
        SHA-256 of all that decides the results.
    """

    name: str
    seed: int
    cases: int
    document: dict[str, Any] = field(repr=False)
    path: Path
    dataset: Dataset | None
    vary: tuple[Vary, ...]
    question: Question | None
    digest: str

    def seed_of(self, case: int) -> int:
        """Return the seed of a case, counted from 1; it depends on the seed of the sweep and this number alone."""
        return int(np.random.SeedSequence([self.seed, case]).generate_state(1, np.uint64)[0] >> 11)

    def draws(self, case: int) -> list[Any]:
        """Return the values drawn for a case, in the order of `vary`."""
        seed = self.seed_of(case)
        return [v.draw(seed, k) for k, v in enumerate(self.vary)]

    def drawn(self, case: int) -> Experiment:
        """Return the experiment of a case, counted from 1: with its seed and the values drawn for it."""
        return self.experiment(self.seed_of(case), list(zip(self.vary, self.draws(case), strict=True)))

    def experiment(self, seed: int, changes: list[tuple[Vary, Any]]) -> Experiment:
        """Return the experiment with some values changed.

        Raises
        ------
        BadInput
            For values that do not make an experiment.
        """
        document: dict[str, Any] = self.document | {"seed": seed}
        for vary, value in changes:
            if not vary.of_truth:
                document = vary.change(document, value)

        def alter(truth: Model) -> Model:
            for vary, value in changes:
                if vary.of_truth:
                    truth = vary.change(truth, value)
            return truth

        return experiment_of(document, self.path, alter)


def load_sweep(path: str | os.PathLike[str]) -> Sweep:
    """Read `SWEEP.toml` and what it names; see docs/files.md for its keys.

    Parameters
    ----------
    path : path
        `SWEEP.toml`.

    Returns
    -------
    Sweep

    Raises
    ------
    BadInput
        Names the file, the key, the value found and the value allowed.
    """
    return tomlfile.load(path, _sweep)


def _sweep(table: dict[str, Any], path: Path) -> Sweep:
    checks.keys("", table, required=["cases"], optional=["name", "seed", "experiment", "dataset", "vary", "identify"])
    cases = checks.whole("cases", table["cases"], least=1, most=MOST_CASES)
    seed = checks.whole("seed", table.get("seed", 1), least=0, most=2**53)
    name = checks.text("name", table.get("name", path.stem))
    vary = tuple(vary_of(f"[[vary]] {k}", t) for k, t in enumerate(checks.tables("vary", table.get("vary", [])), 1))
    for k, item in enumerate(vary):
        if item.key in [other.key for other in vary[:k]]:
            raise BadInput(f"[[vary]] {k + 1}, key", item.key, "each key once")
    if ("experiment" in table) == ("dataset" in table):
        raise BadInput("experiment, dataset", Text("both" if "dataset" in table else "neither"), "one of them")
    question = _question(table["identify"]) if "identify" in table else None
    if "dataset" in table:
        return _resampled(table, path, Sweep(name, seed, cases, {}, path, None, vary, question, ""))
    source = path.parent / checks.text("experiment", table["experiment"])
    document = _experiment_document(source)
    draft = Sweep(name, seed, cases, document, source, None, vary, question, _digest(table, document))
    _check_draws(draft)
    return draft


def _experiment_document(path: Path) -> dict[str, Any]:
    """Return the tables of an experiment with its models loaded; refuse what is no experiment."""
    document = tomlfile.read(path)
    try:
        for key in ("model", "believed"):
            if key in document:
                document[key] = model_at(key, document[key], path)
        experiment_of(document, path)
    except BadInput as error:
        raise error.within(file=error.file or path) from None
    return document


def _check_draws(sweep: Sweep) -> None:
    """Refuse a key that is not there, a range that no experiment can have, and results that no case can have."""
    for k, vary in enumerate(sweep.vary, start=1):
        _check_vary(sweep, vary, f"[[vary]] {k} ({vary.key})")
    if sweep.question is not None:
        nominal = sweep.experiment(sweep.seed_of(1), [])
        _check_question(sweep.question, nominal.believed)
        worn = next((run.configuration for run in nominal.runs if run.worn), None)
        if worn is not None:
            raise BadInput("[identify]", Text(f"masses worn in movement {worn!r}"), "one arm in all trials, or no table [identify]")


def _check_vary(sweep: Sweep, vary: Vary, place: str) -> None:
    try:
        for value in vary.extremes():
            sweep.experiment(sweep.seed_of(1), [(vary, value)])
    except BadInput as error:
        raise error.within(place=place) from None


def _resampled(table: dict[str, Any], path: Path, draft: Sweep) -> Sweep:
    """Return the sweep over resamples of a measured session."""
    if draft.vary:
        raise BadInput("[[vary]]", Text(f"{len(draft.vary)} tables"), "none beside dataset: nothing is simulated")
    if draft.question is None:
        raise BadInput("[identify]", Text("nothing"), "a table [identify]: resamples of a data set are identified")
    if draft.question.bootstrap:
        raise BadInput("[identify], bootstrap", draft.question.bootstrap, "0 beside dataset: every case is a resample")
    dataset = load_dataset(path.parent / checks.text("dataset", table["dataset"]))
    if sum(t.role == "fit" for t in dataset.trials) < 2:
        raise BadInput("dataset", Text("one trial to fit"), "at least two, to draw from")
    _check_question(draft.question, dataset.model)
    return dataclasses.replace(draft, dataset=dataset, digest=_digest(table, {"files": dataset.digest()}))


def _question(table: object) -> Question:
    place = "[identify]"
    given = checks.table(place, table)
    checks.keys(place, given, optional=["method", "with", "cutoff_Hz", "motion", "level", "bootstrap"])
    kinds = given.get("with")
    if kinds is not None and not (isinstance(kinds, list) and all(isinstance(kind, str) for kind in kinds)):
        raise BadInput(f"{place}, with", kinds, 'a list of kinds of effects, as in ["coulomb"]')
    level = checks.number(f"{place}, level", given.get("level", 0.95), **LEVELS)
    cutoff = given.get("cutoff_Hz")
    return Question(
        method=checks.choice(f"{place}, method", given.get("method", "joint"), ("joint", "cascade")),
        with_effects=None if kinds is None else tuple(kinds),
        cutoff=None if cutoff is None else checks.number(f"{place}, cutoff_Hz", cutoff, above=0.0, unit="Hz"),
        motion=checks.choice(f"{place}, motion", given.get("motion", "auto"), ("auto", "measured", "simulated")),
        level=level,
        bootstrap=checks.whole(f"{place}, bootstrap", given.get("bootstrap", 0), least=0, most=MOST_RESAMPLES),
    )


def _check_question(question: Question, model: Model) -> None:
    try:
        effects_of(model, question.with_effects)
        if question.method == "cascade":
            cascade_can(question.with_effects or (), question.motion)
    except BadInput as error:
        named = BadInput("with" if error.place == "with_effects" else error.place, error.found, error.allowed, hint=error.hint)
        raise named.within(place="[identify]") from None


def _digest(table: Mapping[str, Any], source: Mapping[str, Any]) -> str:
    """Return the SHA-256 of the contents of the files, whatever their comments and order of keys, and of the version that reads them."""
    plain = {key: value.to_toml() if isinstance(value, Model) else value for key, value in source.items()}
    content = json.dumps([_armrs.__version__, table, plain], sort_keys=True, default=str)
    return hashlib.sha256(content.encode()).hexdigest()
