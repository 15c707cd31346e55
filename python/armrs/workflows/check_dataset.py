"""Every problem of a data set at once, and what each verb can determine from it."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .. import checks
from ..analysis.passive_curve import PassiveCurve
from ..analysis.stretch_sessions import stretched_joint
from ..errors import ArmrsError, BadInput, BadInputs
from ..formatting import how_many
from ..io import plausibility
from ..io.dataset import FILE, NO_MODEL, Dataset, describe, described_model, left_out, name_of, read_entry, refuse_other_arms
from ..io.dataset_errors import dataset_errors_of
from ..io.muscle_activity import channel_faults
from ..io.samples import NUMBER, header_of
from ..io.trial import Reading, Trial, moving_bases, still_angles
from ..model import Description, Model, TrialEntry
from ..tabular import Tabular, Tidy
from . import setup_check
from .gap import data_checks
from .importing.clock_offset import lateness
from .passive import passive_moments

_LATE, _LATE_BY = 0.06, 2.0
"""Forces are called late from this on [s], when shifting them leaves so many times less unexplained."""
_LONG = 3.0
"""Length of a segment from which on its unit is doubtful [m]."""
_SAME_RATE = 0.02
"""Relative difference of two sampling rates up to which they count as the same."""
_SHORT = 0.7
"""Share of the median length of the other repeats below which a repeat is reported as short."""


@dataclass(frozen=True)
class Problem:
    """Something wrong, or worth knowing.

    Attributes
    ----------
    level : {"error", "warning"}
        An error keeps at least one verb from using the data.
    text : str
        File, place, found and allowed.
    next_step : str
        What to do about it.
    """

    level: str
    text: str
    next_step: str = ""

    def __str__(self) -> str:
        return self.text + (f" -> {self.next_step}" if self.next_step else "")


@dataclass(frozen=True)
class Ability:
    """Whether a verb can use the data, and why."""

    verb: str
    able: bool
    why: str


@dataclass(frozen=True)
class Checked(Tabular):
    """The result of `check_dataset`.

    Attributes
    ----------
    problems : tuple of Problem
    verbs : tuple of Ability
    dataset : Dataset or None
        What of it can be read; None where that is nothing.
    """

    problems: tuple[Problem, ...]
    verbs: tuple[Ability, ...]
    dataset: Dataset | None = field(default=None, repr=False, compare=False)

    @property
    def errors(self) -> tuple[Problem, ...]:
        """Problems that keep a verb from using the data."""
        return tuple(p for p in self.problems if p.level == "error")

    def __repr__(self) -> str:
        found = f"{how_many(len(self.errors), 'error')}, {how_many(len(self.problems) - len(self.errors), 'warning')}"
        able = ", ".join(v.verb for v in self.verbs if v.able) or "no verb"
        return f"Checked({found}; usable by {able})"

    def tidy(self) -> Tidy:
        """Return the problems, one a row."""
        return Tidy({name: [getattr(p, name) for p in self.problems] for name in ("level", "text", "next_step")}, {})

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain data."""
        return {"verb": "check", "problems": [dict(vars(p)) for p in self.problems], "verbs": [dict(vars(v)) for v in self.verbs]}


def check_dataset(source: str | os.PathLike[str], *, progress: Callable[[str, float], None] | None = None) -> Checked:
    """Find every problem of a data set.

    Parameters
    ----------
    source : path
        The folder, or its `dataset.toml`.
    progress : callable, optional
        Called with the name of the stage and the share that is done, 0 to 1.

    Returns
    -------
    Checked

    Examples
    --------
    >>> import armrs, tempfile
    >>> armrs.check_dataset(tempfile.gettempdir() + "/no such folder").errors[0].text.endswith("or that file")
    True
    """
    problems: list[Problem] = []
    checks.path("source", source)
    tell = checks.progress(progress)
    tell("reading", 0.0)
    described = _caught(lambda: describe(source), problems)
    if described is None:
        _despite_faults(Path(source), problems)
        return Checked(
            tuple(problems), tuple(Ability(verb, False, "the data set cannot be read") for verb in ("identify", "passive", "gap"))
        )
    path, description = described
    model = _caught(lambda: described_model(path.parent, description), problems)
    trials = _trials(path.parent, description, description.trials, model, problems)
    if model is None or not trials:
        why = "no model" if model is None else "no trial can be read"
        return Checked(tuple(problems), tuple(Ability(verb, False, why) for verb in ("identify", "passive", "gap")))
    problems += [_warned(line) for line in model.warnings]
    problems += [
        Problem("warning", f"[[arm.segment]] {k}, length: found {s.length:.4g} m (centimetres?)", "state lengths and com in metres")
        for k, s in enumerate(model.segments, start=1)
        if s.length > _LONG
    ]
    if description.model is None:
        problems.append(_warned(NO_MODEL))
    dataset = Dataset(name_of(path, description), model, tuple(trials), force_on=description.force_on, tolerance=description.tolerance)
    problems += [_warned(line) for line in (*still_angles(dataset.trials), *moving_bases(dataset.trials), *channel_faults(dataset.trials))]
    tell("sensors and units", 0.2)
    stretched = stretched_joint(dataset.trials)
    _plausible(dataset, problems, stretches=stretched is not None)
    tell("conventions", 0.4)
    _balanced(dataset, problems)
    problems += _without_robot(dataset)
    tell("clocks", 0.6)
    problems += [*_clocks(dataset, [p.text for p in problems if p.level == "error"]), *_rates(dataset), *_short_repeats(dataset)]
    blocked = any(p.level == "error" for p in problems)
    whole = dataset.replace(folder=path.parent, added=description.added, subject=description.subject)
    other = _other_arm(whole)
    problems += other
    tell("passive moments", 0.8)
    of_stretches = () if stretched is None else (_spasticity(whole, stretched, blocked),)
    verbs = (*of_stretches, *_abilities(whole, blocked, bool(other)))
    return Checked(_feasible(dict.fromkeys(_not_implied(problems)), whole), verbs, whole)


def _despite_faults(source: Path, problems: list[Problem]) -> None:
    """Add the problems of model and trial files where faults of `dataset.toml` leave them to be read."""
    path = source / FILE if source.is_dir() else source
    try:
        faults = dataset_errors_of(path)
    except BadInput:  # it is among the problems
        return
    if faults.rest is not None:
        rest = faults.rest
        model = _caught(lambda: described_model(path.parent, rest), problems) if faults.names_model else None
        _trials(path.parent, rest, faults.trials, model, problems)


def _caught(read: Callable[[], Any], problems: list[Problem]) -> Any:
    """Return what `read` returns, or None with its refusal among the problems, each once."""
    try:
        return read()
    except BadInputs as error:
        refused: Sequence[ArmrsError] = error.problems
    except ArmrsError as error:
        refused = [error]
    known = {p.text for p in problems}
    problems += [Problem("error", str(one), _remedy(one)) for one in refused if str(one) not in known]
    return None


_FILES = {
    "time": "write the unit of time in the name of the column (t_s, t_ms), or correct the time stamps",
    "header": "rename or remove the column",
    "samples": "leave the copy out of dataset.toml",
    "force_on": "state what the forces act on: force_on in dataset.toml",
    "file": "correct the file, or its name in dataset.toml",
}
"""By the place of an error, what to do about it."""


def _remedy(error: ArmrsError) -> str:
    """Return the next step about an error; nothing where the error itself says it."""
    if not isinstance(error, BadInput):
        return ""
    if (error.hint or error.allowed).endswith("or that file") or "no data set" in str(error.found):
        return "give the folder that armrs import, record or demo wrote"
    if str(error.found).startswith(("no column for", "neither forces nor torques")):
        return "add the column, or give this name to the one that holds it"
    place = error.place.rpartition(", ")[2]
    for start, step in _FILES.items():
        if place.startswith(start):
            return step
    if re.search(r"found '[-+]?\d+,\d+(e[-+]?\d+)?'", str(error)):
        return "write decimal points, or import the recording again: armrs import reads decimal commas"
    if str(error.found).endswith(" twice"):
        return "rename or remove one of the two"
    if "dead sensor" in f"{error.hint} {error.allowed}":
        return "repair the sensor and record again, or leave the trial out of dataset.toml"
    if error.allowed == NUMBER and isinstance(error.found, str):
        return "leave the cell empty where the sample is missing"
    if any(words in str(error.found) for words in _MISREAD):
        return "import the recordings again and let armrs import find the convention, or correct the columns"
    of_samples = error.file is None or Path(error.file).suffix != ".toml"
    if of_samples and place.startswith("line"):
        return "write one row with the names of the columns, then one row of numbers a sample; armrs import reads other tables"
    if of_samples and place.startswith(("column", "row", "Fy", "q", "angles")):
        return "correct the column: its unit, its sign, or its values"
    return ""


_WARNINGS = (
    (
        "times the masses",
        "correct the unit of the forces and import again, or body mass (armrs init) or masses (model.toml)",
    ),
    ("a dead channel", "check electrodes and cable and record again, or remove the column"),
    (", its repeats ", "record this repeat again, or nothing if it was ended on purpose"),
    ("saturated", "record with a larger range of the sensor, or leave these trials out"),
    ("hand and handle", "check the bases and lengths of arm and robot in the model, and the zeros of their angles"),
    ("no samples from", "fill the gap or record the movement again; where it was, nothing is compared"),
    ("no samples below", "record this movement again, or remove its [[trial]]"),
    ("samples are missing", "record these repeats again, or leave them out"),
    ("bridged", "look for lost samples in the recorder"),
    ("whole turns", "nothing, if the joint did not turn round"),
    ("the time stamps are used", "correct sample_rate in dataset.toml"),
    ("one fit trial", "record repeats of each movement"),
    ("no movement was repeated", "record repeats of each movement"),
    ('role = "test"', 'set role = "test" for one repeat of each movement'),
    ("hardly", "move the joint, or give its law in the model"),
    ("what holds it cannot be determined", "move the joint, or give its law in the model"),
    ("a joint that is held", "nothing, if the joint was held; else repair its sensor"),
    ("begin them at one", "cut the trials at a rest"),
    ("at a higher rate", "record the robot at a higher rate, or let it start and stop smoothly"),
    ("are compared by joint torques", "nothing if no robot leads the arm; otherwise add what is missing, or leave these trials out"),
    ("no model is named", "nothing, or name a model of your own: model = in dataset.toml"),
)
"""By words of a warning, what to do about it."""


_MISREAD = ("if read otherwise", "from the robot's handle")
"""Words of errors of columns that hold something else than their names state."""
_OF_FORCES = ("times the masses", "the forces do not decide")
"""Words of warnings that are computed with the forces as given."""
_OF_VALUES = (*_OF_FORCES, "hand and handle", "at a higher rate", "in the fit trials: what holds it")
"""The same, with the angles or the forces."""
_MEASURED = re.compile(r"(?<![\w.])[-+]?\d[\d.]*(e[-+]?\d+)?(?= (?:mm?|s|rad(?:/s)?|N(?: m)?|Hz|%|samples)(?![\w/]))")
"""A measured number, which is followed by its unit."""
_OF_ONE = re.compile(
    r"\[\[trial\]\] \d+ of | \(in that folder and in no entry: [^)]*\)|(?:line|row) \d+|\b\d+ times|\bonce"
    r"|(?<=found )[-+]?\d[\d.]*(?:e[-+]?\d+)?(?=,)"
)
"""What else differs between files with one cause: the entry, the row, the first value that was found there, and how often."""
_COLUMN = re.compile(r"\bcolumn (\w+)(?=:| jumps)")


def _not_implied(problems: Iterable[Problem]) -> list[Problem]:
    """Return problems without what only follows from an error.

    Columns that hold something else and dead sensors give no weight, and a dead sensor is no joint that is held. What
    columns probably hold is stated once, whether the robot's handle or the balance of the arm shows it.
    """
    told = list(problems)
    errors = [p.text for p in told if p.level == "error"]
    misread = any(words in text for text in errors for words in _MISREAD)
    dead = [text.partition(": found ")[0] for text in errors if "dead sensor" in text]
    angles = {name for place in dead for name in re.findall(r"\bq\d", place)}
    implied = _OF_VALUES if misread or angles else _OF_FORCES if dead else ()
    by_handle = {text.partition(", allowed ")[2] for text in errors if _MISREAD[1] in text}

    def follows(p: Problem) -> bool:
        if p.level == "error":
            return _MISREAD[0] in p.text and p.text.partition(", allowed ")[2] in by_handle
        return any(words in p.text for words in implied) or p.text.partition(" is ")[0] in angles

    return [p for p in told if not follows(p)]


def _feasible(problems: Iterable[Problem], dataset: Dataset) -> tuple[Problem, ...]:
    """Return problems whose next step does not leave every trial out: what names no trial is of all of them."""
    told = list(problems)
    concerned: dict[str, str] = {}
    for p in told:
        concerned[p.next_step] = concerned.get(p.next_step, "") + p.text
    named = {step: [trial.file in text for trial in dataset.trials] for step, text in concerned.items()}
    all_of_them = {step for step, there in named.items() if all(there) or not any(there)}
    return tuple(replace(p, next_step=p.next_step.partition(", or leave")[0]) if p.next_step in all_of_them else p for p in told)


def _warned(text: str) -> Problem:
    step = next((step for words, step in _WARNINGS if words in text), "look at the values in model.toml")
    return Problem("warning", text, step)


def _trials(
    folder: Path, description: Description, entries: Iterable[TrialEntry], model: Model | None, problems: list[Problem]
) -> list[Trial]:
    """Return the trials of some entries that can be read; what is wrong with the others is added to the problems."""
    trials = []
    for entry in entries:
        path = folder / entry.file
        if model is not None:
            joints: int | None = model.n_joints
        else:
            joints = _caught(partial(_joints_of, path), problems)
        reading = None if joints is None else _caught(partial(_read_or_left_out, path, entry, joints, description), problems)
        if isinstance(reading, str):
            problems.append(_warned(reading))
        elif reading is not None and model is not None:
            problems += [_warned(f"{path}: {line}") for line in reading.warnings]
            trials.append(reading.trial)
    return trials


def _read_or_left_out(path: Path, entry: TrialEntry, joints: int, description: Description) -> Reading | str:
    """Return the trial of an entry as it was read, or the warning of one without samples."""
    return read_entry(path, entry, joints, description) or left_out(entry)


def _joints_of(path: Path) -> int:
    """Return the number of joints with angles in a trial, for a model that cannot be read."""
    header: Sequence[str] = ()
    with suppress(OSError):  # `read_entry` says why the file cannot be read
        header = header_of(path)
    return max((int(found[1]) for name in header if (found := re.match(r"q([1-9])_", name))), default=1)


def _plausible(dataset: Dataset, problems: list[Problem], *, stretches: bool) -> None:
    """Check each trial by itself, so that one dead sensor does not hide another; stretches need no test trial."""
    for trial in dataset.trials:
        one = dataset.replace(trials=(trial,))
        dead = list(plausibility.dead_forces(one))
        problems += [Problem("error", str(error), _remedy(error)) for error in dead]
        if not dead:
            _caught(partial(plausibility.refuse_implausible, one), problems)
    led = _is_led(dataset)
    for test in data_checks.tests():
        if stretches and test is data_checks.no_test_trial:
            continue
        problems += [_warned(line) for line in _caught(partial(test, dataset, led), problems) or ()]


def _balanced(dataset: Dataset, problems: list[Problem]) -> None:
    """Check each trial by itself, whatever the result for all together: one may have been recorded otherwise."""
    trials = setup_check.balanced_trials(dataset)
    met = plausibility.hand_meets_handle(dataset)
    if dataset.model.gravity and setup_check.wrong_setup(dataset.model, trials, met=met) is None:
        said = {p.text for p in problems}
        found = [str(one) for one in setup_check.wrong_trials(dataset.model, trials, met=met)]
        problems += [Problem("warning", text, "compare with the other trials") for text in found if text not in said]


def _without_robot(dataset: Dataset) -> list[Problem]:
    """Return that angles of a robot were recorded which cannot be used, since the model has no place of the robot."""
    if dataset.model.robot is not None or not any(t.robot_q is not None for t in dataset.trials):
        return []
    text = "[robot] in the model: found nothing, though the trials hold the robot's angles (qr1, qr2): gap compares joint torques only"
    step = "add [robot] with lengths, base and elbow to the model, or import the recordings again: armrs import estimates it"
    return [Problem("warning", text, step)]


def _clocks(dataset: Dataset, errors: Sequence[str]) -> Iterator[Problem]:
    """Give the trials whose forces are late or early against their angles by more than a calibration may leave.

    Trials with errors are not checked, and none where angles are counted otherwise.
    """
    if not dataset.model.gravity or any("if read otherwise" in text and " more: " in text for text in errors):
        return
    for trial in setup_check.balanced_trials(dataset):
        if trial.force_on_arm is None or any(trial.file in text for text in errors):
            continue
        late, better = lateness(dataset.model, trial.t, np.where(trial.valid[:, None], trial.q, np.nan), trial.force_on_arm)
        if abs(late) >= _LATE and better >= _LATE_BY:
            said = f"{trial.file}: forces are about {abs(late):.2g} s {'late' if late > 0.0 else 'early'} against the angles"
            yield Problem("warning", said, "bring both on one clock: armrs import does, of forces in a file of their own")


def _rates(dataset: Dataset) -> Iterator[Problem]:
    """Give the trials that are sampled at another rate than at least half of them."""
    rates = np.array([trial.rate for trial in dataset.trials])
    # The upper one of two in the middle: the mean of both would be a rate that no trial has.
    usual = float(np.sort(rates)[rates.size // 2])
    for trial, rate in zip(dataset.trials, rates, strict=True):
        if abs(rate / usual - 1.0) > _SAME_RATE:
            said = f"{trial.file}: {rate:.4g} samples a second, where others have {usual:.4g}"
            yield Problem("warning", said, "record all trials at one rate; lost samples?")


def _short_repeats(dataset: Dataset) -> Iterator[Problem]:
    """Give the repeats that are much shorter than the others of their movement."""
    lengths = [float(trial.t[-1] - trial.t[0]) for trial in dataset.trials]
    for trial, length in zip(dataset.trials, lengths, strict=True):
        others = [
            n for other, n in zip(dataset.trials, lengths, strict=True) if other is not trial and other.configuration == trial.configuration
        ]
        usual = float(np.median(others)) if others else 0.0
        if length < _SHORT * usual:
            yield _warned(f"{trial.file} lasts {length:.1f} s, its repeats {usual:.1f} s")


def _of_file(problem: Problem) -> tuple[str, str]:
    """Return the file that a problem is of, empty where it is of none, and the rest of its text."""
    file, _, rest = problem.text.partition(": ")
    # What stands before a colon may be a joint with its number: that is no file.
    return (file, rest) if file.endswith((".csv", ".parquet")) else ("", problem.text)


def grouped(problems: Sequence[Problem]) -> list[Problem]:
    """Return problems with those of one cause together, each where its first stood.

    They have one cause if they differ only by their file, by the column, or by what was measured there. The first is shown, with the number
    of the other files and the names of all columns.
    """
    together: dict[tuple[str, str, str], list[Problem]] = {}
    for p in problems:
        together.setdefault((p.level, _cause(p), p.next_step), []).append(p)
    return [_one_of(alike) for alike in together.values()]


def _cause(problem: Problem) -> str:
    """Return the text of a problem without what differs between files with one cause; of what is of no file, the whole text."""
    file, rest = _of_file(problem)
    return _COLUMN.sub("column", _OF_ONE.sub("", _MEASURED.sub("", rest))) if file else rest


def _one_of(alike: Sequence[Problem]) -> Problem:
    """Return the first of the problems with one cause, with the number of the other files and the names of all columns."""
    read = [_of_file(p) for p in alike]
    (file, rest), others = read[0], len({file for file, _ in read}) - 1
    names = list(dict.fromkeys(name for _, text in read for name in _COLUMN.findall(text)))
    if len(names) > 1:
        rest = _COLUMN.sub(f"columns {', '.join(names)}", rest, count=1)
    return replace(alike[0], text=f"{file}{f' and {others} more' if others else ''}: {rest}") if file else alike[0]


def _other_arm(dataset: Dataset) -> list[Problem]:
    """Return that the arm is none that `identify` and `gap` take, where `passive` does."""
    found: list[Problem] = []
    _caught(partial(refuse_other_arms, dataset), found)
    return found


def _is_led(dataset: Dataset) -> bool:
    whole = all(t.robot_q is not None and t.force_on_arm is not None for t in dataset.trials)
    return dataset.model.robot is not None and whole


def _abilities(dataset: Dataset, blocked: bool, other_arm: bool) -> tuple[Ability, ...]:
    if blocked:
        return tuple(Ability(verb, False, "correct the errors above first") for verb in ("identify", "passive", "gap"))
    efforts = [t for t in dataset.fit_trials if t.force_on_arm is not None or t.tau is not None]
    repeats = len(dataset.fit_trials) > len({t.configuration for t in dataset.fit_trials})
    lacking = [] if repeats else ["repeats to estimate the noise from"]
    lacking += [] if dataset.test_trials else ['trials with role = "test" to measure the gap on']
    how = _how_gap(dataset)
    passive = _passive(dataset)
    if other_arm:
        why = "correct the error above first"
        return Ability("identify", False, why), passive, Ability("gap", False, why)
    return (
        Ability(
            "identify",
            bool(efforts),
            f"{how_many(len(efforts), 'fit trial')} with forces or torques" if efforts else "no forces and no torques",
        ),
        passive,
        Ability("gap", bool(efforts), f"{how}{'; without ' + ' and '.join(lacking) if lacking else ''}"),
    )


def _spasticity(dataset: Dataset, joint: int, blocked: bool) -> Ability:
    """Return whether `spasticity` can use stretches of a joint, from 1."""
    if blocked:
        return Ability("spasticity", False, "correct the errors above first")
    if not any(t.force_on_arm is not None or t.tau is not None for t in dataset.trials):
        return Ability("spasticity", False, "no forces and no torques")
    name, n = dataset.model.joints[joint - 1].name, len(dataset.trials)
    return Ability("spasticity", True, f"{how_many(n, 'stretch', 'stretches')} of the {name} at several speeds")


def _passive(dataset: Dataset) -> Ability:
    """Return what `passive` finds: its curves, and which movements were slow."""
    try:
        found = passive_moments(dataset)
    except BadInput as error:
        return Ability("passive", False, str(error))
    if not found.curves:
        why = f"no joint moves long enough in both directions over the same angles for a low-pass at {found.cutoff:g} Hz"
        return Ability("passive", False, why)
    slow, fast = ([c for c in found.curves if c.slow is one] for one in (True, False))
    said = [f"slow movements of {_by_joint(slow)}"] if slow else []
    said += [f"not slow: {_by_joint(fast)}"] if fast else []
    return Ability("passive", True, "; ".join(said))


def _by_joint(curves: Sequence[PassiveCurve]) -> str:
    """Return the joints of curves, each with its movements in brackets."""
    joints = sorted({c.joint for c in curves})
    return ", ".join(f"joint {j} ({', '.join(c.configuration for c in curves if c.joint == j)})" for j in joints)


def _how_gap(dataset: Dataset) -> str:
    """Return how `gap` compares, and why where it cannot simulate the robot."""
    if _is_led(dataset):
        return "by angles and forces, arm and robot simulated together"
    absent = {
        "[robot] in the model": dataset.model.robot is None,
        "the robot's angles (qr1, qr2)": any(t.robot_q is None for t in dataset.trials),
        "contact forces": any(t.force_on_arm is None for t in dataset.trials),
    }
    return f"by joint torques only, for lack of {', '.join(name for name, lacks in absent.items() if lacks)}"
