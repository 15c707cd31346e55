"""Build the shared library that travels in FMUs and put it into the package."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
NAMES = {"win32": "arm_fmu.dll", "darwin": "libarm_fmu.dylib"}


def main() -> None:
    """Build with the profile `fmu` and copy what came out."""
    subprocess.run(["cargo", "build", "--quiet", "--profile", "fmu", "-p", "arm-fmu"], cwd=ROOT, check=True)
    name = NAMES.get(sys.platform, "libarm_fmu.so")
    place = ROOT / "python" / "armrs" / "fmu" / "lib"
    place.mkdir(exist_ok=True)
    # Renamed into its place: a process that has the old one loaded keeps it.
    part = place / f"{name}.part"
    shutil.copyfile(ROOT / "target" / "fmu" / name, part)
    part.replace(place / name)


if __name__ == "__main__":
    main()
