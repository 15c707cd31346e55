"""Checks of single values. Each returns the value in its final type or raises `BadInput` naming the place."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from .errors import BadInput, Text, unknown_name

_MISSING = Text("nothing")


def number(
    place: str,
    value: object,
    *,
    unit: str = "",
    above: float | None = None,
    least: float | None = None,
    most: float | None = None,
    hint: str | None = None,
) -> float:
    """Return a finite number as float.

    Parameters
    ----------
    place : str
        Name of the value.
    value : object
        What was given. A boolean or a text is not a number.
    unit : str
        Unit, for the message.
    above, least, most : float, optional
        Bounds: value > above, value >= least, value <= most.
    hint : str, optional
        What a value out of these bounds probably means.
    """
    bounds = [f"> {above:g}"] if above is not None else []
    if least is not None and most is not None:
        bounds.append(f"{least:g} to {most:g}")
    elif least is not None:
        bounds.append(f">= {least:g}")
    elif most is not None:
        bounds.append(f"<= {most:g}")
    allowed = " ".join(part for part in ("a finite number", " and ".join(bounds), unit) if part)
    if isinstance(value, bool) or not hasattr(type(value), "__float__"):
        raise BadInput(place, value, allowed)
    try:
        result = float(value)  # type: ignore[arg-type]
    except (OverflowError, TypeError, ValueError):
        raise BadInput(place, value, allowed) from None
    outside = (
        not math.isfinite(result)
        or (above is not None and not result > above)
        or (least is not None and not result >= least)
        or (most is not None and not result <= most)
    )
    if outside:
        raise BadInput(place, result, allowed, hint=hint)
    return result


def pair(place: str, value: object, **limits: Any) -> tuple[float, float]:
    """Return two numbers; `limits` are those of `number`."""
    if isinstance(value, (str, bytes, Mapping)) or not isinstance(value, Iterable):
        raise BadInput(place, value, "two numbers")
    items = list(value)
    if len(items) != 2:
        raise BadInput(place, items, f"two numbers, not {len(items)}")
    return number(f"{place}[0]", items[0], **limits), number(f"{place}[1]", items[1], **limits)


def whole(place: str, value: object, *, least: int, most: int | None = None) -> int:
    """Return an integer within bounds."""
    allowed = f"a whole number {least} to {most}" if most is not None else f"a whole number >= {least}"
    if isinstance(value, bool) or not hasattr(type(value), "__index__"):
        raise BadInput(place, value, allowed)
    result = value.__index__()  # type: ignore[attr-defined]
    if result < least or (most is not None and result > most):
        raise BadInput(place, result, allowed)
    return int(result)


def numbers(place: str, value: object, unit: str = "") -> np.ndarray:
    """Return an array of finite numbers of any shape; its own copy."""
    allowed = " ".join(part for part in ("finite numbers", unit) if part)
    try:
        result = np.array(value, dtype=float)
    except (OverflowError, TypeError, ValueError):
        raise BadInput(place, value, allowed) from None
    if not np.isfinite(result).all():
        raise BadInput(place, Text("a value that is not finite"), allowed)
    return result


def path(place: str, value: object) -> Path:
    """Return the path of a file or folder."""
    if not isinstance(value, (str, os.PathLike)):
        raise BadInput(place, value, "a path")
    return Path(value)


def instance(place: str, value: object, *kinds: type) -> None:
    """Refuse an object of another class."""
    if not isinstance(value, kinds):
        names = [kind.__name__ for kind in kinds]
        raise BadInput(place, value, " or ".join(f"{'an' if name[0] in 'AEIOU' else 'a'} {name}" for name in names))


def flag(place: str, value: object) -> bool:
    """Return true or false."""
    if not isinstance(value, bool):
        raise BadInput(place, value, "true or false")
    return value


def text(place: str, value: object) -> str:
    """Return a text of at least one visible character, on one line."""
    if not isinstance(value, str) or not value.strip() or not value.isprintable():
        raise BadInput(place, value, "a text on one line")
    return value


def choice(place: str, value: object, options: tuple[str, ...]) -> str:
    """Return one of the named options."""
    if not isinstance(value, str) or value not in options:
        raise BadInput(place, value, " or ".join(f'"{o}"' for o in options))
    return value


def table(place: str, value: object) -> dict[str, Any]:
    """Return a TOML table."""
    if not isinstance(value, Mapping):
        raise BadInput(place, value, "a table")
    return dict(value)


def tables(place: str, value: object) -> list[dict[str, Any]]:
    """Return a list of TOML tables."""
    if isinstance(value, Mapping):
        raise BadInput(place, Text("one table"), f"a list of tables, written [[{place}]]")
    if not isinstance(value, list) or not all(isinstance(item, Mapping) for item in value):
        raise BadInput(place, value, f"a list of tables, written [[{place}]]")
    return [dict(item) for item in value]


def keys(place: str, found: Iterable[str], *, required: Iterable[str] = (), optional: Iterable[str] = ()) -> None:
    """Refuse every key that is not known, and the absence of one that is required."""
    required = list(required)
    known = {*required, *optional}
    found = list(found)
    for key in found:
        if key not in known:
            raise unknown_name(place, key, known)
    for key in required:
        if key not in found:
            raise BadInput(f"{place}, {key}" if place else key, _MISSING, f"key {key} is required")
