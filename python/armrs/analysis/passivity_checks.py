"""Whether passive moments are passive: silent muscles and slow movements (appendices B and D of the thesis)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..io.trial import Trial

WINDOW = 0.2
"""Time over which muscle activity is averaged [s]."""
RISE = 2.0
"""Activity that rises above this many times its own median is a contraction."""
SLOW = 0.1
"""Largest share of inertial torques at which a movement counts as slow."""


@dataclass(frozen=True)
class Check:
    """The verdict on one assumption.

    Attributes
    ----------
    name : str
        `muscles silent` or `slow`.
    passed : bool or None
        None where the data cannot tell.
    text : str
        One sentence that says why.
    """

    name: str
    passed: bool | None
    text: str


def muscles_silent(trials: Sequence[Trial]) -> Check:
    """Judge muscle activity that is not left out: every channel against its own median in the trial.

    A contraction as long as the whole trial cannot be seen this way: that needs the activity of a known effort to compare with.
    """
    if not any(trial.emg for trial in trials):
        return Check("muscles silent", None, "No muscle activity was recorded: the muscles are assumed to have been silent.")
    worst: tuple[float, str, str, float] = (0.0, "", "", 0.0)
    for trial in trials:
        width = max(1, round(WINDOW * trial.rate))
        for name, values in trial.emg.items():
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
    return Check("muscles silent", True, f"Silent: no muscle rises above {ratio:.3g} times its median (allowed {RISE:g}).")


def slow_enough(shares: Sequence[tuple[str, int, float]]) -> Check:
    """Judge inertial torques: configuration, joint (from 1) and root mean square relative to the passive moment."""
    if not shares:
        return Check("slow", None, "No joint moved far enough to tell.")
    configuration, joint, share = max(shares, key=lambda item: item[2])
    found = f"inertial torques are at most {100 * share:.2g} % of the passive moment"
    where = f"(joint {joint}, {configuration}; allowed {100 * SLOW:.0f} %)"
    return Check("slow", share <= SLOW, f"{'Slow enough' if share <= SLOW else 'Not slow'}: {found} {where}.")
