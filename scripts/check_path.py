"""How far forces are off because a robot's path is known at samples only.

    python scripts/check_path.py

The mechanical arm of the thesis without its brakes is led through a movement, and led again along a cubic spline through the robot's
angles at 50 and 100 Hz. The difference of the two contact forces is what no model of the arm can take away; it depends on how sharply the
robot sets off and stops.
"""

from __future__ import annotations

import numpy as np

import armrs
from armrs import Joint, Model, Movement, Trial
from armrs.demo import true_model

WAYPOINTS = np.radians([[-56.0, 53.0], [-37.0, 43.0], [-52.0, 77.0], [-56.0, 53.0]])
SPEED = 1.2
"""Largest speed of a joint [rad/s]."""
FINE = 500.0
"""Samples a second of the run that stands for the truth [Hz]."""


def forces_off(model: Model, movement: Movement, rate: float) -> np.ndarray:
    """Return the root mean square of both components of the force, led along samples less led along the path itself [N]."""
    truth = armrs.simulate(model, movement, rate=FINE)
    every = round(FINE / rate)
    time, angles, robot = (truth.columns[name][::every] for name in ("time", "q", "robot_q"))
    trial = Trial("sampled", "sampled", 1, "test", time, angles, robot_q=robot)
    force = armrs.simulate(model, trial, rate=rate).columns["force_on_arm"]
    off = force - truth.columns["force_on_arm"][::every][: len(force)]
    return np.sqrt(np.mean(off**2, axis=0))


def main() -> None:
    """Print the table."""
    truth = true_model()
    model = truth.replace(joints=tuple(Joint(j.name) for j in truth.joints))
    print("ramps      rad/s²    Hz   Fy off [N]   Fz off [N]")
    for shape in ("trapezoid", "smooth"):
        for acceleration in (0.6, 5.0, 20.0):
            movement = Movement(WAYPOINTS, speed=SPEED, acceleration=acceleration, pause=0.3, shape=shape)
            for rate in (50.0, 100.0):
                y, z = forces_off(model, movement, rate)
                print(f"{shape:9} {acceleration:7.1f} {rate:5.0f} {y:12.4f} {z:12.4f}")


if __name__ == "__main__":
    main()
