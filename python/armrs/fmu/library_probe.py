"""Tests of the library of an FMU against its description. They run in a process of their own."""

from __future__ import annotations

import contextlib
import ctypes
import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from ..errors import ArmrsError, SlaveError
from . import capability_probe, standard_names, variable_access
from .description import Description, parse
from .imported_slave import ImportedSlave
from .probe_context import MOST_SHOWN, ProbeContext
from .shared_library import Library, library_path
from .slave_interface import Status


def run(path: Path, folder: Path, send: Callable[[dict[str, Any]], None], part: int | None = None) -> None:
    """Try an unpacked FMU from its library to everything that it promises, or one part of it: there are `parts` of them."""
    description = parse((folder / "modelDescription.xml").read_bytes())
    probe = ProbeContext(path, folder, description, send)
    probe.step("loading the library")
    try:
        if _symbols(probe):
            tried = (_life, *capability_probe.ALL)
            for promise in tried if part is None else tried[part : part + 1]:
                if not probe.needs_tool:
                    _guarded(probe, promise)
    except ArmrsError as refused:
        probe.find("library", str(refused))
    probe.step("end")


def parts(description: Description) -> list[int | None]:
    """Return the parts that need a process each: all together but for libraries that can be instantiated only once in one."""
    once = any(flags.get("canBeInstantiatedOnlyOncePerProcess") in ("true", "1") for flags in description.interfaces.values())
    return list(range(1 + len(capability_probe.ALL))) if once and not description.flag("needsExecutionTool") else [None]


def _guarded(probe: ProbeContext, promise: Callable[[ProbeContext], None]) -> None:
    """Keep one failure from hiding the others."""
    try:
        promise(probe)
    except ArmrsError as refused:
        probe.find("library", str(refused))


def _symbols(probe: ProbeContext) -> bool:
    """Load the libraries, of which each interface may have one of its own, and find the functions of the standard in them."""
    interfaces: dict[str, list[str]] = {}
    for kind, attributes in probe.description.interfaces.items():
        interfaces.setdefault(attributes.get("modelIdentifier", ""), []).append(kind)
    return all(_symbols_of(probe, kinds) for kinds in interfaces.values())


def _symbols_of(probe: ProbeContext, interfaces: list[str]) -> bool:
    fmi = probe.fmi
    library = Library(library_path(probe.folder, probe.description, probe.path, interfaces[0]), fmi)
    missing = [f"fmi{fmi}{name}" for name in standard_names.functions(fmi, interfaces) if not library.has(f"fmi{fmi}{name}")]
    if missing:
        probe.find("library", f"{len(missing)} functions of the standard are missing: {', '.join(missing[:MOST_SHOWN])}")
        return False
    version = (library.function("GetVersion", ctypes.c_char_p)() or b"").decode(errors="replace")
    if version.split(".")[0] != str(fmi):
        probe.find("library, GetVersion", f"{version!r}, but fmiVersion is {probe.description.version}")
    if fmi == 2 and (platform := library.function("GetTypesPlatform", ctypes.c_char_p)()) != b"default":
        probe.find("library, GetTypesPlatform", f"{platform!r}, allowed is 'default'")
    return True


def _life(probe: ProbeContext) -> None:
    """Make an instance, compare its start values, step it, go back, reset it."""
    if "CoSimulation" not in probe.description.interfaces:
        return
    probe.step("creating an instance")
    try:
        slave = probe.make()
    except SlaveError as error:
        if probe.flag("needsExecutionTool"):
            probe.find("CoSimulation, needsExecutionTool", f"it needs the tool that exported it: not tested ({error})", level="note")
            probe.needs_tool = True
            return
        if probe.fmi == 3 and probe.flag("hasEventMode") and _made_with_events(probe):
            text = "an instance without event mode is refused: not tested, and armrs cannot couple this FMU"
            probe.find("CoSimulation, hasEventMode", text, level="note")
            probe.wants_events = True
            return
        token = "instantiationToken" if probe.fmi == 3 else "guid"
        probe.find("library, instantiate", f"refused with the {token} {probe.description.token!r}: {error}")
        return
    probe.step("setting values before the initialization")
    variable_access.set_all(probe, slave, variable_access.settable_at_start(probe), "before the initialization")
    probe.step("initializing")
    slave.enter_initialization_mode(probe.start)
    probe.step("comparing start values")
    variable_access.starts(probe, slave)
    for promise in capability_probe.IN_INITIALIZATION:
        _guarded(probe, partial(promise, slave=slave))
    slave.exit_initialization_mode()
    variable_access.reads(probe, slave)
    first = _steps(probe, slave)
    _second_instance(probe, slave)
    _tunables(probe, slave)
    probe.step("ending")
    slave.terminate()
    _reset(probe, slave, first)
    probe.step("freeing the instance")
    slave.free()


def _made_with_events(probe: ProbeContext) -> bool:
    """Whether an instance that uses the event mode is made; FMUs with clocks may need it."""
    try:
        probe.make(event_mode=True).free()
    except SlaveError:
        return False
    return True


def _steps(probe: ProbeContext, slave: ImportedSlave) -> dict[str, list[Any]]:
    """Make a step, twice where the FMU can go back; return the outputs after the first."""
    probe.step("doing a step")
    state = slave.get_state() if slave.can_rollback else None
    first = _advance(probe, slave, probe.start, probe.size)
    if state is None:
        probe.find("CoSimulation", "states cannot be saved and restored, so the FMU cannot take part in an iterated coupling", level="note")
    else:
        word = f"GetFMU{'S' if probe.fmi == 3 else 's'}tate"
        probe.step("restoring a state")
        _disturb(probe, slave)
        slave.set_state(state)
        probe.compare(f"library, {word}", first, _advance(probe, slave, probe.start, probe.size), "from the restored state")
        _serialized(probe, slave, state, first)
        slave.free_state(state)
    probe.step("doing steps of other lengths")
    if slave.can_vary_step:
        middle = probe.start + probe.size
        _advance(probe, slave, middle, 0.5 * probe.size)
        _advance(probe, slave, middle + 0.5 * probe.size, probe.size)
    _output_derivatives(probe, slave)
    _input_derivatives(probe, slave)
    return first


def _disturb(probe: ProbeContext, slave: ImportedSlave) -> None:
    """Go on with other inputs, so that a state without inputs or times is seen."""
    for v in probe.readable("input"):
        moved = v.start + 0.125 * v.nominal if v.is_signal and v.start is not None else None
        if moved is not None and (v.max is None or moved <= v.max):
            # An input that cannot be set is a finding later.
            with contextlib.suppress(SlaveError):
                slave.set(v.name, moved)
    slave.do_step(probe.start + probe.size, probe.size)


def _serialized(probe: ProbeContext, slave: ImportedSlave, state: Any, first: dict[str, list[Any]]) -> None:
    if not probe.flag(f"canSerializeFMU{'S' if probe.fmi == 3 else 's'}tate"):
        return
    probe.step("serializing a state")
    content = slave.serialize_state(state)
    if not content:
        probe.find("library, SerializeFMUState", "the serialized state is empty")
    copy = slave.deserialize_state(content)
    slave.set_state(copy)
    slave.free_state(copy)
    probe.compare("library, SerializeFMUState", first, _advance(probe, slave, probe.start, probe.size), "from the deserialized state")


def _advance(probe: ProbeContext, slave: ImportedSlave, time: float, size: float) -> dict[str, list[Any]]:
    done = slave.do_step(time, size)
    place, end = "library, DoStep", time + size
    if done.terminate:
        probe.find(place, f"it requests the end of the run after the step from {time:g} s", level="note")
    elif done.status > Status.WARNING:
        probe.find(place, f"the step of {size:g} s from {time:g} s is discarded: {done.message}")
    elif done.early_return:
        probe.find(place, "it returns early, which was not allowed at instantiation")
    elif abs(done.last_successful_time - end) > 1e-6 * size + 1e-12 * abs(end) + probe.lag:
        probe.find(place, f"lastSuccessfulTime is {done.last_successful_time:g} s after a step to {end:g} s")
    if done.event and not probe.flag("hasEventMode"):
        probe.find(place, "it requests event handling but has no event mode")
    outputs = probe.outputs(slave)
    for name, found in outputs.items():
        for value in found:
            if isinstance(value, float) and not math.isfinite(value):
                probe.find(f"variable {name}", f"is {value} after a step", sort="finite")
    _time(probe, slave, end)
    return outputs


def _time(probe: ProbeContext, slave: ImportedSlave, end: float) -> None:
    """Compare the independent variable with the time of the importer; FMI 2.0 cannot state by which inner step it may lag."""
    for v in probe.readable("independent") if probe.fmi == 3 else []:
        found = float(slave.values(v.name)[0])
        if not abs(found - end) <= 1e-9 * max(1.0, abs(end)) + probe.lag:
            probe.find(f"variable {v.name}", f"is {found:g} after a step to {end:g} s", level="note", sort="time")


def _output_derivatives(probe: ProbeContext, slave: ImportedSlave) -> None:
    order = probe.description.number("maxOutputDerivativeOrder")
    outputs = [v.name for v in probe.readable("output") if v.is_signal and v.variability == "continuous"]
    if order and outputs:
        probe.step("reading derivatives of outputs")
        slave.get_output_derivatives(outputs)


def _input_derivatives(probe: ProbeContext, slave: ImportedSlave) -> None:
    inputs = [v.name for v in probe.readable("input") if v.is_signal and v.variability == "continuous"]
    if probe.fmi == 2 and probe.flag("canInterpolateInputs") and inputs:
        probe.step("setting derivatives of inputs")
        slave.set_input_derivatives(inputs, [0.0] * len(inputs))


def _tunables(probe: ProbeContext, slave: ImportedSlave) -> None:
    probe.step("setting inputs and tunable parameters between steps")
    inputs = [v for v in probe.readable("input") if v.start is not None]
    tunable = [v for v in probe.readable("parameter") if v.variability == "tunable" and v.start is not None]
    variable_access.set_all(probe, slave, [*inputs, *tunable], "between steps")


def _second_instance(probe: ProbeContext, slave: ImportedSlave) -> None:
    """Make a second instance: it begins where the first began, and does not touch it."""
    if probe.only_once:
        return
    probe.step("creating a second instance beside the first")
    before = probe.outputs(slave)
    try:
        other = probe.make()
    except SlaveError as error:
        probe.find("library, instantiate", f"a second instance is refused, and canBeInstantiatedOnlyOncePerProcess is not true: {error}")
        return
    probe.step("initializing a second instance")
    other.enter_initialization_mode(probe.start)
    variable_access.starts(probe, other)
    other.exit_initialization_mode()
    other.do_step(probe.start, probe.size)
    probe.compare("library, instantiate", before, probe.outputs(slave), "after a step of a second instance")
    other.free()


def _reset(probe: ProbeContext, slave: ImportedSlave, first: dict[str, list[Any]]) -> None:
    probe.step("resetting")
    slave.reset()
    probe.begin(slave)
    probe.compare("library, Reset", first, _advance(probe, slave, probe.start, probe.size), "after a reset")
