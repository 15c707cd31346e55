"""Numbers, units, symbols and counts as text: for messages, tables and figures."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Any

_UNITS = {"1": "", "Nm": "N m"}


_MOST_DECIMALS = 6
"""With more, a number is written with a power of ten."""


def digits(value: float, count: int = 3) -> str:
    """Write a number with `count` digits, without an exponent below a million.

    >>> digits(2431.4, 2), digits(2.58153e-05)
    ('2400', '2.58e-05')
    """
    return f"{float(f'{value:.{count}g}'):.{max(count, 6)}g}"


def how_many(number: int, what: str, several: str | None = None) -> str:
    """Return a number of things in words: one of them without the plural, which ends in s unless it is given."""
    return f"{number} {what if number == 1 else several or f'{what}s'}"


def probability(value: float) -> str:
    """Write a probability; values below 1e-12 are not distinguished."""
    return "< 1e-12" if value < 1e-12 else f"{value:.2g}"


def minus(text: str) -> str:
    """Return the text of a number with the sign that is as wide as a plus."""
    return text.replace("-", "−")


def symbol(text: str) -> str:
    """Set a sum of products as print does: `m1*l1^2` is m1·l1²."""
    return text.replace("^2", "²").replace("*", "·")


_BELOW = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


_NUMBERED = re.compile(r"(?<![A-Za-z])([mlaIn])([1-9])(?![0-9.])")


def typeset(text: object) -> str:
    """Set names such as `I1 + m1*l1^2` as print does, I₁ + m₁·ℓ₁²: on pages and in figures I and l look different."""
    return _NUMBERED.sub(lambda found: found[1].replace("l", "ℓ") + found[2].translate(_BELOW), symbol(str(text)))


def unit(text: str) -> str:
    """Return a unit as printed."""
    return _UNITS.get(text, text.replace("^2", "²"))


def read_in(held_in: str) -> tuple[float, str]:
    """Return the factor to the unit in which people read what is held in another, and that unit: angles and their speeds in degrees.

    >>> read_in("Nm"), read_in("rad")[1]
    ((1.0, 'N m'), '°')
    """
    degrees = {"rad": "°", "rad/s": "°/s"}.get(held_in)
    return (1.0, unit(held_in)) if degrees is None else (math.degrees(1.0), degrees)


def read_followed(held_in: str) -> tuple[float, str]:
    """As `read_in`, of what is followed over sessions: times are latencies and delays, in milliseconds.

    >>> read_followed("s")
    (1000.0, 'ms')
    """
    return (1000.0, "ms") if held_in == "s" else read_in(held_in)


def with_unit(written: str, held_in: str) -> str:
    """Return a number as written, with its unit: that of an angle stands at the number.

    >>> with_unit("0.57", "°"), with_unit("0.16", "N"), with_unit("2", "")
    ('0.57°', '0.16 N', '2')
    """
    return f"{written}{'' if held_in == '°' else ' '}{held_in}".rstrip()


def number(value: float | None, std: float | None) -> str:
    """Write a value with the digits that its standard deviation leaves meaningful, at least two."""
    if value is None:
        return "–"
    if not std or not std > 0:
        return f"{value:.4g}"
    digits = two_digits(std)
    # Adding zero turns a rounded -0 into 0.
    return f"{round(value, digits) + 0.0:.{digits}f}" if digits <= _MOST_DECIMALS else f"{value:.3g}"


def with_interval(value: Mapping[str, Any], reading: Callable[[str], tuple[float, str]] = read_in) -> str:
    """Return a value with its unit, and the ends of its interval where it has one, to one digit of its standard deviation.

    >>> with_interval({"value": 0.1613, "std": 0.006, "unit": "Nm", "interval": (0.1492, 0.1731)})
    '0.161 N m (95 % interval 0.149 to 0.173)'
    """
    factor, held_in = reading(value["unit"])
    coarse = value["std"] and 10.0 * factor * value["std"]
    text = with_unit(number(factor * value["value"], coarse), held_in)
    if coarse is None or not value.get("interval"):
        return text
    low, high = (number(factor * end, coarse) for end in value["interval"])
    return f"{text} (95 % interval {low} to {high}{'°' if held_in == '°' else ''})"


def spread(std: float | None) -> str:
    """Write a standard deviation with two digits."""
    if std is None:
        return "–"
    digits = two_digits(std) if std > 0 else 0
    return f"{std:.{digits}f}" if std > 0 and digits <= _MOST_DECIMALS else f"{std:.2g}"


def plus_minus(value: float, std: float | None, sign: str = "") -> str:
    """Write a value with its standard deviation, both to the same decimals; with `sign` "+" the sign of what is positive too.

    >>> plus_minus(0.1613, 0.006, "+")
    '+0.1613 ± 0.0060'
    """
    return f"{sign if sign and value >= 0.0 else ''}{number(value, std)} ± {spread(std)}"


def two_digits(std: float) -> int:
    """Decimals that show two digits of a standard deviation."""
    exponent = int(f"{std:.1e}".partition("e")[2])
    return max(0, 1 - exponent)


def parameter_label(course: Mapping[str, Any]) -> str:
    """Name a parameter that is followed, with the number of its joint; a symbol has it already."""
    name, of, movement = str(course["name"]).partition(" in ")
    if course["joint"] is None or course["kind"] in ("segment", "combination"):
        return symbol(name) + of + movement
    return f"{course['kind']} {name}, joint {course['joint']}".replace("_", " ") + of + movement


def percent(share: float | None) -> str:
    """Write a share with two digits; what has none is unknown."""
    return "unknown" if share is None or not math.isfinite(share) else f"{digits(100 * share, 2)} %"
