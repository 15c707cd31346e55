"""Words for the side of an arm, which `Subject.side` holds."""

from __future__ import annotations

from .. import checks

SIDES = ("left", "right")
WORDS = {"left": ("left", "l", "links", "li"), "right": ("right", "r", "rechts", "re")}
"""How tables write a side, in any case."""


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
