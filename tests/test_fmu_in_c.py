"""The library as a C program meets it, compiled against the official headers that FMPy carries; under valgrind where there is one."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from armrs.cosim import Slave
from armrs.cosim.library import library_path
from armrs.fmu.archive import unpack
from armrs.fmu.description import read_description
from armrs.fmu.export import export_fmu
from armrs.workflows.demo import true_model

SOURCE = Path(__file__).parent / "importer.c"


def test_an_importer_in_c(tmp_path: Path) -> None:
    fmpy = pytest.importorskip("fmpy")
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler")
    program, headers = tmp_path / "importer", Path(fmpy.__file__).parent / "c-code"
    command = [compiler, "-std=c11", "-Wall", "-Werror", f"-I{headers}", "-o", str(program), str(SOURCE), "-ldl"]
    subprocess.run(command, check=True)
    path = export_fmu(true_model(), tmp_path / "arm.fmu", start=np.radians([-60.0, 50.0]))
    folder, description = tmp_path / "unpacked", read_description(path)
    unpack(path, folder)
    arguments = [str(program), str(library_path(folder, description, path)), description.token, f"{folder / 'resources'}/"]
    if valgrind := shutil.which("valgrind"):
        arguments = [valgrind, "--quiet", "--leak-check=full", "--error-exitcode=9", *arguments]
    done = subprocess.run(arguments, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    slave = Slave(true_model(), start=np.radians([-60.0, 50.0]))
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    for k in range(200):
        slave.do_step(k * 0.01, 0.01)
    expected = [v.hex() for v in slave.get(["q[1]", "q[2]"]).tolist()]
    lines = [[float.fromhex(v).hex() for v in line.split()] for line in done.stdout.splitlines()]
    # Straight through, from a state that went through bytes, and again in a second instance.
    assert lines == [expected] * 4
