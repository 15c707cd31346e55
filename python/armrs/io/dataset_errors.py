"""All errors of a `dataset.toml` at once: each is corrected in a copy, so that the next one is found."""

from __future__ import annotations

import copy
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..errors import BadInput
from ..model import Description, TrialEntry
from . import tomlfile

_MOST = 100
_UNKNOWN = re.compile(r"unknown key '(.*)'")
_LISTED = re.compile(r"\[\[(added|muscle)\]\] \d+")
_SOUND = {"force_on": "robot", "model": "model.toml"}
"""Values that take the place of wrong ones; what depends on them is not looked at."""
_TRIAL = re.compile(r"\[\[trial\]\] (\d+)")


@dataclass(frozen=True)
class DatasetErrors:
    """What is wrong with a `dataset.toml`, and what can be read of it all the same.

    Attributes
    ----------
    found : list of BadInput
        Without what only follows from something else; empty when the file is sound.
    rest : Description or None
        None where a fault leaves nothing to read.
    trials : list of TrialEntry
        Those of `rest` whose file is named without a fault.
    names_model : bool
        Whether the model of `rest` is what the file says: a model file, or a subject without a fault.
    """

    found: list[BadInput]
    rest: Description | None = None
    trials: list[TrialEntry] = field(default_factory=list)
    names_model: bool = False


def dataset_errors_of(path: Path) -> DatasetErrors:
    """Return the faults of a `dataset.toml`.

    Parameters
    ----------
    path : Path

    Raises
    ------
    BadInput
        For a file that is no TOML.
    """
    document = tomlfile.read(path)
    written = copy.deepcopy(document)
    found: list[BadInput] = []
    while len(found) < _MOST:
        read = _read(document)
        if isinstance(read, Description):
            named = [trial.get("file") for trial in written["trial"]]
            return DatasetErrors(found, read, [trial for trial in read.trials if trial.file in named], read.model == written.get("model"))
        found.append(read.within(file=path))
        if not _mend(document, read):
            break
    return DatasetErrors(found)


def _read(document: dict[str, Any]) -> Description | BadInput:
    try:
        return Description.from_dict(document)
    except BadInput as error:
        return error


def _mend(document: dict[str, Any], error: BadInput) -> bool:
    """Put right in place what an error is about, and return whether that was possible."""
    place, _, key = error.place.rpartition(", ")
    unknown = _UNKNOWN.fullmatch(str(error.found))
    if unknown:
        place, key = error.place, unknown[1]
        if error.hint == "nearest known: force_on":  # else each trial with forces lacks it
            document.setdefault("force_on", "robot")
    trial = _TRIAL.fullmatch(place)
    name = place.strip("[]")
    if listed := _LISTED.match(place):
        return document.pop(listed[1], None) is not None
    if key == "[[trial]]":  # no trial is fitted
        document["trial"][0]["role"] = "fit"
        return True
    if not place and key in _SOUND:
        document[key] = _SOUND[key]
        return True
    if trial:
        number = int(trial[1])
        table = document["trial"][number - 1]
        if not unknown:  # a value that no other trial has
            table[key] = {"repeat": 1000 + number, "role": "fit"}.get(key, f"{key} of trial {number}")
            return True
    elif key == "trial" or (place and name not in ("subject", "tolerance")):
        return False
    else:
        table = document[name] if place else document
        if name == "subject":
            document.setdefault("model", "model.toml")  # else its subject lacks what was wrong
    return isinstance(table, dict) and table.pop(key, None) is not None
