"""Identification of body segment and joint parameters from a data set."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from .. import _armrs, checks, interruptible
from .._armrs import Estimate as Estimate
from .._armrs import Fit as Fit
from .._armrs import Identification as Identification
from ..catalogue import catalogue
from ..errors import BadInput, IdentificationError, Text, unknown_name
from ..io.dataset import FILE, Dataset, load_dataset, naming_trials, refuse_other_arms
from ..io.muscle_activity import active_kept
from ..io.plausibility import hand_meets_handle, refuse_implausible
from ..io.trial import bridged, refuse_moving_base
from ..model import Effect, Model, Tolerance
from ..result_warnings import with_warnings
from ..tabular import SYMBOLS, Labelled, Series, Tabular, Tidy, over_trials
from .residuals import Explained as Explained
from .residuals import Residual, poor_fits, residuals, without_fit
from .setup_check import Weight, examine_setup, other_weight


@dataclass(frozen=True, eq=False)
class Identified(Tabular, Series):
    """The result of an identification.

    Attributes
    ----------
    result : Identification
        What the core identified: everything below but the trials.
    dataset : Dataset
        What it was identified from.
    method : {"joint", "cascade"}
    status : str
        How the solver ended: "solved", "almost_solved".
    rank, unknowns : int
        How many combinations of the unknowns the data determine.
    parameters : tuple of Estimate
    combinations : tuple of Estimate
        The base parameters: what a planar chain can show at all.
    calibration : tuple of Estimate
        Small imperfections of the measurement that were refitted within the declared tolerance.
    correlated : tuple of str
        Names of the quantities between which `correlations` are: the combinations, then parameters of effects ("coulomb1 torque").
        Empty by the cascade, which fits each joint by itself.
    correlations : ndarray, shape (n_correlated, n_correlated)
        Correlations of their errors.
    contradictions : tuple of str
        Values of the result that are impossible for this arm and these sensors: a mass at its limit, a calibration far beyond its
        tolerance, a torque that is not described at all. Then no number is reliable.
    misfits : tuple of str
        Joints whose torque the fitted model does not describe well, and speeds that are noise. Intervals hold only where the model's
        structure is right.
    left_out : tuple of str
        What of the model the method does not take into account, or finds nothing about in these movements.
    trades : tuple of str
        Which unknowns the movements cannot distinguish, in words.
    scale_free : bool
        No torque acted: all parameters are known up to one common factor, which was taken from the model.
    level : float
        Probability of the intervals.
    cutoff : float
        Cutoff of the zero-phase low-pass that motion and torque share, -3 dB of both passes [Hz].
    residual_rms : dict
        Role -> channel -> root mean square of the torque residual after the low-pass [N m].
    residual_rms_by_configuration : dict
        The same, role -> configuration -> channel.
    explained : tuple of Explained
    model : Model
        The model with the estimates.
    """

    result: Identification = field(repr=False)
    dataset: Dataset

    symbols: ClassVar[str] = SYMBOLS

    @cached_property
    def explained(self) -> tuple[Explained, ...]:
        """How the fitted model explains each trial."""
        fits = zip(self.dataset.trials, self.result.explained, strict=True)
        return tuple(Explained(trial, trial.t[fit.samples], fit.measured, fit.fitted) for trial, fit in fits)

    @property
    def method(self) -> str:
        """The method: "joint" or "cascade"."""
        return self.result.method

    @property
    def status(self) -> str:
        """How the solver ended: "solved", "almost_solved"."""
        return self.result.status

    @property
    def rank(self) -> int:
        """How many combinations of the unknowns the data determine."""
        return self.result.rank

    @property
    def unknowns(self) -> int:
        """Number of unknowns, calibration not counted."""
        return self.result.unknowns

    @cached_property
    def parameters(self) -> tuple[Estimate, ...]:
        """The unknowns and what follows from them."""
        return self.result.parameters

    @cached_property
    def combinations(self) -> tuple[Estimate, ...]:
        """The base parameters: what a planar chain can show at all."""
        return self.result.combinations

    @cached_property
    def calibration(self) -> tuple[Estimate, ...]:
        """Small imperfections of the measurement that were refitted."""
        return self.result.calibration

    @property
    def correlated(self) -> tuple[str, ...]:
        """Names of the quantities between which `correlations` are."""
        return self.result.correlated

    @cached_property
    def correlations(self) -> np.ndarray:
        """Correlations of the errors of `correlated`."""
        count = len(self.correlated)
        return np.array(self.result.correlations).reshape(count, count)

    @property
    def contradictions(self) -> tuple[str, ...]:
        """What in the result cannot be true of this arm and these sensors."""
        return self.result.contradictions

    @property
    def misfits(self) -> tuple[str, ...]:
        """What the fitted model does not describe well."""
        return self.result.misfits

    @property
    def left_out(self) -> tuple[str, ...]:
        """What of the model the method does not take into account."""
        return self.result.left_out

    @property
    def trades(self) -> tuple[str, ...]:
        """Which unknowns the movements cannot distinguish, in words."""
        return self.result.trades

    @property
    def scale_free(self) -> bool:
        """Whether all parameters are known up to one common factor only."""
        return self.result.scale_free

    @property
    def level(self) -> float:
        """Probability of the intervals."""
        return self.result.level

    @property
    def cutoff(self) -> float:
        """Cutoff of the common low-pass [Hz]."""
        return self.result.cutoff

    @cached_property
    def residual_rms(self) -> Mapping[str, Mapping[str, float]]:
        """Root mean square of the torque residual by role and channel [N m]."""
        return self.result.residual_rms

    @cached_property
    def residual_rms_by_configuration(self) -> Mapping[str, Mapping[str, Mapping[str, float]]]:
        """The same by role, configuration and channel [N m]."""
        return self.result.residual_rms_by_configuration

    @cached_property
    def model(self) -> Model:
        """The model with the estimates."""
        return self.result.model

    def __repr__(self) -> str:
        known = f"{self.rank} independent combinations of {self.unknowns} unknowns"
        return f"Identified({self.dataset.name!r}, {self.method} method, {self.status}: {known}; {'; '.join(map(str, self.combinations))})"

    def followed(self) -> tuple[Estimate, ...]:
        """Return what a history keeps: parameters, and combinations of more than one."""
        alone = {(e.name, e.joint) for e in self.parameters}
        return (*self.parameters, *(e for e in self.combinations if (e.name, e.joint) not in alone))

    def tidy(self) -> Tidy:
        """Return the estimates, one a row: parameters, combinations, calibration."""
        groups = (("parameter", self.parameters), ("combination", self.combinations), ("calibration", self.calibration))
        rows = [(group, e) for group, listed in groups for e in listed]
        columns: dict[str, list[Any]] = {"group": [group for group, _ in rows]}
        columns |= {name: [getattr(e, name) for _, e in rows] for name in ("name", "kind", "joint", "value", "std")}
        columns |= {"low": [e.interval[0] for _, e in rows], "high": [e.interval[1] for _, e in rows]}
        columns |= {name: [getattr(e, name) for _, e in rows] for name in ("unit", "decided_by")}
        return Tidy(columns, {})

    def labelled(self) -> tuple[Mapping[str, Any], Mapping[str, Labelled]]:
        """Return the joint torques of every trial, as measured and as the model has them, after the common low-pass."""
        explained = self.explained
        series = {name: [getattr(e, name) for e in explained] for name in ("measured", "fitted")}
        stacked = over_trials([e.t for e in explained], series)
        over = ("trial", "sample")
        quantities = {name: Labelled((*over, "joint"), stacked[name], "N m") for name in series}
        coordinates = {"trial": [e.trial.file for e in explained], "joint": [j.name for j in self.dataset.model.joints]}
        return coordinates, {"time": Labelled(over, stacked["time"], "s")} | quantities

    @property
    def is_sound(self) -> bool:
        """Whether the solver got there, the result is possible, and nothing is known against what the data decided."""
        doubtful = any(e.caveat for e in (*self.parameters, *self.combinations))
        return self.status == "solved" and not self.contradictions and not doubtful

    @property
    def warnings(self) -> tuple[str, ...]:
        """Remarks for the user, a line each."""
        return (*self.contradictions, *self.misfits, *self.left_out)

    def to_dict(self) -> dict[str, Any]:
        """Return the result as it is written to JSON; the model stands in a file of its own."""
        return self.result.to_dict()


@with_warnings
def identify(
    dataset: Dataset | str | os.PathLike[str],
    *,
    method: str = "joint",
    with_effects: Sequence[str] | str | None = None,
    cutoff: float | None = None,
    motion: str = "auto",
    level: float = 0.95,
    threads: int | None = None,
) -> Identified:
    """Identify segment and joint parameters on the fit trials of a data set.

    Parameters
    ----------
    dataset : Dataset or path
    method : {"joint", "cascade"}
        All joints at once with physical constraints, or the thesis' order wrist, elbow, shoulder.
    with_effects : sequence of str, or names separated by commas, optional
        Kinds of joint effects that are fitted at every joint besides those of the model; () for those of the model alone. When absent:
        spring, viscosity and dry friction in each joint that the model leaves without a law, by the joint method.
    cutoff : float, optional
        Cutoff of the common low-pass [Hz]; chosen from the data when absent.
    motion : {"auto", "measured", "simulated"}
        Where the speeds and accelerations come from. "auto": simulated along the robot's path where it is known. If the model as given
        does not follow it, with the values that fit the measured motion; if these do not either, measured, with a line in `warnings`.
    level : float
        Probability of the intervals.
    threads : int, optional
        Over which trials are spread; as many as there are processors when absent. The result is the same.

    Returns
    -------
    Identified

    Notes
    -----
    The default smoothing of dry friction, 0.01 rad/s, is no property of an arm: along simulated motion such friction is fitted as
    set-valued too, with which a joint sticks. That law stands in `model` where simulated angles and forces are significantly closer to the
    recorded ones with it. Another smoothing is kept.

    Raises
    ------
    BadInput
        For an unknown effect or method, and data that cannot be used.
    IdentificationError
        When no solution exists.

    Examples
    --------
    >>> result = armrs.identify("demo/data", with_effects=["coulomb"])  # doctest: +SKIP
    >>> print(result.combinations[0])  # doctest: +SKIP
    m1*l1 + a1*m2 = 0.7032 ± 0.0088 kg m
    """
    dataset = checks.loaded("dataset", dataset, Dataset, load_dataset)
    kinds = _checked(dataset, method, with_effects, cutoff, motion, level)
    model = dataset.model
    effects, fitted = effects_of(model, kinds)
    dataset, effects, fitted = _with_muscles(dataset, effects, fitted)
    if not model.segment_uncertainty and not any(fitted):
        raise BadInput("[arm], segment_uncertainty", 0.0, "above 0, or an effect to fit: nothing is unknown", file=dataset.model_path)
    settings = CoreSettings(
        model, fitted, dataset.tolerance, method=method, cutoff=cutoff, motion=motion, level=level, threads=checks.threads(threads)
    )
    refuse_implausible(dataset)
    unproved = examine_setup(dataset)
    with naming_trials(dataset.trials):
        found, follows = _identified(_armrs.Rig(model, effects), settings, dataset)
    return _result(dataset, found, effects, (*unproved, *follows), other_weight(dataset))


def _with_muscles(dataset: Dataset, effects: list[Effect], fitted: list[bool]) -> tuple[Dataset, list[Effect], list[bool]]:
    """Return a data set in which active samples count if there are effects of muscles, and those of joints whose muscles are recorded.

    Without such effects an active arm is no passive one: its active samples stay left out.
    """
    feel = [catalogue()[effect.kind].feels_activity for effect in effects]
    if not any(feel):
        return dataset, effects, fitted
    recorded = {m.joint for m in dataset.muscles}
    for effect in [e for e, felt in zip(effects, feel, strict=True) if felt]:
        if not recorded or (effect in dataset.model.all_effects and effect.joint not in recorded):
            found, allowed = (
                Text(f"no muscle of joint {effect.joint}"),
                f"an emg column with its activity: {effect.kind} depends on it",
            )
            raise BadInput("[[muscle]]", found, allowed, file=None if dataset.folder is None else dataset.folder / FILE)
    kept = [k for k, (effect, felt) in enumerate(zip(effects, feel, strict=True)) if not felt or effect.joint in recorded]
    return dataset.replace(trials=active_kept(dataset.trials)), [effects[k] for k in kept], [fitted[k] for k in kept]


def _checked(
    dataset: Dataset, method: str, with_effects: Sequence[str] | str | None, cutoff: float | None, motion: str, level: float
) -> Sequence[str] | None:
    """Refuse what cannot be identified, or not with these settings; return the kinds of effects to fit."""
    refuse_other_arms(dataset)
    checks.choice("method", method, ("joint", "cascade"))
    checks.choice("motion", motion, ("auto", "measured", "simulated"))
    kinds = checks.texts("with_effects", () if with_effects is None else with_effects, "kinds of effects")
    checks.number("level", level, **LEVELS)
    slowest = min(trial.rate for trial in dataset.trials)
    if cutoff is not None and checks.number("cutoff", cutoff, above=0.0, unit="Hz") >= 0.4 * slowest:
        raise BadInput("cutoff", Text(f"{cutoff:g} Hz"), f"below {0.4 * slowest:.4g} Hz, 0.4 of the lowest sample rate")
    if method == "cascade":
        cascade_can(kinds, motion)
    if method == "cascade" or motion == "simulated":
        refuse_moving_base(dataset.trials)
    for trial in dataset.trials:
        if trial.force_on_arm is None and trial.tau is None:
            raise BadInput("columns", Text("neither forces nor joint torques"), "Fy_N and Fz_N, or tau1_Nm …", file=trial.file)
    return None if with_effects is None and method == "joint" else kinds


def _result(dataset: Dataset, found: Identification, effects: list[Effect], follows: Sequence[str], weight: Weight | None) -> Identified:
    """Return the result of the core, with remarks."""
    model = dataset.model
    noisy = _noisy_speeds(found.speed_noise)
    parameters, combinations, calibration = (
        _with_caveat(estimates, NOISY_SPEED if noisy else None) for estimates in (found.parameters, found.combinations, found.calibration)
    )
    calibration = _moved_by_data(calibration, dataset.tolerance)
    # Without a load there is no torque that a residual could be a part of.
    left: Sequence[Residual] = () if found.scale_free else residuals(Identified(found, dataset).explained)
    impossible = weight is not None and weight.apart > _BEYOND
    told = found.replace(
        parameters=parameters,
        combinations=combinations,
        calibration=calibration,
        contradictions=(
            *_contradictions(parameters),
            *_beyond_tolerance(calibration, dataset.tolerance, _BEYOND, np.inf),
            *without_fit(left),
            *([str(weight)] if impossible else []),
        ),
        misfits=(
            *poor_fits(left),
            *([] if weight is None or impossible else [str(weight)]),
            *_beyond_segment(model, parameters),
            *(f"{line}: what the model lacks may be in it" for line in _beyond_tolerance(calibration, dataset.tolerance, _FAR, _BEYOND)),
            *noisy,
            *_not_quasi_static(found.neglected_inertia),
            *_alone(dataset, parameters),
        ),
        left_out=(*follows, *_left_out(found.method, effects), *_unmoved(found.method, parameters)),
    )
    return Identified(told, dataset)


def _identified(built: _armrs.Rig, settings: CoreSettings, dataset: Dataset) -> tuple[Identification, tuple[str, ...]]:
    """Return what the core identified, and a line where the measured motion had to take the place of the simulated one."""
    found = interruptible.call(_armrs.identify, built, [bridged(t) for t in dataset.trials], settings)
    error = found.not_simulated
    if error is None:
        return found, ()
    # An arm of which little is known moves elsewhere than its model; one whose robot does not fit is refused.
    if not hand_meets_handle(dataset):
        raise IdentificationError(error)
    why = error.split(":")[0] if "differs from" in error else "the arm cannot be simulated"
    return found, (f"speeds and accelerations are measured, not simulated: {why}, also with the values that fit the measured motion",)


_LARGE_INERTIA_SHIFT = 1.0
"""Standard deviations by which neglected inertia may move a first moment before it is reported: as much as everything else together."""


def _not_quasi_static(moved: Sequence[float]) -> list[str]:
    """Return a line for each joint whose first moment the inertia that the cascade neglects moves noticeably."""
    return [
        f"not quasi-static: inertia, which the cascade neglects, moves the first moment of joint {j} by {shift:.1f} standard deviations; "
        "its interval allows for that, the joint method does without"
        for j, shift in enumerate(moved, 1)
        if shift > _LARGE_INERTIA_SHIFT
    ]


LEVELS: dict[str, Any] = {"least": 0.5, "most": 0.999999}
"""Probabilities that intervals may have."""


def cascade_can(with_effects: Sequence[str], motion: str) -> None:
    """Refuse effects that the cascade would silently leave out: it holds rate-dependent ones at their values in the model."""
    found = [name for name, kind in _joint_kinds().items() if kind.rate_independent]
    for kind in with_effects:
        if kind in _joint_kinds() and kind not in found:
            raise BadInput("with_effects", kind, f"{' or '.join(found)} for the cascade, or the joint method")
    if motion == "simulated":
        raise BadInput("motion", motion, "measured for the cascade, or the joint method")


def _left_out(method: str, effects: Sequence[Effect]) -> tuple[str, ...]:
    """Return what the method leaves out of the model, a line each."""
    kinds = _joint_kinds()
    rotors = [e for e in effects if e.kind in kinds and kinds[e.kind].family == "segment"] if method == "cascade" else []
    return tuple(f"the cascade takes no inertia into account, and so not the {e.kind} of joint {e.joint}" for e in rotors)


def _unmoved(method: str, parameters: Sequence[Estimate]) -> tuple[str, ...]:
    """Return the joints of whose dry friction the cascade finds nothing, a line each."""
    kinds = _joint_kinds()
    dry = [e for e in parameters if e.kind in kinds and kinds[e.kind].family == "dry"] if method == "cascade" else []
    joints = [e.joint for e in dry if e.decided_by == "prior"]
    return tuple(
        f"joint {joint} never moves steadily in one direction: the cascade cannot identify its dry friction, nor use its torque"
        for joint in joints
    )


PASSIVE_LAWS = tuple(kind for _, kind, _ in _armrs.JOINT_LAWS)
"""What resists in every passive joint (equation 3.12 of the thesis): the laws that a joint of a model states."""
_NO_LAWS = ("segment", "muscle")
"""Families of joint effects that are not passive resistance of a joint."""


def effects_of(model: Model, with_effects: Sequence[str] | None) -> tuple[list[Effect], list[bool]]:
    """Return the effects of a model with those requested, or with passive laws where joints have none, and which of them are fitted."""
    wanted = None if with_effects is None else checks.texts("with_effects", with_effects, "kinds of effects")
    effects = [*model.all_effects, *(_passive_laws(model) if wanted is None else _added(model, wanted))]
    return effects, [e.kind in _joint_kinds() for e in effects]


def _passive_laws(model: Model) -> list[Effect]:
    """Return the laws of the joints that the model leaves without one."""
    kinds = _joint_kinds()
    laws = [e for e in model.all_effects if e.kind in kinds and kinds[e.kind].family not in _NO_LAWS]
    # What acts over two joints belongs to both.
    taken = {joint for e in laws for joint in (e.joint, e.joint - kinds[e.kind].first_joint + 1)}
    return [Effect(kind, j) for j in range(1, model.n_joints + 1) if j not in taken for kind in PASSIVE_LAWS]


@dataclass(frozen=True)
class CoreSettings:
    """Input of the core besides the trials: the model as given, which effects of the rig are fitted, and arguments of `identify`."""

    model: Model
    fitted: list[bool]
    tolerance: Tolerance
    method: str = "joint"
    cutoff: float | None = None
    motion: str = "auto"
    level: float = 0.95
    threads: int = 1


_FAR = 2.0
"""A calibration this many times its tolerance, which is its prior standard deviation, may represent another error."""
_BEYOND = 5.0
"""A calibration this many times its tolerance is no calibration."""
_WIDE = 0.25
"""A standard deviation above this part of its value is a wide one."""
_ROUNDING = 1e-12
"""What of a length is beyond another by this part of it is a difference of equal numbers."""


def _contradictions(parameters: Sequence[Estimate]) -> tuple[str, ...]:
    """Return what no arm can be, a line each."""
    return tuple(
        f"{e.name} was driven to its lower limit: is force_on right, and is [robot] that of the laboratory?"
        for e in parameters
        if e.kind == "segment" and e.decided_by == "bound" and e.name.startswith("m") and abs(e.value) <= 1e-2 * abs(e.interval[1])
    )


def _alone(dataset: Dataset, parameters: Sequence[Estimate]) -> tuple[str, ...]:
    """Return that one trial was fitted, so that the scatter of repeats is unknown, with the joint laws whose intervals are wide."""
    if len(dataset.fit_trials) != 1:
        return ()
    laws = [e for e in parameters if e.kind != "segment" and e.decided_by == "data" and e.std > _WIDE * abs(e.value)]
    names = ", ".join(dict.fromkeys(f"{e.name} of joint {e.joint}" for e in laws))
    wide = f"; standard deviations above {100 * _WIDE:.0f} % of the value: {names}" if names else ""
    return (
        "one fit trial: the scatter of repeats is not known, so the intervals hold for this one recording, its handle and its calibration"
        f"{wide}; record repeats of each movement",
    )


def _beyond_segment(model: Model, parameters: Sequence[Estimate]) -> tuple[str, ...]:
    """Return the centres of mass that the cascade, which has no such limit, puts beyond the end of their segment, a line each."""
    lines = []
    for e in parameters:
        length = model.segments[(e.joint or 1) - 1].length
        if e.kind == "segment" and e.unit == "m" and e.value > length * (1.0 + _ROUNDING):
            lines.append(
                f"{e.name} came out as {e.value:.3g} m, beyond the end of its segment of {length:g} m: "
                "the written model has a larger mass instead, with the same first moment"
            )
    return tuple(lines)


def _beyond_tolerance(calibration: Sequence[Estimate], tolerance: Tolerance, above: float, to: float) -> tuple[str, ...]:
    """Return the calibrations larger than their tolerance, more than `above` and up to `to` times, a line each."""
    lines = []
    for e in calibration:
        promised = _promised(e, tolerance)
        if above * promised < abs(e.value) <= to * promised:
            size = f"{e.value:.3g}" if e.unit == "1" else f"{e.value:.3g} {e.unit}"
            lines.append(f"{e.name} came out as {size}, {abs(e.value) / promised:.1f} times the declared tolerance")
    return tuple(lines)


def _moved_by_data(calibration: Sequence[Estimate], tolerance: Tolerance) -> tuple[Estimate, ...]:
    """Return the calibration with what the data pulled far beyond its tolerance decided by them.

    Where the model does not fit, standard deviations are as wide as the tolerance, as if the data decided nothing. The value
    itself contradicts that: its prior mean is zero.
    """
    return tuple(e.replace(decided_by="data") if abs(e.value) > _FAR * _promised(e, tolerance) else e for e in calibration)


def _promised(calibration: Estimate, tolerance: Tolerance) -> float:
    """Return the tolerance that a calibration has."""
    return float(next(getattr(tolerance, key) for start, key in _TOLERANCES.items() if calibration.name.startswith(start)))


NOISY_SPEED = "noisy speed"
"""Caveat of what the data decided where speeds and accelerations are noise to a good part: friction is then misread, and what it
leaves or takes goes into masses and calibration."""


def _noisy_speeds(shares: Sequence[float]) -> tuple[str, ...]:
    """Return the joints whose speeds are noise for a large part, a line each."""
    return tuple(
        f"the speed of joint {j} comes from noisy angles (noise {100 * share:.0f} % of the speed): friction, viscosity and inertia are "
        "biased by more than their intervals say, and masses with them; record the robot's angles and state [robot], or record speeds, "
        "or lower the cutoff"
        for j, share in enumerate(shares, start=1)
        if share > _armrs.SPEED_NOISE_ALLOWED
    )


_TOLERANCES = {
    "angle offset": "angle_offset",
    "force bias": "force_bias_N",
    "force gain": "force_gain",
    "time delay": "time_delay_s",
    "handle placement": "handle_placement_m",
}


def _joint_kinds() -> dict[str, Any]:
    return {name: kind for name, kind in catalogue().items() if kind.where == "joint"}


def _added(model: Model, kinds: Sequence[str]) -> list[Effect]:
    """Return an effect of every requested kind at every joint where the model has none yet."""
    known = _joint_kinds()
    present = {(e.kind, e.joint) for e in model.all_effects}
    added = []
    for place, kind in enumerate(kinds):
        if kind not in known:
            raise unknown_name("with_effects", kind, known, what="joint effect")
        if kind in kinds[:place]:
            raise BadInput("with_effects", Text(f"{kind} twice"), "each kind once")
        first = known[kind].first_joint
        if first > model.n_joints:
            raise BadInput("with_effects", kind, f"an arm of {first} joints or more: it acts over two of them")
        added += [Effect(kind, j) for j in range(first, model.n_joints + 1) if (kind, j) not in present]
    return added


def _with_caveat(estimates: Sequence[Estimate], caveat: str | None) -> tuple[Estimate, ...]:
    """Return estimates; a caveat is one against the data, and so against what they decided alone."""
    return tuple(e.replace(caveat=caveat) if e.decided_by == "data" else e for e in estimates)
