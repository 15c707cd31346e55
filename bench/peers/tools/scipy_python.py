"""SciPy: the cascade as a scientist writes it, by two solvers."""

from __future__ import annotations

import sys
from pathlib import Path

import line
import numpy as np
from scipy.optimize import least_squares, lsq_linear

sys.path.insert(0, str(Path(__file__).parents[1]))
import problem

FOLDER = Path(sys.argv[1])


def columns(q: np.ndarray, force: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the gravity column of every link and the torque of the force in every joint."""
    angle = np.cumsum(q, axis=1)
    cos, sin = np.cos(angle), np.sin(angle)
    link = problem.LENGTH * (cos * force[:, 1:] - sin * force[:, :1])
    torque = np.cumsum(link[:, ::-1], axis=1)[:, ::-1]
    # On its own weight: the force on the arm holds it.
    return [problem.GRAVITY * cos[:, j] for j in range(3)], [torque[:, j] for j in range(3)]


def cascade(q: np.ndarray, force: np.ndarray, solver: str) -> tuple[list[float], list[float]]:
    """Wrist, elbow, shoulder, each under its bounds; return m1 l1, m2, m2 l2, m3, m3 l3 and the root mean square of each joint."""
    mean, low, high = problem.box()
    gravity, torque = columns(q, force)
    x, rms, beyond = mean.copy(), [0.0] * 3, 0.0
    # The unknowns of a joint: m_j l_j, and the mass of the next segment.
    for joint, own in ((2, [4]), (1, [2, 3]), (0, [0, 1])):
        rest = torque[joint].copy()
        for k in range(joint + 1, 3):
            rest -= gravity[k] * moment(x, k)
        length = problem.LENGTH[joint]
        # Masses beyond the next segment are known by now.
        beyond = length * x[3] if joint == 0 else 0.0
        rest -= gravity[joint] * beyond
        matrix = np.stack([gravity[joint], length * gravity[joint]][: len(own)], axis=1)
        bounds = (low[own], high[own])
        if solver == "lsq_linear":
            found = lsq_linear(matrix, rest, bounds, method="bvls").x
        else:
            found = least_squares(lambda p, a=matrix, b=rest: a @ p - b, mean[own], bounds=bounds).x
        x[own] = found
        rms[joint] = float(np.sqrt(np.mean((matrix @ found - rest) ** 2)))
    return x.tolist(), rms


def moment(x: np.ndarray, joint: int) -> float:
    """Return X_j, what the data determine."""
    length = problem.LENGTH[joint]
    return float([x[0] + length * (x[1] + x[3]), x[2] + length * x[3], x[4]][joint])


def samples(count: str) -> tuple[np.ndarray, np.ndarray]:
    """Return angles and forces that the problem has written."""
    values = np.fromfile(FOLDER / f"slow{count}.f64").reshape(-1, 5)
    return np.ascontiguousarray(values[:, :3]), np.ascontiguousarray(values[:, 3:])


def timed(solver: str, count: str) -> object:
    """Time the cascade, from angles and forces in memory."""
    q, force = samples(count)
    return line.seconds_of(lambda: cascade(q, force, solver))


def check(solver: str, count: str) -> object:
    """Return what the cascade finds."""
    x, rms = cascade(*samples(count), solver)
    return {"x": x, "first_moments": [moment(np.array(x), j) for j in range(3)], "rms": rms}


line.serve(
    {
        "cascade:lsq_linear": lambda n: timed("lsq_linear", n),
        "cascade:least_squares": lambda n: timed("least_squares", n),
        "check:cascade:lsq_linear": lambda n: check("lsq_linear", n),
        "check:cascade:least_squares": lambda n: check("least_squares", n),
    }
)
