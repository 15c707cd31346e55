"""Rules of the standards on a model description, beyond its schema."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator

from ..cosim.partner import Variable
from ..errors import nearest
from . import names
from .description import Description, Unit

Broken = tuple[str, str]
"""Place and text of what is wrong."""

_IDENTIFIER = r"(?:[A-Za-z_][A-Za-z0-9_]*|'(?:[^'\\]|\\.)+')"
_INDEX = r"\[[1-9][0-9]*(?:,[1-9][0-9]*)*\]"
_PATH = rf"{_IDENTIFIER}(?:{_INDEX})?(?:\.{_IDENTIFIER}(?:{_INDEX})?)*"
_STRUCTURED = re.compile(rf"(?:{_PATH}|der\({_PATH}(?:,[1-9][0-9]*)?\))")
_C_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
# Powers of kg, m and s. The radian is left out: not every tool counts it.
_SYMBOLS = {
    "1": (0, 0, 0),
    "kg": (1, 0, 0),
    "m": (0, 1, 0),
    "s": (0, 0, 1),
    "rad": (0, 0, 0),
    "deg": (0, 0, 0),
    "Hz": (0, 0, -1),
    "N": (1, 1, -2),
    "J": (1, 2, -2),
    "W": (1, 2, -3),
    "Pa": (1, -1, -2),
}


def broken(description: Description) -> Iterator[Broken]:
    """Give every rule that a description breaks, with its place."""
    yield from _top(description)
    yield from _units(description)
    yield from _uniqueness(description)
    for variable in description.variables:
        for text in _variable(variable, description):
            yield f"variable {variable.name}", text
    yield from _structure(description)


def _top(description: Description) -> Iterator[Broken]:
    fmi, flags = description.fmi, description.flags
    if fmi == 3 and not re.fullmatch(r"3\.\d+(\.\d+)?(-\w+)?", description.version):
        yield "fmiVersion", f"{description.version!r}, allowed is 3.0"
    if not description.token:
        yield ("instantiationToken" if fmi == 3 else "guid"), "missing"
    if not _C_NAME.fullmatch(description.identifier):
        yield "CoSimulation, modelIdentifier", f"{description.identifier!r}, allowed is a name as in C"
    known = names.CO_SIMULATION[fmi]
    for key in flags:
        if key not in known and ":" not in key and not key.startswith("{"):
            yield "CoSimulation", f"unknown attribute {key}, which importers silently ignore (nearest known: {nearest(key, known)})"
    for key, value in flags.items():
        if key.startswith(("can", "provides", "needs", "has", "might")) and value not in ("true", "false", "0", "1"):
            yield f"CoSimulation, {key}", f"{value!r}, allowed is true or false"
    if "fixedInternalStepSize" in flags and not _positive(flags["fixedInternalStepSize"]):
        yield "CoSimulation, fixedInternalStepSize", f"{flags['fixedInternalStepSize']}, allowed is a positive number of seconds"
    experiment = description.experiment
    if "stepSize" in experiment and not _positive(experiment["stepSize"]):
        yield "DefaultExperiment, stepSize", f"{experiment['stepSize']}, allowed is a positive number of seconds"
    independent = [v.name for v in description.variables if v.causality == "independent"]
    if fmi == 3 and len(independent) != 1:
        yield "ModelVariables", f"{len(independent)} independent variables, allowed is one"
    if fmi == 2 and len(independent) > 1:
        yield "ModelVariables", f"{len(independent)} independent variables, allowed is one at most"
    yield from _attributes(description)


def _attributes(description: Description) -> Iterator[Broken]:
    known = names.VARIABLE[description.fmi]
    for element in description.root.iterfind("ModelVariables/*"):
        parts = [element, *(child for child in element if description.fmi == 2 and child.tag != "Annotations")]
        for key in {key for part in parts for key in part.attrib}:
            if key not in known and ":" not in key and not key.startswith("{"):
                yield f"variable {element.get('name')}", f"unknown attribute {key} (nearest known: {nearest(key, known)})"


def _units(description: Description) -> Iterator[Broken]:
    for name, count in Counter(u.get("name") for u in description.root.iterfind("UnitDefinitions/Unit")).items():
        if count > 1:
            yield f"unit {name}", "defined more than once"
    for unit in description.units.values():
        expected = dimension(unit.name)
        if expected is not None and unit.exponents is not None and tuple(unit.exponents[:3]) != expected:
            yield f"unit {unit.name}", f"{_powers(unit)}, {unit.name} has {_powers(Unit(unit.name, expected))}"


def dimension(name: str) -> tuple[int, int, int] | None:
    """Return the powers of kg, m and s of a unit written as in Modelica, or None for one that is not known."""
    powers = [0, 0, 0]
    parts = name.strip().split("/")
    if len(parts) > 2:
        return None
    for part, sign in zip(parts, (1, -1), strict=False):
        for factor in re.split(r"[.* ·]", part.strip("()")):
            match = re.fullmatch(r"(1|[A-Za-z]+)\^?(-?\d+|²|³)?", factor)
            if match is None or match[1] not in _SYMBOLS:
                return None
            power = {"²": 2, "³": 3, None: 1}.get(match[2]) or int(match[2])
            powers = [p + sign * power * own for p, own in zip(powers, _SYMBOLS[match[1]], strict=True)]
    return powers[0], powers[1], powers[2]


def _powers(unit: Unit) -> str:
    pairs = zip(("kg", "m", "s"), unit.exponents or (), strict=False)
    return " ".join(f"{base}^{power}" for base, power in pairs if power) or "no base unit"


def _uniqueness(description: Description) -> Iterator[Broken]:
    for name, count in Counter(v.name for v in description.variables).items():
        if count > 1:
            yield f"variable {name}", f"{count} variables have this name, allowed is one"
    by_reference: dict[tuple[str, int], list[Variable]] = {}
    for variable in description.variables:
        key = ("", variable.reference) if description.fmi == 3 else (variable.type, variable.reference)
        by_reference.setdefault(key, []).append(variable)
    for (_, reference), group in by_reference.items():
        if len(group) < 2:
            continue
        listing = ", ".join(v.name for v in group)
        # In FMI 2.0 these are aliases of one value: at most one may be set, and what they say of it must agree.
        settable = [v for v in group if v.causality in ("input", "parameter") or v.start is not None]
        if description.fmi == 3 or len(settable) > 1 or len({v.unit for v in group}) > 1:
            yield f"variables {listing}", f"share the value reference {reference}"


def _variable(v: Variable, description: Description) -> Iterator[str]:
    allowed = names.VARIABILITIES.get(v.causality)
    if allowed is None:
        yield f"causality {v.causality!r}, allowed are {', '.join(names.VARIABILITIES)}"
    elif v.variability not in allowed and not (description.fmi == 3 and v.causality == "independent"):
        yield f"causality {v.causality} with variability {v.variability}, allowed is {' or '.join(allowed)}"
    if v.variability == "continuous" and not v.type.startswith("Float"):
        yield f"variability continuous of the type {v.type}, allowed are floating point numbers"
    if not v.type.endswith("[]") and v.type not in ("Clock", "Binary"):
        yield from _start(v, description.fmi)
    if v.unit is not None and v.unit not in description.units:
        yield f"the unit {v.unit!r} is not defined"
    convention = description.root.get("variableNamingConvention", "flat")
    if convention == "structured" and not _STRUCTURED.fullmatch(v.name):
        yield "no structured name, such as body[1].m"


def _start(v: Variable, fmi: int) -> Iterator[str]:
    initial = v.initial
    if initial is None:
        exact = v.causality in ("parameter", "structuralParameter") or v.variability == "constant"
        initial = "exact" if exact else ("none" if v.causality in ("input", "independent") else "calculated")
    needs = v.causality in ("input", "parameter", "structuralParameter") or initial in ("exact", "approx")
    if needs and v.start is None:
        yield f"no start value; {v.causality} with initial {initial} has one"
    if v.start is not None and (initial == "calculated" or v.causality == "independent"):
        yield f"start is {v.start}, allowed is none where the value is calculated"
    for low, value, high in ((v.min, v.start, v.max), (v.min, v.max, None)):
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            continue
        if (low is not None and value < low) or (high is not None and value > high):
            word = "start" if value is v.start else "max"
            yield f"{word} is {value}, allowed is {-math.inf if low is None else low} to {math.inf if high is None else high}"


def _structure(description: Description) -> Iterator[Broken]:
    outputs = {v.name for v in description.variables if v.causality == "output"}
    listed = set(description.outputs)
    for name in sorted(outputs - listed):
        yield "ModelStructure", f"the output {name} is not listed"
    for name in sorted(listed - outputs):
        yield "ModelStructure", f"{name} is listed as output and is none"
    calculated = {
        v.name
        for v in description.variables
        if (v.causality == "output" and v.variability != "constant" and v.initial in (None, "approx", "calculated"))
        or v.causality == "calculatedParameter"
    }
    unknowns = set(description.initial_unknowns)
    for name in sorted(calculated - unknowns):
        yield "ModelStructure", f"{name} is calculated at the start and is not listed as InitialUnknown"
    if "?" in unknowns:
        yield "ModelStructure", "an InitialUnknown that is no variable"


def _positive(text: str) -> bool:
    try:
        value = float(text)
    except ValueError:
        return False
    return value > 0 and math.isfinite(value)
