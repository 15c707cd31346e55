"""The tools as programs: compiled where they need it, started, called."""

from __future__ import annotations

import importlib.util
import json
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path
from typing import Any

TOOLS = Path(__file__).parent / "tools"


class Missing(Exception):
    """A tool cannot run here."""


class Peer:
    """A program that answers a line with a line of JSON."""

    def __init__(self, command: list[str]) -> None:
        self.command = command
        self._program = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        # Its first response, to an unknown request, shows that it runs.
        self.ask("ready")

    def ask(self, task: str) -> Any:
        """Return the response of the program; None where it has no such task."""
        assert self._program.stdin and self._program.stdout
        try:
            self._program.stdin.write(f"{task}\n")
            self._program.stdin.flush()
            line = self._program.stdout.readline()
        except BrokenPipeError:
            line = ""
        if not line:
            raise Missing(f"the program stopped at {task!r}, status {self._program.wait()}")
        return json.loads(line)

    def stop(self) -> None:
        """End the program."""
        if self._program.stdin:
            self._program.stdin.close()
        self._program.wait()


def _package(name: str) -> Path:
    found = importlib.util.find_spec(name)
    if found is None or not found.submodule_search_locations:
        raise Missing(f"the Python package {name} is not installed")
    return Path(next(iter(found.submodule_search_locations)))


def _compile(work: Path, source: str, program: str, compiler: str, options: list[str]) -> list[str]:
    if shutil.which(compiler) is None:
        raise Missing(f"no compiler {compiler}")
    target = work / program
    command = [compiler, "-O3", f"-I{work}", f"-I{TOOLS}", str(TOOLS / source), "-o", str(target), *options, "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise Missing(f"{source} does not compile: {next((x for x in done.stderr.splitlines() if 'error' in x), done.stderr[:200])}")
    return [str(target)]


def _limit(work: Path, name: str = "limit", machine: str = "native") -> list[str]:
    return _compile(work, "limit.cpp", name, "c++", [f"-march={machine}", "-std=gnu++17"])


def _unfused(work: Path, name: str = "unfused", machine: str = "native") -> list[str]:
    return _compile(work, "limit.cpp", name, "c++", [f"-march={machine}", "-ffp-contract=off", "-std=gnu++17"])


def countable(tool: str, command: list[str]) -> list[str]:
    """Return the command of a tool for valgrind, which does not know AVX-512: there the hand-written loop is compiled for AVX2."""
    info = Path("/proc/cpuinfo")
    compiled = {"limit": _limit, "limit, nothing fused": _unfused}.get(tool)
    if compiled is None or not info.exists() or "avx512f" not in info.read_text(encoding="utf-8"):
        return command
    program = Path(command[0])
    return compiled(program.parent, f"{program.name}_avx2", "x86-64-v3") + command[1:]


def _mujoco_c(work: Path) -> list[str]:
    package = _package("mujoco")
    library = next(iter(sorted(package.glob("libmujoco*"))), None)
    if library is None or not (package / "include").is_dir():
        raise Missing("the Python package of MuJoCo has no headers or no library here")
    options = ["-march=native", f"-I{package / 'include'}", str(library), f"-Wl,-rpath,{package}"]
    return _compile(work, "mujoco.c", "mujoco_c", "cc", options)


def _pinocchio_c(work: Path) -> list[str]:
    root = Path(sysconfig.get_path("purelib")) / "cmeel.prefix"
    include, library = root / "include", root / "lib"
    if not (include / "pinocchio").is_dir() or not (include / "eigen3").is_dir():
        raise Missing("no headers of Pinocchio or Eigen (packages pin and cmeel-eigen)")
    options = [
        "-std=c++17",
        # As Pinocchio's own build has it: its list of joints is longer than what boost allows by itself.
        "-DBOOST_MPL_LIMIT_LIST_SIZE=30",
        "-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS",
        "-DPINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION",
        "-isystem", str(include), "-isystem", str(include / "eigen3"),
        f"-L{library}", "-lpinocchio_default", f"-Wl,-rpath,{library}",
    ]  # fmt: skip
    return _compile(work, "pinocchio.cpp", "pinocchio_c", "c++", options)


def _python(work: Path, script: str, *packages: str) -> list[str]:
    for name in packages:
        _package(name)
    return [sys.executable, str(TOOLS / script), str(work)]


def start(work: Path, rust: Path) -> tuple[dict[str, Peer], dict[str, str]]:
    """Return the tools that run, and why others do not."""

    def own(_: Path) -> list[str]:
        if not rust.exists():
            raise Missing(f"{rust} is not built")
        return [str(rust), str(work)]

    commands = {
        "armrs, Rust": own,
        "armrs, Python": lambda w: _python(w, "armrs_python.py", "armrs"),
        "limit": _limit,
        "limit, nothing fused": _unfused,
        "MuJoCo, C": _mujoco_c,
        "MuJoCo, Python": lambda w: _python(w, "mujoco_python.py", "mujoco"),
        "Pinocchio, C++": _pinocchio_c,
        "Pinocchio, Python": lambda w: _python(w, "pinocchio_python.py", "pinocchio"),
        "numba": lambda w: _python(w, "numba_python.py", "numba", "scipy"),
        "SciPy": lambda w: _python(w, "scipy_python.py", "scipy"),
    }
    peers: dict[str, Peer] = {}
    missing: dict[str, str] = {}

    def attempt(name: str) -> None:
        try:
            peers[name] = Peer(commands[name](work))
            if name == "armrs, Python":
                peers[name].ask("write_fit")
        except Missing as reason:
            missing[name] = str(reason)
            print(f"skipped: {name}: {reason}", file=sys.stderr)

    for name in commands:
        attempt(name)
    return peers, missing
