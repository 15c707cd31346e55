"""The kernels: one state or many at once, and two ways to the same torque."""

import numpy as np

import armrs

# Upper arm and forearm of an adult man.
arm = armrs.Arm(lengths=[0.322, 0.264], masses=[2.114, 1.264], coms=[0.186, 0.121], inertias=[0.0165, 0.0074])
print(arm)

q = np.radians([-60.0, 30.0])
print("handle at", arm.forward_kinematics(q), "m")
print("torques that hold the arm still", arm.gravity(q), "N m")

# Ten thousand states at once: time along axis 0, shape (n_samples, n_joints).
t = np.linspace(0.0, 10.0, 10_000)
q = np.column_stack([-1.0 + 0.3 * np.sin(t), 0.5 + 0.4 * np.sin(1.3 * t)])
qd = np.column_stack([0.3 * np.cos(t), 0.52 * np.cos(1.3 * t)])
qdd = np.column_stack([-0.3 * np.sin(t), -0.676 * np.sin(1.3 * t)])
torque = arm.inverse_dynamics(q, qd, qdd)

# The same from the regressor: first moments, normal moments, second moments.
parameters = np.concatenate([arm.first_moments, np.zeros(2), arm.second_moments])
assert np.allclose(arm.regressor(q, qd, qdd) @ parameters, torque)
# And back to the accelerations.
assert np.allclose(arm.forward_dynamics(q, qd, torque), qdd)
print("largest torques", np.abs(torque).max(axis=0), "N m")
