"""Build the shared library that travels in FMUs, with the licences of what is in it, and put both into the package.

It says which glibc the library needs: that of the system it is built on, roughly. With `--portable`, for a release on Linux, it is
linked against glibc 2.17, so that FMUs run on older systems as well; this needs `pip install ziglang cargo-zigbuild`. With
`--of-tests`, and the packages that cargo is to test after it, it is the one that the Rust tests are compiled with: of the same bits,
slower, and there without compiling anything twice.

`--target TRIPLE` builds for another machine instead (`scripts/foreign.sh` says which and with what). `--into DIR` puts the library where
`armrs fmu export --library DIR` takes it from, and not into the package.
"""

from __future__ import annotations

import json
import os
import platform
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
OLDEST = (2, 17)
SYSTEMS = {"windows": "arm_fmu.dll", "darwin": "libarm_fmu.dylib", "linux": "libarm_fmu.so"}
MACHINES = {"amd64": "x86_64", "arm64": "aarch64"}


def main() -> None:
    """Build and copy what came out."""
    portable, target, into = "--portable" in sys.argv, option("--target"), option("--into")
    machine, system = of(target)
    name = SYSTEMS[system]
    if target or portable:
        built = foreign(target or f"{machine}-unknown-linux-gnu", name, portable)
    else:
        command = ["cargo", "build", "--release", "-p", "arm-fmu"]
        if sys.argv[1:2] == ["--of-tests"]:
            command = ["cargo", "test", "--no-run", "--tests", *sys.argv[2:]]
        built = library(command, name)
    content = built.read_bytes()
    needed = glibc(content)
    if portable and needed > OLDEST:
        sys.exit(f"fmu_library: the library needs glibc {version(needed)}, allowed is {version(OLDEST)} at most")
    top = Path(into) if into else ROOT / "python" / "armrs" / "fmu" / "lib"
    place = top / f"{machine}-{system}" if into else top
    place.mkdir(parents=True, exist_ok=True)
    (top / "license.txt").write_text(licences(), encoding="utf-8")
    # Renamed into its place: a process that has the old one loaded keeps it.
    part = place / f"{name}.part"
    part.write_bytes(content)
    shutil.copymode(built, part)
    part.replace(place / name)
    if any(needed):
        print(f"the library for FMUs needs glibc {version(needed)}")


def option(name: str) -> str:
    """Return the argument after an option, or nothing."""
    return sys.argv[sys.argv.index(name) + 1] if name in sys.argv[:-1] else ""


def of(target: str) -> tuple[str, str]:
    """Return processor and system of a target, or of this machine."""
    if target:
        return target.split("-")[0], next(system for system in SYSTEMS if system in target)
    machine = platform.machine().lower()
    return MACHINES.get(machine, machine), {"win32": "windows"}.get(sys.platform, sys.platform)


def foreign(target: str, name: str, portable: bool) -> Path:
    """Build for another machine, or for older systems."""
    work = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).absolute() / "crosscheck"
    old = portable and target.endswith("linux-gnu")
    glibc = {"ARMRS_GLIBC": version(OLDEST)} if old else {}
    done = subprocess.run([str(ROOT / "scripts" / "foreign.sh"), target, str(work), "-p", "arm-fmu"], check=False, env=os.environ | glibc)
    if done.returncode:
        sys.exit(done.returncode)
    return work / ("portable" if old else "foreign") / target / "release" / name


def library(command: list[str], name: str) -> Path:
    """Run cargo, and return where it put the library."""
    run = subprocess.run([*command, "--quiet", "--message-format=json-render-diagnostics"], cwd=ROOT, check=True, stdout=subprocess.PIPE)
    made = [message for message in map(json.loads, run.stdout.splitlines()) if message["reason"] == "compiler-artifact"]
    files = [Path(file) for message in made if message["target"]["name"] == "arm_fmu" for file in message["filenames"]]
    return next(file for file in files if file.name == name)


def glibc(library: bytes) -> tuple[int, ...]:
    """Return the newest version of glibc that a library names among its needs; (0,) for none."""
    found = re.findall(rb"\0GLIBC_(\d+)\.(\d+)(?:\.\d+)?(?=\0)", library)
    return max(((int(a), int(b)) for a, b in found), default=(0,))


def version(numbers: tuple[int, ...]) -> str:
    """Return a version as it is written."""
    return ".".join(map(str, numbers))


def licences() -> str:
    """Return the licences of armrs, and of every package that is compiled into the library, whole; what says the same stands once."""
    tree = subprocess.run(
        ["cargo", "tree", "-p", "arm-fmu", "-e", "normal,no-proc-macro", "--prefix", "none", "-f", "{p}", "--no-dedupe"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    inside = {tuple(line.split()[:2]) for line in tree.stdout.splitlines()}
    metadata = subprocess.run(["cargo", "metadata", "--format-version", "1"], cwd=ROOT, check=True, capture_output=True)
    packages = [p for p in json.loads(metadata.stdout)["packages"] if (p["name"], f"v{p['version']}") in inside and p["source"]]
    parts = [
        "SPDX-License-Identifier: MIT OR Apache-2.0",
        "armrs, and the library in this FMU, under either of the two licences that follow.",
    ]
    seen: set[str] = set()

    def add(paths: list[Path]) -> None:
        for path in paths:
            text = path.read_text(encoding="utf-8", errors="replace").strip()
            if (words := " ".join(text.split())) not in seen:
                seen.add(words)
                parts.append(text)

    add(sorted(ROOT.glob("LICENSE*")))
    parts.append("Compiled into it, besides Rust's standard library (MIT OR Apache-2.0), each with its licence unless that stands above:")
    for package in sorted(packages, key=lambda p: str(p["name"])):
        parts.append(f"{package['name']} {package['version']}: {package['license']}, {package['repository']}")
        folder = Path(package["manifest_path"]).parent
        texts = sorted(p for p in folder.glob("*") if re.match("(?i)(un)?licen[sc]e|copying|notice", p.name) and p.is_file())
        # Where there is a choice, MIT: it is short.
        add([p for p in texts if "MIT" in p.name.upper()] or texts)
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    main()
