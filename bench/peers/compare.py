"""armrs beside other tools and a hand-written limit: one run, every tool in turn, ratios of medians.

    compare.py [-o DIR] [--rounds N] [--count] [--rust PROGRAM]

Needs what `requirements.txt` lists, a C++ compiler, and `PYTHONPATH` at the checkout's `python`; `make bench` arranges that. What is
missing is skipped, with the reason in the report.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import time
from importlib import metadata
from pathlib import Path
from typing import Any

import accuracy
import checks
import imports
import instructions
import problem
import report
from programs import Peer, start
from workloads import GOALS, MEASURED

PACKAGES = ("numpy", "scipy", "numba", "mujoco", "pin")


def versions(peers: dict[str, Peer]) -> dict[str, str]:
    """Return what was compared, and on what."""
    found = {
        "date": time.strftime("%Y-%m-%d"),
        "Python": platform.python_version(),
        "machine": platform.machine(),
        "cores": str(os.cpu_count()),
    }
    if hasattr(os, "getloadavg"):
        found["load at the end, this run included"] = f"{os.getloadavg()[0]:.1f}"
    installed = {entry.metadata["Name"].lower(): entry.version for entry in metadata.distributions()}
    found |= {name: installed.get(name, "not installed") for name in PACKAGES}
    compiler = subprocess.run(["c++", "--version"], capture_output=True, text=True, check=False) if "limit" in peers else None
    if compiler:
        found["C++ compiler"] = compiler.stdout.splitlines()[0]
    info = Path("/proc/cpuinfo")
    if info.exists():
        found["processor"] = next((x.split(":")[1].strip() for x in info.read_text().splitlines() if x.startswith("model name")), "")
    return found


def measure(peers: dict[str, Peer], rounds: int, chosen: dict[str, dict[str, Any]]) -> dict[str, list[float]]:
    """Return the times of every measurement, all measured once in each round."""
    times: dict[str, list[float]] = {}
    for number in range(rounds):
        print(f"round {number + 1} of {rounds}", file=sys.stderr, flush=True)
        for item in MEASURED:
            # What takes seconds is measured three times.
            if item.tool in peers and (not item.slow or number < 3) and (not item.ladder or item.key in chosen):
                answer = peers[item.tool].ask(f"{item.task}:{chosen[item.key]['rung']}" if item.ladder else item.task)
                if answer is not None:
                    times.setdefault(item.key, []).append(answer["seconds"] / item.units)
        for key, seconds in imports.measure().items():
            times.setdefault(key, []).append(seconds)
    return times


def main() -> int:
    """Run the comparison; status 1 when the tools do not solve the same problem."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("-o", "--output", type=Path, default=Path("out/bench"))
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--count", action="store_true", help="count instructions too, with valgrind: some minutes")
    parser.add_argument("--rust", type=Path, default=Path("target/release/examples/peer"))
    arguments = parser.parse_args()
    folder = arguments.output
    work = folder / "work"
    problem.write(work)
    peers, missing = start(work, arguments.rust)
    try:
        checked = checks.run(peers)
        right, agreement = accuracy.references(peers)
        checked += agreement
        chosen = accuracy.choose(peers, MEASURED, right)
        times = measure(peers, arguments.rounds, chosen)
        counts, uncounted = instructions.measure(peers, [i for i in MEASURED if i.key in times], chosen) if arguments.count else ({}, {})
    finally:
        for peer in peers.values():
            peer.stop()
    result = {
        "versions": versions(peers),
        "missing": missing | uncounted,
        "checks": checked,
        "accuracy": chosen,
        "seconds": times,
        "instructions": counts,
    }
    result["goals"] = [goal.judge(report.medians(times)) for goal in GOALS]
    (folder / "result.json").write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    words = report.words(result)
    (folder / "table.md").write_text(words, encoding="utf-8")
    report.plots(result, folder)
    print(words)
    wrong = [c for c in checked if not c["agrees"]]
    for check in wrong:
        print(
            f"compare.py: {check['what']} of {check['tool']} is off by {check['found']:.3g}, allowed {check['allowed']:.3g}",
            file=sys.stderr,
        )
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
