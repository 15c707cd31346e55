"""The library as a C program meets it, compiled against the official headers that FMPy carries; under valgrind where there is one.

With libraries of other machines in ARMRS_FMU_LIBRARIES (`scripts/crosscheck fmu` builds them), one FMU holds all of them, and the program
runs on each machine, emulated.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest

from armrs.cosim import Slave
from armrs.cosim.fmu_export import export_fmu
from armrs.demo import true_model
from armrs.fmu.archive import unpack
from armrs.fmu.bundled_libraries import PLATFORMS
from armrs.fmu.description import read_description
from armrs.fmu.shared_library import library_path

SOURCE = Path(__file__).parent / "importer.c"
WINE = SOURCE.parents[1] / "scripts" / "wine" / "run.sh"
START = np.radians([-60.0, 50.0])
LIBRARIES = os.environ.get("ARMRS_FMU_LIBRARIES")
# Compiler, and what runs its programs.
FOREIGN = {
    "aarch64-linux": ("aarch64-linux-gnu-gcc", ["qemu-aarch64-static", "-L", "/usr/aarch64-linux-gnu"]),
    "x86_64-windows": ("x86_64-w64-mingw32-gcc", [str(WINE), str(Path(tempfile.gettempdir()) / "armrs-wine")]),
}
# FMI 2.0 has no folder for aarch64.
ELSEWHERE = [("aarch64-linux", 3), ("x86_64-windows", 2), ("x86_64-windows", 3)] if LIBRARIES else []


def expected() -> list[str]:
    """Return where the slave in Python ends, pushed as the program does."""
    slave = Slave(true_model(), start=START)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    for k in range(200):
        place = k % 40
        slave.set(["handle.F[1]", "der(handle.F[1])"], [0.0625 * min(place, 40 - place), 6.25 if place < 20 else -6.25])
        slave.do_step(k * 0.01, 0.01)
    return [v.hex() for v in slave.get(["q[1]", "q[2]"]).tolist()]


@pytest.mark.parametrize("machine, fmi", [("here", 2), ("here", 3), *ELSEWHERE])
def test_an_importer_in_c(machine: str, fmi: int, tmp_path: Path) -> None:
    fmpy = pytest.importorskip("fmpy")
    compiler, runner = FOREIGN.get(machine, ("cc", [shutil.which("valgrind"), "--quiet", "--leak-check=full", "--error-exitcode=9"]))
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler}")
    program, headers = tmp_path / "importer.exe", Path(fmpy.__file__).parent / "c-code"
    command = [compiler, "-std=c11", "-Wall", "-Werror", f"-DFMI={fmi}", f"-I{headers}", "-o", str(program), str(SOURCE)]
    subprocess.run([*command, *([] if "windows" in machine else ["-ldl"])], check=True)

    path = export_fmu(true_model(), tmp_path / "arm.fmu", fmi=fmi, start=START, libraries=LIBRARIES)
    folder, description = tmp_path / "unpacked", read_description(path)
    unpack(path, folder)
    if machine == "here":
        library = library_path(folder, description, path)
    else:
        known = PLATFORMS[machine]
        library = folder / "binaries" / (machine if fmi == 3 else str(known.folder_of_2)) / f"ArmRs{known.suffix}"
    resources = f"{folder / 'resources'}/" if fmi == 3 else (folder / "resources").as_uri()
    references = {v.name: str(v.reference) for v in description.variables}
    names = ["q[1]", "q[2]", "handle.F[1]", "der(handle.F[1])"]
    arguments = [str(program), str(library), description.token, resources, *(references[name] for name in names)]
    done = subprocess.run([*(r for r in runner if runner[0]), *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    lines = [[float.fromhex(v).hex() for v in line.split()] for line in done.stdout.splitlines()]
    # Straight through, from a state that went through bytes, and again in a second instance.
    assert lines == [expected()] * 4
