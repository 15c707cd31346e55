"""Built-in slaves: signals over time, a PID controller, an impedance controller."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import checks
from ..errors import BadInput, SlaveError, Text, unknown_name
from ..fmu.slave_interface import Partner, Status, StepResult, Variable, listed
from ..io.samples import read_samples

_UNITS: dict[str, tuple[int, int, int, int]] = {
    "": (0, 0, 0, 0),
    "N": (1, 1, -2, 0),
    "Nm": (1, 2, -2, 0),
    "m": (0, 1, 0, 0),
    "m_s": (0, 1, -1, 0),
    "rad": (0, 0, 0, 1),
    "rad_s": (0, 0, -1, 1),
}
"""Units as they stand at the ends of the names of columns, with powers of kg, m, s and rad."""
_NAMES = {"": "1", "Nm": "N.m", "m_s": "m/s", "rad_s": "rad/s"}


class BuiltInSlave(Partner):
    """A partner in Python whose outputs follow from its inputs, its time and a few states.

    Parameters
    ----------
    name : str
    inputs, outputs : iterable of (str, str)
        Names and units, as in `_UNITS`.
    """

    can_rollback = True

    def __init__(self, name: str, inputs: Iterable[tuple[str, str]], outputs: Iterable[tuple[str, str]]) -> None:
        self.name = name
        rows = [(*row, "input") for row in inputs] + [(*row, "output") for row in outputs]
        self.variables = {
            n: Variable(
                n, i, causality, "continuous", unit=_NAMES.get(u, u), exponents=_UNITS[u], start=0.0 if causality == "input" else None
            )
            for i, (n, u, causality) in enumerate(rows)
        }
        self.inputs = {n: 0.0 for n, _, causality in rows if causality == "input"}
        self.states: dict[str, float] = {}
        self.time = 0.0

    def outputs(self) -> dict[str, float]:
        """Return all outputs by name, from inputs, states and time."""
        raise NotImplementedError

    def advance(self, step: float) -> None:
        """Advance the states by a step [s] with the inputs as they are."""

    def enter_initialization_mode(self, start: float = 0.0, stop: float | None = None, tolerance: float | None = None) -> None:
        """Begin at a time [s]."""
        self.time = start

    def exit_initialization_mode(self) -> None:
        """Do nothing: the states are zero."""

    def set(self, names: Sequence[str] | str, values: Any) -> None:
        """Set inputs by name."""
        for name, value in zip(listed(names), np.atleast_1d(values), strict=True):
            if name not in self.inputs:
                raise unknown_name(self.name, name, self.inputs, what="input")
            if not np.isfinite(value):
                raise SlaveError("set", Status.DISCARD, f"{name} is {value}, allowed is a finite number")
            self.inputs[name] = float(value)

    def get(self, names: Sequence[str] | str) -> np.ndarray:
        """Return values by name."""
        known = self.inputs | self.outputs()
        try:
            return np.array([known[name] for name in listed(names)])
        except KeyError as error:
            raise unknown_name(self.name, error.args[0], known, what="variable") from None

    def do_step(self, time: float, step: float) -> StepResult:
        """Advance by a step."""
        self.advance(step)
        self.time = time + step
        return StepResult(Status.OK, self.time)

    def get_state(self) -> Any:
        """Return inputs, states and time."""
        return dict(self.inputs), dict(self.states), self.time

    def set_state(self, state: Any) -> None:
        """Come back to them."""
        self.inputs, self.states, self.time = dict(state[0]), dict(state[1]), state[2]

    def terminate(self) -> None:
        """Do nothing: there is nothing to end."""

    def reset(self) -> None:
        """Set all inputs and states to zero."""
        self.inputs = dict.fromkeys(self.inputs, 0.0)
        self.states = dict.fromkeys(self.states, 0.0)
        self.time = 0.0


class Wave(BuiltInSlave):
    """The output `y` as a function of time: constant, a sine, or a step.

    `y = offset + amplitude · s(t)`, with s = 0 for a constant, `sin(2 π frequency (t − start))`, or 1 from `start` on for a step.

    Parameters
    ----------
    shape : {"constant", "sine", "step"}
    offset, amplitude : float
        In the unit.
    frequency : float
        Of a sine [Hz].
    start : float
        Of a step, or of the phase of a sine [s].
    unit : {"", "N", "Nm", "m", "m_s", "rad", "rad_s"}
    """

    SHAPES = ("constant", "sine", "step")

    def __init__(
        self,
        shape: str,
        *,
        offset: float = 0.0,
        amplitude: float = 0.0,
        frequency: float = 1.0,
        start: float = 0.0,
        unit: str = "",
        name: str = "signal",
    ) -> None:
        super().__init__(name, (), [("y", checks.choice("unit", unit, tuple(_UNITS)))])
        self._shape = checks.choice("shape", shape, self.SHAPES)
        self._offset, self._amplitude = checks.number("offset", offset), checks.number("amplitude", amplitude)
        self._frequency = checks.number("frequency", frequency, above=0.0, unit="Hz")
        self._start = checks.number("start", start, unit="s")

    def outputs(self) -> dict[str, float]:
        """Return the value at the present time."""
        s = 0.0
        if self._shape == "sine":
            s = math.sin(2.0 * math.pi * self._frequency * (self.time - self._start))
        elif self._shape == "step":
            s = 1.0 if self.time >= self._start else 0.0
        return {"y": self._offset + self._amplitude * s}


class Recorded(BuiltInSlave):
    """Columns of a table over time, on straight lines between its rows; before and after them their ends.

    Parameters
    ----------
    table : dict of str to ndarray, shape (n,)
        `t_s` [s], which grows, and columns whose names end in a unit, such as `p1_m`: an output for each, without the unit.
    """

    def __init__(self, table: dict[str, np.ndarray], *, name: str = "signal") -> None:
        if "t_s" not in table:
            raise BadInput("columns", Text(", ".join(table)), "a column t_s, the time")
        self._t = checks.numbers("t_s", table["t_s"], "s", shape=(None,))
        if len(self._t) < 2 or not np.all(np.diff(self._t) > 0):
            raise BadInput("t_s", Text("times that do not increase"), "two times or more, each later than the one before")
        named = {column: _split(column) for column in table if column != "t_s"}
        super().__init__(name, (), named.values())
        self._columns = {n: checks.numbers(c, table[c], shape=(len(self._t),)) for c, (n, _) in named.items()}

    def outputs(self) -> dict[str, float]:
        """Return the values at the present time."""
        return {n: float(np.interp(self.time, self._t, values)) for n, values in self._columns.items()}


class Pid(BuiltInSlave):
    """A PID controller: `u = kp e + ki ∫ e dt − kd v`, with `e = target − measured` and the rate `v` of what is measured.

    Inputs `target`, `measured` and `rate`; output `u`. The rate is an input, so that no noise is differentiated. The integral is that of
    the error held in each step, and stops where `u` is at a limit (Åström and Hägglund 1995, conditional integration).

    Parameters
    ----------
    kp, ki, kd : float
        Gains, in the units of what is connected.
    limit : float, optional
        Largest magnitude of `u`.
    unit, of : str
        Units of `u` and of what is measured, as in `Wave`.
    """

    def __init__(
        self, kp: float, ki: float = 0.0, kd: float = 0.0, *, limit: float = math.inf, unit: str = "", of: str = "", name: str = "pid"
    ) -> None:
        unit, of = checks.choice("unit", unit, tuple(_UNITS)), checks.choice("of", of, tuple(_UNITS))
        rate = {"rad": "rad_s", "m": "m_s"}.get(of, "")
        super().__init__(name, [("target", of), ("measured", of), ("rate", rate)], [("u", unit)])
        self._gains = [checks.number(key, value, least=0.0) for key, value in (("kp", kp), ("ki", ki), ("kd", kd))]
        self._limit = math.inf if limit == math.inf else checks.number("limit", limit, above=0.0)
        self.states = {"integral": 0.0}

    def outputs(self) -> dict[str, float]:
        """Return the controlled value, within its limit."""
        return {"u": min(max(self._unlimited(), -self._limit), self._limit)}

    def advance(self, step: float) -> None:
        """Integrate the error, unless that would push further against the limit."""
        error, u = self.inputs["target"] - self.inputs["measured"], self._unlimited()
        if abs(u) < self._limit or u * error < 0.0:
            self.states["integral"] += error * step

    def _unlimited(self) -> float:
        kp, ki, kd = self._gains
        error = self.inputs["target"] - self.inputs["measured"]
        return kp * error + ki * self.states["integral"] - kd * self.inputs["rate"]


class Impedance(BuiltInSlave):
    """A spring and damper between a target and the hand (Hogan 1985): `F = stiffness (target.r − r) + damping (target.v − v)`.

    Inputs `r[1]`, `r[2]`, `v[1]`, `v[2]` of the hand and `target.r[1]` … `target.v[2]`; outputs `F[1]`, `F[2]`, the force on the hand.

    Parameters
    ----------
    stiffness, damping : float
        [N/m], [N s/m]
    target : (float, float)
        Where the target is when nothing is connected to it [m].
    """

    def __init__(
        self, stiffness: float, damping: float = 0.0, *, target: tuple[float, float] = (0.0, 0.0), name: str = "impedance"
    ) -> None:
        ends = [("r", "m"), ("v", "m_s"), ("target.r", "m"), ("target.v", "m_s")]
        super().__init__(name, [(f"{stem}[{k}]", unit) for stem, unit in ends for k in (1, 2)], [(f"F[{k}]", "N") for k in (1, 2)])
        self._stiffness = checks.number("stiffness", stiffness, least=0.0, unit="N/m")
        self._damping = checks.number("damping", damping, least=0.0, unit="N s/m")
        self._target = checks.pair("target_m", target, unit="m")
        self.reset()

    def outputs(self) -> dict[str, float]:
        """Return the force on the hand."""
        at = self.inputs
        return {
            f"F[{k}]": self._stiffness * (at[f"target.r[{k}]"] - at[f"r[{k}]"]) + self._damping * (at[f"target.v[{k}]"] - at[f"v[{k}]"])
            for k in (1, 2)
        }

    def reset(self) -> None:
        """Set all inputs to zero, and the target to where it is."""
        super().reset()
        self.inputs |= {f"target.r[{k + 1}]": self._target[k] for k in (0, 1)}


def _split(column: str) -> tuple[str, str]:
    """Return the name of a column without its unit, and the unit."""
    for unit in sorted(_UNITS, key=len, reverse=True):
        if unit and column.endswith(f"_{unit}") and len(column) > len(unit) + 1:
            return column.removesuffix(f"_{unit}"), unit
    allowed = ", ".join(unit for unit in _UNITS if unit)
    raise BadInput("columns", column, f"a name that ends in one of the units {allowed}")


def from_table(kind: str, table: dict[str, Any], name: str, folder: os.PathLike[str]) -> Partner:
    """Make a ready partner from its table in SYSTEM.toml."""
    if kind == "pid":
        checks.keys("pid", table, required=["kp"], optional=["ki", "kd", "limit", "unit", "of"])
        return Pid(**table, name=name)
    if kind == "impedance":
        checks.keys("impedance", table, required=["stiffness"], optional=["damping", "target_m"])
        settings = {key.removesuffix("_m"): value for key, value in table.items()}
        return Impedance(**settings, name=name)
    if "file" in table:
        checks.keys("signal", table, required=["file"])
        path = Path(folder) / checks.text("file", table["file"])
        try:
            read = read_samples(path)
            return Recorded(dict(zip(read.names, read.values, strict=True)), name=name)
        except BadInput as error:
            raise error if error.file else error.within(file=path) from None
    checks.keys("signal", table, required=["shape"], optional=["offset", "amplitude", "frequency_Hz", "start_s", "unit"])
    settings = {key.removesuffix("_Hz").removesuffix("_s"): value for key, value in table.items()}
    return Wave(**settings, name=name)
