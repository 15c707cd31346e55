"""The program of the process that runs foreign code: it serves one FMU to an `IsolatedSlave`, or tests one for `armrs fmu check`."""

from __future__ import annotations

import base64
import contextlib
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ArmrsError, BadInput, SlaveError
from . import process_limits
from .confined_process import Channel


def main() -> None:
    """Restrict this process, and do the task of the first message."""
    channel = Channel()
    life = int(sys.argv[1])
    if life >= 0:
        process_limits.end_with(life)
    task = channel.receive()
    if task is None:
        return
    # Everything that is needed is imported before the limits hold.
    if task["task"] == "try":
        from . import library_probe

        channel.send({"unlimited": process_limits.restrict(channel.folder)})
        library_probe.run(Path(task["path"]), channel.folder / "fmu", channel.send, task["part"])
    else:
        from .imported_slave import ImportedSlave

        channel.send({"unlimited": process_limits.restrict(channel.folder)})
        _serve(channel, lambda: ImportedSlave(task["path"], name=task["name"], logging=task["logging"], folder=channel.folder / "fmu"))


def _serve(channel: Channel, make: Callable[[], Any]) -> None:
    """Answer calls until the pipe is closed."""
    slave, states, last = None, {}, 0
    try:
        slave = make()
        channel.send({})
        while (message := channel.receive()) is not None:
            try:
                answer: dict[str, Any] = {}
                for names, values in message.get("set", ()):
                    slave.set(names, np.array(values, dtype=float) if _all_floats(values) else values)
                call, given = message["call"], message.get("with", [])
                if call == "get_state":
                    last += 1
                    states[last] = slave.get_state()
                    answer["value"] = last
                elif call == "set_state":
                    slave.set_state(states[given[0]])
                elif call == "free_state":
                    slave.free_state(states.pop(given[0]))
                elif call == "serialize_state":
                    answer["value"] = base64.b64encode(slave.serialize_state(states[given[0]])).decode()
                elif call == "deserialize_state":
                    last += 1
                    states[last] = slave.deserialize_state(base64.b64decode(given[0]))
                    answer["value"] = last
                elif call == "do_step":
                    done = slave.do_step(*given[:2])
                    result = [int(done.status), done.last_successful_time, done.event, done.terminate, done.early_return, done.message]
                    answer["value"] = [result, [slave.get(names).tolist() for names in given[2]] if done.status <= 1 else []]
                elif call in ("get", "get_output_derivatives"):
                    answer["value"] = getattr(slave, call)(*given).tolist()
                else:
                    getattr(slave, call)(*given)
            except ArmrsError as error:
                answer = _refusal(error)
            channel.send(answer)
        # The parent is done: what the library does at its end is its own affair.
        with contextlib.suppress(ArmrsError):
            slave.free()
    except ArmrsError as error:
        channel.send(_refusal(error))
    os._exit(0)


def _all_floats(values: Any) -> bool:
    return isinstance(values, list) and all(type(v) is float for v in values)


def _refusal(error: ArmrsError) -> dict[str, Any]:
    if isinstance(error, SlaveError):
        return {"slave_error": [error.function, int(error.status), error.message]}
    if isinstance(error, BadInput):
        return {"bad_input": [error.place, str(error.found), error.allowed, error.kind]}
    return {"slave_error": ["call", 3, str(error)]}


if __name__ == "__main__":
    main()
