"""Instructions of a call, which do not depend on the load of the machine: counted by valgrind, programs in C, C++ and Rust only.

A program makes a call once more often in one run than in another; the difference is the call, and start-up falls out.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from typing import Any

import problem
from programs import Missing, Peer, countable
from workloads import Measured

NATIVE = ("armrs, Rust", "limit", "limit, nothing fused", "MuJoCo, C", "Pinocchio, C++")
WORKLOADS = ("W1", "W2", "W2a", "W3", "W3a", "W4")


def collected(command: list[str], given: str) -> int:
    """Return the instructions of a whole run of a program with an input."""
    line = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", *command]
    done = subprocess.run(line, input=given, capture_output=True, text=True, check=False)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode or found is None:
        raise Missing(f"valgrind: {done.stderr.strip().splitlines()[-1] if done.stderr.strip() else 'no count'}")
    return int(found[1])


def measure(peers: dict[str, Peer], items: list[Measured], chosen: dict[str, dict[str, Any]]) -> tuple[dict[str, float], dict[str, str]]:
    """Return the instructions of every measurement, for the unit that its time has; and why others have none."""
    if shutil.which("valgrind") is None:
        return {}, {"instructions": "no program valgrind"}
    counts: dict[str, float] = {}
    missing: dict[str, str] = {}
    commands = {tool: countable(tool, peer.command) for tool, peer in peers.items() if tool in NATIVE}
    for item in items:
        if item.tool not in commands or item.workload not in WORKLOADS:
            continue
        # Threads wait for each other, and the finest steps would take minutes.
        if ":wall:" in item.task or ":fine" in item.task:
            continue
        task = f"{item.task}:{chosen[item.key]['rung']}" if item.ladder else item.task
        # A kernel is called for all states at once, and is too short for one call.
        calls, units = (100, 100 * problem.STATES) if item.workload == "W1" else (1, item.units)
        print(f"instructions of {task} of {item.tool}", file=sys.stderr, flush=True)
        try:
            once, more = (collected(commands[item.tool], f"exactly:{n}\n{task}\n") for n in (0, calls))
            counts[item.key] = (more - once) / units
        except Missing as reason:
            missing[f"instructions of {item.tool}"] = str(reason)
    return counts, missing
