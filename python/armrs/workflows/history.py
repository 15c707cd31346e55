"""Results of one subject over sessions: an SQLite file, a test of change, and a plot."""

from __future__ import annotations

import datetime
import os
import re
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from .. import checks
from ..errors import BadInput, Text, show
from ..formatting import parameter_label
from ..io import files
from ..io.dataset import Dataset
from ..tabular import Tabular, Tidy
from .identify import Estimate

APPLICATION = 0x61726D73
"""Mark of our files: "arms" in ASCII."""
_TOGETHER = ("joint", "cascade")
"""Methods that estimate all parameters of a joint together."""
LEVEL = 0.95
"""One minus the probability of calling any parameter changed when none is."""
LONGEST_WAIT = 60.0
"""Time for which a history that another process writes is waited for [s]; writing takes some milliseconds."""
_SCHEMA = """
CREATE TABLE IF NOT EXISTS session (
    id INTEGER PRIMARY KEY, name TEXT NOT NULL, date TEXT NOT NULL, method TEXT NOT NULL, joints INTEGER NOT NULL,
    UNIQUE (name, date, method)
);
CREATE TABLE IF NOT EXISTS estimate (
    session INTEGER NOT NULL REFERENCES session (id) ON DELETE CASCADE,
    name TEXT NOT NULL, kind TEXT NOT NULL, joint INTEGER NOT NULL, value REAL NOT NULL, std REAL NOT NULL, unit TEXT NOT NULL,
    decided_by TEXT NOT NULL,
    PRIMARY KEY (session, name, kind, joint)
);
"""
_WHOSE = "CREATE TABLE IF NOT EXISTS subject (name TEXT NOT NULL);"
"""Beside it; histories of older versions have no such table."""
_MAGIC = b"SQLite format 3\0"
_TABLES = "SELECT type, name, tbl_name, sql FROM sqlite_master ORDER BY type, name"
_IMPOSSIBLE = {
    "a number is none": (
        "SELECT count(*) FROM estimate WHERE typeof(value) NOT IN ('real', 'integer') OR typeof(std) NOT IN ('real', 'integer') "
        "OR abs(value) > 1e300 OR std < 0 OR std > 1e300"
    ),
    "a date is none": "SELECT count(*) FROM session WHERE date IS NOT date(date)",
    "a number of joints is none": "SELECT count(*) FROM session WHERE typeof(joints) != 'integer' OR joints < 1",
}
"""What the tables would take and armrs never writes, with a query that counts it."""
_IMPOSSIBLE_SUBJECT = {
    "there are two subjects": "SELECT count(*) > 1 FROM subject",
    "a subject has no name": "SELECT count(*) FROM subject WHERE typeof(name) != 'text' OR name = ''",
}
_OUTPUTS = (".json", ".toml", ".html", ".png", ".csv", ".parquet")
_DATE = re.compile(r"\d{4}-\d{2}-\d{2}")
_UNREADABLE = (sqlite3.Error, UnicodeDecodeError)
"""What SQLite raises for a damaged file: the second where its message names what is no text."""
_AROUND = " _-.,;:/|()[]"
"""What may stand between a subject and a date in the name of a data set."""


class Followed(Protocol):
    """A result of a session that a history keeps: of `identify`, `find_gap`, `passive_moments` or `spasticity`."""

    @property
    def dataset(self) -> Dataset:
        """Its data."""

    @property
    def method(self) -> str:
        """What it was found with: sessions compare with those of the same method."""

    @property
    def level(self) -> float:
        """Probability of the intervals."""

    def followed(self) -> Sequence[Estimate]:
        """Return what is kept, each name once a joint."""


@dataclass(frozen=True, eq=False)
class Course:
    """One parameter over sessions that measured it.

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
    since_last, since_last_std, since_last_p_value : float
        The last value less that of the session before it, its deviation, and the probability over all parameters; NaN as above.
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
    since_last: float
    since_last_std: float
    since_last_p_value: float

    @property
    def changed_since_last(self) -> bool:
        """Whether the last session differs from the one before it."""
        return self.since_last_p_value < 1.0 - LEVEL

    @property
    def changed(self) -> bool:
        """Whether the last session differs from those before."""
        return self.p_value < 1.0 - LEVEL

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
            "since_last": self.since_last,
            "since_last_std": self.since_last_std,
            "since_last_p_value": self.since_last_p_value,
            "changed_since_last": self.changed_since_last,
        }


@dataclass(frozen=True, eq=False)
class History(Tabular):
    """What is known of one subject over sessions.

    Attributes
    ----------
    subject : str or None
    courses : tuple of Course
        One for every parameter that the data decided in the last session.
    warnings : tuple of str
        What the file holds that cannot be compared.
    """

    subject: str | None
    courses: tuple[Course, ...]
    warnings: tuple[str, ...] = ()

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

    def to_dict(self) -> dict[str, Any]:
        """Return plain data."""
        return {"subject": self.subject, "courses": [course.to_dict() for course in self.courses]}


def session_date(name: str, given: str | None = None) -> str:
    """Return the date of a session: as given, or in the name of the data set, or today.

    Raises
    ------
    BadInput
        For a date that is none.
    """
    if given is None:
        found = _DATE.search(name)
        given = found[0] if found else datetime.date.today().isoformat()
    try:
        day = datetime.date.fromisoformat(given)
    except (TypeError, ValueError):
        day = None
    if day is None or given != day.isoformat():  # other forms of ISO 8601 are read by some versions of Python only
        raise BadInput("date", given, "a date such as 2026-03-14")
    return given


def subject_of(dataset: Dataset) -> str:
    """Return the name of the subject: as the data set states it, or the data set's own name without its date.

    Raises
    ------
    BadInput
        When neither is given.
    """
    name = dataset.subject.name or without_date(dataset.name)
    if not name:
        found = Text(f"a data set {show(dataset.name)} that names no subject")
        raise BadInput("history", found, "[subject] name in dataset.toml, or a name of the data set besides its date")
    return name


def without_date(name: str) -> str:
    """Return the name of a data set without its date."""
    return _DATE.sub("", name).strip(_AROUND)


def check(path: str | os.PathLike[str], joints: int, subject: str) -> None:
    """Refuse a history file that cannot be added to, before any work is done."""
    file = checks.path("history", path)
    files.must_be_writable(file)
    if file.is_dir():
        raise BadInput("history", Text("a folder"), "the name of a file", file=file)
    if file.suffix.lower() in _OUTPUTS:
        # A result of the same command could take its place.
        raise BadInput("history", Text(f"a name that ends with {file.suffix}"), "another, such as .sqlite", file=file)
    if file.exists():
        with _reading(file) as connection:
            _same_arm(connection, joints, subject, file)


def add(path: str | os.PathLike[str], result: Followed, date: str) -> History:
    """Add a result to the history of its subject, as `adding` does, and return the history."""
    with adding(path, result, date) as history:
        return history


@contextmanager
def adding(path: str | os.PathLike[str], result: Followed, date: str) -> Iterator[History]:
    """Add a result to the history of its subject and give that history; what is added stays only if the block ends well.

    Parameters
    ----------
    path : path
        File of SQLite, made when it does not exist; one subject a file.
    result : Followed
        Of `identify`, `find_gap`, `passive_moments` or `spasticity`. The same session (name of the data set, date, method) takes the
        place of its former result.
    date : str
        ISO date of the session.

    Raises
    ------
    BadInput
        For a file of another kind, of another arm or of another subject.
    """
    file, subject = Path(path), subject_of(result.dataset)
    check(file, result.dataset.model.n_joints, subject)
    try:
        yield _foreseen(file, result, subject, date)
        # The file is written only now, in one short transaction: the block may take long, and others may add meanwhile.
        file.parent.mkdir(parents=True, exist_ok=True)
        with closing(_open(file)) as connection:
            _write(connection, result, subject, date)
    except sqlite3.Error as error:
        raise BadInput("history", Text(str(error)), "a history that can be written", file=file) from None


def _foreseen(file: Path, result: Followed, subject: str, date: str) -> History:
    """Return the history as it will be with a result, without writing it."""
    with closing(sqlite3.connect(":memory:")) as memory:
        memory.execute("PRAGMA foreign_keys = ON")
        if file.exists() and file.stat().st_size > 0:
            with closing(_open(file)) as connection:
                connection.backup(memory)
        replaced = _write(memory, result, subject, date)
        found = _courses(memory, result.method)
        if not _estimates(result):
            line = f"history: no quantity of {show(result.dataset.name)} on {date} has an interval (no repeats?): it is not added"
            return replace(found, warnings=(*found.warnings, line))
        if not replaced:
            return found
        line = f"history: the former result of {show(result.dataset.name)} on {date} is replaced; another --date keeps both"
        return replace(found, warnings=(*found.warnings, line))


def _write(connection: sqlite3.Connection, result: Followed, subject: str, date: str) -> bool:
    """Add a result in one transaction, the tables included: a process that is killed leaves the history as it was.

    Returns
    -------
    bool
        Whether it took the place of a former one.
    """
    # A script begins its own transaction; statements that follow it belong to the same one.
    connection.executescript(f"BEGIN IMMEDIATE; PRAGMA application_id = {APPLICATION}; {_SCHEMA} {_WHOSE}")
    connection.execute("INSERT INTO subject SELECT ? WHERE NOT EXISTS (SELECT * FROM subject)", (subject,))
    replaced = _insert(connection, result, date)
    connection.commit()
    return replaced


def _insert(connection: sqlite3.Connection, result: Followed, date: str) -> bool:
    estimates = _estimates(result)
    if not estimates:
        return False
    key = (result.dataset.name, date, result.method)
    former = connection.execute("DELETE FROM session WHERE name = ? AND date = ? AND method = ?", key)
    made = connection.execute("INSERT INTO session (name, date, method, joints) VALUES (?, ?, ?, ?)", (*key, result.dataset.model.n_joints))
    rows = [(made.lastrowid, *k, e.value, _deviation(e, result.level), e.unit, e.decided_by) for k, e in estimates.items()]
    connection.executemany("INSERT INTO estimate VALUES (?, ?, ?, ?, ?, ?, ?, ?)", rows)
    return former.rowcount > 0


def _estimates(result: Followed) -> dict[tuple[str, str, int], Estimate]:
    """Return what is kept of a result, by name, kind and joint (0 for none): what has an interval."""
    return {(e.name, e.kind, e.joint or 0): e for e in result.followed() if _usable(e)}


def read(path: str | os.PathLike[str], method: str = "joint") -> History:
    """Return every parameter that the data decided in the last session, over all sessions in which they did."""
    with _reading(checks.path("history", path)) as connection:
        return _courses(connection, method)


@contextmanager
def _reading(file: Path) -> Iterator[sqlite3.Connection]:
    """Open a history to read it; what SQLite cannot read of it is a refusal too."""
    try:
        with closing(_open(file)) as connection:
            yield connection
    except _UNREADABLE as error:
        raise _no_history(file, str(error)) from None


def _courses(connection: sqlite3.Connection, method: str) -> History:
    rows = connection.execute(
        "SELECT e.name, e.kind, e.joint, e.unit, s.date, e.value, e.std, s.id FROM estimate e JOIN session s ON s.id = e.session "
        "WHERE s.method = ? AND e.decided_by = 'data' ORDER BY s.date, s.id, e.rowid",
        (method,),
    ).fetchall()
    by_parameter: dict[_Key, list[_Point]] = {}
    beside: dict[tuple[int, int], set[tuple[str, str]]] = {}
    for name, kind, joint, unit, date, value, std, session in rows:
        by_parameter.setdefault((name, kind, joint, unit), []).append((date, value, std, session))
        beside.setdefault((session, joint), set()).add((name, kind))
    last = rows[-1][7] if rows else 0
    followed = {key: points for key, points in by_parameter.items() if points[-1][3] == last}
    # Where another parameter of the joint sat at a bound, a deviation of `identify` means less; the others estimate each by itself.
    alike = [
        [p for p in points if method not in _TOGETHER or beside[p[3], key[2]] == beside[last, key[2]]] for key, points in followed.items()
    ]
    tests, lasts = [_change(points) for points in alike], [_change(points[-2:]) for points in alike]
    adjusted, adjusted_last = (holm([p for *_, p in all_tests]) for all_tests in (tests, lasts))
    courses = tuple(
        Course(
            name=name,
            kind=kind,
            joint=joint or None,
            unit=unit,
            dates=tuple(p[0] for p in points),
            values=np.array([p[1] for p in points]),
            stds=np.array([p[2] for p in points]),
            change=change,
            change_std=std,
            p_value=p_value,
            since_last=since[0],
            since_last_std=since[1],
            since_last_p_value=p_last,
        )
        for ((name, kind, joint, unit), points), (change, std, _), p_value, since, p_last in zip(
            followed.items(), tests, adjusted, lasts, adjusted_last, strict=True
        )
    )
    return History(_whose(connection), courses, _in_other_units(by_parameter, followed))


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


def _open(file: Path) -> sqlite3.Connection:
    """Open a history, or refuse what is none: another file, another program's database, one that is damaged or was changed by hand."""
    try:
        # SQLite takes a file of a few bytes for an empty database, and would write over it.
        if file.exists() and (not file.is_file() or _head(file) not in (b"", _MAGIC)):
            raise _no_history(file, "file is not a database")
        connection = sqlite3.connect(file, timeout=LONGEST_WAIT)
    except OSError as error:
        raise _no_history(file, error.strerror or "a file that cannot be read") from None
    except _UNREADABLE as error:
        raise _no_history(file, str(error)) from None
    try:
        wrong = _wrong(connection)
    except _UNREADABLE as error:
        wrong = str(error)
    if wrong:
        connection.close()
        raise _no_history(file, wrong)
    return connection


def _head(file: Path) -> bytes:
    with file.open("rb") as stream:
        return stream.read(len(_MAGIC))


def _wrong(connection: sqlite3.Connection) -> str | None:
    """Return what makes a database no history of ours, or None."""
    connection.execute("PRAGMA foreign_keys = ON")
    tables = connection.execute(_TABLES).fetchall()
    if not tables:
        return None
    if connection.execute("PRAGMA application_id").fetchone()[0] != APPLICATION:
        return "a database of another program"
    with closing(sqlite3.connect(":memory:")) as ours:
        ours.executescript(_SCHEMA)
        older = ours.execute(_TABLES).fetchall()
        ours.executescript(_WHOSE)
        if tables not in (older, ours.execute(_TABLES).fetchall()):
            return "a history with other tables than armrs makes"
    damage = connection.execute("PRAGMA integrity_check(1)").fetchone()[0]
    if damage != "ok":
        return f"a damaged history ({damage})"
    impossible = _IMPOSSIBLE if tables == older else _IMPOSSIBLE | _IMPOSSIBLE_SUBJECT
    return next((f"a history in which {what}" for what, query in impossible.items() if connection.execute(query).fetchone()[0]), None)


def _no_history(file: Path, found: str) -> BadInput:
    return BadInput("history", Text(found), "a history that armrs wrote, or a new file", file=file)


def _same_arm(connection: sqlite3.Connection, joints: int, subject: str, file: Path) -> None:
    if not connection.execute(_TABLES).fetchall():
        return
    whose = _whose(connection)
    if whose not in (None, subject):
        hint = "[subject] name in dataset.toml says whose arm it is, whatever the data set is called"
        raise BadInput(
            "history", Text(f"the history of {show(whose)}"), f"that of {show(subject)}: one subject a file", file=file, hint=hint
        )
    other = connection.execute("SELECT joints FROM session WHERE joints != ?", (joints,)).fetchone()
    if other is not None:
        raise BadInput("history", Text(f"the history of an arm of {other[0]} joints"), f"one of {joints}: one subject a file", file=file)


def _whose(connection: sqlite3.Connection) -> str | None:
    """Return the subject of a history: as stored, or by the first data set in a file that stores none; None in an empty one."""
    if connection.execute("SELECT count(*) FROM sqlite_master WHERE name = 'subject'").fetchone()[0]:
        stored = connection.execute("SELECT name FROM subject").fetchone()
        if stored is not None:
            return str(stored[0])
    first = connection.execute("SELECT name FROM session ORDER BY id LIMIT 1").fetchone()
    return None if first is None else without_date(str(first[0])) or None


def _deviation(estimate: Estimate, level: float) -> float:
    from scipy.stats import norm

    low, high = estimate.interval
    return float(max(high - estimate.value, estimate.value - low) / norm.ppf(0.5 + 0.5 * level))


def _usable(estimate: Estimate) -> bool:
    return bool(np.isfinite([estimate.value, *estimate.interval]).all())


_Point = tuple[str, float, float, int]
"""Date, value, standard deviation, session."""
_Key = tuple[str, str, int, str]
"""Name, kind, joint (0 for none) and unit of a parameter."""


def _change(points: Sequence[_Point]) -> tuple[float, float, float]:
    """Return the last value less the weighted mean of those before, its deviation, and the two-sided probability."""
    from scipy.stats import norm

    if len(points) < 2:
        return (np.nan, np.nan, np.nan)
    values, stds = np.array([p[1] for p in points]), np.array([max(p[2], 1e-300) for p in points])
    weights = (stds[:-1].min() / stds[:-1]) ** 2
    mean = float(np.sum(weights * values[:-1]) / np.sum(weights))
    mean_std = float(stds[:-1].min() / np.sqrt(np.sum(weights)))
    change, std = float(values[-1]) - mean, float(np.hypot(stds[-1], mean_std))
    return change, std, float(2.0 * norm.sf(abs(change) / std))


def holm(p_values: Sequence[float]) -> list[float]:
    """Return probabilities over all tests together (Holm 1979); NaN stays."""
    order = [int(k) for k in np.argsort(p_values) if np.isfinite(p_values[k])]
    adjusted, largest = [float("nan")] * len(p_values), 0.0
    for place, k in enumerate(order):
        largest = max(largest, min(1.0, (len(order) - place) * p_values[k]))
        adjusted[k] = largest
    return adjusted
