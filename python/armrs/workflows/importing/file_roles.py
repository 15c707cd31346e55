"""Which raw file is which trial: configuration, repeat and role from file names, and pairs of angle and force files."""

from __future__ import annotations

import re
from collections.abc import Sequence, Set
from dataclasses import dataclass

from ...io.raw import RawTable
from .column_guess import symbol_of, words

_REPEAT = re.compile(
    r"^(?P<name>.*?)[\s_\-.]*(?:(?<![^\W\d_])(?:trial|rep|repeat|run|take|wdh|nr|no|t|r))?[\s_\-.#]*(?P<number>\d+)$", flags=re.IGNORECASE
)
"""A name and the number of a repeat; a word for the number is a word of its own: `shoulder 1` is no `shoulde`."""
_TEST = {"test", "holdout", "validation", "probe", "prüfung", "prufung", "pruefung"}
_FORCE_WORDS = {"force", "forces", "kraft", "kraefte", "krafte", "kräfte", "ft", "loadcell", "sensor"}
_ANGLE_WORDS = {"angles", "angle", "winkel", "kinematics", "kinematik", "motion", "markers", "joints"}
_OTHER_WORDS = 1
"""Words that the names of a file of angles and its file of forces may each have for themselves, such as those of the devices."""
_SEPARATORS = re.compile(r"[\s_\-.]+")
_FEWEST = 3
"""Repeats from which on the last one becomes the test trial: two are left to read the noise off."""


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
    split = [_split(title) for title in _names(_titles(with_angles))]
    all_tests = all(_TEST & set(words(table.title)) for table in with_angles)
    from_zero = {name for name, number in split if number == 0}
    for table, (name, number) in zip(with_angles, split, strict=True):
        if number is not None and name in from_zero:
            number += 1
        is_test = bool(_TEST & set(words(table.title))) and not all_tests
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
    """Return the titles, those of the sheets of a workbook without its name where they are unique without it."""
    files = [t.path for t in tables]
    bare = [t.title.removeprefix(t.path.stem).strip() or t.title if files.count(t.path) > 1 else t.title for t in tables]
    return bare if len(set(bare)) == len(bare) else [t.title for t in tables]


def _names(titles: Sequence[str]) -> list[str]:
    """Return the names of movements: titles without words of role, of what was measured, and without the word that all end with."""
    parts = [[part for part in _SEPARATORS.split(title.strip()) if part] for title in titles]
    last = {part[-1].lower() for part in parts if part}
    if len(titles) > 1 and len(last) == 1 and all(_lettered(part[:-1]) for part in parts) and _lettered(list(last)):
        parts = [part[:-1] for part in parts]
    bare = [[word for word in part if word.lower() not in _TEST | _FORCE_WORDS | _ANGLE_WORDS] for part in parts]
    return ["_".join(word) if _lettered(word) else title for word, title in zip(bare, titles, strict=True)]


def _lettered(parts: Sequence[str]) -> bool:
    """Whether words are more than a number."""
    return any(character.isalpha() for part in parts for character in part)


def _split(title: str) -> tuple[str, int | None]:
    match = _REPEAT.match(title.strip())
    name = match["name"] if match and match["name"] else (title if match is None else "movement")
    cleaned = re.sub(r"[\s_]+", "-", name.strip(" _-.").lower()) or "movement"
    return cleaned, int(match["number"]) if match else None


def _key(table: RawTable, besides: Set[str] = frozenset()) -> tuple[str, ...]:
    return tuple(w for w in words(table.title) if w not in _FORCE_WORDS | _ANGLE_WORDS | besides)


def _pairs(angles: Sequence[RawTable], forces: Sequence[RawTable]) -> dict[int, RawTable]:
    """Return the table of forces of each table of angles, by their names.

    That of the same name without the words for force, angle and role, or the only one that differs by the word for a device.
    """
    found: dict[int, RawTable] = {}
    for besides in (frozenset[str](), frozenset(_TEST)):
        by_key = {_key(table, besides): table for table in forces}
        found = {id(table): by_key[_key(table, besides)] for table in angles if _key(table, besides) in by_key} | found
    for table in angles:
        near = [f for f in forces if _differ_by_device(table, f)]
        if id(table) not in found and len(near) == 1:
            found[id(table)] = near[0]
    if not found and len(angles) == len(forces) == 1:
        return {id(angles[0]): forces[0]}
    return found


def _differ_by_device(table: RawTable, other: RawTable) -> bool:
    """Whether two names differ by a word for a device each at most, such as `mocap` and `mini40`; `slow1` and `slow2` differ otherwise."""
    mine, others = ({w for w in _SEPARATORS.split(t.title.lower()) if w not in _FORCE_WORDS | _ANGLE_WORDS} for t in (table, other))
    letters = [{"".join(c for c in word if c.isalpha()) for word in own} for own in (mine - others, others - mine)]
    return all(len(own) <= _OTHER_WORDS and "" not in own for own in letters) and not letters[0] & letters[1]
