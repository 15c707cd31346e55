"""Wrong setups: angles or forces for which the arm is in balance only in another convention."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from ..analysis.torque_balance import BALANCED, SAMPLES, Motion, motion_of, unexplained, weight_of
from ..errors import BadInput, Text
from ..formatting import plus_minus
from ..io import column_conventions
from ..io.column_conventions import AlternativeConvention
from ..io.dataset import Dataset
from ..io.files import first_of
from ..io.plausibility import OTHER_ZERO, hand_meets_handle
from ..io.trial import Trial, constant
from ..model import Model

_UNEXPLAINED = 0.04
"""Share of the contact torques that gravity and passive joints leave, from which on another reading is searched for."""
_MIXED = 0.08
"""And from which on single trials are checked, where no reading of all together is better."""
_BETTER = 2.0
"""Another reading is named that leaves so many times less; in the right setup the best leaves at most 1.2 times less (128 sessions of two
worlds with up to two hidden effects)."""
_BETTER_ALONE = 4.0
"""The same for a single trial."""
_SAMPLES_ALONE = 200
"""Samples of a single trial that are regressed."""
_AT_ALL = 0.5
"""Another reading balances the arm that leaves at most `BALANCED`, or this where the given one leaves ten times as much, as forces in
another unit do."""
_UNEXPLAINED_BY_ZERO, _BETTER_BY_ZERO = 0.05, 2.5
"""The same for another zero, whose number is fitted: in the right setup at most 2.0 times less."""
_PLAINER = 1.5
"""Another zero is named when it leaves so many times less than every other reading."""
_TIED, _MUCH = 4.0, 0.125
"""A second reading that leaves at most so many times what the best does, and this part of what was given, is named beside it."""
_UNPROVED = 1.5
"""A reading that leaves less than this many times what the given one does is not excluded (in the right setup forces read otherwise leave
3 times as much, and angles of shoulder and elbow: 22 sessions of two worlds; a mirrored wrist 1.2 to 2.4 times)."""
_OTHER_WEIGHT, _MUCH_HEAVIER = 2.0, 0.1
"""Another weight is reported from so many standard deviations on, and from this part of the weight on: 42 right sessions of two worlds lie
within both (factors 0.85 to 1.10)."""
_FEW = 3
"""Movements from which on their differences, and not those of trials, are the scatter of the weight."""
OTHER_UNITS = tuple(
    (ratio, f"forces stated in {wrong} that are {right}")
    for unit, newtons in (("lbf", 4.4482216), ("kgf", 9.80665), ("kN", 1000.0))
    for ratio, wrong, right in ((newtons, unit, "N"), (1.0 / newtons, "N", unit))
)
"""Factors of forces in another unit than stated, and the mistake in words."""
_SAME_UNIT = 0.3
"""A factor this close to that of a unit suggests it: literature and springs are wrong by as much."""
_STEPS = (np.radians(10.0), np.radians(1.0))
"""Steps of the search for another zero of an angle [rad]."""


def examine_setup(dataset: Dataset) -> list[str]:
    """Refuse a data set in which the contact forces carry the arm only if angles or forces are read otherwise.

    Returns
    -------
    list of str
        One line if another reading carries it as well, so that nothing in the data proves the given one.

    Raises
    ------
    BadInput
        Names the file, the column and what it probably holds.
    """
    found = find_wrong_setup(dataset)
    if found is not None:
        raise found
    model, trials = dataset.model, balanced_trials(dataset)
    motion = None if model.gravity == 0.0 or dataset.added else _motion(trials)
    return [] if motion is None else _unproved(model, motion, met=hand_meets_handle(dataset))


def setup_warnings(dataset: Dataset) -> list[str]:
    """Return what contradicts the columns and the masses of a data set, a line each, for verbs that do not refuse it."""
    wrong, weight = find_wrong_setup(dataset), other_weight(dataset)
    return [str(found) for found in (wrong, weight) if found is not None]


def find_wrong_setup(dataset: Dataset) -> BadInput | None:
    """Return what `examine_setup` refuses a data set for."""
    if dataset.model.gravity == 0.0 or dataset.added:  # nothing to carry, or no one arm in all trials
        return None
    return first_wrong(dataset.model, balanced_trials(dataset), met=hand_meets_handle(dataset))


def first_wrong(model: Model, trials: Sequence[Trial], *, met: bool) -> BadInput | None:
    """Return what is wrong with all trials together, or with the first of those without which the others balance, with the file."""
    together = wrong_setup(model, trials, met=met)
    motion = _motion(trials)
    if motion is None or (together is None and unexplained(model, motion) <= _MIXED):
        return None
    # More than half of the trials are no exceptions: the others are not checked then.
    alone = dict(islice(((found.file, found) for found in wrong_trials(model, trials, met=met)), len(trials) // 2 + 1))
    rest = _motion([t for t in trials if t.file not in alone])
    if 0 < 2 * len(alone) <= len(trials) and rest is not None and unexplained(model, rest) < _UNEXPLAINED:
        return next(iter(alone.values()))
    return None if together is None else together.within(file=first_of([trial.file for trial in trials]))


def balanced_trials(dataset: Dataset) -> list[Trial]:
    """Return the trials in which contact forces alone carry the arm."""
    return [t for t in dataset.trials if t.force_on_arm is not None and t.tau is None and constant(t.force_on_arm[:, 1]) is None]


def wrong_trials(model: Model, trials: Sequence[Trial], *, met: bool) -> Iterator[BadInput]:
    """Give what is wrong with single trials, as `wrong_setup` finds it, with their files; another zero needs several movements."""
    for trial in trials:
        found = wrong_setup(model, [trial], met=met, alone=True)
        if found is not None:
            yield found.within(file=trial.file)


def wrong_setup(model: Model, trials: Sequence[Trial], *, met: bool, alone: bool = False) -> BadInput | None:
    """Return what only another reading of the columns explains, None where the arm balances or nothing else balances it.

    Parameters
    ----------
    model : Model
    trials : sequence of Trial
        With contact forces.
    met : bool
        Whether the angles are known to be right, since they put the hand where the robot's put its handle.
    alone : bool
        Whether these are few of the trials, which must then be clearly wrong; no other zero of one angle is searched for.
    """
    motion = _motion(trials, _SAMPLES_ALONE if alone else SAMPLES)
    if motion is None:
        return None
    given = unexplained(model, motion)
    if given < (_MIXED if alone else _UNEXPLAINED):
        return None
    ranked = _ranked(model, motion, met)
    least = _BETTER_ALONE if alone else _BETTER
    if not alone and not met and given >= _UNEXPLAINED_BY_ZERO:
        zero = _other_zero(model, motion)
        if zero is not None and _PLAINER * zero[0] < ranked[0][0]:
            ranked, least = [zero], _BETTER_BY_ZERO
    left, best = ranked[0]
    if left > max(BALANCED, min(_AT_ALL, 0.1 * given)) or least * left > given:
        return None
    also = ""
    if len(ranked) > 1 and ranked[1][0] < max(min(_TIED * left, _MUCH * given), _PLAINER * left):
        also = f", or {ranked[1][1].place}: {ranked[1][1].allowed}"
    share = f"{100 * given:.0f} %" if given < 1.0 else "all"
    found = Text(f"{share} of the contact torques unexplained by gravity and passive joints, {100 * left:.2g} % if read otherwise")
    return BadInput(best.place, found, best.allowed + also)


@dataclass(frozen=True)
class Weight:
    """How heavy the arm is by the forces.

    Attributes
    ----------
    factor, std : float
        Times the weight of the model, and the standard deviation of that.
    apart : float
        Standard deviations from the model, whose own uncertainty counts.
    """

    factor: float
    std: float
    apart: float

    @property
    def units(self) -> tuple[str, ...]:
        """Mistakes in the unit of the forces that would give such a factor."""
        return tuple(words for ratio, words in OTHER_UNITS if abs(self.factor / ratio - 1.0) < _SAME_UNIT)

    def __str__(self) -> str:
        factor = plus_minus(self.factor, self.std)
        found = f"the movements ask for {factor} times the masses and first moments of the model, in all segments"
        causes = " or ".join([*self.units, "a wrong body mass", "a mass that the model lacks"])
        return f"{found}, {self.apart:.1f} standard deviations from one, the model's own uncertainty counted: {causes}?"


def other_weight(dataset: Dataset) -> Weight | None:
    """Return how heavy the arm is, where that contradicts the masses of the model; None where it does not, or cannot be determined."""
    model, trials = dataset.model, balanced_trials(dataset)
    if model.gravity == 0.0 or dataset.added:
        return None
    names = list(dict.fromkeys(t.configuration for t in trials))
    if len(names) < _FEW:  # how well the weight is known shows between movements alone
        return None
    groups = [[t for t in trials if t.configuration == name] for name in names]
    motions = [motion for group in groups if (motion := _motion(group, SAMPLES // len(groups))) is not None]
    found = weight_of(model, motions) if motions else None
    if found is None:
        return None
    factor, std = found
    apart = abs(factor - 1.0) / float(np.hypot(np.hypot(std, model.segment_uncertainty), dataset.tolerance.force_gain))
    return Weight(factor, std, apart) if apart > _OTHER_WEIGHT and abs(factor - 1.0) > _MUCH_HEAVIER else None


def _unproved(model: Model, motion: Motion, *, met: bool) -> list[str]:
    """Return which readings of the columns the forces do not distinguish from the given one, in one line."""
    given = unexplained(model, motion)
    near = [one for one in _ranked(model, motion, met) if one[0] < _UNPROVED * given]
    zero = None if met else _other_zero(model, motion)
    near = sorted([*near, *([] if zero is None else [zero])], key=lambda item: item[0])[:2]
    if not near:
        return []
    others = ", or ".join(f"{100 * left:.2g} % with {reading.place}: {reading.allowed}" for left, reading in near)
    why = "" if met else ", and no angles of a robot prove them"
    said = f"as given {100 * given:.2g} % of the contact torques are unexplained, {others}"
    return [f"the forces do not decide what the columns hold{why}: {said}"]


def _ranked(model: Model, motion: Motion, met: bool) -> list[tuple[float, AlternativeConvention]]:
    """Return what every other reading leaves, the least first; of the forces alone where the angles are known to be right."""
    n = model.n_joints
    asked = [*column_conventions.of_forces(n), *column_conventions.of_unit_of_one_force(motion.force, n)]
    if not met:
        asked = [*column_conventions.of_angles(n), *asked]
    return sorted(((unexplained(model, motion.read_as(r)), r) for r in asked if r.differs(motion.q)), key=lambda item: item[0])


def _motion(trials: Sequence[Trial], samples: int = SAMPLES) -> Motion | None:
    recordings = [
        (t.t, np.where(t.valid[:, None], t.q, np.nan), t.force_on_arm, t.moment_on_arm) for t in trials if t.force_on_arm is not None
    ]
    return motion_of(recordings, samples)


def _other_zero(model: Model, motion: Motion) -> tuple[float, AlternativeConvention] | None:
    """Return the zero of one angle with which the arm balances best, and what is left then.

    None where it is a small error, or a quarter turn of the first angle, which is a convention.
    """
    found = []
    n = model.n_joints
    for j in range(1, n + 1):
        centre, width = 0.0, np.pi
        for step in _STEPS:
            tried = centre + np.arange(-width, width + 0.5 * step, step)
            left = [unexplained(model, motion.read_as(column_conventions.other_zero(n, j, float(offset)))) for offset in tried]
            centre, width = float(tried[int(np.argmin(left))]), step
        found.append((min(left), j, centre))
    least, joint, offset = min(found)
    if abs(offset) < OTHER_ZERO or (joint == 1 and abs(abs(offset) - np.pi / 2) < OTHER_ZERO):
        return None
    return least, column_conventions.other_zero(n, joint, offset, still=constant(motion.q[:, joint - 1]) is not None)
