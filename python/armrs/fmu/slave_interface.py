"""The interface of every slave that a master can couple: status, step result, variable, and the abstract class `Partner`."""

from __future__ import annotations

import abc
import enum
import itertools
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import TracebackType
from typing import Any

import numpy as np


class Status(enum.IntEnum):
    """How a call ends, with the numbers of the FMI standards."""

    OK = 0
    WARNING = 1
    DISCARD = 2
    ERROR = 3
    FATAL = 4


# Not frozen: that would double what making one costs, and one is made in every step.
@dataclass(slots=True)
class StepResult:
    """What a communication step gave.

    Attributes
    ----------
    status : Status
        OK or WARNING when it was made, DISCARD when it was not and the slave is as before.
    last_successful_time : float
        Up to when the slave came [s].
    event, terminate, early_return : bool
        What the slave requires, as in FMI 3.0.
    message : str
        Its message on a discarded step.
    """

    status: Status
    last_successful_time: float
    event: bool = False
    terminate: bool = False
    early_return: bool = False
    message: str = ""


@dataclass(frozen=True)
class Variable:
    """One variable of a slave, in the words of FMI 3.0.

    Attributes
    ----------
    name : str
    reference : int
        Value reference.
    causality, variability : str
    initial : str, optional
        "exact", "approx" or "calculated".
    type : str
        Type of FMI 3.0; "Float64" for everything that can be connected.
    unit : str, optional
    exponents : tuple of int, optional
        Powers of kg, m, s and rad; None when the unit is not described.
    scale : float
        Factor to the unit in base units.
    start, min, max : optional
    nominal : float
    description : str
    dimensions : tuple of int
        Lengths of an array; empty for a scalar.
    """

    name: str
    reference: int
    causality: str
    variability: str
    initial: str | None = None
    type: str = "Float64"
    unit: str | None = None
    exponents: tuple[int, ...] | None = None
    scale: float = 1.0
    start: Any = None
    min: float | None = None
    max: float | None = None
    nominal: float = 1.0
    description: str = field(default="", repr=False)
    dimensions: tuple[int, ...] = ()

    @property
    def size(self) -> int:
        """Number of values."""
        return math.prod(self.dimensions)

    @property
    def is_signal(self) -> bool:
        """Whether it is one floating point number of 64 bit."""
        return self.type == "Float64" and not self.dimensions

    @property
    def elements(self) -> list[str]:
        """Names of the elements of an array, row by row, such as `A[1,2]`; the name itself of a scalar."""
        if not self.dimensions:
            return [self.name]
        indices = itertools.product(*(range(1, n + 1) for n in self.dimensions))
        return [f"{self.name}[{','.join(map(str, index))}]" for index in indices]


class Partner(abc.ABC):
    """A slave, wherever it runs.

    Calls that are not done raise `SlaveError`; a discarded step is marked in its result.

    Attributes
    ----------
    name : str
    variables : mapping of str to Variable
    can_rollback : bool
        Whether it can come back to a state.
    internal_step : float, optional
        Step inside [s], where it has a fixed one.
    can_vary_step : bool
        Whether communication steps may differ.
    """

    name: str
    variables: Mapping[str, Variable]
    can_rollback: bool
    internal_step: float | None = None
    can_vary_step: bool = True

    def element(self, name: str) -> tuple[Variable, int | None] | None:
        """Return the variable of a name, and the place in it for an element of an array; None for a name that is not known."""
        if name in self.variables:
            return self.variables[name], None
        match = _ELEMENT.fullmatch(name)
        array = self.variables.get(match[1]) if match else None
        if match is None or array is None or not array.dimensions:
            return None
        index = [int(k) for k in match[2].split(",")]
        if len(index) != len(array.dimensions) or not all(1 <= k <= n for k, n in zip(index, array.dimensions, strict=True)):
            return None
        place = 0
        for k, n in zip(index, array.dimensions, strict=True):
            place = place * n + k - 1
        return array, place

    def variable(self, name: str) -> Variable:
        """Return a variable, or an element of an array as a scalar, by a name that is known."""
        found = self.element(name)
        assert found is not None, name
        variable, place = found
        if place is None:
            return variable
        start = variable.start if variable.start is None or len(variable.start) == 1 else variable.start[place : place + 1]
        return replace(variable, name=name, dimensions=(), start=None if start is None else start[0])

    @abc.abstractmethod
    def enter_initialization_mode(self, start: float = 0.0, stop: float | None = None, tolerance: float | None = None) -> None:
        """Begin the initialization at a time [s]."""

    @abc.abstractmethod
    def exit_initialization_mode(self) -> None:
        """End the initialization."""

    @abc.abstractmethod
    def set(self, names: Sequence[str] | str, values: Any) -> None:
        """Set variables by name, all or none."""

    @abc.abstractmethod
    def get(self, names: Sequence[str] | str) -> np.ndarray:
        """Return variables by name, shape (len(names),)."""

    @abc.abstractmethod
    def do_step(self, time: float, step: float) -> StepResult:
        """Make a communication step from a time [s], of a length [s]."""

    @abc.abstractmethod
    def get_state(self) -> Any:
        """Return the state, to come back to it."""

    @abc.abstractmethod
    def set_state(self, state: Any) -> None:
        """Come back to a state."""

    def free_state(self, state: Any) -> None:  # noqa: B027 (only resources outside Python have to be freed)
        """Give a state back that is not needed any more."""

    @abc.abstractmethod
    def terminate(self) -> None:
        """End the run."""

    @abc.abstractmethod
    def reset(self) -> None:
        """Go back to how the slave was made."""

    def finer(self) -> Partner:
        """Return the slave for a run with half the step: itself after a reset, or another with half the step inside."""
        self.reset()
        return self

    def free(self) -> None:  # noqa: B027
        """Give back what the slave holds; it is not used any more."""

    def __enter__(self) -> Partner:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.free()


_ELEMENT = re.compile(r"(.+)\[(\d+(?:,\d+)*)\]")


def listed(names: Sequence[str] | str) -> list[str]:
    """Return one name or several as a list."""
    return [names] if isinstance(names, str) else list(names)
