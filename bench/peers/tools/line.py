"""What the tools in Python share: the clock, and the conversation. A line comes in, a line of JSON goes out."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from typing import Any

Task = Callable[..., Any]


def seconds_of(call: Callable[[], Any], least: float = 0.1, warm: bool = True) -> dict[str, float]:
    """Repeat a call for about `least` seconds and return the processor time of one, after one that does not count."""
    if warm:
        call()
    # Reading the clock costs as much as some calls: once for many of them where they are short.
    calls, between, start = 0, 1, time.process_time()
    while True:
        for _ in range(between):
            call()
        calls += between
        passed = time.process_time() - start
        if passed >= least:
            return {"seconds": passed / calls}
        if passed < 0.1 * least:
            between *= 2


def serve(tasks: dict[str, Task]) -> None:
    """Answer each line `name` or `name:argument` with what the task returns; with null where there is none."""
    for line in sys.stdin:
        words = line.strip()
        task, arguments = tasks.get(words), []
        if task is None and ":" in words:
            name, _, argument = words.rpartition(":")
            task, arguments = tasks.get(name), [argument]
        print(json.dumps(None if task is None else task(*arguments)), flush=True)
