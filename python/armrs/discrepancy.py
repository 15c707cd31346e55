"""The gap workflow: where simulation and data disagree, which effect is missing, and what adding it gains."""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _armrs, suspicion
from .catalogue import catalogue
from .dataset import Dataset, load_dataset
from .identification import _columns
from .model import Effect, Joint, Model, Segment
from .rig import all_effects, arm, rig
from .trial import Trial

FORCE_CHANNELS = ("Fy", "Fz", "Mx")


@dataclass(frozen=True)
class Value:
    """One parameter of a named effect: estimate, standard deviation, unit; without a standard deviation it was held."""

    value: float
    std: float | None
    unit: str

    @property
    def interval(self) -> tuple[float, float] | None:
        """The 95 % interval, or None for a value that was held."""
        return None if self.std is None else (self.value - 1.96 * self.std, self.value + 1.96 * self.std)


@dataclass(frozen=True)
class Alternative:
    """Another effect that would explain what a named one does.

    Attributes
    ----------
    kind : str
    joint, channel
        Where it acts, as for an effect of a model.
    why : str
    worse : float
        How much worse it explains the data, in units of twice the log-likelihood; a few units decide nothing.
    likeness : float
        Squared cosine between what the two would show on these movements: 1 cannot be told apart.
    """

    kind: str
    joint: int | None
    channel: str | None
    why: str
    worse: float
    likeness: float
    separating_movement: str | None = None


@dataclass(frozen=True)
class Missing:
    """An effect that the model lacks.

    Attributes
    ----------
    kind : str
    joint, channel
        Where it acts.
    parameters : dict of Value
    p_value : float
        Probability of such a gain by chance, all questions that were asked counted.
    share : float
        Share of what can be explained that is lost without it.
    alternatives : tuple of Alternative
    """

    kind: str
    joint: int | None
    channel: str | None
    parameters: Mapping[str, Value]
    p_value: float
    share: float
    alternatives: tuple[Alternative, ...] = ()
    trial: str | None = None

    def __str__(self) -> str:
        place = f" joint {self.joint}" if self.joint else f" {self.channel}" if self.channel else ""
        values = ", ".join(f"{n} = {v.value:.4g}" + (f" ± {v.std:.2g}" if v.std else "") + f" {v.unit}" for n, v in self.parameters.items())
        return f"{self.kind}{place}: {values}"


@dataclass(frozen=True)
class Place:
    """Somewhere that simulation and data disagree.

    Attributes
    ----------
    trial : str
    channel : str
    t_start, t_end : float
        [s]
    joint : int or None
    condition : str
        Region of movement: `dq2 > 0`, `dq2 < 0`, `dq2 = 0`.
    mean : float
        Mean difference there, in the unit of the channel.
    z : float
        The mean in its standard deviations; the correlation of residuals in time is taken into account.
    """

    trial: str
    channel: str
    t_start: float
    t_end: float
    joint: int | None
    condition: str
    mean: float
    z: float


@dataclass(frozen=True)
class ChannelGap:
    """Root mean square difference of simulation and data in one channel, over the test trials.

    Attributes
    ----------
    before, calibrated, after : float or None
        With the model as given, after refitting what the tolerances allow, and with the named effects.
    floor : float or None
        What repeats of one movement differ by; None without repeats.
    """

    before: float | None
    calibrated: float | None
    after: float | None
    floor: float | None

    @property
    def closed(self) -> float | None:
        """Share of the calibrated gap above the floor that is gone."""
        if None in (self.calibrated, self.after) or self.floor is None:
            return None
        above = self.calibrated - self.floor  # type: ignore[operator]
        return None if above <= 0 else (self.calibrated - self.after) / above  # type: ignore[operator]


@dataclass(frozen=True)
class Absorbed:
    """A small imperfection that was refitted within what was promised of it."""

    name: str
    value: float
    promised: float
    unit: str


@dataclass(frozen=True)
class Limit:
    """The smallest effect that these data would have shown."""

    kind: str
    joint: int | None
    channel: str | None
    parameter: str
    at_least: float
    unit: str


@dataclass(frozen=True, eq=False)
class GapFound:
    """The result of the gap workflow.

    Attributes
    ----------
    verdict : {"explained", "nothing_missing", "unexplained"}
    effects : tuple of Missing
        What the model lacks, that which explains most first.
    where : tuple of Place
        Where the calibrated model and the fit trials disagree, the clearest first.
    gap : dict of ChannelGap
        By channel, on the test trials.
    would_have_seen : tuple of Limit
    unexplained : float
        Share of what the calibrated model left beyond noise that is still there.
    looks_like : str or None
        Shape of what is left.
    absorbed : tuple of Absorbed
    lack : ((float, float), (float, float))
        Lack of fit, ratio and z, of the calibrated and of the amended model; NaN without repeats.
    warnings : tuple of str
    model : Model
        The model with the named effects, everything refitted.
    dataset : Dataset
    raw : dict
        What the core returned: the ladder of evidence, what was ruled out, the simulated channels of every trial.
    """

    verdict: str
    effects: tuple[Missing, ...]
    where: tuple[Place, ...]
    gap: Mapping[str, ChannelGap]
    would_have_seen: tuple[Limit, ...]
    unexplained: float
    looks_like: str | None
    absorbed: tuple[Absorbed, ...]
    lack: tuple[tuple[float, float], tuple[float, float]]
    warnings: tuple[str, ...]
    model: Model
    dataset: Dataset
    raw: Mapping[str, Any] = field(repr=False, default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """Return the result as it is written to JSON."""
        return {
            "verdict": self.verdict,
            "effects": [_without_none(dataclasses.asdict(e), keep=("joint", "channel")) for e in self.effects],
            "where": [dataclasses.asdict(w) for w in self.where],
            "gap": {name: dataclasses.asdict(g) for name, g in self.gap.items()},
            "would_have_seen": [dataclasses.asdict(w) for w in self.would_have_seen],
            "unexplained": {"share": self.unexplained, "looks_like": self.looks_like},
            "calibration": [dataclasses.asdict(a) for a in self.absorbed],
            "lack_of_fit": {"calibrated": _lack(self.lack[0]), "amended": _lack(self.lack[1])},
            "warnings": list(self.warnings),
            "model": "amended.toml",
        }


def _lack(lack: tuple[float, float]) -> dict[str, float | None]:
    return {"ratio": _finite(lack[0]), "z": _finite(lack[1])}


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _without_none(item: dict[str, Any], keep: Sequence[str]) -> dict[str, Any]:
    return {k: v for k, v in item.items() if v is not None or k in keep}


def find_gap(
    dataset: Dataset | str | os.PathLike[str],
    *,
    threads: int | None = None,
    progress: Callable[[str, float], None] | None = None,
) -> GapFound:
    """Find where a model and its data disagree, and which effect is missing.

    Everything is chosen and fitted on the fit trials; the gap is measured on the test trials.

    Parameters
    ----------
    dataset : Dataset or path
    threads : int, optional
        All cores when absent; the result does not depend on it.
    progress : callable, optional
        Told what is being done and how far it is, 0 to 1.

    Returns
    -------
    GapFound

    Raises
    ------
    BadInput
        For data that cannot be judged: wrong units, swapped channels, a reversed force.
    SimulationError
        When the model as given cannot be simulated on a trial.
    """
    if not isinstance(dataset, Dataset):
        dataset = load_dataset(dataset)
    led = is_led(dataset)
    settings = _settings(dataset, led, threads)
    columns = trial_columns(dataset)
    built = rig(dataset.model, all_effects(dataset.model))
    warnings = suspicion.examine(dataset, led)
    suspicion.refuse_wrong_angles(dataset)
    suspicion.refuse_mislabelled(dataset, led, _armrs.play(built, columns, settings))
    raw = _armrs.find_gap(built, columns, settings, progress)
    return _found(dataset, led, raw, warnings)


def is_led(dataset: Dataset) -> bool:
    """Whether every trial has what the closed chain is simulated from: robot angles, a robot, and forces."""
    known = all(t.robot_q is not None and t.force_on_arm is not None for t in dataset.trials)
    return known and dataset.model.robot is not None


def channel_names(dataset: Dataset, led: bool) -> list[str]:
    """Return the names of the channels that are compared."""
    n = dataset.model.n_joints
    return [*(f"q{j}_rad" for j in range(1, n + 1)), "Fy_N", "Fz_N"] if led else [f"tau{j}_Nm" for j in range(1, n + 1)]


def trial_columns(dataset: Dataset) -> list[dict[str, Any]]:
    """Return the trials for the core."""
    configurations = sorted({t.configuration for t in dataset.trials})
    return [_columns(t) | {"configuration": configurations.index(t.configuration)} for t in dataset.trials]


def _settings(dataset: Dataset, led: bool, threads: int | None) -> dict[str, Any]:
    tolerance = dataset.tolerance
    return {
        "segment_uncertainty": dataset.model.segment_uncertainty,
        "angle_offset": tolerance.angle_offset,
        "force_bias": tolerance.force_bias_N,
        "force_gain": tolerance.force_gain,
        "time_delay": tolerance.time_delay_s,
        "handle_placement": tolerance.handle_placement_m,
        "led": led,
        "threads": threads or os.cpu_count() or 1,
    }


_MISFIT = 4.0
"""Lack of fit beyond which something is left, in standard deviations."""
_NEGLIGIBLE = 0.05
"""Share of the calibrated model's lack of fit that may be left where effects were named: shapes are never exact."""


def _found(dataset: Dataset, led: bool, raw: Mapping[str, Any], warnings: Sequence[str]) -> GapFound:
    sign = -1.0 if dataset.force_on == "robot" else 1.0
    together = tuple(_missing(item, sign) for item in raw["named"])
    apart = tuple(_apart(item, dataset, raw) for item in raw["apart"])
    effects = tuple(sorted((*together, *apart), key=lambda e: -e.share))
    (before_ratio, before_z, before), (after_ratio, after_z, after) = raw["lack"]
    share = max(after, 0.0) / before if math.isfinite(before) and before > 0 else 0.0
    if after_z >= _MISFIT and not (effects and share < _NEGLIGIBLE):
        verdict = "unexplained"
    else:
        verdict = "explained" if effects else "nothing_missing"
    discrepancy = [
        _torque_gap(dataset, led, t, play["measured"], play["calibrated"]) for t, play in zip(dataset.trials, raw["trials"], strict=True)
    ]
    return GapFound(
        verdict=verdict,
        effects=effects,
        where=_where(dataset, discrepancy),
        gap=_gap(dataset, led, raw),
        would_have_seen=_limits(raw, sign),
        unexplained=min(share, 1.0) if verdict == "unexplained" or effects else 0.0,
        looks_like=None,
        absorbed=_absorbed(dataset, raw),
        lack=((before_ratio, before_z), (after_ratio, after_z)),
        warnings=tuple(warnings),
        model=_amended(dataset.model, raw["amended"]),
        dataset=dataset,
        raw=raw,
    )


def _place(kind: str, index: int) -> tuple[int | None, str | None]:
    address = catalogue()[kind].address
    return (index + 1 if address == "joint" else None, FORCE_CHANNELS[index] if address == "channel" else None)


def _in_file(kind: str, sign: float) -> float:
    """Return the sign of a sensor fault in the file: biases and drifts are of the channel as it stands there."""
    return sign if kind in ("force_bias", "force_drift") else 1.0


def _missing(item: Mapping[str, Any], sign: float) -> Missing:
    kind, index, values = item["effect"]
    joint, channel = _place(kind, index)
    known = dict(item["sd"])
    own = _in_file(kind, sign)
    parameters = {
        p.name: Value((own if p.linear else 1.0) * v, known[k] if k in known and math.isfinite(known[k]) else None, p.unit)
        for k, (p, v) in enumerate(zip(catalogue()[kind].parameters, values, strict=True))
    }
    alternatives = []
    for (entry, _), worse, likeness in item["alternatives"]:
        other_joint, other_channel = _place(entry[0], entry[1])
        why = "explains these movements as well" if worse < 2.0 else "explains these movements nearly as well"
        alternatives.append(Alternative(entry[0], other_joint, other_channel, why, float(worse), float(likeness)))
    return Missing(kind, joint, channel, parameters, item["p_value"], item["share"], tuple(alternatives))


def _apart(item: Sequence[Any], dataset: Dataset, raw: Mapping[str, Any]) -> Missing:
    """Return a rhythm, or what happened in one trial."""
    (kind, index, values), sd, trial, (start, _end), gain, rivals = item
    joint, channel = _place(kind, index)
    known = catalogue()[kind].parameters
    first = next((k for k, p in enumerate(known) if values[k] and p.name not in ("frequency", "phase", "start", "duration")), 0)
    parameters = {p.name: Value(v, sd if k == first else None, p.unit) for k, (p, v) in enumerate(zip(known, values, strict=True))}
    if trial is not None and "start" not in parameters:
        parameters["start"] = Value(start, None, "s")
    alternatives = tuple(
        Alternative(other, *_place(other, place), "swings these channels as much", float(worse), math.nan)
        for (other, place, _), worse in rivals
    )
    explained = gain + raw["calibrated"]["cost"] - raw["amended"]["cost"]
    chance = math.exp(-min(gain / 2.0, 700.0))
    return Missing(
        kind, joint, channel, parameters, chance, gain / explained, alternatives, None if trial is None else dataset.trials[trial].file
    )


def _limits(raw: Mapping[str, Any], sign: float) -> tuple[Limit, ...]:
    best: dict[tuple[str, int, int], Limit] = {}
    for (entry, free), _, _, smallest in raw["ruled"]:
        kind, index, _values = entry
        if not math.isfinite(smallest):
            continue
        parameter = catalogue()[kind].parameters[free[0]]
        joint, channel = _place(kind, index)
        limit = Limit(kind, joint, channel, parameter.name, float(smallest), parameter.unit)
        key = (kind, index, free[0])
        if key not in best or smallest < best[key].at_least:
            best[key] = limit
    return tuple(best.values())


_UNITS = {"mass": "of its value", "com": "of its value", "inertia": "of its value", "shift": "m"}


def _absorbed(dataset: Dataset, raw: Mapping[str, Any]) -> tuple[Absorbed, ...]:
    items = []
    for what, index, part, value, before, _after in raw["unknowns"]:
        if what in ("mass", "com", "inertia"):
            items.append(Absorbed(f"{what} of segment {index + 1}", value, before, _UNITS[what]))
        elif what == "shift":
            items.append(Absorbed(f"place of the robot, {'yz'[part]}", value, 2 * before, "m"))
        elif what in catalogue():
            joint, channel = _place(what, index)
            name = what.replace("_", " ") + (f" of joint {joint}" if joint else f" of {channel}" if channel else "")
            items.append(Absorbed(name, value, 2 * before, catalogue()[what].parameters[0].unit))
    return tuple(items)


def _amended(model: Model, amended: Mapping[str, Any]) -> Model:
    """Return the model with refitted segments and known effects, and the named effects added."""
    segments = tuple(
        Segment(
            s.name,
            s.length,
            s.mass * (1 + m),
            min(max(s.com * (1 + c), 0.0), s.length),
            s.inertia * (1 + i),
            com_normal=s.com_normal * (1 + c),
        )
        for s, (m, c, i) in zip(model.segments, amended["segments"], strict=True)
    )
    known = [Effect(kind, *_address(kind, index), parameters=_named(kind, values)) for kind, index, values in amended["known"]]
    joints = []
    rest = iter(known)
    for joint in model.joints:
        values = dataclasses.asdict(joint)
        if joint.stiffness:
            values["stiffness"] = next(rest).parameters["stiffness"]
        if joint.viscosity:
            values["viscosity"] = next(rest).parameters["viscosity"]
        if joint.coulomb:
            values["coulomb"] = next(rest).parameters["torque"]
        joints.append(Joint(**values))
    named = [Effect(kind, *_address(kind, index), parameters=_named(kind, values)) for kind, index, values in amended["named"]]
    return model.replace(segments=segments, joints=tuple(joints), effects=(*rest, *named))


def _address(kind: str, index: int) -> tuple[int | None, str | None]:
    return _place(kind, index)


def _named(kind: str, values: Sequence[float]) -> dict[str, float]:
    return {p.name: min(max(v, p.min), p.max) for p, v in zip(catalogue()[kind].parameters, values, strict=True)}


def _gap(dataset: Dataset, led: bool, raw: Mapping[str, Any]) -> dict[str, ChannelGap]:
    names = channel_names(dataset, led)
    tests = [k for k, t in enumerate(dataset.trials) if t.role == "test"]
    result = {}
    for c, name in enumerate(names):
        rms = {}
        for version in ("given", "calibrated", "amended"):
            rows = [_difference(dataset.trials[k], raw["trials"][k], version)[:, c] for k in tests if raw["trials"][k][version] is not None]
            rms[version] = float(np.sqrt(np.mean(np.square(np.concatenate(rows))))) if rows and sum(map(len, rows)) else None
        result[name] = ChannelGap(rms["given"], rms["calibrated"], rms["amended"], _floor(dataset, raw, c))
    return result


def _difference(trial: Trial, play: Mapping[str, Any], version: str) -> np.ndarray:
    valid = np.asarray(trial.valid, dtype=bool)
    return (play[version] - play["measured"])[valid]


def _floor(dataset: Dataset, raw: Mapping[str, Any], channel: int) -> float | None:
    """Return what repeats of one movement differ by, after their own simulated differences; None without repeats."""
    square, freedom = 0.0, 0.0
    groups = np.asarray(raw["groups"])
    for group in np.unique(groups):
        members = [k for k in np.flatnonzero(groups == group) if raw["trials"][k]["amended"] is not None]
        if len(members) < 2:
            continue
        length = min(len(dataset.trials[k]) for k in members)
        rows = np.array([(raw["trials"][k]["measured"] - raw["trials"][k]["amended"])[:length, channel] for k in members])
        valid = np.all([np.asarray(dataset.trials[k].valid, dtype=bool)[:length] for k in members], axis=0)
        deviation = (rows - rows.mean(axis=0))[:, valid]
        square += float(np.sum(deviation**2))
        freedom += deviation.shape[1] * (len(members) - 1)
    return math.sqrt(square / freedom) if freedom else None


def _torque_gap(dataset: Dataset, led: bool, trial: Trial, measured: np.ndarray, simulated: np.ndarray | None) -> np.ndarray | None:
    """Return the resisting torque that the model lacks at every sample, (n_samples, n_joints + n_joints): torque, then simulated speed."""
    if simulated is None:
        return None
    n = dataset.model.n_joints
    step = 1.0 / trial.rate
    if not led:
        speed = np.gradient(trial.q, step, axis=0) if trial.dq is None else trial.dq
        return np.hstack([measured - simulated, np.asarray(speed)])
    body = arm(dataset.model)

    def carried(channels: np.ndarray) -> np.ndarray:
        q, force = np.ascontiguousarray(channels[:, :n]), channels[:, n:]
        through = np.einsum("tij,ti->tj", np.asarray(body.jacobian(q))[:, :2, :], force)
        return through - np.asarray(body.gravity(q))

    return np.hstack([carried(measured) - carried(simulated), np.gradient(simulated[:, :n], step, axis=0)])


_MOVING = 0.1
"""Share of a joint's fastest speed in a trial below which it counts as resting."""


def _where(dataset: Dataset, discrepancy: Sequence[np.ndarray | None], most: int = 40) -> tuple[Place, ...]:
    n = dataset.model.n_joints
    places = []
    for trial, rows in zip(dataset.trials, discrepancy, strict=True):
        if rows is None or trial.role != "fit":
            continue
        valid = np.asarray(trial.valid, dtype=bool)
        for j in range(n):
            torque, speed = rows[:, j], rows[:, n + j]
            limit = _MOVING * np.max(np.abs(speed), initial=0.0)
            for condition, region in (("> 0", speed > limit), ("< 0", speed < -limit), ("= 0", np.abs(speed) <= limit)):
                chosen = np.flatnonzero(region & valid)
                if len(chosen) < 16:
                    continue
                mean = float(np.mean(torque[chosen]))
                error = _standard_error(torque[chosen])
                if error > 0 and abs(mean) > 3 * error:
                    t = trial.t[chosen]
                    places.append(
                        Place(trial.file, f"tau{j + 1}_Nm", float(t[0]), float(t[-1]), j + 1, f"dq{j + 1} {condition}", mean, mean / error)
                    )
    return tuple(sorted(places, key=lambda p: -abs(p.z))[:most])


def _standard_error(values: np.ndarray) -> float:
    """Return the standard error of a mean of correlated samples: an autoregression of first order."""
    centred = values - values.mean()
    variance = float(np.mean(centred**2))
    if variance == 0.0:
        return 0.0
    memory = min(max(float(np.mean(centred[1:] * centred[:-1])) / variance, 0.0), 0.99)
    return math.sqrt(variance / len(values) * (1 + memory) / (1 - memory))
