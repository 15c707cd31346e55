"""Stretch reflexes from stretches of one joint at several speeds: `armrs spasticity`."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from .. import _armrs, checks
from ..analysis import joint_centres, passivity_checks, stretch_reflex
from ..analysis.robot_motion import with_robot_motion
from ..analysis.stretch_reflex import Reflex, Stretch
from ..analysis.uncertainty import Deviations, sensitivity
from ..errors import BadInput, Text
from ..io.dataset import Dataset, load_dataset
from ..io.muscle_activity import antagonists, co_contraction, onset
from ..io.plausibility import refuse_implausible
from ..io.trial import Trial
from ..model import Model
from ..result_warnings import with_warnings
from ..tabular import Tabular, Tidy
from .identify import Estimate
from .passive import TrialMoments, trial_moments
from .setup_check import setup_warnings

DEFAULT_CUTOFF = 4.0
"""Cutoff of the low-pass [Hz]: above it, inertia times the noise of angles would be taken for latency (0.05° gave 6 ms at 8 Hz)."""
FINER = 3.0
"""Ratio of the cutoff of the reflex's input motion to that: a low-pass before its threshold has another effect than one after."""
FINER_WITH_ROBOT = 10.0
"""The same where the fast motion is from the angles of the robot: they have little noise (`armrs.analysis.robot_motion`)."""
FINEST = 25.0
"""Samples in each period of the cutoff, enough for the finer motion."""
EDGE = 1.0
"""Periods of the cutoff at both ends of a trial that are not fitted: the low-pass has one side of them only."""
LEAST_STRETCH = np.radians(10.0)
"""A joint that moves less is not stretched, but moves with another [rad]; planned stretches have 20° and more."""
LEAST_SPEEDS = 1.5
"""The fastest stretch must be faster than the slowest by this factor before a reflex can be distinguished from viscosity."""
CATCH_SHARE = 0.1
"""Share of its largest moment in a stretch from which on the reflex counts as begun: the catch."""

SWAPPED_SHARE, FEWEST_SWAPPED = 0.3, 3
"""Stretches with at least this share of the largest reflex show which muscle is active in it; and how many of them must contradict."""


@dataclass(frozen=True)
class MeasuredStretch:
    """One stretch: the motion of a trial in the direction that is resisted.

    Attributes
    ----------
    file, configuration : str
    speed : float
        Largest speed [rad/s].
    peak_moment, work : float
        Largest moment of the stretch less that at its beginning [N m], and the work done on the joint [J].
    elastic, resisting, reflex : float
        Their largest shares of the moment: springs; viscosity and friction; reflex [N m].
    catch_angle, catch_speed : float
        Where the catch began [rad, rad/s]; NaN without one.
    emg_onset : float
        Time from the start of the stretch to the first activity of a muscle [s]; NaN without one.
    emg_latency : float
        Time from the speed's passing the threshold to that activity [s]; NaN as above, and without a reflex.
    co_contraction : float
        Co-contraction of antagonists, 0 to 1; NaN where no pair of them is recorded, see `armrs.io.muscle_activity`.
    active : tuple of str
        Channels of muscles that became active, the first first.
    """

    file: str
    configuration: str
    speed: float
    peak_moment: float
    work: float
    elastic: float
    resisting: float
    reflex: float
    catch_angle: float
    catch_speed: float
    emg_onset: float
    emg_latency: float
    co_contraction: float
    active: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class JointReflex:
    """The reflex of one joint.

    Attributes
    ----------
    joint : int
        From 1.
    reflex : Reflex
    stretches : tuple of MeasuredStretch
        By speed.
    """

    joint: int
    reflex: Reflex
    stretches: tuple[MeasuredStretch, ...]


@dataclass(frozen=True, eq=False)
class Spasticity(Tabular):
    """The reflexes of an arm from stretches at several speeds.

    Attributes
    ----------
    joints : tuple of JointReflex
    cutoff : float
        Of the low-pass [Hz].
    warnings : tuple of str
    dataset : Dataset
    """

    joints: tuple[JointReflex, ...]
    cutoff: float
    warnings: tuple[str, ...]
    dataset: Dataset = field(repr=False)

    method: ClassVar[str] = "spasticity"
    level: ClassVar[float] = stretch_reflex.LEVEL

    def __repr__(self) -> str:
        parts = []
        for j in self.joints:
            shown = ", ".join(f"{name} {p.value:.3g} ± {p.std:.2g} {p.unit}" for name, p in j.reflex.parameters.items())
            parts.append(f"joint {j.joint}: {shown if j.reflex.found else 'no reflex'}")
        return f"Spasticity({self.dataset.name!r}; {'; '.join(parts) or 'no joint was stretched'})"

    def followed(self) -> tuple[Estimate, ...]:
        """Return what a history keeps: gain, threshold and latency of the reflexes, viscosity and friction besides them.

        Intervals are those without the errors that sessions share, which cancel in a difference: of masses, force sensor and low-pass.
        """
        found = []
        for j in self.joints:
            of = {("stretch_reflex", name): p for name, p in j.reflex.parameters.items()} if j.reflex.found else {}
            of |= {("viscous", "viscosity"): j.reflex.viscosity, ("coulomb", "torque"): j.reflex.dry}
            found += [Estimate(name, j.joint, kind, p.value, p.std, p.unit, p.repeatable, "data") for (kind, name), p in of.items()]
        return tuple(found)

    def tidy(self) -> Tidy:
        """Return the stretches, one a row."""
        rows = [(j.joint, s) for j in self.joints for s in j.stretches]
        names = [name for name in MeasuredStretch.__dataclass_fields__ if name != "active"]
        columns: dict[str, list[Any]] = {"joint": [joint for joint, _ in rows]}
        units = dict.fromkeys(("peak_moment", "elastic", "resisting", "reflex"), "N m")
        units |= {"speed": "rad/s", "work": "J", "catch_angle": "rad", "catch_speed": "rad/s", "emg_onset": "s", "emg_latency": "s"}
        return Tidy(columns | {name: [getattr(s, name) for _, s in rows] for name in names}, units)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; `effects` as `armrs gap` writes them."""
        effects = [
            {
                "kind": "stretch_reflex",
                "joint": j.joint,
                "decided": j.reflex.found,
                "parameters": {name: dict(vars(p)) for name, p in j.reflex.parameters.items()}
                | {"direction": {"value": j.reflex.direction}},
            }
            for j in self.joints
        ]
        besides = [
            {
                "joint": j.joint,
                "viscosity": dict(vars(j.reflex.viscosity)),
                "dry": dict(vars(j.reflex.dry)),
                "residual_rms_Nm": j.reflex.residual_rms,
            }
            for j in self.joints
        ]
        stretched = [{"joint": j.joint, **vars(s)} for j in self.joints for s in j.stretches]
        return {"effects": effects, "besides": besides, "stretches": stretched, "cutoff_Hz": self.cutoff, "warnings": list(self.warnings)}


@with_warnings
def spasticity(
    dataset: Dataset | str | os.PathLike[str],
    *,
    cutoff: float = DEFAULT_CUTOFF,
    progress: Callable[[str, float], None] | None = None,
) -> Spasticity:
    """Find the stretch reflex of every joint that was stretched at several speeds: threshold, gain and latency with intervals.

    See `armrs.analysis.stretch_reflex` for the law. The resisting moment is that of `passive_moments`, without its slow low-pass: torque of
    the contact force, less gravity and inertia by the model.

    Parameters
    ----------
    dataset : Dataset or path
        Trials in which joints are stretched, slow to fast; three repeats of three to five speeds in all at least four trials.
    cutoff : float
        Of the zero-phase low-pass of angles and forces, -3 dB of both passes [Hz]; at most 0.4 of the sample rate.
    progress : callable, optional
        Called with the name of the stage and the share that is done, 0 to 1.

    Returns
    -------
    Spasticity

    Raises
    ------
    BadInput
        For settings out of range, and a data set in which no joint is stretched in four trials at speeds that differ.

    Examples
    --------
    >>> armrs.spasticity("patient")  # doctest: +SKIP
    Spasticity('patient'; joint 1: gain 0.8 ± 0.02 N m s/rad, threshold 0.6 ± 0.01 rad/s, latency 0.04 ± 0.001 s)
    """
    dataset = checks.loaded("dataset", dataset, Dataset, load_dataset)
    slowest = min(trial.rate for trial in dataset.trials)
    cutoff = checks.number("cutoff", cutoff, above=0.0, unit="Hz")
    # A slow recording is not refused for a default: the cutoff is lowered.
    cutoff = min(cutoff, 0.4 * slowest)
    tell = checks.progress(progress)
    refuse_implausible(dataset)
    given, centres = dataset, joint_centres.find(dataset)
    dataset = centres.applied(given)
    # Samples with muscle activity count here.
    whole = [dataclasses.replace(trial, valid=np.empty(0, dtype=bool)) for trial in dataset.trials]
    # Torques of the contact are products of forces with angles: the low-pass comes after them.
    moments = [_moments(dataset, trial, cutoff) for trial in whole]
    found, warnings = [], [*setup_warnings(dataset), *centres.warnings()]
    for joint in range(dataset.model.n_joints):
        tell(f"reflexes of the {dataset.model.joints[joint].name}", joint / dataset.model.n_joints)
        own = [(m, s) for m, fine in moments if (s := _stretch((dataset, centres), m, joint, cutoff, fine)) is not None]
        speeds = [float(np.abs(s.qd).max()) for _, s in own]
        if len(own) < stretch_reflex.FEWEST or max(speeds) < LEAST_SPEEDS * min(speeds):
            continue
        fitted = stretch_reflex.fit([s for _, s in own])
        if fitted is None:
            continue
        seen = [_measured_stretch(m, s, fitted, k, dataset) for k, (m, s) in enumerate(own)]
        found.append(JointReflex(joint + 1, fitted, tuple(sorted(seen, key=lambda s: s.speed))))
        warnings += _doubts(dataset.model.joints[joint].name, fitted, max(speeds))
        warnings += _swapped(dataset, found[-1])
    if not found:
        need = f"{stretch_reflex.FEWEST} trials that stretch one joint, the fastest {LEAST_SPEEDS:g} times as fast as the slowest"
        hint = "armrs plan MODEL --angles-deg … --spasticity JOINT -o plan proposes stretches at five speeds: record the slow ones as well"
        raise BadInput("trials", Text("no joint that is stretched at several speeds"), need, hint=hint)
    return Spasticity(tuple(found), cutoff, tuple(warnings), given)


def _moments(dataset: Dataset, trial: Trial, cutoff: float) -> tuple[TrialMoments, float]:
    """Return the moments of a trial and the cutoff of their motion [Hz], the fast one that of the robot where the robot was recorded."""
    fine, most = FINER * cutoff, 0.4 * trial.rate
    known = with_robot_motion(trial, dataset.model_of(trial.configuration), fine) if fine < most else None
    if known is not None:
        trial, fine = known, FINER_WITH_ROBOT * cutoff
    return trial_moments(dataset, trial, min(fine, most)), min(fine, most)


def _stretch(
    session: tuple[Dataset, joint_centres.JointCentres], moments: TrialMoments, joint: int, cutoff: float, fine: float
) -> Stretch | None:
    """Return one joint of a trial from its first to its last sample that was measured; None where it is held, or interrupted."""
    dataset, centres = session
    there = np.flatnonzero(np.isfinite(moments.moment[:, joint]))
    if there.size < 3 or there[-1] - there[0] + 1 != there.size:
        return None
    t, fine_q, fine_qd = moments.trial.t[there], moments.q[there, joint], moments.qd[there, joint]
    if np.ptp(fine_q) < LEAST_STRETCH:
        return None
    rate = moments.trial.rate
    q, qd, qdd = (values[:, 0] for values in _armrs.smooth(np.ascontiguousarray(moments.trial.q[there, joint, None]), rate, cutoff))
    every = max(1, int(rate / (FINEST * cutoff)))
    moment = low_pass(rate, cutoff)(moments.moment[there, joint])
    passivity_checks.refuse_absurd(dataset, [(moments.trial, moment)])
    t, q, qd, qdd, moment, fine_q, fine_qd = (values[::every] for values in (t, q, qd, qdd, moment, fine_q, fine_qd))
    force = None if moments.force is None else moments.force[there][::every]
    model, smooth = dataset.model_of(moments.trial.configuration), low_pass(rate / every, cutoff)
    size, motion = Deviations.of(dataset), moments.q[there][::every]
    errors = sensitivity(model, motion, force, size)[:, :, joint]
    # As `Deviations.vector` orders them; lengths and angles are those of the joint centres.
    n = dataset.model.n_joints
    shared = np.array([smooth(e) for e in (*errors[: 2 * n], *errors[4 * n :])])
    turned, longer = centres.unknown(model, motion, moments.qd[there][::every])
    still = _moment(model, t, motion, force)[:, joint]
    moved = [_moment(joint_centres.lengthened(model, a), t, motion + e, force)[:, joint] for e, a in zip(turned, longer, strict=True)]
    placed, misread = np.array([smooth(seen - still) for seen in moved]).reshape(-1, len(t)), turned[:, :, joint]
    coarser = low_pass(rate / every, 0.5 * fine)
    edge, active = min(round(EDGE * rate / (every * cutoff)), (len(t) - 3) // 2), moments.trial.active[there][::every]
    return Stretch(t, q, qd, qdd, moment, fine_q, fine_qd, smooth, coarser, shared, placed, misread, active, edge=edge)


def _moment(model: Model, t: np.ndarray, q: np.ndarray, force: np.ndarray | None) -> np.ndarray:
    """Return the moments with which joints resist along a motion, (n, n_joints) [N m]."""
    qd = np.gradient(q, t, axis=0)
    chain = _armrs.Arm.from_model(model)
    torque = -chain.inverse_dynamics(q, qd, np.gradient(qd, t, axis=0))
    return np.asarray(torque if force is None else torque + chain.static_torque(q, force))


def low_pass(rate: float, cutoff: float) -> Callable[[np.ndarray], np.ndarray]:
    """Return the zero-phase low-pass of angles and forces at a rate and a cutoff [Hz]."""
    return lambda values: _armrs.smooth(np.ascontiguousarray(values[:, None]), rate, cutoff)[0][:, 0]


def _measured_stretch(moments: TrialMoments, stretch: Stretch, fitted: Reflex, number: int, session: Dataset) -> MeasuredStretch:
    """Return what one stretch of a session shows: from where the joint begins to move in the direction that is resisted, to its turn."""
    along = fitted.direction * stretch.qd
    peak = int(np.argmax(along))
    low = 0.02 * along[peak]
    first = peak - int(np.argmax(along[peak::-1] < low)) if np.any(along[: peak + 1] < low) else 0
    last = peak + int(np.argmax(along[peak:] < low)) if np.any(along[peak:] < low) else len(along) - 1
    span = slice(first, last + 1)
    parts = [fitted.direction * part[number][span] for part in (fitted.elastic, fitted.resisting, fitted.reflex)]
    moment = fitted.direction * (stretch.moment[span] - stretch.moment[first])
    felt = parts[2] > CATCH_SHARE * parts[2].max(initial=0.0)
    shape = fitted.parameters
    begun = first + int(np.argmax(felt)) if fitted.found and felt.any() else None
    span_s = float(stretch.t[first]), float(stretch.t[last])
    place = [t.file for t in session.trials].index(moments.trial.file)
    both = co_contraction(session.trials, place, *span_s, session.muscles)
    # The slow low-pass widens a stretch, and with it the time for which it is beyond the threshold.
    over = fitted.direction * stretch.fine_qd[span] > shape["threshold"].value
    passed = float(stretch.t[first + int(np.argmax(over))]) if over.any() else np.nan
    # A stretch is recorded from its start on where it follows no rest: muscles rest up to the threshold then.
    onsets = {
        name: t
        for name in moments.trial.emg
        if (t := onset(moments.trial, name, *span_s, quiet=passed if over.any() else None)) is not None
    }
    emg = min(onsets.values(), default=np.nan)
    return MeasuredStretch(
        file=moments.trial.file,
        configuration=moments.trial.configuration,
        speed=float(along[peak]),
        peak_moment=float(moment.max()),
        work=float(np.sum(0.5 * (moment[1:] + moment[:-1]) * fitted.direction * np.diff(stretch.q[span]))),
        elastic=float(np.ptp(parts[0])),
        resisting=float(parts[1].max()),
        reflex=float(parts[2].max(initial=0.0)),
        catch_angle=np.nan if begun is None else float(stretch.q[begun]),
        catch_speed=np.nan if begun is None else float(along[begun]),
        emg_onset=float(emg - stretch.t[first]),
        emg_latency=float(emg - passed) if fitted.found else np.nan,
        co_contraction=np.nan if both is None else both,
        active=tuple(sorted(onsets, key=lambda name: onsets[name])),
    )


def _doubts(name: str, fitted: Reflex, fastest: float) -> list[str]:
    """Return evidence against a reflex that was found."""
    threshold, latency = (fitted.parameters[key] for key in ("threshold", "latency"))
    said = []
    if not fitted.found:
        drives = "; viscosity or dry friction would have to be below zero beside one, and no passive joint drives itself"
        why = drives if fitted.parameters["gain"].interval[0] > 0.0 else ""
        return [f"{name}: no reflex was found up to {np.degrees(fastest):.0f} °/s{why}"]
    if threshold.value < 0.02 * fastest:
        said.append(f"{name}: the threshold of the reflex is close to zero: it cannot be distinguished from a viscosity in one direction")
    if latency.interval[1] > 0.95 * stretch_reflex.LONGEST:
        said.append(f"{name}: the latency is not determined: its interval reaches the largest value tested, {stretch_reflex.LONGEST:g} s")
    return said


def _swapped(dataset: Dataset, joint: JointReflex) -> list[str]:
    """Return which channels of antagonists are probably swapped: at reflexes the other one is active, and the stretched muscle never."""
    name = dataset.model.joints[joint.joint - 1].name
    largest = max((s.reflex for s in joint.stretches), default=0.0)
    caught = [s for s in joint.stretches if joint.reflex.found and s.reflex > SWAPPED_SHARE * largest]
    said = []
    for pair in antagonists(sorted({channel for trial in dataset.trials for channel in trial.emg if name in channel})):
        # Growing angles are flexion: they stretch the extensor.
        stretched, other = pair[::-1] if joint.reflex.direction > 0 else pair
        first = [next((c for c in s.active if c in pair), None) for s in caught]
        if first.count(other) >= FEWEST_SWAPPED and not any(stretched in s.active for s in caught):
            said.append(
                f"{name}: in {first.count(other)} of {len(caught)} stretches with a reflex {other} becomes active, and {stretched}, the "
                "stretched muscle, in none: are these channels swapped?"
            )
    return said
