"""Model Exchange, directional derivatives and dependencies of our FMUs, with FMPy as the importer."""

from __future__ import annotations

import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from armrs.cosim import Slave
from armrs.cosim.fmu_export import export_fmu
from armrs.errors import SlaveError
from armrs.fmu.check import check_fmu
from armrs.fmu.description import read_description
from armrs.fmu.imported_slave import ImportedSlave
from armrs.model import Contact, Effect, Joint, Model, Segment

ARM = Model(
    (Segment("upper arm", 0.322, 2.114, 0.186, 0.0165), Segment("forearm", 0.264, 1.264, 0.121, 0.0074)),
    (Joint("shoulder", viscosity=0.2), Joint("elbow", viscosity=0.2)),
    contact=Contact((500.0, 500.0), (5.0, 5.0)),
)
START = np.radians([-60.0, 50.0])
VARIANTS = [(fmi, port) for fmi in (2, 3) for port in ("force", "motion")]


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[int, str], Path]:
    place = tmp_path_factory.mktemp("exchange")
    return {(fmi, port): export_fmu(ARM, place / f"{port}{fmi}.fmu", fmi=fmi, port=port, start=START) for fmi, port in VARIANTS}


@pytest.mark.parametrize(("fmi", "port"), VARIANTS)
def test_an_importer_that_integrates_agrees_with_co_simulation(fmi: int, port: str, files: dict[tuple[int, str], Path]) -> None:
    """FMPy with CVode against FMPy with our own steps, over 5 s."""
    fmpy = pytest.importorskip("fmpy")
    names = ["q[1]", "q[2]", "work.resisted"]
    settings = {"stop_time": 5.0, "output_interval": 0.05, "output": names, "relative_tolerance": 1e-10}
    path = str(files[fmi, port])
    exchanged = fmpy.simulate_fmu(path, fmi_type="ModelExchange", solver="CVode", **settings)
    stepped = fmpy.simulate_fmu(path, fmi_type="CoSimulation", **settings)
    for name in names:
        assert np.ptp(stepped[name]) > 0.01
        np.testing.assert_allclose(exchanged[name], stepped[name], rtol=0.0, atol=1e-6)


@pytest.mark.parametrize(("fmi", "port"), VARIANTS)
def test_directional_derivatives_are_those_of_finite_differences(fmi: int, port: str, files: dict[tuple[int, str], Path]) -> None:
    knowns = ["handle.F[1]", "robot.r[1]", "robot.v[2]", "tau[1]", "q[1]", "qd[2]", "body[1].m", "gravity"]
    unknowns = ["handle.r[1]", "handle.v[2]", "energy", "der(qd[1])", "der(qd[2])", "der(work.port)"]
    with ImportedSlave(files[fmi, port]) as slave:
        unknowns += ["contact.F[1]", "contact.F[2]"] if port == "motion" else []
        slave.enter_initialization_mode()
        slave.set("qd[1]", 0.7)
        slave.set("tau[1]", 1.0)
        at = {name: float(slave.get(name)[0]) for name in knowns if name in slave.variables}
        for name, value in at.items():
            found = slave.get_directional_derivative(unknowns, [name], [1.0])
            ends = []
            for change in (1e-5, -1e-5):
                slave.set(name, value + change)
                ends.append(slave.get(unknowns))
            slave.set(name, value)
            np.testing.assert_allclose(found, (ends[0] - ends[1]) / 2e-5, rtol=1e-6, atol=1e-6)
        both = list(at)[:3]
        one = sum(2.0 * slave.get_directional_derivative(unknowns, [name], [1.0]) for name in both)
        np.testing.assert_allclose(slave.get_directional_derivative(unknowns, both, [2.0] * 3), one, rtol=1e-8, atol=1e-8)
        # The state is as before.
        assert {name: float(slave.get(name)[0]) for name in at} == at


def test_directional_derivatives_of_what_is_no_unknown_are_refused(files: dict[tuple[int, str], Path]) -> None:
    with ImportedSlave(files[3, "force"]) as slave:
        slave.enter_initialization_mode()
        slave.exit_initialization_mode()
        with pytest.raises(SlaveError, match="is not that of an input, a state"):
            slave.get_directional_derivative(["q[1]"], ["gravity"], [1.0])


@pytest.mark.parametrize("fmi", [2, 3])
def test_no_importer_sees_an_algebraic_loop(fmi: int, files: dict[tuple[int, str], Path]) -> None:
    """Inputs go through to outputs at the contact of the motion port alone."""
    for port, through in (("force", set()), ("motion", {"contact.F[1]", "contact.F[2]", "energy"})):
        description = read_description(files[fmi, port])
        inputs = {v.name for v in description.variables if v.causality == "input"}
        outputs = description.unknowns("Output")
        assert all(u.dependencies is not None for u in outputs)
        assert {u.name for u in outputs if inputs & set(u.dependencies or ())} == through


def test_the_check_finds_nothing_in_them(files: dict[tuple[int, str], Path]) -> None:
    for path in files.values():
        assert [f for f in check_fmu(path) if f.level == "error"] == []


def test_an_arm_whose_effect_carries_a_state_is_for_co_simulation_alone(tmp_path: Path) -> None:
    effect = Effect("relaxation", joint=2)
    path = export_fmu(ARM.replace(effects=(effect,)), tmp_path / "arm.fmu", start=START)
    with zipfile.ZipFile(path) as packed:
        root = ElementTree.fromstring(packed.read("modelDescription.xml"))
    assert root.find("ModelExchange") is None
    assert root.find("ModelStructure/ContinuousStateDerivative") is None
    assert [f for f in check_fmu(path) if f.level == "error"] == []


@pytest.mark.parametrize("kind", ["python", "fmu"])
def test_the_contact_is_tunable(kind: str, files: dict[tuple[int, str], Path]) -> None:
    arm = Slave(ARM, port="motion", start=START, name="motion3") if kind == "python" else ImportedSlave(files[3, "motion"])
    arm.enter_initialization_mode()
    arm.exit_initialization_mode()
    arm.set(["robot.r[1]", "robot.r[2]"], [0.5, -0.3])
    arm.do_step(0.0, 0.1)
    before = arm.get(["q[1]", "q[2]", "qd[1]", "contact.F[1]"])
    arm.set("contact.D[1]", 0.0)
    arm.set("contact.S[1]", 1000.0)
    after = arm.get(["q[1]", "q[2]", "qd[1]", "contact.F[1]"])
    np.testing.assert_array_equal(before[:3], after[:3])
    assert before[3] != after[3]
    assert arm.do_step(0.1, 0.1).status == 0
    with pytest.raises(SlaveError):
        arm.set("body[1].m", 1.0)
    arm.free()


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_force_goes_on_along_a_line_within_a_step(fmi: int, files: dict[tuple[int, str], Path], tmp_path: Path) -> None:
    """FMI 2.0 has a function for derivatives of inputs; in FMI 3.0 they are inputs themselves."""
    fmpy = pytest.importorskip("fmpy")
    description = fmpy.read_model_description(str(files[fmi, "force"]))
    references = {v.name: [v.valueReference] for v in description.modelVariables}
    folder = fmpy.extract(str(files[fmi, "force"]), unzipdir=str(tmp_path))

    def force(time: float) -> float:
        return float(5.0 * np.sin(3.0 * np.pi * time))

    def end(parts: int, rates: bool) -> float:
        """Return the angle after 1 s: the force is a polygon with corners every 20 ms, given at as many times between them."""
        fmu = fmpy.instantiate_fmu(folder, description, "CoSimulation")
        if fmi == 2:
            fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        write, read = (fmu.setReal, fmu.getReal) if fmi == 2 else (fmu.setFloat64, fmu.getFloat64)
        for k in range(50):
            start, slope = force(0.02 * k), (force(0.02 * (k + 1)) - force(0.02 * k)) / 0.02
            for part in range(parts):
                write(references["handle.F[1]"], [start + slope * 0.02 * part / parts])
                if rates and fmi == 2:
                    fmu.setRealInputDerivatives(references["handle.F[1]"], [1], [slope])
                elif rates:
                    write(references["der(handle.F[1])"], [slope])
                fmu.doStep(0.02 * (k + part / parts), 0.02 / parts)
        [angle] = read(references["q[1]"])
        fmu.terminate()
        fmu.freeInstance()
        return float(angle)

    once = end(1, rates=True)
    assert abs(once - end(20, rates=True)) < 1e-9
    assert abs(once - end(1, rates=False)) > 1e-3
