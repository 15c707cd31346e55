"""Reading JSON."""

from __future__ import annotations

import json
import os
from typing import Any

from ..errors import BadInput, Text
from .tomlfile import read_text


def read(path: str | os.PathLike[str]) -> Any:
    """Return what a JSON file says.

    Raises
    ------
    BadInput
        When it is no JSON, or holds half a character, which JSON can escape and no file can hold.
    """
    content = read_text(path, "a JSON file")
    try:
        data = json.loads(content)
        if "\\ud" in content.lower():
            json.dumps(data, ensure_ascii=False).encode()
    except UnicodeEncodeError as error:
        half = f"half a character, {error.object[error.start : error.start + 1]!r}"
        raise BadInput("file", Text(half), "whole characters", file=path) from None
    except (ValueError, RecursionError) as error:
        raise BadInput("file", Text(str(error)), "JSON", file=path) from None
    return data
