"""Input of the simulation in the core: what drives the arm, and how the run is computed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _armrs
from ..errors import BadInput, Text
from ..io.trial import Trial
from ..model import Model
from .movement import Movement


@dataclass(frozen=True, eq=False)
class CoreDrive:
    """How an arm is driven: "movement", "robot", "torque" or "free"; values are its waypoints, or samples at the times."""

    kind: str
    rigid: bool
    values: np.ndarray | None = None
    times: np.ndarray | None = None
    shape: str = "trapezoid"
    speed: float = 0.0
    acceleration: float = 0.0
    pause: float = 0.0
    base: np.ndarray | None = None
    """How far the first joint is from the model's base at the times [m]."""
    activity: np.ndarray | None = None
    """Activity of the muscles of each joint at the times, 0 to 1."""


INTEGRATORS = ("rk4", "euler", "imex")
"""Integrators of the native engine."""


@dataclass(frozen=True)
class CoreRun:
    """How a run is computed: where it starts, its length [s] where the drive does not define it, and time from sample to sample [s]."""

    integrator: str
    dt: float
    output_interval: float
    engine: str = "native"
    duration: float | None = None
    q: list[float] | None = None
    qd: list[float] | None = None


def driven(model: Model, drive: Movement | Trial | None, coupling: str) -> CoreDrive:
    """Return a drive as the core takes it."""
    rigid = coupling == "rigid"
    if isinstance(drive, Movement):
        return CoreDrive("movement", rigid, drive.waypoints, None, drive.shape, drive.speed, drive.acceleration, drive.pause)
    if drive is not None:
        kind, values = ("robot", drive.robot_q) if drive.robot_q is not None else ("torque", drive.tau)
        if values is None:
            raise BadInput("columns", "neither robot angles nor joint torques", "qr1_rad and qr2_rad, or tau1_Nm …", file=drive.file)
        there = np.isfinite(values).all(axis=1)
        if drive.base is not None:
            there &= np.isfinite(drive.base).all(axis=1)
        upto = int(np.flatnonzero(there)[-1]) + 1 if there.any() else 0
        if not there[:upto].all() or not upto:
            lost = float(drive.t[int(np.argmin(there))])
            what = "robot angles" if kind == "robot" else "joint torques"
            if drive.base is not None:
                what = f"{what} or path of the first joint"
            raise BadInput(what, Text(f"none at {lost:g} s"), "samples without a gap: they drive the arm", file=drive.file)
        times = np.array(drive.t[:upto] - drive.t[0])
        base = None if drive.base is None else _armrs.displacement_of_base(drive.base[:upto], model.base, drive.rate)
        activity = None if drive.activity is None else np.array(drive.activity[:upto])
        return CoreDrive(kind, rigid, np.array(values[:upto]), times, base=base, activity=activity)
    return CoreDrive("free", rigid)


def about(drive: Movement | Trial | None, error: BadInput, more: str = "") -> BadInput:
    """Return a refusal of the core with the file of the drive, where it is about how that leads the arm; `more` is for its length."""
    if drive is None:
        return error
    if error.place == "duration":
        place = f"length of the {type(drive).__name__.lower()} [s]"
        return BadInput(place, error.found, f"{error.allowed}{more}", file=drive.file, hint=error.hint)
    return error.within(file=drive.file) if error.place.startswith("handle at ") else error
