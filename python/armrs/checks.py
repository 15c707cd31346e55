"""Checks of arguments and of values in files. Each returns the value in its final type or raises `BadInput` naming the place."""

from __future__ import annotations

import math
import operator
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

from .errors import BadInput, Text, unknown_name
from .io.files import path as path
from .io.files import with_articles

_MISSING = Text("nothing")
_Kind = TypeVar("_Kind")


def number(
    place: str,
    value: object,
    *,
    unit: str = "",
    above: float | None = None,
    least: float | None = None,
    most: float | None = None,
    below: float | None = None,
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
    above, least, most, below : float, optional
        Bounds: value > above, value >= least, value <= most, value < below.
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
    if below is not None:
        bounds.append(f"< {below:g}")
    allowed = " ".join(part for part in ("a finite number", " and ".join(bounds), unit) if part)
    plain = value.ndim == 0 and value.dtype.kind in "iuf" if isinstance(value, (np.ndarray, np.generic)) else not isinstance(value, bool)
    if not plain or not hasattr(type(value), "__float__"):
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
        or (below is not None and not result < below)
    )
    if outside:
        raise BadInput(place, result, allowed, hint=hint)
    return result


def extent(place: str, value: object, **limits: Any) -> float:
    """Return a number that may be infinite: a bound where there is none; `limits` are those of `number`."""
    if isinstance(value, float) and math.isinf(value) and limits.get("above", -math.inf) < value:
        return value
    return number(place, value, **limits)


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
    try:
        result = operator.index(value)  # type: ignore[arg-type]
    except TypeError:  # arrays have the method, whatever is in them
        raise BadInput(place, value, allowed) from None
    if isinstance(value, bool) or result < least or (most is not None and result > most):
        raise BadInput(place, value, allowed)
    return result


def threads(value: object) -> int:
    """Return a number of threads; as many as there are processors for None."""
    return (os.cpu_count() or 1) if value is None else whole("threads", value, least=1, most=1024)


def bits(place: str, value: object) -> int:
    """Return the bits of a converter over its whole range: no more than a number of the core distinguishes."""
    return whole(place, value, least=1, most=52)


def numbers(place: str, value: object, unit: str = "", *, shape: Sequence[int | None] | None = None) -> np.ndarray:
    """Return an array of finite numbers, its own copy; `shape` as for `samples`."""
    result = samples(place, value, unit, shape=shape, what="finite numbers").copy()
    if not np.isfinite(result).all():
        raise BadInput(place, Text("a value that is not finite"), " ".join(part for part in ("finite numbers", unit) if part))
    return result


def samples(place: str, value: object, unit: str = "", *, shape: Sequence[int | None] | None = None, what: str = "numbers") -> np.ndarray:
    """Return an array of float64, NaN where a sample is missing; the array given when it is one already.

    Parameters
    ----------
    place : str
        Name of the value. Empty for the compiled kernels, which put the name of their argument in front.
    value : object
        Anything that NumPy reads as real numbers. Texts, booleans, times and complex numbers are none, and a masked array is not
        taken for its data.
    unit : str
        Unit, for the message.
    shape : sequence of int or None, optional
        What the shape has to be; None is any length.
    what : str
        What is allowed, for the message.
    """
    allowed = " ".join(part for part in (what, unit) if part)
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise BadInput(place, Text("a masked array"), f"{allowed}: NaN where a sample is missing, by .filled(numpy.nan)")
    try:
        raw = np.asarray(value)
        if raw.dtype == object:  # whole numbers of any length, fractions; each must be a number
            raw = np.array([number(place, item) for item in raw.ravel()]).reshape(raw.shape)
    except (OverflowError, TypeError, ValueError):
        raise _uneven(place, value) or BadInput(place, value, allowed) from None
    if raw.dtype.kind not in "iuf":
        raise BadInput(place, Text(_KINDS.get(raw.dtype.kind, str(raw.dtype))) if raw.ndim else value, allowed)
    if 0 in raw.strides:  # numbers that are held once and shared by views; users copy them
        from ._armrs import require_memory

        require_memory(8 * raw.size)
    result = np.asarray(raw, dtype=float)
    if shape is not None:
        fits = len(shape) == result.ndim and all(want in (None, have) for want, have in zip(shape, result.shape, strict=True))
        if not fits:
            wanted = ", ".join("n" if want is None else str(want) for want in shape)
            raise BadInput(place, Text(f"an array of shape {result.shape}"), f"shape ({wanted}{',' if len(shape) == 1 else ''})")
    return result


def _uneven(place: str, value: object) -> BadInput | None:
    """Return the refusal of rows that differ in length, of which NumPy makes no array; None where that is not it."""
    if not isinstance(value, (list, tuple)) or not all(isinstance(row, (list, tuple)) for row in value):
        return None
    lengths = list(dict.fromkeys(len(row) for row in value))
    return BadInput(place, Text(f"rows of {lengths[0]} and of {lengths[1]} values"), "rows of one length") if len(lengths) > 1 else None


_KINDS = {"U": "texts", "S": "bytes", "b": "booleans", "c": "complex numbers", "M": "dates", "m": "times"}
"""What NumPy's kinds of arrays that are no numbers hold."""


def loaded(place: str, value: object, kind: type[_Kind], load: Callable[[Any], _Kind]) -> _Kind:
    """Return an object of a class, or what the file at a path holds."""
    if isinstance(value, kind):
        return value
    path(place, value, kind)
    return load(value)


def instance(place: str, value: object, *kinds: type) -> None:
    """Refuse an object of another class."""
    if not isinstance(value, kinds):
        raise BadInput(place, value, " or ".join(with_articles(kinds)))


def instances(place: str, value: object, kind: type[_Kind]) -> tuple[_Kind, ...]:
    """Return a sequence of objects of one class."""
    allowed = f"a sequence of {kind.__name__}"
    if isinstance(value, (str, bytes, Mapping)) or not isinstance(value, Iterable):
        raise BadInput(place, value, allowed)
    try:
        items = tuple(value)
    except TypeError:  # an array without a dimension has `__iter__`
        raise BadInput(place, value, allowed) from None
    for k, item in enumerate(items):
        instance(f"{place}[{k}]", item, kind)
    return items


def texts(place: str, value: object, what: str = "names") -> tuple[str, ...]:
    """Return a sequence of texts; one text holds them with commas between them."""
    if not isinstance(value, str):
        return instances(place, value, str)
    parts = tuple(part.strip() for part in value.split(","))
    if not all(parts):
        raise BadInput(place, value, f"{what} with commas between them")
    return parts


def function(place: str, value: object) -> None:
    """Refuse what cannot be called."""
    if not callable(value):
        raise BadInput(place, value, "a function")


def progress(given: Callable[[str, float], None] | None) -> Callable[[str, float], None]:
    """Return the receiver of stages and shares; one without effect where nothing is given."""
    if given is None:
        return lambda stage, share: None
    function("progress", given)
    return given


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
            raise BadInput(f"{place}, {key}" if place else key, _MISSING, f"key {key} is required", kind="missing_key")
