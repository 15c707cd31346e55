"""The stretch reflex in fast and slow stretches of one joint: separated from elastic, viscous and dry resistance.

`R = offset + k1 x + … + k5 x⁵ + b q̇ + c sign(q̇) + ΔI q̈ + s·gain·max(0, s q̇(t−L) − threshold − slope·max(0, s (tonic − q(t−L))))`,
x the angle from its mean, s = ±1 the direction of the stretch, with an offset of its own in every trial, as tone drifts. At rest the moment
is free, as dry friction holds a joint with any torque up to its own, and so it is where muscles are active that no reflex drives. The law
is that of the effect `stretch_reflex` (Lance 1980; Levin and Feldman 1994). For given threshold, latency, tonic angle and slope the rest is
linear: variable projection (Golub and Pereyra 1973). Intervals, linearised at the optimum, are from the scatter of the trials
(`cluster_robust`), so that neither the colour of the noise nor what differs from trial to trial has to be modelled, and from the errors
that all trials share.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from .._armrs import THRESHOLD
from . import students_t
from .cluster_robust import deviations

LONGEST = 0.2
"""Longest latency that is tried [s]."""
FEWEST = 4
"""Fewest trials from which the scatter between them is estimated."""
LEVEL = 0.95
"""Probability of the intervals."""
RESTING = 0.05
"""Speed below which a joint rests [rad/s]: dry friction then holds it with any torque up to its own."""
HELD = 0.1
"""Time for which what holds a joint at rest is taken as constant, and for which an oscillation is no movement [s]."""
ELASTIC = 5
"""Degree of the polynomial that describes the springs of a joint."""
AFTER = 2.0 * LONGEST
"""Time for which a muscle may be active after a movement faster than the threshold of its reflex: latency, twitch and envelope [s]."""
BELOW = 0.8
"""Share of the threshold below which no speed sets off a reflex: an estimated threshold is that good."""
_SLIGHT = 1e-3
"""Size beside the largest below which an unknown of a trial is rounding."""
SHAPES = ("threshold", "latency", "tonic", "slope")
UNITS = {"gain": "N m s/rad", "threshold": "rad/s", "latency": "s", "tonic": "rad", "slope": "1/s"}


@dataclass(frozen=True, eq=False)
class Stretch:
    """One trial of one joint, evenly sampled.

    Attributes
    ----------
    t, q, qd, qdd : ndarray, shape (n,)
        [s, rad, rad/s, rad/s²]
    moment : ndarray, shape (n,)
        Torque with which the joint resists [N m].
    fine_q, fine_qd : ndarray, shape (n,)
        Angle and speed with less of a low-pass, which are compared with thresholds [rad, rad/s].
    smooth : callable
        The low-pass that angle and moment went through: what reflex and friction should show went through it too.
    coarser : callable
        A low-pass of half the cutoff for the fine motion: its change is an estimate of that of the one in use.
    shared : ndarray, shape (n_errors, n)
        What errors that all sessions share, each of one standard deviation, do to the moment [N m]: of masses and of the force sensor.
    placed : ndarray, shape (n_errors, n)
        The same of errors that the trials of one session share: of markers, which are placed anew for the next.
    misread : ndarray, shape (n_errors, n)
        What the latter do to the angle [rad], and so to the input speed of the reflex.
    active : ndarray of bool, shape (n,)
        Where muscles are active.
    contracted : ndarray of bool, shape (n,)
        Where they are, and no reflex drives them: the moment is free there.
    edge : int
        Samples at each end that are not fitted: a low-pass has one side of them only. A reflex still depends on their motion.
    """

    t: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    moment: np.ndarray
    fine_q: np.ndarray
    fine_qd: np.ndarray
    smooth: Callable[[np.ndarray], np.ndarray] = field(repr=False)
    coarser: Callable[[np.ndarray], np.ndarray] = field(repr=False)
    shared: np.ndarray = field(repr=False)
    placed: np.ndarray = field(repr=False)
    misread: np.ndarray = field(repr=False)
    active: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=bool), repr=False)
    contracted: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=bool), repr=False)
    edge: int = 0

    @cached_property
    def rests(self) -> tuple[slice, ...]:
        """The samples of each rest; one that a swing shorter than `HELD` interrupts is one rest."""
        return self._runs(np.abs(self.fine_qd) < RESTING)

    def _runs(self, those: np.ndarray) -> tuple[slice, ...]:
        """Return the stretches of flagged samples; what interrupts one for less than `HELD` belongs to it."""
        flagged = np.flatnonzero(those)
        if not flagged.size:
            return ()
        parts = np.split(flagged, np.flatnonzero(np.diff(self.t[flagged]) > HELD) + 1)
        return tuple(slice(own[0], own[-1] + 1) for own in parts)

    @cached_property
    def unknown(self) -> np.ndarray:
        """An orthonormal basis of the unknowns of a trial, (n_fitted, k): offset, what friction holds at rest, what contractions exert.

        These change as the joint creeps and the muscle twitches: they have a level of their own every `HELD`.
        """
        held = []
        for rest in (*self.rests, *self._runs(self.contracted)):
            part = ((self.t[rest] - self.t[rest.start]) / HELD).astype(int)
            for k in np.unique(part):
                column = np.zeros(len(self.t))
                column[rest] = part == k
                held.append(self.smooth(column))
        basis, sizes, _ = np.linalg.svd(self.inner(np.column_stack([np.ones(len(self.t)), *held])), full_matrices=False)
        return np.asarray(basis[:, sizes > _SLIGHT * sizes[0]])

    def inner(self, values: np.ndarray) -> np.ndarray:
        """Return the samples that are fitted."""
        return values[self.edge : len(values) - self.edge]

    def reduced(self, values: np.ndarray) -> np.ndarray:
        """Return the samples that are fitted, (n,) or (n, m), less the unknowns of the trial."""
        inner = self.inner(values)
        return np.asarray(inner - self.unknown @ (self.unknown.T @ inner))

    def without_contractions(self, direction: int, threshold: float) -> Stretch:
        """Return the stretch with the moment free where muscles are active and no reflex with this threshold [rad/s] acts or has acted."""
        past = round(AFTER / (self.t[1] - self.t[0]))
        speed = np.concatenate([np.zeros(past), direction * self.fine_qd])
        fastest = np.lib.stride_tricks.sliding_window_view(speed, past + 1).max(axis=1)
        return replace(self, contracted=self.active & (fastest < BELOW * threshold))

    def moved_by(self, error: np.ndarray) -> Stretch:
        """Return the stretch with an error of the angle, (n,) [rad]."""
        speed = np.gradient(error, self.t)
        return replace(self, fine_q=self.fine_q + error, fine_qd=self.fine_qd + speed, qd=self.qd + self.smooth(speed))


@dataclass(frozen=True)
class Estimated:
    """A number with its interval.

    Attributes
    ----------
    value : float
    std : float
        From the scatter of the trials and the errors that they share: calibration, anthropometry, markers, the low-pass of the motion.
    interval : tuple of float
        With both.
    unit : str
    repeatable : tuple of float
        The interval without the errors that sessions share, as they cancel in a difference: calibration, anthropometry, the low-pass.
    """

    value: float
    std: float
    interval: tuple[float, float]
    unit: str
    repeatable: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Reflex:
    """Result of the stretches of one joint.

    Attributes
    ----------
    direction : int
        1 where motion with growing angle is resisted.
    parameters : dict of Estimated
        `gain`, `threshold`, `latency`, and `tonic` and `slope` where an angle threshold is needed.
    viscosity, dry : Estimated
        Besides the reflex [N m s/rad, N m].
    found : bool
        Whether there is a reflex: its gain is above zero in the interval, and viscosity and dry friction beside it are not below it, as no
        passive joint drives itself.
    elastic, resisting, reflex : tuple of ndarray
        Elastic, viscous and dry, and reflex moment of every trial [N m].
    residual_rms : float
        [N m]
    """

    direction: int
    parameters: dict[str, Estimated]
    viscosity: Estimated
    dry: Estimated
    found: bool
    elastic: tuple[np.ndarray, ...] = field(repr=False)
    resisting: tuple[np.ndarray, ...] = field(repr=False)
    reflex: tuple[np.ndarray, ...] = field(repr=False)
    residual_rms: float


def drive(stretch: Stretch, direction: int, shape: np.ndarray) -> np.ndarray:
    """Return what a reflex of gain 1 resists with, after the low-pass [N m]; `shape` holds threshold, latency, tonic angle and slope."""
    threshold, latency, tonic, slope = shape
    ago = stretch.t - latency
    q, qd = (direction * np.interp(ago, stretch.t, values) for values in (stretch.fine_q, stretch.fine_qd))
    excess = qd - threshold - slope * np.maximum(0.0, direction * tonic - q)
    return stretch.smooth(direction * np.maximum(0.0, excess))


def fit(stretches: Sequence[Stretch]) -> Reflex | None:
    """Fit the reflex of one joint to its stretches; None where there are too few."""
    if len(stretches) < FEWEST:
        return None
    found = _fitted(stretches)
    if not found.found or not any(s.active.any() for s in stretches):
        return found
    passive = [s.without_contractions(found.direction, found.parameters["threshold"].value) for s in stretches]
    return _fitted(passive) if any(s.contracted.any() for s in passive) else found


def _fitted(stretches: Sequence[Stretch]) -> Reflex:
    problem = _Problem(stretches)
    direction, shape = min((problem.start(direction) for direction in (1, -1)), key=lambda s: problem.cost(*s))
    shape = problem.refined(direction, shape, 2)
    return problem.result(direction, *problem.with_angle(direction, shape))


def spread(stretches: Sequence[Stretch], direction: int, shape: np.ndarray, gain: float) -> np.ndarray:
    """Return the deviations of gain, threshold and latency that white noise of 1 N m in each sample leaves, by the linearised law."""
    jacobian = _Problem(stretches).jacobian(direction, shape, gain, 2)
    scale = np.linalg.norm(jacobian, axis=0) + 1e-300
    inverse = np.linalg.pinv((jacobian / scale).T @ (jacobian / scale), hermitian=True)
    return np.asarray((np.sqrt(np.diag(inverse)) / scale)[:3])


class _Problem:
    """Moments and linear columns of all trials, less their means in each trial and so without the offsets."""

    def __init__(self, stretches: Sequence[Stretch]) -> None:
        self.stretches = list(stretches)
        self.middle = float(np.mean(np.concatenate([s.q for s in stretches])))
        self.ends = np.cumsum([len(s.q) - 2 * s.edge for s in stretches])[:-1]
        self.linear = np.concatenate([s.reduced(_columns(s, self.middle)) for s in stretches])
        self.moment = np.concatenate([s.reduced(s.moment) for s in stretches])
        self.shared = np.concatenate([s.reduced(s.shared.T) for s in stretches])
        self.basis = np.linalg.qr(self.linear)[0]
        self.rest = self.moment - self.basis @ (self.basis.T @ self.moment)
        self.total = float(self.rest @ self.rest)
        self.fastest = max(float(np.percentile(np.abs(s.qd), 98.0)) for s in stretches)

    def column(self, direction: int, shape: np.ndarray) -> np.ndarray:
        """Return what a reflex of gain 1 shows in all trials."""
        return np.concatenate([s.reduced(drive(s, direction, shape)) for s in self.stretches])

    def gain(self, direction: int, shape: np.ndarray) -> tuple[float, float]:
        """Return the best gain, not below zero, and the sum of squares that it leaves."""
        own = self.column(direction, shape)
        inside = self.basis.T @ own
        size, along = float(own @ own - inside @ inside), max(0.0, float(own @ self.rest))
        return (0.0, self.total) if size < 1e-12 * len(own) else (along / size, self.total - along**2 / size)

    def cost(self, direction: int, shape: np.ndarray) -> float:
        """Return the sum of squares that is left."""
        return self.gain(direction, shape)[1]

    def start(self, direction: int) -> tuple[int, np.ndarray]:
        """Return the best of a grid of thresholds and latencies."""
        grid = [
            np.array([share * self.fastest, latency, self.middle, 0.0])
            for share in np.linspace(0.05, 0.85, 7)
            for latency in (0.0, 0.025, 0.05, 0.08, 0.12)
        ]
        return direction, min(grid, key=lambda shape: self.cost(direction, shape))

    def refined(self, direction: int, shape: np.ndarray, free: int) -> np.ndarray:
        """Return the shape with its first `free` numbers at the minimum nearby (Nelder and Mead 1965: the law has kinks)."""
        from scipy.optimize import minimize

        scale = np.array([self.fastest, 0.1, 1.0, 10.0])[:free]
        limits = np.array([(0.0, 1.0), (0.0, LONGEST / 0.1), (-7.0, 7.0), (0.0, 10.0)])[:free]
        begin = shape[:free] / scale

        def of(values: np.ndarray) -> float:
            return self.cost(direction, np.concatenate([values * scale, shape[free:]]))

        simplex = np.clip(np.vstack([begin, begin + 0.15 * np.eye(free)]), *limits.T)
        options = {"initial_simplex": simplex, "xatol": 3e-4, "fatol": 1e-7 * self.total, "maxfev": 80 * free}
        found = minimize(of, begin, method="Nelder-Mead", bounds=limits, options=options)
        return np.concatenate([found.x * scale, shape[free:]])

    def with_angle(self, direction: int, shape: np.ndarray) -> tuple[np.ndarray, int]:
        """Return the shape, with an angle threshold if it gains what `armrs gap` requires, and how many numbers of it are free."""
        angles = np.percentile(np.concatenate([s.q for s in self.stretches]), (25.0, 60.0, 95.0))
        starts = [
            np.array([share * shape[0], shape[1], angle, slope])
            for share in (0.3, 1.0)
            for angle in angles
            for slope in (0.3 * self.fastest, self.fastest)
        ]
        best = min(starts, key=lambda s: self.cost(direction, s))
        wider = self.refined(direction, best, 4)
        n = self._independent(self.residual(direction, wider))
        gained = n * np.log(self.cost(direction, shape) / max(self.cost(direction, wider), 1e-300))
        return (wider, 4) if gained > THRESHOLD + 2.0 * np.log(n) else (shape, 2)

    def residual(self, direction: int, shape: np.ndarray) -> np.ndarray:
        """Return what is left of the moments."""
        left = self.moment - self.gain(direction, shape)[0] * self.column(direction, shape)
        return left - self.basis @ (self.basis.T @ left)

    def _independent(self, left: np.ndarray) -> float:
        """Return the number of independent samples, by the correlation of what is left with itself up to half a second."""
        parts = [(s, p) for s, p in zip(self.stretches, np.split(left, self.ends), strict=True)]
        count = 0.0
        for stretch, part in parts:
            lags = min(len(part) - 1, round(0.5 / (stretch.t[1] - stretch.t[0])))
            size = max(float(part @ part), 1e-300)
            correlation = np.array([float(part[k:] @ part[:-k]) / size for k in range(1, lags)])
            # Up to the first that is none: beyond it is noise.
            correlation = correlation[: int(np.argmax(correlation < 0.0))] if np.any(correlation < 0.0) else correlation
            count += len(part) / (1.0 + 2.0 * float(correlation.sum()))
        return max(count, 8.0)

    def jacobian(self, direction: int, shape: np.ndarray, gain: float, free: int) -> np.ndarray:
        """Return the derivatives of the moments to gain, the first `free` numbers of the shape, and the linear coefficients."""
        steps = np.array([0.01 * self.fastest, 2e-3, 0.02, 0.02 * self.fastest])
        slopes = []
        for k in range(free):
            up, down = shape.copy(), shape.copy()
            up[k] += steps[k]
            down[k] = max(down[k] - steps[k], 0.0) if k != 2 else down[k] - steps[k]
            slopes.append(gain * (self.column(direction, up) - self.column(direction, down)) / (up[k] - down[k]))
        return np.column_stack([self.column(direction, shape), *slopes, self.linear])

    def _deviations(self, direction: int, shape: np.ndarray, free: int) -> np.ndarray:
        """Return of gain, shape, viscosity and dry friction, linearised at the optimum, (4, 7).

        Deviations by scatter, degrees of freedom, deviations by errors of one session and by errors that all sessions share.
        """
        jacobian = self.jacobian(direction, shape, self.gain(direction, shape)[0], free)
        found = deviations(np.split(jacobian, self.ends), np.split(self.residual(direction, shape), self.ends))
        none = np.array([0.0, 1.0, 0.0, 0.0])[:, None] * np.ones(4 - free)
        scale = np.linalg.norm(jacobian, axis=0) + 1e-300
        lost, placed = self._motion_errors(direction, shape)
        moved = (
            np.linalg.norm(np.linalg.lstsq(jacobian / scale, errors, rcond=None)[0], axis=1) / scale
            for errors in (placed, np.column_stack([self.shared, lost]))
        )
        known = np.array([*found, *moved])
        return np.concatenate([known[:, : 1 + free], none, known[:, 1 + free + ELASTIC : 3 + free + ELASTIC]], axis=1)

    def _motion_errors(self, direction: int, shape: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what a coarser low-pass of the motion changes, (n,), and what misplaced markers change, (n, n_errors) [N m]."""
        gain = self.gain(direction, shape)[0]
        linear = np.linalg.lstsq(self.linear, self.moment - gain * self.column(direction, shape), rcond=None)[0]
        lost, placed = [], []
        for own in self.stretches:
            coarse = replace(own, fine_q=own.coarser(own.fine_q), fine_qd=own.coarser(own.fine_qd))
            dry = linear[ELASTIC + 1]
            seen, told = (gain * drive(s, direction, shape) + dry * _dry(s) for s in (own, coarse))
            lost.append(own.reduced(seen - told))
            own_law, *moved = (
                _columns(s, self.middle) @ linear + gain * drive(s, direction, shape) for s in (own, *map(own.moved_by, own.misread))
            )
            placed.append(own.reduced(own.placed.T - np.array([law - own_law for law in moved]).T))
        return np.concatenate(lost), np.concatenate(placed)

    def result(self, direction: int, shape: np.ndarray, free: int) -> Reflex:
        """Return what was found."""
        gain = self.gain(direction, shape)[0]
        column = self.column(direction, shape)
        linear = np.linalg.lstsq(self.linear, self.moment - gain * column, rcond=None)[0]
        values = np.array([gain, *shape, *linear[ELASTIC : ELASTIC + 2]])
        scatter, freedom, placed, shared = self._deviations(direction, shape, free)
        normal = students_t.quantile(LEVEL, np.inf)
        half = np.hypot(np.array([students_t.quantile(LEVEL, f) for f in freedom]) * scatter, normal * placed)
        whole, std = np.hypot(half, normal * shared), np.sqrt(scatter**2 + placed**2 + shared**2)
        least = np.array([0.0, 0.0, 0.0, -np.inf, 0.0, -np.inf, -np.inf])
        names, units = ("gain", *SHAPES), (*UNITS.values(), "N m s/rad", "N m")
        numbers = [
            Estimated(float(v), float(s), (float(max(v - w, low)), float(v + w)), unit, (float(max(v - h, low)), float(v + h)))
            for v, s, w, h, low, unit in zip(values, std, whole, half, least, units, strict=True)
        ]
        told = [(_columns(s, self.middle), gain * drive(s, direction, shape)) for s in self.stretches]
        return Reflex(
            direction=direction,
            parameters=dict(zip(names[: 1 + free], numbers[: 1 + free], strict=True)),
            viscosity=numbers[5],
            dry=numbers[6],
            found=bool(values[0] - half[0] > 0.0 and min(numbers[5].interval[1], numbers[6].interval[1]) > 0.0),
            elastic=tuple(_from_start(c[:, :ELASTIC] @ linear[:ELASTIC]) for c, _ in told),
            resisting=tuple(_from_start(c[:, ELASTIC : ELASTIC + 2] @ linear[ELASTIC : ELASTIC + 2]) for c, _ in told),
            reflex=tuple(_from_start(late) for _, late in told),
            residual_rms=float(np.sqrt(np.mean(self.residual(direction, shape) ** 2))),
        )


def _from_start(values: np.ndarray) -> np.ndarray:
    """Return a part of the moment from its value at the beginning of the trial on."""
    return values - values[0]


def _columns(stretch: Stretch, middle: float) -> np.ndarray:
    """Return what the moment is linear in, besides offset and reflex."""
    # What is not linear in the motion is computed before the low-pass, as joints do.
    x = stretch.fine_q - middle
    springs = (stretch.smooth(x**k) for k in range(1, ELASTIC + 1))
    return np.column_stack([*springs, stretch.qd, _dry(stretch), stretch.qdd])


def _dry(stretch: Stretch) -> np.ndarray:
    """Return what dry friction of 1 N m shows while the joint moves."""
    signs = np.sign(stretch.fine_qd)
    for rest in stretch.rests:
        signs[rest] = 0.0
    return stretch.smooth(signs)
