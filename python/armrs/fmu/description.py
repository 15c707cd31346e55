"""The model description of an FMU, FMI 2.0 or 3.0: capabilities, variables with their units, structure."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any
from xml.etree import ElementTree

from ..errors import BadInput, Text
from .archive import DESCRIPTION, archive, read_xml, xml_root
from .slave_interface import Variable

BASE_UNITS = ("kg", "m", "s", "rad")
_OTHER_UNITS = ("A", "K", "mol", "cd")
_MOST_REFERENCE = 2**32 - 1
_MOST_NUMBERS = 1_000_000
"""Most numbers of one array."""
_TYPES_OF_2 = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean", "String": "String", "Enumeration": "Int32"}


@dataclass(frozen=True)
class Unit:
    """A unit: powers of kg, m, s and rad, or None when the file does not state them, and the factor to base units."""

    name: str
    exponents: tuple[int, ...] | None
    factor: float = 1.0


@dataclass(frozen=True)
class Unknown:
    """An entry of ModelStructure.

    Attributes
    ----------
    kind : {"Output", "ContinuousStateDerivative", "InitialUnknown", "EventIndicator", "ClockedState"}
        In the words of FMI 3.0.
    name : str
        The variable; "?" for one that does not exist.
    dependencies : tuple of str, optional
        Variables that it depends on; None where none are listed, which means all.
    kinds : tuple of str, optional
        One kind of dependency for each.
    """

    kind: str
    name: str
    dependencies: tuple[str, ...] | None = None
    kinds: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Description:
    """Contents of `modelDescription.xml`.

    Attributes
    ----------
    version : str
        "2.0" or "3.0…", as written.
    model_name, token, identifier, tool, text : str
        `token` is the instantiation token of FMI 3.0 or the GUID of FMI 2.0; `identifier` the name of the library.
    flags : dict of str to str
        Attributes of the element CoSimulation.
    interfaces : dict of str to (dict of str to str)
        Attributes of each of CoSimulation, ModelExchange and ScheduledExecution that is offered.
    variables : tuple of Variable
    units : dict of str to Unit
    structure : tuple of Unknown
    experiment : dict of str to str
        Attributes of DefaultExperiment.
    root : Element
        The whole document.
    """

    version: str
    model_name: str
    token: str
    identifier: str
    tool: str
    text: str
    flags: dict[str, str]
    interfaces: dict[str, dict[str, str]]
    variables: tuple[Variable, ...] = field(repr=False)
    units: dict[str, Unit] = field(repr=False)
    structure: tuple[Unknown, ...] = field(repr=False)
    experiment: dict[str, str]
    root: ElementTree.Element = field(repr=False)

    @property
    def fmi(self) -> int:
        """Major version of the standard: 2 or 3."""
        return int(self.version.split(".")[0])

    def unknowns(self, kind: str) -> tuple[Unknown, ...]:
        """Entries of ModelStructure of one kind."""
        return tuple(u for u in self.structure if u.kind == kind)

    def flag(self, name: str) -> bool:
        """Return a capability; what is not written is false."""
        return self.flags.get(name) in ("true", "1")

    def number(self, name: str) -> float | None:
        """Return a capability that is a finite number; None for any other text."""
        return finite(self.flags.get(name))


def read_description(path: str | os.PathLike[str]) -> Description:
    """Read the model description of an FMU.

    Raises
    ------
    BadInput
        For what is no archive, no XML, or no FMU of FMI 2.0 or 3.0.
    """
    with archive(path) as files:
        content = read_xml(files, DESCRIPTION, path)
    try:
        return parse(content)
    except BadInput as error:
        raise error.within(file=path) from None


def parse(content: bytes) -> Description:
    """Read a model description from its bytes."""
    root = xml_root(DESCRIPTION, content)
    version = root.get("fmiVersion", "")
    if root.tag != "fmiModelDescription" or version.split(".")[0] not in ("2", "3"):
        raise BadInput(f"{DESCRIPTION}, fmiVersion", version or Text("none"), "2.0 or 3.0")
    kinds = ("CoSimulation", "ModelExchange", "ScheduledExecution")
    interfaces = {kind: dict(element.attrib) for kind in kinds if (element := root.find(kind)) is not None}
    if not interfaces:
        raise BadInput(DESCRIPTION, Text("no interface"), f"one of {', '.join(kinds)}")
    is_two = version.startswith("2")
    units = {unit.name: unit for unit in _units(root)}
    variables = tuple(_variables_of_2(root, units) if is_two else _variables_of_3(root, units))
    experiment = root.find("DefaultExperiment")
    return Description(
        version=version,
        model_name=root.get("modelName", ""),
        token=root.get("guid" if is_two else "instantiationToken", ""),
        identifier=next(iter(interfaces.values())).get("modelIdentifier", ""),
        tool=root.get("generationTool", ""),
        text=root.get("description", ""),
        flags=interfaces.get("CoSimulation", {}),
        interfaces=interfaces,
        variables=variables,
        units=units,
        structure=tuple(_structure(root, variables, is_two=is_two)),
        experiment={} if experiment is None else dict(experiment.attrib),
        root=root,
    )


def _units(root: ElementTree.Element) -> Iterator[Unit]:
    for element in root.iterfind("UnitDefinitions/Unit"):
        base = element.find("BaseUnit")
        name = element.get("name", "")
        if base is None:
            yield Unit(name, None)
            continue
        powers = tuple(_whole(f"unit {name}, {key}", base.get(key, "0")) for key in (*BASE_UNITS, *_OTHER_UNITS))
        # Powers of other base units are kept, so that they differ from what has none.
        exponents = powers[: len(BASE_UNITS)] if not any(powers[len(BASE_UNITS) :]) else powers
        factor = finite(base.get("factor", "1"))
        if not factor:
            raise BadInput(f"unit {name}, factor", base.get("factor"), "a finite number other than 0")
        yield Unit(name, exponents, factor)


def _variables_of_3(root: ElementTree.Element, units: dict[str, Unit]) -> Iterator[Variable]:
    types = {t.get("name"): t for t in root.iterfind("TypeDefinitions/*")}
    elements = list(root.iterfind("ModelVariables/*"))
    by_reference = {e.get("valueReference"): e for e in elements}
    for element in elements:
        start: str | list[str] | None = element.get("start")
        dimensions = tuple(_dimension(d, by_reference) for d in element.iterfind("Dimension"))
        if math.prod(dimensions) > _MOST_NUMBERS:
            raise BadInput(f"variable {element.get('name')}", Text(f"{math.prod(dimensions)} elements"), f"at most {_MOST_NUMBERS}")
        if element.tag in ("String", "Binary"):
            inner = [child.get("value", "") for child in element.iterfind("Start")]
            start = inner or None
        kind = "Int64" if element.tag == "Enumeration" else element.tag
        yield _variable(element, element, (types.get(element.get("declaredType")), kind, start), units, dimensions)


def _dimension(element: ElementTree.Element, by_reference: dict[str | None, ElementTree.Element]) -> int:
    """Return the length of an array along a dimension, as it is before a structural parameter is changed."""
    text = element.get("start")
    if text is None:
        parameter = by_reference.get(element.get("valueReference"))
        text = None if parameter is None else parameter.get("start")
    return _whole("Dimension", text or "", least=0)


def _variables_of_2(root: ElementTree.Element, units: dict[str, Unit]) -> Iterator[Variable]:
    types = {t.get("name"): t.find("Real") for t in root.iterfind("TypeDefinitions/SimpleType")}
    for element in root.iterfind("ModelVariables/ScalarVariable"):
        typed = next((child for child in element if child.tag in _TYPES_OF_2), None)
        if typed is None:
            raise BadInput(f"variable {element.get('name')}", Text("no type"), f"one of {', '.join(_TYPES_OF_2)}")
        declared = types.get(typed.get("declaredType"))
        yield _variable(element, typed, (declared, _TYPES_OF_2[typed.tag], typed.get("start")), units, ())


def _variable(
    element: ElementTree.Element,
    typed: ElementTree.Element,
    own: tuple[ElementTree.Element | None, str, str | list[str] | None],
    units: dict[str, Unit],
    dimensions: tuple[int, ...],
) -> Variable:
    declared, kind, start = own
    name = element.get("name", "")

    def attribute(key: str) -> str | None:
        value = typed.get(key)
        return value if value is not None or declared is None else declared.get(key)

    unit = attribute("unit")
    known = units.get(unit or "")
    floating = kind.startswith("Float") or typed.tag == "Real"
    return Variable(
        name=name,
        reference=_whole(f"variable {name}, valueReference", element.get("valueReference", ""), least=0, most=_MOST_REFERENCE),
        causality=element.get("causality", "local"),
        variability=element.get("variability") or _variability(element, floating=floating, is_two=element is not typed),
        initial=element.get("initial"),
        type=kind,
        unit=unit,
        exponents=None if known is None else known.exponents,
        scale=1.0 if known is None else known.factor,
        start=_starts(kind, start, name) if dimensions else _start(kind, start, name),
        min=finite(attribute("min")),
        max=finite(attribute("max")),
        nominal=finite(attribute("nominal")) or 1.0,
        description=element.get("description", ""),
        dimensions=dimensions,
    )


def _variability(element: ElementTree.Element, *, floating: bool, is_two: bool) -> str:
    """Return the default of the standards."""
    if is_two:
        return "continuous"
    if element.get("causality") in ("parameter", "calculatedParameter", "structuralParameter"):
        return "fixed"
    return "continuous" if floating else "discrete"


def _starts(kind: str, value: str | list[str] | None, name: str) -> tuple[Any, ...] | None:
    """Return the values of an array; texts stand in elements of their own."""
    return None if value is None else tuple(_start(kind, part, name) for part in (value.split() if isinstance(value, str) else value))


def _start(kind: str, value: str | list[str] | None, name: str) -> Any:
    if value is None:
        return None
    if isinstance(value, list):
        value = value[0]
    if kind in ("String", "Binary"):
        return value
    if kind == "Boolean":
        return value.strip() in ("true", "1")
    if kind.startswith("Float"):
        try:
            return float(value)
        except ValueError:
            raise BadInput(f"variable {name}, start", value, "a number") from None
    return _whole(f"variable {name}, start", value)


def _structure(root: ElementTree.Element, variables: tuple[Variable, ...], *, is_two: bool) -> Iterator[Unknown]:
    if is_two:
        known = dict(enumerate((v.name for v in variables), start=1))
        paths, key = {"Output": "Outputs/", "ContinuousStateDerivative": "Derivatives/", "InitialUnknown": "InitialUnknowns/"}, "index"
    else:
        known = {v.reference: v.name for v in variables}
        kinds = ("Output", "ContinuousStateDerivative", "InitialUnknown", "EventIndicator", "ClockedState")
        paths, key = dict.fromkeys(kinds, ""), "valueReference"
    for kind, folder in paths.items():
        for element in root.iterfind(f"ModelStructure/{folder}{'Unknown' if is_two else kind}"):
            place = f"ModelStructure, {kind}"
            dependencies, kinds_of = element.get("dependencies"), element.get("dependenciesKind")
            yield Unknown(
                kind,
                known.get(_whole(f"{place}, {key}", element.get(key, "")), "?"),
                None if dependencies is None else tuple(known.get(_whole(place, d), "?") for d in dependencies.split()),
                None if kinds_of is None else tuple(kinds_of.split()),
            )


def _whole(place: str, text: str, *, least: int = -(2**63), most: int = 2**64 - 1) -> int:
    """Read a whole number, strictly: no fraction, no exponent."""
    if re.fullmatch(r"\s*[+-]?[0-9]{1,20}\s*", text) and least <= int(text) <= most:
        return int(text)
    limits = f"a whole number from {least} to {most}" if least == 0 and most < 2**63 else "a whole number"
    raise BadInput(place, text or Text("nothing"), limits)


def finite(text: str | None) -> float | None:
    """Return a finite number, or None for any other text."""
    try:
        value = None if text is None else float(text)
    except ValueError:
        return None
    return value if value is None or math.isfinite(value) else None
