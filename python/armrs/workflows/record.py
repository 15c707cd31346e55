"""The virtual laboratory (thesis figure 3.8): a subject, a controlled robot, sensors, clocks, and a supervisor that stops it."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import _armrs, checks
from ..catalogue import catalogue
from ..errors import ArmrsError, BadInput, Sentence, Text
from ..io import files
from ..io.dataset import FILE, Dataset, write_dataset
from ..io.markers import Markers, planar_motion
from ..io.opensim import write_trc
from ..io.samples import write_samples
from ..io.trial import FEWEST_SAMPLES, Trial
from ..model import AddedMass, Description, Effect, Model
from ..tabular import Tabular, Tidy
from .core_experiment import CoreRun, driven
from .experiment import Devices, Experiment, Fault, Run, load_experiment
from .force_sensor import CHANNELS, RobotMotion, digitised
from .interaction import CONTROL_RATE, Interacted
from .movement import Movement
from .simulate import Channel, Sensors, Simulated, simulate
from .stiction import DEFAULT_DT

if TYPE_CHECKING:
    from .._armrs import _Controlled

RECORDING_RATE = 500.0
"""Samples a second of the simulation, from which the devices take theirs [Hz]."""
LONGEST = 3600.0
"""Longest trial [s]: no subject holds still for longer, and the recording would fill the memory."""
GAP = 0.1
"""Length of a gap of a hidden marker [s]."""
EMG_REST, EMG_GAIN = 3.0, 20.0
"""Amplitude of a silent muscle [µV], and what each newton metre of it adds [µV/(N m)]."""
_POINTS = ("shoulder", "elbow", "wrist", "handle")


@dataclass(frozen=True, eq=False)
class Recorded(Tabular):
    """What the virtual laboratory measured.

    Attributes
    ----------
    dataset : Dataset
        As it was written, before reading it back.
    experiment : Experiment
    trials : tuple of dict
        For each trial: what the supervisor and the robot did, moments drawn, clocks.
    files : tuple of Path
        What was written.
    interacted : dict of str to tuple of Interacted
        Where the handle yields, by the file of the trial: the run that was recorded, and where something carries the arm the same run
        without it.
    """

    dataset: Dataset
    experiment: Experiment
    trials: tuple[dict[str, Any], ...]
    files: tuple[Path, ...]
    interacted: dict[str, tuple[Interacted, ...]]

    @property
    def stopped(self) -> list[dict[str, Any]]:
        """The trials that the supervisor stopped; they are not in the data set."""
        return [trial for trial in self.trials if trial["stop"] is not None]

    def __repr__(self) -> str:
        return f"Recorded({self.dataset!r}, {len(self.stopped)} stopped)"

    def tidy(self) -> Tidy:
        """Return the trials, one a row."""
        columns: dict[str, list[Any]] = {name: [t[name] for t in self.trials] for name in ("configuration", "repeat", "seed")}
        columns["tracking_error"] = [np.nan if t["tracking_error_rad"] is None else t["tracking_error_rad"] for t in self.trials]
        columns["stopped"] = [None if t["stop"] is None else t["stop"]["reason"] for t in self.trials]
        return Tidy(columns, {"tracking_error": "rad"})

    def to_dict(self) -> dict[str, Any]:
        """Return plain data with units in the names."""
        return {
            "verb": "record",
            "data": {"name": self.dataset.name, "synthetic": True, "joints": [j.name for j in self.dataset.model.joints]},
            "trials": list(self.trials),
            "stopped": len(self.stopped),
            "lengths_m": [s.length for s in self.dataset.model.segments],
            "files": [os.fspath(path) for path in self.files],
        }


def record(
    experiment: Experiment | str | os.PathLike[str], folder: str | os.PathLike[str], *, step: Callable[[int], None] = lambda done: None
) -> Recorded:
    """Run an experiment in the virtual laboratory and write a data set.

    Parameters
    ----------
    experiment : Experiment or path
        `EXPERIMENT.toml`.
    folder : path
        Gets the data set, the markers in `markers/`, the readings of a six-axis force sensor in `wrench/`, and the truth in `truth/`,
        which no other verb reads.
    step : callable
        Called with 1 after each trial.

    Returns
    -------
    Recorded

    Raises
    ------
    BadInput
        For an experiment that cannot be used; nothing is written.
    ArmrsError
        When the supervisor stopped every trial to be fitted.
    """
    experiment = checks.loaded("experiment", experiment, Experiment, load_experiment)
    out = files.output_folder(folder)
    former = _former(out)
    check_required(experiment)
    measured = measure(experiment, step=step)
    written = _write(measured, experiment, out)
    for path in former - {*written, *(out / trial.file for trial in measured.dataset.trials)}:
        path.unlink(missing_ok=True)
    return Recorded(measured.dataset, experiment, measured.trials, written, measured.interacted)


@dataclass(frozen=True, eq=False)
class Measured:
    """A session as the devices saw it, in memory alone.

    Attributes
    ----------
    dataset : Dataset
    trials : tuple of dict
        As in `Recorded`.
    markers : dict of str to Markers
        What the cameras saw, by the file of the trial.
    interacted : dict of str to tuple of Interacted
        As in `Recorded`.
    wrench_on_robot : dict of str to ndarray, shape (n, 6)
        What a six-axis force sensor read, by the file of the trial [N, N m].
    """

    dataset: Dataset
    trials: tuple[dict[str, Any], ...]
    markers: dict[str, Markers]
    interacted: dict[str, tuple[Interacted, ...]]
    wrench_on_robot: dict[str, np.ndarray]


def measure(experiment: Experiment, *, step: Callable[[int], None] = lambda done: None) -> Measured:
    """Run an experiment without writing anything; errors and `step` are those of `record`, movements are not checked beforehand."""
    session = _Session(experiment)
    seen = []
    for number, run in enumerate(experiment.runs):
        for repeat in range(1, run.repeats + run.tests + 1):
            seen.append(session.measure(run, number, repeat))
            step(1)
    kept = [(m.trial, m.markers, m.story) for m in seen if m.trial is not None and m.markers is not None]
    if not any(trial.role == "fit" for trial, _, _ in kept):
        stop = seen[0].story["stop"]
        if stop is None:
            rate = experiment.devices.rate_Hz
            short = f"a recording of less than {FEWEST_SAMPLES} samples at {rate:g} Hz"
            raise BadInput("[[movement]] 1", Text(short), "a longer movement or a higher rate")
        found = f"{stop['what']} {stop['reason']}, {stop['value']:.4g} where {stop['limit']:.4g} is allowed"
        raise ArmrsError(f"the supervisor stopped every trial to be fitted, the first after {stop['at_s']:.4g} s: {found}")
    lengths = np.mean([story["lengths_m"] for _, _, story in kept], axis=0)
    dataset = Dataset(
        name=experiment.name,
        model=_with_lengths(experiment.believed, lengths),
        trials=tuple(trial for trial, _, _ in kept),
        force_on="robot",
        sample_rate=experiment.devices.rate_Hz,
        subject=experiment.subject,
        tolerance=experiment.tolerance,
        synthetic=True,
        added=_added(experiment.runs, {trial.configuration for trial, _, _ in kept}),
    )
    interacted = {m.trial.file: m.interacted for m in seen if m.trial is not None and m.interacted}
    wrenches = {m.trial.file: m.wrench_on_robot for m in seen if m.trial is not None and m.wrench_on_robot is not None}
    return Measured(dataset, tuple(m.story for m in seen), {trial.file: markers for trial, markers, _ in kept}, interacted, wrenches)


def check_required(experiment: Experiment) -> None:
    """Refuse movements beyond the limits of the robot's supervisor."""
    safety = experiment.safety
    for number, run in enumerate(experiment.runs, start=1):
        place = f"[[movement]] {number} ({run.configuration})"
        if (least := _least_duration(run.movement)) > LONGEST:
            hint = "a larger speed or acceleration"
            raise BadInput(place, Text(f"{least:.4g} s and more"), f"at most {LONGEST:g} s", file=experiment.file, hint=hint)
        try:
            asked = simulate(experiment.truth, run.movement, rate=RECORDING_RATE).columns
        except BadInput as error:
            raise error.within(file=experiment.file, place=place) from None
        for column, unit, name in (("robot_qd", "rad/s", "speed_rad_s"), ("robot_qdd", "rad/s²", "acceleration_rad_s2")):
            most, allowed = float(np.abs(asked[column]).max()), getattr(safety, name)
            if most > allowed:
                found = Text(f"{most:.3g} {unit} of a joint of the robot")
                hint = "slower, or away from where the robot is stretched out"
                raise BadInput(place, found, f"at most [safety] {name} = {allowed:g}", file=experiment.file, hint=hint)


def _least_duration(movement: Movement) -> float:
    """Return what a movement lasts at least, whatever its shape [s]."""
    ways = np.abs(np.diff(movement.waypoints, axis=0)).max(axis=1)
    moving = np.maximum(ways / movement.speed, 2.0 * np.sqrt(ways / movement.acceleration))
    return float(moving.sum()) + movement.pause * (len(ways) - 1)


@dataclass(frozen=True, eq=False)
class _MeasuredRun:
    trial: Trial | None
    markers: Markers | None
    story: dict[str, Any]
    interacted: tuple[Interacted, ...] = ()
    wrench_on_robot: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class _Reading:
    """What is true at any time, and what the robot and its force sensor read."""

    t: np.ndarray
    q: np.ndarray
    stamps: np.ndarray
    force_on_arm: np.ndarray | None
    moment_on_arm: np.ndarray | None
    robot_q: np.ndarray | None


class _Session:
    """What stays the same from trial to trial."""

    def __init__(self, experiment: Experiment) -> None:
        self.experiment = experiment
        draw = np.random.default_rng([experiment.seed, 1])
        n, devices = experiment.truth.n_joints, experiment.devices
        self.offsets = devices.marker_offset_m * draw.standard_normal((n + 1, 2))
        self.skin = devices.marker_skin_m_rad * draw.standard_normal((n, 2))

    def measure(self, run: Run, number: int, repeat: int) -> _MeasuredRun:
        """Measure one trial; its random numbers depend on seed, movement and repeat alone."""
        e, devices = self.experiment, self.experiment.devices
        seed = int(np.random.SeedSequence([e.seed, 2, number, repeat]).generate_state(1, np.uint64)[0] >> 11)
        draw = np.random.default_rng(seed)
        moments = e.variation_Nm * draw.standard_normal(e.truth.n_joints)
        model = _wearing(e.truth, run.worn)
        extra = tuple(Effect("constant_moment", j, parameters={"moment": m}) for j, m in enumerate(moments, 1) if m)
        model = model.replace(effects=(*model.effects, *extra))
        if e.interaction is not None:
            return self._yield(model, run, repeat, (draw, moments, seed))
        fault = next((f for f in e.faults if (f.configuration, f.repeat) == (run.configuration, repeat)), None)
        led = self._lead(model, run.movement, fault, seed)
        story: dict[str, Any] = {
            "configuration": run.configuration,
            "repeat": repeat,
            "seed": seed,
            "moment_Nm": list(moments),
            "tracking_error_rad": led["tracking_error"],
            "stop": _stop(led["stop"], led),
        }
        if story["stop"] is not None:
            return _MeasuredRun(None, None, story)
        every = round(1.0 / (RECORDING_RATE * DEFAULT_DT))
        path = Trial(
            "",
            run.configuration,
            repeat,
            "fit",
            led["time"][::every],
            np.empty((len(led["time"][::every]), 0)),
            robot_q=led["robot_q"][::every],
            valid=np.ones(1, bool),
        )
        # Sensors read what is recorded.
        rate = RECORDING_RATE if devices.rate_Hz <= RECORDING_RATE else 2.0 * RECORDING_RATE
        true = simulate(model, path, rate=rate, start=run.movement.waypoints[0], sensors=_sensors(devices), seeds=[seed])
        read = true.readings[0]
        assert read.force_on_arm is not None and read.robot_q is not None
        moved = RobotMotion(true.t, *(true.columns[name] for name in ("robot_q", "robot_qd", "robot_qdd")))
        force, wrench = self._sense(model, moved, (read.time, read.force_on_arm, read.robot_q), (seed, story))
        reading = _Reading(true.t, true.q, read.time, force, read.moment_on_arm, read.robot_q)
        trial, markers = self._read(run, repeat, (reading, model), (draw, story))
        if trial is not None:
            tau, emg = _brakes(true, read.time, devices, draw), _emg(true, read.time, draw) if devices.emg else {}
            trial = dataclasses.replace(trial, tau=tau, emg=emg)
        return _MeasuredRun(trial, markers, story, wrench_on_robot=wrench)

    def _yield(self, model: Model, run: Run, repeat: int, drawn: tuple[np.random.Generator, np.ndarray, int]) -> _MeasuredRun:
        """Measure one trial with a handle that yields; where something carries the arm, run it without that as well."""
        e, devices, (draw, moments, seed) = self.experiment, self.experiment.devices, drawn
        assert e.interaction is not None and model.robot is not None
        pushed = np.empty((0, 2)) if e.perturbation is None else e.perturbation.force(np.random.default_rng([seed, 3]))
        core = CoreRun("rk4", DEFAULT_DT, 1.0 / RECORDING_RATE, q=[float(v) for v in run.movement.waypoints[0]])
        device = (self._watch(None, seed), e.interaction.core())
        supports = [None] if e.support is None else [e.support.core(), None]
        rig, led = _armrs.Rig(model), driven(model, run.movement, "compliant")
        every = round(CONTROL_RATE / RECORDING_RATE)
        runs = tuple(Interacted.of(_armrs.interact(rig, led, core, device, pushed, s), model.robot, every) for s in supports)
        kept = runs[0]
        story: dict[str, Any] = {
            "configuration": run.configuration,
            "repeat": repeat,
            "seed": seed,
            "moment_Nm": list(moments),
            "tracking_error_rad": None,
            "stop": _stop(kept.stop),
            "interaction": _compared(runs, self.experiment),
        }
        if kept.stop is not None:
            return _MeasuredRun(None, None, story, runs)
        stamps = np.arange(0.0, kept.t[-1], 1.0 / devices.rate_Hz)
        force, robot_q = (np.column_stack([np.interp(stamps, kept.t, c) for c in a.T]) for a in (kept.force_on_arm, kept.robot_q))
        wrench = None
        if devices.six_axis is None:
            noisy = force + devices.force_noise_N * draw.standard_normal(force.shape)
            force = digitised(noisy, devices.force_range_N, devices.force_bits)
        else:
            force, wrench = self._sense(model, RobotMotion.of_angles(kept.t, kept.robot_q), (stamps, force, robot_q), (seed, story))
        moment = (devices.moment_noise_Nm or 0.0) * draw.standard_normal(len(stamps))
        trial, markers = self._read(run, repeat, (_Reading(kept.t, kept.q, stamps, force, moment, robot_q), model), (draw, story))
        if trial is not None and e.support is not None:
            torque = np.column_stack([np.interp(stamps, kept.t, c) for c in kept.support.T])
            trial = dataclasses.replace(trial, tau=torque + (devices.brake_noise_Nm or 0.0) * draw.standard_normal(torque.shape))
        return _MeasuredRun(trial, markers, story, runs, wrench)

    def _sense(
        self, model: Model, moved: RobotMotion, seen: tuple[np.ndarray, np.ndarray, np.ndarray], state: tuple[int, dict[str, Any]]
    ) -> tuple[np.ndarray, np.ndarray | None]:
        """Return the force on the arm as it is recorded, and what a six-axis sensor read; `seen`: time, force on the arm, robot angles."""
        sensor, (stamps, force_on_arm, robot_q), (seed, story) = self.experiment.devices.six_axis, seen, state
        if sensor is None:
            return force_on_arm, None
        assert model.robot is not None
        rig = (model.robot, model.gravity)
        wrench = sensor.read(rig, moved.at(stamps), -force_on_arm, np.random.default_rng([seed, 4]))
        story["six_axis"] = {"saturated": sensor.saturated(wrench)}
        return -sensor.force_on_robot(rig, RobotMotion.of_angles(stamps, robot_q), wrench), wrench

    def _lead(self, model: Model, movement: Movement, fault: Fault | None, seed: int) -> _Controlled:
        """Let the robot's controller follow the movement; it is programmed with the true lengths."""
        start = [float(v) for v in movement.waypoints[0]]
        run = CoreRun("rk4", DEFAULT_DT, 1.0 / RECORDING_RATE, q=start)
        return _armrs.control(_armrs.Rig(model), driven(model, movement, "compliant"), run, self._watch(fault, seed))

    def _watch(self, fault: Fault | None, seed: int) -> _armrs._Watch:
        c, s = self.experiment.controller, self.experiment.safety
        return {
            "bandwidth": c.bandwidth_rad_s,
            "damping": c.damping,
            "torque_limit": c.torque_limit_Nm,
            "angle_margin": np.radians(s.angle_margin_deg),
            "speed": s.speed_rad_s,
            "acceleration": s.acceleration_rad_s2,
            "force": s.force_N,
            "fault": None if fault is None else _injected(fault),
            "seed": seed,
        }

    def _read(
        self, run: Run, repeat: int, true: tuple[_Reading, Model], state: tuple[np.random.Generator, dict[str, Any]]
    ) -> tuple[Trial | None, Markers]:
        """Let every device read the run."""
        (read, model), (draw, story) = true, state
        devices = self.experiment.devices
        stamps = read.stamps
        seen = (1.0 + devices.clock_drift) * stamps + devices.clock_offset_s + devices.clock_jitter_s * draw.standard_normal(len(stamps))
        q = np.column_stack([np.interp(seen, read.t, column) for column in read.q.T])
        markers = self._markers(model, stamps, q, draw)
        motion = planar_motion(markers, markers.names, up="z", forward="y")
        story["lengths_m"] = list(motion.lengths)
        story["clock"] = {"offset_s": devices.clock_offset_s, "drift": devices.clock_drift, "jitter_s": devices.clock_jitter_s}
        trial = Trial(
            file=f"trials/{run.configuration}_{repeat}.csv",
            configuration=run.configuration,
            repeat=repeat,
            role="fit" if repeat <= run.repeats else "test",
            t=stamps,
            q=motion.q,
            force_on_arm=read.force_on_arm,
            moment_on_arm=None if devices.moment_noise_Nm is None else read.moment_on_arm,
            robot_q=read.robot_q,
        )
        return trial if len(stamps) >= FEWEST_SAMPLES else None, markers

    def _markers(self, model: Model, t: np.ndarray, q: np.ndarray, draw: np.random.Generator) -> Markers:
        """Return the positions of the joints as the cameras measure them: x (normal to the plane), y, z [m].

        The marker of the first joint sits on the trunk, the one at the end of a segment on this segment. Skin that moves with the next
        joint carries it along, from the hanging stretched arm on; the handle has no skin.
        """
        absolute = np.cumsum(q, axis=1)
        at = np.tile(np.array(model.base), (len(t), 1))
        points = [at]
        for segment, angle in zip(model.segments, absolute.T, strict=True):
            at = at + segment.length * np.column_stack([np.cos(angle), np.sin(angle)])
            points.append(at)
        beside = np.tile(self.offsets, (len(t), 1, 1))
        beside[:, :-1] += (q + 0.5 * np.pi * np.eye(1, q.shape[1]))[:, :, None] * self.skin
        positions = np.zeros((len(t), len(points), 3))
        positions[:, :, 1:] = np.stack(points, axis=1) + np.stack([beside[:, 0], *_turned(beside[:, 1:], absolute)], axis=1)
        devices = self.experiment.devices
        positions += devices.marker_noise_m * draw.standard_normal(positions.shape)
        _hide(positions, devices, draw)
        return Markers([*_POINTS[: len(points) - 1], _POINTS[-1]], t, positions, up="z")


def _turned(vectors: np.ndarray, absolute: np.ndarray) -> list[np.ndarray]:
    """Return vectors in the frames of segments, (n, n_joints, 2), in the plane: one (n, 2) a segment."""
    cosine, sine = np.cos(absolute), np.sin(absolute)
    y, z = cosine * vectors[:, :, 0] - sine * vectors[:, :, 1], sine * vectors[:, :, 0] + cosine * vectors[:, :, 1]
    return [np.column_stack(pair) for pair in zip(y.T, z.T, strict=True)]


def _hide(positions: np.ndarray, devices: Devices, draw: np.random.Generator) -> None:
    """Hide markers for a tenth of a second at a time."""
    length = max(1, round(GAP * devices.rate_Hz))
    n, markers, _ = positions.shape
    for k in range(markers):
        for start in np.flatnonzero(draw.random(n) < devices.marker_gaps / length):
            positions[start : start + length, k] = np.nan


def _sensors(devices: Devices) -> Sensors:
    # Six axes read the contact force as it is, with the tool.
    force = Channel(devices.force_noise_N, range=devices.force_range_N, bits=devices.force_bits)
    return Sensors(
        rate=devices.rate_Hz,
        force=force if devices.six_axis is None else Channel(),
        moment=Channel(devices.moment_noise_Nm or 0.0),
        robot=Channel(range=2 * np.pi, bits=24),
    )


def _effects_torque(true: Simulated, family: str) -> np.ndarray:
    """Return the torque with which effects of a family resist, shape (n, n_joints) [N m]."""
    total, kinds = np.zeros_like(true.q), catalogue()
    for column, (kind, joint) in enumerate(true.columns["effects"]):
        if kinds[kind].family == family:
            total[:, joint] += true.columns["resisting"][:, column]
    return total


def _brakes(true: Simulated, t: np.ndarray, devices: Devices, draw: np.random.Generator) -> np.ndarray | None:
    if devices.brake_noise_Nm is None:
        return None
    torque = -_effects_torque(true, "dry")
    at = np.column_stack([np.interp(t, true.t, column) for column in torque.T])
    return at + devices.brake_noise_Nm * draw.standard_normal(at.shape)


def _emg(true: Simulated, t: np.ndarray, draw: np.random.Generator) -> dict[str, np.ndarray]:
    pull = -_effects_torque(true, "muscle")
    return muscle_activity(np.column_stack([np.interp(t, true.t, column) for column in pull.T]), draw)


def muscle_activity(pull: np.ndarray, draw: np.random.Generator) -> dict[str, np.ndarray]:
    """Return the amplitude of a flexor and an extensor of each joint by the names of columns [µV]; silent ones are never at zero.

    Parameters
    ----------
    pull : ndarray, shape (n, n_joints)
        Torque that the muscles of each joint apply, flexion positive [N m].
    draw : Generator
        Of the noise.
    """
    columns = {}
    for name, at in zip(_POINTS, pull.T, strict=False):
        for side, sign in (("flexor", 1.0), ("extensor", -1.0)):
            rest = EMG_REST * np.abs(1.0 + 0.2 * draw.standard_normal(len(at)))
            columns[f"emg_{name}_{side}_uV"] = rest + EMG_GAIN * np.maximum(sign * at, 0.0)
    return columns


def _injected(fault: Fault) -> tuple[float, str, int, tuple[float, float]]:
    size = (fault.delay_s, 0.0) if fault.kind == "late" else fault.force_N
    return fault.at_s, fault.kind, fault.joint - 1, size


def _stop(stop: tuple[str, int, float, float, float] | None, led: _Controlled | None = None) -> dict[str, Any] | None:
    if stop is None:
        return None
    reason, channel, value, limit, at = stop
    quantities = ("angle", "speed", "acceleration", "force")
    what = (
        "data" if channel is None else f"{quantities[channel // 2]} {('1', '2')[channel % 2] if channel < 6 else ('Fy', 'Fz')[channel % 2]}"
    )
    told: dict[str, Any] = {"reason": reason, "what": what, "value": value, "limit": limit, "at_s": at}
    if led is not None:
        told |= {
            "periods_after_fault": led["periods_to_stop"],
            "force_after_fault_N": led["force_after_fault"],
            "way_after_stop_m": led["way_after_stop"],
        }
    return told


def _compared(runs: tuple[Interacted, ...], experiment: Experiment) -> dict[str, Any]:
    """Return how a run with a yielding handle went, and without what carries the arm."""
    told: dict[str, Any] = {"run": runs[0].to_dict(), "without_support": None, "lowered": None}
    if len(runs) > 1:
        told["without_support"] = runs[1].to_dict()
    if len(runs) > 1 and all(run.stop is None for run in runs):
        told["lowered"] = 1.0 - told["run"]["force_rms_N"] / told["without_support"]["force_rms_N"]
    if experiment.perturbation is not None and experiment.interaction is not None:
        for key, run in zip(("run", "without_support"), runs, strict=False):
            if run.stop is None:
                tip = run.endpoint(experiment.interaction.hold_s)
                told[key]["endpoint_stiffness_N_m"] = tip.stiffness.tolist()
                told[key]["endpoint_stiffness_std_N_m"] = tip.std.tolist()
    return told


def _wearing(model: Model, worn: tuple[AddedMass, ...]) -> Model:
    for item in worn:
        model = model.with_mass(item.segment, item.mass, item.at)
    return model


def _with_lengths(model: Model, lengths: np.ndarray) -> Model:
    """Return a model with lengths as the markers show them."""
    segments = tuple(s.replace(length=float(a), com=min(s.com, float(a))) for s, a in zip(model.segments, lengths, strict=True))
    return model.replace(segments=segments)


def _added(runs: tuple[Run, ...], kept: set[str]) -> tuple[AddedMass, ...]:
    by_item: dict[tuple[int, float, float], list[str]] = {}
    for run in runs:
        for item in run.worn:
            if run.configuration in kept:
                by_item.setdefault((item.segment, item.mass, item.at), []).append(run.configuration)
    return tuple(AddedMass(*key, configurations=tuple(names)) for key, names in by_item.items())


def _former(out: Path) -> set[Path]:
    """Return trials and markers that a former recording left in a folder; a data set of another origin is never replaced."""
    if not (out / FILE).exists():
        return set()
    if not (out / "truth" / "truth.toml").is_file():
        raise BadInput("folder", Sentence("this folder holds a data set that armrs record did not write"), files.ANOTHER, file=out)
    names = [name for entry in Description.load(out / FILE).trials if (name := Path(entry.file)).parent == Path("trials")]
    markers = {out / "markers" / name.with_suffix(".trc").name for name in names}
    return {out / name for name in names} | markers | {out / "wrench" / name.name for name in names}


def _write(measured: Measured, experiment: Experiment, out: Path) -> tuple[Path, ...]:
    head = "# SYNTHETIC: what was simulated. No verb reads it.\n"
    truth = out / "truth" / "truth.toml"
    files.write_text(truth, head + experiment.truth.to_toml(), kind=".toml")
    files.write_json(
        out / "truth" / "truth.json", {"experiment": experiment.name, "seed": experiment.seed, "trials": list(measured.trials)}
    )
    written = [write_trc(out / "markers" / Path(file).with_suffix(".trc").name, markers) for file, markers in measured.markers.items()]
    for trial in measured.dataset.trials:
        if (wrench := measured.wrench_on_robot.get(trial.file)) is not None:
            written.append(out / "wrench" / Path(trial.file).name)
            write_samples(written[-1], ["t_s", *CHANNELS], [trial.t, *wrench.T])
    return (write_dataset(measured.dataset, out), truth, truth.with_suffix(".json"), *written)
