"""A system as an archive of SSP 1.0, for OMSimulator, libcosim, ecos, FMPy and others."""

from __future__ import annotations

import os
import tempfile
import zipfile
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from .. import checks
from ..errors import BadInput, Text
from ..fmu.description import BASE_UNITS
from ..fmu.isolated_slave import IsolatedSlave
from ..fmu.slave_interface import Partner, Variable
from ..io import files
from .fmu_export import export_fmu
from .slave import Slave
from .ssp import ANNOTATION, NAMESPACES, ROOT
from .system import Connection, System

_KINDS = {"Float": "Real", "Int": "Integer", "UInt": "Integer", "Boolean": "Boolean", "String": "String"}
_MOMENT = (1980, 1, 1, 0, 0, 0)


def export_ssp(
    system: System,
    path: str | os.PathLike[str],
    *,
    fmi: int = 2,
    libraries: str | os.PathLike[str] | None = None,
    replace: bool = False,
) -> Path:
    """Write a system as an `.ssp` archive: arms are exported as FMUs, FMUs are taken along as they are.

    Algorithm, accuracy and what holds within a step go into annotations, since SSP has no words for them; the communication step also into
    that of the Open Simulation Platform. The same system gives the same bytes.

    Parameters
    ----------
    system : System
    path : path
        The file to write; it ends in `.ssp`.
    fmi : {2, 3}
        Version of the standard of the exported arms. Most tools that read SSP take FMI 2.0.
    libraries : path, optional
        As in `armrs.fmu.export_fmu`.
    replace : bool
        Whether an archive of another tool may be replaced; one of armrs always is.

    Raises
    ------
    BadInput
        For partners that are no arm and no FMU, and connected arrays: SSP 1.0 has none.
    """
    target = checks.path("path", path)
    files.may_replace(target, ".ssp")
    if not checks.flag("replace", replace):
        files.may_replace_archive(target, ".ssp", ROOT, ANNOTATION)
    with tempfile.TemporaryDirectory(prefix="armrs-ssp-") as place:
        content = {}
        for number, slave in enumerate(system.slaves.values(), start=1):
            file = Path(place) / f"{number}.fmu"
            if isinstance(slave, Slave):
                export_fmu(slave, file, fmi=fmi, libraries=libraries)
            elif isinstance(slave, IsolatedSlave):
                file = slave.path
            else:
                kind = type(slave).__name__.lower()
                allowed = "an arm or an FMU: nothing else can be put into an SSP archive"
                raise BadInput(f"[[slave]] {slave.name}", Text(f"a {kind}"), allowed)
            content[_source(number)] = file.read_bytes()
    with files.replacing(target) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, data in {ROOT: _description(system, target.stem), **content}.items():
            info = zipfile.ZipInfo(name, _MOMENT)
            info.compress_type, info.create_system, info.external_attr = zipfile.ZIP_DEFLATED, 3, 0o644 << 16
            packed.writestr(info, data)
    return target


def _source(number: int) -> str:
    return f"resources/{number}.fmu"


def _description(system: System, name: str) -> bytes:
    for prefix, uri in NAMESPACES.items():
        ElementTree.register_namespace(prefix, uri)
    root = _element(None, "ssd:SystemStructureDescription", name=name, version="1.0")
    top = _element(root, "ssd:System", name="system")
    elements = _element(top, "ssd:Elements")
    used = {end for c in system.connections for end in (c.source, c.target)}
    for number, (label, slave) in enumerate(system.slaves.items(), start=1):
        _component(elements, _source(number), slave, ({variable for at, variable in used if at == label}, system.starts.get(label, {})))
    lines = _element(top, "ssd:Connections")
    for connection in system.connections:
        _connection(lines, connection, system)
    _units(root, system)
    experiment = _element(root, "ssd:DefaultExperiment", startTime="0.0", stopTime=repr(system.duration))
    annotations = _element(experiment, "ssd:Annotations")
    algorithm = _element(_element(annotations, "ssc:Annotation", type="com.opensimulationplatform"), "osp:Algorithm")
    _element(algorithm, "osp:FixedStepAlgorithm", baseStepSize=repr(system.step))
    keys = ("algorithm", "tolerance", "accuracy", "refine", "resolution", *(["shortest_step"] if system.varies else []))
    settings = {key: str(getattr(system, key)) for key in keys}
    _element(_element(annotations, "ssc:Annotation", type=ANNOTATION), "armrs:Run", **settings)
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="UTF-8", xml_declaration=True) + b"\n"


def _component(parent: ElementTree.Element, source: str, slave: Partner, needs: tuple[set[str], dict[str, Any]]) -> None:
    connected, starts = needs
    component = _element(
        parent, "ssd:Component", name=slave.name, type="application/x-fmu-sharedlibrary", source=source, implementation="CoSimulation"
    )
    connectors = _element(component, "ssd:Connectors")
    for v in slave.variables.values():
        if v.dimensions and not connected.isdisjoint(v.elements):
            raise BadInput(f"{slave.name}.{v.name}", Text("a connected array"), "scalars: SSP 1.0 has no arrays")
        # An input that nothing drives keeps its start value; FMPy stumbles over its connector.
        is_end = v.causality == "output" or v.name in connected or (v.causality != "local" and v.name in starts)
        if is_end and not v.dimensions and _kind(v) is not None:
            connector = _element(connectors, "ssd:Connector", name=v.name, kind=v.causality)
            _element(connector, f"ssc:{_kind(v)}", **({"unit": v.unit} if v.unit and _kind(v) == "Real" else {}))
    if starts:
        binding = _element(_element(component, "ssd:ParameterBindings"), "ssd:ParameterBinding")
        values = _element(_element(binding, "ssd:ParameterValues"), "ssv:ParameterSet", version="1.0", name="start")
        listing = _element(values, "ssv:Parameters")
        for name, value in starts.items():
            v = slave.variables[name]
            if v.dimensions:
                raise BadInput(f"{slave.name}, [slave.start], {name}", Text("an array"), "scalars: SSP 1.0 has no arrays")
            text = str(value).lower() if isinstance(value, bool) else str(value) if isinstance(value, str) else repr(value)
            unit = {"unit": v.unit} if v.unit and _kind(v) == "Real" else {}
            _element(_element(listing, "ssv:Parameter", name=name), f"ssv:{_kind(v)}", value=text, **unit)


def _connection(parent: ElementTree.Element, connection: Connection, system: System) -> None:
    ends: dict[str, str] = {}
    for key, (name, variable) in (("start", connection.source), ("end", connection.target)):
        ends |= {f"{key}Element": name, f"{key}Connector": variable}
    line = _element(parent, "ssd:Connection", **ends)
    output, given = (system.slaves[name].variables[variable] for name, variable in (connection.source, connection.target))
    # Units are converted by the reader of the file, from the connectors.
    factor = connection.factor * given.scale / output.scale
    if (factor, connection.offset) != (1.0, 0.0):
        _element(line, "ssc:LinearTransformation", factor=repr(factor), offset=repr(connection.offset))
    own = {"within": connection.within} | ({} if connection.dual is None else {"dual": connection.dual})
    _element(_element(_element(line, "ssd:Annotations"), "ssc:Annotation", type=ANNOTATION), "armrs:Connection", **own)


def _units(root: ElementTree.Element, system: System) -> None:
    units: dict[str, Variable] = {}
    for slave in system.slaves.values():
        for v in slave.variables.values():
            if v.unit and v.exponents is not None:
                units.setdefault(v.unit, v)
    if units:
        listing = _element(root, "ssd:Units")
        for name, v in sorted(units.items()):
            powers = {base: str(power) for base, power in zip(BASE_UNITS, v.exponents or (), strict=False) if power}
            factor = {} if v.scale == 1.0 else {"factor": repr(v.scale)}
            _element(_element(listing, "ssc:Unit", name=name), "ssc:BaseUnit", **powers, **factor)


def _kind(v: Variable) -> str | None:
    return next((kind for family, kind in _KINDS.items() if v.type.startswith(family)), None)


def _element(parent: ElementTree.Element | None, tag: str, **attributes: str) -> ElementTree.Element:
    prefix, _, name = tag.partition(":")
    full = f"{{{NAMESPACES[prefix]}}}{name}"
    return ElementTree.Element(full, attributes) if parent is None else ElementTree.SubElement(parent, full, attributes)
