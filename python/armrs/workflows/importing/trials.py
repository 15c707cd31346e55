"""Which raw file is which trial: configuration, repeat and role from names, and the file of forces that belongs to a file of angles."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from ...io.raw import RawTable
from .columns import symbol_of, words

_REPEAT = re.compile(
    r"^(?P<name>.*?)[\s_\-.]*(?:(?<![^\W\d_])(?:trial|rep|repeat|run|take|wdh|nr|no|t|r))?[\s_\-.#]*(?P<number>\d+)$", flags=re.IGNORECASE
)
"""A name and the number of a repeat; a word for the number is a word of its own: `shoulder 1` is no `shoulde`."""
_TEST = {"test", "holdout", "validation"}
_FORCE_WORDS = {"force", "forces", "kraft", "kraefte", "krafte", "ft", "loadcell", "sensor"}
_FEWEST = 3
"""Repeats from which on the last one is kept apart: two are left to read the noise off."""


@dataclass(frozen=True)
class Named:
    """A table of angles with its table of forces, where that is another, and its place in the data set."""

    table: RawTable
    forces: RawTable | None
    configuration: str
    repeat: int
    role: str


def arrange(tables: Sequence[RawTable]) -> tuple[list[Named], list[RawTable], str]:
    """Return the trials, the tables that belong to none, and how roles were given."""
    with_angles = [t for t in tables if _has(t, "q")]
    others = [t for t in tables if not _has(t, "q")]
    forces = [t for t in others if _has(t, "F")]
    pairs = _pairs([t for t in with_angles if not _has(t, "F")], forces)
    placed: list[tuple[RawTable, str, int, bool]] = []
    counts: dict[str, int] = {}
    used: set[tuple[str, int]] = set()
    split = [_split(title) for title in _titles(with_angles)]
    from_zero = {name for name, number in split if number == 0}
    for table, (name, number) in zip(with_angles, split, strict=True):
        if number is not None and name in from_zero:
            number += 1
        is_test = bool(_TEST & set(words(table.title)))
        repeat = number if number is not None and (name, number) not in used else counts.get(name, 0) + 1
        while (name, repeat) in used:
            repeat += 1
        counts[name] = max(counts.get(name, 0), repeat)
        used.add((name, repeat))
        placed.append((table, name, repeat, is_test))
    stated = any(is_test for *_, is_test in placed)
    last = {name: max(r for _, n, r, _ in placed if n == name) for name in counts}
    many = {name for name in counts if sum(n == name for _, n, _, _ in placed) >= _FEWEST}
    trials = [
        Named(
            table, pairs.get(id(table)), name, repeat, "test" if (is_test if stated else name in many and repeat == last[name]) else "fit"
        )
        for table, name, repeat, is_test in placed
    ]
    matched = {id(f) for f in pairs.values()}
    why = "from the names of the files" if stated else f"the last repeat of each movement with {_FEWEST} repeats or more is kept as test"
    if not any(t.role == "test" for t in trials):
        why = f"no test trial: no movement has {_FEWEST} repeats"
    return trials, [t for t in others if id(t) not in matched], why


def _has(table: RawTable, start: str) -> bool:
    symbols = (symbol_of(c) for c in table.columns)
    return any(s is not None and s.startswith(start) and not s.startswith("qr") for s in symbols)


def _titles(tables: Sequence[RawTable]) -> list[str]:
    """Return the titles, those of one workbook's sheets without the name of the workbook."""
    if len({t.path for t in tables}) == 1 and len(tables) > 1:
        return [t.title.removeprefix(t.path.stem).strip() or t.title for t in tables]
    return [t.title for t in tables]


def _split(title: str) -> tuple[str, int | None]:
    match = _REPEAT.match(title.strip())
    name = match["name"] if match and match["name"] else (title if match is None else "movement")
    cleaned = re.sub(r"[\s_]+", "-", name.strip(" _-.").lower()) or "movement"
    return cleaned, int(match["number"]) if match else None


def _key(table: RawTable) -> str:
    return " ".join(
        w for w in words(table.title) if w not in _FORCE_WORDS | {"angles", "angle", "winkel", "kinematics", "motion", "markers"}
    )


def _pairs(angles: Sequence[RawTable], forces: Sequence[RawTable]) -> dict[int, RawTable]:
    """Return the table of forces of each table of angles: that of the same name without the words for force and angle."""
    by_key = {_key(table): table for table in forces}
    found = {id(table): by_key[_key(table)] for table in angles if _key(table) in by_key}
    if not found and len(angles) == len(forces) == 1:
        return {id(angles[0]): forces[0]}
    return found
