"""Passive joint moments of slow movements: elastic mean and hysteresis (section 3.4 of the thesis)."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, ClassVar

import numpy as np

from .. import _armrs, checks
from ..analysis import (
    double_exponential,
    joint_centres,
    joint_coupling,
    low_pass,
    motion_direction,
    passivity_checks,
    preconditioning,
    repeat_statistics,
    uncertainty,
)
from ..analysis.joint_centres import JointCentres
from ..analysis.passive_curve import LEVEL, PassiveCurve, interval_of
from ..errors import BadInput, Text
from ..io import resample
from ..io.dataset import Dataset, load_dataset
from ..io.plausibility import refuse_implausible
from ..io.trial import FEWEST_SAMPLES, Trial
from ..result_warnings import with_warnings
from ..tabular import Tabular, Tidy
from .identify import Estimate
from .setup_check import setup_warnings

DEFAULT_CUTOFF = 1.0
"""Cutoff of the low-pass [Hz]; slow movements have nothing above it."""
LEAST_CUTOFF = 1e-3
"""No arm moves slower [Hz]."""
DEFAULT_BINS = 24
"""Angle bins over the range of a joint in one configuration."""
MARGIN = 0.43
"""The low-pass mixes what lies within this time, in periods of its cutoff."""
CENTRES_APART = np.radians(10.0)
"""Repeats whose mean angles differ by more are no repeats of one movement [rad]."""
CARRIED = (0.05, 20.0)
"""The force carries an arm that is led: its torque along that of the weight, relative to that. Outside of this, unit or side are wrong."""
LEAST_WEIGHT = 0.5
"""Torque of the weight from which on that is checked [N m]."""
RESTING = 0.02
"""A joint rests when its speed is below this part of its usual speed in the trial."""


@dataclass(frozen=True, eq=False)
class TrialMoments:
    """Passive moments of one trial; rows are samples, NaN where nothing was measured.

    Attributes
    ----------
    trial : Trial
    q, qd : ndarray, shape (n, n_joints)
        Low-passed angles and speeds [rad, rad/s], also where muscles are active.
    moment : ndarray, shape (n, n_joints)
        Torque with which each joint resists [N m].
    inertial : ndarray, shape (n, n_joints)
        Inertial torques by the model, taken off the moment [N m].
    direction : ndarray of int, shape (n, n_joints)
        1 where the angle grows, -1 where it shrinks, 0 at rest.
    force : ndarray, shape (n, 2), or None
        Low-passed force on the arm [N].
    sign : ndarray, shape (n, n_joints)
        Low-passed sign of the speed: how much of a dissipative moment is left in `moment` near reversals.
    """

    trial: Trial
    q: np.ndarray
    qd: np.ndarray
    moment: np.ndarray
    inertial: np.ndarray
    direction: np.ndarray
    force: np.ndarray | None
    sign: np.ndarray


@dataclass(frozen=True, eq=False)
class PassiveMoments(Tabular):
    """Passive joint moments of a data set.

    Attributes
    ----------
    trials : tuple of TrialMoments
    curves : tuple of PassiveCurve
        One for every configuration and joint that moved in both directions.
    cutoff : float
        Cutoff of the low-pass [Hz].
    warnings : tuple of str
    dataset : Dataset
    dependence : tuple of Dependence
        For every joint that moved while an adjacent one was held at different angles: the elastic moment as a function of both.
    couplings : tuple of Coupling
        For every pair of joints that were each moved while the other was held: their coupling from both.
    checks : tuple of Check
        Whether the muscles were silent and the movement slow.
    centres : tuple of str
        Where the joints are, if the path of a robot shows it.
    """

    trials: tuple[TrialMoments, ...]
    curves: tuple[PassiveCurve, ...]
    cutoff: float
    warnings: tuple[str, ...]
    dataset: Dataset = field(repr=False)
    couplings: tuple[joint_coupling.Coupling, ...] = ()
    dependence: tuple[joint_coupling.Dependence, ...] = ()
    checks: tuple[passivity_checks.Check, ...] = ()
    centres: tuple[str, ...] = ()

    method: ClassVar[str] = "passive"
    level: ClassVar[float] = LEVEL

    def __repr__(self) -> str:
        parts = [f"joint {c.joint} in {c.configuration!r}: ±{np.nanmean(c.half_width):.3g} N m" for c in self.curves]
        return f"PassiveMoments({self.dataset.name!r}; {'; '.join(parts) or 'no joint moved in both directions'})"

    def followed(self) -> tuple[Estimate, ...]:
        """Return what a history keeps, with intervals from the scatter of the repeats and from markers, which every session places anew.

        For each joint in each slow movement the mean half width of the hysteresis [N m], the stiffness [N m/rad], the range that was moved
        through [rad] and the speed [rad/s]; for each pair of joints their coupling [N m/rad].
        """
        found = []
        for curve in (c for c in self.curves if c.slow):
            own = [
                m.q[np.isfinite(m.q[:, curve.joint - 1]), curve.joint - 1]
                for m in self.trials
                if m.trial.configuration == curve.configuration
            ]
            placed = curve.placed()
            quantities = {
                "half_width": (curve.means("half_width"), "N m"),
                "stiffness": (curve.stiffness(), "N m/rad"),
                "range": (np.array([np.ptp(angles) for angles in own if angles.size]), "rad"),
                "speed": (self._speeds(curve), "rad/s"),
            }
            found += [
                _estimate(f"{name} in {curve.configuration}", curve.joint, interval_of(values, placed.get(name, 0.0)), unit)
                for name, (values, unit) in quantities.items()
            ]
        found += [_estimate(f"coupling {c.joints[0]}-{c.joints[1]}", None, c.interval, "N m/rad") for c in self.couplings]
        return tuple(found)

    def _speeds(self, curve: PassiveCurve) -> np.ndarray:
        """Return the usual speed of the joint of a curve in every repeat [rad/s]."""
        j = curve.joint - 1
        moving = [np.abs(m.qd[m.direction[:, j] != 0, j]) for m in self.trials if m.trial.configuration == curve.configuration]
        return np.array([np.median(speeds) for speeds in moving if speeds.size])

    def tidy(self) -> Tidy:
        """Return the curves, one angle a row."""
        rows = [(c, k) for c in self.curves for k in range(len(c.angle))]
        columns: dict[str, list[Any]] = {"configuration": [c.configuration for c, _ in rows], "joint": [c.joint for c, _ in rows]}
        columns |= {
            name: [float(getattr(c, name)[k]) for c, k in rows]
            for name in ("angle", "elastic", "elastic_std", "half_width", "half_width_std")
        }
        return Tidy(columns, {"angle": "rad", **dict.fromkeys(("elastic", "elastic_std", "half_width", "half_width_std"), "N m")})

    def to_dict(self) -> dict[str, Any]:
        """Return the curves as plain data."""
        return {"curves": [c.to_dict() for c in self.curves], "warnings": list(self.warnings)}


def _estimate(name: str, joint: int | None, interval: tuple[float, float], unit: str) -> Estimate:
    """Return a quantity in the middle of its interval; `std` is that of a normal distribution with this interval."""
    half = 0.5 * (interval[1] - interval[0])
    return Estimate(name, joint, "passive", 0.5 * (interval[0] + interval[1]), half / 1.96, unit, interval, "data")


@with_warnings
def passive_moments(
    dataset: Dataset | str | os.PathLike[str],
    *,
    cutoff: float = DEFAULT_CUTOFF,
    bins: int = DEFAULT_BINS,
    progress: Callable[[str, float], None] | None = None,
) -> PassiveMoments:
    """Compute the passive moment of every joint in slow movements, and its elastic and dissipative parts.

    `tau_p = J(q)^T F_on_arm - G(q) - B(q) qdd - C(q, qd) qd`, plus joint torques where they were measured: equation 3.18 of the thesis
    with the force on the arm. The thesis neglects inertial torques; here they are subtracted by the model; a check states where they are
    not small. Only the rigid arm of the model counts, with what was worn, and none of its effects.

    Parameters
    ----------
    dataset : Dataset or path
    cutoff : float
        Cutoff of the zero-phase low-pass of angles and forces, -3 dB of both passes [Hz].
    bins : int
        Angle bins over the range of each joint in each configuration.
    progress : callable, optional
        Called with the name of the stage and the share that is done, 0 to 1.

    Returns
    -------
    PassiveMoments

    Raises
    ------
    BadInput
        For settings out of range, and a trial with neither forces nor joint torques.
    """
    dataset = checks.loaded("dataset", dataset, Dataset, load_dataset)
    bins = checks.whole("bins", bins, least=2, most=1000)
    cutoff = checks.number("cutoff", cutoff, least=LEAST_CUTOFF, unit="Hz")
    tell = checks.progress(progress)
    refuse_implausible(dataset)
    given, centres = dataset, joint_centres.find(dataset)
    dataset = centres.applied(given)
    trials = tuple(trial_moments(dataset, trial, cutoff) for trial in dataset.trials)
    passivity_checks.refuse_absurd(dataset, ((m.trial, m.moment) for m in trials))
    trials, conditioned = _without_preconditioning(trials)
    curves, warnings = [], [*setup_warnings(dataset), *centres.warnings(), *conditioned]
    configurations = list(dict.fromkeys(t.configuration for t in dataset.trials))
    for k, configuration in enumerate(configurations):
        tell(f"passive moments of {configuration}", k / len(configurations))
        repeats = [m for m in trials if m.trial.configuration == configuration]
        lost = []
        for joint in range(dataset.model.n_joints):
            curve = _curve(dataset, repeats, joint, bins, centres, cutoff)
            if curve is not None:
                curves.append(curve)
                warnings += _missing_repeats(repeats, curve)
            elif any(motion_direction.moves(m.q[:, joint]) for m in repeats):
                lost.append(f"{joint + 1}")
        if lost:
            warnings.append(
                f"{configuration}: joint{'s' * (len(lost) > 1)} {', '.join(lost)} moved, but not long enough in both directions over the "
                f"same angles for a low-pass at {cutoff:g} Hz: left out"
            )
        warnings += _doubtful(dataset, repeats)
    assumptions = (passivity_checks.muscles_silent(dataset.trials), passivity_checks.slow_enough(curves, cutoff))
    if assumptions[0].passed is False:
        warnings.append(assumptions[0].text)
    warnings += passivity_checks.gives_energy([(c.configuration, c.joint, c.interval("half_width")) for c in curves])
    warnings += passivity_checks.not_slow(curves, cutoff)
    fitted = _dependence([c for c in curves if c.slow])
    both = tuple(
        joint_coupling.together(one, other)
        for one in fitted
        for other in fitted
        if (one.joint, one.adjacent) == (other.adjacent, other.joint) and one.joint < other.joint
    )
    return PassiveMoments(trials, tuple(curves), cutoff, tuple(warnings), given, both, fitted, assumptions, centres.lines(given.model))


def _missing_repeats(repeats: Sequence[TrialMoments], curve: PassiveCurve) -> list[str]:
    """Return the repeats that a curve has nothing of, a line each with the reason."""
    lines = []
    moved = [motion_direction.moves(m.q[:, curve.joint - 1]) for m in repeats]
    for m, values, moves in zip(repeats, curve.elastic_repeats, moved, strict=True):
        # Of a trial in which no joint moves, `_doubtful` says so. A joint that moves in few of the repeats was held.
        if np.isfinite(values).any() or not m.direction.any() or not (moves or 2 * sum(moved) > len(moved)):
            continue
        ways = set(m.direction[:, curve.joint - 1]) - {0}
        if not moves:
            why = f"it moves by less than {np.degrees(motion_direction.LEAST_RANGE):g}°"
        elif active := _muscles(m.trial):
            why = active
        elif len(ways) < 2:
            way = "the angle only grows" if 1 in ways else "the angle only shrinks"
            why = f"{way} in what is measured" if ways else "what is measured is too short for the low-pass"
        else:
            why = "its two directions share no angles"
        lines.append(f"{m.trial.file}: not among the repeats of joint {curve.joint}: {why}")
    return lines


def _muscles(trial: Trial) -> str | None:
    """Return that muscles are active in most of a trial; None where they are not."""
    share = float(trial.active.mean())
    return f"muscles are active in {100 * share:.0f} % of it" if share > 0.5 else None


def _without_preconditioning(trials: tuple[TrialMoments, ...]) -> tuple[tuple[TrialMoments, ...], list[str]]:
    """Return trials without the direction of first cycles that resist more than later ones, and a line for each."""
    kept, lines = list(trials), []
    for configuration in dict.fromkeys(m.trial.configuration for m in trials):
        own = [k for k, m in enumerate(trials) if m.trial.configuration == configuration]
        for joint in range(trials[0].q.shape[1]):
            courses = [(trials[k].q[:, joint], trials[k].moment[:, joint], trials[k].direction[:, joint]) for k in own]
            for found in preconditioning.find(courses):
                k = own[found.course]
                direction = kept[k].direction.copy()
                direction[found.samples, joint] = 0
                kept[k] = dataclasses.replace(kept[k], direction=direction)
                cycles, lose = ("cycle", "dissipates") if found.cycles == 1 else (f"{found.cycles} cycles", "dissipate")
                lines.append(
                    f"{trials[k].trial.file}: the first {cycles} of joint {joint + 1} {lose} {100 * found.more:.0f} % more than later "
                    "ones: left out as preconditioning"
                )
    return tuple(kept), lines


def trial_moments(dataset: Dataset, trial: Trial, cutoff: float) -> TrialMoments:
    """Return the moments with which the joints resist in one trial, low-passed at a cutoff [Hz].

    Raises
    ------
    BadInput
        For a trial with neither forces nor joint torques.
    """
    if trial.force_on_arm is None and trial.tau is None:
        raise BadInput("columns", Text("neither forces nor joint torques"), "Fy_N and Fz_N, or tau1_Nm …", file=trial.file)
    model, n = dataset.model_of(trial.configuration), dataset.model.n_joints
    chain, unit = _armrs.Arm.from_model(model), _armrs.Arm.from_model(model.replace(gravity=1.0))
    q, qd, qdd, moment, inertial, sign = (np.full((len(trial), n), np.nan) for _ in range(6))
    # Activity spoils torques and not the motion.
    measured = _long_enough(resample.complete_pieces(trial.valid | trial.active))
    for piece in measured:
        q[piece], qd[piece], qdd[piece] = _armrs.smooth(np.ascontiguousarray(trial.q[piece]), trial.rate, cutoff)
        usual = RESTING * np.percentile(np.abs(qd[piece]), 90.0, axis=0)
        moving = np.where(np.abs(qd[piece]) > usual, np.sign(qd[piece]), 0.0)
        sign[piece] = _armrs.smooth(np.ascontiguousarray(moving), trial.rate, cutoff)[0]
    seen = None if trial.force_on_arm is None else np.full((len(trial), 2), np.nan)
    for piece in measured:
        smooth = partial(low_pass.over_gaps, known=trial.valid[piece], rate=trial.rate, cutoff=cutoff)
        angle, speed, acceleration = q[piece], qd[piece], qdd[piece]
        gravity = chain.gravity(angle)
        torque = -gravity
        if trial.force_on_arm is not None:
            force = smooth(trial.force_on_arm[piece])
            torque = torque + chain.static_torque(angle, force)
            if seen is not None:
                seen[piece] = force
        if trial.moment_on_arm is not None:  # it turns every joint alike
            torque = torque + smooth(trial.moment_on_arm[piece, None])
        if trial.tau is not None:
            torque = torque + smooth(trial.tau[piece])
        inertial[piece] = chain.inverse_dynamics(angle, speed, acceleration) - gravity
        if trial.base is not None:
            inertial[piece] += _carried(unit, angle, _armrs.smooth(np.ascontiguousarray(trial.base[piece]), trial.rate, cutoff)[2])
        moment[piece] = torque - inertial[piece]
    moment[~trial.valid] = np.nan
    direction = motion_direction.directions(q, qd, np.isfinite(moment), round(MARGIN * trial.rate / cutoff))
    return TrialMoments(trial, q, qd, moment, inertial, direction, seen, sign)


def _long_enough(pieces: Sequence[slice]) -> list[slice]:
    return [piece for piece in pieces if piece.stop - piece.start >= FEWEST_SAMPLES]


def _carried(unit: _armrs.Arm, q: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    """Return the torques of a first joint that accelerates, (n, 2) [m/s²], from the weight of the arm under 1 m/s².

    What accelerates the arm acts as a weight against it, and weight along −y is weight along −z, everything turned by a right angle.
    """
    turned = q + np.eye(1, q.shape[1]) * np.pi / 2.0
    return np.asarray(acceleration[:, :1] * unit.gravity(turned) + acceleration[:, 1:] * unit.gravity(q))


def _curve(
    dataset: Dataset, repeats: Sequence[TrialMoments], joint: int, bins: int, centres: JointCentres, cutoff: float
) -> PassiveCurve | None:
    moving = [m.direction[:, joint] != 0 for m in repeats]
    samples = [m.q[keep, joint] for m, keep in zip(repeats, moving, strict=True)]
    angles = np.concatenate(samples)
    if angles.size == 0:
        return None
    edges = np.linspace(angles.min(), angles.max(), bins + 1)
    # A friction that turns with the speed went through the same low-pass as its sign did.
    (rising, ups), (falling, downs) = (_sides(repeats, joint, sign, edges) for sign in (1, -1))
    half_width = (rising - falling) / (ups - downs)
    elastic = 0.5 * (rising + falling - half_width * (ups + downs))
    if not np.isfinite(elastic).any():
        return None
    # A mean over other repeats at the next angle would jump by what differs between them.
    shared = np.isfinite(elastic[np.isfinite(elastic).any(axis=1)]).all(axis=0)
    kept = np.where(shared, 0.0, np.nan) if shared.any() else np.zeros(bins)
    errors = _systematic(dataset, repeats, (joint, repeat_statistics.slope(repeat_statistics.mean(elastic), edges)), edges, centres)
    declared = len(uncertainty.Deviations.of(dataset).vector(dataset.model.n_joints))
    systematic = [part[:declared] for part in errors]
    moved = [(m.inertial[keep, joint], m.moment[keep, joint]) for m, keep in zip(repeats, moving, strict=True)]
    inertial, moment = (np.concatenate(part) for part in zip(*moved, strict=True))
    inertial_share = float(np.sqrt(np.mean(inertial**2) / np.mean(moment**2)))
    strokes = [b for m in repeats for b in motion_direction.bandwidth(m.qd[:, joint], m.direction[:, joint], m.trial.rate)]
    # What a joint moves that is held is no movement of its own.
    bandwidth = float(np.median(strokes)) if strokes and np.ptp(edges) > joint_coupling.LEAST_HELD else float("nan")
    return PassiveCurve(
        configuration=repeats[0].trial.configuration,
        joint=joint + 1,
        repeats=int(np.isfinite(elastic).any(axis=1).sum()),
        angle=0.5 * (edges[1:] + edges[:-1]),
        rising=repeat_statistics.mean(rising) + kept,
        falling=repeat_statistics.mean(falling) + kept,
        elastic=repeat_statistics.mean(elastic) + kept,
        elastic_std=repeat_statistics.deviation(elastic) + kept,
        half_width=repeat_statistics.mean(half_width) + kept,
        half_width_std=repeat_statistics.deviation(half_width) + kept,
        inertial_share=inertial_share,
        bandwidth=bandwidth,
        slow=inertial_share <= passivity_checks.SLOW and not bandwidth >= cutoff,
        elastic_repeats=elastic,
        half_width_repeats=half_width,
        held=np.array([repeat_statistics.mean(m.q) for m in repeats]),
        elastic_systematic=uncertainty.by_jacobian(systematic[0]),
        half_width_systematic=uncertainty.by_jacobian(systematic[1]),
        elastic_errors=systematic[0],
        half_width_errors=systematic[1],
        placed_errors=np.array([part[declared:] for part in errors]),
    )


def _systematic(
    dataset: Dataset, repeats: Sequence[TrialMoments], spring: tuple[int, float], edges: np.ndarray, centres: JointCentres
) -> tuple[np.ndarray, np.ndarray]:
    """Return what errors that all samples of all repeats share do to elastic mean and half width, each (n_errors, n_bins).

    First those that are declared, as `Deviations.vector` orders them, then those of `uncertainty.placements`.
    """
    parts = [_shifts(dataset, m, spring, edges, centres) for m in repeats]
    rising, falling = (np.array([repeat_statistics.mean(errors) for errors in np.stack(each, axis=1)]) for each in zip(*parts, strict=True))
    return 0.5 * (rising + falling), 0.5 * (rising - falling)


def _shifts(
    dataset: Dataset, moments: TrialMoments, spring: tuple[int, float], edges: np.ndarray, centres: JointCentres
) -> tuple[np.ndarray, np.ndarray]:
    """Return what each shared error of its size does to the moment of a repeat, by direction, each (n_errors, n_bins)."""
    model, joint = dataset.model_of(moments.trial.configuration), spring[0]
    there = np.isfinite(moments.q).all(axis=1) & (moments.direction[:, joint] != 0)
    deviations = uncertainty.Deviations.of(dataset)
    values = np.full((len(deviations.vector(model.n_joints)) + centres.factor.shape[1], len(moments.q)), np.nan)
    if there.any():
        force = None if moments.force is None else moments.force[there]
        declared = uncertainty.sensitivity(model, moments.q[there], force, deviations)
        placed = uncertainty.placements(model, moments.q[there], force, centres.unknown(model, moments.q[there], moments.qd[there]), spring)
        values[:, there] = np.concatenate([declared[:, :, joint], placed])
    rising, falling = (np.array([_binned(moments, row, joint, sign, edges) for row in values]) for sign in (1, -1))
    return rising, falling


def _dependence(curves: Sequence[PassiveCurve]) -> tuple[joint_coupling.Dependence, ...]:
    """Fit every joint that moved in several configurations against the joint next to it, the one before where there are two."""
    found: dict[tuple[int, int], list[double_exponential.MomentCurve]] = {}
    for joint in sorted({c.joint for c in curves}):
        own = [c for c in curves if c.joint == joint and _led_by(c)]
        n = own[0].held.shape[1] if own else 1
        adjacent = joint - 1 if joint > 1 else joint + 1
        if not own or n == 1:
            continue
        courses = []
        for curve in own:
            for elastic, held in zip(curve.elastic_repeats, curve.held, strict=True):
                there = np.isfinite(elastic)
                if there.sum() >= 4:
                    known = np.nan_to_num(curve.elastic_errors[:, there].T)
                    course = (curve.angle[there], elastic[there], float(held[adjacent - 1]), curve.configuration, known)
                    courses.append(double_exponential.MomentCurve(*course))
        found[joint, adjacent] = courses
    return joint_coupling.fit_joints(found, LEVEL)


def _led_by(curve: PassiveCurve) -> bool:
    """Whether the joint moves far enough to determine a shape."""
    return bool(np.ptp(curve.angle) > joint_coupling.LEAST_HELD)


def _sides(repeats: Sequence[TrialMoments], joint: int, sign: int, edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the moments of repeats in one direction, and the low-passed sign of the speed, by angle bin, each (repeats, bins)."""
    broken = np.array([not m.trial.valid.all() for m in repeats])
    moments = np.array([_at_centres(m, joint, sign, edges) for m in repeats])
    signs = np.array([_binned(m, m.sign[:, joint], joint, sign, edges) for m in repeats])
    return repeat_statistics.completed(moments, broken), repeat_statistics.completed(signs, broken)


def _binned(moments: TrialMoments, values: np.ndarray, joint: int, sign: int, edges: np.ndarray) -> np.ndarray:
    """Return the mean of values, one a sample, in each angle bin of one direction; NaN where there are no samples."""
    own = moments.direction[:, joint] == sign
    place = np.clip(np.searchsorted(edges, moments.q[own, joint], side="right") - 1, 0, len(edges) - 2)
    count = np.bincount(place, minlength=len(edges) - 1)
    total = np.bincount(place, weights=values[own], minlength=len(edges) - 1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _at_centres(moments: TrialMoments, joint: int, sign: int, edges: np.ndarray) -> np.ndarray:
    """Return the moment at the middle of each angle bin in one direction; NaN where there are no samples.

    Where a movement turns, its bins are filled on one side only, and by another part for every repeat and direction: the mean of their
    samples belongs to the mean of their angles, and is moved from there along the slope between bins.
    """
    mean, angle = (_binned(moments, values[:, joint], joint, sign, edges) for values in (moments.moment, moments.q))
    there = np.isfinite(mean)
    if there.sum() >= 2:
        middle = 0.5 * (edges[1:] + edges[:-1])
        mean[there] += np.gradient(mean[there], angle[there]) * (middle - angle)[there]
    return mean


def _doubtful(dataset: Dataset, repeats: Sequence[TrialMoments]) -> list[str]:
    """Return what is odd in the trials of one configuration, a line each: none of it proves an error, and all of it spoils the means."""
    lines = []
    moving = [m for m in repeats if m.direction.any()]
    for m in repeats:
        there = np.isfinite(m.moment).all(axis=1)
        # Where no repeat has a direction, the movement is the cause and not a sensor, and a line on its joints states that.
        if moving and not m.direction.any():
            why = _muscles(m.trial) or "wrong unit, or a dead sensor?"
            lines.append(f"{m.trial.file}: no joint moves long enough in one direction: the trial is not used ({why})")
        if m.force is None or not there.any():
            continue
        weight = _armrs.Arm.from_model(dataset.model_of(m.trial.configuration)).gravity(m.q[there])
        share = float(np.sum((m.moment + m.inertial)[there] * weight) / max(np.sum(weight**2), 1e-300)) + 1.0
        if np.mean(np.sum(weight**2, axis=1)) > LEAST_WEIGHT**2 and not CARRIED[0] <= share <= CARRIED[1]:
            lines.append(f"{m.trial.file}: the force carries {100 * share:.2g} % of the arm's weight: check the unit (N) and force_on")
    places = np.array([repeat_statistics.mean(m.q) for m in repeats])
    for j, at in enumerate(places[np.isfinite(places).all(axis=1)].T, start=1):
        if at.size and np.ptp(at) > CENTRES_APART:
            where = (
                f"{repeats[0].trial.configuration}: the mean angle of joint {j} differs by {np.degrees(np.ptp(at)):.3g}° between repeats"
            )
            lines.append(f"{where}: another unit, swapped columns, or two configurations?")
    return lines
