"""Planning an experiment: how well movements determine each parameter, and movements that determine them well."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import _armrs, checks, interruptible
from .._armrs import Design as Design
from .._armrs import DesignedMovement as DesignedMovement
from .._armrs import Forecast as Forecast
from .._armrs import Prediction as Prediction
from .._armrs import Slowed as Slowed
from ..errors import BadInput, Text
from ..io import files, tomlfile
from ..model import Model, Tolerance
from ..tabular import Tabular, Tidy
from .core_experiment import about
from .experiment import Safety
from .identify import CoreSettings, effects_of
from .movement import Movement
from .result_data import origin


@dataclass(frozen=True)
class Instruments:
    """What the sensors of the experiment will do.

    Attributes
    ----------
    rate : float
        Samples a second [Hz].
    cutoff : float
        Cutoff of the low-pass of the identification [Hz].
    force : float
        Standard deviation of a single force sample [N].
    angle : float
        Standard deviation of a single angle sample [rad].
    tolerance : Tolerance
        Tolerances of the calibration.
    """

    rate: float = 50.0
    cutoff: float = 5.0
    force: float = 0.2
    angle: float = float(np.radians(0.1))
    tolerance: Tolerance = field(default_factory=Tolerance)

    def __post_init__(self) -> None:
        checks.number("rate", self.rate, above=0.0, most=10_000.0, unit="Hz")
        checks.number("cutoff", self.cutoff, above=0.0, most=0.4 * self.rate, unit="Hz")
        checks.number("force", self.force, above=0.0, most=1e3, unit="N")
        checks.number("angle", self.angle, above=0.0, most=1.0, unit="rad", hint="degrees?")
        checks.instance("tolerance", self.tolerance, Tolerance)


LEAST_TURN = np.radians(1.0)
"""What a joint must be able to turn in a trial, from rest to rest [rad]."""


@dataclass(frozen=True)
class Limits:
    """What a planned movement must respect.

    Attributes
    ----------
    angles : tuple of (float, float)
        Smallest and largest angle of each joint [rad].
    speed, acceleration : float
        Largest of any joint [rad/s, rad/s²].
    robot_speed : float
        Largest of any joint of the robot, where the model has one [rad/s]; that of the laboratory's supervisor when absent.
    robot_acceleration : float
        The same of its accelerations [rad/s²].
    force : float
        Largest force on the arm [N].
    duration : float
        Longest trial [s].
    """

    angles: tuple[tuple[float, float], ...]
    speed: float = 2.0
    acceleration: float = 8.0
    robot_speed: float = Safety.speed_rad_s
    robot_acceleration: float = Safety.acceleration_rad_s2
    force: float = 60.0
    duration: float = 20.0

    def __post_init__(self) -> None:
        if isinstance(self.angles, (str, bytes, Mapping)) or not isinstance(self.angles, Iterable):
            raise BadInput("angles", self.angles, "a pair of angles for each joint")
        angles = []
        for j, ends in enumerate(self.angles, start=1):
            place = f"angles of joint {j}"
            low, high = checks.pair(place, ends, least=-4 * np.pi, most=4 * np.pi, unit="rad", hint="looks like degrees")
            if not low < high:
                raise BadInput(place, Text(f"{low:g} to {high:g} rad"), "the smaller angle first")
            angles.append((low, high))
        object.__setattr__(self, "angles", tuple(angles))
        checks.number("speed", self.speed, above=0.0, most=100.0, unit="rad/s")
        checks.number("acceleration", self.acceleration, above=0.0, most=1e4, unit="rad/s²")
        checks.number("robot_speed", self.robot_speed, above=0.0, most=100.0, unit="rad/s")
        checks.number("robot_acceleration", self.robot_acceleration, above=0.0, most=1e4, unit="rad/s²")
        checks.number("force", self.force, above=0.0, most=1e4, unit="N")
        checks.number("duration", self.duration, above=0.0, most=600.0, unit="s")
        # A movement is simulated before its duration is checked, which must not be endless.
        for name, unit, least in (
            ("speed", "rad/s", LEAST_TURN / self.duration),
            ("acceleration", "rad/s²", 4.0 * LEAST_TURN / self.duration**2),
        ):
            if getattr(self, name) < least:
                raise BadInput(name, getattr(self, name), f"at least {least:.2g} {unit}: to turn by 1° within {self.duration:g} s")


MOST_UNCERTAIN = 0.5
"""Relative standard deviation from which on a parameter counts as not known."""


@dataclass(frozen=True, eq=False)
class Plan(Tabular):
    """Movements, and what they will show.

    Attributes
    ----------
    movements : tuple of Movement
    repeats : int
        Trials of each.
    forecast : Forecast
        Certainty of the parameters and load of the robot; its attributes are those of the plan as well.
    model : Model
    slowed : tuple of Slowed
        The movements that had to be slowed for a limit.
    """

    movements: tuple[Movement, ...]
    repeats: int
    forecast: Forecast
    model: Model = field(repr=False)
    slowed: tuple[Slowed, ...] = field(default=(), repr=False)

    @property
    def predictions(self) -> tuple[Prediction, ...]:
        """How well each parameter will be known."""
        return self.forecast.predictions

    @property
    def worst(self) -> float:
        """The worst relative standard deviation from the data alone."""
        return self.forecast.worst

    @property
    def force(self) -> float:
        """Largest force on the arm [N]."""
        return self.forecast.force

    @property
    def speed(self) -> float:
        """Largest speed of a joint [rad/s]."""
        return self.forecast.speed

    @property
    def robot_speed(self) -> float:
        """Largest speed of a joint of the robot, zero without one [rad/s]."""
        return self.forecast.robot_speed

    @property
    def robot_acceleration(self) -> float:
        """Largest acceleration of a joint of the robot, zero without one [rad/s²]."""
        return self.forecast.robot_acceleration

    @property
    def duration(self) -> float:
        """Of all trials together [s]."""
        return self.forecast.duration

    def __repr__(self) -> str:
        return f"Plan({len(self.movements)} movements, {self.duration:.4g} s; {'; '.join(map(str, self.predictions))})"

    def tidy(self) -> Tidy:
        """Return how well each parameter will be known, one a row."""
        names = Prediction.__match_args__ if self.predictions else ()
        return Tidy({name: [getattr(p, name) for p in self.predictions] for name in names}, {})

    def to_dict(self) -> dict[str, Any]:
        """Return plain data with units in the names."""
        return {
            "movements": [
                {
                    "waypoints_deg": np.degrees(m.waypoints),
                    "speed_rad_s": m.speed,
                    "acceleration_rad_s2": m.acceleration,
                    "pause_s": m.pause,
                    "shape": m.shape,
                    "repeats": self.repeats,
                }
                for m in self.movements
            ],
            **self.forecast.to_dict(),
            "slowed": [s.to_dict() for s in self.slowed],
        }

    def to_toml(self) -> str:
        """Return the movements as tables of `EXPERIMENT.toml`."""
        blocks = []
        for number, entry in enumerate(self.to_dict()["movements"], start=1):
            table = {"configuration": f"planned {number}", **entry, "waypoints_deg": np.round(entry["waypoints_deg"], 3).tolist()}
            blocks.append("\n".join(["[[movement]]", *tomlfile.lines(table), ""]))
        return "\n".join(blocks)


def forecast(
    model: Model,
    movements: Sequence[Movement],
    *,
    repeats: int = 5,
    with_effects: Sequence[str] | None = None,
    instruments: Instruments = Instruments(),
) -> Plan:
    """Predict before an experiment how well movements determine the parameters of an arm.

    Parameters
    ----------
    model : Model
        The assumed arm.
    movements : sequence of Movement
    repeats : int
        Trials of each movement.
    with_effects : sequence of str, optional
        Kinds of joint effects that will be fitted at every joint besides those of the model, as for `identify`: when absent, elastic,
        viscous and coulomb in joints without a law.
    instruments : Instruments

    Returns
    -------
    Plan
        Its predictions: value and the standard deviation that `identify` will state.

    Raises
    ------
    BadInput
        For a movement that the robot cannot make and settings out of range.
    IdentificationError
        When no prediction is possible.

    Notes
    -----
    The closed chain is simulated, noise of the sensors is carried through the rows of the regression and the prior of the
    model, as `identify` would have them. Nothing is measured: what the model lacks is not in it. Over 200 repetitions with two
    segments the scatter was 0.90 to 1.09 of the deviations; over 100 with three, where the robot does not hold every joint, 0.84 to
    1.03, accurate to 5 and 7 % with so many repetitions (`scripts/check_plan.py 200` and `100 300 3 601`). With three segments and
    five repeats two deviations of the hand's first moment are 2.1 % of it and of its second moment 4.9 %. With ten they are 1.5 and
    3.5 %: of 200 repetitions 95 % were within 1.6 and 3.5 %, and the scatter was 0.97 to 1.17 of the deviations.

    Examples
    --------
    >>> import armrs, numpy as np
    >>> from armrs.demo import true_model
    >>> out = armrs.Movement(np.radians([[-60, 60], [-48, 60], [-60, 60]]), speed=0.5, acceleration=2.0)
    >>> print(armrs.forecast(true_model(), [out]).predictions[0])
    torque = 0.139 ± 0.0067 N m
    """
    asked = _Question(model, with_effects, instruments, repeats)
    movements = checks.instances("movements", movements, Movement)
    if not movements:
        raise BadInput("movements", Text("none"), "at least one")
    for movement in movements:
        if movement.waypoints.shape[1] != model.n_joints:
            raise BadInput("waypoints", f"rows of {movement.waypoints.shape[1]} angles", f"rows of {model.n_joints}")
    try:
        return asked.plan(
            movements, interruptible.call(_armrs.forecast, asked.rig, asked.settings, instruments, (movements, asked.repeats))
        )
    except BadInput as error:
        # Of several movements it is unknown which it was.
        raise about(movements[0], error) if len(movements) == 1 else error from None


def plan(
    model: Model,
    limits: Limits,
    *,
    speeds: Sequence[float] = (1.0, 0.3),
    waypoints: int = 6,
    repeats: int = 5,
    with_effects: Sequence[str] | None = None,
    instruments: Instruments = Instruments(),
    evaluations: int = 300,
    seed: int = 1,
) -> Plan:
    """Propose movements that make every parameter of an arm known well.

    Parameters
    ----------
    model : Model
        The assumed arm. Its robot, where there is one, has to reach every place of the path.
    limits : Limits
        Of joints, speed, acceleration, the robot, force and duration.
    speeds : sequence of float
        One movement for each, at this share of the largest speed and acceleration; slower along the same path where it would exceed
        another limit.
    waypoints : int
        Of each movement, besides the return to the first.
    repeats, with_effects, instruments
        As in `forecast`.
    evaluations : int
        Movements that are tried.
    seed : int
        Of the search; the same seed proposes the same movements.

    Returns
    -------
    Plan

    Raises
    ------
    BadInput
        For settings out of range, and for limits that no movement that was tried respects, even slowed: to the longest trial allowed, or
        a tenth of the requested speed. It names the limit, what the nearest movement takes, and what is allowed.
    IdentificationError
        When the movements that respect the limits cannot distinguish the parameters.
    """
    asked = _Question(model, with_effects, instruments, repeats)
    checks.instance("limits", limits, Limits)
    n = model.n_joints
    if len(limits.angles) != n:
        raise BadInput("angles", Text(f"{len(limits.angles)} ranges"), f"{n}, one a joint")
    shares = checks.numbers("speeds", speeds, shape=(None,)).tolist()
    if not shares:
        raise BadInput("speeds", Text("none"), "at least one share")
    search: _armrs._Search = {
        "speeds": [checks.number("speeds", v, above=0.0, most=1.0) for v in shares],
        "waypoints": checks.whole("waypoints", waypoints, least=2, most=100),
        "repeats": repeats,
        "evaluations": checks.whole("evaluations", evaluations, least=1, most=100_000),
        "seed": checks.whole("seed", seed, least=0, most=2**64 - 1),
    }
    design = interruptible.call(_armrs.design, asked.rig, asked.settings, instruments, limits, search)
    found = tuple(Movement(np.array(m.waypoints), speed=m.speed, acceleration=m.acceleration, shape="smooth") for m in design.movements)
    return replace(asked.plan(found, design.forecast), slowed=design.slowed)


def angles_of(text: str) -> tuple[tuple[float, float], ...]:
    """Return the ranges of joints [rad] written in degrees as `LOW:HIGH,LOW:HIGH`."""
    ranges = []
    for part in text.split(","):
        ends = part.split(":")
        try:
            low, high = (float(np.radians(float(end))) for end in ends)
        except ValueError:
            raise BadInput("--angles-deg", part, "LOW:HIGH in degrees for each joint, such as -80:-10,20:110") from None
        if low >= high:
            raise BadInput("--angles-deg", part, "the smaller angle first, as LOW:HIGH")
        ranges.append((low, high))
    return tuple(ranges)


def plan_data(
    found: Plan, beside: Plan | None = None, smallest: Sequence[Any] = (), *, name: str = "planned movements", command: str | None = None
) -> dict[str, Any]:
    """Return a plan as it is written to JSON, with the forecast of another movement to compare with, and the smallest effects seen."""
    data: dict[str, Any] = {
        "verb": "plan",
        **found.to_dict(),
        "would_show": [w.to_dict() for w in smallest],
        "data": {"name": name, "synthetic": True, "joints": [joint.name for joint in found.model.joints]},
        "made_by": origin(command),
    }
    if beside is not None:
        data["compared"] = beside.to_dict() | {"worst_ratio": beside.worst / found.worst}
    return data


def write_movements(found: Plan, data: dict[str, Any], folder: Path) -> list[Path]:
    """Write `plan.toml`, whose tables belong into an EXPERIMENT.toml, and a movement file for each movement."""
    written = [folder / "plan.toml"]
    files.write_text(written[0], found.to_toml(), kind=".toml")
    for number, entry in enumerate(data["movements"], start=1):
        table = {key: value for key, value in entry.items() if key != "repeats"}
        table["waypoints_deg"] = np.round(table["waypoints_deg"], 3).tolist()
        written.append(folder / f"movement-{number}.toml")
        files.write_text(written[-1], "\n".join(["[movement]", *tomlfile.lines(table), ""]), kind=".toml")
    return written


class _Question:
    """Input of forecast and plan for the core."""

    def __init__(self, model: Model, with_effects: Sequence[str] | None, instruments: Instruments, repeats: int) -> None:
        checks.instance("model", model, Model)
        checks.instance("instruments", instruments, Instruments)
        self.model, self.repeats = model, checks.whole("repeats", repeats, least=1, most=10_000)
        self.effects, fitted = effects_of(model, with_effects)
        self.rig = _armrs.Rig(model, self.effects)
        self.settings = CoreSettings(model, fitted, instruments.tolerance)

    def plan(self, movements: tuple[Movement, ...], forecast: Forecast) -> Plan:
        """Return what the core found."""
        return Plan(movements, self.repeats, forecast, self.model)
