"""armrs from Python: kernels one by one and in a batch, the single run, and the fit by simulation."""

from __future__ import annotations

import sys
from pathlib import Path

import line
import numpy as np

import armrs

sys.path.insert(0, str(Path(__file__).parents[1]))
import problem

FOLDER = Path(sys.argv[1])
BATCH = 100_000


def model(joints: np.ndarray) -> armrs.Model:
    """Return the arm with viscosity and stiffness of each joint."""
    return armrs.Model(
        segments=tuple(
            armrs.Segment(f"segment {j + 1}", length=a, mass=m, com=c, inertia=i)
            for j, (a, m, c, i) in enumerate(zip(problem.LENGTH, problem.MASS, problem.COM, problem.INERTIA, strict=True))
        ),
        joints=tuple(armrs.Joint(f"joint {j + 1}", viscosity=joints[2 * j], stiffness=joints[2 * j + 1]) for j in range(3)),
        gravity=problem.GRAVITY,
        contact=armrs.Contact((problem.SPRING, problem.SPRING)),
    )


arm = armrs.Arm(problem.LENGTH, problem.MASS, problem.COM, problem.INERTIA, gravity=problem.GRAVITY)
q, qd, third = problem.states()
many = [np.resize(part, (BATCH, 3)) for part in (q, qd, third)]
usual = model(np.tile([problem.VISCOSITY, problem.STIFFNESS], 3))
# The elbow goes furthest: its speed and acceleration set the pace.
half = 0.5 * problem.LONG
speed = float(np.abs(problem.TO - problem.FROM).max() / (0.9 * half))
movement = armrs.Movement(np.array([problem.FROM, problem.TO, problem.FROM]), speed=speed, acceleration=speed / (0.1 * half))


def run(of: armrs.Model = usual, integrator: str = "euler", dt: float = problem.STEP) -> armrs.Simulated:
    """Simulate 20 s, recorded at 50 Hz."""
    return armrs.simulate(of, movement, integrator=integrator, dt=dt, duration=problem.LONG)


def accurate(substeps: str) -> armrs.Simulated:
    """Simulate 20 s with so many steps of fourth order from one sample to the next."""
    return run(integrator="rk4", dt=problem.RECORD * problem.STEP / int(substeps))


def found(accuracy: str) -> armrs.Simulated:
    """Simulate 20 s with the step that is found for an accuracy."""
    return armrs.simulate(usual, movement, accuracy=float(accuracy), duration=problem.LONG)


def write_fit() -> bool:
    """Write the recording that the fits start from: that of an arm with other joints, with noise."""
    true = run(model(problem.TRUE))
    exact = np.hstack([true.q, true.force_on_arm])
    (exact + np.random.default_rng(6).normal(size=exact.shape) * problem.NOISE).tofile(FOLDER / "fit.f64")
    return True


def fit() -> object:
    """Time the fit of viscosities and stiffnesses by simulation."""
    data = np.fromfile(FOLDER / "fit.f64").reshape(-1, 5)
    bounds = {
        f"{kind}{joint + 1} {name}": (0.0, problem.UPPER[2 * joint + number])
        for joint in range(3)
        for number, (kind, name) in enumerate((("viscous", "viscosity"), ("elastic", "stiffness")))
    }
    found = {}

    def solve() -> None:
        fitted = armrs.fit_by_simulation(
            model(problem.GUESS), movement, data[:, :3], data[:, 3:], bounds,
            angle_noise=problem.NOISE[0], force_noise=problem.NOISE[3], integrator="euler", dt=problem.STEP,
        )  # fmt: skip
        found.update(x=list(fitted.values.values()), cost=fitted.residual_rms**2 * data.size)

    return line.seconds_of(solve) | found


def batch(kernel: line.Task) -> dict[str, float]:
    """Time a kernel over many states, a state."""
    return {"seconds": line.seconds_of(lambda: kernel(*many))["seconds"] / BATCH}


line.serve(
    {
        "accurate": lambda n: line.seconds_of(lambda: accurate(n)),
        "accurate:found": lambda a: line.seconds_of(lambda: found(a)),
        "check:accurate:found": lambda a: found(a).q.ravel().tolist(),
        "check:accurate": lambda n: accurate(n).q.ravel().tolist(),
        "check:forward_dynamics": lambda: arm.forward_dynamics(q, qd, third).ravel().tolist(),
        "check:inverse_dynamics": lambda: arm.inverse_dynamics(q, qd, third).ravel().tolist(),
        "check:run": lambda: run().q.ravel().tolist(),
        "check:run:fourth": lambda: run(integrator="rk4").q.ravel().tolist(),
        "forward_dynamics": lambda: line.seconds_of(lambda: arm.forward_dynamics(q[0], qd[0], third[0])),
        "inverse_dynamics": lambda: line.seconds_of(lambda: arm.inverse_dynamics(q[0], qd[0], third[0])),
        "forward_dynamics:batch": lambda: batch(arm.forward_dynamics),
        "inverse_dynamics:batch": lambda: batch(arm.inverse_dynamics),
        "fit": fit,
        "run": lambda: line.seconds_of(run),
        "write_fit": write_fit,
    }
)
