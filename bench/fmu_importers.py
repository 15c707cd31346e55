"""What a step through an importer of FMUs costs: this one beside FMPy, in one run, taking turns.

A step sets the two inputs of the force port, advances by one inner step and reads four outputs: three calls of the C interface.
`pip install fmpy`.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from armrs.cosim.fmu_export import export_fmu
from armrs.demo import true_model
from armrs.fmu.imported_slave import ImportedSlave

INPUTS, OUTPUTS = ["handle.F[1]", "handle.F[2]"], ["handle.r[1]", "handle.r[2]", "handle.v[1]", "handle.v[2]"]
STEP, STEPS, ROUNDS = 0.25e-3, 2000, 7


def ours(path: Path) -> float:
    """Return the time of a step [s]."""
    with ImportedSlave(path) as slave:
        slave.enter_initialization_mode()
        slave.exit_initialization_mode()
        force = np.zeros(2)
        begin = time.perf_counter()
        for k in range(STEPS):
            slave.set(INPUTS, force)
            slave.do_step(k * STEP, STEP)
            slave.get(OUTPUTS)
        return (time.perf_counter() - begin) / STEPS


def fmpy(path: Path, fmi: int) -> float:
    """Return the time of a step [s]."""
    description, folder = read_model_description(str(path)), extract(str(path))
    references = {v.name: v.valueReference for v in description.modelVariables}
    given, wanted = [references[name] for name in INPUTS], [references[name] for name in OUTPUTS]
    token = description.guid if fmi == 2 else description.instantiationToken
    make = FMU2Slave if fmi == 2 else FMU3Slave
    slave = make(guid=token, unzipDirectory=folder, modelIdentifier=description.coSimulation.modelIdentifier, instanceName="arm")
    slave.instantiate()
    if fmi == 2:
        slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    put, read = (slave.setReal, slave.getReal) if fmi == 2 else (slave.setFloat64, slave.getFloat64)
    force = [0.0, 0.0]
    begin = time.perf_counter()
    for k in range(STEPS):
        put(given, force)
        slave.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)
        read(wanted)
    used = (time.perf_counter() - begin) / STEPS
    slave.terminate()
    slave.freeInstance()
    return used


def main() -> int:
    """Print the best of all rounds; 1 when ours is slower."""
    slower = 0
    with tempfile.TemporaryDirectory() as folder:
        for fmi in (2, 3):
            path = export_fmu(true_model(), Path(folder) / f"arm{fmi}.fmu", fmi=fmi)
            times = np.array([(ours(path), fmpy(path, fmi)) for _ in range(ROUNDS)])
            own, other = 1e6 * times.min(axis=0)
            slower += own > other
            print(f"FMI {fmi}: a step takes {own:.1f} µs through armrs, {other:.1f} µs through FMPy ({own / other:.2f} of it)")
    return 1 if slower else 0


if __name__ == "__main__":
    sys.exit(main())
