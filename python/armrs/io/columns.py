"""Names of the columns of a trial: what is measured, of which joint, in which unit."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import BadInput, BadInputs, Text, nearest, unknown_name

_DEGREE = math.pi / 180.0
_ANGLE = {"rad": 1.0, "mrad": 1e-3, "deg": _DEGREE}
_SPEED = {"rad_s": 1.0, "mrad_s": 1e-3, "deg_s": _DEGREE}
_FORCE = {"N": 1.0, "mN": 1e-3, "kN": 1e3}
_MOMENT = {"Nm": 1.0, "mNm": 1e-3, "kNm": 1e3, "Nmm": 1e-3}
_TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
_LENGTH = {"m": 1.0, "mm": 1e-3, "cm": 1e-2}

_NUMBERED = re.compile(r"(q|qr|dq|tau)([1-9][0-9]?)")


@dataclass(frozen=True)
class Quantity:
    """What a family of columns measures.

    Attributes
    ----------
    units : mapping of str to float
        Units that a column name may end with, and their factor to SI; the first is the SI unit.
    most : float
        Largest magnitude that can be meant [SI].
    hint : str
        What a larger one probably means.
    """

    units: dict[str, float]
    most: float
    hint: str


TIME = Quantity(_TIME, 1e11, "milliseconds?")  # seconds since 1970 are welcome
ANGLE = Quantity(_ANGLE, 8 * math.pi, "looks like degrees")  # an arm does not wind up four turns
SPEED = Quantity(_SPEED, 1e4, "looks like degrees per second")
FORCE = Quantity(_FORCE, 1e4, "looks like millinewtons")
MOMENT = Quantity(_MOMENT, 1e4, "looks like newton millimetres")
LENGTH = Quantity(_LENGTH, 100.0, "looks like millimetres")
ACTIVITY = Quantity({"": 1.0}, 1e12, "a number that no amplifier gives")

_QUANTITIES = {
    "t": TIME, "q": ANGLE, "qr": ANGLE, "dq": SPEED, "tau": MOMENT, "Fy": FORCE, "Fz": FORCE, "Mx": MOMENT, "by": LENGTH, "bz": LENGTH,
}  # fmt: skip


@dataclass(frozen=True)
class Column:
    """One column of a trial.

    Attributes
    ----------
    name : str
        As in the file.
    symbol : str
        What it measures, without the unit: `t`, `q1`, `Fy`, `emg_biceps`.
    factor : float
        From the unit of the file to SI.
    quantity : Quantity
        What it measures, with the bounds of what can be meant.
    """

    name: str
    symbol: str
    factor: float
    quantity: Quantity

    @property
    def si_name(self) -> str:
        """Name of the same column in SI units."""
        return self.name if self.quantity is ACTIVITY else f"{self.symbol}_{next(iter(self.quantity.units))}"


def parse(names: Sequence[str], n_joints: int, *, loads: bool = True) -> list[Column]:
    """Read the names of all columns of a trial; every name that is wrong is refused at once (`BadInputs`).

    Parameters
    ----------
    names : sequence of str
        Column names.
    n_joints : int
        Number of joints of the model.
    loads : bool
        Whether forces or torques must be there.

    Raises
    ------
    BadInput
        For a name that is not known (with the nearest known one), one that stands twice, a quantity given in two units, a joint that the
        model does not have, or a group of columns that is not complete.
    """
    columns: list[Column] = []
    problems: list[BadInput] = []
    seen: dict[str, str] = {}
    for name in names:
        try:
            column = _parse_one(name, n_joints)
        except BadInput as error:
            problems.append(error)
            continue
        if column.symbol in seen:
            both = f"{seen[column.symbol]} and {column.name}"
            problems.append(BadInput("header", Text(both), f"{column.symbol} once"))
        seen[column.symbol] = column.name
        columns.append(column)
    if problems:
        raise BadInputs.of(problems)
    _complete(seen, n_joints, loads=loads)
    return columns


def _parse_one(name: str, n_joints: int) -> Column:
    if name.startswith("emg_") and len(name) > len("emg_"):
        return Column(name, name, 1.0, ACTIVITY)
    symbol, _, unit = name.partition("_")
    numbered = _NUMBERED.fullmatch(symbol)
    quantity = _QUANTITIES.get(numbered[1] if numbered else symbol)
    if quantity is None or (numbered is None and symbol in ("q", "qr", "dq", "tau")):
        raise unknown_name("header", name, _known(n_joints), what="column")
    if unit not in quantity.units:
        allowed = ", ".join(f"{symbol}_{u}" for u in quantity.units)
        near = nearest(unit, quantity.units)
        raise BadInput("header", name, f"a known unit: {allowed}", hint=f"nearest known: {symbol}_{near}" if near else None)
    if numbered:
        most = 2 if numbered[1] == "qr" else n_joints
        if int(numbered[2]) > most:
            owner = "robot has" if numbered[1] == "qr" else "model has"
            raise BadInput("header", name, f"{numbered[1]}1 to {numbered[1]}{most}: the {owner} {most} joint{'s' * (most > 1)}")
    return Column(name, symbol, quantity.units[unit], quantity)


def _known(n_joints: int) -> list[str]:
    joints = range(1, n_joints + 1)
    return [
        "t_s", "Fy_N", "Fz_N", "Mx_Nm", "qr1_rad", "qr2_rad", "by_m", "bz_m", "emg_NAME",
        *(f"{symbol}{j}_{unit}" for j in joints for symbol, unit in (("q", "rad"), ("q", "deg"), ("dq", "rad_s"), ("tau", "Nm"))),
    ]  # fmt: skip


def _complete(seen: dict[str, str], n_joints: int, *, loads: bool) -> None:
    def group(symbols: list[str], *, required: bool, why: str) -> bool:
        present = [s for s in symbols if s in seen]
        for symbol in symbols:
            if symbol not in seen and (required or present):
                raise BadInput("header", Text(f"no column for {symbol}"), why)
        return bool(present)

    joints = range(1, n_joints + 1)
    group(["t"], required=True, why="time in a column t_s")
    group([f"q{j}" for j in joints], required=True, why=f"an angle for each of the {n_joints} joints of the model")
    group([f"dq{j}" for j in joints], required=False, why="a speed for every joint or for none")
    torque = group([f"tau{j}" for j in joints], required=False, why="a torque for every joint or for none")
    group(["qr1", "qr2"], required=False, why="both angles of the robot or none")
    group(["by", "bz"], required=False, why="both coordinates of the first joint or none")
    force = group(["Fy", "Fz"], required="Mx" in seen, why="both Fy and Fz or none of Fy, Fz, Mx")
    if loads and not force and not torque:
        raise BadInput("header", Text("neither forces nor torques"), "Fy_N and Fz_N, or tau1_Nm …, or both")
