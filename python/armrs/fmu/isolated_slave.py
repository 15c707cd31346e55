"""An FMU as a slave in a process of its own, so that a crash or hang does not affect this process."""

from __future__ import annotations

import base64
import os
import shutil
import tempfile
import weakref
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import checks
from ..errors import BadInput, SlaveError, Text, unknown_name
from .archive import unpack
from .confined_process import Confined, ProcessEnded
from .description import read_description
from .imported_slave import describe
from .shared_library import library_path
from .slave_interface import Partner, Status, StepResult, listed

_SECONDS = 60.0
"""Longest time of one call."""


class IsolatedSlave(Partner):
    """An FMU for co-simulation, FMI 2.0 or 3.0, from any tool, in a process of its own.

    The process has limits of memory, output and time, may write only to a temporary folder of its own where the system allows this
    (see `armrs.fmu.process_limits`), and is ended with all that it has started. A slave that crashes, ends itself or hangs raises a
    `SlaveError` with the status FATAL.

    Parameters
    ----------
    path : path
        The FMU.
    name : str, optional
        Name of the instance.
    logging : bool
        Whether logging of the FMU is switched on.
    seconds : float
        Longest time of one call [s].

    Attributes
    ----------
    description : Description
    """

    def __init__(self, path: str | os.PathLike[str], *, name: str | None = None, logging: bool = False, seconds: float = _SECONDS) -> None:
        self.path = checks.path("path", path)
        self.description = read_description(path)
        describe(self, self.path, self.description, name)
        # Inputs travel with the next call, and what was read after the last step comes with the next step: one way there and back a step.
        self._stepping = False
        self._pending: list[tuple[Any, Any]] = []
        self._wanted: dict[tuple[str, ...], None] = {}
        self._fresh: dict[tuple[str, ...], list[float]] = {}
        self._seconds = checks.number("seconds", seconds, above=0.0, unit="s")
        folder = Path(tempfile.mkdtemp(prefix="armrs-fmu-"))
        process = None
        try:
            unpack(path, folder / "fmu")
            library_path(folder / "fmu", self.description, path)
            process = Confined("armrs.fmu.worker", folder)
            self._process = process
            process.send({"task": "serve", "path": str(self.path.resolve()), "name": self.name, "logging": logging})
            self._receive("instantiate")
            self._receive("instantiate")
        except BaseException:
            _release(process, folder)
            raise
        self._release = weakref.finalize(self, _release, process, folder)

    def enter_initialization_mode(self, start: float = 0.0, stop: float | None = None, tolerance: float | None = None) -> None:
        """Begin the initialization."""
        self._call("enter_initialization_mode", start, stop, tolerance)

    def exit_initialization_mode(self) -> None:
        """End the initialization."""
        self._call("exit_initialization_mode")
        self._stepping = True

    def set(self, names: Sequence[str] | str, values: Any) -> None:
        """Set variables by name."""
        self._known(names)
        self._fresh.clear()
        listing = names if isinstance(names, str) else list(names)
        given = values.tolist() if isinstance(values, np.ndarray) else values
        if self._stepping:
            self._pending.append((listing, given))
        else:
            self._call("set", listing, given)

    def get(self, names: Sequence[str] | str) -> np.ndarray:
        """Return variables by name, shape (len(names),)."""
        key = (names,) if isinstance(names, str) else tuple(names)
        found = self._fresh.get(key)
        if found is None:
            self._known(key)
            self._wanted[key] = None
            found = self._call("get", list(key))
        return np.array(found, dtype=float)

    def do_step(self, time: float, step: float) -> StepResult:
        """Make a communication step from a time [s], of a length [s]."""
        wanted = list(self._wanted)
        (status, *rest), values = self._call("do_step", float(time), float(step), wanted)
        self._fresh = dict(zip(wanted, values, strict=False))
        return StepResult(Status(status), *rest)

    def get_state(self) -> int:
        """Return the state, to come back to it."""
        return int(self._call("get_state"))

    def set_state(self, state: int) -> None:
        """Come back to a state."""
        self._call("set_state", state)

    def free_state(self, state: int) -> None:
        """Give a state back."""
        self._call("free_state", state)

    def serialize_state(self, state: int) -> bytes:
        """Return a state as bytes."""
        return base64.b64decode(self._call("serialize_state", state))

    def deserialize_state(self, state: bytes) -> int:
        """Return the state that was serialized."""
        return int(self._call("deserialize_state", base64.b64encode(state).decode()))

    def get_output_derivatives(self, names: Sequence[str] | str, orders: Sequence[int] | None = None) -> np.ndarray:
        """Return time derivatives of outputs."""
        return np.array(self._call("get_output_derivatives", listed(names), None if orders is None else list(orders)))

    def terminate(self) -> None:
        """End the run."""
        self._call("terminate")

    def reset(self) -> None:
        """Go back to how the slave was made."""
        self._pending.clear()
        self._stepping = False
        self._call("reset")

    def free(self) -> None:
        """End the process and remove the temporary folder."""
        self._release()

    def _known(self, names: Sequence[str] | str) -> None:
        for name in listed(names):
            if self.element(name) is None:
                raise unknown_name(self.name, name, self.variables, what="variable")

    def _call(self, call: str, *given: Any) -> Any:
        pending, self._pending = self._pending, []
        self._fresh = {}
        try:
            self._process.send({"call": call, "with": given, "set": pending})
        except ProcessEnded as error:
            raise self._ended(call, error) from None
        return self._receive(call).get("value")

    def _receive(self, call: str) -> dict[str, Any]:
        try:
            answer = self._process.receive(self._seconds)
        except ProcessEnded as error:
            raise self._ended(call, error) from None
        if "slave_error" in answer:
            function, status, message = answer["slave_error"]
            raise SlaveError(function, Status(status) if 0 <= status <= Status.FATAL else Status.FATAL, message)
        if "bad_input" in answer:
            place, found, allowed, kind = answer["bad_input"]
            raise BadInput(place, Text(found), allowed, file=self.path, kind=kind)
        return answer

    def _ended(self, call: str, error: ProcessEnded) -> SlaveError:
        said = f" (it printed: {error.printed[:200]})" if error.printed else ""
        return SlaveError(call, Status.FATAL, f"{self.path.name} {error.how}{said}")


def _release(process: Confined | None, folder: Path) -> None:
    if process is not None:
        process.close()
    shutil.rmtree(folder, ignore_errors=True)
