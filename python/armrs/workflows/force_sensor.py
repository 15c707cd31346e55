"""A six-axis force sensor between the robot's last link and its handle: `[sensors.six_axis]` of `EXPERIMENT.toml`.

Its frame turns with the last link: x along the link towards the handle, y in the plane, counter-clockwise of x, z normal to the plane.
Points and forces of the plane are complex numbers here, `y + i z` in the base frame and `x + i y` in that of the sensor.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import checks
from ..errors import BadInput
from ..model import Robot

CHANNELS = ("Fx_N", "Fy_N", "Fz_N", "Mx_Nm", "My_Nm", "Mz_Nm")
"""Columns of the six readings: the wrench of the handle on the robot, at the sensor's origin and in its frame."""
_NO_CROSSTALK = ((0.0,) * 6,) * 6
_BOUNDS = {
    "noise_N": ("N", 0.0, 100.0), "noise_Nm": ("N m", 0.0, 100.0), "bias_N": ("N", -100.0, 100.0), "bias_Nm": ("N m", -100.0, 100.0),
    "drift_N_s": ("N/s", -10.0, 10.0), "drift_Nm_s": ("N m/s", -10.0, 10.0), "range_N": ("N", 0.01, 1e5), "range_Nm": ("N m", 0.01, 1e4),
}  # fmt: skip
"""Unit, least and most of what each channel has its own of: far beyond any device."""


@dataclass(frozen=True, eq=False)
class RobotMotion:
    """Motion of the robot.

    Attributes
    ----------
    t : ndarray, shape (n,)
        [s].
    q, qd, qdd : ndarray, shape (n, 2)
        Angles, the second relative to the first [rad], speeds and accelerations.
    """

    t: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray

    @classmethod
    def of_angles(cls, t: np.ndarray, q: np.ndarray) -> RobotMotion:
        """Return the motion of recorded angles: speeds and accelerations by central differences."""
        qd = np.gradient(q, t, axis=0)
        return cls(t, q, qd, np.gradient(qd, t, axis=0))

    def at(self, t: np.ndarray) -> RobotMotion:
        """Return the motion at other times, linear in between."""
        return RobotMotion(t, *(np.column_stack([np.interp(t, self.t, c) for c in a.T]) for a in (self.q, self.qd, self.qdd)))

    @property
    def direction(self) -> np.ndarray:
        """Direction of the last link in the base frame, complex, shape (n,)."""
        return np.asarray(np.exp(1j * self.q.sum(axis=1)))


@dataclass(frozen=True)
class SixAxis:
    """A six-axis force sensor and the tool behind it; points in the plane of the sensor's frame, three numbers along x, y and z.

    Attributes
    ----------
    handle_m : (float, float)
        Axis of the handle, where the arm pulls, from the sensor's origin.
    tool_mass_kg, tool_com_m, tool_inertia_kg_m2
        Of everything between sensor and hand: mass, centre of mass, moment of inertia about it and z.
    stated_mass_kg, stated_com_m
        What the laboratory takes off; those of the tool when absent.
    noise_N, noise_Nm, bias_N, bias_Nm, drift_N_s, drift_Nm_s : (float, float, float)
        Standard deviation of white noise, error at the start of each trial, and its change.
    range_N, range_Nm : (float, float, float)
        Largest magnitude that is read.
    bits : int
        Over the whole range of each channel.
    crosstalk : 6 rows of 6 numbers
        Error of the calibration matrix, in shares of the ranges: entry (i, j) times the range of channel i is what it misreads when
        channel j is loaded with its range. The diagonal holds errors of the gains.
    """

    handle_m: tuple[float, float]
    tool_mass_kg: float
    tool_com_m: tuple[float, float]
    tool_inertia_kg_m2: float = 0.0
    stated_mass_kg: float | None = None
    stated_com_m: tuple[float, float] | None = None
    noise_N: tuple[float, ...] = (0.2, 0.2, 0.2)
    noise_Nm: tuple[float, ...] = (0.02, 0.02, 0.02)
    bias_N: tuple[float, ...] = (0.0, 0.0, 0.0)
    bias_Nm: tuple[float, ...] = (0.0, 0.0, 0.0)
    drift_N_s: tuple[float, ...] = (0.0, 0.0, 0.0)
    drift_Nm_s: tuple[float, ...] = (0.0, 0.0, 0.0)
    range_N: tuple[float, ...] = (110.0, 110.0, 110.0)
    range_Nm: tuple[float, ...] = (11.0, 11.0, 11.0)
    bits: int = 12
    crosstalk: tuple[tuple[float, ...], ...] = _NO_CROSSTALK

    def __post_init__(self) -> None:
        if self.stated_mass_kg is None:
            object.__setattr__(self, "stated_mass_kg", self.tool_mass_kg)
        if self.stated_com_m is None:
            object.__setattr__(self, "stated_com_m", self.tool_com_m)
        for name in ("handle_m", "tool_com_m", "stated_com_m"):
            object.__setattr__(self, name, checks.pair(name, getattr(self, name), least=-1.0, most=1.0, unit="m"))
        for name in ("tool_mass_kg", "stated_mass_kg"):
            checks.number(name, getattr(self, name), least=0.0, most=20.0, unit="kg")
        checks.number("tool_inertia_kg_m2", self.tool_inertia_kg_m2, least=0.0, most=1.0, unit="kg m²")
        for name, (unit, least, most) in _BOUNDS.items():
            object.__setattr__(self, name, _three(name, getattr(self, name), unit=unit, least=least, most=most))
        checks.bits("bits", self.bits)
        object.__setattr__(self, "crosstalk", _matrix(self.crosstalk))

    def read(self, rig: tuple[Robot, float], motion: RobotMotion, force_on_robot: np.ndarray, noise: np.random.Generator) -> np.ndarray:
        """Return what the six channels read, shape (n, 6), as `CHANNELS`.

        Parameters
        ----------
        rig : (Robot, float)
            And the gravity along −z [m/s²].
        motion : RobotMotion
            The true one.
        force_on_robot : ndarray, shape (n, 2)
            Of the arm at the handle, y and z [N].
        noise : Generator
        """
        handle, com = complex(*self.handle_m), complex(*self.tool_com_m)
        contact = _complex(force_on_robot) / motion.direction
        load = _load_on_robot(rig, motion, self.tool_mass_kg, com - handle) / motion.direction
        wrench = np.zeros((len(motion.t), 6))
        wrench[:, 0], wrench[:, 1] = (contact + load).real, (contact + load).imag
        wrench[:, 5] = (handle.conjugate() * contact + com.conjugate() * load).imag - self.tool_inertia_kg_m2 * motion.qdd.sum(axis=1)
        misread = (wrench / self.limits) @ np.array(self.crosstalk).T * self.limits
        constant = np.array([*self.bias_N, *self.bias_Nm]) + np.outer(motion.t - motion.t[0], [*self.drift_N_s, *self.drift_Nm_s])
        read = wrench + misread + constant + np.array([*self.noise_N, *self.noise_Nm]) * noise.standard_normal(wrench.shape)
        return digitised(read, self.limits, self.bits)

    def force_on_robot(self, rig: tuple[Robot, float], motion: RobotMotion, wrench: np.ndarray) -> np.ndarray:
        """Return the force of the arm on the robot that a laboratory makes of the readings, y and z, shape (n, 2) [N].

        They are turned to the base frame, and weight and inertial force of the stated tool are taken off.

        Parameters
        ----------
        rig : (Robot, float)
            And the gravity along −z [m/s²].
        motion : RobotMotion
            As it was measured.
        wrench : ndarray, shape (n, 6)
            As `CHANNELS`.
        """
        assert self.stated_mass_kg is not None and self.stated_com_m is not None
        load = _load_on_robot(rig, motion, self.stated_mass_kg, complex(*self.stated_com_m) - complex(*self.handle_m))
        force = _complex(wrench[:, :2]) * motion.direction - load
        return np.column_stack([force.real, force.imag])

    @property
    def limits(self) -> np.ndarray:
        """Largest magnitudes of the channels, shape (6,) [N, N m]."""
        return np.array([*self.range_N, *self.range_Nm])

    def saturated(self, wrench: np.ndarray) -> dict[str, int]:
        """Return how many samples of which channels are at the end of their range."""
        counts = (np.abs(wrench) >= self.limits).sum(axis=0)
        return {name: int(count) for name, count in zip(CHANNELS, counts, strict=True) if count}


def digitised(values: np.ndarray, largest: np.ndarray | float, bits: int) -> np.ndarray:
    """Return values as a converter gives them that has so many bits over the range from `-largest` to `largest`, beyond which it clips."""
    step = 2.0 * largest / 2**bits
    return np.clip(np.round(values / step) * step, -largest, largest)


def _load_on_robot(rig: tuple[Robot, float], motion: RobotMotion, mass: float, from_handle: complex) -> np.ndarray:
    """Return weight and inertial force of a mass that moves with the last link, `m (g − a)` in the base frame, shape (n,) [N]."""
    robot, gravity = rig
    angle, speed, faster = (np.cumsum(a, axis=1) for a in (motion.q, motion.qd, motion.qdd))
    links = np.array([robot.lengths[0], robot.lengths[1] + from_handle])
    acceleration = ((1j * faster - speed**2) * np.exp(1j * angle)) @ links
    return np.asarray(mass * (-1j * gravity - acceleration))


def _complex(vectors: np.ndarray) -> np.ndarray:
    return np.asarray(vectors[:, 0] + 1j * vectors[:, 1])


def _three(place: str, value: Any, **limits: Any) -> tuple[float, ...]:
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise BadInput(place, value, "three numbers: along x, y and z")
    return tuple(checks.number(f"{place}[{k}]", v, **limits) for k, v in enumerate(value))


def _matrix(value: Any) -> tuple[tuple[float, ...], ...]:
    rows = checks.numbers("crosstalk", value, shape=(6, 6))
    return tuple(tuple(checks.number(f"crosstalk[{i}][{j}]", v, least=-0.5, most=0.5) for j, v in enumerate(r)) for i, r in enumerate(rows))
