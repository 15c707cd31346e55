"""Signals, controllers and impedances of SYSTEM.toml, against SciPy's integrator and against the spring inside the arm."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from armrs import cli
from armrs.cosim import Slave
from armrs.cosim.error_estimate import run_checked
from armrs.cosim.sources_and_controllers import BuiltInSlave, Impedance, Pid, Wave
from armrs.cosim.system import couple, load_system
from armrs.errors import BadInput
from armrs.model import Contact, Joint, Model, Segment

LENGTH, MASS, COM, INERTIA, VISCOSITY, GRAVITY = 0.3, 1.5, 0.15, 0.012, 0.3, 9.81
ARM = Model(
    (Segment("arm", LENGTH, MASS, COM, INERTIA),), (Joint("joint", viscosity=VISCOSITY),), contact=Contact((500.0, 500.0), (2.0, 2.0))
)


def reference(torque: object, duration: float, more: int = 0) -> np.ndarray:
    """Integrate the pendulum with SciPy; `torque(t, q, qd, extra)` returns the torque and the rates of further states."""

    def rates(t: float, y: np.ndarray) -> list[float]:
        tau, extra = torque(t, y[0], y[1], y[2:])  # type: ignore[operator]
        qdd = (tau - VISCOSITY * y[1] - MASS * GRAVITY * COM * np.cos(y[0])) / (INERTIA + MASS * COM**2)
        return [y[1], qdd, *extra]

    run = solve_ivp(rates, (0.0, duration), [-1.0, 0.0, *[0.0] * more], rtol=1e-10, atol=1e-12)
    return run.y[:, -1]


def test_a_sine_drives_an_arm_as_in_scipy() -> None:
    arm = Slave(ARM, start=[-1.0], name="arm")
    sine = Wave("sine", offset=0.5, amplitude=2.0, frequency=1.5, start=0.1, unit="Nm")
    run = run_checked(couple([sine, arm], [("signal.y", "arm.tau[1]")], step=1e-3, duration=1.0))
    end = reference(lambda t, q, qd, _: (0.5 + 2.0 * np.sin(2.0 * np.pi * 1.5 * (t - 0.1)), []), 1.0)
    assert run.verdict == "good"
    assert run.columns["arm.q[1]"][-1] == pytest.approx(end[0], abs=2e-6)


def test_a_pid_controller_moves_an_arm_as_in_scipy() -> None:
    arm = Slave(ARM, start=[-1.0], name="arm")
    pid = Pid(20.0, 30.0, 2.0, unit="Nm", of="rad")
    lines = [("signal.y", "pid.target"), ("arm.q[1]", "pid.measured"), ("arm.qd[1]", "pid.rate"), ("pid.u", "arm.tau[1]")]
    goal = Wave("constant", offset=-0.3, unit="rad")
    run = run_checked(couple([goal, arm, pid], lines, algorithm="iterated", step=5e-4, duration=1.0))

    def torque(t: float, q: float, qd: float, integral: np.ndarray) -> tuple[float, list[float]]:
        return 20.0 * (-0.3 - q) + 30.0 * integral[0] - 2.0 * qd, [-0.3 - q]

    end = reference(torque, 1.0, more=1)
    assert run.verdict == "good"
    assert run.columns["arm.q[1]"][-1] == pytest.approx(end[0], abs=1e-4)


def test_a_limit_stops_the_integral() -> None:
    pid = Pid(1.0, 1.0, limit=0.5)
    pid.set(["target"], [10.0])
    for k in range(100):
        pid.do_step(0.01 * k, 0.01)
    assert pid.get(["u"])[0] == 0.5
    assert pid.states["integral"] == 0.0
    pid.set(["target"], [-0.2])
    pid.do_step(1.0, 0.01)
    assert pid.states["integral"] == pytest.approx(-0.002)


def test_an_impedance_is_the_spring_inside_the_arm() -> None:
    arm = Slave(ARM, start=[-1.0], name="arm")
    whole = Slave(ARM, port="motion", start=[-1.0], handle=(0.2, -0.2))
    whole.enter_initialization_mode()
    whole.exit_initialization_mode()
    whole.do_step(0.0, 0.5)
    lines = [("arm.handle.r", "impedance.r"), ("arm.handle.v", "impedance.v"), ("impedance.F", "arm.handle.F")]
    partners = [arm, Impedance(500.0, 2.0, target=(0.2, -0.2))]
    run = run_checked(couple(partners, lines, algorithm="iterated", step=1e-3, duration=0.5))
    assert run.verdict == "good"
    assert run.columns["arm.q[1]"][-1] == pytest.approx(whole.get("q[1]")[0], abs=1e-5)


SYSTEM = """
[system]
step_s = 0.001
duration_s = 0.5

[[slave]]
name = "path"
signal = { file = "path.csv" }

[[slave]]
name = "arm"
model = "arm.toml"
port = "motion"
start_deg = [-57.0]

[[connection]]
from = "path.r"
to = "arm.robot.r"

[[connection]]
from = "path.v"
to = "arm.robot.v"
"""


def test_a_recorded_path_leads_an_arm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    ARM.write("arm.toml")
    t = np.arange(0.0, 0.5001, 0.01)
    at = 0.3 * np.array([np.cos(np.radians(-57.0)), np.sin(np.radians(-57.0))])
    rows = np.column_stack([t, at[0] + 0.0 * t, at[1] + 0.02 * t**2, 0.0 * t, 0.04 * t])
    np.savetxt("path.csv", rows, delimiter=",", header="t_s,r[1]_m,r[2]_m,v[1]_m_s,v[2]_m_s", comments="")
    Path("system.toml").write_text(SYSTEM, encoding="utf-8")
    assert cli.main(["fmu", "run", "system.toml", "-o", "out"]) == 0, capsys.readouterr()
    assert Path("out/coupled.csv").exists()


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ('signal = { shape = "square" }', "shape: found 'square'"),
        ('signal = { shape = "sine", frequency_Hz = 0 }', "frequency: found 0"),
        ('signal = { shape = "sine", unit = "lbf" }', "unit: found 'lbf'"),
        ('signal = { file = "none.csv" }', "none.csv"),
        ("pid = { kp = -1 }", "kp: found -1"),
        ("pid = { }", "kp"),
        ("impedance = { stiffness = 1, target_m = [1] }", "target"),
    ],
)
def test_what_a_ready_partner_cannot_be_is_refused(table: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "system.toml"
    path.write_text(f'[system]\nstep_s = 0.01\nduration_s = 1\n[[slave]]\nname = "x"\n{table}\n', encoding="utf-8")
    with pytest.raises(BadInput) as refused:
        load_system(path)
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)


def test_names_with_dots_quotes_and_letters_beyond_ascii_are_ends_of_connections() -> None:
    class Quoted(BuiltInSlave):
        def __init__(self) -> None:
            super().__init__("my.größe", [("'länge ü.x'.r[1]", "m"), ("'länge ü.x'.r[2]", "m")], [("öl", "m")])

        def outputs(self) -> dict[str, float]:
            return {"öl": 0.0}

    system = couple([Wave("constant", unit="m", name="w"), Quoted()], [("w.y", "my.größe.'länge ü.x'.r[2]")])
    assert system.connections[0].target == ("my.größe", "'länge ü.x'.r[2]")
    run = run_checked(system)
    assert run.verdict == "good"
    assert run.tidy().units["my.größe.öl"] == "m"
    with pytest.raises(BadInput, match="unknown slave 'your'"):
        couple([Wave("constant", name="w"), Quoted()], [("w.y", "your.größe.x")])
