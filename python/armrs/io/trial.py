"""One trial: what was measured during one movement, in SI units on a uniform time grid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import checks, view_registry
from ..errors import BadInput, BadInputs, Text, not_later
from . import columns, resample
from .samples import Samples, read_samples

if TYPE_CHECKING:
    from ..model import Model

FEWEST_SAMPLES = 16
"""A trial or a channel with fewer is refused."""
BRIDGED = 0.05
"""A larger share of bridged samples is reported."""
SAME_RATE = 0.01
"""Time stamps that depart from the stated rate by more than this are reported."""
SLOWEST = 0.5
"""Samples that are as far apart [s] show no movement of an arm; a recording in milliseconds at 1 kHz has 1."""
SHORTEST, FASTEST = 0.5, 2e-4
"""A recording shorter than this [s] whose samples are nearer than this [s] is in another unit; one in seconds at 25 Hz has 4e-5 s."""
STILL = 1e-9
"""A channel that varies by no more than this is dead: noise alone is more."""
_TURN = 2.0 * np.pi
_TABLES = ("emg", "filled_columns", "original")


@dataclass(frozen=True, eq=False)
class Trial:
    """One trial.

    Arrays are read-only, float64, with time along axis 0. A sample that is missing is NaN where its gap was too long to be bridged.

    Attributes
    ----------
    file : str
        As the data set names it.
    configuration : str
        Repeats of one movement carry the same.
    repeat : int
    role : {"fit", "test"}
        Nothing is chosen or fitted on a "test" trial.
    t : ndarray, shape (n,)
        Uniform time [s], with the origin of the file.
    q : ndarray, shape (n, n_joints)
        Joint angles [rad].
    force_on_arm : ndarray, shape (n, 2), or None
        Contact force on the arm, y and z [N].
    moment_on_arm : ndarray, shape (n,), or None
        Contact moment on the arm, counter-clockwise [N m].
    robot_q : ndarray, shape (n, 2), or None
        Angles of the robot's joints [rad].
    tau : ndarray, shape (n, n_joints), or None
        Measured joint torques [N m].
    dq : ndarray, shape (n, n_joints), or None
        Measured joint speeds [rad/s].
    emg : mapping of str to ndarray, shape (n,)
        Muscle activity by column name, in the unit of the file.
    valid : ndarray of bool, shape (n,)
        False where any angle, force, torque, robot angle or coordinate of the first joint is NaN, and where muscles are active.
    active : ndarray of bool, shape (n,)
        Where muscles are active in this trial, as `armrs.io.muscle_activity` marks it.
    filled_columns : mapping of str to ndarray of bool, shape (n,)
        Which samples of a column (named in SI units) were missing and bridged. Columns without any are left out.
    gaps : tuple of (str, float, float)
        Stretches that were not bridged: column, start and end [s].
    original_t : ndarray, shape (m,)
        Time stamps of the file [s].
    original : mapping of str to ndarray, shape (m,)
        Columns before resampling, by their names in SI units, with the signs of the file; NaN where missing.
    resampled : bool
        Whether the time stamps were uneven. Otherwise `t` is `original_t`.
    activity : ndarray, shape (n, n_joints), or None
        Activity of the muscles that move each joint, 0 at rest and 1 in a maximal voluntary contraction; None where no `[[muscle]]` says
        which these are.
    base : ndarray, shape (n, 2), or None
        Measured path of the first joint, y and z [m]; None where it rests at the model's `base`.
    """

    file: str
    configuration: str
    repeat: int
    role: str
    t: np.ndarray
    q: np.ndarray
    force_on_arm: np.ndarray | None = None
    moment_on_arm: np.ndarray | None = None
    robot_q: np.ndarray | None = None
    tau: np.ndarray | None = None
    dq: np.ndarray | None = None
    emg: Mapping[str, np.ndarray] = field(default_factory=dict)
    valid: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=bool))
    active: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=bool))
    filled_columns: Mapping[str, np.ndarray] = field(default_factory=dict)
    gaps: tuple[tuple[str, float, float], ...] = ()
    original_t: np.ndarray = field(default_factory=lambda: np.empty(0))
    original: Mapping[str, np.ndarray] = field(default_factory=dict)
    resampled: bool = False
    base: np.ndarray | None = None
    activity: np.ndarray | None = None

    def __post_init__(self) -> None:
        for name in ("file", "configuration"):
            checks.instance(name, getattr(self, name), str)
        checks.whole("repeat", self.repeat, least=1)
        checks.choice("role", self.role, ("fit", "test"))
        n = len(checks.numbers("t", self.t, "s", shape=(None,)))
        if n < 2:
            raise BadInput("t", Text(f"{n} samples"), "two or more")
        joints = checks.samples("q", self.q, "rad", shape=(n, None)).shape[1]
        shapes: dict[str, tuple[int, ...]] = {
            "force_on_arm": (n, 2), "moment_on_arm": (n,), "robot_q": (n, 2), "tau": (n, joints), "dq": (n, joints),
            "base": (n, 2), "activity": (n, joints),
        }  # fmt: skip
        for name, shape in {"t": (n,), "q": (n, joints), **shapes}.items():
            if getattr(self, name) is not None:
                object.__setattr__(self, name, checks.samples(name, getattr(self, name), shape=shape))
        if self.valid.size == 0:
            measured = [a for a in (self.q, self.force_on_arm, self.moment_on_arm, self.robot_q, self.tau, self.base) if a is not None]
            rows = [np.isfinite(a).reshape(len(a), -1).all(axis=1) for a in measured]
            object.__setattr__(self, "valid", np.logical_and.reduce(rows))
        if self.active.size == 0:
            object.__setattr__(self, "active", np.zeros(n, dtype=bool))
        self._freeze()

    def _freeze(self) -> None:
        for name in _TABLES:
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))
        arrays = [value for value in vars(self).values() if isinstance(value, np.ndarray)]
        for name in _TABLES:
            arrays += getattr(self, name).values()
        for array in arrays:
            array.flags.writeable = False

    def __getstate__(self) -> dict[str, object]:
        return {**vars(self), **{name: dict(getattr(self, name)) for name in _TABLES}}

    def __setstate__(self, state: dict[str, object]) -> None:
        vars(self).update(state)
        self._freeze()

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        held = [n for n in ("force_on_arm", "moment_on_arm", "robot_q", "tau", "dq", "base") if getattr(self, n) is not None]
        size = f"{len(self)} samples at {self.rate:.6g} Hz, {self.q.shape[1]} joints"
        return f"Trial({self.file!r}, {self.configuration!r} repeat {self.repeat}, {self.role}: {size}; {', '.join(['q', *held])})"

    @property
    def dt(self) -> float:
        """Sample interval [s]."""
        return float((self.t[-1] - self.t[0]) / (len(self.t) - 1))

    @property
    def rate(self) -> float:
        """Sample rate [Hz]."""
        return 1.0 / self.dt

    @property
    def filled(self) -> np.ndarray:
        """Samples at which any column was bridged, shape (n,)."""
        return np.logical_or.reduce([np.zeros(len(self.t), dtype=bool), *self.filled_columns.values()])

    def plot(self, model: Model | None = None) -> np.ndarray:
        """Draw every channel over time where notebooks and windows show it; with a model also the arm in five instants.

        Returns
        -------
        ndarray of matplotlib Axes, shape (n,)
            `axes[0].figure` is the figure.
        """
        if model is not None and model.n_joints != self.q.shape[1]:
            raise BadInput("model", Text(f"{model.n_joints} joints"), f"{self.q.shape[1]}, as the trial has")
        axes: np.ndarray = view_registry.of(self).plot(self, model)
        return axes

    def pieces(self) -> list[slice]:
        """Return the stretches of valid samples, in order."""
        return resample.complete_pieces(self.valid)


def refuse_moving_base(trials: Sequence[Trial]) -> None:
    """Refuse a measured path of the first joint: the cascade, a fit along simulated motion and a device have it at rest."""
    for trial in trials:
        if trial.base is not None:
            found, allowed = (
                Text("a first joint that moves"),
                "none: identify (along measured motion), gap, simulate, passive and spasticity alone follow a first joint that moves",
            )
            raise BadInput("columns by, bz", found, allowed, file=trial.file)


MOVED = 5e-3
"""Movement of the first joint that is reported [m]: as much of a shoulder in a strapped trunk is skin."""


def moving_bases(trials: Sequence[Trial]) -> list[str]:
    """Return the trials in which the first joint moves noticeably, a line each."""
    lines = []
    for trial in trials:
        if trial.base is not None:
            moved = float(np.linalg.norm(np.ptp(trial.base[np.isfinite(trial.base).all(axis=1)], axis=0)))
            if moved > MOVED:
                lines.append(
                    f"{trial.file}: the first joint, and so the trunk, moves by {1e3 * moved:.2g} mm; its path is taken into account"
                )
    return lines


@dataclass(frozen=True)
class Reading:
    """A trial as read, with remarks of the reader."""

    trial: Trial
    warnings: tuple[str, ...]


def read_trial(
    path: Path,
    *,
    n_joints: int,
    force_on: str | None,
    sample_rate: float | None,
    file: str,
    configuration: str,
    repeat: int,
    role: str,
    loads: bool = True,
) -> Reading | None:
    """Read one trial and bring it to SI units, to forces on the arm and to a uniform grid.

    Parameters
    ----------
    path : Path
    n_joints : int
        Of the model.
    force_on : {"robot", "arm"} or None
        What the forces of the file act on.
    sample_rate : float or None
        Rate that the data set states [Hz].
    file, configuration, repeat, role
        Handed on to the trial.
    loads : bool
        Whether forces or torques must be there.

    Returns
    -------
    Reading, or None when the header is right but not a single sample follows.

    Raises
    ------
    BadInput
        Without the file's name in it; the caller adds it.
    """
    samples = read_samples(path)
    header = columns.parse(samples.names, n_joints, loads=loads)
    has_force = any(column.symbol == "Fy" for column in header)
    if has_force and force_on is None:
        raise BadInput("column Fy", Text("forces in a data set without force_on"), 'force_on = "robot" or "arm" in dataset.toml')
    if samples.n_rows == 0:
        return None
    if samples.n_rows < FEWEST_SAMPLES:
        raise BadInput("file", Text(f"{samples.n_rows} samples"), f"at least {FEWEST_SAMPLES} samples")
    warnings: list[str] = []
    original = _in_si(header, samples, warnings)
    t = original.pop("t_s")

    grid, resampled = _grid(t, sample_rate, warnings)
    channels = {name: resample.onto_grid(t, values, grid) for name, values in original.items()}
    gaps = tuple((name, *gap) for name, channel in channels.items() for gap in channel.gaps)
    warnings += _gap_lines(gaps) + _bridged_lines(channels)
    on_grid = {name: channel.values for name, channel in channels.items()}
    sign = 1.0 if force_on == "arm" else -1.0
    trial = Trial(
        file=file,
        configuration=configuration,
        repeat=repeat,
        role=role,
        t=grid,
        q=_together(on_grid, [f"q{j}_rad" for j in range(1, n_joints + 1)]),
        force_on_arm=sign * _together(on_grid, ["Fy_N", "Fz_N"]) if has_force else None,
        moment_on_arm=sign * on_grid["Mx_Nm"] if "Mx_Nm" in on_grid else None,
        robot_q=_together(on_grid, ["qr1_rad", "qr2_rad"]) if "qr1_rad" in on_grid else None,
        tau=_together(on_grid, [f"tau{j}_Nm" for j in range(1, n_joints + 1)]) if "tau1_Nm" in on_grid else None,
        dq=_together(on_grid, [f"dq{j}_rad_s" for j in range(1, n_joints + 1)]) if "dq1_rad_s" in on_grid else None,
        base=_together(on_grid, ["by_m", "bz_m"]) if "by_m" in on_grid else None,
        emg={name: values for name, values in on_grid.items() if name.startswith("emg_")},
        filled_columns={name: c.bridged for name, c in channels.items() if c.bridged.any()},
        gaps=gaps,
        original_t=t,
        original=original,
        resampled=resampled,
    )
    if not trial.valid.any():
        raise BadInput("file", Text("no time at which all columns have a sample"), "at least one stretch of complete samples")
    return Reading(trial, tuple(warnings))


def _in_si(header: Sequence[columns.Column], samples: Samples, warnings: list[str]) -> dict[str, np.ndarray]:
    """Return the columns in SI units by name, angles without jumps by whole turns; what was done to them is added to the warnings.

    Raises
    ------
    BadInput
        With every column that is wrong.
    """
    original: dict[str, np.ndarray] = {}
    problems: list[BadInput] = []
    for column, raw in zip(header, samples.values, strict=True):
        values = raw if column.factor == 1.0 else raw * column.factor
        try:
            _check_size(column, values, samples)
            if column.symbol == "t":
                _check_time(values, samples)
        except BadInput as error:
            problems.append(error)
            continue
        if column.quantity is columns.ANGLE:
            values = _unwrapped(column, values, warnings)
        original[column.si_name] = values
    if problems:
        raise BadInputs.of(problems)
    return original


def _together(channels: Mapping[str, np.ndarray], names: list[str]) -> np.ndarray:
    return np.column_stack([channels[name] for name in names])


def _check_size(column: columns.Column, values: np.ndarray, samples: Samples) -> None:
    there = np.isfinite(values)
    count = int(there.sum())
    if count == 0:
        raise BadInput(f"column {column.name}", Text("no sample at all"), "samples, or no such column")
    if column.symbol != "t" and count < FEWEST_SAMPLES:
        raise BadInput(f"column {column.name}", Text(f"{count} samples"), f"at least {FEWEST_SAMPLES} samples")
    large = np.flatnonzero(np.abs(np.where(there, values, 0.0)) > column.quantity.most)
    if large.size:
        row = int(large[0])
        most = column.quantity.most / column.factor
        raise BadInput(
            f"{samples.place_of(row)}, column {column.name}",
            float(values[row] / column.factor),
            f"{-most:g} to {most:g}" + (f" {column.name.partition('_')[2]}" if column.quantity is not columns.ACTIVITY else ""),
            hint=column.quantity.hint
            if column.factor == 1.0
            else f"{column.si_name.partition('_')[2]} labelled as {column.name.partition('_')[2]}?",
        )


def _check_time(t: np.ndarray, samples: Samples) -> None:
    empty = np.flatnonzero(np.isnan(t))
    if empty.size:
        raise BadInput(f"{samples.place_of(int(empty[0]))}, time", Text("an empty cell"), "a time stamp in every row")
    back = np.flatnonzero(np.diff(t) <= 0.0)
    if back.size:
        row = int(back[0])
        raise not_later(f"{samples.place_of(row + 1)}, time", t[row], t[row + 1])
    step = resample.usual_step(t)
    if step >= SLOWEST:
        raise BadInput("time", Text(f"{step:g} s between samples"), f"less than {SLOWEST:g} s", hint=columns.TIME.hint)
    if t[-1] - t[0] < SHORTEST and step < FASTEST:
        found, allowed = Text(f"{len(t)} samples in {t[-1] - t[0]:.3g} s"), f"{SHORTEST:g} s or more, or {FASTEST:g} s between samples"
        raise BadInput("time", found, allowed, hint="seconds labelled as milliseconds?")
    if t[-1] - t[0] > 10.0 * step * len(t):
        row = int(np.argmax(np.diff(t)))
        found = Text(f"{t[row + 1]:.9g} s after {t[row]:.9g} s")
        raise BadInput(f"{samples.place_of(row + 1)}, time", found, "a recording of which at least a tenth is there")


def _grid(t: np.ndarray, sample_rate: float | None, warnings: list[str]) -> tuple[np.ndarray, bool]:
    """Return the uniform grid, and whether the samples have to be brought onto it."""
    rate = 1.0 / resample.usual_step(t)
    if sample_rate is not None and abs(rate / sample_rate - 1.0) > SAME_RATE:
        if not 1 / 900 < rate / sample_rate < 900:
            raise BadInput("time", Text(f"{rate:g} samples a second"), f"about sample_rate = {sample_rate:g} Hz", hint="milliseconds?")
        warnings.append(f"time stamps give {rate:.6g} Hz, sample_rate says {sample_rate:g} Hz: the time stamps are used")
        sample_rate = None
    if resample.is_even(t):
        return t, False
    return resample.uniform_grid(t, sample_rate), True


def _unwrapped(column: columns.Column, values: np.ndarray, warnings: list[str]) -> np.ndarray:
    """Undo jumps of whole turns between neighbouring samples."""
    there = np.flatnonzero(np.isfinite(values))
    steps = np.diff(values[there])
    turns = np.round(steps / _TURN)
    turns[np.abs(steps - _TURN * turns) > 0.1 * _TURN] = 0.0
    if not turns.any():
        return values
    count = int(np.count_nonzero(turns))
    warnings.append(f"column {column.name} jumps by whole turns {f'{count} times' if count > 1 else 'once'}: they were taken out")
    result = values.copy()
    result[there[1:]] -= _TURN * np.cumsum(turns)
    return result


def _gap_lines(gaps: tuple[tuple[str, float, float], ...]) -> list[str]:
    """Return one line for all columns with the same gaps, however many these are."""
    said = {}
    for name in dict.fromkeys(gap[0] for gap in gaps):
        own = [(start, end) for column, start, end in gaps if column == name]
        first = f"{own[0][0]:g} to {own[0][1]:g} s"
        more = f" and {len(own) - 1} more" if len(own) > 1 else ""
        said[name] = f"no samples from {first}{more}: left out"
    return _lines(said)


def _bridged_lines(channels: Mapping[str, resample.Channel]) -> list[str]:
    """Return one line for all columns of which the same good part was bridged."""
    shares = {name: float(np.mean(c.bridged)) for name, c in channels.items() if not name.startswith("emg_")}
    return _lines(
        {
            name: f"{share:.0%} of the samples were missing and are bridged; they count as measured, so that intervals are too narrow"
            for name, share in shares.items()
            if share > BRIDGED
        }
    )


def _lines(said: Mapping[str, str]) -> list[str]:
    """Return remarks on columns, those with the same remark together: a sensor that drops out is one fact."""
    names: dict[str, list[str]] = {}
    for name, text in said.items():
        names.setdefault(text, []).append(name)
    return [f"column{'s' * (len(own) > 1)} {', '.join(own)}: {text}" for text, own in names.items()]


def constant(values: np.ndarray) -> float | None:
    """Return the value that a channel has throughout, or None for one that varies."""
    there = values[np.isfinite(values)]
    return float(there[0]) if len(there) and np.ptp(there) <= STILL else None


def still_angles(trials: tuple[Trial, ...]) -> list[str]:
    """Return the joints whose angle is the same in every sample of every trial, a line each: held, or not measured."""
    lines = []
    for j in range(trials[0].q.shape[1] if trials else 0):
        levels = [constant(trial.q[:, j]) for trial in trials]
        if all(level is not None and level == levels[0] for level in levels):
            lines.append(f"q{j + 1} is {levels[0]:g} rad in every sample of every trial: a joint that is held, or a dead sensor?")
    return lines


def bridged(trial: Trial) -> Trial:
    """Return a trial for the core, which reads no NaN: gaps are bridged by straight lines, and masked by `valid`."""

    def whole(values: np.ndarray | None) -> np.ndarray | None:
        if values is None or np.isfinite(values).all():
            return values
        table = np.array(values, dtype=float).reshape(len(trial), -1)
        for column in table.T:
            bad = ~np.isfinite(column)
            if bad.any():
                column[bad] = np.interp(trial.t[bad], trial.t[~bad], column[~bad])
        return table.reshape(values.shape)

    channels = ("q", "dq", "force_on_arm", "moment_on_arm", "tau", "robot_q", "base", "activity")
    filled: dict[str, Any] = {name: whole(getattr(trial, name)) for name in channels}
    return replace(trial, **filled)
