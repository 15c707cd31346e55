"""An FMU as a slave: its library is loaded through the C interface of FMI 2.0 or 3.0. Nothing but Python is needed."""

from __future__ import annotations

import ctypes
import os
import platform
import shutil
import sys
import tempfile
import weakref
from collections.abc import Sequence
from ctypes import byref, c_bool, c_char_p, c_double, c_float, c_int, c_size_t, c_void_p
from pathlib import Path
from typing import Any

import numpy as np

from .. import checks
from ..errors import BadInput, SlaveError, Text, unknown_name
from ..fmu.description import Description, read_description, unpack
from .partner import Partner, Status, StepResult, listed

_C_TYPES: dict[str, Any] = {
    "Float64": c_double,
    "Float32": c_float,
    "Boolean": c_bool,
    "String": c_char_p,
    **{f"{sign}Int{bits}": getattr(ctypes, f"c_{sign.lower()}int{bits}") for sign in ("", "U") for bits in (8, 16, 32, 64)},
}
_NAMES_IN_2 = {"Float64": "Real", "Int32": "Integer", "Boolean": "Boolean", "String": "String"}

_LOG_3 = ctypes.CFUNCTYPE(None, c_void_p, c_int, c_char_p, c_char_p)
# The sixth argument is the first after the format: what "%s" stands for.
_LOG_2 = ctypes.CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p, c_void_p)


class _Callbacks2(ctypes.Structure):
    _fields_ = [
        ("logger", _LOG_2),
        ("allocate", c_void_p),
        ("free", c_void_p),
        ("step_finished", c_void_p),
        ("environment", c_void_p),
    ]


def platform_folder(fmi: int) -> tuple[str, str]:
    """Return the folder of libraries for this machine below `binaries`, and the suffix of libraries."""
    system = {"linux": "linux", "win32": "windows", "darwin": "darwin"}.get(sys.platform, sys.platform)
    suffix = {"linux": ".so", "windows": ".dll", "darwin": ".dylib"}.get(system, ".so")
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    if fmi == 3:
        return f"{machine}-{system}", suffix
    bits = 64 if sys.maxsize > 2**32 else 32
    return ("darwin64" if system == "darwin" else f"{ {'windows': 'win'}.get(system, system) }{bits}"), suffix


class Library:
    """The shared library of an FMU with the functions of one version of the standard; it keeps what the FMU logs.

    Parameters
    ----------
    path : Path
        The shared library.
    fmi : {2, 3}
    """

    def __init__(self, path: Path, fmi: int) -> None:
        try:
            self._library = ctypes.CDLL(os.fspath(path))
        except OSError as error:
            raise BadInput("library", Text(str(error)), "a shared library for this machine", file=path) from None
        self.fmi = fmi
        self.messages: list[tuple[int, str, str]] = []
        self._log_3 = _LOG_3(lambda _, status, category, text: self._keep(status, category, text))
        self._log_2 = _LOG_2(lambda _, name, status, category, form, value: self._keep_2(status, category, form, value))
        memory = ctypes.CDLL(None) if os.name != "nt" else ctypes.cdll.msvcrt
        self._callbacks = _Callbacks2(
            self._log_2, ctypes.cast(memory.calloc, c_void_p).value, ctypes.cast(memory.free, c_void_p).value, None, None
        )

    def has(self, name: str) -> bool:
        """Whether the library exports a function."""
        return hasattr(self._library, name)

    def call(self, name: str, *arguments: Any) -> int:
        """Call a function of the standard, named without its prefix, and return its status."""
        return int(self.function(name)(*arguments))

    def function(self, name: str, result: Any = c_int) -> Any:
        """Return a function of the standard, named without its prefix."""
        try:
            function = self._library[f"fmi{self.fmi}{name}"]
        except AttributeError:
            raise BadInput("library", Text(f"no function fmi{self.fmi}{name}"), "all functions of the standard") from None
        function.restype = result
        return function

    def instantiate(self, name: str, token: str, resources: Path | None, *, logging: bool = False) -> int | None:
        """Return the handle of a new instance, or None when the FMU refuses."""
        text = [c_char_p(part.encode()) for part in (name, token)]
        if self.fmi == 3:
            # The standard wants a separator at the end.
            place = c_char_p(None if resources is None else os.fsencode(f"{resources}{os.sep}"))
            make = self.function("InstantiateCoSimulation", c_void_p)
            off = c_bool(False)
            return make(*text, place, off, c_bool(logging), off, off, None, c_size_t(0), None, self._log_3, None)
        place = c_char_p(None if resources is None else resources.as_uri().encode())
        make = self.function("Instantiate", c_void_p)
        return make(text[0], c_int(1), text[1], place, byref(self._callbacks), c_int(0), c_int(logging))

    def release(self) -> None:
        """Let the library give back what must not wait for the end of the process.

        Libraries of PythonFMU and PythonFMU3 do so when the process ends, but then write into memory that they have freed just
        before, which can end the process with "corrupted double-linked list". Done before, it is not done again. Every FMU is
        unpacked into a folder of its own, so that no other instance shares the library.
        """
        if hasattr(self._library, "finalizePythonInterpreter"):
            self._library.finalizePythonInterpreter()

    def last_message(self) -> str:
        """Return what the FMU logged last."""
        return self.messages[-1][2] if self.messages else "the FMU says nothing of it"

    def _keep(self, status: int, category: bytes | None, text: bytes | None) -> None:
        # A slave that complains in every step must not fill the memory.
        if len(self.messages) < 10_000:
            words = [(part or b"").decode(errors="replace") for part in (category, text)]
            self.messages.append((status, words[0], words[1]))

    def _keep_2(self, status: int, category: bytes | None, form: bytes | None, value: int | None) -> None:
        # On Apple silicon further arguments are elsewhere.
        if form == b"%s" and value and not (sys.platform == "darwin" and platform.machine() == "arm64"):
            form = ctypes.string_at(value)
        self._keep(status, category, form)


class ImportedSlave(Partner):
    """An FMU for co-simulation, FMI 2.0 or 3.0, from any tool.

    It is unpacked into a temporary folder that `free` removes.

    Parameters
    ----------
    path : path
        The FMU.
    name : str, optional
        Name of the instance.
    logging : bool
        Whether the FMU is asked to log what it does.

    Attributes
    ----------
    description : Description
    library : Library
    """

    def __init__(self, path: str | os.PathLike[str], *, name: str | None = None, logging: bool = False) -> None:
        self.path = checks.path("path", path)
        self.description = read_description(path)
        self.name = self.path.stem if name is None else checks.text("name", name)
        self.variables = {v.name: v for v in self.description.variables}
        self.can_rollback = self.description.flag(f"canGetAndSetFMU{'S' if self.fmi == 3 else 's'}tate")
        self.can_vary_step = self.description.flag("canHandleVariableCommunicationStepSize")
        self.internal_step = self.description.number("fixedInternalStepSize")
        folder = Path(tempfile.mkdtemp(prefix="armrs-fmu-"))
        try:
            unpack(path, folder)
            self.library = Library(library_path(folder, self.description, path), self.fmi)
            resources = folder / "resources"
            resources.mkdir(exist_ok=True)
            handle = self.library.instantiate(self.name, self.description.token, resources, logging=logging)
            if not handle:
                raise SlaveError("instantiate", Status.ERROR, f"{self.path.name}: {self.library.last_message()}")
        except BaseException:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        self._handle: int | None = handle
        # Also at the end of the process, while there still is an interpreter that a library may need.
        self._release = weakref.finalize(self, _release, self.library, handle, folder)

    @property
    def fmi(self) -> int:
        """Major version of the standard: 2 or 3."""
        return self.description.fmi

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
            self._call("EnterInitializationMode", *known)
        else:
            self._call("SetupExperiment", *known)
            self._call("EnterInitializationMode")

    def exit_initialization_mode(self) -> None:
        """End the initialization."""
        self._call("ExitInitializationMode")

    def set(self, names: Sequence[str] | str, values: Any) -> None:
        """Set variables by name; those of one type in one call."""
        listing = listed(names)
        given = [values] if isinstance(names, str) and not isinstance(values, (list, tuple, np.ndarray)) else list(values)
        for kind, places in self._by_type(listing).items():
            ctype, extra = self._ctype(kind), (c_size_t(len(places)),) if self.fmi == 3 else ()
            content = [_c_value(kind, given[k]) for k in places]
            self._call(f"Set{self._in_c(kind)}", *self._references(listing, places), (ctype * len(places))(*content), *extra)

    def get(self, names: Sequence[str] | str) -> np.ndarray:
        """Return variables by name as floating point numbers, shape (len(names),)."""
        listing = listed(names)
        out = np.empty(len(listing))
        for kind, places in self._by_type(listing).items():
            room = (self._ctype(kind) * len(places))()
            extra = (c_size_t(len(places)),) if self.fmi == 3 else ()
            self._call(f"Get{self._in_c(kind)}", *self._references(listing, places), room, *extra)
            out[places] = list(room)
        return out

    def do_step(self, time: float, step: float) -> StepResult:
        """Make a communication step from a time [s], of a length [s]."""
        if self.fmi == 3:
            flags = [c_bool() for _ in range(3)]
            last = c_double(time + step)
            places = (*(byref(flag) for flag in flags), byref(last))
            status = self.library.call("DoStep", c_void_p(self._handle), c_double(time), c_double(step), c_bool(False), *places)
            event, terminate, early = (flag.value for flag in flags)
            reached = last.value
        else:
            status = self.library.call("DoStep", c_void_p(self._handle), c_double(time), c_double(step), c_int(0))
            event = terminate = early = False
            reached = time + step if status <= Status.WARNING else self._reached(time)
        if status > Status.DISCARD:
            raise SlaveError("do_step", status, self.library.last_message())
        message = self.library.last_message() if status == Status.DISCARD else ""
        return StepResult(Status(status), reached, event, terminate, early, message)

    def get_state(self) -> c_void_p:
        """Return the state, to come back to it."""
        state = c_void_p()
        self._call("GetFMUState" if self.fmi == 3 else "GetFMUstate", byref(state))
        return state

    def set_state(self, state: c_void_p) -> None:
        """Come back to a state."""
        self._call("SetFMUState" if self.fmi == 3 else "SetFMUstate", state)

    def free_state(self, state: c_void_p) -> None:
        """Give a state back."""
        self._call("FreeFMUState" if self.fmi == 3 else "FreeFMUstate", byref(state))

    def serialize_state(self, state: c_void_p) -> bytes:
        """Return a state as bytes."""
        size = c_size_t()
        self._call(f"SerializedFMU{self._s}tateSize", state, byref(size))
        room = ctypes.create_string_buffer(size.value)
        self._call(f"SerializeFMU{self._s}tate", state, room, size)
        return room.raw

    def deserialize_state(self, state: bytes) -> c_void_p:
        """Return the state that was serialized."""
        made = c_void_p()
        word = "Deserialize" if self.fmi == 3 else "DeSerialize"
        self._call(f"{word}FMU{self._s}tate", state, c_size_t(len(state)), byref(made))
        return made

    def get_output_derivatives(self, names: Sequence[str] | str, orders: Sequence[int] | None = None) -> np.ndarray:
        """Return time derivatives of outputs."""
        listing = listed(names)
        n = len(listing)
        room, order = (c_double * n)(), (c_int * n)(*([1] * n if orders is None else orders))
        word = "GetOutputDerivatives" if self.fmi == 3 else "GetRealOutputDerivatives"
        extra = (c_size_t(n),) if self.fmi == 3 else ()
        self._call(word, *self._references(listing, range(n)), order, room, *extra)
        return np.array(room)

    def terminate(self) -> None:
        """End the run."""
        self._call("Terminate")

    def reset(self) -> None:
        """Go back to how the slave was made."""
        self._call("Reset")

    def free(self) -> None:
        """Free the instance and remove the temporary folder."""
        self._handle = None
        self._release()

    @property
    def _s(self) -> str:
        return "S" if self.fmi == 3 else "s"

    def _call(self, name: str, *arguments: Any) -> None:
        status = self.library.call(name, c_void_p(self._handle), *arguments)
        if status > Status.WARNING:
            raise SlaveError(name, status, self.library.last_message())

    def _reached(self, time: float) -> float:
        last = c_double(time)
        self.library.call("GetRealStatus", c_void_p(self._handle), c_int(2), byref(last))
        return last.value

    def _by_type(self, names: list[str]) -> dict[str, list[int]]:
        groups: dict[str, list[int]] = {}
        for place, name in enumerate(names):
            if name not in self.variables:
                raise unknown_name(self.name, name, self.variables, what="variable")
            kind = self.variables[name].type
            if kind not in _C_TYPES or (self.fmi == 2 and kind not in _NAMES_IN_2):
                raise BadInput(f"{self.name}, {name}", Text(f"a variable of type {kind}"), "a scalar number, truth value or text")
            groups.setdefault(kind, []).append(place)
        return groups

    def _ctype(self, kind: str) -> Any:
        return c_int if self.fmi == 2 and kind == "Boolean" else _C_TYPES[kind]

    def _in_c(self, kind: str) -> str:
        return _NAMES_IN_2[kind] if self.fmi == 2 else kind

    def _references(self, names: list[str], places: Sequence[int]) -> tuple[Any, c_size_t]:
        references = [self.variables[names[k]].reference for k in places]
        return (ctypes.c_uint32 * len(references))(*references), c_size_t(len(references))


def _release(library: Library, handle: int, folder: Path) -> None:
    library.function("FreeInstance", None)(c_void_p(handle))
    library.release()
    shutil.rmtree(folder, ignore_errors=True)


def library_path(folder: Path, description: Description, file: str | os.PathLike[str]) -> Path:
    """Return the library of an unpacked FMU for this machine."""
    place, suffix = platform_folder(description.fmi)
    path = folder / "binaries" / place / f"{description.identifier}{suffix}"
    if not path.is_file():
        raise BadInput("library", Text("nothing"), f"binaries/{place}/{description.identifier}{suffix}", file=file)
    return path


def _c_value(kind: str, value: Any) -> Any:
    if kind == "String":
        return str(value).encode()
    if kind == "Boolean":
        return bool(value)
    return float(value) if kind.startswith("Float") else int(value)
