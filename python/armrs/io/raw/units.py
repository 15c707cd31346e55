"""Spellings of units, with their factors to SI."""

from __future__ import annotations

import math
from dataclasses import dataclass

_DEGREE = math.pi / 180.0
_POUND_FORCE = 4.4482216152605
_KILOGRAM_FORCE = 9.80665
_FOOT_POUND = 0.3048 * _POUND_FORCE


@dataclass(frozen=True)
class Unit:
    """A unit: what it measures, its SI unit as in the names of columns, and the factor to it."""

    dimension: str
    factor: float
    text: str


def _spelled(dimension: str, units: dict[str, float]) -> dict[str, Unit]:
    return {spelling.lower(): Unit(dimension, factor, names.split()[0]) for names, factor in units.items() for spelling in names.split()}


UNITS: dict[str, Unit] = {
    **_spelled("time", {"s sec secs second seconds sek sekunden": 1.0, "min": 60.0}),
    **_spelled("time", {"ms msec millisec milliseconds millisekunden": 1e-3, "µs us μs usec": 1e-6, "ns nsec nanoseconds": 1e-9}),
    **_spelled("angle", {"rad radian radians": 1.0, "deg ° degree degrees": _DEGREE, "mrad": 1e-3}),
    **_spelled("angle", {"deg grad grados gradi graus degré degrés graden stopinje stopnie": _DEGREE}),
    **_spelled("speed", {"rad/s rad_s rads": 1.0, "deg/s °/s deg_s grad/s deg/sec": _DEGREE}),
    **_spelled("force", {"N newton newtons": 1.0, "kN": 1e3, "mN": 1e-3, "daN": 10.0}),
    **_spelled("force", {"kgf kp": _KILOGRAM_FORCE, "lbf lb lbs": _POUND_FORCE}),
    **_spelled("moment", {"Nm N·m N*m N.m N-m Nmeter": 1.0, "kNm": 1e3, "Nmm N·mm N.mm mm.N": 1e-3, "Ncm N·cm": 1e-2}),
    **_spelled("moment", {"ft-lbs ft-lb": _FOOT_POUND}),
    **_spelled("length", {"m meter metre": 1.0, "cm": 1e-2, "mm": 1e-3}),
    **_spelled("voltage", {"V volt": 1.0, "mV": 1e-3, "µV uV μV": 1e-6}),
}  # fmt: skip
"""By spelling in lower case. `grad` is the German word for degree; gons are not measured in laboratories of movement."""


def unit(text: str) -> Unit | None:
    """Return the unit of a spelling, or None for one that is not known.

    >>> unit("kN").factor
    1000.0
    >>> unit("N m").dimension
    'moment'
    """
    return UNITS.get(text.strip().lower().replace(" ", ""))
