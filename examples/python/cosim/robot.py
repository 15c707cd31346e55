"""A robot that leads a hand along a line, written for PythonFMU: a foreign partner for the arm, with nothing of armrs in it.

`pythonfmu build -f robot.py --handle-state` makes Robot.fmu (FMI 2.0) of it.

The handle goes from (y0, z0) forward by `way` and back, with trapezoidal speed. Where the arm is coupled by its force port, the contact
spring is here: `F` is the force on the arm for its handle at `r` with velocity `v`. Where it is coupled by its motion port, `p` and `u` are
position and velocity of this handle.
"""

import sys

try:
    from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real
except ImportError:
    print("this needs PythonFMU: pip install pythonfmu")
    sys.exit(0)


class Robot(Fmi2Slave):
    """Two freedoms, tracked perfectly."""

    author = "armrs"
    description = "A robot that leads a hand along a line"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.time = 0.0
        self.y0, self.z0 = 0.0, 0.0
        self.way, self.duration, self.ramp = 0.1, 2.0, 0.25
        self.S, self.D = 10_000.0, 0.0
        self.r_y = self.r_z = self.v_y = self.v_z = 0.0
        for name in ("y0", "z0", "way", "duration", "ramp", "S", "D"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))
        for name in ("r_y", "r_z", "v_y", "v_z"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        for name in ("F_y", "F_z", "p_y", "p_z", "u_y", "u_z"):
            getter = getattr(self, f"_{name}")
            self.register_variable(Real(name, causality=Fmi2Causality.output, getter=getter))

    def do_step(self, current_time, step_size):
        """Let time pass."""
        self.time = current_time + step_size
        return True

    def _progress(self):
        """Share of the way and its rate [1/s]: there in the first half, back in the second."""
        half = 0.5 * self.duration
        back = self.time > half
        t = min(max(self.time - half if back else self.time, 0.0), half)
        ramp = self.ramp * half
        top = 1.0 / (half - ramp)
        if t < ramp:
            s, rate = 0.5 * top / ramp * t * t, top / ramp * t
        elif t <= half - ramp:
            s, rate = top * (t - 0.5 * ramp), top
        else:
            left = half - t
            s, rate = 1.0 - 0.5 * top / ramp * left * left, top / ramp * left
        return (1.0 - s, -rate) if back else (s, rate)

    def _p_y(self):
        return self.y0 + self.way * self._progress()[0]

    def _p_z(self):
        return self.z0

    def _u_y(self):
        return self.way * self._progress()[1]

    def _u_z(self):
        return 0.0

    def _F_y(self):
        return self.S * (self._p_y() - self.r_y) + self.D * (self._u_y() - self.v_y)

    def _F_z(self):
        return self.S * (self._p_z() - self.r_z) + self.D * (self._u_z() - self.v_z)
