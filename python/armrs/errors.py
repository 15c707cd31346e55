"""The errors of armrs: one tree, and one line of text for each."""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable
from typing import Any, Literal

WRITABLE = "a place that can be written"
"""What is allowed where a file or folder cannot be made."""
RefusalKind = Literal["value", "missing_key", "missing_file", "missing_source"]
"""In which way an input cannot be used: a value that is not allowed, a required key that is missing, a file that does not exist, or one
that does not exist where other things than a file are allowed. `arm_model::RefusalKind` has the first three."""
_ALIKE = 0.5
"""Least similarity of names, from 0 to 1, at which one is suggested for the other."""


class ArmrsError(Exception):
    """Anything armrs refuses or cannot finish. The command line ends with status 1.

    Attributes
    ----------
    trial : int, optional
        Index of the trial it is about, where the core states it; `armrs.io.dataset.naming_trials` turns it into the name of a file.
    """

    trial: int | None = None


class ArmrsWarning(UserWarning):
    """A remark on a result or its data. Results hold these lines in `warnings`, too; the command line prints them."""


class BadInput(ArmrsError, ValueError):
    """An input that cannot be used as it is. The command line ends with status 2 and writes nothing.

    Parameters
    ----------
    place : str
        Where in the file (key, row and column) or which argument.
    found : object
        The value found.
    allowed : str
        What is allowed there, with its unit.
    file : path, optional
        The file, as the caller named it.
    hint : str, optional
        What was probably meant.
    kind : str
        In which way the input cannot be used, a `RefusalKind`.
    """

    def __init__(
        self,
        place: str,
        found: object,
        allowed: str,
        *,
        file: str | os.PathLike[str] | None = None,
        hint: str | None = None,
        kind: RefusalKind = "value",
    ) -> None:
        super().__init__(place, found, allowed)
        self.place = place
        self.found = found
        self.allowed = allowed
        self.file = None if file is None else os.fspath(file)
        self.hint = hint
        self.kind = kind

    def within(self, *, file: str | os.PathLike[str] | None = None, place: str | None = None) -> BadInput:
        """Return this error seen from further outside: with the file, or with the table that holds the place."""
        outer = ", ".join(part for part in (place, self.place) if part)
        return BadInput(
            outer,
            self.found,
            self.allowed,
            file=self.file if file is None else file,
            hint=self.hint,
            kind=self.kind,
        )

    def __str__(self) -> str:
        where, said = _worded(self)
        text = ": ".join(one_line(part) for part in (self.file, where, said) if part)
        return f"{text} ({one_line(self.hint)})" if self.hint else text


class BadInputs(BadInput):
    """Several inputs that cannot be used as they are: it reads as the first of them, with the number of the others.

    Attributes
    ----------
    problems : tuple of BadInput
    """

    problems: tuple[BadInput, ...]

    def within(self, *, file: str | os.PathLike[str] | None = None, place: str | None = None) -> BadInput:
        """Return all of them seen from further outside."""
        return BadInputs.of([problem.within(file=file, place=place) for problem in self.problems])

    @classmethod
    def of(cls, problems: Iterable[BadInput], told_by: str = "armrs check lists") -> BadInput:
        """Return one refusal for all problems, or the problem itself where there is but one; `told_by` is where the others stand."""
        listed = tuple(problems)
        if len(listed) == 1:
            return listed[0]
        first, others = listed[0], len(listed) - 1
        more = f"and {others} more problem{'s' * (others > 1)}, which {told_by}"
        hint = f"{first.hint}; {more}" if first.hint else more
        made = cls(first.place, first.found, first.allowed, file=first.file, hint=hint, kind=first.kind)
        made.problems = listed
        return made


class IdentificationError(ArmrsError):
    """The data do not determine what is to be identified."""


class SimulationError(ArmrsError):
    """A simulation that stopped: it names the step and the joint."""


class SlaveError(ArmrsError):
    """A call that a co-simulation slave did not do.

    Parameters
    ----------
    function : str
        The call, named as in FMI 3.0.
    status : int
        `armrs.cosim.Status`: discard (2), error (3) or fatal (4).
    message : str
        Message of the slave.
    """

    def __init__(self, function: str, status: int, message: str) -> None:
        super().__init__(function, status, message)
        self.function = function
        self.status = status
        self.message = message

    def __str__(self) -> str:
        word = {2: "discarded", 3: "error", 4: "fatal error"}.get(self.status, f"status {self.status}")
        return one_line(f"{self.function}: {word}: {self.message}")


class CoupledError(ArmrsError):
    """A co-simulation whose numbers are no result: it diverged, creates energy, or its iteration did not converge.

    Attributes
    ----------
    run : CoupledRun, optional
        The run as far as it went, for diagnosis.
    """

    run: Any = None


class Text(str):
    """A description of what was found, printed as it is and not as a quoted value."""


class Sentence(Text):
    """What is wrong in a sentence of its own: printed without place and `found`; what is allowed then says what to do."""


NO_FILE = Text("no such file")
_OF_TRIALS = {
    "configuration": "the name of the movement, shared by its repeats",
    "file": "the file of the samples",
    "repeat": "the number of the repeat of its movement",
    "role": "fit or test",
}
"""Required keys of a trial with their meaning."""


def _worded(refusal: BadInput) -> tuple[str, str]:
    """Return the place and what is wrong there: what is missing in words of its own, all else as found and allowed."""
    found, allowed = refusal.found, refusal.allowed
    table, _, key = refusal.place.rpartition(", ")
    if isinstance(found, Sentence):
        return "", f"{found}; {allowed}"
    if refusal.kind == "missing_key":
        meaning = _OF_TRIALS.get(key) if table.startswith("[[trial]]") else None
        return "", f"`{key}` is missing{f' in {table}' if table else ''}{f': {meaning}' if meaning else ''}"
    if refusal.kind == "missing_file":
        return table, NO_FILE
    if refusal.kind == "missing_source":
        return table, f"{NO_FILE}, allowed {allowed}"
    return refusal.place, f"found {found if isinstance(found, Text) else show(found)}, allowed {allowed}"


def unreadable(error: OSError, what: str = "a file", *, file: str | os.PathLike[str] | None = None) -> BadInput:
    """Build the refusal of a file that the system does not read; `what` names what it should be."""
    kind: RefusalKind = "missing_file" if isinstance(error, FileNotFoundError) else "value"
    return BadInput("file", Text(error.strerror or "unreadable"), f"{what} that can be read", file=file, kind=kind)


def not_utf8(place: str, raw: bytes, error: UnicodeDecodeError, *, file: str | os.PathLike[str] | None = None) -> BadInput:
    """Build the refusal of bytes that are no UTF-8 text; it states what they probably are."""
    utf16 = raw[:2] in (b"\xff\xfe", b"\xfe\xff")
    guess = "UTF-16" if utf16 else "Latin-1 or Windows-1252"
    return BadInput(place, Text(f"byte 0x{raw[error.start]:02x}"), "UTF-8 text", file=file, hint=f"{guess} text? Save it as UTF-8")


def not_later(place: str, before: float, after: float, *, file: str | os.PathLike[str] | None = None) -> BadInput:
    """Return the refusal of a time stamp [s] that is not after the one before it.

    >>> print(not_later("line 8, time", 0.1, 0.05).found, not_later("", 1.7e9 + 1e-3, 1.7e9).found, sep="; ")
    0.05 s after 0.1 s; 1.7e+09 s, 0.001 s less than the one before
    """
    early, late = f"{before:.9g} s", f"{after:.9g} s"
    found = (
        f"{late} twice"
        if after == before
        else f"{late} after {early}"
        if early != late
        else f"{late}, {before - after:.2g} s less than the one before"
    )
    return BadInput(place, Text(found), "time stamps that increase strictly", file=file)


def show(value: object) -> str:
    """Write a value on one line of bounded length, as it would stand in a file."""
    text = str(value).lower() if isinstance(value, bool) else repr(value)
    return one_line(text if len(text) <= 80 else text[:77] + "...")


def one_line(text: object) -> str:
    """Replace line ends and other control characters, so that a message stays one line."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in str(text))


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that is most similar to `name`, or None when none is similar."""
    known = sorted(known)
    lower = {k.lower(): k for k in reversed(known)}
    match = difflib.get_close_matches(str(name).lower(), lower, n=1, cutoff=_ALIKE)
    return lower[match[0]] if match else None


def unknown_name(place: str, name: str, known: Iterable[str], *, what: str = "key") -> BadInput:
    """Build the refusal of an unknown name; it states the nearest known one."""
    known = sorted(known)
    near = nearest(name, known)
    return BadInput(
        place,
        Text(f"unknown {what} {show(name)}"),
        ", ".join(known) if known else f"no {what}",
        hint=f"nearest known: {near}" if near else None,
    )
