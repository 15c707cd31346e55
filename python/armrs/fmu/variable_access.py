"""Tests of variables: start values, and which can be set and read."""

from __future__ import annotations

import ctypes
import math
from typing import Any

from ..errors import SlaveError
from .imported_slave import ImportedSlave
from .probe_context import ProbeContext, same
from .slave_interface import Variable

_ROUNDED = 1e-12
"""Relative difference of a start value that a decimal number with 15 digits may cause."""


def settable_at_start(probe: ProbeContext) -> list[Variable]:
    """Return inputs and parameters with start values; structural parameters need the configuration mode."""
    return [v for v in probe.readable("input", "parameter") if v.start is not None]


def set_all(probe: ProbeContext, slave: ImportedSlave, variables: list[Variable], when: str) -> None:
    """Set variables to their own start values."""
    for v in variables:
        try:
            slave.set(v.name, _given(v))
        except SlaveError as error:  # noqa: PERF203 (every variable is tried)
            probe.find(f"variable {v.name}", f"its own start value cannot be set {when}: {error}", sort=f"set {when}")


def _given(v: Variable) -> Any:
    """Return the start value in the shape that `set` takes; one value may stand for a whole array."""
    if not v.dimensions:
        return v.start
    return list(v.start) * (v.size if len(v.start) == 1 else 1)


def starts(probe: ProbeContext, slave: ImportedSlave) -> None:
    """Compare the values in the library with those of the description."""
    exact = [v for v in probe.readable() if v.start is not None and v.causality != "independent" and _initial_of(v) == "exact"]
    for v in exact:
        try:
            found, said = slave.values(v.name), v.start if v.dimensions else (v.start,)
        except SlaveError as error:
            probe.find(f"variable {v.name}", f"cannot be read: {error}", sort="unreadable")
            continue
        if len(said) == 1:
            said = said * len(found)
        if len(said) != len(found):
            probe.find(f"variable {v.name}", f"start has {len(said)} values, but its dimensions require {len(found)}", sort="start size")
        elif not all(_as_described(v, a, b) for a, b in zip(found, said, strict=True)):
            shown = (v.start, found) if v.dimensions else (v.start, found[0])
            probe.find(f"variable {v.name}", f"start is {shown[0]!r} in the description and {shown[1]!r} in the library", sort="start")


def _as_described(v: Variable, found: Any, said: Any) -> bool:
    if not v.type.startswith("Float"):
        return bool(found == said)
    if v.type == "Float32":
        return bool(ctypes.c_float(said).value == found) or math.isclose(found, said, rel_tol=1e-6)
    return same(found, said) or math.isclose(found, said, rel_tol=_ROUNDED)


def reads(probe: ProbeContext, slave: ImportedSlave) -> None:
    """Read every variable."""
    probe.step("reading every variable")
    for v in probe.readable():
        try:
            slave.values(v.name)
        except SlaveError as error:  # noqa: PERF203
            probe.find(f"variable {v.name}", f"cannot be read after the initialization: {error}", sort="unreadable")


def _initial_of(v: Variable) -> str:
    """Return where a start value comes from, with the default of the standards."""
    if v.initial is not None:
        return v.initial
    exact = v.causality in ("input", "parameter", "structuralParameter") or v.variability == "constant"
    return "exact" if exact else "calculated"
