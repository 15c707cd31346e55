"""The closed-chain experiment: a robot leads the arm, and every quantity is recorded."""

from __future__ import annotations

import contextlib
import dataclasses
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from .. import _armrs, checks
from .._armrs import Readings as Readings
from .._armrs import Recording as Recording
from ..errors import BadInput, SimulationError, Text
from ..io.trial import Trial
from ..model import Model, load_model
from ..result_warnings import with_warnings
from ..tabular import Labelled, Series, Tabular, Tidy
from .core_experiment import INTEGRATORS, CoreDrive, CoreRun, about, driven
from .movement import Movement
from .simulation_accuracy import EnergyBalance, energy_balance
from .stiction import DEFAULT_DT, smoothings, steps_to_try, sticking

CHATTER = 1e-5
"""Share of the energy exchanged that smooth friction loses when the step does not resolve it."""
DEFAULT_RATE = 50.0
"""Samples a second of a recording [Hz]."""
SLOWEST = 1e-3
"""Least rate of a recording [Hz]."""
RUNAWAY = 30.0
"""Speed of a joint beyond which a run is none of a led arm [rad/s]."""
PIECE = 16384
"""Samples of a run that are held, drawn and written at once."""
_MOST_SEEDS = 10**5
_MOST_START = 100.0
"""Largest angle to start from [rad], as of a rest angle: turns beyond change nothing but the precision."""
_CHANNELS = ("angle", "force", "moment", "robot", "torque")


@dataclass(frozen=True)
class Channel:
    """Noise and limits of one kind of sensor channel.

    Attributes
    ----------
    deviation : float
        Standard deviation of the noise, in the unit of the channel.
    correlation_time : float
        Time in which its correlation falls to 1/e [s]; 0 for white noise.
    range : float
        Largest magnitude that is read.
    bits : int, optional
        Bits over the whole range.
    """

    deviation: float = 0.0
    correlation_time: float = 0.0
    range: float = np.inf
    bits: int | None = None

    def __post_init__(self) -> None:
        checks.number("deviation", self.deviation, least=0.0)
        checks.number("correlation_time", self.correlation_time, least=0.0, unit="s")
        checks.extent("range", self.range, above=0.0)
        if self.bits is not None:
            checks.bits("bits", self.bits)


@dataclass(frozen=True)
class Sensors:
    """What the sensors of a rig do to the truth; the defaults are ideal ones at 50 Hz."""

    rate: float = DEFAULT_RATE
    angle: Channel = Channel()
    force: Channel = Channel()
    moment: Channel = Channel()
    robot: Channel = Channel()
    torque: Channel = Channel()

    def __post_init__(self) -> None:
        checks.number("rate", self.rate, least=SLOWEST, unit="Hz")
        for kind in _CHANNELS:
            checks.instance(kind, getattr(self, kind), Channel)

    @classmethod
    def realistic(cls) -> Sensors:
        """Sensors of the thesis: cameras of 0.1°, a force sensor of ±110 N and 12 bit with 0.2 N of noise, robot encoders."""
        return cls(
            angle=Channel(np.radians(0.1)),
            force=Channel(0.2, range=110.0, bits=12),
            robot=Channel(range=2 * np.pi, bits=20),
        )


class Run(Protocol):
    """A recorded run, whole or streamed: what its summary, figures and files are made from."""

    @property
    def model(self) -> Model:
        """As of `Simulated`."""

    @property
    def settings(self) -> dict[str, Any]:
        """As of `Simulated`."""

    @property
    def samples(self) -> int:
        """How many were recorded."""

    @property
    def digest(self) -> str:
        """As of `Simulated`."""

    @property
    def balance(self) -> EnergyBalance:
        """As of `Simulated`."""

    def pieces(self) -> Iterator[Simulated]:
        """Give the samples in order, as runs of at most `PIECE` of them."""


class Doubted:
    """What may be wrong with a recorded run, by its samples."""

    @cached_property
    def balance(self: Run) -> EnergyBalance:
        """What of the energy of the run is not accounted for."""
        return energy_balance(self.pieces())

    @property
    def warnings(self: Run) -> tuple[str, ...]:
        """What is hardly a movement of an arm, or not accounted for, a line each."""
        return warnings(self)


def _samples(columns: dict[str, Any]) -> dict[str, Any]:
    """Return what a run keeps of its columns by name, and all of them."""
    return {"t": columns["time"]} | {name: columns[name] for name in ("q", "qd", "qdd", "force_on_arm")} | {"columns": columns}


@dataclass(frozen=True, eq=False)
class Simulated(Doubted, Tabular, Series):
    """A recorded run; rows are samples.

    Attributes
    ----------
    t : ndarray, shape (n,)
    q, qd, qdd : ndarray, shape (n, n_joints)
        Joint angles, speeds and accelerations [rad, rad/s, rad/s²].
    force_on_arm : ndarray, shape (n, 2)
        Contact force [N].
    columns : dict of str to ndarray
        Everything that was recorded: tip, handle, robot angles, every torque by itself, energies and works.
    readings : tuple of Readings
        What the sensors read, one for each seed.
    model : Model
    settings : dict
        Engine, integrator (of the native engine), step and rate that made it.
    """

    t: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    force_on_arm: np.ndarray
    columns: dict[str, Any] = field(repr=False)
    readings: tuple[Readings, ...] = field(repr=False)
    model: Model = field(repr=False)
    settings: dict[str, Any] = field(repr=False)

    def __repr__(self) -> str:
        most = np.max(np.hypot(*self.force_on_arm.T))
        size = f"{len(self.t)} samples, {self.t[-1]:.6g} s, {self.q.shape[1]} joints"
        return f"Simulated({size}; force on the arm up to {most:.4g} N; digest {self.digest})"

    def tidy(self) -> Tidy:
        """Return the samples, one a row: time, angles, speeds and the force on the arm."""
        joints = range(self.q.shape[1])
        columns = {"t": self.t} | {f"q{j + 1}": self.q[:, j] for j in joints} | {f"qd{j + 1}": self.qd[:, j] for j in joints}
        columns |= {"force_on_arm_y": self.force_on_arm[:, 0], "force_on_arm_z": self.force_on_arm[:, 1]}
        units = {"t": "s"} | {f"q{j + 1}": "rad" for j in joints} | {f"qd{j + 1}": "rad/s" for j in joints}
        return Tidy(columns, units | {"force_on_arm_y": "N", "force_on_arm_z": "N"})

    def labelled(self) -> tuple[Mapping[str, Any], Mapping[str, Labelled]]:
        """Return every recorded quantity with the names of its dimensions: joints, axes of the plane, joints of the robot."""
        joint, axis, robot = ("time", "joint"), ("time", "axis"), ("time", "robot_joint")
        dims: dict[str, tuple[tuple[str, ...], str]] = {
            "q": (joint, "rad"), "qd": (joint, "rad/s"), "qdd": (joint, "rad/s^2"), "tip": (axis, "m"), "handle": (axis, "m"),
            "robot_q": (robot, "rad"), "robot_qd": (robot, "rad/s"), "robot_qdd": (robot, "rad/s^2"), "force_on_arm": (axis, "N"),
            "moment_on_arm": (("time",), "N m"),
        }  # fmt: skip
        for name in self.columns:
            family = name.partition(".")[0]
            if family in ("torque", "energy", "work"):
                dims[name] = (joint, "N m") if family == "torque" else (("time",), "J")
        coordinates = {
            "time": self.t,
            "joint": [j.name for j in self.model.joints],
            "axis": ["y", "z"],
        }
        there = {name: self.columns.get(name) for name in dims}
        if there["robot_q"] is not None:
            coordinates["robot_joint"] = [1, 2]
        return coordinates, {name: Labelled(dims[name][0], values, dims[name][1]) for name, values in there.items() if values is not None}

    def to_dict(self) -> dict[str, Any]:
        """Return the samples and the settings as plain data."""
        return {"settings": dict(self.settings), "digest": self.digest, **self.tidy().columns}

    @cached_property
    def digest(self) -> str:
        """Digest of the recorded bits; the same on every machine. Computed at the first access."""
        digest = _armrs.Digest(self.columns["effects"])
        for name in digested(self.columns):
            values = self.columns[name]
            digest.column(name, 0 if values is None else values.size)
            if values is not None:
                digest.values(values)
        return digest.value()

    @property
    def samples(self) -> int:
        """How many were recorded."""
        return len(self.t)

    def pieces(self, samples: int = PIECE) -> Iterator[Simulated]:
        """Give the samples in order, so many at a time."""
        if len(self.t) <= samples:
            yield self
            return
        for first in range(0, len(self.t), samples):
            part = slice(first, first + samples)
            yield self.with_columns(
                {name: values[part] if isinstance(values, np.ndarray) else values for name, values in self.columns.items()}
            )

    def with_columns(self, columns: dict[str, Any]) -> Simulated:
        """Return the run with other samples."""
        return dataclasses.replace(self, **_samples(columns))


def digested(columns: Mapping[str, Any]) -> list[str]:
    """Return the names of the columns of a digest, in its order."""
    return [name for name in columns if name not in ("effects", "energy_error")]


def is_doubtful(run: Run) -> str | None:
    """Return why a run has to be compared with one of half the step; None where that is not needed.

    Rapier does not locate where set-valued friction sticks and slips. Smooth friction whose slope at rest is too steep for the step
    chatters, and loses energy while it does: at 1e-5 of what is exchanged the force is off by up to 0.2 %.
    """
    speeds = smoothings(run.model)
    if run.settings["engine"] == "rapier" and 0.0 in speeds:
        return "rapier does not locate where set-valued friction sticks and slips"
    if any(speed > 0.0 for speed in speeds) and run.balance.share > CHATTER:
        return "the dry friction may be too steep for the step"
    return None


def warnings(run: Run) -> tuple[str, ...]:
    """Return fast joints, missing energy and doubts about the step, a line each."""
    lines = [*runaway(run.pieces()), *run.balance.warnings]
    doubt = is_doubtful(run)
    if doubt is not None:
        lines.append(f"{doubt}: compare with half the step, or give it smoothing = 0 in the native engine, which solves it at any step")
    return tuple(lines)


def runaway(pieces: Iterable[Simulated]) -> tuple[str, ...]:
    """Return a line where a joint turns faster than a led arm does."""
    fastest, first = 0.0, None
    for piece in pieces:
        fastest = max(fastest, float(piece.qd.max()), -float(piece.qd.min()))
        if first is None and fastest > RUNAWAY:
            first = piece.t[np.argmax((np.abs(piece.qd) > RUNAWAY).any(axis=1))]
    if first is None:
        return ()
    return (f"the arm runs away: from {first:.3g} s on a joint turns faster than {RUNAWAY:g} rad/s, at most {fastest:.4g} rad/s",)


@with_warnings
def simulate(
    model: Model | str | os.PathLike[str],
    drive: Movement | Trial | None = None,
    *,
    engine: str = "native",
    integrator: str | None = None,
    dt: float | None = None,
    accuracy: float | None = None,
    rate: float | None = None,
    duration: float | None = None,
    coupling: str = "compliant",
    start: np.ndarray | None = None,
    start_speed: np.ndarray | None = None,
    sensors: Sensors | None = None,
    seeds: Sequence[int] = (),
) -> Simulated:
    """Simulate an arm that a robot leads, that motors move, or that swings freely.

    Parameters
    ----------
    model : Model or path
    drive : Movement, Trial or None
        The desired movement; a measured trial, whose robot angles (or else joint torques) drive the arm; or nothing, and it swings.
    engine : {"native", "rapier"}
        Minimal coordinates, or rigid bodies and joints in maximal coordinates.
    integrator : {"rk4", "euler", "imex"}, optional
        Of the native engine: fourth order, taken when absent; semi-implicit first order; or second order with the friction of joints
        implicit, which stays accurate with steep smooth friction at steps up to 2 ms. The default step is the same.
    dt : float, optional
        Step [s]. When absent 0.25 ms, or a 4th, 16th or 64th of it where smooth dry friction is too steep for it: the longest with which
        less than 1e-5 of the exchanged energy is unaccounted for. At any step, constant friction with the default smoothing that is too
        steep for 0.25 ms is set-valued: `smoothing` is 0 there in `model` of the run.
    accuracy : float, optional
        Largest error of a recorded angle against ever shorter steps [rad], instead of `dt`: of the fourth-order method, by comparing runs.
        The step is 1/rate divided by a whole number, 1e-6 s or more; `settings` of the run hold it and the estimated error.
    rate : float, optional
        Samples a second that are recorded [Hz]; 1/rate must be a whole number of steps. Sensors read this recording at a rate of their own,
        `sensors.rate`, which may not be larger: what is in between is not recorded. When absent, 50 Hz, or that of faster sensors.
    duration : float, optional
        Length of the run [s]; that of the movement or trial when absent.
    coupling : {"compliant", "rigid"}
        How the handle holds the tip.
    start, start_speed : ndarray, shape (n_joints,), optional
        Angles [rad] and speeds [rad/s] at the start. Where a handle leads: the static equilibrium near these angles.
    sensors, seeds
        What sensors read of the run, once for every seed.

    Returns
    -------
    Simulated

    Raises
    ------
    BadInput
        For settings that cannot be used.
    SimulationError
        When the run stops early.
    """
    checks.instance("sensors", sensors, Sensors, type(None))
    if rate is None:
        rate = DEFAULT_RATE if sensors is None else max(DEFAULT_RATE, sensors.rate)
    model = sticking(checks.loaded("model", model, Model, load_model))
    _check_accuracy(accuracy, dt, engine, integrator)

    def run(step: float) -> Simulated:
        options: dict[str, Any] = {"engine": engine, "integrator": integrator, "rate": rate, "duration": duration, "coupling": coupling}
        prepared = _prepared(model, drive, dt=step, start=(start, start_speed), **options)
        return _run(prepared, accuracy, _seeded(sensors, seeds, rate))

    if accuracy is not None:
        return run(1.0 / checks.number("rate", rate, least=SLOWEST, unit="Hz"))
    *shorter, last = steps_to_try(model, engine=engine, integrator=integrator, dt=dt)
    for step in shorter:
        with contextlib.suppress(SimulationError):  # a step that is too long may end the run
            made = run(step)
            if is_doubtful(made) is None:
                return made
    return run(last)


def _run(prepared: _PreparedRun, accuracy: float | None, sensing: tuple[Sensors, list[int]] | None) -> Simulated:
    """Return a run with the requested step, or with one that keeps an accuracy."""
    rig = _armrs.Rig(prepared.model)
    with prepared.about_drive():
        if accuracy is None:
            return prepared.recorded(_armrs.simulate(rig, prepared.led, prepared.core, sensing))
        raw, dt, error = _armrs.simulate_accurately(rig, prepared.led, prepared.core, accuracy, sensing)
    made = prepared.recorded(raw)
    return dataclasses.replace(made, settings=made.settings | _resolved(dt, accuracy, error))


def simulate_in_pieces(
    model: Model,
    drive: Movement | Trial | None,
    take: Callable[[Simulated], None],
    *,
    samples: int,
    engine: str = "native",
    integrator: str | None = None,
    dt: float = DEFAULT_DT,
    rate: float = DEFAULT_RATE,
    duration: float | None = None,
    coupling: str = "compliant",
) -> None:
    """Simulate as `simulate` does, and hand over every so many samples instead of keeping them; `take` gets each piece.

    Raises
    ------
    BadInput, SimulationError
        As `simulate`, and what `take` raises.
    """
    prepared = _prepared(
        model, drive, engine=engine, integrator=integrator, dt=dt, rate=rate, duration=duration, coupling=coupling, start=(None, None)
    )
    with prepared.about_drive():
        _armrs.simulate_in_pieces(_armrs.Rig(model), prepared.led, prepared.core, samples, lambda raw: take(prepared.recorded(raw)))


def resolve(
    model: Model,
    drive: Movement | Trial | None,
    accuracy: float,
    *,
    engine: str = "native",
    integrator: str | None = None,
    dt: float | None = None,
    rate: float = DEFAULT_RATE,
    **options: Any,
) -> dict[str, float]:
    """Return the settings of `simulate` with an accuracy [rad]: step, accuracy and estimated error; of the runs nothing is kept.

    Raises
    ------
    BadInput, SimulationError
        As `simulate`.
    """
    _check_accuracy(accuracy, dt, engine, integrator)
    step = 1.0 / checks.number("rate", rate, least=SLOWEST, unit="Hz")
    prepared = _prepared(model, drive, engine=engine, integrator=integrator, dt=step, rate=rate, start=(None, None), **options)
    with prepared.about_drive():
        chosen, error = _armrs.resolve(_armrs.Rig(model), prepared.led, prepared.core, accuracy)
    return _resolved(chosen, accuracy, error)


def _resolved(dt: float, accuracy: float, error: float) -> dict[str, float]:
    """Return the settings of a run whose step was found for an accuracy."""
    return {"dt_s": dt, "accuracy_rad": accuracy, "angle_error_rad": error}


def _check_accuracy(accuracy: float | None, dt: float | None, engine: str, integrator: str | None) -> None:
    """Refuse an accuracy beside a step, or of what has none."""
    if accuracy is None:
        return
    checks.number("accuracy", accuracy, above=0.0, unit="rad")
    if dt is not None:
        raise BadInput("dt, accuracy", Text("both"), "one of them: the step is found for the accuracy")
    if engine == "rapier":
        raise BadInput("accuracy", accuracy, "none beside the engine rapier, whose error has no known order")
    if integrator not in (None, "rk4"):
        raise BadInput("accuracy", accuracy, f"none beside the integrator {integrator}; the step is found for rk4")


@dataclass(frozen=True, eq=False)
class _PreparedRun:
    """A run as the core takes it."""

    model: Model
    drive: Movement | Trial | None
    led: CoreDrive
    core: CoreRun
    settings: dict[str, Any]

    @contextlib.contextmanager
    def about_drive(self) -> Iterator[None]:
        """Name the file that a refusal of the core is about."""
        try:
            yield
        except BadInput as error:
            raise about(self.drive, error, f"; a step is {self.core.dt:g} s") from None

    def recorded(self, raw: Recording) -> Simulated:
        """Return what the core has recorded."""
        columns: dict[str, Any] = {**raw.columns, "effects": raw.effects, "energy_error": raw.energy_error}
        return Simulated(**_samples(columns), readings=raw.readings, model=self.model, settings=self.settings)


def _prepared(
    model: Model | str | os.PathLike[str],
    drive: Movement | Trial | None,
    *,
    engine: str,
    integrator: str | None,
    dt: float,
    rate: float,
    duration: float | None,
    coupling: str,
    start: tuple[np.ndarray | None, np.ndarray | None],
) -> _PreparedRun:
    model = checks.loaded("model", model, Model, load_model)
    checks.choice("coupling", coupling, ("compliant", "rigid"))
    checks.choice("engine", engine, ("native", "rapier"))
    integrator = _integrator(integrator, engine)
    checks.instance("drive", drive, Movement, Trial, type(None))
    checks.number("dt", dt, above=0.0, unit="s")
    checks.number("rate", rate, least=SLOWEST, unit="Hz")
    steps = 1.0 / max(rate * dt, 1e-18)  # a step next to zero is refused with the length of the run
    if steps < 1.0 - 1e-6:
        raise BadInput("dt, rate", _clock(dt, rate), "at least one step from sample to sample")
    if abs(steps - round(steps)) > 1e-6 * steps:
        raise BadInput("dt, rate", _clock(dt, rate), f"a whole number of steps from sample to sample, not {steps:.6g}")
    if duration is not None:
        _check_duration(duration, dt, rate)
    led = driven(model, drive, coupling)
    if duration is not None and led.times is not None and duration > led.times[-1] + 1e-6 * dt:
        raise BadInput("duration", duration, f"at most {np.floor(1e4 * led.times[-1]) / 1e4:.6g} s, the length of the trial")
    if duration is None and led.times is not None and rate * led.times[-1] < 1.0:
        raise BadInput("rate", rate, f"at least one sample interval in the {led.times[-1]:.6g} s of the trial")
    angles, speeds = start
    if isinstance(drive, Trial) and angles is None:
        first = int(np.argmax(np.isfinite(drive.q).all(axis=1)))
        angles = drive.q[first]
        if led.kind != "robot" and speeds is None and drive.dq is not None:
            speeds = drive.dq[first]
    core = CoreRun(
        engine=engine,
        integrator=integrator,
        dt=dt,
        duration=duration,
        output_interval=1.0 / rate,
        q=None if angles is None else _start(angles),
        qd=None if speeds is None else checks.numbers("start_speed", speeds, "rad/s").reshape(-1).tolist(),
    )
    settings = {
        "engine": engine,
        "integrator": None if engine == "rapier" else integrator,
        "dt_s": dt,
        "rate_Hz": rate,
        "coupling": coupling,
    }
    return _PreparedRun(model, drive, led, core, settings)


def _integrator(given: str | None, engine: str) -> str:
    """Return the integrator of a run; rapier has its own, and a requested one would be ignored."""
    if given is None:
        return "rk4"
    if engine == "rapier":
        raise BadInput("integrator", given, "none beside the engine rapier, which has its own")
    return checks.choice("integrator", given, INTEGRATORS)


def _clock(dt: float, rate: float) -> Text:
    """Return step and rate together, as either may have to change."""
    return Text(f"a step of {dt:g} s and {rate:g} Hz")


def _start(angles: np.ndarray) -> list[float]:
    found = checks.numbers("start", angles, "rad").reshape(-1)
    for k, angle in enumerate(found):
        checks.number(f"start[{k}]", float(angle), least=-_MOST_START, most=_MOST_START, unit="rad")
    return found.tolist()


def _check_duration(duration: float, dt: float, rate: float) -> None:
    """Refuse a length of a run that is no whole number of steps, or holds no sample interval."""
    checks.number("duration", duration, above=0.0, unit="s")
    if not 1.0 / rate <= duration < _armrs.MOST_STEPS * dt:
        raise BadInput("duration", duration, f"{1.0 / rate:g} s (one interval between samples) to {_armrs.MOST_STEPS * dt:g} s")
    steps = duration / dt
    if abs(steps - round(steps)) > 1e-9 * steps:
        raise BadInput("duration", duration, f"a whole number of steps of {dt:g} s", hint=f"nearest: {round(steps) * dt:.9g} s")


def _seeded(sensors: Sensors | None, seeds: Sequence[int], rate: float) -> tuple[Sensors, list[int]] | None:
    """Return sensors with their seeds; what would silently have no effect is refused."""
    checks.instance("seeds", seeds, list, tuple, range, np.ndarray)
    if len(seeds) > _MOST_SEEDS:
        raise BadInput("seeds", Text(f"{len(seeds)} of them"), f"at most {_MOST_SEEDS}")
    read = [checks.whole(f"seeds[{k}]", seed, least=0, most=2**64 - 1) for k, seed in enumerate(seeds)]
    if sensors is None:
        if read:
            raise BadInput("seeds", read, "none without sensors: they are the seeds of what sensors read")
        return None
    if not read:
        raise BadInput("seeds", Text("none"), "a seed for each reading of the sensors")
    if sensors.rate > rate * (1.0 + 1e-9):
        found = Text(f"{rate:g} Hz")
        raise BadInput("rate", found, f"at least the {sensors.rate:g} Hz of the sensors, which read what is recorded")
    return sensors, read
