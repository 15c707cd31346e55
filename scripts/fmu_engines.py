"""The same run through every co-simulation engine at hand: the bits must be those of the slave in Python.

`pip install fmpy libcosimpy ecospy tbb`, and `LD_LIBRARY_PATH` with the library tbb for ecos; what is not installed is left out.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from armrs.cosim import Slave
from armrs.demo import true_model
from armrs.fmu.description import read_description
from armrs.fmu.export import export_fmu

NAMES = ["q[1]", "q[2]", "energy"]
START = np.radians([-60.0, 50.0])
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
    return list(result[-1].tolist()[1:])


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
    engines: list[tuple[Callable[[Path, float], list[float]], tuple[int, ...]]] = [(fmpy, (2, 3)), (ecos, (2, 3)), (libcosim, (2,))]
    different = 0
    with tempfile.TemporaryDirectory() as folder:
        files = {fmi: export_fmu(true_model(), Path(folder) / f"arm{fmi}.fmu", fmi=fmi, start=START) for fmi in (2, 3)}
        for step in (1e-3, 10e-3, 100e-3):
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
                    print(f"{1e3 * step:5.0f} ms  {engine.__name__:8} FMI {fmi}  {word}")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
