"""Checks of a data set before any fit: labels, units, signs, channels without information."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ... import _armrs
from ..._armrs import SimulatedTrial
from ...errors import BadInput, Text
from ...io.column_conventions import TOO_LARGE, TOO_SMALL
from ...io.dataset import Dataset
from ...io.plausibility import mean_gap, refuse_implausible
from ...io.trial import Trial, constant
from ...model import Model
from ..setup_check import examine_setup, other_weight
from .core_input import core_settings, core_trials
from .unresolved_motion import unresolved

_BY_TORQUES = "so all trials are compared by joint torques in measured motion"
_NOT_TESTED = "The contact, the robot, a first joint that moves, tremor and bursts cannot be tested that way"
_NO_FORCES = "nor can errors of the force sensor, its misalignment and its delay"
_OFF_HANDLE = 0.01
"""Mean distance of hand and handle from which on it is reported [m]: ten times the default placement of the handle."""
_LONG = 5
"""Samples in a row at one and the same extreme value from which on a channel may be saturated."""
_NEAR = 0.02
"""Part of a channel's range that counts as next to its extreme."""
_OFTEN = 3.0
"""A saturated channel is that much oftener at its extreme than next to it."""
_ALIKE = 0.9
"""Correlation above which two signals are the same movement."""
_STARTING = 0.02
"""Time between the samples from which the speed of the robot at the start of a trial is computed [s]."""
_AT_REST = 0.05
"""Speed of a robot's joint up to which it counts as resting [rad/s]: four samples of an encoder of 0.1 mrad give it to 0.02."""
_CONFIRMING_CHANGE = 1.0
"""Change of the weight that a fit must confirm for another weight to be reported, in units of the stated `segment_uncertainty`."""
_FIRST = 16
"""Samples at the start that are compared first to find copies: no trial has fewer."""


def examine(dataset: Dataset, led: bool) -> list[str]:
    """Return remarks on the data for a reader of the result, a line each.

    Raises
    ------
    BadInput
        For channels that never change, and trials that are copies.
    """
    return [line for test in tests() for line in test(dataset, led)]


def tests() -> tuple[Callable[[Dataset, bool], list[str]], ...]:
    """Return the tests of `examine`, each by itself: of a data set and whether a robot leads the arm, lines or a refusal."""
    return (
        _without_the_robot, _few_trials, no_test_trial, _dead_sensors, _copies, _wrong_setup, _off_handle, _other_weight, _still_joints,
        _moving_starts, unresolved, _uneven_repeats, _saturated,
    )  # fmt: skip


def _few_trials(dataset: Dataset, led: bool) -> list[str]:
    lines = []
    fit = dataset.fit_trials
    if len(fit) == 1:
        lines.append("one fit trial only: what is noise and what is missing cannot be distinguished by repeats")
    elif len({t.configuration for t in fit}) == len(fit):
        lines.append(
            "no movement was repeated: what is noise and what is missing cannot be distinguished; names after the first are guesses"
        )
    return lines


def no_test_trial(dataset: Dataset, led: bool) -> list[str]:
    """Return that there is nothing to measure the gap on."""
    return [] if dataset.test_trials else ['no trial with role = "test": the gap cannot be measured on data outside the fit']


def _dead_sensors(dataset: Dataset, led: bool) -> list[str]:
    refuse_implausible(dataset)
    for trial in dataset.trials:
        for name, values in _channels(trial, led):
            level = constant(values)
            if level:  # zero is an arm that swings freely
                found = Text(f"{level:g} N m in every sample")
                raise BadInput(f"column {name}", found, "a torque that changes with the movement", file=trial.file, hint="a dead sensor?")
    return []


def _wrong_setup(dataset: Dataset, led: bool) -> list[str]:
    return examine_setup(dataset)


def _off_handle(dataset: Dataset, led: bool) -> list[str]:
    """Return that hand and handle are apart on average: a base or a length is wrong by centimetres, which would be named as an effect.

    A soft contact deflects by millimetres.
    """
    gap = mean_gap(dataset)
    if gap is None or float(np.hypot(*gap)) < _OFF_HANDLE:
        return []
    forward, up = 1e3 * gap
    return [
        f"hand and handle: {forward:+.0f} mm forward and {up:+.0f} mm up from each other on average, allowed {1e3 * _OFF_HANDLE:.0f} mm"
    ]


def _other_weight(dataset: Dataset, led: bool) -> list[str]:
    found = other_weight(dataset)
    return [] if found is None else [str(found)]


def refuted(dataset: Dataset, fitted: Model) -> list[str]:
    """Return the warning about the weight of the arm if the fit with all named effects does not confirm it; otherwise an empty list.

    Parameters
    ----------
    dataset : Dataset
    fitted : Model
        Model with the named effects and refitted segments. Until a missing law is named, it can imitate a different weight.
    """
    found = other_weight(dataset)
    if found is None:
        return []
    moved = _weight_moment(fitted) / _weight_moment(dataset.model) - 1.0
    towards = moved if found.factor > 1.0 else -moved
    return [] if towards >= _CONFIRMING_CHANGE * dataset.model.segment_uncertainty else [str(found)]


def _weight_moment(model: Model) -> float:
    """Return the first moment of mass of the stretched arm about its first joint [kg m]."""
    return float(np.sum(_armrs.Arm.from_model(model).first_moments))


def _without_the_robot(dataset: Dataset, led: bool) -> list[str]:
    """Return which trials prevent a comparison in the closed chain, and what is not tested because of them."""
    if led or not any(t.force_on_arm is not None for t in dataset.trials):
        return []
    forces = ", ".join(t.file for t in dataset.trials if t.force_on_arm is None)
    not_tested = f"{_NOT_TESTED}; {_NO_FORCES}" if forces else _NOT_TESTED
    absent = {
        "[robot] in the model": dataset.model.robot is None,
        "robot angles (qr1, qr2)": not any(t.robot_q is not None for t in dataset.trials),
    }
    if any(absent.values()):
        return [f"no {' and no '.join(name for name, lacks in absent.items() if lacks)}: {_BY_TORQUES}. {not_tested}"]
    angles = ", ".join(t.file for t in dataset.trials if t.robot_q is None)
    missing = [f"no {what} in {files}" for what, files in (("robot angles", angles), ("contact forces", forces)) if files]
    return [f"{'; '.join(missing)}: {_BY_TORQUES}; leave such trials out, or add what they lack. {not_tested}"]


def _still_joints(dataset: Dataset, led: bool) -> list[str]:
    """Return which joints hardly move, but for noise and one trial in which a sensor may slip: those that the search holds."""
    if not led:
        return []
    moved = _armrs.reach(_armrs.Rig(dataset.model), core_trials(dataset), core_settings(dataset, led, 1))
    return [
        f"joint {j + 1} moves by {reach:.2g} rad in the fit trials: what holds it cannot be determined; where the model states no law for "
        "it the simulation holds it, and amended.toml has no law for it either"
        for j, reach in enumerate(moved)
        if reach <= _armrs.STILL
    ]


def _copies(dataset: Dataset, led: bool) -> list[str]:
    """Refuse a trial whose samples are those of another, or of its start: such repeats show no noise, and such a test is none."""
    known: dict[bytes, list[Trial]] = {}
    for trial in dataset.trials:
        # Comparing those alone that start alike is cheap for many trials and long ones.
        alike = known.setdefault(trial.q[:_FIRST].tobytes(), [])
        for other in alike:
            if _same_samples(trial, other):
                copy, first = (other, trial) if (other.role, trial.role) == ("test", "fit") else (trial, other)
                why = "a copy is no repeat" if copy.role == first.role else "a test on a copy of what was fitted proves nothing"
                found, allowed = Text(f"those of {first.file}, one by one"), "a measurement of its own"
                raise BadInput("samples", found, allowed, file=copy.file, hint=f"{why}; simulated repeats need noise")
        alike.append(trial)
    return []


def _same_samples(a: Trial, b: Trial) -> bool:
    """Whether measured angles and forces, or torques, of two trials are equal as far as both go, and one of them changes."""
    efforts = [(a.force_on_arm, b.force_on_arm), (a.tau, b.tau)]
    both = [(x, y) for x, y in efforts if x is not None and y is not None]
    if not both and any(values is not None for pair in efforts for values in pair):
        return False
    n = min(len(a), len(b))
    pairs = [(x[:n], y[:n]) for x, y in ((a.q, b.q), *both)]
    if not all(np.array_equal(x, y, equal_nan=True) for x, y in pairs):
        return False
    return any(np.isfinite(column).any() and constant(column) is None for x, _ in pairs for column in x.T)


def _moving_starts(dataset: Dataset, led: bool) -> list[str]:
    """Return the trials that begin while the robot moves: a simulated run starts at rest."""
    fastest: dict[str, float] = {}
    for trial in dataset.trials if led else ():
        step = max(1, int(np.ceil(_STARTING / np.median(np.diff(trial.t)) - 1e-6)))
        start = trial.robot_q[: 3 * step + 1 : step] if trial.robot_q is not None else np.empty((0, 2))
        if len(start) < 4 or not np.isfinite(start).all():
            continue
        # The speed at the first sample: a robot that sets off there has none yet, however sharply it does.
        slope = np.polynomial.polynomial.polyfit(trial.t[: 3 * step + 1 : step] - trial.t[0], start, 2)[1]
        speed = slope * np.sign(start[-1] - start[0])
        if speed.max() > _AT_REST:
            fastest[trial.file] = float(speed.max())
    if not fastest:
        return []
    each = ", ".join(f"{file} ({speed:.2g} rad/s)" for file, speed in fastest.items())
    return [f"the robot moves when these begin: {each}; runs are simulated from rest, so begin them at one, or what is left says little"]


def _uneven_repeats(dataset: Dataset, led: bool) -> list[str]:
    """Return the movements whose repeats have no common samples, since a gap of one of them was too long to be bridged."""
    lines = []
    trials = dataset.fit_trials
    for name in dict.fromkeys(t.configuration for t in trials):
        own = [t for t in trials if t.configuration == name]
        broken = [t for t in own if not t.valid.all()]
        if any(not np.array_equal(t.valid, broken[0].valid) for t in own if broken):
            files = ", ".join(t.file for t in broken)
            lines.append(f"samples are missing in {files}: repeats of {name!r} are not compared, and no noise is read off them")
    return lines


def _saturated(dataset: Dataset, led: bool) -> list[str]:
    """Return the channels that are cut off: at the extreme of all trials, for long, and hardly ever next to it."""
    together: dict[str, list[tuple[str, np.ndarray]]] = {}
    for trial in dataset.trials:
        for name, values in _efforts(trial):
            together.setdefault(name, []).append((trial.file, values[np.isfinite(values)]))
    lines = []
    for name, columns in together.items():
        everything = np.concatenate([values for _, values in columns])
        if len(everything) == 0:
            continue
        near = _NEAR * np.ptp(everything)
        for extreme in (everything.max(), everything.min()):
            at = sum(int((values == extreme).sum()) for _, values in columns)
            beside = sum(int((np.abs(values - extreme) <= near).sum()) for _, values in columns) - at
            files = [file for file, values in columns if _longest(values == extreme) >= _LONG]
            if files and near > 0 and at > _OFTEN * beside:
                lines.append(f"{', '.join(files)}: {name} stays at {extreme:g}, the most of all trials, for many samples: saturated?")
    return lines


def _longest(flags: np.ndarray) -> int:
    best = run = 0
    for flag in flags:
        run = run + 1 if flag else 0
        best = max(best, run)
    return best


def _efforts(trial: Trial) -> list[tuple[str, np.ndarray]]:
    """Return the channels of forces and torques that a trial has."""
    return [] if trial.force_on_arm is None and trial.tau is None else _channels(trial, trial.force_on_arm is not None)


def _channels(trial: Any, led: bool) -> list[tuple[str, np.ndarray]]:
    if led:
        return [("Fy", trial.force_on_arm[:, 0]), ("Fz", trial.force_on_arm[:, 1])]
    return [] if trial.tau is None else [(f"tau{j + 1}", trial.tau[:, j]) for j in range(trial.tau.shape[1])]


def refuse_mislabelled(dataset: Dataset, led: bool, plays: Sequence[SimulatedTrial]) -> None:
    """Compare what was measured with what the model as given would show, and refuse what only a label can explain.

    Parameters
    ----------
    plays
        Each trial as it was measured, and as the model as given shows it.

    Raises
    ------
    BadInput
        Forces wrong by 1000, with reversed sign, or with swapped channels, in all trials together or in one.
    """
    if not led:
        return
    n = dataset.model.n_joints
    pairs = [(trial, p.measured, given) for trial, p in zip(dataset.trials, plays, strict=True) if (given := p.shown["given"]) is not None]
    compared = [trial for trial, _, _ in pairs]
    shown = [(trial.file, measured[:, n:], given[:, n:]) for trial, measured, given in pairs]
    if not shown:
        return
    together = np.concatenate([f for _, f, _ in shown]), np.concatenate([e for _, _, e in shown])
    _refuse_units(*together)
    _refuse_directions(dataset, *together)
    # One trial alone may be labelled otherwise than the rest; where its repeats show the same, the arm is another one than the model.
    for trial, (file, forces, expected) in zip(compared, shown, strict=True):
        _refuse_units(forces, expected, f"{file}: ")
        others = (
            f for other, (_, f, _) in zip(compared, shown, strict=True) if other is not trial and other.configuration == trial.configuration
        )
        if not any(_repeats(forces, other) for other in others):
            _refuse_directions(dataset, forces, expected, f"{file}: ")


def _repeats(forces: np.ndarray, other: np.ndarray) -> bool:
    """Whether two trials of a movement show forces, (n_samples, 2), of the same direction as far as both go."""
    n = min(len(forces), len(other))
    return _alike(forces[:n], other[:n]) > _ALIKE


def _refuse_units(forces: np.ndarray, expected: np.ndarray, at: str = "") -> None:
    """Refuse forces, (n_samples, 2), that are those expected of the arm in another unit."""
    size, usual = np.sqrt(np.mean(forces**2)), np.sqrt(np.mean(expected**2))
    for factor, mistake in ((1000.0, TOO_LARGE), (0.001, TOO_SMALL)):
        if usual > 0 and abs(np.log10(size / usual / factor)) < 0.5:
            found = f"{size:.3g} N on average where the model expects {usual:.3g} N"
            raise BadInput(f"{at}Fy_N, Fz_N", Text(found), f"forces in the unit of their column ({mistake})")


def _refuse_directions(dataset: Dataset, forces: np.ndarray, expected: np.ndarray, at: str = "") -> None:
    """Refuse forces, (n_samples, 2), that are those expected of the arm in another order or direction."""
    own = [_correlation(forces[:, c], expected[:, c]) for c in (0, 1)]
    cross = [_correlation(forces[:, c], expected[:, 1 - c]) for c in (0, 1)]
    if _alike(forces, expected) < -_ALIKE:
        found = f"force_on = {dataset.force_on!r} with forces opposite to those that carry the arm"
        raise BadInput(f"{at}force_on", Text(found), '"arm" or "robot", whichever the force acts on')
    for c, name in enumerate(("Fy_N", "Fz_N")):
        # Both in its mean and in how it changes: a bias turns the one, a law of speed the other.
        if own[c] < -_ALIKE and _alike(forces[:, c], expected[:, c]) < -_ALIKE:
            raise BadInput(f"{at}{name}", Text("the opposite of what carries the arm"), "Fy along the horizontal, Fz up: a reversed axis?")
    if min(cross) > _ALIKE and max(own) < 0.7:
        raise BadInput(f"{at}Fy_N, Fz_N", Text("each follows what the other should be"), "Fy along the horizontal, Fz up: swapped columns?")


def _alike(a: np.ndarray, b: np.ndarray) -> float:
    """Return the cosine of the angle between two signals, means included."""
    return float(np.sum(a * b) / max(np.sqrt(np.sum(a**2) * np.sum(b**2)), 1e-300))


def _correlation(a: np.ndarray, b: np.ndarray) -> float:
    if np.ptp(a) == 0 or np.ptp(b) == 0:
        return 0.0
    return float(np.corrcoef(a, b)[0, 1])
