"""The library of an FMU, tried: run as a process of its own, it writes what it finds as lines of JSON."""

from __future__ import annotations

import ctypes
import json
import struct
import sys
import tempfile
from pathlib import Path

import numpy as np

from ..cosim.imported import ImportedSlave, Library, library_path
from ..cosim.partner import Status, Variable
from ..errors import ArmrsError
from . import names
from .description import Description, read_description, unpack


def _write(record: dict[str, str]) -> None:
    print(f"probe:{json.dumps(record)}", flush=True)


def _step(what: str) -> None:
    """Say what comes next, for the case that it crashes."""
    _write({"step": what})


def _find(place: str, text: str, level: str = "error") -> None:
    _write({"level": level, "place": place, "text": text})


def main(path: str) -> None:
    """Try an FMU from its library to a step made twice."""
    _step("loading the library")
    description = read_description(path)
    if not _symbols(path, description):
        return
    _step("making an instance")
    try:
        slave = ImportedSlave(path)
    except ArmrsError as error:
        token = "instantiationToken" if description.fmi == 3 else "guid"
        _find("library, instantiate", f"refused with the {token} {description.token!r}: {error}")
        return
    version = slave.library.function("GetVersion", ctypes.c_char_p)().decode()
    if version.split(".")[0] != str(description.fmi):
        _find("library, GetVersion", f"{version}, the description has {description.version}")
    _step("comparing start values")
    _starts(slave)
    _step("initializing")
    slave.enter_initialization_mode(0.0)
    slave.exit_initialization_mode()
    _steps(slave)
    _step("ending")
    slave.terminate()
    slave.free()


def _symbols(path: str, description: Description) -> bool:
    with tempfile.TemporaryDirectory(prefix="armrs-fmu-") as folder:
        unpack(path, Path(folder))
        library = Library(library_path(Path(folder), description, path), description.fmi)
        missing = [
            f"fmi{description.fmi}{name}" for name in names.FUNCTIONS[description.fmi] if not library.has(f"fmi{description.fmi}{name}")
        ]
    if missing:
        _find("library", f"{len(missing)} functions of the standard are missing: {', '.join(missing[:5])}")
    return not missing


def _starts(slave: ImportedSlave) -> None:
    """Compare what the library holds with what the description says, to the last bit."""
    for v in slave.variables.values():
        if v.start is None or v.type != "Float64" or v.causality == "independent":
            continue
        try:
            found = float(slave.get(v.name)[0])
        except ArmrsError as error:
            _find(f"variable {v.name}", f"cannot be read: {error}")
            return
        if not _same(found, float(v.start)):
            _find(f"variable {v.name}", f"start is {v.start!r} in the description and {found!r} in the library")


def _steps(slave: ImportedSlave) -> None:
    asked = slave.description.experiment.get("stepSize")
    try:
        size = float(asked or slave.internal_step or 0.01)
    except ValueError:
        size = slave.internal_step or 0.01  # what the description says wrong is a finding of its own
    outputs = [v.name for v in slave.variables.values() if v.causality == "output" and _readable(v)]
    _step("making a step")
    if not slave.can_rollback:
        _find("CoSimulation", "states cannot be kept: it takes part in no iterated coupling", "note")
        _advance(slave, size, outputs)
        return
    state = slave.get_state()
    once = _advance(slave, size, outputs)
    _step("going back to a state")
    slave.set_state(state)
    again = _advance(slave, size, outputs)
    for name, a, b in zip(outputs, once, again, strict=True):
        if not _same(a, b):
            _find("library, SetFMUState", f"{name} is {a!r} after a step and {b!r} after going back and making it again")
    _serialized(slave, state, outputs, (size, once))
    slave.free_state(state)


def _serialized(slave: ImportedSlave, state: object, outputs: list[str], expected: tuple[float, np.ndarray]) -> None:
    if not slave.description.flag(f"canSerializeFMU{'S' if slave.fmi == 3 else 's'}tate"):
        return
    _step("writing a state as bytes")
    size, once = expected
    copy = slave.deserialize_state(slave.serialize_state(state))  # type: ignore[arg-type]
    slave.set_state(copy)
    slave.free_state(copy)
    for name, a, b in zip(outputs, once, _advance(slave, size, outputs), strict=True):
        if not _same(a, b):
            _find("library, SerializeFMUState", f"{name} is {a!r} after a step and {b!r} from the state read back")


def _advance(slave: ImportedSlave, size: float, outputs: list[str]) -> np.ndarray:
    done = slave.do_step(0.0, size)
    if done.status > Status.WARNING:
        _find("library, DoStep", f"the first step of {size} s is discarded: {done.message}")
    values = slave.get(outputs)
    for name, value in zip(outputs, values, strict=True):
        if not np.isfinite(value):
            _find(f"variable {name}", f"is {value} after the first step")
    return values


def _readable(v: Variable) -> bool:
    return v.type == "Float64"


def _same(a: float, b: float) -> bool:
    return struct.pack("<d", a) == struct.pack("<d", b)


if __name__ == "__main__":
    try:
        main(sys.argv[1])
    except ArmrsError as refused:
        _find("library", str(refused))
    _step("end")
