"""Compliant robot, gravity compensation by motors and perturbing forces: tables of `EXPERIMENT.toml`, and their results."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _armrs, checks
from ..errors import BadInput, Text
from ..model import Model, Robot
from .firmware import covariance_of

if TYPE_CHECKING:
    from .._armrs import _Yielded, _Yielding

PERIOD = 2.0
"""After which a perturbation repeats [s]."""
LINES = 8
"""Frequencies of a multisine."""
CONTROL_RATE = 4000.0
"""Control periods a second."""
MOVING = 0.05
"""RMS speed of the handle in the last second of a hold beyond which a run counts as unstable [m/s]."""
AT_END = 1.0
"""That last part [s]."""


@dataclass(frozen=True)
class Interaction:
    """How the handle responds to a force, in y and z alike.

    Attributes
    ----------
    law : {"impedance", "admittance"}
        Motion in and force out, or force in and motion out.
    stiffness_N_m, damping_N_s_m : float
        About the required motion.
    mass_kg : float
        The virtual mass of an admittance.
    link_masses_kg : (float, float)
        Of the robot's links, uniform rods, beside the inertia of its motors.
    hold_s : float
        Time at rest after the movement, in which stability is checked.
    """

    law: str = "impedance"
    stiffness_N_m: float = 300.0
    damping_N_s_m: float = 150.0
    mass_kg: float = 8.0
    link_masses_kg: tuple[float, float] = (8.0, 5.0)
    hold_s: float = 2.0

    def __post_init__(self) -> None:
        checks.choice("law", self.law, ("impedance", "admittance"))
        checks.number("stiffness_N_m", self.stiffness_N_m, least=0.0, most=20_000.0, unit="N/m")
        checks.number("damping_N_s_m", self.damping_N_s_m, above=0.0, unit="N s/m")
        checks.number("mass_kg", self.mass_kg, above=0.0, unit="kg")
        object.__setattr__(self, "link_masses_kg", checks.pair("link_masses_kg", self.link_masses_kg, unit="kg"))
        checks.number("hold_s", self.hold_s, least=AT_END, most=600.0, unit="s")

    def core(self) -> _Yielding:
        """Return it as the core takes it."""
        return {
            "law": self.law,
            "stiffness": self.stiffness_N_m,
            "handle_damping": self.damping_N_s_m,
            "mass": self.mass_kg,
            "link_masses": self.link_masses_kg,
            "hold": self.hold_s,
        }


@dataclass(frozen=True)
class Perturbation:
    """A force at the handle that repeats every two seconds, drawn anew for each trial.

    Attributes
    ----------
    kind : {"multisine", "prbs", "ramps"}
        Sines with random phases; a random binary sequence; ramps to random levels.
    amplitude_N : float
        Largest force in y and z each.
    from_Hz, to_Hz : float
        Of the lines of a multisine; a binary sequence may switch, and a ramp bends, `2 to_Hz` times a second.
    """

    kind: str = "multisine"
    amplitude_N: float = 3.0
    from_Hz: float = 0.5
    to_Hz: float = 5.0

    def __post_init__(self) -> None:
        checks.choice("kind", self.kind, ("multisine", "prbs", "ramps"))
        checks.number("amplitude_N", self.amplitude_N, above=0.0, most=50.0, unit="N")
        checks.number("from_Hz", self.from_Hz, least=1.0 / PERIOD, unit="Hz")
        checks.number("to_Hz", self.to_Hz, above=self.from_Hz, most=50.0, unit="Hz")

    def force(self, draw: np.random.Generator) -> np.ndarray:
        """Return the force in each control period of one repeat, shape (n, 2) [N]."""
        return np.column_stack([self._axis(draw) for _ in range(2)])

    def _axis(self, draw: np.random.Generator) -> np.ndarray:
        t = np.arange(round(PERIOD * CONTROL_RATE)) / CONTROL_RATE
        if self.kind == "multisine":
            lines = np.unique(np.round(np.geomspace(self.from_Hz, self.to_Hz, LINES) * PERIOD)) / PERIOD
            phases = draw.uniform(0.0, 2.0 * np.pi, len(lines))
            sum_ = np.cos(2.0 * np.pi * np.outer(t, lines) + phases).sum(axis=1)
            return self.amplitude_N * sum_ / np.abs(sum_).max()
        count = max(4, round(2.0 * self.to_Hz * PERIOD))
        if self.kind == "prbs":
            # As many up as down: no mean.
            levels = draw.permutation(np.tile([1.0, -1.0], count // 2))
            return self.amplitude_N * levels[(np.arange(len(t)) * len(levels)) // len(t)]
        levels = draw.uniform(-1.0, 1.0, count)
        return self.amplitude_N * np.interp(t, np.linspace(0.0, PERIOD, count + 1), np.r_[levels, levels[0]])


@dataclass(frozen=True, eq=False)
class Support:
    """Motors in the joints of an orthosis that carry the arm with the torques of `armrs_compensation_carry`.

    Attributes
    ----------
    model : Model
        The arm that they carry, as it was identified.
    share : float
        Of its torque at rest.
    limit_Nm : float
        Largest torque of a motor.
    """

    model: Model
    share: float = 1.0
    limit_Nm: float = 30.0

    def __post_init__(self) -> None:
        checks.number("share", self.share, above=0.0, most=5.0)
        checks.number("limit_Nm", self.limit_Nm, above=0.0, unit="N m")

    def core(self) -> tuple[_armrs.OnlineCompensation, float, float]:
        """Return it as the core takes it."""
        compensation = _armrs.OnlineCompensation(_armrs.Rig(self.model), covariance_of(self.model).tolist(), "double")
        return compensation, self.share, self.limit_Nm


@dataclass(frozen=True, eq=False)
class EndpointImpedance:
    """Impedance of the arm's tip: `F = K x + D ẋ + M ẍ`, as fitted to a perturbation.

    Attributes
    ----------
    stiffness, damping, inertia : ndarray, shape (2, 2)
        In y and z [N/m, N s/m, kg].
    std : ndarray, shape (2, 2)
        Standard deviation of the stiffness [N/m].
    """

    stiffness: np.ndarray
    damping: np.ndarray
    inertia: np.ndarray
    std: np.ndarray

    @property
    def ellipse(self) -> tuple[float, float, float]:
        """Largest and smallest stiffness of the symmetric part [N/m], and the direction of the largest from +y [rad]."""
        values, vectors = np.linalg.eigh(0.5 * (self.stiffness + self.stiffness.T))
        return float(values[1]), float(values[0]), float(np.arctan2(vectors[1, 1], vectors[0, 1]) % np.pi)


def endpoint_impedance(rate: float, position: np.ndarray, force_on_arm: np.ndarray, most_Hz: float = 10.0) -> EndpointImpedance:
    """Fit stiffness, damping and inertia of an arm's tip to periodic motion, by least squares over the lines of its spectrum.

    Parameters
    ----------
    rate : float
        Samples a second [Hz].
    position, force_on_arm : ndarray, shape (n, 2)
        Of the handle, over a whole number of periods of the perturbation [m, N].
    most_Hz : float
        Frequency up to which lines are used.

    Raises
    ------
    BadInput
        For less than two periods of the perturbation.

    Notes
    -----
    The force that moves the tip by x is `F(ω) = (K + iωD − ω²M) X(ω)` [Perreault, Kirsch and Acosta 1999]. Lines between those of the
    perturbation carry noise alone and are left out.
    """
    periods = int(len(position) / (rate * PERIOD) + 1e-9)
    if periods < 2:
        raise BadInput("position", Text(f"{len(position) / rate:.3g} s"), f"at least {2 * PERIOD:g} s, two periods of the perturbation")
    n = round(periods * PERIOD * rate)
    x, f = (np.fft.rfft(values[-n:] - values[-n:].mean(axis=0), axis=0) / n for values in (position, force_on_arm))
    lines = np.arange(periods, min(len(x), int(most_Hz * PERIOD) * periods + 1), periods)
    omega = 2.0 * np.pi * lines / periods / PERIOD
    rows = np.hstack([x[lines], 1j * omega[:, None] * x[lines], -(omega[:, None] ** 2) * x[lines]])
    design, wanted = np.vstack([rows.real, rows.imag]), np.vstack([f[lines].real, f[lines].imag])
    found, *_ = np.linalg.lstsq(design, wanted, rcond=None)
    left = wanted - design @ found
    variance = (left**2).sum(axis=0) / (len(design) - 6)
    spread = np.linalg.inv(design.T @ design).diagonal()[:2]
    return EndpointImpedance(found[:2].T, found[2:4].T, found[4:].T, np.sqrt(np.outer(variance, spread)))


def endpoint_stiffness(model: Model, q: np.ndarray) -> np.ndarray:
    """Return the static stiffness that a model of two segments has at its tip, shape (2, 2) [N/m].

    `∂F/∂x` of the force `F = J⁻ᵀ τ` that holds the tip, with the weight and the elastic torques τ at rest: `∂(J⁻ᵀ τ)/∂q J⁻¹`.
    """
    if model.n_joints != 2:
        raise BadInput("model", Text(f"{model.n_joints} segments"), "2: a tip in a plane does not tell how three joints move")
    arm, carried = _armrs.Arm.from_model(model), _armrs.OnlineCompensation(_armrs.Rig(model), covariance_of(model).tolist(), "double")

    def holding(angles: np.ndarray) -> np.ndarray:
        torque, _ = carried.carry(np.zeros(1), angles[None], np.zeros((1, 2)))
        return np.linalg.solve(arm.jacobian(angles).T, torque[0])

    step = 1e-6
    slopes = [(holding(q + step * e) - holding(q - step * e)) / (2.0 * step) for e in np.eye(2)]
    return np.asarray(np.column_stack(slopes) @ np.linalg.inv(arm.jacobian(q)))


@dataclass(frozen=True, eq=False)
class Interacted:
    """How a run with a yielding handle went, at 500 Hz.

    Attributes
    ----------
    t, q, robot_q, force_on_arm, support : ndarray
        Time [s], angles of arm and robot [rad], force on the arm at its tip [N], torques that carry it [N m].
    handle : ndarray, shape (n, 2)
        [m].
    off : float
        Largest distance of the handle from where it was required [m].
    stop : tuple, optional
        What the supervisor stopped it for.
    """

    t: np.ndarray
    q: np.ndarray
    robot_q: np.ndarray
    force_on_arm: np.ndarray
    support: np.ndarray
    handle: np.ndarray
    off: float
    stop: tuple[str, int, float, float, float] | None

    @classmethod
    def of(cls, led: _Yielded, robot: Robot, every: int) -> Interacted:
        """Return every so many control periods of a run."""
        names = ("q", "robot_q", "force_on_arm", "support")
        t, q, robot_q, force, support = (np.asarray(led[name])[::every] for name in ("time", *names))  # type: ignore[literal-required]
        return cls(t, q, robot_q, force, support, handle_of(robot, robot_q), led["tracking_error"], led["stop"])

    @property
    def speed_at_end(self) -> float | None:
        """RMS speed of the handle in the last second [m/s]; None where the run was stopped."""
        if self.stop is not None:
            return None
        last = self.t > self.t[-1] - AT_END
        speed = np.diff(self.handle[last], axis=0) / np.diff(self.t[last])[:, None]
        return float(np.sqrt((speed**2).sum(axis=1).mean()))

    @property
    def is_stable(self) -> bool:
        """Whether nothing stopped it and the handle came to rest."""
        return self.speed_at_end is not None and self.speed_at_end <= MOVING

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of the run with units in the names."""
        size = np.hypot(*self.force_on_arm.T)
        return {
            "force_rms_N": float(np.sqrt((size**2).mean())),
            "force_largest_N": float(size.max()),
            "handle_off_m": self.off,
            "support_largest_Nm": float(np.abs(self.support).max()),
            "speed_at_end_m_s": self.speed_at_end,
            "stable": self.is_stable,
        }

    def endpoint(self, hold: float) -> EndpointImpedance:
        """Return the impedance of the arm's tip from the perturbation in the last `hold` seconds but the first period."""
        last = self.t > self.t[-1] - (hold - PERIOD) - 1e-9
        rate = 1.0 / (self.t[1] - self.t[0])
        return endpoint_impedance(rate, self.handle[last], self.force_on_arm[last])


def handle_of(robot: Robot, robot_q: np.ndarray) -> np.ndarray:
    """Return the position of a robot's handle, shape (n, 2) [m]."""
    directions = np.cumsum(robot_q, axis=1)
    steps = np.array(robot.lengths)[:, None] * np.stack([np.cos(directions), np.sin(directions)], axis=-1)
    return np.asarray(np.array(robot.base) + steps.sum(axis=1))
