"""numba: a loop compiled from Python, as one writes it for this arm; and the fit by simulation with SciPy."""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path

import line
import numpy as np
from numba import njit

sys.path.insert(0, str(Path(__file__).parents[1]))
import problem

FOLDER = Path(sys.argv[1])
A, L, M, J = problem.LENGTH, problem.COM, problem.MASS, problem.INERTIA
FIRST = M * L + A * (M.sum() - np.cumsum(M))
SECOND = J + M * L**2 + A**2 * (M.sum() - np.cumsum(M))
A0, A1, A2 = (float(v) for v in A)
X0, X1, X2 = (float(v) for v in FIRST)
J0, J1, J2 = (float(v) for v in SECOND)
G, K, H = problem.GRAVITY, problem.SPRING, problem.STEP
Q0, Q1, Q2 = (float(v) for v in problem.FROM)
D0, D1, D2 = (float(v) for v in problem.TO - problem.FROM)


@njit(inline="always")
def accelerate(s0, c0, s1, c1, s2, c2, w0, w1, w2, t0, t1, t2):
    """Return link accelerations from the torques on the links, by L D Lᵀ."""
    m01, m02, m12 = A0 * X1 * (c0 * c1 + s0 * s1), A0 * X2 * (c0 * c2 + s0 * s2), A1 * X2 * (c1 * c2 + s1 * s2)
    h01, h02, h12 = A0 * X1 * (s0 * c1 - c0 * s1), A0 * X2 * (s0 * c2 - c0 * s2), A1 * X2 * (s1 * c2 - c1 * s2)
    b0 = t0 - G * X0 * c0 - h01 * w1 * w1 - h02 * w2 * w2
    b1 = t1 - G * X1 * c1 + h01 * w0 * w0 - h12 * w2 * w2
    b2 = t2 - G * X2 * c2 + h02 * w0 * w0 + h12 * w1 * w1
    l10, l20 = m01 / J0, m02 / J0
    d1 = J1 - l10 * m01
    e12 = m12 - l10 * m02
    l21 = e12 / d1
    d2 = J2 - l20 * m02 - l21 * e12
    y1 = b1 - l10 * b0
    y2 = b2 - l20 * b0 - l21 * y1
    a2 = y2 / d2
    a1 = y1 / d1 - l21 * a2
    return b0 / J0 - l10 * a1 - l20 * a2, a1, a2


@njit(inline="always")
def handle(time, duration):
    """Return y and z of the point that the spring pulls towards."""
    half = 0.5 * duration
    ramp = 0.1 * half
    peak = 1.0 / (half - ramp)
    inside = min(time, duration - time)
    near = min(inside, half - inside)
    part = peak * (0.5 * near * near / ramp if near < ramp else near - 0.5 * ramp)
    s = part if inside <= 0.5 * half else 1.0 - part
    r0 = Q0 + s * D0
    r1 = r0 + Q1 + s * D1
    r2 = r1 + Q2 + s * D2
    return A0 * np.cos(r0) + A1 * np.cos(r1) + A2 * np.cos(r2), A0 * np.sin(r0) + A1 * np.sin(r1) + A2 * np.sin(r2)


@njit(inline="always")
def slopes(p0, p1, p2, w0, w1, w2, y, z, viscosity, stiffness):
    """Return the accelerations of the links and the force of the spring."""
    s0, c0, s1, c1, s2, c2 = np.sin(p0), np.cos(p0), np.sin(p1), np.cos(p1), np.sin(p2), np.cos(p2)
    fy, fz = K * (y - A0 * c0 - A1 * c1 - A2 * c2), K * (z - A0 * s0 - A1 * s1 - A2 * s2)
    e0 = stiffness[0] * p0 + viscosity[0] * w0
    e1 = stiffness[1] * (p1 - p0) + viscosity[1] * (w1 - w0)
    e2 = stiffness[2] * (p2 - p1) + viscosity[2] * (w2 - w1)
    t0, t1, t2 = A0 * (fz * c0 - fy * s0) - e0 + e1, A1 * (fz * c1 - fy * s1) - e1 + e2, A2 * (fz * c2 - fy * s2) - e2
    a0, a1, a2 = accelerate(s0, c0, s1, c1, s2, c2, w0, w1, w2, t0, t1, t2)
    return a0, a1, a2, fy, fz


@njit
def run(q, steps, duration, viscosity, stiffness, record):
    """Run semi-implicit Euler; `record` gets angles and forces at 50 Hz."""
    p0, p1, p2 = q[0], q[0] + q[1], q[0] + q[1] + q[2]
    w0 = w1 = w2 = 0.0
    for i in range(steps + 1):
        y, z = handle(i * H, duration)
        a0, a1, a2, fy, fz = slopes(p0, p1, p2, w0, w1, w2, y, z, viscosity, stiffness)
        if i % 80 == 0:
            k = i // 80
            record[k, 0], record[k, 1], record[k, 2] = p0, p1 - p0, p2 - p1
            record[k, 3], record[k, 4] = fy, fz
        if i == steps:
            return
        w0 += H * a0
        w1 += H * a1
        w2 += H * a2
        p0 += H * w0
        p1 += H * w1
        p2 += H * w2


@njit
def run_fourth(q, substeps, samples, duration, viscosity, stiffness, record):
    """Run the classical fourth-order method, `substeps` steps from one sample to the next; `record` gets angles."""
    h = 0.02 / substeps
    p0, p1, p2 = q[0], q[0] + q[1], q[0] + q[1] + q[2]
    w0 = w1 = w2 = 0.0
    y0, z0 = handle(0.0, duration)
    for k in range(samples + 1):
        record[k, 0], record[k, 1], record[k, 2] = p0, p1 - p0, p2 - p1
        if k == samples:
            return
        for i in range(k * substeps, (k + 1) * substeps):
            y1, z1 = handle((i + 0.5) * h, duration)
            y2, z2 = handle((i + 1) * h, duration)
            a0, a1, a2, _, _ = slopes(p0, p1, p2, w0, w1, w2, y0, z0, viscosity, stiffness)
            u0, u1, u2 = w0 + 0.5 * h * a0, w1 + 0.5 * h * a1, w2 + 0.5 * h * a2
            l0, l1, l2 = p0 + 0.5 * h * w0, p1 + 0.5 * h * w1, p2 + 0.5 * h * w2
            b0, b1, b2, _, _ = slopes(l0, l1, l2, u0, u1, u2, y1, z1, viscosity, stiffness)
            v0, v1, v2 = w0 + 0.5 * h * b0, w1 + 0.5 * h * b1, w2 + 0.5 * h * b2
            l0, l1, l2 = p0 + 0.5 * h * u0, p1 + 0.5 * h * u1, p2 + 0.5 * h * u2
            c0, c1, c2, _, _ = slopes(l0, l1, l2, v0, v1, v2, y1, z1, viscosity, stiffness)
            x0, x1, x2 = w0 + h * c0, w1 + h * c1, w2 + h * c2
            l0, l1, l2 = p0 + h * v0, p1 + h * v1, p2 + h * v2
            d0, d1, d2, _, _ = slopes(l0, l1, l2, x0, x1, x2, y2, z2, viscosity, stiffness)
            p0 += h * (w0 + h / 6.0 * (a0 + b0 + c0))
            p1 += h * (w1 + h / 6.0 * (a1 + b1 + c1))
            p2 += h * (w2 + h / 6.0 * (a2 + b2 + c2))
            w0 += h / 6.0 * (a0 + 2.0 * (b0 + c0) + d0)
            w1 += h / 6.0 * (a1 + 2.0 * (b1 + c1) + d1)
            w2 += h / 6.0 * (a2 + 2.0 * (b2 + c2) + d2)
            y0, z0 = y2, z2


@njit
def forward(q, qd, tau, out):
    """Write joint accelerations."""
    p0, p1, p2 = q[0], q[0] + q[1], q[0] + q[1] + q[2]
    a0, a1, a2 = accelerate(
        np.sin(p0), np.cos(p0), np.sin(p1), np.cos(p1), np.sin(p2), np.cos(p2),
        qd[0], qd[0] + qd[1], qd[0] + qd[1] + qd[2], tau[0] - tau[1], tau[1] - tau[2], tau[2],
    )  # fmt: skip
    out[0], out[1], out[2] = a0, a1 - a0, a2 - a1


q, qd, third = problem.states()
starts = np.fromfile(FOLDER / "starts.f64").reshape(-1, 3)
STEPS = round(problem.LONG / problem.STEP)
record = np.empty((STEPS // problem.RECORD + 1, 5))
VISCOSITY, STIFFNESS = np.full(3, problem.VISCOSITY), np.full(3, problem.STIFFNESS)


def one_run() -> np.ndarray:
    """Return angles and forces of the single run."""
    run(starts[0], STEPS, problem.LONG, VISCOSITY, STIFFNESS, record)
    return record


def fourth(substeps: str) -> np.ndarray:
    """Return the angles of the single run by the fourth-order method."""
    angles = np.empty((len(record), 3))
    run_fourth(starts[0], int(substeps), len(record) - 1, problem.LONG, VISCOSITY, STIFFNESS, angles)
    return angles


@njit
def derivative(time, state):
    """Return what SciPy integrates: speeds and accelerations of the links."""
    p0, p1, p2, w0, w1, w2 = state
    y, z = handle(time, problem.LONG)
    a0, a1, a2, _, _ = slopes(p0, p1, p2, w0, w1, w2, y, z, VISCOSITY, STIFFNESS)
    return np.array([w0, w1, w2, a0, a1, a2])


CORNERS = problem.LONG * np.array([0.0, 0.05, 0.45, 0.5, 0.55, 0.95, 1.0])
"""Where the speed of the movement has a corner: a solver starts anew there."""
TIMES = np.linspace(0.0, problem.LONG, len(record))


def solved(solver: str, tolerance: str) -> np.ndarray:
    """Return the angles of the single run by a solver of SciPy."""
    from scipy.integrate import odeint, solve_ivp

    size = float(tolerance)
    state = np.concatenate([np.cumsum(starts[0]), np.zeros(3)])
    found = [state[None]]
    for begin, end in pairwise(CORNERS):
        times = TIMES[(begin - 1e-9 < TIMES) & (end + 1e-9 > TIMES)]
        if solver == "lsoda":
            part = odeint(derivative, state, times, tfirst=True, rtol=size, atol=size, mxstep=100_000)
        else:
            part = solve_ivp(derivative, (begin, end), state, "DOP853", times, rtol=size, atol=size).y.T
        state = part[-1]
        found.append(part[1:])
    return np.diff(np.vstack(found)[:, :3], prepend=0.0)


def check_forward() -> list[float]:
    """Return the accelerations of every state."""
    out = np.empty((problem.STATES, 3))
    for i in range(problem.STATES):
        forward(q[i], qd[i], third[i], out[i])
    return out.ravel().tolist()


def fit() -> object:
    """Time the fit of viscosities and stiffnesses by simulation."""
    from scipy.optimize import least_squares

    data = np.fromfile(FOLDER / "fit.f64").reshape(-1, 5)

    def residual(x: np.ndarray) -> np.ndarray:
        run(problem.equilibrium(joints=x), STEPS, problem.LONG, x[::2].copy(), x[1::2].copy(), record)
        return ((record - data) / problem.NOISE).ravel()

    found = {}

    def solve() -> None:
        result = least_squares(residual, problem.GUESS, bounds=(np.zeros(6), problem.UPPER), x_scale="jac")
        found.update(x=result.x.tolist(), cost=2.0 * float(result.cost))

    return line.seconds_of(solve) | found


out = np.empty(3)
line.serve(
    {
        "check:forward_dynamics": check_forward,
        "check:run": lambda: one_run()[:, :3].ravel().tolist(),
        "forward_dynamics": lambda: line.seconds_of(lambda: forward(q[0], qd[0], third[0], out)),
        "accurate:rk4": lambda n: line.seconds_of(lambda: fourth(n)),
        "check:accurate:rk4": lambda n: fourth(n).ravel().tolist(),
        "accurate:dop853": lambda size: line.seconds_of(lambda: solved("dop853", size)),
        "check:accurate:dop853": lambda size: solved("dop853", size).ravel().tolist(),
        "accurate:lsoda": lambda size: line.seconds_of(lambda: solved("lsoda", size)),
        "check:accurate:lsoda": lambda size: solved("lsoda", size).ravel().tolist(),
        "run": lambda: line.seconds_of(one_run),
        "fit": fit,
    }
)
