"""A haptic wall: a stateless slave whose force follows from position and velocity."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from .. import checks
from ..errors import SlaveError, unknown_name
from ..fmu.slave_interface import Partner, Status, StepResult, Variable, listed

_AXES = {"y": 0, "z": 1}
_NEWTON, _METRE, _SPEED = (1, 1, -2, 0), (0, 1, 0, 0), (0, 1, -1, 0)


class Wall(Partner):
    """A wall that pushes the arm's handle back: `x (stiffness + damping · ẋ)` at a depth x, and never pulls (Hunt and Crossley 1975).

    Inputs `r[1]`, `r[2]` [m] and `v[1]`, `v[2]` [m/s] of the handle; outputs `F[1]`, `F[2]` [N], the force of the wall on the arm.

    Parameters
    ----------
    axis : {"y", "z", "-y", "-z"}
        Direction in which the wall lies: with "y" it is where y is larger than `position`.
    position : float
        Its face along that axis [m].
    stiffness : float
        [N/m]
    damping : float
        For each metre of depth, so that the force does not jump where contact begins [N s/m²].
    """

    can_rollback = True

    def __init__(self, axis: str, position: float, stiffness: float, damping: float = 0.0, *, name: str = "wall") -> None:
        checks.choice("axis", axis, ("y", "z", "-y", "-z"))
        self.name = name
        self._axis, self._sign = _AXES[axis[-1]], -1.0 if axis.startswith("-") else 1.0
        self._position = checks.number("position", position, unit="m")
        self._stiffness = checks.number("stiffness", stiffness, least=0.0, unit="N/m")
        self._damping = checks.number("damping", damping, least=0.0, unit="N s/m²")
        self._values = {f"{stem}[{k}]": 0.0 for stem in ("r", "v") for k in (1, 2)}
        inputs = [("r", "m", _METRE), ("v", "m/s", _SPEED)]
        rows = [(f"{stem}[{k}]", "input", unit, powers) for stem, unit, powers in inputs for k in (1, 2)]
        rows += [(f"F[{k}]", "output", "N", _NEWTON) for k in (1, 2)]
        self.variables = {
            n: Variable(n, i, causality, "continuous", unit=unit, exponents=powers, start=0.0 if causality == "input" else None)
            for i, (n, causality, unit, powers) in enumerate(rows)
        }
        self._time = 0.0

    def enter_initialization_mode(self, start: float = 0.0, stop: float | None = None, tolerance: float | None = None) -> None:
        """Begin at a time [s]."""
        self._time = start

    def exit_initialization_mode(self) -> None:
        """Do nothing: there is no state."""

    def set(self, names: Sequence[str] | str, values: Any) -> None:
        """Set inputs by name."""
        for name, value in zip(listed(names), np.atleast_1d(values), strict=True):
            if name not in self._values:
                raise unknown_name(self.name, name, self._values, what="input")
            if not np.isfinite(value):
                raise SlaveError("set", Status.DISCARD, f"{name} is {value}, allowed is a finite number")
            self._values[name] = float(value)

    def get(self, names: Sequence[str] | str) -> np.ndarray:
        """Return values by name."""
        known = self._values | {f"F[{k + 1}]": self._force() if k == self._axis else 0.0 for k in (0, 1)}
        try:
            return np.array([known[name] for name in listed(names)])
        except KeyError as error:
            raise unknown_name(self.name, error.args[0], known, what="variable") from None

    def do_step(self, time: float, step: float) -> StepResult:
        """Let time pass."""
        self._time = time + step
        return StepResult(Status.OK, self._time)

    def get_state(self) -> Any:
        """Return inputs and time."""
        return dict(self._values), self._time

    def set_state(self, state: Any) -> None:
        """Come back to them."""
        self._values, self._time = dict(state[0]), state[1]

    def terminate(self) -> None:
        """Do nothing: there is nothing to end."""

    def reset(self) -> None:
        """Set all inputs to zero."""
        self._values = dict.fromkeys(self._values, 0.0)

    def _force(self) -> float:
        into = self._sign * (self._values[f"r[{self._axis + 1}]"] - self._position)
        speed = self._sign * self._values[f"v[{self._axis + 1}]"]
        push = max(0.0, into * (self._stiffness + self._damping * speed)) if into > 0.0 else 0.0
        return -self._sign * push
