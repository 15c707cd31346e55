"""Whether passive moments are passive: silent muscles and slow movements (appendices B and D of the thesis)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from .. import _armrs
from ..errors import BadInput, Text
from ..io.dataset import Dataset
from ..io.muscle_activity import is_constant
from ..io.trial import Trial
from .passive_curve import PassiveCurve

WINDOW = 0.2
"""Time over which muscle activity is averaged [s]."""
RISE = 2.0
"""Activity that rises above this many times its own median is a contraction."""
SLOW = 0.1
"""Largest share of inertial torques at which a movement counts as slow."""
NOT_SLOW = "not slow for joint"
"""Words of the warning that a joint did not move slowly."""
CLEAR = 3.0
"""A half width is clearly below zero when it is so many half widths of its 95 % interval: chance does that in one of a thousand joints
without friction at four repeats."""
_ABSURD = 3.0
"""Joint moments are at most this many times what measured forces exert and the arm weighs: inertia is what an arm that is led adds."""


@dataclass(frozen=True)
class Check:
    """The verdict on one assumption.

    Attributes
    ----------
    name : str
        `muscles silent` or `slow`.
    passed : bool or None
        None where the data do not show it.
    text : str
        The reason, in one sentence.
    """

    name: str
    passed: bool | None
    text: str


def muscles_silent(trials: Sequence[Trial]) -> Check:
    """Check muscle activity that is not left out: every channel against its own median in the trial.

    A contraction as long as the whole trial cannot be seen this way: that needs the activity of a known effort to compare with.
    """
    if not any(trial.emg for trial in trials):
        return Check("muscles silent", None, "No muscle activity was recorded: the muscles are assumed inactive.")
    worst: tuple[float, str, str, float] = (0.0, "", "", 0.0)
    constant: set[str] = set()
    for trial in trials:
        width = max(1, round(WINDOW * trial.rate))
        for name, values in trial.emg.items():
            if is_constant(values):
                constant.add(name)
            judged = np.isfinite(values) & ~trial.active
            size = np.abs(values[judged])
            if len(size) < 2 * width:
                continue
            mean = np.convolve(size, np.full(width, 1.0 / width), mode="valid")
            middle = float(np.median(mean))
            at = int(np.argmax(mean))
            ratio = float(mean[at]) / middle if middle > 0.0 else (np.inf if mean[at] > 0.0 else 0.0)
            if ratio > worst[0]:
                worst = (ratio, name, trial.file, float(trial.t[judged][at + width // 2]))
    ratio, name, file, at_s = worst
    if ratio > RISE:
        return Check(
            "muscles silent",
            False,
            f"Not silent: {name} rises to {ratio:.3g} times its median at {at_s:.3g} s of {file} (allowed {RISE:g}).",
        )
    if constant:
        names = ", ".join(sorted(constant))
        return Check("muscles silent", None, f"Constant in a trial, so not recorded: {names}. Whether the muscles were silent is unknown.")
    return Check("muscles silent", True, f"Silent: no muscle rises above {ratio:.3g} times its median (allowed {RISE:g}).")


def slow_enough(curves: Sequence[PassiveCurve], cutoff: float) -> Check:
    """Check inertial torques relative to the passive moment, and the bandwidth of movements against the low-pass [Hz]."""
    if not curves:
        return Check("slow", None, "No joint moved far enough to check this.")
    wide = [c for c in curves if c.bandwidth >= cutoff]
    if wide:
        worst = max(wide, key=lambda c: c.bandwidth)
        found = f"the bandwidth of a movement is {worst.bandwidth:.2g} Hz, and the low-pass is at {cutoff:g} Hz"
        return Check("slow", False, f"Not slow: {found} (joint {worst.joint}, {worst.configuration}).")
    most = max(curves, key=lambda c: c.inertial_share)
    found = f"inertial torques are at most {100 * most.inertial_share:.2g} % of the passive moment"
    where = f"(joint {most.joint}, {most.configuration}; allowed {100 * SLOW:.0f} %)"
    slow = most.inertial_share <= SLOW
    return Check("slow", slow, f"{'Slow enough' if slow else 'Not slow'}: {found} {where}.")


def not_slow(curves: Sequence[PassiveCurve], cutoff: float) -> list[str]:
    """Return the joints that did not move slowly, a line each; takes what `slow_enough` takes."""
    lines = []
    for c in curves:
        why = []
        if c.inertial_share > SLOW:
            why.append(f"inertial torques are {100 * c.inertial_share:.0f} % of the passive moment, more than {100 * SLOW:.0f} %")
        if c.bandwidth >= cutoff:
            why.append(f"the bandwidth of the movement is {c.bandwidth:.2g} Hz, and the low-pass is at {cutoff:g} Hz")
        if why:
            lines.append(f"{c.configuration}: {NOT_SLOW} {c.joint}: {', and '.join(why)}")
    return lines


def gives_energy(half_widths: Sequence[tuple[str, int, tuple[float, float]]]) -> list[str]:
    """Return in one line the joints whose hysteresis gives energy, none where there are none.

    Takes configuration, joint (from 1) and the interval of the half width of the hysteresis [N m], NaN where nothing was repeated.
    """
    wrong = [f"joint {joint} ({name})" for name, joint, (low, high) in half_widths if low + high < -CLEAR * (high - low)]
    if not wrong:
        return []
    joints = ", ".join(wrong)
    return [
        f"half width of the hysteresis below zero: {joints}: a relaxed joint cannot generate energy. Are angles or forces in another unit "
        "or direction, or delayed against each other, or were muscles active?"
    ]


def refuse_absurd(dataset: Dataset, moments: Iterable[tuple[Trial, np.ndarray]]) -> None:
    """Refuse moments that what was measured cannot exert: motion is then not that of the arm, or a unit is wrong.

    Parameters
    ----------
    dataset : Dataset
    moments : iterable of (Trial, ndarray)
        With which joints resist in each trial, NaN where nothing was measured [N m].

    Raises
    ------
    BadInput
        Names the trial, the moment and what the arm can resist with.
    """
    for trial, moment in moments:
        model = dataset.model_of(trial.configuration)
        able = model.gravity * float(np.sum(np.abs(_armrs.Arm.from_model(model).first_moments)))
        for measured, arm in ((trial.force_on_arm, sum(s.length for s in model.segments)), (trial.moment_on_arm, 1.0), (trial.tau, 1.0)):
            if measured is not None and np.isfinite(measured).any():
                able += arm * np.sqrt(2.0) * float(np.nanmax(np.abs(measured)))
        most = float(np.max(np.abs(moment[np.isfinite(moment)]), initial=0.0))
        if most > _ABSURD * able:
            allowed = f"at most {_ABSURD * able:.3g} N m, {_ABSURD:g} times what force and weight exert"
            found = Text(f"a joint moment of {most:.3g} N m")
            raise BadInput("angles and forces", found, allowed, file=trial.file, hint="jumps of the angles, or a wrong unit?")
