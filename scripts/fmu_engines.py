"""Our FMUs in other tools: the same run through every co-simulation engine, and what public validators find.

The bits must be those of the slave in Python; nothing may be found. `pip install fmpy libcosimpy ecospy tbb
fmu-manipulation-toolbox`, and `LD_LIBRARY_PATH` with the library tbb for ecos; what is not installed is left out.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from armrs.cosim import Slave
from armrs.cosim.fmu_export import export_fmu
from armrs.demo import true_model
from armrs.fmu.description import read_description

NAMES = ["q[1]", "q[2]", "energy"]
START = np.radians([-60.0, 50.0])
FMUTOOL = shutil.which("fmutool", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}")
DURATION = 2.0


def python(_: Path, step: float) -> list[float]:
    """Run the slave in Python."""
    slave = Slave(true_model(), start=START)
    slave.enter_initialization_mode()
    slave.exit_initialization_mode()
    for k in range(round(DURATION / step)):
        slave.do_step(k * step, step)
    return slave.get(NAMES).tolist()


def fmpy(path: Path, step: float) -> list[float]:
    """Run in FMPy."""
    from fmpy import simulate_fmu

    result = simulate_fmu(str(path), stop_time=DURATION, step_size=step, output_interval=step, output=NAMES)
    return [float(result[name][-1]) for name in NAMES]


def container(path: Path, step: float) -> list[float]:
    """Run inside the container FMU of FMPy (a library in Rust that imports FMUs), and that in FMPy."""
    from fmpy import read_model_description
    from fmpy.container_fmu.cli import create_container_fmu
    from fmpy.container_fmu.config import Component, Configuration

    # The container itself is of FMI 3.0, whatever the arm is.
    inner, outer = read_model_description(str(path)), read_model_description(str(path.with_name("arm3.fmu")))
    arm = Component(name="arm", filename=path, modelDescription=inner)
    known = {v.name: v for v in inner.modelVariables}
    outer.modelVariables = [v for v in outer.modelVariables if v.name in NAMES or v.causality == "independent"]
    outer.outputs = [u for u in outer.outputs if u.variable.name in NAMES]
    outer.initialUnknowns, outer.derivatives = list(outer.outputs), []
    for unknown in outer.outputs:
        unknown.dependencies = unknown.dependenciesKind = None
    outer.coSimulation.fixedInternalStepSize = step
    for v in outer.modelVariables:
        # The arm starts where it was exported to; the container sets nothing.
        v.start, v.initial = None, "calculated" if v.causality == "output" else None
    mappings = {v: [(arm, known[v.name])] for v in outer.modelVariables if v.name in NAMES}
    configuration = Configuration(False, outer, [arm], [], mappings)
    file = path.with_name(f"container-{path.stem}.fmu")
    with tempfile.TemporaryDirectory() as folder:
        create_container_fmu(configuration, Path(folder), file)
    return fmpy(file, step)


def ecos(path: Path, step: float) -> list[float]:
    """Run in ecos (C++)."""
    from ecospy import EcosSimulation, EcosSimulationStructure

    structure = EcosSimulationStructure()
    structure.add_model("arm", str(path))
    simulation = EcosSimulation(step, structure=structure)
    simulation.init()
    simulation.step(round(DURATION / step))
    return [simulation.get_real(f"arm::{name}") for name in NAMES]


def libcosim(path: Path, step: float) -> list[float]:
    """Run in libcosim (C++, FMI 2.0 alone)."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(round(step * 1e9))
    index = execution.add_local_slave(CosimLocalSlave(str(path), "arm"))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    execution.step(round(DURATION / step))
    references = {v.name: v.reference for v in read_description(path).variables}
    return list(observer.last_real_values(index, [references[name] for name in NAMES]))


def main() -> int:
    """Print what every engine ends with; 1 when one differs."""
    engines: list[tuple[Callable[[Path, float], list[float]], tuple[int, ...]]] = [
        (fmpy, (2, 3)),
        (container, (2, 3)),
        (ecos, (2, 3)),
        (libcosim, (2,)),
    ]
    different = 0
    with tempfile.TemporaryDirectory() as folder:
        files = {fmi: export_fmu(true_model(), Path(folder) / f"arm{fmi}.fmu", fmi=fmi, start=START) for fmi in (2, 3)}
        for step in (1e-3, 10e-3, 20e-3, 100e-3):
            expected = [v.hex() for v in python(files[3], step)]
            print(f"{1e3 * step:5.0f} ms  python          {' '.join(expected)}")
            for engine, versions in engines:
                for fmi in versions:
                    try:
                        found = [float(v).hex() for v in engine(files[fmi], step)]
                    except (ImportError, OSError) as error:
                        print(f"{1e3 * step:5.0f} ms  {engine.__name__}: left out ({error})")
                        continue
                    different += found != expected
                    word = "the same" if found == expected else f"DIFFERENT {' '.join(found)}"
                    print(f"{1e3 * step:5.0f} ms  {engine.__name__:9} FMI {fmi}  {word}")
    if FMUTOOL:
        different += validators()
    else:
        print("fmutool: left out (it is not installed)")
    return 1 if different else 0


def validators() -> int:
    """Let fmutool look at every version and port; how many it finds something in."""
    found = 0
    with tempfile.TemporaryDirectory() as folder:
        for fmi, port in ((fmi, port) for fmi in (2, 3) for port in ("force", "motion")):
            path = export_fmu(true_model(), Path(folder) / "arm.fmu", fmi=fmi, port=port, start=START)
            done = subprocess.run([FMUTOOL, "-input", str(path), "-check"], capture_output=True, text=True, check=False)
            found += done.returncode != 0
            print(f"fmutool  FMI {fmi}, {port} port: {'nothing found' if done.returncode == 0 else done.stdout + done.stderr}")
    return found


if __name__ == "__main__":
    sys.exit(main())
