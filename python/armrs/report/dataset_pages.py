"""Pages, figures and sentences of data sets that were imported, checked or recorded."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from ..formatting import how_many
from ..io.dataset import Dataset, load_dataset
from ..workflows import result_data
from . import figures, interaction, interactive, recording, run_animation
from .tables import Table
from .view import View

if TYPE_CHECKING:
    from ..workflows.check_dataset import Checked
    from ..workflows.importing import Imported
    from ..workflows.record import Recorded

MOST_RECORDINGS = 6
"""So many movements of a session are drawn, one trial of each."""


def recordings(dataset: Dataset | None, section: str = "") -> figures.Figures:
    """Return how the arm stood in one trial of each movement, and what was recorded of it, for a section of the report."""
    if dataset is None:
        return {}
    trials = list({t.configuration: t for t in reversed(dataset.trials)}.values())[::-1]
    made: dict[str, Callable[[], figures.Drawn]] = {}
    for trial in trials[:MOST_RECORDINGS]:
        made |= {f"{trial.configuration}, arm": partial(recording.arm, trial, dataset.model, section)}
        made |= {trial.configuration: partial(recording.channels, trial, dataset.model, section)}
    return made


def verdict(result: Mapping[str, Any]) -> str:
    """Return a check or an import in a sentence."""
    if result["verb"] == "import":
        return f"{how_many(len(result['trials']), 'trial')} imported: {result['convention']['words']}."
    errors = sum(p["level"] == "error" for p in result["problems"])
    warnings = len(result["problems"]) - errors
    able = [v["verb"] for v in result["verbs"] if v["able"]]
    found = f"{how_many(errors, 'error')} and {how_many(warnings, 'warning')}" if result["problems"] else "No problem was found"
    return f"{found}; {', '.join(able) or 'no verb'} can use the data."


def problems(result: Mapping[str, Any]) -> list[str]:
    """Return every problem and its next step, a line each."""
    return [f"{p['level']}: {p['text']}" + (f". Next: {p['next_step']}" if p["next_step"] else "") for p in result["problems"]]


def abilities(result: Mapping[str, Any]) -> Table:
    """Return what each verb can do with the data."""
    return Table(["verb", "can use the data", "why"], [[v["verb"], "yes" if v["able"] else "no", v["why"]] for v in result["verbs"]], 3)


def channels(result: Mapping[str, Any]) -> Table:
    """Return which column became what, and why."""
    rows = [[c["symbol"], c["column"], c["unit"], "−" if c["sign"] < 0 else "+", c["why"]] for c in result["channels"]]
    return Table(["symbol", "column", "unit", "sign", "why"], rows, 5)


def decisions(result: Mapping[str, Any]) -> list[str]:
    """Return what was decided beside the columns, which have a table."""
    columns = {f"{c['symbol']}: column {c['column']!r}" for c in result["channels"]}
    return [note for note in result["notes"] if note.partition(", ")[0] not in columns]


def trials(result: Mapping[str, Any]) -> Table:
    """Return which file became which trial."""
    rows = [[t["file"], t["configuration"], t["repeat"], t["role"]] for t in result["trials"]]
    return Table(["file", "configuration", "repeat", "role"], rows, 2)


def _of(dataset: Dataset | None, name: str) -> dict[str, Any]:
    return {"name": name, "synthetic": False} if dataset is None else result_data.data_of(dataset)


def checked_data(result: Checked, command: str | None = None) -> dict[str, Any]:
    """Return a check as it is written to JSON."""
    return {**result.to_dict(), "data": _of(result.dataset, "a data set that cannot be read"), "made_by": result_data.origin(command)}


def imported_data(result: Imported, command: str | None = None) -> dict[str, Any]:
    """Return an import as it is written to JSON."""
    return {**result.to_dict(), "data": _of(load_dataset(result.folder), result.folder.name), "made_by": result_data.origin(command)}


def recorded_data(result: Recorded) -> dict[str, Any]:
    """Return a session of the virtual laboratory as a report reads it."""
    return {**result.to_dict(), "made_by": result_data.origin(None)}


def recorded_figures(result: Recorded) -> figures.Figures:
    """Return the figures of a session of the virtual laboratory."""
    return {**interaction.figures(result), **recordings(result.dataset)}


def first_trial(dataset: Dataset | None) -> interactive.Live:
    """Return what moves: the first trial."""
    return interactive.NOTHING if dataset is None or not dataset.trials else run_animation.recorded(dataset.trials[0], dataset.model)


CHECKED = View(checked_data, lambda result, _: recordings(result.dataset), lambda result: first_trial(result.dataset))
IMPORTED = View(imported_data, lambda result, _: recordings(load_dataset(result.folder), "first"))
RECORDED = View(recorded_data, lambda result, _: recorded_figures(result), lambda result: first_trial(result.dataset))
