"""Questions about the columns of a recording, each with a guess and the reason for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import BadInput
from ...io.raw import RawTable
from . import raw_tables
from .column_guess import symbol_of


@dataclass(frozen=True)
class Question:
    """One quantity that an import needs.

    Attributes
    ----------
    symbol : str
        As `--map` has it.
    meaning : str
        In words.
    guess : str or None
        The column that probably holds it.
    why : str
        The reason for the guess.
    """

    symbol: str
    meaning: str
    guess: str | None
    why: str


def questions(paths: Sequence[Path], points: tuple[str, ...], joints: Sequence[str]) -> tuple[RawTable, list[Question]]:
    """Return the first recording that has columns, and the questions about them.

    Raises
    ------
    BadInput
        When no file has columns.
    """
    problems: list[BadInput] = []
    tables = [table for table in raw_tables.read_all(paths, points, len(joints), problems).tables if table.columns]
    if not tables:
        raise problems[0] if problems else BadInput("file", "nothing", "a recording with columns", file=paths[0])
    table = next((t for t in tables if any((symbol_of(c) or "").startswith("q") for c in t.columns)), tables[0])
    return table, _about(table, joints)


def _about(table: RawTable, joints: Sequence[str]) -> list[Question]:
    named = {symbol: c.name for c in reversed(table.columns) if (symbol := symbol_of(c)) is not None}
    free = [c for c in table.columns if symbol_of(c) is None]
    meanings = {"t": "time"} | {f"q{j}": f"angle of joint {j}, {name}" for j, name in enumerate(joints, start=1)}
    meanings |= {"Fy": "force forward", "Fz": "force upward"}
    asked = []
    for symbol, meaning in meanings.items():
        if symbol in named:
            asked.append(Question(symbol, meaning, named[symbol], "by its name"))
            continue
        clocks = [c for c in free if bool((np.diff(c.values[np.isfinite(c.values)]) > 0.0).all())]
        chosen = next(iter(clocks if symbol == "t" else [c for c in free if c not in clocks]), None)
        if chosen is not None:
            free.remove(chosen)
        why = "" if chosen is None else "it increases in every sample" if symbol == "t" else "the next column whose name says nothing"
        asked.append(Question(symbol, meaning, None if chosen is None else chosen.name, why))
    return asked
