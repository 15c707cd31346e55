"""The master: coupled runs against monolithic ones, and runs that are no result."""

from __future__ import annotations

import csv
import dataclasses
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armrs import Contact, Joint, Model, _armrs, cli
from armrs.cosim import Partner, Slave
from armrs.cosim.coupled_run import CoupledRun
from armrs.cosim.error_estimate import run_checked
from armrs.cosim.fmu_export import export_fmu
from armrs.cosim.haptic_wall import Wall
from armrs.cosim.master import run_system
from armrs.cosim.sources_and_controllers import BuiltInSlave
from armrs.cosim.system import couple, load_system
from armrs.errors import BadInput, CoupledError, SlaveError
from armrs.fmu.imported_slave import ImportedSlave
from armrs.fmu.slave_interface import StepResult, Variable
from armrs.model import Segment, load_model
from armrs.workflows.simulate import CoreDrive, CoreRun
from markup import unescaped
from pythonfmu_builds import built

EXAMPLES = Path(__file__).parents[1] / "examples"
NEAR = np.radians([-60.0, 50.0])
WAY, RAMP, DURATION = -0.1, 0.25, 2.0
FORCE = [
    ("robot.F_y", "arm.handle.F[1]"),
    ("robot.F_z", "arm.handle.F[2]"),
    ("arm.handle.r[1]", "robot.r_y"),
    ("arm.handle.r[2]", "robot.r_z"),
    ("arm.handle.v[1]", "robot.v_y"),
    ("arm.handle.v[2]", "robot.v_z"),
]
MOTION = [
    ("robot.p_y", "arm.robot.r[1]"),
    ("robot.p_z", "arm.robot.r[2]"),
    ("robot.u_y", "arm.robot.v[1]"),
    ("robot.u_z", "arm.robot.v[2]"),
]


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot that leads the hand 0.1 m back and forth, with the contact spring of the thesis, made by PythonFMU."""
    source = (EXAMPLES / "python" / "cosim" / "robot.py").read_text(encoding="utf-8")
    return built(tmp_path_factory.mktemp("robot"), source, "Robot", "--handle-state")


class Rig:
    """The arm at rest on its spring, and the monolithic run that a coupled one is measured against."""

    def __init__(self) -> None:
        # The contact of the thesis, undamped; its viscosity 0.2 N m s/rad.
        self.model = load_model(EXAMPLES / "cosim" / "arm.toml")
        start = Slave(self.model, port="motion", start=NEAR, rest=True)
        self.q = start.get(["q[1]", "q[2]"])
        self.handle = start.get(["robot.r[1]", "robot.r[2]"])
        self.t = np.arange(0.0, DURATION + 1e-9, 0.25e-3)
        drive = CoreDrive("handle", False, np.array([self._at(t) for t in self.t]), self.t)
        settings = CoreRun("rk4", 0.25e-3, 1e-3, duration=DURATION, q=list(self.q), qd=[0.0, 0.0])
        run = _armrs.simulate(_armrs.Rig(self.model), drive, settings)
        self.reference: np.ndarray = run.columns["q"]

    def _at(self, time: float) -> list[float]:
        half = 0.5 * DURATION
        back = time > half
        t, ramp = (time - half if back else time), RAMP * half
        top = 1.0 / (half - ramp)
        if t < ramp:
            s = 0.5 * top / ramp * t * t
        elif t <= half - ramp:
            s = top * (t - 0.5 * ramp)
        else:
            s = 1.0 - 0.5 * top / ramp * (half - t) ** 2
        return [float(self.handle[0] + WAY * (1.0 - s if back else s)), float(self.handle[1])]

    def run(self, robot: Path, port: str, algorithm: str, step: float, arm: Partner | None = None) -> CoupledRun:
        arm = arm or Slave(self.model, port=port, start=self.q, handle=(self.handle[0], self.handle[1]))
        with ImportedSlave(robot, name="robot") as partner:
            starts = {"robot": {"y0": self.handle[0], "z0": self.handle[1], "way": WAY, "ramp": RAMP, "duration": DURATION}}
            slaves = [arm, partner] if port == "force" else [partner, arm]
            lines = FORCE if port == "force" else MOTION
            return run_system(couple(slaves, lines, algorithm=algorithm, step=step, duration=DURATION, starts=starts))

    def error(self, run: CoupledRun) -> float:
        """Largest difference of the joint angles [rad]."""
        at = np.round(run.t / 1e-3).astype(int)
        q = np.column_stack([run.columns["arm.q[1]"], run.columns["arm.q[2]"]])
        return float(np.abs(q - self.reference[at]).max())


@pytest.fixture(scope="module")
def arm() -> Rig:
    return Rig()


def test_the_iterated_master_is_near_the_monolithic_run(arm: Rig, robot: Path) -> None:
    errors = {step: arm.error(arm.run(robot, "force", "iterated", step)) for step in (2e-3, 5e-3, 10e-3)}
    assert errors[10e-3] < 1e-3
    # Second order: (10/2)² = 25 between the ends, less where the vibration is hardly resolved any more.
    assert errors[2e-3] < 1e-4
    order = np.log(errors[5e-3] / errors[2e-3]) / np.log(2.5)
    assert 1.7 < order < 2.3


def test_the_motion_port_is_nearer_without_going_back(arm: Rig, robot: Path) -> None:
    errors = {step: arm.error(arm.run(robot, "motion", "gauss-seidel", step)) for step in (2e-3, 5e-3, 10e-3)}
    assert errors[10e-3] < 1e-4
    order = np.log(errors[10e-3] / errors[2e-3]) / np.log(5.0)
    assert 1.7 < order < 2.3


@pytest.mark.parametrize("algorithm", ["jacobi", "gauss-seidel"])
def test_an_explicit_master_at_2_ms_is_called_unstable(arm: Rig, robot: Path, algorithm: str) -> None:
    with pytest.raises(CoupledError, match=r"unstable: the coupling creates .* J at arm") as refused:
        arm.run(robot, "force", algorithm, 2e-3)
    assert refused.value.run.verdict == "unstable"
    assert arm.error(refused.value.run) > 1.0  # and rightly so


def test_what_the_arm_received_is_compared_with_what_was_given(arm: Rig, robot: Path) -> None:
    """The motion port holds what it was given, so that the hold creates nothing; too long a step shows inside the arm."""
    with pytest.raises(CoupledError, match=r"not resolved: arm receives .* take a shorter step") as refused:
        arm.run(robot, "motion", "gauss-seidel", 0.1)
    assert refused.value.run.verdict == "not resolved"
    assert arm.error(refused.value.run) > 1e-2
    run = arm.run(robot, "motion", "gauss-seidel", 0.02)
    assert 3e-4 < arm.error(run) < 4e-4
    assert any("the work of its partners at the communication points differs by" in text for text in run.warnings)
    assert not any("the work of its partners" in text for text in arm.run(robot, "motion", "gauss-seidel", 0.01).warnings)


def test_an_explicit_master_that_is_good_is_as_near_as_the_page_says(arm: Rig, robot: Path) -> None:
    assert arm.error(arm.run(robot, "force", "gauss-seidel", 1e-3)) == pytest.approx(2.4e-3, rel=0.05)
    with pytest.raises(CoupledError, match="unstable"):
        arm.run(robot, "force", "jacobi", 1e-3)


def test_our_fmu_couples_with_the_same_bits_as_the_slave_in_python(arm: Rig, robot: Path, tmp_path: Path) -> None:
    slave = Slave(arm.model, port="force", start=arm.q)
    ends = [arm.run(robot, "force", "iterated", 0.02, slave).columns["arm.q[1]"].tobytes()]
    for fmi in (2, 3):
        path = export_fmu(Slave(arm.model, port="force", start=arm.q), tmp_path / "arm.fmu", fmi=fmi)
        with ImportedSlave(path, name="arm") as fmu:
            ends.append(arm.run(robot, "force", "iterated", 0.02, fmu).columns["arm.q[1]"].tobytes())
    assert ends[0] == ends[1] == ends[2]


def test_iterating_needs_partners_that_can_go_back(arm: Rig, robot: Path) -> None:
    with ImportedSlave(robot, name="robot") as partner:
        partner.can_rollback = False
        slave = Slave(arm.model, port="force", start=arm.q)
        with pytest.raises(BadInput, match="robot does not support rollback"):
            run_system(couple([slave, partner], FORCE, algorithm="iterated", step=0.01, duration=0.1))
        # Through the motion port nothing comes back, so that there is nothing to iterate.
        slave = Slave(arm.model, port="motion", start=arm.q)
        lines = [("robot.p_y", "arm.robot.r[1]"), ("robot.u_y", "arm.robot.v[1]")]
        starts = {"robot": {"y0": float(slave.get("robot.r[1]")[0])}}
        assert run_system(couple([partner, slave], lines, algorithm="iterated", step=0.01, duration=0.1, starts=starts)).evaluations == 2.0


def test_what_another_tool_made_is_checked_too(robot: Path) -> None:
    """PythonFMU lists no InitialUnknowns; that is found, and the library is tried all the same."""
    from armrs.fmu.check import check_fmu

    found = [str(f) for f in check_fmu(robot)]
    assert any("F_y is calculated at initialization but is not listed as InitialUnknown" in f for f in found)
    assert not any("crash" in f for f in found)


SPRING = """
from pythonfmu3 import Float64, Fmi3Causality, Fmi3Slave, Fmi3Variability


class Spring(Fmi3Slave):
    author, description = "armrs", "a spring along y"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.time, self.k, self.at, self.x, self.f = 0.0, 200.0, 0.1, 0.0, 0.0
        self.register_variable(Float64("time", causality=Fmi3Causality.independent, variability=Fmi3Variability.continuous))
        for name in ("k", "at"):
            self.register_variable(Float64(name, causality=Fmi3Causality.parameter, variability=Fmi3Variability.fixed))
        self.register_variable(Float64("x", causality=Fmi3Causality.input))
        self.register_variable(Float64("f", causality=Fmi3Causality.output, getter=lambda: self.k * (self.at - self.x)))

    def do_step(self, current_time, step_size):
        return True
"""


def test_a_foreign_partner_of_fmi_3(arm: Rig, tmp_path: Path) -> None:
    """A spring made by PythonFMU3 at the force port, against the same spring inside the arm behind its motion port."""
    built(tmp_path, SPRING, "Spring", "--handle-state", fmi=3)
    whole = Slave(arm.model.replace(contact=Contact((200.0, 1e-9))), port="motion", start=NEAR, handle=(0.1, 0.0))
    whole.enter_initialization_mode()
    whole.exit_initialization_mode()
    whole.do_step(0.0, 1.0)
    lines = [("arm.handle.r[1]", "spring.x"), ("spring.f", "arm.handle.F[1]")]
    errors = []
    for step in (4e-3, 1e-3):
        slave = Slave(arm.model, start=NEAR)
        with ImportedSlave(tmp_path / "Spring.fmu", name="spring") as spring:
            assert spring.fmi == 3
            run_system(couple([slave, spring], lines, algorithm="iterated", step=step, duration=1.0))
        errors.append(float(np.abs(slave.get(["q[1]", "q[2]"]) - whole.get(["q[1]", "q[2]"])).max()))
    # The arm falls freely but for the spring. Second order: a quarter of the step, a sixteenth of the error.
    assert errors[1] < 1e-3
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.1)


def test_a_partner_that_asks_to_end_ends_the_run() -> None:
    class Ending(Wall):
        def do_step(self, time: float, step: float) -> StepResult:
            return dataclasses.replace(super().do_step(time, step), terminate=time > 0.05)

    run = run_checked(couple([Ending("y", 1.0, 1.0)], [], step=0.01, duration=1.0))
    assert run.verdict == "ended"
    assert "wall requests the end of the run in the step from 0.06 s" in run.why
    assert run.t[-1] == pytest.approx(0.06)
    assert len(run.columns["wall.F[1]"]) == len(run.t)


# ---- a wall
def wall_system(algorithm: str, step: float, damping: float = 3000.0) -> CoupledRun:
    system = load_system(EXAMPLES / "cosim" / "wall.toml")
    slaves = [system.slaves["arm"], Wall("y", 0.1, 3000.0, damping)]
    lines = [("arm.handle.r", "wall.r"), ("arm.handle.v", "wall.v"), ("wall.F", "arm.handle.F")]
    return run_system(couple(slaves, lines, algorithm=algorithm, step=step, duration=2.0))


def test_a_wall_takes_energy_and_gives_none() -> None:
    run = wall_system("iterated", 2e-3)
    assert run.columns["wall.F[1]"].min() < -50.0
    assert run.columns["wall.F[1]"].max() == 0.0
    work = run.columns["arm.work.port"]
    assert np.all(work < 1e-6)
    energy = run.columns["arm.energy"] + run.columns["arm.work.resisted"] - work
    assert np.ptp(energy) < 1e-6


def test_a_wall_beyond_all_numbers_does_not_converge() -> None:
    arm = load_system(EXAMPLES / "cosim" / "wall.toml").slaves["arm"]
    lines = [("arm.handle.r", "wall.r"), ("wall.F", "arm.handle.F")]
    with pytest.raises(CoupledError, match=r"not converged|diverged"), np.errstate(all="ignore"):
        run_system(couple([arm, Wall("y", 0.1, 1e308)], lines, algorithm="iterated", step=2e-3, duration=2.0))


def test_explicit_coupling_with_a_wall_is_refused() -> None:
    """The textbook instability of haptic rendering: a sampled wall gives back more than it took."""
    with pytest.raises(CoupledError, match="unstable"):
        wall_system("jacobi", 10e-3)
    created = wall_system("iterated", 10e-3).connections[-2].energy_created
    assert created is not None
    assert abs(created) < 1e-4


class Broken(Wall):
    """A wall that fails in the way that it is told to."""

    def __init__(self, way: str) -> None:
        super().__init__("y", 10.0, 1.0)
        self.name, self.way = "wall", way

    def get(self, names: object) -> np.ndarray:
        values = super().get(names)  # type: ignore[arg-type]
        bad = {"nan": np.nan, "inf": np.inf, "jump": 100.0 * np.sign(np.sin(1e9 * (self._values["r[1]"] + 0.1)))}
        return np.full_like(values, bad[self.way]) if self._time > 0.05 else values


@pytest.mark.parametrize(
    ("way", "algorithm", "verdict"),
    [("nan", "jacobi", "diverged"), ("inf", "gauss-seidel", "diverged"), ("jump", "iterated", "not converged")],
)
def test_a_partner_that_fails_is_no_result(way: str, algorithm: str, verdict: str) -> None:
    slave = load_system(EXAMPLES / "cosim" / "wall.toml").slaves["arm"]
    lines = [("arm.handle.r", "wall.r"), ("wall.F", "arm.handle.F")]
    with pytest.raises(CoupledError, match=verdict) as refused:
        run_system(couple([slave, Broken(way)], lines, algorithm=algorithm, step=0.01, duration=1.0))
    assert 0.03 < refused.value.run.t[-1] < 0.1


def test_a_last_step_that_is_shorter() -> None:
    slave = load_system(EXAMPLES / "cosim" / "wall.toml").slaves["arm"]
    run = run_system(couple([slave], [], step=0.03, duration=0.1))
    np.testing.assert_allclose(run.t, [0.0, 0.03, 0.06, 0.09, 0.1], atol=1e-15)


def test_units_are_checked_and_converted() -> None:
    arm = Model((Segment("a", 0.3, 1.0, 0.1, 0.01),), (Joint("j"),), contact=Contact((1e3, 1e3)))
    a, b = Slave(arm, name="a"), Slave(arm, port="motion", name="b")
    with pytest.raises(BadInput, match=r"a.handle.v\[1\] -> b.robot.r\[1\], in m/s and m, allowed the same dimension"):
        couple([a, b], [("a.handle.v[1]", "b.robot.r[1]")])
    with pytest.raises(BadInput, match=r"found a.handle.F\[1\], an input, allowed an output"):
        couple([a, b], [("a.handle.F[1]", "b.robot.r[1]")])
    with pytest.raises(BadInput, match="two connections to"):
        couple([a, b], [("a.handle.r", "b.robot.r"), ("a.handle.r[1]", "b.robot.r[1]")])
    with pytest.raises(BadInput, match="2 outputs and 1 inputs"):
        couple([a, b], [("a.handle.r", "b.tau")])
    system = couple([a, b], [("a.handle.r", "b.robot.r"), {"from": "a.handle.v", "to": "b.robot.v", "within": "start"}])
    assert [c.within for c in system.connections] == ["start"] * 4
    assert [c.dual for c in system.connections] == [None, None, "contact.F[1]", "contact.F[2]"]
    assert system.unconnected == ["a.handle.F[1]", "a.handle.F[2]", "a.tau[1]", "b.tau[1]"]


# ---- SYSTEM.toml and the command line
@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    for name in ("arm.toml", "wall.toml"):
        (tmp_path / name).write_text((EXAMPLES / "cosim" / name).read_text(encoding="utf-8"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    yield tmp_path


@pytest.mark.long
def test_run_writes_samples_figures_and_report(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["fmu", "run", "wall.toml", "-o", "out"]) == 0
    assert "wall.toml: 2 s coupled" in capsys.readouterr().out
    data = json.loads(Path("out/coupled.json").read_text(encoding="utf-8"))
    assert (data["verdict"], data["samples"], data["file"]) == ("good", 2001, "coupled.csv")
    with Path("out/coupled.csv").open(encoding="utf-8") as file:
        head, first = next(csv.reader(file)), next(csv.reader(file))
    assert head[:2] == ["t_s", "arm.q[1]_rad"]
    assert float(first[1]) == np.radians(-150.0)
    assert Path("out/figures/interface.png").stat().st_size > 10_000
    assert "Energy created by the coupling" not in Path("out/report.html").read_text(encoding="utf-8")  # that stands in the picture
    page = Path("out/report.html").read_text(encoding="utf-8").replace("<wbr>", "")
    assert "wall.F[1] -&gt; arm.handle.F[1]" in page
    assert unescaped(Path("out/coupled.json"), folder) == []
    assert cli.main(["fmu", "run", "wall.toml", "-o", "parquet", "--to", "parquet"]) == 0
    assert Path("parquet/coupled.parquet").exists()


def test_friction_too_steep_for_the_inner_step_is_said(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    brake = '\n[[effect]]\nkind = "coulomb"\njoint = 2\ntorque = 2.0\nsmoothing = {}\n'
    arm = Path("arm.toml").read_text(encoding="utf-8")
    told = "coulomb in joint 2: the default smoothing is too steep for inner steps of 0.00025 s -> smoothing = 0"
    for smoothing, said in ((0.01, True), (0.0, False)):
        Path("arm.toml").write_text(arm + brake.format(smoothing), encoding="utf-8")
        cli.main(["fmu", "run", "wall.toml", "--no-estimate"])
        assert (f"arm: {told}" in capsys.readouterr().err) == said
        cli.main(["fmu", "export", "arm.toml"])
        assert (told in capsys.readouterr().err) == said
    Path("arm.toml").write_text(arm + brake.format(0.01), encoding="utf-8")
    cli.main(["fmu", "export", "arm.toml", "--dt", "1e-6"])
    assert told not in capsys.readouterr().err


def test_a_run_that_is_no_result_writes_its_diagnosis_alone(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = Path("wall.toml").read_text(encoding="utf-8").replace('"iterated"', '"jacobi"').replace("0.002", "0.01")
    Path("explicit.toml").write_text(text, encoding="utf-8")
    assert cli.main(["fmu", "run", "explicit.toml", "-o", "out"]) == 1
    out, err = capsys.readouterr()
    assert "UNSTABLE, no result: the coupling creates" in out
    assert "unstable, no result" in err
    assert not list(Path("out").glob("coupled.csv"))
    data = json.loads(Path("out/coupled.json").read_text(encoding="utf-8"))
    assert (data["verdict"], data["file"]) == ("unstable", None)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('algorithm = "iterated"', 'algorithm = "newton"', 'algorithm: found \'newton\', allowed "jacobi" or "gauss-seidel" or "iterated"'),
        ("step_s = 0.002", "step_s = 0.0", "step_s: found 0.0, allowed a finite number > 0 s"),
        ("step_s = 0.002", "step_s = 5.0", "duration_s"),
        ("step_s = 0.002", "stepp_s = 0.002", "unknown key"),
        ('model = "arm.toml"', 'model = "leg.toml"', "leg.toml: no such file"),
        ('model = "arm.toml"', 'fmu = "arm.toml"', "unknown key 'port', allowed fmu, name, seconds, start"),
        (
            'model = "arm.toml"\nport = "force"\nstart_deg = [-150.0, 20.0]',
            'fmu = "arm.toml"',
            "arm.toml: archive: found File is not a zip file",
        ),
        ('model = "arm.toml"', "", "impedance: found none of them"),
        ('port = "force"', 'port = "motor"', "port"),
        ('axis = "y"', 'axis = "x"', "axis"),
        ('from = "wall.F"', 'from = "wal.F"', "unknown slave 'wal'"),
        ('from = "wall.F"', 'from = "wall.G"', "unknown variable of wall 'G'"),
        ('to = "arm.handle.F"', 'to = "arm.handle.r"', "allowed an input"),
        ('to = "arm.handle.F"', 'to = "arm.tau"', "in N and N.m, allowed the same dimension"),
        ('name = "wall"', 'name = "arm"', "a name for each slave"),
        ("start_deg = [-150.0, 20.0]", "start_deg = [-150.0]", "found 1 values, allowed 2"),
        ("[system]", "[sytem]", "unknown key"),
        ("[-150.0, 20.0]", "5", "start_deg: found 5, allowed a list of numbers"),
        ("[-150.0, 20.0]", '[-150.0, 20.0]\nstart = { "body[1].m" = "abc" }', "body[1].m: found 'abc', allowed a finite number"),
        ("[-150.0, 20.0]", '[-150.0, 20.0]\nstart = { "body[1].m" = [1, 2] }', "body[1].m: found [1, 2], allowed a finite number"),
        ("[-150.0, 20.0]", "[-150.0, 20.0]\nstart = { mass = 1.0 }", "unknown variable 'mass'"),
        ('name = "wall"', 'name = "wall"\nstart = { "r[1]" = "abc" }', "r[1]: found 'abc', allowed a finite number"),
        ('to = "arm.handle.F"', 'to = "arm.handle.F"\ndual = "handle.F[1]"', "a variable whose product with handle.F[1] is a power"),
        ("step_s = 0.002", "step_s = 1e-300", "at most 10000000 steps of 1e-300 s"),
    ],
)
def test_a_system_that_does_not_fit_is_refused(folder: Path, old: str, new: str, message: str, capsys: pytest.CaptureFixture[str]) -> None:
    text = Path("wall.toml").read_text(encoding="utf-8")
    assert old in text
    Path("wall.toml").write_text(text.replace(old, new, 1), encoding="utf-8")
    assert cli.main(["fmu", "run", "wall.toml", "-o", "out"]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert message in err
    assert not Path("out").exists()


def test_an_fmu_that_refuses_is_one_line(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    export_fmu("arm.toml", "a.fmu")
    with pytest.raises(SlaveError):
        raise SlaveError("set", 3, "x")
    text = Path("wall.toml").read_text(encoding="utf-8").replace('model = "arm.toml"', 'fmu = "a.fmu"').replace('port = "force"', "")
    Path("fmu.toml").write_text(text.replace("start_deg = [-150.0, 20.0]", '[slave.start]\n"body[1].m" = -1.0'), encoding="utf-8")
    assert cli.main(["fmu", "run", "fmu.toml"]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert err.startswith("armrs: fmu.toml: arm, [slave.start]")
    assert "body[1].m is -1, allowed is a finite number" in err


# ---- arrays, and what a connection does to a value
class Vector(BuiltInSlave):
    """Holds an array; gives it back turned round, as an array of two rows."""

    def __init__(self, name: str) -> None:
        super().__init__(name, (), ())
        row = {"unit": "m", "exponents": (0, 1, 0, 0)}
        self.variables = {
            "u": Variable("u", 0, "input", "continuous", dimensions=(4,), start=(0.0,), **row),
            "Y": Variable("Y", 1, "output", "continuous", dimensions=(2, 2), **row),
        }
        self.inputs = {name: float(k) for k, name in enumerate(self.variables["u"].elements)}

    def outputs(self) -> dict[str, float]:
        return dict(zip(self.variables["Y"].elements, reversed(list(self.inputs.values())), strict=True))


def test_arrays_are_connected_element_by_element() -> None:
    one, two = Vector("one"), Vector("two")
    system = couple([one, two], [{"from": "one.Y", "to": "two.u", "factor": 2.0, "offset": 1.0}], step=0.1, duration=0.2)
    assert [c.label for c in system.connections][1:3] == ["one.Y[1,2] -> two.u[2]", "one.Y[2,1] -> two.u[3]"]
    assert system.unconnected == ["one.u"]
    run = run_system(system)
    assert [run.columns[f"two.{name}"][-1] for name in two.variables["Y"].elements] == [1.0, 3.0, 5.0, 7.0]


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ({"from": "one.Y", "to": "two.u[1]"}, r"unknown variable of two 'u\[1\]'"),
        ({"from": "one.Y[1,2]", "to": "two.u"}, r"unknown variable of one 'Y\[1,2\]'"),
        ({"from": "one.Y", "to": "three.u"}, "4 outputs and 3 inputs"),
        ({"from": "one.Y", "to": "two.u", "factor": float("nan")}, "factor: found nan"),
    ],
)
def test_arrays_are_connected_whole(line: dict[str, Any], words: str) -> None:
    three = Vector("three")
    three.variables["u"] = dataclasses.replace(three.variables["u"], dimensions=(3,))
    with pytest.raises(BadInput, match=words):
        couple([Vector("one"), Vector("two"), three], [line], step=0.1, duration=0.2)


def test_start_values_of_arrays_are_lists_row_by_row() -> None:
    values = [1.0, 2.0, 3.0, 4.0]
    system = couple([Vector("one")], [], step=0.1, duration=0.2, starts={"one": {"u": values}})
    assert system.starts == {"one": {"u": values}}
    for wrong, words in (
        ([1.0], r"u: found \[1.0\], allowed a list of 4 values, row by row"),
        (3.0, "allowed a list of 4"),
        ([1.0, 2.0, "a", 4.0], r"u\[3\]: found 'a'"),
    ):
        with pytest.raises(BadInput, match=words):
            couple([Vector("one")], [], step=0.1, duration=0.2, starts={"one": {"u": wrong}})


def test_units_are_asked_of_floating_point_numbers_alone() -> None:
    one, two = Vector("one"), Vector("two")
    for slave in (one, two):
        for name, variable in slave.variables.items():
            slave.variables[name] = dataclasses.replace(variable, type="Int32", unit=None, exponents=None)
    assert couple([one, two], [("one.Y", "two.u")], step=0.1, duration=0.2).warnings == ()


def test_steps_inside_of_a_partner_that_stay_as_they_are_are_not_estimated() -> None:
    """An FMU that may be stepped at will and has steps of 0.1 s inside: halving the step tells nothing about these."""
    wall = Wall("y", 10.0, 1.0)
    wall.internal_step = 0.1
    arm = load_system(EXAMPLES / "cosim" / "wall.toml").slaves["arm"]
    run = run_checked(couple([arm, wall], [("arm.handle.r", "wall.r"), ("wall.F", "arm.handle.F")], step=0.01, duration=0.1))
    assert run.verdict == "stable"
    assert "the error is not estimated: half the step is less than the inner step of wall, 0.1 s" in run.warnings


def test_the_handle_of_an_arm_with_a_force_port_is_refused(tmp_path: Path) -> None:
    example = EXAMPLES / "cosim" / "wall.toml"
    text = example.read_text(encoding="utf-8").replace('model = "', f'model = "{example.parent}/', 1)
    system = tmp_path / "system.toml"
    system.write_text(text.replace('name = "arm"', 'name = "arm"\nhandle_m = [0.1, 0.0]', 1), encoding="utf-8")
    with pytest.raises(BadInput, match=r'handle_m.*none with port = "force"'):
        load_system(system)
