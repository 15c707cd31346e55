"""SYSTEM.toml: which slaves are coupled, how, and for how long."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .. import checks
from ..errors import BadInput, Text, unknown_name
from ..fmu.isolated_slave import IsolatedSlave
from ..fmu.slave_interface import Partner, Variable
from ..io import tomlfile
from .haptic_wall import Wall
from .slave import Slave
from .sources_and_controllers import from_table

ALGORITHMS = ("jacobi", "gauss-seidel", "iterated")
KINDS = ("model", "fmu", "wall", "signal", "pid", "impedance")
"""What a slave of SYSTEM.toml can be."""
WITHIN = ("start", "mean", "end")
_OPTIONAL = ("algorithm", "tolerance", "accuracy", "refine", "resolution_s", "shortest_step_s")
RESOLUTION = 0.25e-3
"""Default of the shortest event of a partner that a good run must not miss [s]: the inner step of arms."""
_POWER = (1, 2, -3)
_MOST_STEPS = 10_000_000
"""Most communication steps of a run: every one of them is kept."""
_FORCES = ((1, 1, -2), (1, 2, -2))
"""Powers of kg, m and s of forces and torques."""


@dataclass(frozen=True)
class Connection:
    """One output that drives one input.

    Attributes
    ----------
    source, target : (str, str)
        Names of slave and variable.
    within : {"start", "mean", "end"}
        Which value of the output holds during a step, where the algorithm lets choose.
    dual : str, optional
        Variable of the target slave that makes a power with this input: a velocity for a force.
    sign : float
        +1 when input times dual is power into the target slave, −1 when it is power out of it.
    factor, offset : float
        What the output is multiplied by, its unit turned into that of the input included, and what is added then.
    """

    source: tuple[str, str]
    target: tuple[str, str]
    within: str
    dual: str | None = None
    sign: float = 1.0
    factor: float = 1.0
    offset: float = 0.0

    @property
    def label(self) -> str:
        """Both ends, for people."""
        return f"{'.'.join(self.source)} -> {'.'.join(self.target)}"


@dataclass(frozen=True)
class System:
    """Slaves, connections and how they are run.

    Attributes
    ----------
    slaves : dict of str to Partner
        In the order in which they are stepped.
    connections : tuple of Connection
    starts : dict of str to dict
        Values to be set before the initialization, by slave.
    algorithm : {"jacobi", "gauss-seidel", "iterated"}
    step, duration : float
        Communication step and length of the run [s].
    shortest_step : float, optional
        With it, steps between this and `step` are chosen so that their errors stay within the accuracy [s].
    grid : tuple of float
        Communication points that are given [s]; none where they follow from the steps.
    tolerance : float
        What the iteration may leave at the interface, relative to the larger of nominal and present value.
    accuracy : float
        Error that a good run may have at the interface and in the angles of arms, relative to the largest change of each variable.
    refine : int
        How often the step may be halved to reach it.
    resolution : float
        Shortest event of a partner that a good run must not miss [s].
    warnings : tuple of str
    """

    slaves: dict[str, Partner]
    connections: tuple[Connection, ...]
    starts: dict[str, dict[str, Any]] = field(default_factory=dict)
    algorithm: str = "gauss-seidel"
    step: float = 1e-3
    duration: float = 1.0
    tolerance: float = 1e-6
    accuracy: float = 0.01
    refine: int = 0
    resolution: float = RESOLUTION
    shortest_step: float | None = None
    grid: tuple[float, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def varies(self) -> bool:
        """Whether steps may have different lengths."""
        return self.shortest_step is not None

    @property
    def unconnected(self) -> list[str]:
        """Inputs that nothing drives and that were given no start value, but for derivatives of others; they keep their own."""
        driven = {c.target for c in self.connections} | {(name, v) for name, given in self.starts.items() for v in given}
        return [
            f"{name}.{v.name}"
            for name, slave in self.slaves.items()
            for v in slave.variables.values()
            if v.causality == "input"
            and not v.name.startswith("der(")
            and not any((name, element) in driven for element in [v.name, *v.elements])
        ]

    @property
    def count(self) -> int:
        """Number of communication steps, the last perhaps a shorter one."""
        return max(1, math.ceil(self.duration / self.step - 1e-6))

    def free(self) -> None:
        """Free every slave."""
        for slave in self.slaves.values():
            slave.free()


def couple(
    slaves: Iterable[Partner],
    connections: Iterable[tuple[str, str] | Mapping[str, Any]],
    *,
    algorithm: str = "gauss-seidel",
    step: float = 1e-3,
    duration: float = 1.0,
    tolerance: float = 1e-6,
    accuracy: float = 0.01,
    refine: int = 0,
    resolution: float = RESOLUTION,
    shortest_step: float | None = None,
    starts: Mapping[str, Mapping[str, Any]] | None = None,
) -> System:
    """Make a system of slaves and connections, and check that they fit together.

    Parameters
    ----------
    slaves : iterable of Partner
        Stepped in this order.
    connections : iterable
        Pairs `("robot.F", "arm.handle.F")`, or tables with the keys of `[[connection]]`. A name without index stands for all of its
        indices.
    algorithm, step, duration, tolerance, accuracy, refine, resolution, shortest_step
        As in `System`.
    starts : mapping, optional
        Values to be set before the initialization, by slave and variable.

    Raises
    ------
    BadInput
        For names that are not known, units that do not match, an input that is driven twice.
    """
    named: dict[str, Partner] = {}
    for slave in slaves:
        if slave.name in named:
            raise BadInput("[[slave]], name", slave.name, "a name for each slave")
        named[slave.name] = slave
    warnings: list[str] = []
    joined: list[Connection] = []
    for number, item in enumerate(connections, start=1):
        table = dict(item) if isinstance(item, Mapping) else {"from": item[0], "to": item[1]}
        try:
            joined += _connections(table, named, warnings)
        except BadInput as error:
            raise error.within(place=f"[[connection]] {number}") from None
    seen: set[tuple[str, str]] = set()
    for connection in joined:
        if connection.target in seen:
            raise BadInput("[[connection]]", Text(f"two connections to {'.'.join(connection.target)}"), "one for each input")
        seen.add(connection.target)
    step = checks.number("[system], step_s", step, above=0.0, unit="s")
    duration = checks.number("[system], duration_s", duration, least=step, unit="s", hint="at least one step")
    if shortest_step is not None:
        shortest_step = checks.number("[system], shortest_step_s", shortest_step, above=0.0, most=step, unit="s")
        for fixed in (slave.name for slave in named.values() if not slave.can_vary_step):
            raise BadInput("[system], shortest_step_s", shortest_step, f"none, for {fixed} cannot vary its step")
    shortest = shortest_step or step
    if duration / shortest > _MOST_STEPS:
        raise BadInput("[system], duration_s", duration, f"at most {_MOST_STEPS} steps of {shortest:g} s")
    for name, values in (starts or {}).items():
        if name not in named:
            raise unknown_name("start", name, named, what="slave")
        for variable, value in values.items():
            _check_start(named[name], variable, value)
    return System(
        slaves=named,
        connections=tuple(joined),
        starts={name: dict(values) for name, values in (starts or {}).items()},
        algorithm=checks.choice("[system], algorithm", algorithm, ALGORITHMS),
        step=step,
        duration=duration,
        tolerance=checks.number("[system], tolerance", tolerance, above=0.0, most=0.1),
        accuracy=checks.number("[system], accuracy", accuracy, above=0.0, most=1.0),
        refine=checks.whole("[system], refine", refine, least=0, most=10),
        resolution=checks.number("[system], resolution_s", resolution, least=1e-6, unit="s"),
        shortest_step=shortest_step,
        warnings=tuple(warnings),
    )


def load_system(path: str | os.PathLike[str]) -> System:
    """Read SYSTEM.toml and make its slaves; paths in it are relative to it.

    Raises
    ------
    BadInput
        Names the file, the key, the value found and the value allowed.
    """
    return tomlfile.load(path, _system)


def _system(document: dict[str, Any], path: Path) -> System:
    made: list[Partner] = []
    try:
        checks.keys("", document, required=["system", "slave"], optional=["connection"])
        settings = checks.table("[system]", document["system"])
        checks.keys("[system]", settings, required=["step_s", "duration_s"], optional=_OPTIONAL)
        starts = {}
        for number, table in enumerate(checks.tables("slave", document["slave"]), start=1):
            try:
                made.append(_slave(table, path.parent))
            except BadInput as error:
                raise error if error.file else error.within(place=f"[[slave]] {number}") from None
            starts[made[-1].name] = checks.table("start", table.get("start", {}))
        settings = {key.removesuffix("_s"): value for key, value in settings.items()}
        return couple(made, checks.tables("connection", document.get("connection", [])), starts=starts, **settings)
    except BaseException:
        for slave in made:
            slave.free()
        raise


def _check_start(slave: Partner, name: str, value: object) -> None:
    """Refuse a start value of a variable that is not known, or of another kind than the variable."""
    place = f"{slave.name}, [slave.start]"
    if name not in slave.variables:
        raise unknown_name(place, name, slave.variables, what="variable")
    variable = slave.variables[name]
    if not variable.dimensions:
        _check_value(f"{place}, {name}", variable, value)
    elif not isinstance(value, list) or len(value) != variable.size:
        raise BadInput(f"{place}, {name}", value, f"a list of {variable.size} values, row by row")
    else:
        for element, item in zip(variable.elements, value, strict=True):
            _check_value(f"{place}, {element}", variable, item)


def whole_range(kind: str) -> tuple[int, int]:
    """Return the smallest and the largest value of a type of integers, such as "Int8"."""
    bits, signed = int(kind.lstrip("UInt")), kind.startswith("Int")
    least = -(2 ** (bits - 1)) if signed else 0
    return least, least + 2**bits - 1


def _check_value(place: str, variable: Variable, value: object) -> None:
    """Refuse a value of another kind than a variable."""
    kind = variable.type
    if kind in ("Binary", "Clock"):
        raise BadInput(place, Text(f"a variable of type {kind}"), "numbers, Booleans and strings")
    if variable.causality == "structuralParameter":
        raise BadInput(place, Text("a structural parameter"), "variables that do not change the size of an array")
    if kind == "String":
        if not isinstance(value, str):
            raise BadInput(place, value, "a text")
    elif kind == "Boolean":
        checks.flag(place, value)
    elif kind.startswith(("Int", "UInt")):
        least, most = whole_range(kind)
        checks.whole(place, value, least=least, most=most)
    else:
        checks.number(place, value)


def _slave(table: dict[str, Any], folder: Path) -> Partner:
    kinds = [kind for kind in KINDS if kind in table]
    if len(kinds) != 1:
        raise BadInput(", ".join(KINDS), Text(" and ".join(kinds) or "none of them"), "one of them")
    kind = kinds[0]
    if kind in ("signal", "pid", "impedance"):
        checks.keys("", table, required=[kind, "name"], optional=["start"])
        try:
            return from_table(kind, checks.table(kind, table[kind]), checks.text("name", table["name"]), folder)
        except BadInput as error:
            raise error if error.file else error.within(place=kind) from None
    if kind == "wall":
        checks.keys("", table, required=["wall", "name"], optional=["start"])
        wall = checks.table("wall", table["wall"])
        checks.keys("wall", wall, required=["axis", "position_m", "stiffness"], optional=["damping"])
        return Wall(wall["axis"], wall["position_m"], wall["stiffness"], wall.get("damping", 0.0), name=checks.text("name", table["name"]))
    path = folder / checks.text(kind, table[kind])
    if kind == "fmu":
        checks.keys("", table, required=["fmu"], optional=["name", "start", "seconds"])
        settings: dict[str, Any] = (
            {"seconds": checks.number("seconds", table["seconds"], above=0.0, unit="s")} if "seconds" in table else {}
        )
        return IsolatedSlave(path, name=checks.text("name", table["name"]) if "name" in table else None, **settings)
    optional = ["name", "port", "start", "start_deg", "rest", "inner_step_s", "handle_m"]
    checks.keys("", table, required=["model"], optional=optional)
    if "handle_m" in table and table.get("port", "force") == "force":
        raise BadInput("handle_m", table["handle_m"], 'none with port = "force": the handle belongs to the motion port')
    degrees = table.get("start_deg")
    if degrees is not None:
        if not isinstance(degrees, list):
            raise BadInput("start_deg", degrees, "a list of numbers, one a joint")
        degrees = [np.radians(checks.number(f"start_deg[{k}]", item)) for k, item in enumerate(degrees)]
    settings = {"step": table["inner_step_s"]} if "inner_step_s" in table else {}
    try:
        return Slave(
            path,
            port=table.get("port", "force"),
            start=degrees,
            rest=checks.flag("rest", table.get("rest", False)),
            handle=table.get("handle_m"),
            name=table.get("name"),
            **settings,
        )
    except BadInput as error:
        raise error if error.file or error.place != "start" else BadInput("start_deg", error.found, error.allowed) from None


def _connections(table: dict[str, Any], slaves: dict[str, Partner], warnings: list[str]) -> list[Connection]:
    checks.keys("", table, required=["from", "to"], optional=["within", "dual", "factor", "offset"])
    sources = _ends("from", table["from"], slaves)
    targets = _ends("to", table["to"], slaves)
    if len(sources) != len(targets):
        found = Text(f"{len(sources)} outputs and {len(targets)} inputs")
        raise BadInput("from, to", found, "as many outputs as inputs")
    return [_connection(table, ends, slaves, warnings) for ends in zip(sources, targets, strict=True)]


def _connection(
    table: dict[str, Any], ends: tuple[tuple[str, str], tuple[str, str]], slaves: dict[str, Partner], warnings: list[str]
) -> Connection:
    source, target = ends
    output, given = (slaves[name].variable(variable) for name, variable in ends)
    if output.causality == "input":
        raise BadInput("from", Text(f"{'.'.join(source)}, an input"), "an output")
    if given.causality != "input":
        raise BadInput("to", Text(f"{'.'.join(target)}, {given.causality}"), "an input")
    for end, variable in zip(ends, (output, given), strict=True):
        if family(variable) is None:
            raise BadInput("from, to", Text(f"{'.'.join(end)}, {variable.type}"), "numbers or Booleans")
    if family(output) != family(given):
        raise BadInput("from, to", Text(f"{output.type} and {given.type}"), "the same kind of value at both ends")
    label = f"{'.'.join(source)} -> {'.'.join(target)}"
    if family(given) == "Float" and (output.exponents is None or given.exponents is None):
        warnings.append(f"{label}: units not checked, one of them is not described")
    # Not every tool counts the radian as a base unit.
    elif (
        output.exponents
        and given.exponents
        and (*output.exponents[:3], *output.exponents[4:]) != (*given.exponents[:3], *given.exponents[4:])
    ):
        raise BadInput("from, to", Text(f"{label}, in {output.unit} and {given.unit}"), "the same dimension at both ends")
    dual, sign = _dual(table.get("dual"), target, slaves)
    factor, offset = checks.number("factor", table.get("factor", 1.0)), checks.number("offset", table.get("offset", 0.0))
    within = table.get("within")
    if family(given) != "Float":
        if (factor, offset) != (1.0, 0.0):
            raise BadInput("factor, offset", Text(f"with {output.type}"), "neither, except between floating point numbers")
        # Between whole numbers there is nothing to hold.
        return Connection(source, target, checks.choice("within", "start" if within is None else within, ("start", "end")))
    within = _within(target, given, slaves) if within is None else checks.choice("within", within, WITHIN)
    return Connection(source, target, within, dual, sign, factor * output.scale / given.scale, offset)


def family(variable: Variable) -> str | None:
    """Return the sort of value that may be connected: "Float", "Int", or "Boolean"; None for others."""
    for word in ("Float", "UInt", "Int", "Boolean"):
        if variable.type.startswith(word):
            return "Int" if word == "UInt" else word
    return None


def parted(text: str, slaves: Iterable[str]) -> tuple[str, str]:
    """Return the names of slave and variable; that of a slave may contain dots, as that of a file may."""
    name = max((known for known in slaves if text.startswith(f"{known}.")), key=len, default=text.partition(".")[0])
    return name, text[len(name) + 1 :]


def _ends(key: str, value: object, slaves: dict[str, Partner]) -> list[tuple[str, str]]:
    """Return the variables of a name: itself, or all of its indices."""
    text = checks.text(key, value)
    name, variable = parted(text, slaves)
    if name not in slaves:
        raise unknown_name(key, name, slaves, what="slave")
    known = slaves[name].variables
    if variable in known:
        return [(name, element) for element in known[variable].elements]
    indexed = [v for v in known if re.fullmatch(rf"{re.escape(variable)}\[\d+\]", v)]
    if not indexed:
        raise unknown_name(key, variable, known, what=f"variable of {name}")
    return [(name, v) for v in indexed]


def _within(target: tuple[str, str], variable: Variable, slaves: dict[str, Partner]) -> str:
    """Return which value of an output an input takes by default."""
    if target[1].startswith(("robot.r[", "robot.v[")) and "contact.F[1]" in slaves[target[0]].variables:
        # The motion port goes on from the start by itself, best with the mean velocity.
        return "start" if target[1].startswith("robot.r[") else "mean"
    if variable.exponents is not None and tuple(variable.exponents[:3]) in _FORCES:
        return "mean"
    return "end"


def _dual(given: object, target: tuple[str, str], slaves: dict[str, Partner]) -> tuple[str | None, float]:
    """Return what makes a power with an input; known for the ports of an arm."""
    known = slaves[target[0]].variables
    own: tuple[str | None, float] = (None, 1.0)
    for stem, dual, sign in (("handle.F", "handle.v", 1.0), ("robot.v", "contact.F", -1.0)):
        match = re.fullmatch(rf"{re.escape(stem)}(\[\d+\])", target[1])
        if match and f"{dual}{match[1]}" in known:
            own = f"{dual}{match[1]}", sign
    if given is None or given == own[0]:
        return own
    name = checks.text("dual", given)
    if name not in known:
        raise unknown_name("dual", name, known, what=f"variable of {target[0]}")
    one, other = slaves[target[0]].variable(target[1]).exponents, known[name].exponents
    if one is not None and other is not None and tuple(a + b for a, b in zip(one[:3], other[:3], strict=True)) != _POWER:
        raise BadInput("dual", name, f"a variable whose product with {target[1]} is a power")
    return name, 1.0
