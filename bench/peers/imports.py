"""W5: time of a start of Python that imports a module, beyond an empty one."""

from __future__ import annotations

import importlib.util
import resource
import subprocess
import sys

MODULES = ("numpy", "armrs", "scipy.optimize", "numba", "mujoco", "pinocchio")
LINES = {"empty": "pass"} | {name: f"import {name}" for name in MODULES} | {"armrs, first use": "import armrs; armrs.Arm"}


def measure() -> dict[str, float]:
    """Return the processor time of one start for every module that is installed, by the key of the measurement."""
    return {
        f"import/{name}": _seconds(code)
        for name, code in LINES.items()
        if name.split(",")[0] == "empty" or importlib.util.find_spec(name.split(",")[0].split(".")[0])
    }


def _seconds(code: str) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([sys.executable, "-c", code], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (after.ru_utime + after.ru_stime) - (before.ru_utime + before.ru_stime)
