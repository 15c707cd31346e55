"""Build the shared library that travels in FMUs and put it into the package.

With `--portable`, for a release on Linux, it is linked against glibc 2.17, so that FMUs run on older systems than the one they were
built on; this needs `pip install ziglang cargo-zigbuild`.
"""

from __future__ import annotations

import platform
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
NAMES = {"win32": "arm_fmu.dll", "darwin": "libarm_fmu.dylib"}


def main() -> None:
    """Build and copy what came out."""
    built = ROOT / "target" / "release"
    command = ["cargo", "build"]
    if "--portable" in sys.argv:
        target = f"{platform.machine()}-unknown-linux-gnu"
        command = ["cargo", "zigbuild", "--target", f"{target}.2.17"]
        built = ROOT / "target" / target / "release"
    subprocess.run([*command, "--quiet", "--release", "-p", "arm-fmu"], cwd=ROOT, check=True)
    name = NAMES.get(sys.platform, "libarm_fmu.so")
    place = ROOT / "python" / "armrs" / "fmu" / "lib"
    place.mkdir(exist_ok=True)
    # Renamed into its place: a process that has the old one loaded keeps it.
    part = place / f"{name}.part"
    shutil.copyfile(built / name, part)
    part.replace(place / name)


if __name__ == "__main__":
    main()
