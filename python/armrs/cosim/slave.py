"""The arm as a co-simulation slave in Python, with the variables, rules and bits of the FMU."""

from __future__ import annotations

import copy
import json
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .. import _armrs, checks
from ..errors import BadInput, SlaveError, Text, unknown_name
from ..fmu.slave_interface import Partner, Status, StepResult, Variable, listed
from ..model import Model, load_model
from ..workflows.stiction import DEFAULT_DT

PORTS = ("force", "motion")


class Slave(Partner):
    """An arm with the life cycle of FMI 3.0 co-simulation.

    It is made in the state "instantiated". `docs/cosim.md` has its variables, which are those of the exported FMU, and the states.

    Parameters
    ----------
    model : Model or path
        The arm. What its sensors do is not part of the slave; the [robot] is what it is coupled to.
    port : {"force", "motion"}
        Force on the arm in and motion of the handle out, or motion of the robot's handle in and contact force out.
    start, start_speed : array_like, shape (n_joints,), optional
        Angles [rad] and speeds [rad/s] at the start; zero when absent.
    handle : (float, float), optional
        Motion port: the robot's handle at the start [m]; at the arm's tip when absent.
    rest : bool
        Start in equilibrium near `start`: on the spring of the contact, or hanging where the port is the force port.
    step : float
        Inner step [s].
    name : str, optional
        Name of the instance.

    Examples
    --------
    >>> from armrs.cosim import Slave
    >>> from armrs.demo import true_model
    >>> arm = Slave(true_model(), start=[-1.0, 0.5])
    >>> arm.enter_initialization_mode(0.0)
    >>> arm.exit_initialization_mode()
    >>> arm.set(["handle.F[1]", "handle.F[2]"], [0.0, 5.0])
    >>> arm.do_step(0.0, 0.01).status.name
    'OK'
    """

    can_rollback = True
    internal_step: float

    def __init__(
        self,
        model: Model | str | os.PathLike[str],
        *,
        port: str = "force",
        start: Any = None,
        start_speed: Any = None,
        handle: tuple[float, float] | None = None,
        rest: bool = False,
        step: float = DEFAULT_DT,
        name: str | None = None,
    ) -> None:
        if not isinstance(model, Model):
            name = name or checks.path("model", model, Model).stem
        model = checks.loaded("model", model, Model, load_model)
        checks.choice("port", port, PORTS)
        self.internal_step = checks.number("step", step, above=0.0, unit="s")
        self.model = model
        self.name = checks.text("name", "arm" if name is None else name)
        self._coupling: dict[str, Any] = {
            "name": self.name,
            "port": port,
            "step": self.internal_step,
            "q": _joints("start", start, model.n_joints),
            "qd": _joints("start_speed", start_speed, model.n_joints),
            "handle": None if handle is None else list(checks.pair("handle", handle, unit="m")),
            "rest": checks.flag("rest", rest),
        }
        self.port = port
        self._compile()

    def _compile(self) -> None:
        self.compiled = _armrs.ArmSlave(_armrs.Rig(self.model), self._coupling)
        self.variables = {row["name"]: _variable(row) for row in self.compiled.variables()}

    def __repr__(self) -> str:
        return f"Slave({self.name!r}, {self.port} port, {self.mode}, {self.time:g} s)"

    @property
    def left_out(self) -> list[str]:
        """Effects of the model that the slave does not have: those in sensors, and behind the force port those in the contact."""
        inside = Counter(effect["kind"] for effect in json.loads(self.compiled.json)["effects"])
        return sorted((Counter(effect.kind for effect in self.model.effects) - inside).elements())

    @property
    def token(self) -> str:
        """Instantiation token: it changes with every value of the arm and every row of its table of variables."""
        return self.compiled.token

    @property
    def mode(self) -> str:
        """Where it is in its life."""
        return self.compiled.mode

    @property
    def time(self) -> float:
        """Time [s]."""
        return self.compiled.time

    def finer(self) -> Slave:
        """Return the same slave as it was made, with half the inner step."""
        other = copy.copy(self)
        other.internal_step = step = 0.5 * self._coupling["step"]
        other._coupling = self._coupling | {"step": step}
        other._compile()
        return other

    def enter_initialization_mode(self, start: float = 0.0, stop: float | None = None, tolerance: float | None = None) -> None:
        """Begin the initialization; the tolerance means nothing to a fixed step."""
        self.compiled.enter_initialization_mode(float(start), None if stop is None else float(stop))

    def exit_initialization_mode(self) -> None:
        """Take parameters and start values."""
        self.compiled.exit_initialization_mode()

    def set(self, names: Sequence[str] | str, values: Any) -> None:
        """Set variables by name, all or none."""
        self.compiled.set(self._references(names), np.atleast_1d(np.asarray(values, dtype=float)))

    def get(self, names: Sequence[str] | str) -> np.ndarray:
        """Return variables by name, shape (len(names),)."""
        return self.compiled.get(self._references(names))

    def do_step(self, time: float, step: float) -> StepResult:
        """Make a communication step from a time [s], of a length [s]."""
        try:
            self.compiled.do_step(float(time), float(step))
        except SlaveError as error:
            if error.status != Status.DISCARD:
                raise
            return StepResult(Status.DISCARD, self.time, message=error.message)
        return StepResult(Status.OK, self.time)

    def get_output_derivatives(self, names: Sequence[str] | str, orders: Sequence[int] | None = None) -> np.ndarray:
        """Return time derivatives of outputs, with the inputs going on as they are; the only order is 1."""
        references = self._references(names)
        return self.compiled.output_derivatives(references, [1] * len(references) if orders is None else list(orders))

    def get_state(self) -> _armrs.ArmState:
        """Return the state, to come back to it."""
        return self.compiled.state()

    def set_state(self, state: _armrs.ArmState) -> None:
        """Come back to a state of the same arm."""
        self.compiled.set_state(state)

    def serialize_state(self, state: _armrs.ArmState) -> bytes:
        """Return a state as bytes that a slave of the same arm in another process, or an FMU of it, can read."""
        return self.compiled.serialize(state)

    def deserialize_state(self, state: bytes) -> _armrs.ArmState:
        """Return the state that was serialized."""
        return self.compiled.deserialize(state)

    def terminate(self) -> None:
        """End the run."""
        self.compiled.terminate()

    def reset(self) -> None:
        """Go back to how the slave was made."""
        self.compiled.reset()

    def _references(self, names: Sequence[str] | str) -> list[int]:
        try:
            return [self.variables[name].reference for name in listed(names)]
        except KeyError as error:
            raise unknown_name(self.name, error.args[0], self.variables, what="variable") from None


def _joints(place: str, values: Any, n: int) -> list[float]:
    if values is None:
        return [0.0] * n
    given: list[float] = checks.numbers(place, values).reshape(-1).tolist()
    if len(given) != n:
        raise BadInput(place, Text(f"{len(given)} values"), f"{n}, one a joint")
    return given


def _variable(row: Mapping[str, Any]) -> Variable:
    return Variable(**{**row, "exponents": tuple(row["exponents"])})
