"""Tests of declared capabilities beyond stepping: derivatives, dependencies, event mode, Model Exchange."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from ctypes import byref, c_bool, c_double, c_int, c_size_t, c_void_p

from ..errors import ArmrsError, SlaveError
from . import clocks
from .imported_slave import ImportedSlave
from .intermediate_update import early_return, intermediate_update
from .probe_context import ProbeContext
from .shared_library import Library, library_path
from .slave_interface import Variable

_MOST_PROBED = 200
"""Most changes of one variable after which another is read."""
_MOST_EVENTS = 100
"""Most updates of the discrete states at one event."""
_NOISE = 1e-6
"""Relative change of a value that solving equations by iteration may cause."""
_DIFFERENCE = 1e-6
"""Relative step of the difference quotients that derivatives are compared with."""
_DERIVATIVE_OFF = 1e-3
"""Relative difference from a finite difference that a directional derivative may have: it is to find wrong formulas, not rounding."""


def dependencies(probe: ProbeContext, slave: ImportedSlave) -> None:
    """Change, in the initialization, what an unknown does not depend on; it must not change."""
    listed = {u.name: set(u.dependencies) for u in probe.description.unknowns("InitialUnknown") if u.dependencies is not None}
    outputs = [v for v in probe.readable() if v.is_signal and v.name in listed and v.variability == "continuous"]
    if not outputs:
        return
    probe.step("comparing dependencies")
    changed = 0
    for known in _changeable(probe):
        free = [v.name for v in outputs if known.name not in listed[v.name]]
        if not free:
            continue
        if (changed := changed + 1) > _MOST_PROBED:
            return
        before = slave.get(free)
        slave.set(known.name, _moved(known))
        after = slave.get(free)
        slave.set(known.name, known.start)
        for name, a, b in zip(free, before, after, strict=True):
            if abs(a - b) > _NOISE * max(abs(a), abs(b)):
                text = f"changes with {known.name}, which is not among its dependencies in the initialization"
                probe.find(f"ModelStructure, InitialUnknown {name}", text, sort="dependencies")


def directional_derivatives(probe: ProbeContext, slave: ImportedSlave) -> None:
    """Compare directional derivatives with finite differences in the initialization."""
    word = f"providesDirectionalDerivative{'s' if probe.fmi == 3 else ''}"
    if not probe.flag(word):
        return
    probe.step("reading directional derivatives")
    unknowns = _unknowns(probe)
    knowns = [v for v in _changeable(probe) if v.causality == "input"]
    for known in knowns[:_MOST_PROBED] if unknowns else []:
        derivative = slave.get_directional_derivative(unknowns, [known.name], [1.0])
        size = _DIFFERENCE * max(1.0, abs(known.nominal), abs(known.start))
        values = []
        for sign in (1.0, -1.0):
            slave.set(known.name, known.start + sign * size)
            values.append(slave.get(unknowns))
        slave.set(known.name, known.start)
        difference = (values[0] - values[1]) / (2.0 * size)
        for name, found, expected in zip(unknowns, derivative, difference, strict=True):
            if not abs(found - expected) <= _DERIVATIVE_OFF * max(1.0, abs(expected)):
                text = f"the derivative of {name} with respect to {known.name} is {found:.6g}, finite differences give {expected:.6g}"
                probe.find("library, GetDirectionalDerivative", text, sort="derivatives")


def adjoint_derivatives(probe: ProbeContext, slave: ImportedSlave) -> None:
    """Compare adjoint derivatives with directional derivatives in the initialization."""
    if probe.fmi == 2 or not (probe.flag("providesAdjointDerivatives") and probe.flag("providesDirectionalDerivatives")):
        return
    probe.step("reading adjoint derivatives")
    unknowns, knowns = _unknowns(probe), [v.name for v in _changeable(probe) if v.causality == "input"][:_MOST_PROBED]
    if not unknowns or not knowns:
        return
    columns = [slave.get_directional_derivative(unknowns, [known], [1.0]) for known in knowns]
    for k, unknown in enumerate(unknowns):
        row = slave.get_adjoint_derivative([unknown], knowns, [1.0])
        for known, found, column in zip(knowns, row, columns, strict=True):
            if not abs(found - column[k]) <= _NOISE * max(1.0, abs(column[k])):
                text = f"the derivative of {unknown} with respect to {known} is {found:.6g}, GetDirectionalDerivative gives {column[k]:.6g}"
                probe.find("library, GetAdjointDerivative", text, sort="adjoint")


def configuration(probe: ProbeContext) -> None:
    """Set structural parameters to their start values in configuration mode, which an FMU that has some must offer."""
    structural = [v for v in probe.readable("structuralParameter") if v.start is not None and not v.dimensions]
    if not structural or probe.wants_events or "CoSimulation" not in probe.description.interfaces:
        return
    probe.step("setting structural parameters in configuration mode")
    slave = probe.make()
    slave.call("EnterConfigurationMode")
    try:
        for v in structural:
            slave.set(v.name, v.start)
    except SlaveError as error:
        probe.find(f"variable {v.name}", f"its own start value cannot be set in configuration mode: {error}")
    else:
        slave.call("ExitConfigurationMode")
        probe.begin(slave)
    slave.free()


def binaries(probe: ProbeContext, slave: ImportedSlave) -> None:
    """Compare binary variables with their start values, and set inputs and parameters to them."""
    for v in probe.description.variables if probe.fmi == 3 else ():
        if v.type != "Binary" or v.dimensions or v.start is None:
            continue
        probe.step("comparing binary start values")
        try:
            said = bytes.fromhex(v.start)
        except ValueError:
            probe.find(f"variable {v.name}", f"start is {v.start[:80]!r}, allowed are hexadecimal digits", sort="binary")
            continue
        found = slave.get_binary(v.name)
        if found != said:
            shown = f"start is {said.hex()[:80]} in the description and {found.hex()[:80]} in the library"
            probe.find(f"variable {v.name}", shown, sort="binary")
        if v.causality in ("input", "parameter"):
            slave.set_binary(v.name, said)


def event_mode(probe: ProbeContext) -> None:
    """Go through the event mode where it is promised."""
    if probe.fmi == 2 or not probe.flag("hasEventMode"):
        return
    probe.step("creating an instance that uses the event mode")
    try:
        slave = probe.make(event_mode=True)
    except SlaveError as error:
        probe.find("CoSimulation, hasEventMode", f"an instance that uses the event mode is refused: {error}")
        return
    probe.step("running event mode")
    slave.enter_initialization_mode(probe.start)
    clocks.intervals(probe, slave.call, "in the initialization")
    slave.exit_initialization_mode()
    clocks.tick(probe, slave.call)
    _discrete(probe, slave)
    clocks.intervals(probe, slave.call, "in the event mode", ("countdown",))
    slave.call("EnterStepMode")
    done = slave.do_step(probe.start, probe.size)
    if done.event:
        slave.call("EnterEventMode")
        _discrete(probe, slave)
    slave.terminate()
    slave.free()


def _discrete(probe: ProbeContext, slave: ImportedSlave) -> None:
    """Update the discrete states until nothing is left to do."""
    flags, time = [c_bool() for _ in range(5)], c_double()
    for _ in range(_MOST_EVENTS):
        slave.call("UpdateDiscreteStates", *(byref(flag) for flag in flags), byref(time))
        if not flags[0].value:
            return
    probe.find("library, UpdateDiscreteStates", f"the discrete states need more than {_MOST_EVENTS} updates")


def model_exchange(probe: ProbeContext) -> None:
    """Initialize an instance for Model Exchange, and compare the number of its states and their derivatives with the description."""
    flags = probe.description.interfaces.get("ModelExchange")
    if flags is None or flags.get("needsExecutionTool") in ("true", "1"):
        return
    probe.step("creating an instance for Model Exchange")
    library = Library(library_path(probe.folder, probe.description, probe.path, "ModelExchange"), probe.fmi)
    resources = probe.folder / "resources"
    handle = library.instantiate_model_exchange("tried", probe.description.token, resources)
    if not handle:
        probe.find("library, instantiate", f"Model Exchange is refused: {library.last_message()}")
        return
    instance = c_void_p(handle)

    def call(name: str, *given: object) -> None:
        status = library.call(name, instance, *given)
        if not 0 <= status <= 1:
            raise SlaveError(name, status, library.last_message())

    try:
        _exchanged(probe, library, call)
    except ArmrsError as error:
        probe.find("library, Model Exchange", str(error))
    library.function("FreeInstance", None)(instance)


def _exchanged(probe: ProbeContext, library: Library, call: Callable[..., None]) -> None:
    probe.step("initializing for Model Exchange")
    start = c_double(probe.start)
    truth = c_bool if probe.fmi == 3 else c_int
    known = (truth(False), c_double(0.0), start, truth(False), c_double(0.0))
    if probe.fmi == 3:
        call("EnterInitializationMode", *known)
        clocks.intervals(probe, call, "in the initialization")
    else:
        call("SetupExperiment", *known)
        call("EnterInitializationMode")
    call("ExitInitializationMode")
    variables = {v.name: v for v in probe.description.variables}
    said = sum(variables[u.name].size for u in probe.description.unknowns("ContinuousStateDerivative") if u.name in variables)
    if probe.fmi == 3:
        number = c_size_t()
        call("GetNumberOfContinuousStates", byref(number))
        if number.value != said:
            probe.find("library, GetNumberOfContinuousStates", f"{number.value}, ModelStructure lists {said} derivatives")
            return
        clocks.tick(probe, call)
        _events(call)
    else:
        _events_of_2(call)
    call("EnterContinuousTimeMode")
    call("SetTime", start)
    room = (c_double * max(said, 1))()
    if said:
        call("GetContinuousStates", room, c_size_t(said))
        call("SetContinuousStates", room, c_size_t(said))
        call("GetContinuousStateDerivatives" if probe.fmi == 3 else "GetDerivatives", room, c_size_t(said))
        call("GetNominalsOfContinuousStates", room, c_size_t(said))
        if any(not value > 0.0 for value in room):
            probe.find("library, GetNominalsOfContinuousStates", f"{list(room)[:5]}, allowed are numbers > 0")


def _events(call: Callable[..., None]) -> None:
    flags, time = [c_bool() for _ in range(5)], c_double()
    for _ in range(_MOST_EVENTS):
        call("UpdateDiscreteStates", *(byref(flag) for flag in flags), byref(time))
        if not flags[0].value:
            return


class _EventInfo2(ctypes.Structure):
    _fields_ = [*((f"flag{k}", c_int) for k in range(5)), ("next", c_double)]


def _events_of_2(call: Callable[..., None]) -> None:
    info = _EventInfo2()
    for _ in range(_MOST_EVENTS):
        call("NewDiscreteStates", byref(info))
        if not info.flag0:
            return


def _unknowns(probe: ProbeContext) -> list[str]:
    """Return outputs that have derivatives in the initialization."""
    return [v.name for v in probe.readable("output") if v.is_signal and v.variability == "continuous" and v.initial != "exact"]


def _changeable(probe: ProbeContext) -> list[Variable]:
    """Scalar inputs and parameters that have a start value."""
    return [v for v in probe.readable("input", "parameter") if v.is_signal and v.start is not None]


def _moved(v: Variable) -> float:
    """Return another value of a variable within its limits."""
    start = float(v.start)
    size = 0.01 * max(abs(start), abs(v.nominal))
    return start + size if v.max is None or start + size <= v.max else start - size


ALL: tuple[Callable[[ProbeContext], None], ...] = (
    configuration,
    event_mode,
    intermediate_update,
    early_return,
    model_exchange,
    clocks.scheduled_execution,
)
"""Promises that need an instance of their own."""
IN_INITIALIZATION = (binaries, dependencies, directional_derivatives, adjoint_derivatives)
"""Promises that are tried while an instance is initialized."""
