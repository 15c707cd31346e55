"""An FMU as a slave in this process, through the C interface of FMI 2.0 or 3.0. Nothing but Python is needed."""

from __future__ import annotations

import ctypes
import os
import shutil
import tempfile
import weakref
from collections.abc import Sequence
from ctypes import byref, c_bool, c_double, c_int, c_size_t, c_void_p
from pathlib import Path
from typing import Any

import numpy as np

from .. import checks
from ..errors import BadInput, SlaveError, Text, unknown_name
from .archive import unpack
from .description import Description, read_description
from .shared_library import C_TYPES, NAMES_IN_2, Library, library_path
from .slave_interface import Partner, Status, StepResult, Variable, listed


class _Group:
    """Variables of one type that are read or set in one call, with everything that the call needs made once.

    Of an array single elements may be listed; the call is for the whole.
    """

    def __init__(self, slave: ImportedSlave, kind: str, members: list[tuple[int, Variable, int | None]]) -> None:
        self.kind = kind
        variables = {v.name: v for _, v, _ in members}
        begins, at = {}, 0
        for v in variables.values():
            begins[v.name] = at
            at += v.size
        self.slices = [
            slice(begins[v.name], begins[v.name] + v.size) if k is None else slice(begins[v.name] + k, begins[v.name] + k + 1)
            for _, v, k in members
        ]
        self.places = [place for place, _, _ in members]
        self.is_whole = sorted(k for s in self.slices for k in range(s.start, s.stop)) == list(range(at))
        ctype = c_int if slave.fmi == 2 and kind == "Boolean" else C_TYPES[kind]
        self.buffer = (ctype * at)()
        numeric = kind not in ("String", "Boolean")
        self.view: Any = np.ctypeslib.as_array(self.buffer) if numeric and at else None
        references = (ctypes.c_uint32 * len(variables))(*(v.reference for v in variables.values()))
        name = NAMES_IN_2[kind] if slave.fmi == 2 else kind
        self.arguments = (references, c_size_t(len(variables)), self.buffer, *((c_size_t(at),) if slave.fmi == 3 else ()))
        self.names = (f"Get{name}", f"Set{name}")
        self.get, self.set = (slave.library.function(n) for n in self.names)


class _Plan:
    """How a list of variables is read and set: one call for each of their types."""

    def __init__(self, slave: ImportedSlave, names: tuple[str, ...]) -> None:
        by_type: dict[str, list[tuple[int, Variable, int | None]]] = {}
        for place, name in enumerate(names):
            found = slave.element(name)
            if found is None:
                raise unknown_name(slave.name, name, slave.variables, what="variable")
            variable, element = found
            kind = variable.type
            if kind not in C_TYPES or (slave.fmi == 2 and kind not in NAMES_IN_2):
                raise BadInput(f"{slave.name}, {name}", Text(f"a variable of type {kind}"), "a number, Boolean or string")
            by_type.setdefault(kind, []).append((place, variable, element))
        self.groups = [_Group(slave, kind, variables) for kind, variables in by_type.items()]
        self.count = len(names)
        # The usual case: nothing but scalars of one numeric type.
        only = self.groups[0] if len(self.groups) == 1 else None
        in_order = only is not None and [(s.start, s.stop) for s in only.slices] == [(k, k + 1) for k in range(len(only.buffer))]
        self.simple = only if only is not None and only.view is not None and in_order else None


class ImportedSlave(Partner):
    """An FMU for co-simulation, FMI 2.0 or 3.0, from any tool, loaded into this process.

    It runs the native code of the FMU with the rights of this process, and a crash ends both; `IsolatedSlave` has it in a process of its
    own. It is unpacked into a temporary folder that `free` removes.

    Parameters
    ----------
    path : path
        The FMU.
    name : str, optional
        Name of the instance.
    logging : bool
        Whether logging of the FMU is switched on.
    folder : Path, optional
        Where it is unpacked already; it stays there.
    **mode
        As in `Library.instantiate`.

    Attributes
    ----------
    description : Description
    library : Library
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        name: str | None = None,
        logging: bool = False,
        folder: Path | None = None,
        description: Description | None = None,
        **mode: Any,
    ) -> None:
        self.path = checks.path("path", path)
        self.description = read_description(path) if description is None else description
        interface = "ScheduledExecution" if "scheduled" in mode else "CoSimulation"
        describe(self, self.path, self.description, name, interface)
        unpacked = Path(tempfile.mkdtemp(prefix="armrs-fmu-")) if folder is None else folder
        remove = unpacked if folder is None else None
        try:
            if folder is None:
                unpack(path, unpacked)
            self.library = Library(library_path(unpacked, self.description, path, interface), self.fmi)
            self._do_step = self.library.function("DoStep")
            resources = unpacked / "resources"
            resources.mkdir(exist_ok=True)
            handle = self.library.instantiate(self.name, self.description.token, resources, logging=logging, **mode)
            if not handle:
                hint = "" if mode or not self.description.flag("hasEventMode") else "; armrs couples FMUs without their event mode"
                raise SlaveError("instantiate", Status.ERROR, f"{self.path.name}: {self.library.last_message()}{hint}")
        except BaseException:
            if remove is not None:
                shutil.rmtree(remove, ignore_errors=True)
            raise
        self._mode = mode  # callbacks must exist as long as the instance
        self._instance = c_void_p(handle)
        self._plans: dict[tuple[str, ...], _Plan] = {}
        self._flags = [c_bool() for _ in range(3)]
        self._last = c_double()
        self._is_three = self.fmi == 3
        self._time, self._step = c_double(), c_double()
        places = (c_bool(False), *(byref(flag) for flag in self._flags), byref(self._last)) if self._is_three else (c_int(0),)
        self._step_arguments = (self._instance, self._time, self._step, *places)
        # Also at the end of the process, while there still is an interpreter that a library may need.
        self._release = weakref.finalize(self, _release, self.library, handle, remove)

    @property
    def fmi(self) -> int:
        """Major version of the standard: 2 or 3."""
        return self.description.fmi

    @property
    def handle(self) -> c_void_p:
        """The instance, for calls of the C interface."""
        return self._instance

    def enter_initialization_mode(self, start: float = 0.0, stop: float | None = None, tolerance: float | None = None) -> None:
        """Begin the initialization."""
        truth = c_bool if self.fmi == 3 else c_int
        known = (
            truth(tolerance is not None),
            c_double(tolerance or 0.0),
            c_double(start),
            truth(stop is not None),
            c_double(stop if stop is not None else 0.0),
        )
        if self.fmi == 3:
            self.call("EnterInitializationMode", *known)
        else:
            self.call("SetupExperiment", *known)
            self.call("EnterInitializationMode")

    def exit_initialization_mode(self) -> None:
        """End the initialization."""
        self.call("ExitInitializationMode")

    def set(self, names: Sequence[str] | str, values: Any) -> None:
        """Set variables by name; those of one type in one call. Arrays are given as sequences, row by row, or all of their elements."""
        plan = self._plan(names)
        if plan.simple is not None and isinstance(values, np.ndarray) and values.dtype == plan.simple.view.dtype:
            plan.simple.view[:] = values
            self._done(plan.simple.names[1], plan.simple.set(self._instance, *plan.simple.arguments))
            return
        given = [values] if isinstance(names, str) and plan.count == 1 and not _is_listed(values) else list(values)
        if isinstance(names, str) and len(given) != 1:
            given = [given]
        for group in plan.groups:
            if not group.is_whole:
                raise BadInput(self.name, Text("some elements of an array"), "all of them")
            for place, part in zip(group.places, group.slices, strict=True):
                group.buffer[part] = [_c_value(group.kind, v) for v in np.ravel(given[place]).tolist()]
            self._done(group.names[1], group.set(self._instance, *group.arguments))

    def get(self, names: Sequence[str] | str) -> np.ndarray:
        """Return scalar variables and elements of arrays by name as floating point numbers, shape (len(names),)."""
        plan = self._plan(names)
        if plan.simple is not None:
            self._done(plan.simple.names[0], plan.simple.get(self._instance, *plan.simple.arguments))
            return plan.simple.view.astype(float)  # a copy
        out = np.empty(plan.count)
        for group in plan.groups:
            if any(part.stop - part.start != 1 for part in group.slices):
                raise BadInput(self.name, Text("an array"), "scalar variables; `values` reads arrays")
            self._done(group.names[0], group.get(self._instance, *group.arguments))
            out[group.places] = [group.buffer[part.start] for part in group.slices]
        return out

    def values(self, name: str) -> list[Any]:
        """Return one variable of any type, an array row by row."""
        [group] = self._plan(name).groups
        self._done(group.names[0], group.get(self._instance, *group.arguments))
        found = list(group.buffer)
        if group.kind == "String":
            return [(v or b"").decode(errors="replace") for v in found]
        return [bool(v) for v in found] if group.kind == "Boolean" else found

    def do_step(self, time: float, step: float) -> StepResult:
        """Make a communication step from a time [s], of a length [s]."""
        self._time.value, self._step.value = time, step
        if self._is_three:
            for flag in self._flags:
                flag.value = False
            self._last.value = time + step
            status = self._do_step(*self._step_arguments)
            event, terminate, early = [flag.value for flag in self._flags]
            if status == 0:
                return StepResult(Status.OK, self._last.value, event, terminate, early)
            reached = self._last.value
        else:
            status = self._do_step(*self._step_arguments)
            if status == 0:
                return StepResult(Status.OK, time + step)
            event = early = False
            # A slave of FMI 2.0 that requests the end discards the step, and returns the request when queried.
            terminate = status == Status.DISCARD and self._terminated()
            reached = time + step if status == Status.WARNING else self._reached(time)
        if not 0 <= status <= Status.DISCARD:
            raise SlaveError("do_step", status, self.library.last_message())
        message = self.library.last_message() if status == Status.DISCARD else ""
        return StepResult(Status(status), reached, event, terminate, early, message)

    def get_state(self) -> c_void_p:
        """Return the state, to come back to it."""
        state = c_void_p()
        self.call(f"GetFMU{self._s}tate", byref(state))
        return state

    def set_state(self, state: c_void_p) -> None:
        """Come back to a state."""
        self.call(f"SetFMU{self._s}tate", state)

    def free_state(self, state: c_void_p) -> None:
        """Give a state back."""
        self.call(f"FreeFMU{self._s}tate", byref(state))

    def serialize_state(self, state: c_void_p) -> bytes:
        """Return a state as bytes."""
        size = c_size_t()
        self.call(f"SerializedFMU{self._s}tateSize", state, byref(size))
        room = ctypes.create_string_buffer(size.value)
        self.call(f"SerializeFMU{self._s}tate", state, room, size)
        return room.raw

    def deserialize_state(self, state: bytes) -> c_void_p:
        """Return the state that was serialized."""
        made = c_void_p()
        word = "Deserialize" if self.fmi == 3 else "DeSerialize"
        self.call(f"{word}FMU{self._s}tate", state, c_size_t(len(state)), byref(made))
        return made

    def get_output_derivatives(self, names: Sequence[str] | str, orders: Sequence[int] | None = None) -> np.ndarray:
        """Return time derivatives of outputs."""
        listing = listed(names)
        n = len(listing)
        room, order = (c_double * n)(), (c_int * n)(*([1] * n if orders is None else orders))
        word = "GetOutputDerivatives" if self.fmi == 3 else "GetRealOutputDerivatives"
        extra = (c_size_t(n),) if self.fmi == 3 else ()
        self.call(word, self._references(listing), c_size_t(n), order, room, *extra)
        return np.array(room)

    def set_input_derivatives(self, names: Sequence[str] | str, values: Sequence[float]) -> None:
        """Set first time derivatives of inputs (FMI 2.0), which hold until they are set anew."""
        listing = listed(names)
        n = len(listing)
        self.call("SetRealInputDerivatives", self._references(listing), c_size_t(n), (c_int * n)(*[1] * n), (c_double * n)(*values))

    def get_directional_derivative(self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]) -> np.ndarray:
        """Return the derivatives of variables in the direction of a change of others, shape (len(unknowns),)."""
        n, m = len(unknowns), len(knowns)
        room, given = (c_double * n)(), (c_double * m)(*seed)
        ends = [(self._references(list(names)), c_size_t(len(names))) for names in (unknowns, knowns)]
        if self.fmi == 3:
            self.call("GetDirectionalDerivative", *ends[0], *ends[1], given, c_size_t(m), room, c_size_t(n))
        else:
            self.call("GetDirectionalDerivative", *ends[0], *ends[1], given, room)
        return np.array(room)

    def get_adjoint_derivative(self, unknowns: Sequence[str], knowns: Sequence[str], seed: Sequence[float]) -> np.ndarray:
        """Return derivatives of a combination of variables by others (FMI 3.0), shape (len(knowns),)."""
        n, m = len(unknowns), len(knowns)
        room, given = (c_double * m)(), (c_double * n)(*seed)
        ends = [(self._references(list(names)), c_size_t(len(names))) for names in (unknowns, knowns)]
        self.call("GetAdjointDerivative", *ends[0], *ends[1], given, c_size_t(n), room, c_size_t(m))
        return np.array(room)

    def get_binary(self, name: str) -> bytes:
        """Return a scalar variable of the type Binary (FMI 3.0)."""
        size, place = c_size_t(), c_void_p()
        self.call("GetBinary", self._references([name]), c_size_t(1), byref(size), byref(place), c_size_t(1))
        return ctypes.string_at(place, size.value) if place.value else b""

    def set_binary(self, name: str, value: bytes) -> None:
        """Set a scalar variable of the type Binary (FMI 3.0)."""
        place = ctypes.c_char_p(value)
        self.call("SetBinary", self._references([name]), c_size_t(1), byref(c_size_t(len(value))), byref(place), c_size_t(1))

    def terminate(self) -> None:
        """End the run."""
        self.call("Terminate")

    def reset(self) -> None:
        """Go back to how the slave was made."""
        self.call("Reset")

    def free(self) -> None:
        """Free the instance and remove the temporary folder."""
        self._release()

    def call(self, name: str, *arguments: Any) -> None:
        """Call a function of the standard on this instance, named without its prefix."""
        self._done(name, self.library.function(name)(self._instance, *arguments))

    @property
    def _s(self) -> str:
        return "S" if self.fmi == 3 else "s"

    def _done(self, name: str, status: int) -> None:
        if not 0 <= status <= Status.WARNING:
            raise SlaveError(name, status, self.library.last_message())

    def _plan(self, names: Sequence[str] | str) -> _Plan:
        key = (names,) if isinstance(names, str) else tuple(names)
        plan = self._plans.get(key)
        if plan is None:
            plan = self._plans[key] = _Plan(self, key)
        return plan

    def _reached(self, time: float) -> float:
        last = c_double(time)
        self.library.call("GetRealStatus", self._instance, c_int(2), byref(last))
        return last.value

    def _terminated(self) -> bool:
        ended = c_int(0)
        status = self.library.call("GetBooleanStatus", self._instance, c_int(3), byref(ended))
        return status == Status.OK and ended.value != 0

    def _references(self, names: list[str]) -> Any:
        for name in names:
            if name not in self.variables:
                raise unknown_name(self.name, name, self.variables, what="variable")
        return (ctypes.c_uint32 * len(names))(*(self.variables[name].reference for name in names))


def describe(slave: Any, path: Path, description: Description, name: str | None, interface: str = "CoSimulation") -> None:
    """Give a slave the attributes of a `Partner` from the description of its FMU."""
    if interface not in description.interfaces:
        raise BadInput("modelDescription.xml", Text(f"{' and '.join(description.interfaces)} only"), "an FMU for co-simulation", file=path)
    slave.name = path.stem if name is None else checks.text("name", name)
    slave.variables = {v.name: v for v in description.variables}
    slave.can_rollback = description.flag(f"canGetAndSetFMU{'S' if description.fmi == 3 else 's'}tate")
    slave.can_vary_step = description.flag("canHandleVariableCommunicationStepSize")
    slave.internal_step = description.number("fixedInternalStepSize")


def _release(library: Library, handle: int, folder: Path | None) -> None:
    library.function("FreeInstance", None)(c_void_p(handle))
    library.release()
    if folder is not None:
        shutil.rmtree(folder, ignore_errors=True)


def _is_listed(values: Any) -> bool:
    return isinstance(values, (list, tuple, np.ndarray))


def _c_value(kind: str, value: Any) -> Any:
    if kind == "String":
        return str(value).encode()
    if kind == "Boolean":
        return bool(value)
    return float(value) if kind.startswith("Float") else int(value)
