"""Results of one subject over sessions: an SQLite file, a test of change, and a plot."""

from __future__ import annotations

import datetime
import hashlib
import os
import re
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from statistics import NormalDist
from typing import Protocol

import numpy as np

from .. import checks
from ..errors import BadInput, Text, show
from ..io import files
from ..io.dataset import Dataset
from .courses import History, history_of
from .identify import Estimate

APPLICATION = 0x61726D73
"""Mark of our files: "arms" in ASCII."""
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
_ARM = (
    "CREATE TABLE IF NOT EXISTS arm (session INTEGER PRIMARY KEY REFERENCES session (id) ON DELETE CASCADE, "
    "side TEXT NOT NULL, recording_sha256 TEXT NOT NULL);"
)
"""The same: which arm was measured, empty where that is not stated, and what was recorded."""
_MAGIC = b"SQLite format 3\0"
_TABLES = "SELECT type, name, tbl_name, sql FROM sqlite_master ORDER BY type, name"
_IMPOSSIBLE = {
    "a value is invalid": (
        "SELECT count(*) FROM estimate WHERE typeof(value) NOT IN ('real', 'integer') OR typeof(std) NOT IN ('real', 'integer') "
        "OR abs(value) > 1e300 OR std < 0 OR std > 1e300"
    ),
    "a date is invalid": "SELECT count(*) FROM session WHERE date IS NOT date(date)",
    "a number of joints is invalid": "SELECT count(*) FROM session WHERE typeof(joints) != 'integer' OR joints < 1",
}
"""What the tables would take and armrs never writes, with a query that counts it."""
_IMPOSSIBLE_SUBJECT = {
    "there are two subjects": "SELECT count(*) > 1 FROM subject",
    "a subject has no name": "SELECT count(*) FROM subject WHERE typeof(name) != 'text' OR name = ''",
}
_IMPOSSIBLE_ARM = {"a side is invalid": "SELECT count(*) FROM arm WHERE side NOT IN ('', 'left', 'right')"}
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


def refuse_future(date: str) -> None:
    """Refuse the date of a session that has not been yet."""
    # Somewhere it is tomorrow already.
    today = datetime.date.today()
    if datetime.date.fromisoformat(date) > today + datetime.timedelta(days=1):
        raise BadInput("date", Text(f"{date}, which is in the future"), f"a date up to today, {today.isoformat()}")


def check(path: str | os.PathLike[str], joints: int, subject: str, dataset: Dataset | None = None, date: str | None = None) -> None:
    """Refuse a history file that cannot be added to, before any work is done; with a data set and its date also a second copy of it."""
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
            if dataset is not None and date is not None:
                _refuse_copy(connection, dataset, date, file)


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
        Of `identify`, `find_gap`, `passive_moments` or `spasticity`. The same session (name of the data set, side, date, method), and
        another result of the same recording on that date, take the place of the former result.
    date : str
        ISO date of the session.

    Raises
    ------
    BadInput
        For a file of another kind, of another subject or an arm of other joints, and a recording that is there with another date or side.
    """
    file, subject = Path(path), subject_of(result.dataset)
    check(file, result.dataset.model.n_joints, subject, result.dataset, date)
    try:
        yield _foreseen(file, result, subject, date)
        # The file is written only now, in one short transaction: the block may take long, and others may add meanwhile.
        file.parent.mkdir(parents=True, exist_ok=True)
        with closing(_open(file)) as connection:
            _write(connection, result, subject, date, file)
    except sqlite3.Error as error:
        raise BadInput("history", Text(str(error)), "a history that can be written", file=file) from None


def _foreseen(file: Path, result: Followed, subject: str, date: str) -> History:
    """Return the history as it will be with a result, without writing it."""
    with closing(sqlite3.connect(":memory:")) as memory:
        memory.execute("PRAGMA foreign_keys = ON")
        if file.exists() and file.stat().st_size > 0:
            with closing(_open(file)) as connection:
                connection.backup(memory)
        session, replaced = _write(memory, result, subject, date, file)
        if session is None:
            why = "no repeats, or no slow movement?"
            line = f"history: no quantity of {show(result.dataset.name)} on {date} has an interval ({why}): it is not added"
            return History(subject, (), (line,), date, result.dataset.subject.side)
        found = history_of(memory, result.method, _whose(memory), session)
        if not replaced:
            return found
        line = f"history: the former result of {show(result.dataset.name)} on {date} is replaced; another --date keeps both"
        return replace(found, warnings=(*found.warnings, line))


def _write(connection: sqlite3.Connection, result: Followed, subject: str, date: str, file: Path) -> tuple[int | None, bool]:
    """Add a result in one transaction, the tables included: a process that is killed leaves the history as it was.

    Returns
    -------
    int or None
        Number of the session; None for a result without intervals, which is not added.
    bool
        Whether it took the place of a former one.
    """
    # A script begins its own transaction; statements that follow it belong to the same one.
    connection.executescript(f"BEGIN IMMEDIATE; PRAGMA application_id = {APPLICATION}; {_SCHEMA} {_WHOSE} {_ARM}")
    _refuse_copy(connection, result.dataset, date, file)
    connection.execute("INSERT INTO subject SELECT ? WHERE NOT EXISTS (SELECT * FROM subject)", (subject,))
    added = _insert(connection, result, date)
    connection.commit()
    return added


def _insert(connection: sqlite3.Connection, result: Followed, date: str) -> tuple[int | None, bool]:
    estimates = _estimates(result)
    if not estimates:
        return None, False
    data, recorded = result.dataset, _recorded(result.dataset)
    name = data.name if data.subject.side is None else f"{data.name} ({data.subject.side} arm)"
    # A former result may have been stored before its side was stated, or its data set named otherwise.
    former = connection.execute(
        "DELETE FROM session WHERE date = ? AND method = ? AND (name IN (?, ?) OR id IN "
        "(SELECT session FROM arm WHERE recording_sha256 = ?))",
        (date, result.method, name, data.name, recorded),
    )
    key = (name, date, result.method, data.model.n_joints)
    made = connection.execute("INSERT INTO session (name, date, method, joints) VALUES (?, ?, ?, ?)", key).lastrowid
    connection.execute("INSERT INTO arm VALUES (?, ?, ?)", (made, data.subject.side or "", recorded))
    rows = [(made, *k, e.value, _deviation(e, result.level), e.unit, e.decided_by) for k, e in estimates.items()]
    connection.executemany("INSERT INTO estimate VALUES (?, ?, ?, ?, ?, ?, ?, ?)", rows)
    return made, former.rowcount > 0


def _recorded(dataset: Dataset) -> str:
    """Return a digest of the samples of a session: the same for a copy under other names, in another order or another format."""
    digests = []
    for trial in dataset.trials:
        channels = (trial.t, trial.q, trial.force_on_arm, trial.tau, trial.robot_q)
        digests.append(hashlib.sha256(b"".join(np.ascontiguousarray(c).tobytes() for c in channels if c is not None)).hexdigest())
    return hashlib.sha256("".join(sorted(digests)).encode()).hexdigest()


def _refuse_copy(connection: sqlite3.Connection, dataset: Dataset, date: str, file: Path) -> None:
    """Refuse a recording that the history has with another date or of the other arm: one session would count as two."""
    rows = connection.execute(
        "SELECT s.name, s.date, a.side FROM session s JOIN arm a ON a.session = s.id WHERE a.recording_sha256 = ? ORDER BY s.date, s.id",
        (_recorded(dataset),),
    )
    for name, there, side in rows:
        arm = f" of the {side} arm" if side else ""
        if there != date or (side and dataset.subject.side and side != dataset.subject.side):
            found = Text(f"the recording that it has as {show(name)} on {there}{arm}, sample for sample")
            own = f" of the {dataset.subject.side} arm" if dataset.subject.side else ""
            allowed = f"another recording for the session on {date}{own}"
            raise BadInput("history", found, allowed, file=file, hint=f"--date {there} replaces that result")


def _estimates(result: Followed) -> dict[tuple[str, str, int], Estimate]:
    """Return what is kept of a result, by name, kind and joint (0 for none): what has an interval."""
    return {(e.name, e.kind, e.joint or 0): e for e in result.followed() if _usable(e)}


def read(path: str | os.PathLike[str], method: str = "joint") -> History:
    """Return every parameter that the data decided in the last session, over all sessions in which they did."""
    with _reading(checks.path("history", path)) as connection:
        return history_of(connection, method, _whose(connection))


@contextmanager
def _reading(file: Path) -> Iterator[sqlite3.Connection]:
    """Give a copy of a history in memory, with the tables that an older version did not make; what SQLite cannot read is refused."""
    try:
        with closing(sqlite3.connect(":memory:")) as memory:
            with closing(_open(file)) as connection:
                connection.backup(memory)
            memory.executescript(f"{_SCHEMA} {_WHOSE} {_ARM}")
            yield memory
    except _UNREADABLE as error:
        raise _no_history(file, str(error)) from None


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
        known = [older]
        for later in (_WHOSE, _ARM):
            ours.executescript(later)
            known.append(ours.execute(_TABLES).fetchall())
        if tables not in known:
            return "a history with other tables than armrs makes"
    damage = connection.execute("PRAGMA integrity_check(1)").fetchone()[0]
    if damage != "ok":
        return f"a damaged history ({damage})"
    impossible = _IMPOSSIBLE | (_IMPOSSIBLE_SUBJECT if tables != older else {}) | (_IMPOSSIBLE_ARM if tables == known[-1] else {})
    return next((f"a history in which {what}" for what, query in impossible.items() if connection.execute(query).fetchone()[0]), None)


def _no_history(file: Path, found: str) -> BadInput:
    return BadInput("history", Text(found), "a history that armrs wrote, or a new file", file=file)


def _same_arm(connection: sqlite3.Connection, joints: int, subject: str, file: Path) -> None:
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
    low, high = estimate.interval
    return max(high - estimate.value, estimate.value - low) / NormalDist().inv_cdf(0.5 + 0.5 * level)


def _usable(estimate: Estimate) -> bool:
    return bool(np.isfinite([estimate.value, *estimate.interval]).all())
