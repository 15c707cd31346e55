"""Reading and writing TOML; errors are one line."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from .. import checks
from ..errors import BadInput, Text, not_utf8, unreadable

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

_Made = TypeVar("_Made")
_LIMIT = 16 * 1024 * 1024
_DEEPEST = 32
_DIGITS = 1000
_QUOTED = re.compile(r'"(?:[^"\\]|\\.)*"|\'[^\']*\'')
_LONG_KEY = re.compile(rf'\s*\[{{0,2}}\s*[\w"-]+(\s*\.\s*[\w"-]+){{{_DEEPEST},}}')
_LONG_NUMBER = re.compile(rf"[\d_]{{{_DIGITS},}}")
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the tables of a TOML file, or raise `BadInput` naming file, line and column."""
    content = read_text(path, "a TOML file")
    _refuse_bombs(content, path)
    try:
        return tomllib.loads(content)
    except tomllib.TOMLDecodeError as error:
        message, _, position = str(error).partition(" (at ")
        place = position.rstrip(")") or "TOML"
        raise BadInput(place, Text(message), "TOML", file=path) from None


def _refuse_bombs(content: str, path: str | os.PathLike[str]) -> None:
    """Refuse what is legal, means nothing here, and keeps a reader busy for minutes: nesting, keys in parts, and numbers without end."""
    depth = 0
    for number, line in enumerate(content.splitlines(), start=1):
        plain = _QUOTED.sub('""', line).partition("#")[0]
        for c in plain:
            depth += (c in "[{") - (c in "]}")
            if depth > _DEEPEST:
                raise BadInput(
                    f"line {number}", Text(f"more than {_DEEPEST} brackets within one another"), "TOML as armrs writes it", file=path
                )
        depth = max(depth, 0)
        if _LONG_KEY.match(plain):
            raise BadInput(f"line {number}", Text(f"a key of more than {_DEEPEST} parts"), "TOML as armrs writes it", file=path)
        if _LONG_NUMBER.search(plain):
            raise BadInput(f"line {number}", Text(f"a number of more than {_DIGITS} digits"), "a number", file=path)


def load(path: str | os.PathLike[str], make: Callable[[dict[str, Any], Path], _Made]) -> _Made:
    """Return what `make` builds of the tables of a TOML file and its path; a refusal without a file names this one."""
    document = read(path)
    try:
        return make(document, Path(path))
    except BadInput as error:
        raise error.within(file=error.file or path) from None


def read_text(path: str | os.PathLike[str], what: str, most: int = _LIMIT) -> str:
    """Return the text of a UTF-8 file of at most `most` bytes, or raise `BadInput`."""
    file = checks.path("file", path)
    try:
        is_folder, is_file, size = file.is_dir(), file.is_file(), file.stat().st_size
        raw = file.read_bytes() if is_file and size <= most else b""
    except OSError as error:
        raise unreadable(error, what, file=path) from None
    except ValueError:  # a path with a null character
        raise BadInput("file", Text("a name no file can have"), what, file=path) from None
    if is_folder:
        raise BadInput("file", Text("a folder"), what, file=path)
    if not is_file:
        raise BadInput("file", Text("a device or a pipe"), f"{what} on a disk", file=path)
    if size > most:
        raise BadInput("file", Text(f"{size} bytes"), f"{what} of at most {most} bytes", file=path)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise not_utf8(f"line {line}", raw, error, file=path) from None


def value(item: object) -> str:
    """Write one value; a float is written with all the digits that reading it back needs."""
    if isinstance(item, bool):
        return "true" if item else "false"
    if isinstance(item, int):
        return repr(int(item))
    if isinstance(item, float):
        # A float of NumPy is one too, and writes its type.
        return repr(float(item))
    if isinstance(item, str):
        return '"' + "".join(_escape(c) for c in item) + '"'
    if isinstance(item, (list, tuple)):
        return "[" + ", ".join(value(part) for part in item) + "]"
    raise TypeError(f"no TOML form for {type(item).__name__}")


def lines(table: Mapping[str, object]) -> list[str]:
    """Write the plain keys of one table, leaving out those that are None."""
    return [f"{_key(key)} = {value(item)}" for key, item in table.items() if item is not None]


def _key(key: str) -> str:
    return key if _BARE_KEY.fullmatch(key) else value(key)


def _escape(character: str) -> str:
    if character in '"\\':
        return "\\" + character
    if character < " " or character == "\x7f":
        return f"\\u{ord(character):04x}"
    return character
