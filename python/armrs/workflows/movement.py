"""Desired movements of an arm's joints, and the files that describe them."""

from __future__ import annotations

import dataclasses
import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import checks
from ..errors import BadInput
from ..io import tomlfile


@dataclass(frozen=True, eq=False)
class Movement:
    """A desired movement of the arm's joints: straight lines through waypoints, at rest in each.

    Attributes
    ----------
    waypoints : ndarray, shape (k, n_joints)
        Joint angles [rad].
    speed : float
        Largest joint speed [rad/s].
    acceleration : float
        Largest joint acceleration [rad/s²].
    pause : float
        Rest in every waypoint on the way [s].
    shape : {"trapezoid", "smooth"}
        Velocity profile: straight ramps as in the thesis, or ramps with continuous acceleration.
    file : str, optional
        Where it was read, for refusals.
    """

    waypoints: np.ndarray
    speed: float = 0.2
    acceleration: float = 0.6
    pause: float = 0.0
    shape: str = "trapezoid"
    file: str | None = None

    def __post_init__(self) -> None:
        points = checks.numbers("waypoints", self.waypoints, "rad")
        if points.ndim != 2 or len(points) < 2 or not points.size:
            raise BadInput("waypoints", f"an array of shape {points.shape}", "two or more rows of joint angles")
        if np.abs(points).max(initial=0.0) > 4 * np.pi:
            raise BadInput("waypoints", float(np.abs(points).max()), "angles within two turns, in radians", hint="looks like degrees")
        checks.number("speed", self.speed, above=0.0, unit="rad/s")
        checks.number("acceleration", self.acceleration, above=0.0, unit="rad/s²")
        checks.number("pause", self.pause, least=0.0, unit="s")
        checks.choice("shape", self.shape, ("trapezoid", "smooth"))
        if self.file is not None:
            checks.text("file", self.file)
        points.flags.writeable = False
        object.__setattr__(self, "waypoints", points)


def load_movement(path: str | os.PathLike[str], n_joints: int | None = None) -> Movement:
    """Read a movement file: a TOML table `[movement]` with `waypoints_deg` (or `_rad`), speed, acceleration, pause, shape.

    Parameters
    ----------
    path : path
    n_joints : int, optional
        Angles that each waypoint must have, where that is known; as many as the file has when absent.

    Returns
    -------
    Movement

    Raises
    ------
    BadInput
        For a file that is no movement, or one of another number of joints.
    """
    checks.path("path", path)
    if n_joints is not None:
        checks.whole("n_joints", n_joints, least=1)

    def made(document: dict[str, Any], _: object) -> Movement:
        checks.keys("", document, required=["movement"])
        return dataclasses.replace(movement_of(checks.table("movement", document["movement"]), n_joints), file=os.fspath(path))

    return tomlfile.load(path, made)


def movement_of(table: dict[str, Any], n_joints: int | None) -> Movement:
    """Return the movement that a table describes, with waypoints of so many angles, or as many as the table has."""
    known = [
        "waypoints_deg", "waypoints_rad", "speed_rad_s", "speed_deg_s", "acceleration_rad_s2", "acceleration_deg_s2", "pause_s", "shape",
    ]  # fmt: skip
    checks.keys("movement", table, optional=known)
    fields: dict[str, Any] = {}
    for name in known:
        if name not in table:
            continue
        value = table[name]
        key, _, unit = name.partition("_")
        if key == "shape":
            if value not in ("trapezoid", "smooth"):
                raise BadInput("movement.shape", value, "trapezoid or smooth")
            fields[key] = value
            continue
        numbers = checks.samples(f"movement.{name}", value)
        if not np.isfinite(numbers).all() or (key != "waypoints" and numbers.ndim):
            raise BadInput(f"movement.{name}", value, "finite numbers" if key == "waypoints" else "one finite number")
        if key in fields:
            raise BadInput(f"movement.{name}", "a second unit", f"{key} once, in degrees or radians")
        numbers = np.radians(numbers) if unit.startswith("deg") else numbers
        fields[key] = numbers if key == "waypoints" else float(numbers)
    if "waypoints" not in fields:
        raise BadInput("movement", "no waypoints", "waypoints_deg or waypoints_rad")
    shape = fields["waypoints"].shape
    if len(shape) != 2 or shape[1] != (shape[1] if n_joints is None else n_joints):
        raise BadInput("movement.waypoints", f"an array of shape {shape}", f"rows of {'' if n_joints is None else f'{n_joints} '}angles")
    return Movement(**fields)
