"""Every fault of a `dataset.toml` at once: each is put right in a copy, so that the next shows."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from ..errors import BadInput
from ..model import Description
from . import tomlfile

_MOST = 100
_UNKNOWN = re.compile(r"unknown key '(.*)'")
_TRIAL = re.compile(r"\[\[trial\]\] (\d+)")


def faults_of(path: Path) -> list[BadInput]:
    """Return what is wrong with a `dataset.toml`, without what only follows from something else; nothing when it is sound.

    Parameters
    ----------
    path : Path

    Raises
    ------
    BadInput
        For a file that is no TOML.
    """
    document = tomlfile.read(path)
    found: list[BadInput] = []
    while len(found) < _MOST and (error := _first(document)) is not None:
        found.append(error.within(file=path))
        if not _mend(document, error):
            break
    return found


def _first(document: dict[str, Any]) -> BadInput | None:
    try:
        Description.from_dict(document)
    except BadInput as error:
        return error
    return None


def _mend(document: dict[str, Any], error: BadInput) -> bool:
    """Put right in place what an error is about, and return whether that was possible."""
    place, _, key = error.place.rpartition(", ")
    unknown = _UNKNOWN.fullmatch(str(error.found))
    if unknown:
        place, key = error.place, unknown[1]
    trial = _TRIAL.fullmatch(place)
    name = place.strip("[]")
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
