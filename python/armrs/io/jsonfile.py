"""Reading JSON."""

from __future__ import annotations

import json
import os
from typing import Any

from ..errors import BadInput, Text
from .tomlfile import read_text

_SHOWN = 40
"""Characters of a file that is no JSON by which it is recognised."""


def read(path: str | os.PathLike[str], what: str = "a JSON file") -> Any:
    """Return the contents of a JSON file; `what` is the expected file, in words.

    Raises
    ------
    BadInput
        When it is no JSON, or holds half a character, which JSON can escape and no file can hold.
    """
    content = read_text(path, what)
    try:
        data = json.loads(content)
        if "\\ud" in content.lower():
            json.dumps(data, ensure_ascii=False).encode()
    except UnicodeEncodeError as error:
        half = f"half a character, {error.object[error.start : error.start + 1]!r}"
        raise BadInput("file", Text(half), "whole characters", file=path) from None
    except (ValueError, RecursionError) as error:
        raise BadInput("file", Text(_instead(content, error)), what, file=path) from None
    return data


def _instead(content: str, error: Exception) -> str:
    """Return what a text is that is no JSON."""
    start = content.strip()
    if not start:
        return "an empty file"
    if start[0] == "{":
        return f"broken JSON ({error})"
    first = start.splitlines()[0]
    return f"no JSON but {first[:_SHOWN] + '…' if len(first) > _SHOWN else first!r}"
