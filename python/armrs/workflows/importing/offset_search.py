"""Clock offset of force recordings by correlation with posture and acceleration, for all recordings of a session together.

Only the posture is used, whatever the convention of the angles: forces are regressed on sines and cosines of the sums of neighbouring
angles, which gravity of a moving arm consists of, on their second derivatives, which its inertia consists of, and on speeds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import BadInput, Text

_RATE, _LEAST_RATE = 50.0, 10.0
"""Rate at which signals are compared, and that of the longest recordings [Hz]."""
_SAMPLES = 12_000
"""Samples of a recording from which on the rate is less."""
_COARSE = 0.04
"""Steps of the offset [s]."""
_OFFSETS = 3000
"""As many are tried at most."""
_CREEP = 0.02
"""Speed at which friction has most of its size [rad/s]."""
_OVERLAP = 0.6
"""Least part of the angles that forces must cover."""
_ALIKE = 3.0
"""Offsets that leave at most this many times as much unexplained as the best may be the right one."""
_MOST = 6
"""As many are kept at most."""
_EXPLAINED = 0.6
"""Least share of the force's variance that the movement must explain: less is no match."""
_ROUNDS = 6
"""Rounds in which the offset of each recording is searched for beside those of the others."""
_STARTS, _LEAST_SEPARATION = 4, 0.35
"""Recordings that the search begins with, the clearest ones: of which offsets so far [s] from the best are the worst."""
_RIDGE = 1e-9
"""Regressors that cannot be distinguished share what they explain; relative to their size."""
AVERAGED = 0.1
"""Angles and forces are averaged over this before angles are differentiated [s]."""
_SMOOTHED, _TIMES = 0.12, 3
"""Regressors and forces alike are averaged over this [s], so many times: a low-pass of 2.2 Hz, after which accelerations are no noise."""
FINE = 2
"""Samples before that to one of the comparison."""
EDGE = 0.15
"""Samples so near to the end of a recording hold less than the others [s]: beyond lies a hundredth of the weight of the low-pass."""


def smoothed(columns: np.ndarray, rate: float) -> np.ndarray:
    """Return columns after the low-pass, and of their samples one in `FINE`."""
    box = np.ones(2 * round(0.5 * _SMOOTHED * rate) + 1)
    kernel = box
    for _ in range(_TIMES - 1):
        kernel = np.convolve(kernel, box)
    flat = columns.reshape(len(columns), -1)
    if len(flat) < len(kernel):
        return columns[::FINE]
    weight = np.convolve(np.ones(len(flat)), kernel, "same")[::FINE]
    found = [np.convolve(column, kernel, "same")[::FINE] / weight for column in flat.T]
    return np.column_stack(found).reshape(-1, *columns.shape[1:])


def averaged(t: np.ndarray, values: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Return means of a signal over windows.

    Parameters
    ----------
    t : ndarray, shape (n,)
        Time of the samples [s], ascending.
    values : ndarray, shape (n, m)
        Straight between samples; windows that would reach beyond them are less wide.
    rate : float
        Of what is returned [Hz].

    Returns
    -------
    (ndarray, shape (k,), ndarray, shape (k, m))
        Times [s] and means.
    """
    at = np.arange(t[0], t[-1], 1.0 / rate)
    steps = np.diff(t)[:, None]
    sums = np.vstack([np.zeros(values.shape[1]), np.cumsum(0.5 * steps * (values[1:] + values[:-1]), axis=0)])

    def until(end: np.ndarray) -> np.ndarray:
        k = np.clip(np.searchsorted(t, end, side="right") - 1, 0, len(t) - 2)
        into = (end - t[k])[:, None]
        slope = (values[k + 1] - values[k]) / steps[k]
        return np.asarray(sums[k] + into * (values[k] + 0.5 * into * slope))

    low, high = np.clip(at - 0.5 * AVERAGED, t[0], t[-1]), np.clip(at + 0.5 * AVERAGED, t[0], t[-1])
    return at, (until(high) - until(low)) / np.maximum(high - low, 1e-9)[:, None]


@dataclass(frozen=True, eq=False)
class Match:
    """Regression of the forces of one recording on its movement, at every offset.

    Attributes
    ----------
    shifts : ndarray, shape (s,)
        What is added to the time of the forces [s].
    gram : ndarray, shape (s, p, p)
        Products of the regressors, summed over the samples that have forces.
    cross : ndarray, shape (s, p, 2)
        Those of regressors and forces.
    power, total : ndarray, shape (s,)
        Squares of the forces, and of their deviations from the mean.
    """

    shifts: np.ndarray
    gram: np.ndarray
    cross: np.ndarray
    power: np.ndarray
    total: np.ndarray

    @classmethod
    def of(cls, t: np.ndarray, q: np.ndarray, force_t: np.ndarray, force: np.ndarray, within: float = np.inf) -> Match:
        """Return that of one recording.

        Parameters
        ----------
        t, q
            Time [s] and angles [rad] in any convention, shape (n, n_joints).
        force_t, force
            Time [s] and forces [N] by another clock, shape (m, 2).
        within : float
            Largest offset [s].
        """
        good, seen = np.isfinite(q).all(axis=1), np.isfinite(force).all(axis=1)
        t, q, force_t, force = t[good], q[good], force_t[seen], force[seen]
        longest = max(t[-1] - t[0], force_t[-1] - force_t[0])
        rate = float(np.clip(_SAMPLES / max(longest, 1e-9), _LEAST_RATE, _RATE))
        (grid, angles), (clock, values) = (averaged(*signal, FINE * rate) for signal in ((t, q), (force_t, force)))
        features, values = smoothed(_features(angles, FINE * rate), FINE * rate), smoothed(values, FINE * rate)
        grid, clock = grid[::FINE], clock[::FINE]
        lags, low, high = _lags(grid, clock, rate, within)
        squares, sums = _sums(np.sum(values**2, axis=1)), _sums(values)
        power = squares[high - lags] - squares[low - lags]
        mean = sums[high - lags] - sums[low - lags]
        cross = np.stack([_correlated(features, column, lags) for column in values.T], axis=2)
        total = power - np.sum(mean**2, axis=1) / np.maximum(high - low, 1)
        return cls(grid[0] - clock[0] + lags / rate, _grams(features[:, None, :], low, high), cross, power, total)

    @classmethod
    def of_motion(
        cls, grid: np.ndarray, design: np.ndarray, jacobian: np.ndarray, clock: np.ndarray, force: np.ndarray, within: float = np.inf
    ) -> Match:
        """Return that of the equation of motion: `design` times unknowns is the torque of the contact force.

        Parameters
        ----------
        grid, design, jacobian
            Time [s], shape (n,); regressors, shape (n, n_joints, p); and of the hand, shape (n, 2, n_joints).
        clock, force
            Time [s] and forces on the arm [N] by another clock, shape (m, 2), at the same rate.
        within : float
            Largest offset [s].
        """
        rate = 1.0 / float(grid[1] - grid[0])
        lags, low, high = _lags(grid, clock, rate, within)
        turned = np.einsum("nkj,njp->nkp", jacobian, design)
        cross = sum(_correlated(turned[:, k], force[:, k], lags) for k in range(2))
        weights = np.einsum("nkj,nlj->nkl", jacobian, jacobian)
        pairs = [(k, m) for k in range(2) for m in range(2)]
        power = sum(_correlated(weights[:, k, m : m + 1], force[:, k] * force[:, m], lags)[:, 0] for k, m in pairs)
        sums = sum(_correlated(jacobian[:, k], force[:, k], lags) for k in range(2))
        total = power - np.sum(np.square(sums), axis=1) / np.maximum(high - low, 1)
        shifts = grid[0] - clock[0] + lags / rate
        return cls(shifts, _grams(design, low, high), np.asarray(cross)[:, :, None], np.asarray(power), np.asarray(total))

    def own(self) -> np.ndarray:
        """Return the share that the law which suits this recording best leaves at every offset."""
        return _left(self.gram, self.cross, self.power) / np.maximum(self.total, 1e-300)

    def peaks(self, left: np.ndarray) -> list[float]:
        """Return offsets that leave less than those beside them and little more than the best, the best first [s]."""
        around = np.pad(left, 1, constant_values=np.inf)
        found = np.flatnonzero((left <= around[:-2]) & (left < around[2:]) & (left <= _ALIKE * left.min()))
        return [float(self.shifts[k]) for k in sorted(found, key=lambda k: left[k])[:_MOST]]

    def at(self, seconds: np.ndarray) -> np.ndarray:
        """Return the index of the offset next to each of these."""
        return np.asarray(np.clip(np.round((seconds - self.shifts[0]) / max(self.step, 1e-9)), 0, len(self.shifts) - 1), dtype=int)

    @property
    def step(self) -> float:
        """Between two offsets [s]."""
        return float(self.shifts[1] - self.shifts[0]) if len(self.shifts) > 1 else _COARSE

    def check(self) -> None:
        """Refuse forces that belong to no part of the movement."""
        best = 1.0 - float(self.own().min()) if len(self.shifts) else 0.0
        if best < _EXPLAINED:
            said = Text(f"{100 * best:.0f} % of the forces explained by the movement at the best offset")
            raise BadInput("clock of the forces", said, f"at least {100 * _EXPLAINED:.0f} %", hint="do the forces belong to this trial?")


def together(matches: Sequence[Match]) -> list[list[float]]:
    """Return for each recording the offsets at which the movement explains its forces about equally well, the best first [s].

    Forces of all recordings follow one law of the movement. The one that suits all best, as where one trigger
    starts both devices, stands second.
    """
    if len(matches) == 1:
        return [matches[0].peaks(matches[0].own())]
    common = _common(matches)
    sharp = sorted(range(len(matches)), key=lambda k: -_sharpness(matches[k]))
    found = [_descended(matches, _grown(matches, first, sharp)) for first in sharp[:_STARTS]]
    if common is not None:
        found.append(_descended(matches, common))
    best = min(found, key=lambda chosen: _unexplained(matches, chosen))
    offsets = []
    for i, (m, k) in enumerate(zip(matches, best, strict=True)):
        first = [float(m.shifts[n]) for n in ([k] if common is None else [k, common[i]])]
        left = _beside(m, _rest(matches, best, i), alone=True)
        offsets.append([*first, *(s for s in m.peaks(left) if abs(s - first[0]) > 1.5 * m.step)][:_MOST])
    return offsets


_Sums = tuple[np.ndarray, np.ndarray, float, float]
"""Products of regressors, those with forces, squares of forces and of their deviations from the mean, over several recordings."""


def _rest(matches: Sequence[Match], chosen: Mapping[int, int] | Sequence[int], without: int) -> _Sums:
    """Return the sums over the recordings that have an offset, but for one."""
    pairs = [(matches[i], k) for i, k in (chosen.items() if isinstance(chosen, Mapping) else enumerate(chosen)) if i != without]
    gram, cross = (np.sum([getattr(m, name)[k] for m, k in pairs], axis=0) for name in ("gram", "cross"))
    return gram, cross, sum(float(m.power[k]) for m, k in pairs), sum(float(m.total[k]) for m, k in pairs)


def _beside(match: Match, rest: _Sums, *, alone: bool = False) -> np.ndarray:
    """Return the share that one law of this recording and the rest leaves, at every offset: of all forces, or of its own."""
    gram, cross, power, total = rest
    left = _left(match.gram + gram, match.cross + cross, match.power + power)
    if alone:
        return (left - float(_left(gram[None], cross[None], np.array([power]))[0])) / np.maximum(match.total, 1e-300)
    return left / np.maximum(match.total + total, 1e-300)


def _unexplained(matches: Sequence[Match], chosen: Sequence[int]) -> float:
    return float(_beside(matches[0], _rest(matches, chosen, 0))[chosen[0]])


def _sharpness(match: Match) -> float:
    """Return how many times more the second best offset of a recording leaves than the best."""
    left = match.own()
    first = match.peaks(left)
    apart = np.abs(match.shifts - first[0]) > _LEAST_SEPARATION if first else np.zeros(len(left), dtype=bool)
    return float(left[apart].min() / max(left.min(), 1e-300)) if apart.any() else float("inf")


def _grown(matches: Sequence[Match], first: int, order: Sequence[int]) -> list[int]:
    """Return offsets that are found one after the other, beginning with the best one of a recording."""
    chosen = {first: int(matches[first].own().argmin())}
    for k in order:
        if k != first:
            chosen[k] = int(_beside(matches[k], _rest(matches, chosen, k)).argmin())
    return [chosen[k] for k in range(len(matches))]


def _descended(matches: Sequence[Match], chosen: Sequence[int]) -> list[int]:
    """Return the offsets to which the best of each recording beside those of the others leads."""
    found = list(chosen)
    for _ in range(_ROUNDS):
        before = list(found)
        for k, match in enumerate(matches):
            found[k] = int(_beside(match, _rest(matches, found, k)).argmin())
        if found == before:
            break
    return found


def _common(matches: Sequence[Match]) -> list[int] | None:
    """Return the offset at which one clock of all forces explains them best, by its index in each; None where none suits all."""
    low, high = max(m.shifts[0] for m in matches), min(m.shifts[-1] for m in matches)
    if high < low:
        return None
    seconds = np.arange(low, high + 1e-9, min(m.step for m in matches))
    places = [m.at(seconds) for m in matches]
    gram = np.sum([m.gram[k] for m, k in zip(matches, places, strict=True)], axis=0)
    cross = np.sum([m.cross[k] for m, k in zip(matches, places, strict=True)], axis=0)
    power, total = (np.sum([getattr(m, name)[k] for m, k in zip(matches, places, strict=True)], axis=0) for name in ("power", "total"))
    best = int((_left(gram, cross, power) / np.maximum(total, 1e-300)).argmin())
    return [int(k[best]) for k in places]


def _left(gram: np.ndarray, cross: np.ndarray, power: np.ndarray) -> np.ndarray:
    """Return the sums of squares that least squares leave."""
    size = np.sqrt(np.maximum(np.diagonal(gram, axis1=-2, axis2=-1), 1e-300))
    scaled = gram / (size[..., :, None] * size[..., None, :]) + _RIDGE * np.eye(gram.shape[-1])
    right = cross / size[..., None]
    return np.asarray(np.maximum(power - np.einsum("spk,spk->s", np.linalg.solve(scaled, right), right), 0.0))


def _lags(grid: np.ndarray, clock: np.ndarray, rate: float, within: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return offsets in samples, and the first sample that has forces at each, and the one behind the last."""
    m, n = len(grid), len(clock)
    covered, first = int(np.ceil(_OVERLAP * m)), grid[0] - clock[0]
    step = max(1, round(_COARSE * rate), -(-(m + n - 2 * covered) // _OFFSETS))
    lags = np.arange(covered - n, m - covered + 1, step)
    lags = lags[np.abs(first + lags / rate) <= within]
    return lags, np.maximum(lags, 0), np.minimum(lags + n, m)


def _grams(design: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    products = _sums(np.einsum("njp,njq->npq", design, design))
    return np.asarray(products[high] - products[low])


def _features(q: np.ndarray, rate: float) -> np.ndarray:
    sums = [q[:, a : b + 1].sum(axis=1) for a in range(q.shape[1]) for b in range(a, q.shape[1])]
    waves = np.column_stack([f(s) for s in sums for f in (np.sin, np.cos)])
    speeds = np.gradient(q, 1.0 / rate, axis=0)
    inertial = np.gradient(np.gradient(waves, 1.0 / rate, axis=0), 1.0 / rate, axis=0)
    return np.column_stack([np.ones(len(q)), waves, inertial, speeds, np.tanh(speeds / _CREEP)])


def _sums(values: np.ndarray) -> np.ndarray:
    """Return sums over the first 0, 1, … samples."""
    return np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])


def _correlated(features: np.ndarray, values: np.ndarray, lags: np.ndarray) -> np.ndarray:
    """Return sums of products of regressors and a signal, shape (lags, p), where sample `i` belongs to sample `i - lag` of the signal."""
    length = 1 << int(np.ceil(np.log2(len(features) + len(values))))
    spectrum = np.conj(np.fft.rfft(values, length))
    return np.asarray(np.fft.irfft(np.fft.rfft(features, length, axis=0) * spectrum[:, None], length, axis=0)[lags])
