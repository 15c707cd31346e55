"""Reader of SSP 1.0 (System Structure and Parameterization): `.ssp` archives and bare `.ssd` files."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree

from .. import checks
from ..errors import BadInput, Text, unreadable
from ..fmu.archive import archive, refuse_xml, unpack, xml_root
from ..fmu.isolated_slave import IsolatedSlave
from ..fmu.slave_interface import Partner
from .system import System, couple

ROOT = "SystemStructure.ssd"
NAMESPACES = {
    part: f"http://ssp-standard.org/SSP1/SystemStructure{word}"
    for part, word in (("ssd", "Description"), ("ssc", "Common"), ("ssv", "ParameterValues"), ("ssm", "ParameterMapping"))
} | {"osp": "http://opensimulationplatform.com/SSP/OSPAnnotations", "armrs": "urn:armrs"}
ANNOTATION = "armrs"
"""Type of the annotations that hold what SSP has no words for."""
_DEEPEST = 32
_Node = tuple[str, str]
"""Element, by its path from the root, and connector."""


@dataclass
class _Component:
    source: str
    parameters: dict[str, tuple[Any, str | None]] = field(default_factory=dict)
    connectors: dict[str, str] = field(default_factory=dict)


@dataclass
class _Edge:
    start: _Node
    factor: float
    offset: float
    more: dict[str, str]


@dataclass
class _Flat:
    """A hierarchy of systems as one."""

    folder: Path
    is_sealed: bool
    factors: dict[str, float]
    components: dict[str, _Component] = field(default_factory=dict)
    edges: dict[_Node, _Edge] = field(default_factory=dict)
    given: dict[_Node, tuple[Any, str | None]] = field(default_factory=dict)
    inputs: set[_Node] = field(default_factory=set)

    def file(self, source: str) -> Path:
        """Return the path of a file that is referred to; one of an archive is inside it."""
        path = self.folder / unquote(source.removeprefix("file:"))
        if self.is_sealed and not path.resolve().is_relative_to(self.folder.resolve()):
            raise BadInput("source", source, "a file inside the archive")
        return path


def load_ssp(path: str | os.PathLike[str], *, step: float | None = None, duration: float | None = None) -> System:
    """Read a system from an `.ssp` or `.ssd` file and make its slaves.

    Components are FMUs for co-simulation; systems within systems are taken apart, with names such as `inner/motor`. Connections, linear
    transformations, parameter bindings and mappings are taken over. What else SSP has (signal dictionaries, arrays, components of other
    types, a start other than zero) is refused by name.

    Parameters
    ----------
    path : path
    step : float, optional
        Communication step [s]; when absent, the base step of an annotation of the Open Simulation Platform, or of armrs.
    duration : float, optional
        Length of the run [s]; when absent, the stop time of the default experiment.

    Raises
    ------
    BadInput
        Names the file, the element, what was found and what is allowed.
    """
    source = checks.path("path", path)
    if source.suffix.lower() != ".ssp":
        return _of_file(source, source, step, duration)
    with tempfile.TemporaryDirectory(prefix="armrs-ssp-") as place:
        with archive(source) as files:
            if ROOT not in files.namelist():
                raise BadInput(ROOT, Text("missing"), "a system structure description", file=source)
        unpack(source, Path(place))
        return _of_file(Path(place) / ROOT, source, step, duration)


def _of_file(ssd: Path, named: Path, step: float | None, duration: float | None) -> System:
    made: list[Partner] = []
    try:
        root = _xml(ssd, "ssd", "SystemStructureDescription")
        return _load(root, _Flat(ssd.parent, ssd != named, _factors(root)), made, (step, duration))
    except BaseException as error:
        for slave in made:
            slave.free()
        if not isinstance(error, BadInput):
            raise
        # What was unpacked is named as what is in the archive.
        inside = Path(error.file) if error.file else named
        if ssd != named and inside.is_relative_to(ssd.parent):
            inside = named / inside.relative_to(ssd.parent)
        raise error.within(file=inside) from None


def _load(root: ElementTree.Element, flat: _Flat, made: list[Partner], asked: tuple[float | None, float | None]) -> System:
    top = root.find("ssd:System", NAMESPACES)
    if top is None:
        raise BadInput("ssd:SystemStructureDescription", Text("no System"), "one")
    _take(top, "", flat, 0)
    if not flat.components:
        raise BadInput("System", Text("no components"), "one or more")
    settings, warnings = _settings(root, asked), []
    for name, component in flat.components.items():
        made.append(IsolatedSlave(flat.file(component.source), name=name))
    slaves = {slave.name: slave for slave in made}
    lines, starts = [], {}
    for (name, connector), kind in [((n, c), k) for n, part in flat.components.items() for c, k in part.connectors.items()]:
        found = _origin(flat, (name, connector)) if kind in ("input", "parameter", "inout") else None
        if found is None:
            continue
        if found.start in flat.given:
            value, unit = flat.given[found.start]
            value = found.factor * value + found.offset if isinstance(value, float) else value
            flat.components[name].parameters.setdefault(connector, (value, unit))
        elif found.start[0] in slaves:
            line = {"from": ".".join(found.start), "to": f"{name}.{connector}", **_numbers(found)}
            lines.append(line | found.more)
    for name, component in flat.components.items():
        starts[name], unknown = _starts(slaves[name], component, flat.factors)
        warnings += [f"{name}: the parameter {parameter} matches no variable of the FMU and is ignored" for parameter in unknown]
    warnings += [f"the system's own input {connector} is not driven" for _, connector in sorted(flat.inputs)]
    system = couple(made, lines, starts=starts, **settings)
    return replace(system, warnings=(*system.warnings, *warnings))


def _numbers(edge: _Edge) -> dict[str, float]:
    return {} if (edge.factor, edge.offset) == (1.0, 0.0) else {"factor": edge.factor, "offset": edge.offset}


def _take(system: ElementTree.Element, path: str, flat: _Flat, depth: int) -> None:
    """Take a system and all within it apart."""
    if depth > _DEEPEST:
        raise BadInput(f"System {path}", Text(f"more than {_DEEPEST} nested systems"), "fewer")
    for child in system.iterfind("ssd:Elements/*", NAMESPACES):
        tag, name = child.tag.rpartition("}")[2], _attribute(child, "name")
        inner = f"{path}/{name}" if path else name
        if tag == "System":
            _take(child, inner, flat, depth + 1)
        elif tag == "Component":
            flat.components[inner] = _component(child, inner, flat)
        else:
            raise BadInput(f"Elements, {name}", Text(tag), "Component or System")
    for connector in system.iterfind("ssd:Connectors/ssd:Connector", NAMESPACES):
        if not path and connector.get("kind") == "input":
            flat.inputs.add((path, _attribute(connector, "name")))
    for name, value in _bound(system, path or "System", flat).items():
        part, _, parameter = name.partition(".")
        inner = f"{path}/{part}" if path else part
        if inner in flat.components and parameter:
            flat.components[inner].parameters[parameter] = value
        else:
            flat.given[path, name] = value
            flat.inputs.discard((path, name))
    for connection in system.iterfind("ssd:Connections/ssd:Connection", NAMESPACES):
        _connect(connection, path, flat)


def _component(element: ElementTree.Element, path: str, flat: _Flat) -> _Component:
    kind = element.get("type", "application/x-fmu-sharedlibrary")
    if kind != "application/x-fmu-sharedlibrary":
        raise BadInput(f"Component {path}, type", kind, "application/x-fmu-sharedlibrary")
    if element.get("implementation", "any") not in ("any", "CoSimulation"):
        raise BadInput(f"Component {path}, implementation", element.get("implementation"), "any or CoSimulation")
    connectors = {_attribute(c, "name"): _attribute(c, "kind") for c in element.iterfind("ssd:Connectors/ssd:Connector", NAMESPACES)}
    return _Component(_attribute(element, "source"), _bound(element, path, flat), connectors)


def _connect(element: ElementTree.Element, path: str, flat: _Flat) -> None:
    def node(end: str) -> _Node:
        inner = element.get(f"{end}Element")
        at = path if inner is None else f"{path}/{inner}" if path else inner
        return at, _attribute(element, f"{end}Connector")

    start, end = node("start"), node("end")
    label = f"Connection {'.'.join(start)} -> {'.'.join(end)}"
    if end in flat.edges:
        raise BadInput(label, Text("a second connection to this input"), "one for each input")
    factor, offset = 1.0, 0.0
    for child in element:
        tag = child.tag.rpartition("}")[2]
        if tag == "LinearTransformation":
            factor, offset = (
                checks.number(f"{label}, {key}", _number(child, key, normal)) for key, normal in (("factor", 1.0), ("offset", 0.0))
            )
        elif tag not in ("ConnectionGeometry", "Annotations"):
            raise BadInput(label, Text(tag), "LinearTransformation, or none")
    own = element.find(f"ssd:Annotations/ssc:Annotation[@type='{ANNOTATION}']/armrs:Connection", NAMESPACES)
    flat.edges[end] = _Edge(start, factor, offset, {} if own is None else dict(own.attrib))
    if not start[0]:
        flat.inputs.add(start)


def _origin(flat: _Flat, node: _Node) -> _Edge | None:
    """Follow connections back through the borders of systems to what drives a connector."""
    found: _Edge | None = None
    for _ in range(2 * _DEEPEST):
        edge = flat.edges.get(node)
        if edge is None:
            return found
        if found is None:
            found = replace(edge, more=dict(edge.more))
        else:
            found = _Edge(edge.start, found.factor * edge.factor, found.factor * edge.offset + found.offset, found.more)
        node = edge.start
        if node[0] in flat.components or node in flat.given:
            return found
    raise BadInput(".".join(node), Text("connections in a circle"), "connections that begin at an output")


def _bound(element: ElementTree.Element, label: str, flat: _Flat) -> dict[str, tuple[Any, str | None]]:
    """Return the parameters that are bound to an element: value and unit."""
    found: dict[str, tuple[Any, str | None]] = {}
    for binding in element.iterfind("ssd:ParameterBindings/ssd:ParameterBinding", NAMESPACES):
        place = f"{label}, ParameterBinding"
        if binding.get("type", "application/x-ssp-parameter-set") != "application/x-ssp-parameter-set":
            raise BadInput(place, binding.get("type"), "application/x-ssp-parameter-set")
        values = _referred(binding, "ParameterValues", ("ssv", "ParameterSet"), flat)
        if values is None:
            raise BadInput(place, Text("no parameters"), "a source, or ParameterValues")
        mapping = _referred(binding.find("ssd:ParameterMapping", NAMESPACES), "", ("ssm", "ParameterMapping"), flat)
        factors = flat.factors | _factors(values)
        own = {}
        for parameter in values.iterfind("ssv:Parameters/ssv:Parameter", NAMESPACES):
            name = _attribute(parameter, "name")
            own[binding.get("prefix", "") + name] = _value(parameter, f"{place}, {name}")
        flat.factors.update(factors)
        found |= own if mapping is None else dict(_mapped(own, mapping, place))
    return found


def _referred(element: ElementTree.Element | None, inline: str, root: tuple[str, str], flat: _Flat) -> ElementTree.Element | None:
    """Return what an element has inside, or in a file of its own."""
    if element is None:
        return None
    source = element.get("source")
    if source is not None:
        return _xml(flat.file(source), *root)
    return element.find(f"ssd:{inline}/{root[0]}:{root[1]}" if inline else f"{root[0]}:{root[1]}", NAMESPACES)


def _value(parameter: ElementTree.Element, place: str) -> tuple[Any, str | None]:
    typed = next(iter(parameter), None)
    kind = "nothing" if typed is None else typed.tag.rpartition("}")[2]
    text = "" if typed is None else typed.get("value", "")
    if kind == "Real" and typed is not None:
        return checks.number(place, _number(typed, "value", None)), typed.get("unit")
    if kind == "Integer":
        with contextlib.suppress(ValueError):
            return int(text), None
        raise BadInput(place, text, "a whole number")
    if kind == "Boolean":
        if text not in ("true", "false", "1", "0"):
            raise BadInput(place, text, "true or false")
        return text in ("true", "1"), None
    if kind == "String":
        return text, None
    raise BadInput(place, Text(kind), "Real, Integer, Boolean or String")


def _mapped(
    own: dict[str, tuple[Any, str | None]], mapping: ElementTree.Element, place: str
) -> Iterator[tuple[str, tuple[Any, str | None]]]:
    for entry in mapping.iterfind("ssm:MappingEntry", NAMESPACES):
        if entry.get("source") == "":
            # Some tools list every parameter, and leave empty what is not mapped.
            continue
        source, target = _attribute(entry, "source"), _attribute(entry, "target")
        if source not in own:
            raise BadInput(f"{place}, ParameterMapping", source, "a parameter of the binding")
        value, unit = own[source]
        for child in entry:
            tag = child.tag.rpartition("}")[2]
            if tag != "LinearTransformation" or not isinstance(value, float):
                raise BadInput(f"{place}, ParameterMapping, {source}", Text(tag), "a LinearTransformation of a Real")
            value = _number(child, "factor", 1.0) * value + _number(child, "offset", 0.0)
        yield target, (value, unit)


def _starts(slave: Partner, component: _Component, factors: dict[str, float]) -> tuple[dict[str, Any], list[str]]:
    """Return start values in the units of the variables, and the names that are no variables."""
    found, unknown = {}, []
    for name, (value, unit) in component.parameters.items():
        variable = slave.variables.get(name)
        if variable is None:
            unknown.append(name)
            continue
        if isinstance(value, float) and unit is not None and variable.unit is not None and unit != variable.unit:
            if unit not in factors:
                raise BadInput(f"{slave.name}, {name}", Text(f"in {unit}, which is not described"), f"{variable.unit}, or a unit in Units")
            value *= factors[unit] / variable.scale
        found[name] = (
            float(value) if variable.type.startswith("Float") and isinstance(value, int) and not isinstance(value, bool) else value
        )
    return found, unknown


def _factors(root: ElementTree.Element) -> dict[str, float]:
    """Return the factors of units to base units; those with an offset are left out, and so refused where they are needed."""
    found = {}
    for unit in root.iterfind("*/ssc:Unit", NAMESPACES):
        base = unit.find("ssc:BaseUnit", NAMESPACES)
        if base is not None and _number(base, "offset", 0.0) == 0.0:
            found[_attribute(unit, "name")] = _number(base, "factor", 1.0)
    return found


def _settings(root: ElementTree.Element, asked: tuple[float | None, float | None]) -> dict[str, Any]:
    """Return algorithm, step and duration."""
    experiment = root.find("ssd:DefaultExperiment", NAMESPACES)
    found: dict[str, Any] = {}
    step, duration = asked
    if experiment is not None:
        if (begin := _number(experiment, "startTime", 0.0)) != 0.0:
            raise BadInput("DefaultExperiment, startTime", begin, "0: runs begin at zero")
        if duration is None and experiment.get("stopTime") is not None:
            duration = _number(experiment, "stopTime", None)
        own = experiment.find(f"ssd:Annotations/ssc:Annotation[@type='{ANNOTATION}']/armrs:Run", NAMESPACES)
        if own is not None:
            found |= {key: own.attrib[key] for key in ("algorithm",) if key in own.attrib}
            found |= {key: _number(own, key, None) for key in ("tolerance", "accuracy", "resolution", "shortest_step") if key in own.attrib}
            if "refine" in own.attrib:
                found["refine"] = int(_number(own, "refine", None))
        base = experiment.find(".//osp:FixedStepAlgorithm", NAMESPACES)
        if step is None and base is not None:
            step = _number(base, "baseStepSize", None)
    if step is None:
        raise BadInput("step", Text("nothing"), "a communication step: the file has no annotation baseStepSize, give --step")
    if duration is None:
        raise BadInput("duration", Text("nothing"), "a duration: the file has no stopTime, give --duration")
    return found | {"step": step, "duration": duration}


def _attribute(element: ElementTree.Element, key: str) -> str:
    value = element.get(key)
    if not value:
        raise BadInput(element.tag.rpartition("}")[2], Text(f"no {key}"), f"the attribute {key}")
    return value


def _number(element: ElementTree.Element, key: str, normal: float | None) -> float:
    text = element.get(key)
    try:
        value = normal if text is None else float(text)
    except ValueError:
        value = None
    if value is None:
        raise BadInput(f"{element.tag.rpartition('}')[2]}, {key}", Text(text or "nothing"), "a number")
    return value


def _xml(path: Path, prefix: str, tag: str) -> ElementTree.Element:
    """Read an XML file and refuse any other than the expected one."""
    try:
        content = path.read_bytes()
    except OSError as error:
        raise unreadable(error, file=path) from None
    refuse_xml(path.name, content, path)
    try:
        root = xml_root("XML", content)
    except BadInput as error:
        raise error.within(file=path) from None
    if root.tag != f"{{{NAMESPACES[prefix]}}}{tag}":
        raise BadInput("root", root.tag, f"{prefix}:{tag} of SSP 1.0", file=path)
    return root
