"""FMUs that PythonFMU (FMI 2.0) and PythonFMU3 (FMI 3.0) make of Python source: partners that none of us wrote."""

import subprocess
import sys
import zlib
from pathlib import Path

import pytest


def built(folder: Path, source: str, name: str, *options: str, fmi: int = 2) -> Path:
    """Make the FMU of the class `name` in a folder."""
    module = "pythonfmu" if fmi == 2 else "pythonfmu3"
    pytest.importorskip(module)
    # Python imports the source of every FMU that one process loads: each has a name of its own.
    script = f"{name.lower()}_{zlib.crc32(source.encode()):08x}.py"
    (folder / script).write_text(source, encoding="utf-8")
    command = [sys.executable, "-m", module, "build", "-f", script, *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
    fmu = folder / f"{name}.fmu"
    assert fmu.exists(), done.stdout + done.stderr
    return fmu
