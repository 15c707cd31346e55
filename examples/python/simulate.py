"""A robot swings an arm with dry friction: where the torque goes, and what the brakes cost."""

import numpy as np

import armrs
from armrs.demo import true_model

model = true_model()  # the mechanical arm of the thesis
movement = armrs.Movement(np.radians([[-60, 60], [-48, 60], [-60, 60]]), speed=0.5, acceleration=2.0, shape="smooth")
run = armrs.simulate(model, movement)
print(run)

shoulder = 0
for name in ("inertial", "gravity", "resisting", "contact"):
    print(f"{name:>10}: up to {np.abs(run.columns[f'torque.{name}'][:, shoulder]).max():.3f} N m")

# The same run has the same digest on every machine.
assert run.digest == armrs.simulate(model, movement).digest

# Without the brakes, all else equal.
free = model.replace(joints=tuple(armrs.Joint(joint.name) for joint in model.joints))
lighter = armrs.simulate(free, movement)
print(f"the brakes cost up to {np.abs(run.force_on_arm - lighter.force_on_arm).max():.2f} N at the handle")
