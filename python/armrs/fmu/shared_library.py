"""The C interface of FMI 2.0 or 3.0 of the shared library of an FMU."""

from __future__ import annotations

import ctypes
import os
import platform
import re
import sys
from ctypes import byref, c_bool, c_char_p, c_double, c_float, c_int, c_size_t, c_void_p
from pathlib import Path
from typing import Any

from ..errors import BadInput, Text
from .description import Description

C_TYPES: dict[str, Any] = {
    "Float64": c_double,
    "Float32": c_float,
    "Boolean": c_bool,
    "String": c_char_p,
    **{f"{sign}Int{bits}": getattr(ctypes, f"c_{sign.lower()}int{bits}") for sign in ("", "U") for bits in (8, 16, 32, 64)},
}
"""Types of FMI 3.0 that are read and set."""
NAMES_IN_2 = {"Float64": "Real", "Int32": "Integer", "Boolean": "Boolean", "String": "String"}

_LOG_3 = ctypes.CFUNCTYPE(None, c_void_p, c_int, c_char_p, c_char_p)
# The sixth argument is the first after the format: the value of "%s".
_LOG_2 = ctypes.CFUNCTYPE(None, c_void_p, c_char_p, c_int, c_char_p, c_char_p, c_void_p)
UPDATE_3 = ctypes.CFUNCTYPE(None, c_void_p, c_double, c_bool, c_bool, c_bool, c_bool, ctypes.POINTER(c_bool), ctypes.POINTER(c_double))
"""Intermediate update of FMI 3.0."""
UPDATE_CLOCKS_3 = ctypes.CFUNCTYPE(None, c_void_p)
"""Clock update of scheduled execution in FMI 3.0."""
_C_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


class _Callbacks2(ctypes.Structure):
    _fields_ = [
        ("logger", _LOG_2),
        ("allocate", c_void_p),
        ("free", c_void_p),
        ("step_finished", c_void_p),
        ("environment", c_void_p),
    ]


class Library:
    """The shared library of an FMU with the functions of one version of the standard; it keeps what the FMU logs.

    Parameters
    ----------
    path : Path
        The shared library.
    fmi : {2, 3}
    """

    def __init__(self, path: Path, fmi: int) -> None:
        self._functions: dict[str, Any] = {}
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
        """Return a function of the standard, named without its prefix; it is looked up once."""
        function = self._functions.get(name)
        if function is None:
            try:
                function = self._library[f"fmi{self.fmi}{name}"]
            except AttributeError:
                raise BadInput("library", Text(f"no function fmi{self.fmi}{name}"), "all functions of the standard") from None
            function.restype = result
            self._functions[name] = function
        return function

    def instantiate(self, name: str, token: str, resources: Path | None, *, logging: bool = False, **mode: Any) -> int | None:
        """Return the handle of a new instance for co-simulation, or for scheduled execution, or None when the FMU refuses.

        Parameters
        ----------
        name, token : str
        resources : Path, optional
        logging : bool
        **mode
            FMI 3.0: `event_mode`, whether the event mode is used; `early`, whether a step may return early; `intermediate`, the callback
            of the intermediate update; `required`, the value references that are read and set in it; `scheduled`, for an instance for
            scheduled execution instead, the callbacks for updates of clocks, and for what must not be interrupted.
        """
        text = [c_char_p(part.encode()) for part in (name, token)]
        if "scheduled" in mode:
            make = self.function("InstantiateScheduledExecution", c_void_p)
            return make(*text, _folder(resources), c_bool(False), c_bool(logging), None, self._log_3, *mode["scheduled"])
        if self.fmi == 3:
            make = self.function("InstantiateCoSimulation", c_void_p)
            modes = [c_bool(mode.get(word, False)) for word in ("event_mode", "early")]
            required = mode.get("required", ())
            references = (ctypes.c_uint32 * len(required))(*required)
            calls = (None, self._log_3, mode.get("intermediate") or c_void_p(None))
            return make(*text, _folder(resources), c_bool(False), c_bool(logging), *modes, references, c_size_t(len(required)), *calls)
        make = self.function("Instantiate", c_void_p)
        return make(text[0], c_int(1), text[1], _uri(resources), byref(self._callbacks), c_int(0), c_int(logging))

    def instantiate_model_exchange(self, name: str, token: str, resources: Path | None) -> int | None:
        """Return the handle of a new instance for Model Exchange, or None when the FMU refuses."""
        text = [c_char_p(part.encode()) for part in (name, token)]
        if self.fmi == 3:
            make = self.function("InstantiateModelExchange", c_void_p)
            return make(*text, _folder(resources), c_bool(False), c_bool(False), None, self._log_3)
        make = self.function("Instantiate", c_void_p)
        return make(text[0], c_int(0), text[1], _uri(resources), byref(self._callbacks), c_int(0), c_int(0))

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
        return self.messages[-1][2] if self.messages else "the FMU gives no reason"

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


def _folder(resources: Path | None) -> c_char_p:
    # The standard requires a separator at the end.
    return c_char_p(None if resources is None else os.fsencode(f"{resources}{os.sep}"))


def _uri(resources: Path | None) -> c_char_p:
    return c_char_p(None if resources is None else resources.as_uri().encode())


def platform_folder(fmi: int) -> tuple[str, str]:
    """Return the folder of libraries for this machine below `binaries`, and the suffix of libraries."""
    system = {"linux": "linux", "win32": "windows", "darwin": "darwin"}.get(sys.platform, sys.platform)
    suffix = {"linux": ".so", "windows": ".dll", "darwin": ".dylib"}.get(system, ".so")
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine().lower())
    if fmi == 3:
        return f"{machine}-{system}", suffix
    bits = 64 if sys.maxsize > 2**32 else 32
    return ("darwin64" if system == "darwin" else f"{ {'windows': 'win'}.get(system, system) }{bits}"), suffix


def library_path(folder: Path, description: Description, file: str | os.PathLike[str], interface: str = "") -> Path:
    """Return the library of an unpacked FMU for this machine; each interface may have one of its own, co-simulation goes before."""
    identifier = description.interfaces[interface].get("modelIdentifier", "") if interface else description.identifier
    if not _C_NAME.fullmatch(identifier):
        # A path here would load a library from outside the archive.
        raise BadInput("modelIdentifier", identifier, "a C identifier", file=file)
    place, suffix = platform_folder(description.fmi)
    path = folder / "binaries" / place / f"{identifier}{suffix}"
    if not path.is_file():
        raise BadInput("library", Text("nothing"), f"binaries/{place}/{identifier}{suffix}", file=file)
    return path
