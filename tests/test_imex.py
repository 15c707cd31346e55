"""The integrator `imex`, which takes friction implicitly: against SciPy's implicit method, and what it refuses."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import armrs
from armrs.cli import main
from test_friction import COMS, INERTIAS, LENGTHS, MASSES, effect, written

FRICTION, SMOOTHING, VISCOSITY, GRAVITY = np.array([2.0, 0.5]), 0.0003, 0.05, 9.81
START, DURATION = (-0.4, 0.6), 1.0


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    laws = [
        effect("coulomb", k, torque=torque, smoothing=SMOOTHING) + effect("viscous", k, viscosity=VISCOSITY)
        for k, torque in enumerate(FRICTION, start=1)
    ]
    return written(tmp_path, "".join(laws))


def swing() -> np.ndarray:
    """Let an arm of two segments fall by its equations of motion and Radau's method; angles every 10 ms, shape (101, 2)."""
    (l1, _), (m1, m2), (c1, c2), (i1, i2) = LENGTHS, MASSES, COMS, INERTIAS

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        q, v = y[:2], y[2:]
        cos, turning = m2 * l1 * c2 * np.cos(q[1]), m2 * l1 * c2 * np.sin(q[1])
        own = m2 * c2**2 + i2
        mass = np.array([[m1 * c1**2 + i1 + m2 * l1**2 + own + 2 * cos, own + cos], [own + cos, own]])
        outer = m2 * c2 * GRAVITY * np.cos(q.sum())
        weight = np.array([(m1 * c1 + m2 * l1) * GRAVITY * np.cos(q[0]) + outer, outer])
        coriolis = turning * np.array([-2 * v[0] * v[1] - v[1] ** 2, v[0] ** 2])
        friction = FRICTION * np.tanh(v / SMOOTHING) + VISCOSITY * v
        return np.concatenate([v, np.linalg.solve(mass, -coriolis - weight - friction)])

    times = np.linspace(0.0, DURATION, 101)
    return solve_ivp(rates, (0.0, DURATION), [*START, 0.0, 0.0], "Radau", times, rtol=1e-9, atol=1e-11).y[:2].T


def error(arm: Path, integrator: str, dt: float) -> float:
    """Return the largest difference from that swing [rad]."""
    run = armrs.simulate(arm, None, integrator=integrator, dt=dt, rate=100.0, duration=DURATION, start=np.array(START))
    return float(np.abs(run.q - swing()).max())


def test_steep_smooth_friction_is_followed_as_by_radau(arm: Path) -> None:
    """The forearm loses its speed at 0.0003 rad/s in 0.01 ms: an explicit method of fourth order rattles, and the run says so."""
    coarse, fine = error(arm, "imex", 1e-3), error(arm, "imex", 0.25e-3)
    assert coarse < 2e-4
    assert fine < 0.5 * coarse
    with pytest.warns(armrs.ArmrsWarning, match="too steep for the step"):
        assert error(arm, "rk4", 1e-3) > 10.0 * coarse


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"accuracy": 1e-6}, "none beside the integrator imex"),
        ({"engine": "rapier"}, "none beside the engine rapier"),
        ({"integrator": "rk5"}, "rk4"),
    ],
)
def test_what_it_cannot_do_is_refused(arm: Path, options: dict[str, Any], said: str) -> None:
    with pytest.raises(armrs.BadInput, match=said):
        armrs.simulate(arm, None, **{"integrator": "imex", "duration": 0.1, **options})


def test_the_command_refuses_a_rigid_coupling_by_name(slow_arm: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ["simulate", slow_arm / "truth.toml", "--movement", slow_arm / "movement.toml", "--integrator", "imex", "--coupling", "rigid"]
    assert main([str(part) for part in asked]) == 1
    assert "cannot simulate a rigid coupling with the integrator imex" in capsys.readouterr().err
