"""Pinocchio from Python: one call of each kernel."""

from __future__ import annotations

import sys
from pathlib import Path

import line
import numpy as np
import pinocchio as pin

sys.path.insert(0, str(Path(__file__).parents[1]))
import problem

model = pin.Model()
model.gravity.linear = np.array([0.0, 0.0, -problem.GRAVITY])
parent = 0
for j in range(3):
    place = pin.SE3(np.eye(3), np.array([0.0, problem.LENGTH[j - 1] if j else 0.0, 0.0]))
    parent = model.addJoint(parent, pin.JointModelRX(), place, f"joint{j}")
    about = np.diag([1.0, 0.5, 0.5]) * problem.INERTIA[j]
    model.appendBodyToJoint(parent, pin.Inertia(problem.MASS[j], np.array([0.0, problem.COM[j], 0.0]), about), pin.SE3.Identity())
data = model.createData()
q, qd, third = problem.states()


def all_states(kernel: line.Task) -> list[float]:
    """Return what a kernel gives for every state."""
    return [float(v) for i in range(problem.STATES) for v in kernel(model, data, q[i], qd[i], third[i])]


line.serve(
    {
        "check:forward_dynamics": lambda: all_states(pin.aba),
        "check:inverse_dynamics": lambda: all_states(pin.rnea),
        "forward_dynamics": lambda: line.seconds_of(lambda: pin.aba(model, data, q[0], qd[0], third[0])),
        "inverse_dynamics": lambda: line.seconds_of(lambda: pin.rnea(model, data, q[0], qd[0], third[0])),
    }
)
