"""The log of a device: its samples as recorded, without resampling, interpolation or unwrapping."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .. import _armrs, checks
from ..errors import BadInput, Text, not_later
from ..io import columns
from ..io.resample import usual_step
from ..io.samples import read_samples
from ..model import Model

FARTHEST = 0.25
"""Part of a control period by which a time stamp may be off its place."""
SPARSEST = 10.0
"""Control periods for each sample of a log, at most."""


@dataclass(frozen=True, eq=False)
class Log:
    """What a device measured, a row a sample. NaN is a value that was none; a row without any number is a sample that is missing.

    Arrays are read-only. `Log(**numpy.load("log.npz"))` reads an archive whose arrays have these names.

    Attributes
    ----------
    t : ndarray, shape (n,)
        Increasing time stamps [s].
    q : ndarray, shape (n, n_joints)
        Joint angles [rad].
    force_on_arm : ndarray, shape (n, 2)
        Force on the arm at its tip, y and z [N]; zero when absent.
    moment_on_arm : ndarray, shape (n,)
        Moment there [N m]; zero when absent.
    tau : ndarray, shape (n, n_joints)
        Torques of motors in the joints [N m]; zero when absent.
    lead : ndarray, shape (n, n_joints), or None
        Angles from which speeds are taken, where better ones than `q` are known [rad].

    Raises
    ------
    BadInput
        For shapes that do not fit, neither forces nor torques, fewer than two samples, and time stamps that do not increase.
    """

    t: np.ndarray
    q: np.ndarray
    force_on_arm: np.ndarray | None = None
    moment_on_arm: np.ndarray | None = None
    tau: np.ndarray | None = None
    lead: np.ndarray | None = None

    def __post_init__(self) -> None:
        t = checks.numbers("t", self.t, "s", shape=(None,))
        n = len(t)
        if n < 2:
            raise BadInput("t", Text(f"{n} samples"), "two or more")
        back = np.flatnonzero(np.diff(t) <= 0.0)
        if back.size:
            k = int(back[0]) + 1
            raise not_later(f"t[{k}]", t[k - 1], t[k])
        joints = checks.samples("q", self.q, "rad", shape=(n, None)).shape[1]
        if self.force_on_arm is None and self.tau is None:
            raise BadInput("force_on_arm", Text("neither forces nor torques"), "force_on_arm, or tau, or both")
        shapes = {"t": (n,), "q": (n, joints), "force_on_arm": (n, 2), "moment_on_arm": (n,), "tau": (n, joints), "lead": (n, joints)}
        for name, shape in shapes.items():
            if getattr(self, name) is not None:
                array = checks.samples(name, getattr(self, name), shape=shape).copy()
                array.flags.writeable = False
                object.__setattr__(self, name, array)

    def __repr__(self) -> str:
        return f"Log({len(self.t)} samples of {self.q.shape[1]} joints in {self.t[-1] - self.t[0]:.6g} s)"

    @property
    def period(self) -> float:
        """Usual time between two samples [s], to a nanosecond: the rest is rounding of the time stamps."""
        return round(usual_step(self.t), 9)

    @property
    def hand(self) -> np.ndarray:
        """Force in y and z and moment on the arm, shape (n, 3); zero where they were not measured."""
        n = len(self.t)
        force = np.zeros((n, 2)) if self.force_on_arm is None else self.force_on_arm
        return np.column_stack([force, np.zeros(n) if self.moment_on_arm is None else self.moment_on_arm])

    @property
    def torque(self) -> np.ndarray:
        """Torques of motors, shape (n, n_joints); zero where they were not measured."""
        return np.zeros(self.q.shape) if self.tau is None else self.tau

    @property
    def empty(self) -> np.ndarray:
        """Rows without any number, shape (n,)."""
        measured = [a for a in (self.q, self.force_on_arm, self.moment_on_arm, self.tau) if a is not None]
        return np.logical_and.reduce([np.isnan(a).reshape(len(a), -1).all(axis=1) for a in measured])

    def calibrated(self, model: Model) -> Log:
        """Return the log without constant errors of the sensors that a model has: offsets of angles; bias, gain and misalignment of forces.

        A delay of the force stays: `armrs_model_calibrate` takes none out either.
        """
        told = _armrs.firmware(_armrs.Rig(model), model.segment_uncertainty, [])
        q = self.q - np.array(told["angle_offset"])
        if self.force_on_arm is None and self.moment_on_arm is None:
            return replace(self, q=q)
        offset, gains = np.array(told["force_offset"]), np.array(told["force"])
        if not offset.any() and np.array_equal(gains, np.eye(len(gains))):
            return replace(self, q=q)
        # A sample that is not finite stays one: the estimator refuses it.
        with np.errstate(invalid="ignore"):
            hand = (self.hand - offset) @ np.linalg.inv(gains).T
        return replace(self, q=q, force_on_arm=hand[:, :2], moment_on_arm=None if self.moment_on_arm is None else hand[:, 2])

    def places(self, period: float) -> np.ndarray:
        """Return the control period of each sample, shape (n,), counted from the first.

        Raises
        ------
        BadInput
            When the samples do not come at this period, or less than a tenth of the periods have one.
        """
        if not 1.0 / (1.0 + FARTHEST) < self.period / period < 1.0 + FARTHEST:
            raise BadInput("t", Text(f"{self.period:.6g} s between samples"), f"about the control period of the settings, {period:.6g} s")
        if self.t[-1] - self.t[0] > SPARSEST * period * len(self.t):
            raise BadInput(
                "t", Text(f"{len(self.t)} samples in {self.t[-1] - self.t[0]:.6g} s"), "a log of which at least a tenth is there"
            )
        # Against the sample before: a clock that is a little fast or slow does not add up to a sample that is lost.
        steps = np.maximum(np.rint(np.diff(self.t) / period), 1.0)
        return np.concatenate([[0], np.cumsum(steps)]).astype(np.int64)


def load_log(path: str | os.PathLike[str], n_joints: int, *, force_on: str | None = None) -> Log:
    """Read the log of a device: CSV or Parquet with the columns of a trial, in any of their units.

    Nothing is bridged, resampled or unwrapped; an empty cell is NaN.

    Parameters
    ----------
    path : path
    n_joints : int
        2 or 3.
    force_on : {"arm", "robot"}, optional
        What the forces of the file act on; needed where it has any.

    Raises
    ------
    BadInput
        With file, place, what was found and what is allowed.
    """
    source = checks.path("path", path)
    n_joints = checks.whole("n_joints", n_joints, least=2, most=3)
    try:
        return _read(source, n_joints, force_on)
    except BadInput as error:
        raise error.within(file=source) from None


def _read(source: Path, n_joints: int, force_on: str | None) -> Log:
    samples = read_samples(source)
    header = columns.parse(samples.names, n_joints)
    if samples.n_rows < 2:
        raise BadInput("file", Text(f"{samples.n_rows} samples"), "two or more")
    found = {c.symbol: values * c.factor for c, values in zip(header, samples.values, strict=True)}
    if "by" in found:
        raise BadInput("columns by, bz", Text("a first joint that moves"), "none: a device has its first joint at rest")
    has_force = "Fy" in found
    if has_force and force_on is None:
        raise BadInput("force_on", Text("nothing, beside forces"), '"arm" or "robot": what the forces act on')
    sign = 1.0
    if has_force:
        sign = 1.0 if checks.choice("force_on", force_on, ("arm", "robot")) == "arm" else -1.0
    empty = np.flatnonzero(np.isnan(found["t"]))
    if empty.size:
        raise BadInput(f"{samples.place_of(int(empty[0]))}, time", Text("an empty cell"), "a time stamp in every row")
    back = np.flatnonzero(np.diff(found["t"]) <= 0.0)
    if back.size:
        before, after = (float(found["t"][back[0] + k]) for k in (0, 1))
        raise not_later(f"{samples.place_of(int(back[0]) + 1)}, time", before, after)
    joints = range(1, n_joints + 1)
    return Log(
        t=found["t"],
        q=np.column_stack([found[f"q{j}"] for j in joints]),
        force_on_arm=sign * np.column_stack([found["Fy"], found["Fz"]]) if has_force else None,
        moment_on_arm=sign * found["Mx"] if "Mx" in found else None,
        tau=np.column_stack([found[f"tau{j}"] for j in joints]) if "tau1" in found else None,
    )
