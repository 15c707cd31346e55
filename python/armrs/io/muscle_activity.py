"""Muscle activity from EMG: samples at which a muscle is active are marked, because the arm is not passive there.

The envelope of each channel is its rectified deviation from its mean, averaged over a tenth of a second. Its resting level is the median of
the session, its scatter the median absolute deviation. What exceeds the level by eight deviations is activity. Torque begins later than
activity and outlasts it, so the marks are widened.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Sequence

import numpy as np

from .. import checks
from ..errors import BadInput, Text
from ..model import Muscle
from .files import first_of
from .trial import Trial

SMOOTHED = 0.1
"""Time over which the rectified signal is averaged [s]."""
DEVIATIONS = 8.0
"""Of the resting scatter that a sample must exceed: white noise does not in 10⁶ samples (a test counts), resting tone has longer tails."""
BEFORE, AFTER = 0.05, 0.3
"""By how much marks are widened [s]: torque follows activity by 30 to 100 ms (Cavanagh and Komi 1979) and decays in about as long again."""
MOST = 0.5
"""Share of a session beyond which activity is no exception: the median is then no resting level."""
ONSET_SMOOTHED, ONSET_HELD, LEAST_REST = 0.01, 0.025, 0.05
"""Time over which the rectified signal is averaged for an onset, for which it must last, and of rest before it [s]."""
ONSET_DEVIATIONS = 3.0
"""Of rest that an onset must exceed."""
ONSET_BEFORE = 0.15
"""How long before that an onset is looked for [s]: the averages and a gradual rise delay the alarm by less."""
_RISES = 24
"""Slopes of a gradual onset that are compared."""
_CLIPPED = 20
"""Samples at one and the same extreme from which on a channel may be saturated."""
_NEAR, _OFTEN = 0.02, 3.0
"""Part of the range of a channel that is next to its extreme, and how much oftener a saturated channel is at it than next to it."""
_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""


def mark_activity(trials: Sequence[Trial]) -> tuple[tuple[Trial, ...], list[str]]:
    """Mark the samples of a session at which any muscle is active.

    Parameters
    ----------
    trials : sequence of Trial
        Of one session, whose channels have one gain.

    Returns
    -------
    trials : tuple of Trial
        With `active` set, and `valid` False there.
    lines : list of str
        Remarks on the data.
    """
    names = sorted({name for trial in trials for name in trial.emg})
    active = [np.zeros(len(trial), dtype=bool) for trial in trials]
    lines = []
    for name in names:
        envelopes = [_envelope(trial, name) for trial in trials]
        together = np.concatenate([e[np.isfinite(e)] for e in envelopes])
        if together.size == 0 or np.ptp(together) == 0.0:
            continue
        _, threshold = _resting(together)
        marks = [_widened(np.nan_to_num(e, nan=0.0) > threshold, trial.dt) for e, trial in zip(envelopes, trials, strict=True)]
        share = float(np.mean(np.concatenate(marks)))
        if share > MOST:
            lines.append(f"{name}: active in {share:.0%} of the session, so its resting level is not known; nothing is marked by it")
            continue
        for own, mark in zip(active, marks, strict=True):
            own |= mark
    return _applied(trials, active, lines)


def channel_faults(trials: Sequence[Trial]) -> list[str]:
    """Return the channels that are constant in a trial, and those that are cut off at an extreme, a line each with the files.

    Samples count as read: between time stamps of a grid, interpolation blurs both.

    Parameters
    ----------
    trials : sequence of Trial
        Of one session, whose channels have one gain.
    """
    lines = []
    for name in dict.fromkeys(name for trial in trials for name in trial.emg):
        read = [(trial.file, trial.original.get(name, trial.emg[name])) for trial in trials if name in trial.emg]
        there = [(file, values[np.isfinite(values)]) for file, values in read]
        dead = [file for file, values in there if is_constant(values)]
        if dead:
            lines.append(f"{first_of(dead)}: {name} is constant: a dead channel?")
        lines += _clipped(name, [(file, values) for file, values in there if file not in dead])
    return lines


def is_constant(values: np.ndarray) -> bool:
    """Whether a channel was measured and has one value throughout: a dead sensor, and no silent muscle."""
    there = values[np.isfinite(values)]
    return bool(there.size and np.ptp(there) == 0.0)


def _clipped(name: str, columns: Sequence[tuple[str, np.ndarray]]) -> list[str]:
    """Return the line on a channel that is at an extreme of the session in many samples, and hardly ever next to it."""
    levels, counts = np.unique(np.concatenate([np.empty(0), *(values for _, values in columns)]), return_counts=True)
    if len(levels) < 3:  # a switch, not a signal
        return []
    # Rectified signals rest at zero.
    ends = (-1,) if levels[0] >= 0.0 else (-1, 0)
    close = _NEAR * (levels[-1] - levels[0])
    clipped = []
    for end in ends:
        near = np.abs(levels - levels[end]) <= close
        # The next level counts as well: steps of a converter may be wider.
        beside = max(int(counts[near].sum() - counts[end]), int(counts[1 if end == 0 else -2]))
        if counts[end] >= max(_CLIPPED, _OFTEN * beside):
            clipped.append(float(levels[end]))
    if not clipped:
        return []
    shares = [(file, int(np.isin(values, clipped).sum())) for file, values in columns]
    where, total = first_of([file for file, n in shares if n]), sum(n for _, n in shares)
    return [f"{where}: {name} stays at {' or '.join(f'{level:g}' for level in clipped)}, its extreme, in {total} samples: saturated?"]


def _applied(trials: Sequence[Trial], active: list[np.ndarray], lines: list[str]) -> tuple[tuple[Trial, ...], list[str]]:
    marked, seconds = [], {}
    for trial, own in zip(trials, active, strict=True):
        own = own & trial.valid
        valid = trial.valid & ~own
        throughout = own.any() and not valid.any()
        if throughout:
            lines.append(f"{trial.file}: muscles are active throughout; this is no passive recording")
        elif own.any():
            seconds[trial.file] = float(own.sum()) * trial.dt
        # A trial that is active throughout is compared as a whole; the line above states that.
        marked.append(dataclasses.replace(trial, active=own, valid=trial.valid if throughout else valid))
    return tuple(marked), lines + _activity_line(seconds)


def _activity_line(seconds: dict[str, float]) -> list[str]:
    """Return one line on the trials, and for how long [s], muscles are active."""
    if not seconds:
        return []
    first, *others = seconds
    least, most = (f"{end:.2g}" for end in (min(seconds.values()), max(seconds.values())))
    where = f"{first}{f' and {len(others)} more trials' if len(others) > 1 else f' and {others[0]}' if others else ''}"
    long = f"{least} s" if least == most else f"{least} to {most} s"
    return [f"{where}: muscles are active for {long}; analyses of a passive arm leave these samples out"]


def joint_activity(trials: Sequence[Trial], muscles: Sequence[Muscle], n_joints: int) -> tuple[tuple[Trial, ...], list[str]]:
    """Return the activity of the muscles of each joint: their mean, 0 at rest and 1 in a maximal voluntary contraction.

    That of a muscle is its envelope above rest, relative to that of the contraction, as late as torque follows it. Rest is the median of
    the session and the contraction its largest envelope, where the muscle does not state them.

    Parameters
    ----------
    trials : sequence of Trial
        Of one session, whose channels have one gain.
    muscles : sequence of Muscle
    n_joints : int

    Returns
    -------
    trials : tuple of Trial
        With `activity` set, where there is a muscle.
    lines : list of str
        Remarks on the data.

    Raises
    ------
    BadInput
        For a joint that the arm does not have, and a channel that a trial does not have.
    """
    if not muscles:
        return tuple(trials), []
    sums, counts, lines = [np.zeros((len(trial), n_joints)) for trial in trials], np.zeros(n_joints), []
    for number, muscle in enumerate(muscles, start=1):
        joint = checks.whole(f"[[muscle]] {number}, joint", muscle.joint, least=1, most=n_joints) - 1
        counts[joint] += 1
        for trial in trials:
            if muscle.channel not in trial.emg:
                found = Text(f"no such column in {trial.file}")
                raise BadInput(f"[[muscle]] {number}, channel", found, f"a column of every trial: {', '.join(trial.emg) or 'none'}")
        for own, relative in zip(sums, _relative(trials, muscle), strict=True):
            own[:, joint] += relative
        if muscle.mvc is None:
            lines.append(
                f"{muscle.channel}: no mvc is stated, so its activity is relative to the largest of this session, and what depends on "
                "it is not comparable with other sessions"
            )
    told = [dataclasses.replace(t, activity=own / np.maximum(counts, 1.0)) for t, own in zip(trials, sums, strict=True)]
    return tuple(told), lines


def _relative(trials: Sequence[Trial], muscle: Muscle) -> list[np.ndarray]:
    """Return the activity of one muscle in each trial, 0 at rest and 1 in a maximal contraction."""
    envelopes = [_envelope(trial, muscle.channel) for trial in trials]
    rest, most = _levels(envelopes, muscle)
    late = [np.interp(t.t - muscle.delay_s, t.t, np.nan_to_num(e, nan=rest)) for t, e in zip(trials, envelopes, strict=True)]
    return [np.maximum(e - rest, 0.0) / max(most - rest, 1e-300) for e in late]


def _levels(envelopes: Sequence[np.ndarray], muscle: Muscle | None) -> tuple[float, float]:
    """Return the envelope of a channel at rest and in a maximal contraction: as stated, else by the session."""
    together = np.concatenate(envelopes)
    there = together[np.isfinite(together)]
    stated = (None, None) if muscle is None else (muscle.rest, muscle.mvc)
    rest = float(np.median(there)) if stated[0] is None else stated[0]
    return rest, float(there.max()) if stated[1] is None else stated[1]


def active_kept(trials: Sequence[Trial]) -> tuple[Trial, ...]:
    """Return trials in which what is active counts as well: for a model with effects of muscles."""
    return tuple(dataclasses.replace(trial, valid=trial.valid | trial.active) for trial in trials)


def comparable(trials: Sequence[Trial]) -> tuple[Trial, ...]:
    """Return trials in which what is active in one repeat of a movement is left out of all: `gap` compares repeats sample by sample."""
    shared = []
    for trial in trials:
        active = np.zeros(len(trial), dtype=bool)
        for other in trials:
            if other.configuration == trial.configuration:
                n = min(len(trial), len(other))
                active[:n] |= other.active[:n]
        valid = trial.valid & ~active
        shared.append(dataclasses.replace(trial, valid=valid) if active.any() and valid.any() else trial)
    return tuple(shared)


def antagonists(names: Iterable[str]) -> list[tuple[str, str]]:
    """Return the pairs of channels whose names differ by `flexor` and `extensor` alone, as `emg_elbow_flexor` and `emg_elbow_extensor`."""
    found = list(names)
    return [(name, other) for name in found if "flexor" in name and (other := name.replace("flexor", "extensor")) in found]


def co_contraction(trials: Sequence[Trial], number: int, start: float, end: float, muscles: Sequence[Muscle] = ()) -> float | None:
    """Return how much antagonists work against one another in a stretch of a trial: 0, one alone, to 1, both alike.

    `2 ∫ min(a, b) dt / ∫ (a + b) dt` (Falconer and Winter 1985), a and b the envelopes above rest where they are active, each relative to
    a maximal voluntary contraction where its muscle states one, else to its largest in the session. The largest over the pairs counts.

    Parameters
    ----------
    trials : sequence of Trial
        Of one session.
    number : int
        Which of them, from 0.
    start, end : float
        Of the stretch [s].
    muscles : sequence of Muscle
        That state rest and contraction of their channels.

    Returns
    -------
    float or None
        None where no pair of antagonists is recorded, or none of them is active.
    """
    trial = trials[number]
    during = (trial.t >= start) & (trial.t <= end)
    stated = {muscle.channel: muscle for muscle in muscles}
    indices = []
    for pair in antagonists(trial.emg):
        sizes = []
        for name in pair:
            envelopes = [_envelope(t, name) for t in trials]
            together = np.concatenate(envelopes)
            level, threshold = _resting(together[np.isfinite(together)])
            rest, most = _levels(envelopes, stated.get(name))
            own = envelopes[number][during]
            sizes.append(np.where(own > threshold - level + rest, own - rest, 0.0) / max(most - rest, 1e-300))
        whole = float(np.nansum(sizes[0] + sizes[1]))
        if whole > 0.0:
            indices.append(2.0 * float(np.nansum(np.minimum(*sizes))) / whole)
    return max(indices, default=None)


def _resting(envelope: np.ndarray) -> tuple[float, float]:
    """Return the resting level of a channel in a session and the threshold of activity."""
    level = float(np.median(envelope))
    return level, level + DEVIATIONS * _TO_SIGMA * float(np.median(np.abs(envelope - level)))


def _envelope(trial: Trial, name: str) -> np.ndarray:
    """Return the envelope of a channel, NaN where the trial has no such channel."""
    if name not in trial.emg:
        return np.full(len(trial), np.nan)
    signal = trial.emg[name]
    there = np.isfinite(signal)
    if not there.any():
        return np.full(len(trial), np.nan)
    filled = np.interp(trial.t, trial.t[there], signal[there])
    rectified = filled if filled.min() >= 0.0 else np.abs(filled - filled.mean())
    half = max(1, round(0.5 * SMOOTHED / trial.dt))
    padded = np.pad(rectified, half, mode="reflect")
    return np.convolve(padded, np.full(2 * half + 1, 1.0 / (2 * half + 1)), mode="valid")


def _widened(mark: np.ndarray, dt: float) -> np.ndarray:
    before, after = round(BEFORE / dt), round(AFTER / dt)
    wide = mark.copy()
    for k in np.flatnonzero(mark):
        wide[max(0, k - before) : k + after + 1] = True
    return wide


def onset(trial: Trial, name: str, start: float, end: float, quiet: float | None = None) -> float | None:
    """Return when a channel becomes active in a stretch [s].

    Activity is what exceeds rest by three deviations for 25 ms (Hodges and Bui 1996). An average delays that, and a gradual onset more: the
    onset is the most probable time of a change of the amplitude of the single samples before, a step or a ramp (approximated generalized
    likelihood ratio, Staude 2001).

    Parameters
    ----------
    trial : Trial
    name : str
        Of the channel.
    start, end : float
        Between which an onset counts [s].
    quiet : float, optional
        Up to when the channel rests, where less than 50 ms were recorded before `start` [s].

    Returns
    -------
    float or None
        None where less than 50 ms of rest were recorded, and for no such channel or no activity up to `end`.
    """
    signal = trial.emg.get(name)
    if signal is None or not np.isfinite(signal).all():
        return None
    raw = bool(signal.min() < 0.0)
    centred = signal - np.median(signal) if raw else signal
    rectified = np.abs(centred)
    width = max(1, round(ONSET_SMOOTHED / trial.dt))
    # The mean of the samples up to each: nothing later is in it.
    envelope = np.convolve(rectified, np.full(width, 1.0 / width))[: len(rectified)]
    counted = np.arange(len(envelope)) >= width
    resting = counted & (trial.t < start)
    if quiet is not None and resting.sum() * trial.dt < LEAST_REST:
        start = quiet
        resting = counted & (trial.t < quiet)
    if resting.sum() * trial.dt < LEAST_REST:
        return None
    rest = envelope[resting]
    above = envelope > rest.mean() + ONSET_DEVIATIONS * max(float(rest.std()), 1e-12)
    held = max(1, round(ONSET_HELD / trial.dt))
    lasting = np.convolve(above, np.ones(held), mode="valid") > held - 0.5
    there = np.flatnonzero(lasting & (trial.t[: len(lasting)] >= start) & (trial.t[: len(lasting)] <= end))
    if not there.size:
        return None
    first = max(int(np.argmax(trial.t >= start)), there[0] - round(ONSET_BEFORE / trial.dt))
    changed = _change(centred[first : there[0] + held], raw, centred[resting])
    return float(trial.t[first + changed])


def _change(values: np.ndarray, raw: bool, rest: np.ndarray) -> int:
    """Return the sample from which on a signal differs from rest, by the most probable step or ramp of its amplitude.

    A raw signal is normally distributed about zero with that standard deviation; an envelope has it as its mean, with the scatter of rest.
    """
    level, scatter = (float(np.sqrt(np.mean(rest**2))), 0.0) if raw else (float(rest.mean()), max(float(rest.std()), 1e-12))
    level, n = max(level, 1e-12), len(values)
    after = np.arange(n)[None, :] - np.arange(n - 1)[:, None]
    sizes = np.geomspace(0.25, 64.0, _RISES) * (level if raw else scatter)
    best, found = np.inf, 0
    for shape in ((after >= 0).astype(float), np.maximum(after + 1.0, 0.0) / n):
        for size in sizes:
            amplitude = level + size * shape
            cost = 2.0 * np.log(amplitude) + (values / amplitude) ** 2 if raw else ((values - amplitude) / scatter) ** 2
            total = cost.sum(axis=1)
            if total.min() < best:
                best, found = float(total.min()), int(np.argmin(total))
    return found
