"""Which arm of the subject was measured: `side` in `[subject]` of a `dataset.toml`.

The arm is a property of the session, not of the person: `Dataset.side` holds it, not `Subject`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import checks
from ..errors import BadInput, Text
from ..model import Description
from . import tomlfile

SIDES = ("left", "right")
WORDS = {"left": ("left", "l", "links", "li"), "right": ("right", "r", "rechts", "re")}
"""How tables write a side, in any case."""
_TABLE = "[subject]"


def side_of(place: str, value: object) -> str | None:
    """Return a side as files state it; None stays."""
    return None if value is None else checks.choice(place, value, SIDES)


def written_side(word: str) -> str | None:
    """Return the side that a word of a table means, None for one that means none.

    >>> written_side("Links"), written_side("R"), written_side("upper")
    ('left', 'right', None)
    """
    return next((side for side, words in WORDS.items() if word.strip().lower() in words), None)


def other(side: str) -> str:
    """Return the other side."""
    return SIDES[1 - SIDES.index(side)]


def taken(document: Mapping[str, Any]) -> tuple[dict[str, Any], str | None]:
    """Return a document without the side, as the core reads it, and the side."""
    subject = document.get("subject")
    if not isinstance(subject, Mapping) or "side" not in subject:
        return dict(document), None
    side = side_of(f"{_TABLE}, side", subject["side"])
    return {**document, "subject": {key: value for key, value in subject.items() if key != "side"}}, side


def read(path: Path) -> tuple[Description, str | None]:
    """Return a `dataset.toml` and the side that it states.

    Raises
    ------
    BadInput
        Names the file, the place, the value found and the value allowed.
    """
    if "side" not in tomlfile.read_text(path, "a TOML file"):
        return Description.load(path), None
    try:
        document, side = taken(tomlfile.read(path))
        return Description.from_dict(document), side
    except BadInput as error:
        raise error.within(file=path) from None


def to_toml(description: Description, side: str | None) -> str:
    """Return the text of a `dataset.toml` with a side."""
    content = description.to_toml()
    if side is None:
        return content
    line = "\n".join(tomlfile.lines({"side": side}))
    head = f"{_TABLE}\n"
    if content.startswith(head) or f"\n{head}" in content:
        before, _, after = content.partition(head)
        return f"{before}{head}{line}\n{after}"
    before, bracket, after = content.partition("\n[")
    if not bracket:
        raise BadInput(_TABLE, Text("a data set without trials"), "one with trials")
    return f"{before}\n{head}{line}\n\n{bracket[1:]}{after}"
