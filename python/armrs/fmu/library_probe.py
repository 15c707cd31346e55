"""The library of an FMU, tried: its behaviour against its description. It runs in a process of its own."""

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
from .probe_context import MOST_SHOWN, Trial
from .shared_library import Library, library_path
from .slave_interface import Status


def run(path: Path, folder: Path, send: Callable[[dict[str, Any]], None], part: int | None = None) -> None:
    """Try an unpacked FMU from its library to everything that it promises, or one part of it: there are `parts` of them."""
    description = parse((folder / "modelDescription.xml").read_bytes())
    trial = Trial(path, folder, description, send)
    trial.step("loading the library")
    try:
        if _symbols(trial):
            tried = (_life, *capability_probe.ALL)
            for promise in tried if part is None else tried[part : part + 1]:
                if not trial.needs_tool:
                    _guarded(trial, promise)
    except ArmrsError as refused:
        trial.find("library", str(refused))
    trial.step("end")


def parts(description: Description) -> list[int | None]:
    """Return the parts that need a process each: all together but for libraries that can be instantiated only once in one."""
    once = any(flags.get("canBeInstantiatedOnlyOncePerProcess") in ("true", "1") for flags in description.interfaces.values())
    return list(range(1 + len(capability_probe.ALL))) if once and not description.flag("needsExecutionTool") else [None]


def _guarded(trial: Trial, promise: Callable[[Trial], None]) -> None:
    """Keep one failure from hiding the others."""
    try:
        promise(trial)
    except ArmrsError as refused:
        trial.find("library", str(refused))


def _symbols(trial: Trial) -> bool:
    """Load the libraries, of which each interface may have one of its own, and find the functions of the standard in them."""
    interfaces: dict[str, list[str]] = {}
    for kind, attributes in trial.description.interfaces.items():
        interfaces.setdefault(attributes.get("modelIdentifier", ""), []).append(kind)
    return all(_symbols_of(trial, kinds) for kinds in interfaces.values())


def _symbols_of(trial: Trial, interfaces: list[str]) -> bool:
    fmi = trial.fmi
    library = Library(library_path(trial.folder, trial.description, trial.path, interfaces[0]), fmi)
    missing = [f"fmi{fmi}{name}" for name in standard_names.functions(fmi, interfaces) if not library.has(f"fmi{fmi}{name}")]
    if missing:
        trial.find("library", f"{len(missing)} functions of the standard are missing: {', '.join(missing[:MOST_SHOWN])}")
        return False
    version = (library.function("GetVersion", ctypes.c_char_p)() or b"").decode(errors="replace")
    if version.split(".")[0] != str(fmi):
        trial.find("library, GetVersion", f"{version!r}, but fmiVersion is {trial.description.version}")
    if fmi == 2 and (platform := library.function("GetTypesPlatform", ctypes.c_char_p)()) != b"default":
        trial.find("library, GetTypesPlatform", f"{platform!r}, allowed is 'default'")
    return True


def _life(trial: Trial) -> None:
    """Make an instance, compare its start values, step it, go back, reset it."""
    if "CoSimulation" not in trial.description.interfaces:
        return
    trial.step("creating an instance")
    try:
        slave = trial.make()
    except SlaveError as error:
        if trial.flag("needsExecutionTool"):
            trial.find("CoSimulation, needsExecutionTool", f"it needs the tool that exported it: not tested ({error})", level="note")
            trial.needs_tool = True
            return
        if trial.fmi == 3 and trial.flag("hasEventMode") and _made_with_events(trial):
            text = "an instance without event mode is refused: not tested, and armrs cannot couple this FMU"
            trial.find("CoSimulation, hasEventMode", text, level="note")
            trial.wants_events = True
            return
        token = "instantiationToken" if trial.fmi == 3 else "guid"
        trial.find("library, instantiate", f"refused with the {token} {trial.description.token!r}: {error}")
        return
    trial.step("setting values before the initialization")
    variable_access.set_all(trial, slave, variable_access.settable_at_start(trial), "before the initialization")
    trial.step("initializing")
    slave.enter_initialization_mode(trial.start)
    trial.step("comparing start values")
    variable_access.starts(trial, slave)
    for promise in capability_probe.IN_INITIALIZATION:
        _guarded(trial, partial(promise, slave=slave))
    slave.exit_initialization_mode()
    variable_access.reads(trial, slave)
    first = _steps(trial, slave)
    _second_instance(trial, slave)
    _tunables(trial, slave)
    trial.step("ending")
    slave.terminate()
    _reset(trial, slave, first)
    trial.step("freeing the instance")
    slave.free()


def _made_with_events(trial: Trial) -> bool:
    """Whether an instance that uses the event mode is made; FMUs with clocks may need it."""
    try:
        trial.make(event_mode=True).free()
    except SlaveError:
        return False
    return True


def _steps(trial: Trial, slave: ImportedSlave) -> dict[str, list[Any]]:
    """Make a step, twice where the FMU can go back; return the outputs after the first."""
    trial.step("doing a step")
    state = slave.get_state() if slave.can_rollback else None
    first = _advance(trial, slave, trial.start, trial.size)
    if state is None:
        trial.find("CoSimulation", "states cannot be saved and restored, so the FMU cannot take part in an iterated coupling", level="note")
    else:
        word = f"GetFMU{'S' if trial.fmi == 3 else 's'}tate"
        trial.step("restoring a state")
        _disturb(trial, slave)
        slave.set_state(state)
        trial.compare(f"library, {word}", first, _advance(trial, slave, trial.start, trial.size), "from the restored state")
        _serialized(trial, slave, state, first)
        slave.free_state(state)
    trial.step("doing steps of other lengths")
    if slave.can_vary_step:
        middle = trial.start + trial.size
        _advance(trial, slave, middle, 0.5 * trial.size)
        _advance(trial, slave, middle + 0.5 * trial.size, trial.size)
    _output_derivatives(trial, slave)
    _input_derivatives(trial, slave)
    return first


def _disturb(trial: Trial, slave: ImportedSlave) -> None:
    """Go on with other inputs, so that a state without inputs or times is seen."""
    for v in trial.readable("input"):
        moved = v.start + 0.125 * v.nominal if v.is_signal and v.start is not None else None
        if moved is not None and (v.max is None or moved <= v.max):
            # An input that cannot be set is a finding later.
            with contextlib.suppress(SlaveError):
                slave.set(v.name, moved)
    slave.do_step(trial.start + trial.size, trial.size)


def _serialized(trial: Trial, slave: ImportedSlave, state: Any, first: dict[str, list[Any]]) -> None:
    if not trial.flag(f"canSerializeFMU{'S' if trial.fmi == 3 else 's'}tate"):
        return
    trial.step("serializing a state")
    content = slave.serialize_state(state)
    if not content:
        trial.find("library, SerializeFMUState", "the serialized state is empty")
    copy = slave.deserialize_state(content)
    slave.set_state(copy)
    slave.free_state(copy)
    trial.compare("library, SerializeFMUState", first, _advance(trial, slave, trial.start, trial.size), "from the deserialized state")


def _advance(trial: Trial, slave: ImportedSlave, time: float, size: float) -> dict[str, list[Any]]:
    done = slave.do_step(time, size)
    place, end = "library, DoStep", time + size
    if done.terminate:
        trial.find(place, f"it requests the end of the run after the step from {time:g} s", level="note")
    elif done.status > Status.WARNING:
        trial.find(place, f"the step of {size:g} s from {time:g} s is discarded: {done.message}")
    elif done.early_return:
        trial.find(place, "it returns early, which was not allowed at instantiation")
    elif abs(done.last_successful_time - end) > 1e-6 * size + 1e-12 * abs(end) + trial.lag:
        trial.find(place, f"lastSuccessfulTime is {done.last_successful_time:g} s after a step to {end:g} s")
    if done.event and not trial.flag("hasEventMode"):
        trial.find(place, "it requests event handling but has no event mode")
    outputs = trial.outputs(slave)
    for name, found in outputs.items():
        for value in found:
            if isinstance(value, float) and not math.isfinite(value):
                trial.find(f"variable {name}", f"is {value} after a step", sort="finite")
    _time(trial, slave, end)
    return outputs


def _time(trial: Trial, slave: ImportedSlave, end: float) -> None:
    """Compare the independent variable with the time of the importer; FMI 2.0 cannot state by which inner step it may lag."""
    for v in trial.readable("independent") if trial.fmi == 3 else []:
        found = float(slave.values(v.name)[0])
        if not abs(found - end) <= 1e-9 * max(1.0, abs(end)) + trial.lag:
            trial.find(f"variable {v.name}", f"is {found:g} after a step to {end:g} s", level="note", sort="time")


def _output_derivatives(trial: Trial, slave: ImportedSlave) -> None:
    order = trial.description.number("maxOutputDerivativeOrder")
    outputs = [v.name for v in trial.readable("output") if v.is_signal and v.variability == "continuous"]
    if order and outputs:
        trial.step("reading derivatives of outputs")
        slave.get_output_derivatives(outputs)


def _input_derivatives(trial: Trial, slave: ImportedSlave) -> None:
    inputs = [v.name for v in trial.readable("input") if v.is_signal and v.variability == "continuous"]
    if trial.fmi == 2 and trial.flag("canInterpolateInputs") and inputs:
        trial.step("setting derivatives of inputs")
        slave.set_input_derivatives(inputs, [0.0] * len(inputs))


def _tunables(trial: Trial, slave: ImportedSlave) -> None:
    trial.step("setting inputs and tunable parameters between steps")
    inputs = [v for v in trial.readable("input") if v.start is not None]
    tunable = [v for v in trial.readable("parameter") if v.variability == "tunable" and v.start is not None]
    variable_access.set_all(trial, slave, [*inputs, *tunable], "between steps")


def _second_instance(trial: Trial, slave: ImportedSlave) -> None:
    """Make a second instance: it begins where the first began, and does not touch it."""
    if trial.only_once:
        return
    trial.step("creating a second instance beside the first")
    before = trial.outputs(slave)
    try:
        other = trial.make()
    except SlaveError as error:
        trial.find("library, instantiate", f"a second instance is refused, and canBeInstantiatedOnlyOncePerProcess is not true: {error}")
        return
    trial.step("initializing a second instance")
    other.enter_initialization_mode(trial.start)
    variable_access.starts(trial, other)
    other.exit_initialization_mode()
    other.do_step(trial.start, trial.size)
    trial.compare("library, instantiate", before, trial.outputs(slave), "after a step of a second instance")
    other.free()


def _reset(trial: Trial, slave: ImportedSlave, first: dict[str, list[Any]]) -> None:
    trial.step("resetting")
    slave.reset()
    trial.begin(slave)
    trial.compare("library, Reset", first, _advance(trial, slave, trial.start, trial.size), "after a reset")
