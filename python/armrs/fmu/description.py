"""An FMU as a file: the zip archive, its model description, its variables with their units. FMI 2.0 and 3.0 for co-simulation."""

from __future__ import annotations

import math
import os
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from .. import checks
from ..cosim.partner import Variable
from ..errors import BadInput, Text

DESCRIPTION = "modelDescription.xml"
BASE_UNITS = ("kg", "m", "s", "rad")
_OTHER_UNITS = ("A", "K", "mol", "cd")
_MOST_XML = 64 << 20
_MOST_FILES = 1 << 30
"""Most bytes that are unpacked."""
_TYPES_OF_2 = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean", "String": "String", "Enumeration": "Int32"}


@dataclass(frozen=True)
class Unit:
    """A unit: powers of kg, m, s and rad, or None when the file does not say, and the factor to base units."""

    name: str
    exponents: tuple[int, ...] | None
    factor: float = 1.0


@dataclass(frozen=True)
class Description:
    """What `modelDescription.xml` says.

    Attributes
    ----------
    version : str
        "2.0" or "3.0…", as written.
    model_name, token, identifier, tool, text : str
        `token` is the instantiation token of FMI 3.0 or the GUID of FMI 2.0; `identifier` the name of the library.
    flags : dict of str to str
        Attributes of the element CoSimulation.
    variables : tuple of Variable
    units : dict of str to Unit
    outputs, initial_unknowns : tuple of str
        Names of variables.
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
    variables: tuple[Variable, ...] = field(repr=False)
    units: dict[str, Unit] = field(repr=False)
    outputs: tuple[str, ...]
    initial_unknowns: tuple[str, ...]
    experiment: dict[str, str]
    root: ElementTree.Element = field(repr=False)

    @property
    def fmi(self) -> int:
        """Major version of the standard: 2 or 3."""
        return int(self.version.split(".")[0])

    def flag(self, name: str) -> bool:
        """Return a capability; what is not written is false."""
        return self.flags.get(name) in ("true", "1")

    def number(self, name: str) -> float | None:
        """Return a capability that is a finite number; None for any other text."""
        return _number(self.flags.get(name))


def read_description(path: str | os.PathLike[str]) -> Description:
    """Read the model description of an FMU.

    Raises
    ------
    BadInput
        For what is no archive, no XML, or no co-simulation FMU of FMI 2.0 or 3.0.
    """
    with archive(path) as files:
        try:
            info = files.getinfo(DESCRIPTION)
        except KeyError:
            raise BadInput("archive", Text(f"no {DESCRIPTION}"), f"an FMU with {DESCRIPTION} at its top", file=path) from None
        if info.file_size > _MOST_XML:
            raise BadInput(DESCRIPTION, Text(f"{info.file_size} bytes"), f"at most {_MOST_XML} bytes", file=path)
        content = _content(files, info, path)
    try:
        return parse(content)
    except BadInput as error:
        raise error.within(file=path) from None


def archive(path: str | os.PathLike[str]) -> zipfile.ZipFile:
    """Open an FMU as an archive."""
    try:
        return zipfile.ZipFile(checks.path("path", path))
    except zipfile.BadZipFile as error:
        raise BadInput("archive", Text(str(error)), "an FMU, which is a zip archive", file=path) from None
    except BadInput:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "a name no file can have"
        raise BadInput("file", Text(reason), "an FMU that can be read", file=path) from None


def unpack(path: str | os.PathLike[str], folder: Path) -> None:
    """Unpack an FMU below a folder; names that would leave it and archives of absurd size are refused."""
    with archive(path) as files:
        total = 0
        for info in files.infolist():
            name = info.filename.replace("\\", "/")
            target = (folder / name).resolve()
            if not target.is_relative_to(folder.resolve()):
                raise BadInput("archive", Text(f"the name {info.filename!r}"), "names inside the archive", file=path)
            total += info.file_size
            if total > _MOST_FILES:
                raise BadInput("archive", Text(f"more than {_MOST_FILES} bytes"), "at most that", file=path)
            if name.endswith("/"):
                target.mkdir(parents=True, exist_ok=True)
                continue
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(_content(files, info, path))


def _content(files: zipfile.ZipFile, info: zipfile.ZipInfo, path: str | os.PathLike[str]) -> bytes:
    try:
        return files.read(info)
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, OSError, EOFError, ValueError) as error:
        raise BadInput(info.filename, Text(str(error)), "a file that can be unpacked", file=path) from None
    except Exception as error:  # zlib and lzma have errors of their own
        raise BadInput(info.filename, Text(f"damaged: {error}"), "a file that can be unpacked", file=path) from None


def parse(content: bytes) -> Description:
    """Read a model description from its bytes."""
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise BadInput(DESCRIPTION, Text("a document type"), "XML without one")
    try:
        root = ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        raise BadInput(DESCRIPTION, Text(str(error)), "XML") from None
    version = root.get("fmiVersion", "")
    if root.tag != "fmiModelDescription" or version.split(".")[0] not in ("2", "3"):
        raise BadInput(f"{DESCRIPTION}, fmiVersion", version or Text("none"), "2.0 or 3.0")
    simulation = root.find("CoSimulation")
    if simulation is None:
        raise BadInput(DESCRIPTION, Text("no element CoSimulation"), "an FMU for co-simulation")
    is_two = version.startswith("2")
    units = {unit.name: unit for unit in _units(root)}
    variables = tuple(_variables_of_2(root, units) if is_two else _variables_of_3(root, units))
    outputs, unknowns = _structure(root, variables, is_two=is_two)
    experiment = root.find("DefaultExperiment")
    return Description(
        version=version,
        model_name=root.get("modelName", ""),
        token=root.get("guid" if is_two else "instantiationToken", ""),
        identifier=simulation.get("modelIdentifier", ""),
        tool=root.get("generationTool", ""),
        text=root.get("description", ""),
        flags=dict(simulation.attrib),
        variables=variables,
        units=units,
        outputs=outputs,
        initial_unknowns=unknowns,
        experiment={} if experiment is None else dict(experiment.attrib),
        root=root,
    )


def _units(root: ElementTree.Element) -> Iterator[Unit]:
    for element in root.iterfind("UnitDefinitions/Unit"):
        base = element.find("BaseUnit")
        if base is None:
            yield Unit(element.get("name", ""), None)
            continue
        powers = tuple(int(_number(base.get(name)) or 0) for name in (*BASE_UNITS, *_OTHER_UNITS))
        # Powers of other base units are kept, so that they differ from what has none.
        exponents = powers[: len(BASE_UNITS)] if not any(powers[len(BASE_UNITS) :]) else powers
        factor = _number(base.get("factor"))
        yield Unit(element.get("name", ""), exponents, 1.0 if factor is None else factor)


def _variables_of_3(root: ElementTree.Element, units: dict[str, Unit]) -> Iterator[Variable]:
    types = {t.get("name"): t for t in root.iterfind("TypeDefinitions/*")}
    for element in root.iterfind("ModelVariables/*"):
        start = element.get("start")
        if element.tag == "String":
            inner = element.find("Start")
            start = None if inner is None else inner.get("value")
        # Arrays have no scalar start and cannot be connected.
        kind = element.tag if element.find("Dimension") is None else f"{element.tag}[]"
        yield _variable(element, element, (types.get(element.get("declaredType")), kind, start), units)


def _variables_of_2(root: ElementTree.Element, units: dict[str, Unit]) -> Iterator[Variable]:
    types = {t.get("name"): t.find("Real") for t in root.iterfind("TypeDefinitions/SimpleType")}
    for element in root.iterfind("ModelVariables/ScalarVariable"):
        typed = next((child for child in element if child.tag in _TYPES_OF_2), None)
        if typed is None:
            continue
        declared = types.get(typed.get("declaredType"))
        yield _variable(element, typed, (declared, _TYPES_OF_2[typed.tag], typed.get("start")), units)


def _variable(
    element: ElementTree.Element,
    typed: ElementTree.Element,
    own: tuple[ElementTree.Element | None, str, str | None],
    units: dict[str, Unit],
) -> Variable:
    declared, kind, start = own
    name = element.get("name", "")

    def attribute(key: str) -> str | None:
        value = typed.get(key)
        return value if value is not None or declared is None else declared.get(key)

    unit = attribute("unit")
    known = units.get(unit or "")
    floating = kind.startswith("Float")
    return Variable(
        name=name,
        reference=int(_number(element.get("valueReference")) or 0),
        causality=element.get("causality", "local"),
        variability=element.get("variability", "continuous" if floating else "discrete"),
        initial=element.get("initial"),
        type=kind,
        unit=unit,
        exponents=None if known is None else known.exponents,
        scale=1.0 if known is None else known.factor,
        start=_start(kind, start),
        min=_number(attribute("min")),
        max=_number(attribute("max")),
        nominal=_number(attribute("nominal")) or 1.0,
        description=element.get("description", ""),
    )


def _start(kind: str, value: str | None) -> Any:
    if value is None or kind.endswith("[]"):
        return None
    if kind == "String":
        return value
    if kind == "Boolean":
        return value in ("true", "1")
    number = _number(value)
    return number if number is None or kind.startswith("Float") else int(number)


def _structure(root: ElementTree.Element, variables: tuple[Variable, ...], *, is_two: bool) -> tuple[tuple[str, ...], tuple[str, ...]]:
    if is_two:
        by_index = dict(enumerate((v.name for v in variables), start=1))
        paths, key = ("ModelStructure/Outputs/Unknown", "ModelStructure/InitialUnknowns/Unknown"), "index"
    else:
        by_index = {v.reference: v.name for v in variables}
        paths, key = ("ModelStructure/Output", "ModelStructure/InitialUnknown"), "valueReference"
    found = [tuple(by_index.get(int(_number(e.get(key)) or 0), "?") for e in root.iterfind(path)) for path in paths]
    return found[0], found[1]


def _number(text: str | None) -> float | None:
    try:
        value = None if text is None else float(text)
    except ValueError:
        return None
    return value if value is None or math.isfinite(value) else None
