"""Rules of the standards for a model description that its schema cannot express."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterator
from xml.etree import ElementTree

from ..errors import nearest
from . import clocks, standard_names, structure_rules
from .description import Description, Unit, finite
from .slave_interface import Variable

Broken = tuple[str, str]
"""Place and text of what is wrong."""

# Quoted names have letters, digits and marks of ASCII alone (FMI 2.0.5 section 2.2.9; FMPy takes the same rule for FMI 3.0).
_IDENTIFIER = r"""(?:[A-Za-z_][A-Za-z0-9_]*|'(?:[A-Za-z0-9_!#$%&()*+,\-./:;<>=?@\[\]^{}|~ ]|\\['"?\\abfnrtv])+')"""
_INDEX = r"\[[0-9]+(?:,[0-9]+)*\]"
_PATH = rf"{_IDENTIFIER}(?:{_INDEX})?(?:\.{_IDENTIFIER}(?:{_INDEX})?)*"
_STRUCTURED = re.compile(rf"(?:{_PATH}|der\({_PATH}(?:,[1-9][0-9]*)?\))")
_WHOLE = re.compile(r"U?Int\d+")
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
    yield from _references(description)
    yield from structure_rules.broken(description)
    yield from clocks.broken(description)


def _top(description: Description) -> Iterator[Broken]:
    fmi = description.fmi
    if fmi == 3 and not re.fullmatch(r"3\.\d+(\.\d+)?(-\w+)?", description.version):
        yield "fmiVersion", f"{description.version!r}, allowed is 3.0"
    token = _token(description)
    if token not in description.root.attrib:
        yield token, "missing"
    if not description.model_name:
        yield "modelName", "missing"
    for kind, attributes in description.interfaces.items():
        if not _C_NAME.fullmatch(attributes.get("modelIdentifier", "")):
            yield f"{kind}, modelIdentifier", f"{attributes.get('modelIdentifier', '')!r}, allowed is a C identifier"
    for kind, known in (("CoSimulation", standard_names.CO_SIMULATION[fmi]), ("ModelExchange", standard_names.MODEL_EXCHANGE[fmi])):
        for key in description.interfaces.get(kind, ()):
            if key not in known and ":" not in key and not key.startswith("{") and (hint := nearest(key, known)):
                yield kind, f"unknown attribute {key}, which importers silently ignore (nearest known: {hint})"
    yield from _flags(description)
    yield from _experiment(description.experiment)
    independent = [v.name for v in description.variables if v.causality == "independent"]
    if fmi == 3 and len(independent) != 1:
        yield "ModelVariables", f"{len(independent)} independent variables, allowed is one"
    if fmi == 2 and len(independent) > 1:
        yield "ModelVariables", f"{len(independent)} independent variables, allowed is one at most"
    yield from _attributes(description)


def _token(description: Description) -> str:
    return "instantiationToken" if description.fmi == 3 else "guid"


def _flags(description: Description) -> Iterator[Broken]:
    flags = description.flags
    for key, value in flags.items():
        if key.startswith(("can", "provides", "needs", "has", "might")) and value not in ("true", "false", "0", "1"):
            yield f"CoSimulation, {key}", f"{value!r}, allowed is true or false"
    if "fixedInternalStepSize" in flags and not _positive(flags["fixedInternalStepSize"]):
        yield "CoSimulation, fixedInternalStepSize", f"{flags['fixedInternalStepSize']}, allowed is a positive number of seconds"
    state = "State" if description.fmi == 3 else "state"
    if description.flag(f"canSerializeFMU{state}") and not description.flag(f"canGetAndSetFMU{state}"):
        yield "CoSimulation", f"canSerializeFMU{state} without canGetAndSetFMU{state}"
    order = flags.get("maxOutputDerivativeOrder", "0")
    if not order.strip().isdigit():
        yield "CoSimulation, maxOutputDerivativeOrder", f"{order!r}, allowed is a whole number from 0"


def _experiment(experiment: dict[str, str]) -> Iterator[Broken]:
    for key in ("stepSize", "tolerance"):
        if key in experiment and not _positive(experiment[key]):
            yield f"DefaultExperiment, {key}", f"{experiment[key]}, allowed is a positive number"
    times = {key: finite(experiment[key]) for key in ("startTime", "stopTime") if key in experiment}
    for key, value in times.items():
        if value is None:
            yield f"DefaultExperiment, {key}", f"{experiment[key]}, allowed is a finite number of seconds"
    start, stop = times.get("startTime", 0.0), times.get("stopTime")
    if start is not None and stop is not None and stop < start:
        yield "DefaultExperiment, stopTime", f"{stop} s, before the start at {start} s"


def _references(description: Description) -> Iterator[Broken]:
    """Compare what variables refer to with what there is: declared types, display units, derivatives, clocks."""
    root, fmi = description.root, description.fmi
    path = "TypeDefinitions/SimpleType" if fmi == 2 else "TypeDefinitions/*"
    types = {t.get("name"): t for t in root.iterfind(path)}
    for name, count in Counter(t.get("name") for t in root.iterfind(path)).items():
        if count > 1:
            yield f"type {name}", "defined more than once"
    displays = {u.get("name"): {d.get("name") for d in u.iterfind("DisplayUnit")} for u in root.iterfind("UnitDefinitions/Unit")}
    for name, t in types.items():
        inner = next(iter(t), t) if fmi == 2 else t
        if inner.get("unit") is not None and inner.get("unit") not in displays:
            yield f"type {name}", f"the unit {inner.get('unit')!r} is not defined"
    variables = {v.name: v for v in description.variables}
    by_reference = {str(v.reference): v for v in description.variables}
    for element in root.iterfind("ModelVariables/*"):
        name = element.get("name", "")
        typed = element if fmi == 3 else next((c for c in element if c.tag not in ("Annotations",)), element)
        for text in _refers(typed, types, displays, fmi):
            yield f"variable {name}", text
        derivative = typed.get("derivative")
        if derivative is not None and name in variables:
            state = _state(derivative, description, by_reference)
            if state is None:
                yield f"variable {name}", f"derivative refers to {derivative}, which is not a variable"
            elif not state.type.startswith("Float"):
                yield f"variable {name}", f"derivative of {state.name}, which is not a floating point number"


def _state(text: str, description: Description, by_reference: dict[str, Variable]) -> Variable | None:
    if description.fmi == 3:
        return by_reference.get(text.strip())
    index = int(text) if text.strip().isdigit() else 0
    return description.variables[index - 1] if 1 <= index <= len(description.variables) else None


def _refers(
    typed: ElementTree.Element, types: dict[str | None, ElementTree.Element], displays: dict[str | None, set[str | None]], fmi: int
) -> Iterator[str]:
    declared = typed.get("declaredType")
    inner = None
    if declared is not None:
        if declared not in types:
            yield f"declaredType {declared!r} is not defined"
        else:
            t = types[declared]
            inner = next(iter(t), t) if fmi == 2 else t
            tag = inner.tag if fmi == 2 else inner.tag.removesuffix("Type")
            if tag != typed.tag:
                yield f"declaredType {declared!r} is a type of {tag}, but the variable is {typed.tag}"
    elif typed.tag == "Enumeration":
        yield "an Enumeration without declaredType"
    unit = typed.get("unit") or (None if inner is None else inner.get("unit"))
    shown = typed.get("displayUnit")
    if shown is not None and unit is None:
        yield f"displayUnit {shown!r} without a unit"
    elif shown is not None and unit in displays and shown not in displays[unit] and shown != unit:
        yield f"displayUnit {shown!r} is not defined for {unit!r}"


def _attributes(description: Description) -> Iterator[Broken]:
    known = standard_names.VARIABLE[description.fmi]
    for element in description.root.iterfind("ModelVariables/*"):
        parts = [element, *(child for child in element if description.fmi == 2 and child.tag != "Annotations")]
        for key in {key for part in parts for key in part.attrib}:
            if key not in known and ":" not in key and not key.startswith("{") and (hint := nearest(key, known)):
                yield f"variable {element.get('name')}", f"unknown attribute {key} (nearest known: {hint})"


def worth_knowing(description: Description) -> Iterator[Broken]:
    """Give what is no error, and not what the standard has either: attributes that are not in the standard."""
    if not description.token and _token(description) in description.root.attrib:
        yield _token(description), "empty: nothing ties the description to the library"
    known = standard_names.CO_SIMULATION[description.fmi]
    for key in description.flags:
        if key not in known and ":" not in key and not key.startswith("{") and nearest(key, known) is None:
            yield "CoSimulation", f"unknown attribute {key}, which importers ignore"
    # Forbidden since FMI 2.0.1 alone, and tools from before that are in use.
    aliases: dict[tuple[str, int], list[Variable]] = {}
    for variable in description.variables if description.fmi == 2 else ():
        aliases.setdefault((variable.type, variable.reference), []).append(variable)
    for group in aliases.values():
        if len({v.variability for v in group}) > 1:
            yield f"variables {', '.join(v.name for v in group)}", "share a value reference with different variabilities"


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
        # In FMI 2.0 these are aliases of one value: at most one may be set, and they have one unit or none (section 2.2.7).
        settable = [v.name for v in group if v.causality in ("input", "parameter") or (v.start is not None and v.variability != "constant")]
        constants = {v.start for v in group if v.variability == "constant"}
        units = {v.unit for v in group}
        if description.fmi == 3:
            yield f"variables {listing}", f"share the value reference {reference}, allowed is one variable for each"
        elif len(settable) > 1:
            yield f"variables {listing}", f"share the value reference {reference}, and {len(settable)} of them have a start or can be set"
        elif len(constants) > 1:
            yield f"variables {listing}", f"share the value reference {reference}, and are constants with different start values"
        elif len(units) > 1:
            shown = ", ".join(sorted(repr(u) if u else "none" for u in units))
            yield f"variables {listing}", f"share the value reference {reference} with different units: {shown}"


def _variable(v: Variable, description: Description) -> Iterator[str]:
    fmi = description.fmi
    allowed = standard_names.VARIABILITIES.get(v.causality)
    if allowed is None or (fmi == 2 and v.causality == "structuralParameter"):
        yield f"causality {v.causality!r}, allowed are {', '.join(standard_names.VARIABILITIES)}"
    elif v.variability not in allowed:
        yield f"causality {v.causality} with variability {v.variability}, allowed is {' or '.join(allowed)}"
    elif v.initial is not None and v.initial not in (initials := standard_names.initials(fmi, v.causality, v.variability)):
        kinds = " or ".join(initials) or "none"
        yield f"initial {v.initial} with causality {v.causality} and variability {v.variability}, allowed is {kinds}"
    if v.variability == "continuous" and not v.type.startswith("Float"):
        yield f"variability continuous for type {v.type}, allowed only for floating point numbers"
    if v.causality == "independent" and not v.type.startswith("Float"):
        yield f"the independent variable is of type {v.type}, allowed is a floating point number"
    if v.type not in ("Clock", "Binary"):
        yield from _start(v)
    if v.unit is not None and v.unit not in description.units:
        yield f"the unit {v.unit!r} is not defined"
    if not v.name or any(c in v.name for c in "\r\n\t"):
        yield "a name that is empty or contains a line break or a tab"
    convention = description.root.get("variableNamingConvention", "flat")
    if convention == "structured" and not _STRUCTURED.fullmatch(v.name):
        yield "not a structured name such as body[1].m or 'body 1'.m, with ASCII letters, digits and punctuation only"


def _start(v: Variable) -> Iterator[str]:
    initial = v.initial
    if initial is None:
        exact = v.causality in ("parameter", "structuralParameter") or v.variability == "constant"
        initial = "exact" if exact else ("none" if v.causality in ("input", "independent") else "calculated")
    needs = v.causality in ("input", "parameter", "structuralParameter") or initial in ("exact", "approx")
    if needs and v.start is None:
        yield f"no start value, which causality {v.causality} with initial {initial} requires"
    if v.start is not None and (initial == "calculated" or v.causality == "independent"):
        yield f"start is {v.start}, allowed is none where the value is calculated"
    if v.dimensions and v.start is not None and len(v.start) not in (1, v.size):
        yield f"start has {len(v.start)} values, but its dimensions require {v.size}"
    yield from _limits(v)


def _limits(v: Variable) -> Iterator[str]:
    low = -math.inf if v.min is None else v.min
    high = math.inf if v.max is None else v.max
    if low > high:
        yield f"max is {v.max}, allowed is at least min, {v.min}"
        return
    for value in v.start if v.dimensions and v.start else (v.start,):
        if not isinstance(value, bool) and isinstance(value, (int, float)) and not low <= value <= high:
            yield f"start is {value}, allowed is {low} to {high}"
    if _WHOLE.fullmatch(v.type) and isinstance(v.start, int):
        bits, signed = int(v.type.lstrip("UInt")), v.type.startswith("I")
        least = -(2 ** (bits - 1)) if signed else 0
        if not least <= v.start < least + 2**bits:
            yield f"start is {v.start}, allowed for type {v.type} is {least} to {least + 2**bits - 1}"


def _positive(text: str) -> bool:
    value = finite(text)
    return value is not None and value > 0
