"""Many subjects: mean, scatter between and within subjects, groups and sides compared, norm bands with their uncertainty."""

from __future__ import annotations

import csv
import io
import json
import os
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import NormalDist
from typing import Any

import numpy as np

from .. import checks
from ..analysis import mixed_model, students_t
from ..analysis.mixed_model import MixedModel
from ..analysis.significance import holm
from ..errors import ArmrsError, BadInput, Text, show, unreadable
from ..io import arm_side, files, jsonfile
from ..io.raw import text_table
from ..result_warnings import with_warnings
from ..tabular import Tabular, Tidy
from .history import session_date, without_date
from .passive import passive_moments
from .result_data import passive_data

LEVEL = 0.95
"""Share of sessions that a norm band holds, and probability of the intervals."""
FEWEST = 3
"""Fewest subjects of a group that is summarised."""
NEEDED = ("subject", "quantity", "value")
MAY = ("unit", "std", "group", "side", "date")
COLUMNS = (*NEEDED, *MAY)


@dataclass(frozen=True)
class Value:
    """One value of one session.

    Attributes
    ----------
    subject, quantity, unit, group, side, date : str
        Empty where nothing is known.
    value : float
    std : float or None
        Standard deviation of the value by its measurement.
    """

    subject: str
    quantity: str
    value: float
    unit: str = ""
    std: float | None = None
    group: str = ""
    side: str = ""
    date: str = ""


@dataclass(frozen=True)
class Quantity:
    """A quantity of one group, where both sides were measured of one side.

    Attributes
    ----------
    name, group, side, unit : str
        No side where only one was measured, or not all values have one.
    subjects, sessions : int
    mean, mean_std : float
    between_std, within_std : float, float or None
        Between subjects, and between sessions of one, of all groups together; a difference of sides differs between subjects as
        sessions do. None where each subject has one session: the first then contains the second.
    norm : (float, float)
        Holds 95 of 100 sessions of other subjects of the group, on that side.
    norm_low_interval, norm_high_interval : (float, float)
        95 % intervals of the ends of the band that holds the middle 95 % of the group.
    """

    name: str
    group: str
    side: str
    unit: str
    subjects: int
    sessions: int
    mean: float
    mean_std: float
    between_std: float
    within_std: float | None
    norm: tuple[float, float]
    norm_low_interval: tuple[float, float]
    norm_high_interval: tuple[float, float]


@dataclass(frozen=True)
class Contrast:
    """What differs between two groups, or two sides: the second less the first.

    Attributes
    ----------
    name, unit : str
    between : (str, str)
    within : str
        The group in which two sides are compared; empty without groups, and for groups, which are compared over their sides.
    difference, std : float
    interval : (float, float)
    p_value : float
        Over all contrasts together (Holm 1979).
    """

    name: str
    unit: str
    between: tuple[str, str]
    within: str
    difference: float
    std: float
    interval: tuple[float, float]
    p_value: float


@dataclass(frozen=True, eq=False)
class Cohort(Tabular):
    """A summary of many subjects.

    Attributes
    ----------
    name : str
    values : tuple of Value
    quantities : tuple of Quantity
    contrasts : tuple of Contrast
    warnings : tuple of str
    """

    name: str
    values: tuple[Value, ...]
    quantities: tuple[Quantity, ...]
    contrasts: tuple[Contrast, ...]
    warnings: tuple[str, ...]

    def __repr__(self) -> str:
        count = len({q.name for q in self.quantities})
        return (
            f"Cohort({self.name!r}: {len({v.subject for v in self.values})} subjects, {count} {'quantity' if count == 1 else 'quantities'})"
        )

    def values_of(self, quantity: Quantity) -> list[float]:
        """Return the values behind a quantity of one group."""
        own = (v for v in self.values if (v.quantity, v.group or ALL) == (quantity.name, quantity.group))
        return [v.value for v in own if quantity.side in ("", v.side)]

    def tidy(self) -> Tidy:
        """Return the values, one a row."""
        return Tidy({name: [getattr(v, name) for v in self.values] for name in COLUMNS}, {})

    def write_table(self, path: Path) -> None:
        """Write the values as a tidy table, which `cohort` reads."""
        text = io.StringIO()
        table = csv.writer(text, lineterminator="\n")
        table.writerow(COLUMNS)
        table.writerows([getattr(v, name) for name in COLUMNS] for v in self.values)
        files.write_text(path, text.getvalue(), kind=".csv")

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        # Without dates, the values of one quantity show how many sessions there were.
        counts = Counter((v.quantity, v.subject, v.date, v.side) for v in self.values)
        sessions: Counter[tuple[str, ...]] = Counter()
        for (_, *session), count in counts.items():
            sessions[tuple(session)] = max(sessions[tuple(session)], count)
        return {
            "subjects": len({v.subject for v in self.values}),
            "sessions": sessions.total(),
            "quantities": [asdict(q) for q in self.quantities],
            "contrasts": [asdict(c) for c in self.contrasts],
            "level": LEVEL,
            "warnings": list(self.warnings),
        }


_COMPUTED = 0.8
"""Share of the work after which the passive moments of data sets are known."""
_MOST = 1e100
"""Values of a table are below it, of any quantity in any unit: squares of larger ones overflow."""
ALL = "all"
"""The group of those of whom none is stated."""


@with_warnings
def cohort(
    source: str | os.PathLike[str],
    *,
    groups: str | os.PathLike[str] | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> Cohort:
    """Summarise a table of values, or a folder of results or data sets.

    Parameters
    ----------
    source : path
        A CSV with a value a row: subject, quantity, value, and optionally unit, std, group, side (left or right), date; with commas,
        semicolons, tabs or bars between cells, decimal points or commas. Or a folder, searched at all
        depths: JSON results of `identify`, `passive`, `gap` and `spasticity`; where there are none, data sets, whose passive moments
        are computed.
    groups : path, optional
        For a folder: a CSV with columns subject, group and side; subject is the subject's or the data set's name.
    progress : callable, optional
        Called with the name of the stage and the share that is done, 0 to 1.

    Returns
    -------
    Cohort

    Raises
    ------
    BadInput
        For a table without these columns or with a value that is none, and a folder in which there is nothing.

    Examples
    --------
    >>> armrs.cohort("values.csv").quantities[0].norm  # doctest: +SKIP
    (0.31, 0.74)
    """
    path, tell = checks.path("source", source), checks.progress(progress)
    if path.is_dir():
        values, warnings = _of_folder(path, _groups(groups), tell)
    elif groups is not None:
        raise BadInput("groups", Text("a table beside a table"), "a folder: a table has its own columns group and side")
    else:
        values, warnings = _of_table(path)
    quantities, contrasts = [], []
    names = list(dict.fromkeys(v.quantity for v in values))
    for k, name in enumerate(names):
        tell(name, _COMPUTED + (1.0 - _COMPUTED) * k / len(names))
        own = [v for v in values if v.quantity == name]
        units = {v.unit for v in own}
        if len(units) > 1:
            raise BadInput(f"unit of {name}", Text(" and ".join(sorted(map(repr, units)))), "one unit a quantity", file=path)
        found, differ, doubts = _summary(own)
        quantities += found
        contrasts += differ
        warnings += doubts
    adjusted = holm([c.p_value for c in contrasts])
    compared = tuple(Contrast(**{**asdict(c), "p_value": p}) for c, p in zip(contrasts, adjusted, strict=True))
    return Cohort(path.stem, tuple(values), tuple(quantities), compared, tuple(warnings))


def _summary(values: Sequence[Value]) -> tuple[list[Quantity], list[Contrast], list[str]]:
    """Return what one quantity is in each group, and what differs."""
    name, unit = values[0].quantity, values[0].unit
    counts = {g: len({v.subject for v in values if (v.group or ALL) == g}) for g in dict.fromkeys(v.group or ALL for v in values)}
    few = [g for g, count in counts.items() if count < FEWEST]
    warnings = [f"{name}: {counts[g]} subject{'s' * (counts[g] > 1)} in group {g!r}, needed are {FEWEST}: left out" for g in few]
    kept = [v for v in values if (v.group or ALL) not in few]
    groups = [g for g in counts if g not in few]
    if not groups:
        return [], [], warnings
    if len({v.side for v in kept if v.side}) > 1 and (without := sum(not v.side for v in kept)):
        warnings.append(f"{name}: {without} of {len(kept)} values state no side: sides are not compared")
    cells = _cells(kept, groups)
    kept = [v for own in cells.values() for v in own]
    design = np.repeat(np.eye(len(cells)), [len(own) for own in cells.values()], axis=0)
    fitted = mixed_model.fit(np.array([v.value for v in kept]), design, [v.subject for v in kept])
    quantities = [_quantity(fitted, k, (name, *cell, unit), own) for k, (cell, own) in enumerate(cells.items())]
    contrasts = []
    for group in groups[1:]:
        common = {side for g, side in cells if g == groups[0]} & {side for g, side in cells if g == group}
        if not common:
            warnings.append(f"{name}: {groups[0]} and {group} were measured on different sides: their difference may be one of sides")
        means = [_mean_of(cells, g, common) for g in (groups[0], group)]
        contrasts.append(_contrast(fitted, means[1] - means[0], (name, unit), ((groups[0], group), ""), fitted.between_freedom))
    for group in groups:
        sides = [side for g, side in cells if g == group]
        if len(sides) == 2:
            vector = _mean_of(cells, group, {sides[1]}) - _mean_of(cells, group, {sides[0]})
            subjects = [{v.subject for v in cells[group, side]} for side in sides]
            freedom = fitted.within_freedom if subjects[0] & subjects[1] else fitted.between_freedom
            contrasts.append(
                _contrast(fitted, vector, (name, unit), ((sides[0], sides[1]), "" if group == ALL else group), max(freedom, 1.0))
            )
    return quantities, contrasts, warnings


def _cells(values: Sequence[Value], groups: Sequence[str]) -> dict[tuple[str, str], list[Value]]:
    """Return the values by group and side; without side where not two of them are known of all values."""
    sides = sorted({v.side for v in values})
    if len(sides) != 2 or "" in sides:
        return {(g, ""): [v for v in values if (v.group or ALL) == g] for g in groups}
    cells = {(g, side): [v for v in values if (v.group or ALL, v.side) == (g, side)] for g in groups for side in sides}
    return {cell: own for cell, own in cells.items() if own}


def _mean_of(cells: Iterable[tuple[str, str]], group: str, sides: Set[str]) -> np.ndarray:
    """Return the shares of the cells in the mean of a group over some sides, or over all that it has if none is given, shape (n_cells,)."""
    chosen = np.array([float(g == group and (not sides or side in sides)) for g, side in cells])
    return chosen / chosen.sum()


def _quantity(fitted: MixedModel, place: int, named: tuple[str, str, str, str], own: Sequence[Value]) -> Quantity:
    mean, variance = float(fitted.coefficients[place]), float(fitted.covariance[place, place])
    freedom, z = fitted.total_freedom, NormalDist().inv_cdf(0.5 + 0.5 * LEVEL)
    half = float(students_t.quantile(LEVEL, freedom) * np.hypot(fitted.total, np.sqrt(variance)))
    end_std = float(np.sqrt(variance + z**2 * fitted.total**2 / (2.0 * freedom)))
    ends = [mean - z * fitted.total, mean + z * fitted.total]
    return Quantity(
        *named,
        subjects=len({v.subject for v in own}),
        sessions=len(own),
        mean=mean,
        mean_std=float(np.sqrt(variance)),
        between_std=fitted.between,
        within_std=fitted.within if fitted.within_freedom >= 1.0 else None,
        norm=(mean - half, mean + half),
        norm_low_interval=(ends[0] - z * end_std, ends[0] + z * end_std),
        norm_high_interval=(ends[1] - z * end_std, ends[1] + z * end_std),
    )


def _contrast(
    fitted: MixedModel, vector: np.ndarray, named: tuple[str, str], compared: tuple[tuple[str, str], str], freedom: float
) -> Contrast:
    difference = float(vector @ fitted.coefficients)
    std = max(float(np.sqrt(vector @ fitted.covariance @ vector)), 1e-300)
    half = students_t.quantile(LEVEL, freedom) * std
    p_value = students_t.chance(difference, std, freedom)
    return Contrast(*named, *compared, difference, std, (difference - half, difference + half), p_value)


def _rows(path: Path, needed: Sequence[str], may: Sequence[str]) -> list[tuple[int, Mapping[str, str]]]:
    """Return the rows of a text table with their numbers in the file, blank ones not counted."""
    try:
        lines, _ = text_table.decoded_lines(path)
    except OSError as error:
        raise unreadable(error, "a table in CSV", file=path) from None
    except BadInput as error:
        raise error.within(file=path) from None
    head, *body = text_table.rows_of(lines) if lines else [[]]
    head = [name.lower() for name in head]
    while head and not head[-1]:  # a spreadsheet writes empty columns
        head.pop()
    missing = [name for name in needed if name not in head]
    unknown = [name for name in head if name not in (*needed, *may)]
    if missing or unknown:
        raise BadInput(
            "columns", Text(", ".join(head) or "none"), f"{', '.join(needed)}, and may be {', '.join(may) or 'no more'}", file=path
        )
    rows: list[tuple[int, Mapping[str, str]]] = []
    for number, cells in enumerate(body, start=2):
        if any(cells[len(head) :]):
            hint = "a decimal comma? Put semicolons between the cells"
            raise BadInput(f"row {number}", Text(f"{len(cells)} cells"), f"{len(head)}, as the first row", file=path, hint=hint)
        if any(cells):
            rows.append((number, dict.fromkeys(head, "") | dict(zip(head, cells, strict=False))))
    if not rows:
        raise BadInput("rows", Text("none"), "a value a row", file=path)
    return rows


def _of_table(path: Path) -> tuple[list[Value], list[str]]:
    """Return the values of a table, and which rows have none."""
    rows, values = _rows(path, NEEDED, MAY), []
    empty = [number for number, row in rows if row["value"] in text_table.MISSING]
    rows = [(number, row) for number, row in rows if number not in empty]
    if not rows:
        raise BadInput("value", Text("none"), "a value a row", file=path)
    decimal = text_table.decimal_of([row.get(name, "") for _, row in rows for name in ("value", "std")])
    for number, row in rows:
        value = _number(row, "value", (number, path, decimal))
        std = _number(row, "std", (number, path, decimal)) if row.get("std") else None
        for name in ("subject", "quantity"):
            if not row[name]:
                raise BadInput(f"row {number}, {name}", Text("nothing"), "a name", file=path)
        words = {name: row.get(name, "") for name in COLUMNS if name not in ("value", "std")}
        values.append(Value(value=value, std=std, **words | {"side": _side(row, number, path)}))
    more = f" and {len(empty) - 1} more" if len(empty) > 1 else ""
    return values, [f"{path}: row {empty[0]}{more}: no value: left out"] if empty else []


def _number(row: Mapping[str, str], name: str, where: tuple[int, Path, str]) -> float:
    number, path, decimal = where
    found = text_table.number_in(row[name], decimal)
    if found is None or not abs(found) < _MOST:
        marked = " with a decimal comma, as other rows have" if decimal == "," else ""
        raise BadInput(f"row {number}, {name}", row[name], f"a number below {_MOST:g}{marked}", file=path)
    return found


def _side(row: Mapping[str, str], number: int, path: Path) -> str:
    """Return the side of a row, `left` or `right`; empty where it states none."""
    word = row.get("side", "")
    side = arm_side.written_side(word)
    if word and side is None:
        allowed = f"{' or '.join(' '.join(words) for words in arm_side.WORDS.values())} in any case, or nothing"
        raise BadInput(f"row {number}, side", word, allowed, file=path, hint="affected or not belongs into the column group")
    return side or ""


@dataclass(frozen=True)
class _Groups:
    """Group and side by the name of a subject or of a data set, and where they are stated."""

    path: Path | None = None
    rows: Mapping[str, tuple[int, str, str]] = field(default_factory=dict)

    def of(self, name: str, subject: str) -> tuple[str, str]:
        """Return group and side of a data set."""
        _, group, side = self.rows.get(name, self.rows.get(subject, (0, "", "")))
        return group, side

    def unused(self, names: Set[str]) -> list[str]:
        """Return which rows are of nobody."""
        shown = ", ".join(sorted(names))
        return [
            f"{self.path}: row {number}, subject: found {show(name)}, allowed {shown}: it is in no result"
            for name, (number, *_) in self.rows.items()
            if name not in names
        ]


def _groups(path: str | os.PathLike[str] | None) -> _Groups:
    """Read group and side by the name of a subject or of a data set."""
    if path is None:
        return _Groups()
    file = checks.path("groups", path)
    rows = _rows(file, ["subject"], ["group", "side"])
    return _Groups(file, {row["subject"]: (number, row.get("group", ""), _side(row, number, file)) for number, row in rows})


def _of_folder(folder: Path, groups: _Groups, tell: Callable[[str, float], None]) -> tuple[list[Value], list[str]]:
    """Return the values of all results in a folder, or of its data sets where there are none."""
    results: list[dict[str, Any]] = []
    warnings: list[str] = []
    for file in sorted(folder.rglob("*.json")):
        try:
            data = jsonfile.read(file)
        except BadInput:
            continue
        if isinstance(data, dict) and data.get("verb") in ("identify", "passive", "gap", "spasticity"):
            results.append(data)
    if not results:
        results, warnings = _computed(folder, tell)
    if not results:
        raise BadInput(
            "source", Text("a folder without results and data sets"), "JSON of armrs identify, passive, gap or spasticity", file=folder
        )
    try:
        stated = [(data["verb"], v) for data in results for v in _of_result(data, groups)]
    except (KeyError, TypeError, AttributeError, ValueError) as error:
        raise BadInput("content", Text(f"not what a result holds ({error})"), "whole results", file=folder) from None
    # `gap` estimates some quantities of `identify` from the same recordings, and a file may be a copy: neither is another session.
    fitted = {(v.subject, v.side, v.date, v.quantity) for verb, v in stated if verb != "gap"}
    values = list(dict.fromkeys(v for verb, v in stated if verb != "gap" or (v.subject, v.side, v.date, v.quantity) not in fitted))
    if len(values) < len(stated):
        warnings.append(f"{folder}: {len(stated) - len(values)} values that another result of the same session states: left out")
    named = {name for data in results for name in _names(data)}
    return values, [*warnings, *groups.unused(named)]


def _computed(folder: Path, tell: Callable[[str, float], None]) -> tuple[list[dict[str, Any]], list[str]]:
    """Return the passive moments of every data set in a folder, and which could not be had."""
    found = []
    listed = sorted(folder.rglob("dataset.toml"))
    for k, file in enumerate(listed):
        tell(f"passive moments of {file.parent.name}", _COMPUTED * k / len(listed))
        found.append(_passive(file.parent))
    return [f for f in found if isinstance(f, dict)], [f for f in found if isinstance(f, str)]


def _passive(dataset: Path) -> dict[str, Any] | str:
    """Return the passive moments of a data set as in their file, or why there are none."""
    try:
        plain: dict[str, Any] = json.loads(files.json_text(passive_data(passive_moments(dataset))))
    except ArmrsError as error:
        return f"{dataset}: left out: {error}"
    return plain


def _names(data: Mapping[str, Any]) -> tuple[str, str]:
    """Return the names of the data set and of the subject of a result."""
    name = str(data["data"]["name"])
    return name, str(data["data"].get("subject") or without_date(name) or name)


def _of_result(data: Mapping[str, Any], groups: _Groups) -> list[Value]:
    """Return the values of the subject in one result."""
    name, subject = _names(data)
    group, side = groups.of(name, subject)
    side = side or data["data"].get("side") or ""
    date = data.get("session", {}).get("date") or session_date(name)
    if data["verb"] == "identify":
        found = [(e["kind"], e["name"], e["joint"], e) for e in data["parameters"] if e["decided_by"] == "data"]
    elif data["verb"] == "passive":
        found = [(e["kind"], e["name"], e["joint"], e) for e in data["repeated"]]
    else:
        found = [
            (e["kind"], n, e["joint"], p) for e in data["effects"] if e.get("decided") for n, p in e["parameters"].items() if p.get("std")
        ]
    values = []
    for kind, what, joint, entry in found:
        if entry["value"] is not None and np.isfinite(entry["value"]):
            label = f"{kind} {what}" + ("" if joint is None else f" of joint {joint}")
            values.append(Value(subject, label, float(entry["value"]), entry["unit"], entry.get("std"), group, side, date))
    return values
