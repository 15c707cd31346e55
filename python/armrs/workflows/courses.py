"""Parameters of one arm over its sessions: each session compared with those before it, and with the other arm."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..analysis.significance import CHANGE_LEVEL, holm
from ..errors import show
from ..formatting import parameter_label
from ..io import arm_side
from ..tabular import Tabular, Tidy

if TYPE_CHECKING:
    import sqlite3

_TOGETHER = ("joint", "cascade")
"""Methods that estimate all parameters of a joint together."""
CHOSEN = ("range in ", "speed in ")
"""What is kept of a slow movement and was chosen: it is shown, and not tested for a change."""
SAME_SPEED, LEAST_SPEED = 0.1, 0.02
"""Share by which the speed of a movement may differ between sessions that compare, and what it may differ by in any case [rad/s]."""
_ROWS = (
    "SELECT e.name, e.kind, e.joint, e.unit, s.date, e.value, e.std, s.id, coalesce(a.side, '') FROM estimate e "
    "JOIN session s ON s.id = e.session LEFT JOIN arm a ON a.session = s.id "
    "WHERE s.method = ? AND e.decided_by = 'data' ORDER BY s.date, s.id, e.rowid"
)
_Point = tuple[str, float, float, int]
"""Date, value, standard deviation, session."""
_Key = tuple[str, str, int, str]
"""Name, kind, joint (0 for none) and unit of a parameter."""
_Row = tuple[str, str, int, str, str, float, float, int, str]
"""Key, date, value, standard deviation, session and side."""
_Decided = Mapping[tuple[int, int], set[tuple[str, str]]]
"""Names and kinds of what the data decided, by session and joint."""
_NO_TEST = (np.nan, np.nan, np.nan)


@dataclass(frozen=True)
class Difference:
    """The value of a session less another one.

    Attributes
    ----------
    date : str or None
        Of the session that it is compared with; None without one.
    value, std : float
        NaN without one.
    p_value : float
        Of so large a difference by chance, over all parameters followed (Holm 1979).
    """

    date: str | None
    value: float
    std: float
    p_value: float

    @property
    def clear(self) -> bool:
        """Whether the sessions differ."""
        return self.p_value < CHANGE_LEVEL

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {**vars(self), "clear": self.clear}


@dataclass(frozen=True, eq=False)
class Course:
    """One parameter of one arm over the sessions that measured it, up to the one that is looked at: the last of `dates`.

    Attributes
    ----------
    name, kind : str
    joint : int or None
        From 1; None where it belongs to no single joint.
    unit : str
    dates : tuple of str
        ISO dates, in order.
    values, stds : ndarray, shape (n_sessions,)
        A deviation is the wider half of the interval, in normal quantiles: few trials, whose scatter is uncertain, count as few.
    change, change_std : float
        The last value less the mean of those before, weighted by certainty; NaN where there is none to compare with. Sessions compare
        when the data decided the same parameters of that joint: where another one sat at a bound, a deviation means less.
    p_value : float
        Of so large a change by chance, over all parameters followed (Holm 1979); NaN for a single session.
    before, first : Difference
        The last value less that of the session before it, and less that of the first one.
    other_arm : Difference
        The last value less that of the other arm, of its last session that is not later.
    """

    name: str
    kind: str
    joint: int | None
    unit: str
    dates: tuple[str, ...]
    values: np.ndarray
    stds: np.ndarray
    change: float
    change_std: float
    p_value: float
    before: Difference
    first: Difference
    other_arm: Difference

    @property
    def changed(self) -> bool:
        """Whether the last session differs from those before."""
        return self.p_value < CHANGE_LEVEL

    @property
    def label(self) -> str:
        """Name for people."""
        return parameter_label({"name": self.name, "kind": self.kind, "joint": self.joint})

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {
            "name": self.name,
            "kind": self.kind,
            "joint": self.joint,
            "unit": self.unit,
            "dates": list(self.dates),
            "values": self.values,
            "stds": self.stds,
            "change": self.change,
            "change_std": self.change_std,
            "p_value": self.p_value,
            "changed": self.changed,
            "before": self.before.to_dict(),
            "first": self.first.to_dict(),
            "other_arm": self.other_arm.to_dict(),
        }


@dataclass(frozen=True, eq=False)
class History(Tabular):
    """What is known of one arm of a subject up to one session: the last, or the one just added.

    Attributes
    ----------
    subject : str or None
    courses : tuple of Course
        One for every parameter that the data decided in that session.
    warnings : tuple of str
        What the file holds that cannot be compared.
    date : str or None
        Of that session; None in an empty history.
    side : str or None
        The arm that was measured then; None where it is not stated.
    later : tuple of str
        Dates of later sessions of this arm, which are not compared.
    """

    subject: str | None
    courses: tuple[Course, ...]
    warnings: tuple[str, ...] = ()
    date: str | None = None
    side: str | None = None
    later: tuple[str, ...] = ()

    def __repr__(self) -> str:
        changed = [c.label for c in self.courses if c.changed]
        dates = len({date for c in self.courses for date in c.dates})
        said = f"changed in the last session: {', '.join(changed)}" if changed else "nothing changed in the last session"
        return f"History({self.subject!r}: {len(self.courses)} parameters on {dates} dates; {said})"

    def tidy(self) -> Tidy:
        """Return the values, one parameter and session a row."""
        rows = [(c, k) for c in self.courses for k in range(len(c.dates))]
        columns: dict[str, list[Any]] = {name: [getattr(c, name) for c, _ in rows] for name in ("name", "kind", "joint", "unit")}
        columns |= {"date": [c.dates[k] for c, k in rows]}
        return Tidy(columns | {name: [float(getattr(c, f"{name}s")[k]) for c, k in rows] for name in ("value", "std")}, {})

    def session(self) -> dict[str, Any]:
        """Return whose session the courses end with, as plain data."""
        return {"subject": self.subject, "side": self.side, "date": self.date, "later": list(self.later)}

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"subject": self.subject, "courses": [course.to_dict() for course in self.courses]}


def history_of(connection: sqlite3.Connection, method: str, subject: str | None, session: int | None = None) -> History:
    """Return the courses of the arm of one session up to it, the last one by default.

    Parameters
    ----------
    connection : sqlite3.Connection
        A history with all its tables.
    method : str
        Sessions compare with those of the same method.
    subject : str or None
    session : int, optional
        Its number in the file.
    """
    rows: list[_Row] = connection.execute(_ROWS, (method,)).fetchall()
    if session is None:
        session = rows[-1][7] if rows else None
    own = [row for row in rows if row[7] == session]
    if not own:
        return History(subject, ())
    date, side = own[0][4], own[0][8]
    known = [row for row in rows if (row[4], row[7]) <= (date, session)]
    same = [row for row in known if row[8] == side]
    there = [row for row in known if side and row[8] == arm_side.other(side)]
    points, elsewhere = _by_parameter(same), _by_parameter(there)
    followed = {key: own_points for key, own_points in points.items() if own_points[-1][3] == session}
    decided = _decided(known) if method in _TOGETHER else None
    slower = _at_other_speeds(_by_parameter([*same, *there]), followed)

    def compare(key: _Key, with_points: Sequence[_Point]) -> list[_Point]:
        alike = _comparable(with_points, followed[key][-1], key[2], decided)
        return [p for p in alike if p[3] not in slower.get((key[0].partition(" in ")[2], key[2]), ())]

    alike = [compare(key, own_points) for key, own_points in followed.items()]
    others = [[*compare(key, elsewhere.get(key, ()))[-1:], own_points[-1]] for key, own_points in followed.items()]
    courses = _courses(followed, alike, others)
    later = tuple(dict.fromkeys(row[4] for row in rows if row[8] == side and (row[4], row[7]) > (date, session)))
    warnings = (*_in_other_units(points, followed), *_without_side(rows, side), *_faster(slower, known), *_not_last(date, later))
    return History(subject, courses, warnings, date, side or None, later)


def _by_parameter(rows: Iterable[_Row]) -> dict[_Key, list[_Point]]:
    points: dict[_Key, list[_Point]] = {}
    for name, kind, joint, unit, date, value, std, session, _ in rows:
        points.setdefault((name, kind, joint, unit), []).append((date, value, std, session))
    return points


def _decided(rows: Iterable[_Row]) -> _Decided:
    decided: dict[tuple[int, int], set[tuple[str, str]]] = {}
    for name, kind, joint, *_, session, _ in rows:
        decided.setdefault((session, joint), set()).add((name, kind))
    return decided


def _comparable(points: Sequence[_Point], last: _Point, joint: int, decided: _Decided | None) -> list[_Point]:
    """Return the points of a parameter that compare with a last one.

    Where another parameter of the joint sat at a bound, a deviation of `identify` means less. Other methods estimate each by itself.
    """
    return [p for p in points if decided is None or decided[p[3], joint] == decided[last[3], joint]]


def _at_other_speeds(
    points: Mapping[_Key, Sequence[_Point]], followed: Mapping[_Key, Sequence[_Point]]
) -> dict[tuple[str, int], list[int]]:
    """Return by slow movement and joint the sessions in which it had another speed than in the last one: what resists depends on it."""
    found: dict[tuple[str, int], list[int]] = {}
    for key, own in followed.items():
        quantity, _, movement = key[0].partition(" in ")
        if key[1] != "passive" or quantity != "speed":
            continue
        now = own[-1][1]
        if other := [p[3] for p in points[key] if abs(p[1] - now) > max(SAME_SPEED * now, LEAST_SPEED)]:
            found[movement, key[2]] = other
    return found


def _courses(
    followed: Mapping[_Key, Sequence[_Point]], alike: Sequence[Sequence[_Point]], others: Sequence[Sequence[_Point]]
) -> tuple[Course, ...]:
    alike, others = (
        [p[-1:] if key[1] == "passive" and key[0].startswith(CHOSEN) else p for key, p in zip(followed, each, strict=True)]
        for each in (alike, others)
    )
    tests = [change(points) for points in alike]
    adjusted = holm([p for *_, p in tests])
    before, first, other = (
        _differences(pairs) for pairs in ([p[-2:] for p in alike], [[p[0], p[-1]] if len(p) > 1 else list(p) for p in alike], others)
    )
    return tuple(
        Course(
            name=name,
            kind=kind,
            joint=joint or None,
            unit=unit,
            dates=tuple(p[0] for p in points),
            values=np.array([p[1] for p in points]),
            stds=np.array([p[2] for p in points]),
            change=difference,
            change_std=std,
            p_value=p_value,
            before=before[k],
            first=first[k],
            other_arm=other[k],
        )
        for k, (((name, kind, joint, unit), points), (difference, std, _), p_value) in enumerate(
            zip(followed.items(), tests, adjusted, strict=True)
        )
    )


def _differences(pairs: Sequence[Sequence[_Point]]) -> list[Difference]:
    tests = [change(pair) for pair in pairs]
    adjusted = holm([p for *_, p in tests])
    return [
        Difference(pair[0][0] if len(pair) > 1 else None, value, std, p)
        for pair, (value, std, _), p in zip(pairs, tests, adjusted, strict=True)
    ]


def _in_other_units(known: Mapping[_Key, Sequence[_Point]], followed: Iterable[_Key]) -> tuple[str, ...]:
    """Return which sessions are left out, since their unit is not that of the last session; armrs writes each parameter in one."""
    lines = []
    for name, kind, joint, unit in followed:
        for other, points in known.items():
            if other[:3] == (name, kind, joint) and other[3] != unit:
                of = f"{kind} {name}{f' of joint {joint}' if joint else ''}"
                dates = ", ".join(date for date, *_ in points)
                lines.append(f"history, {of}: found {show(other[3])} on {dates}, allowed {show(unit)} as in the last session: not compared")
    return tuple(lines)


def _without_side(rows: Sequence[_Row], side: str) -> tuple[str, ...]:
    """Return which sessions are left out since they, or this one, do not state the side of the arm."""
    others = [row for row in rows if bool(row[8]) != bool(side)]
    if not others:
        return ()
    dates = ", ".join(dict.fromkeys(row[4] for row in others))
    if side:
        step = 'state it in [subject] of their dataset.toml, such as side = "left", and run their commands again with their dates'
        return (f"history, side: found none on {dates}, allowed {side} as in this session: not compared; {step}",)
    stated = " and ".join(sorted({row[8] for row in others}))
    return (f"history, side: found none in this session, allowed {stated} as on {dates}: not compared; state side in [subject]",)


def _faster(slower: Mapping[tuple[str, int], Sequence[int]], rows: Sequence[_Row]) -> list[str]:
    """Return which sessions are left out since a slow movement had another speed."""
    date = {row[7]: row[4] for row in rows}
    lines = []
    for (movement, joint), sessions in slower.items():
        dates = ", ".join(dict.fromkeys(date[session] for session in sessions))
        found = f"found another speed of joint {joint} on {dates}"
        lines.append(f"history, {movement}: {found}, allowed that of this session up to {100 * SAME_SPEED:.0f} %: not compared")
    return lines


def _not_last(date: str, later: Sequence[str]) -> tuple[str, ...]:
    return (f"history: {date} is compared with earlier sessions only, not with {', '.join(later)}",) if later else ()


def change(points: Sequence[_Point]) -> tuple[float, float, float]:
    """Return the last value less the weighted mean of those before, its deviation, and the two-sided probability."""
    if len(points) < 2:
        return _NO_TEST
    values, stds = np.array([p[1] for p in points]), np.array([max(p[2], 1e-300) for p in points])
    weights = (stds[:-1].min() / stds[:-1]) ** 2
    mean = float(np.sum(weights * values[:-1]) / np.sum(weights))
    mean_std = float(stds[:-1].min() / np.sqrt(np.sum(weights)))
    difference, std = float(values[-1]) - mean, float(np.hypot(stds[-1], mean_std))
    return difference, std, math.erfc(abs(difference) / std / math.sqrt(2.0))
