"""Where simulation and data disagree: the joint torque that a model lacks, over time, angle and direction of motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ... import _armrs
from ..._armrs import Place, SimulatedTrial
from ...io.dataset import Dataset
from ...io.trial import Trial

_MOVING = 0.1
"""Share of a joint's fastest speed in a trial below which it counts as resting."""
_FEWEST = 16
"""Fewest samples of a region that is compared."""
_LEAST_SAMPLES = 3
"""Samples of one trial below which a cell of a map was not visited."""


@dataclass(frozen=True, eq=False)
class Discrepancy:
    """The resisting torque that a model lacks in one trial.

    Attributes
    ----------
    trial : Trial
    torque : ndarray, shape (n, n_joints)
        Positive where the joint resists a growing angle more than the model does [N m].
    q, qd : ndarray, shape (n, n_joints)
        Angles and speeds of the joints [rad, rad/s]: simulated for a led arm, else measured.
    counted : ndarray of bool, shape (n, n_joints)
        Samples over which the gap of each joint is measured; not those that a disturbance has touched.
    """

    trial: Trial
    torque: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    counted: np.ndarray

    def valid(self, joint: int) -> np.ndarray:
        """Return which samples of a joint (zero-based) were measured and count, shape (n,)."""
        return np.asarray(self.trial.valid, dtype=bool) & self.counted[:, joint]


def discrepancies(dataset: Dataset, led: bool, plays: Sequence[SimulatedTrial], version: str) -> list[Discrepancy]:
    """Return the torque that a model lacks in every trial that it could be simulated on.

    Parameters
    ----------
    dataset : Dataset
    led : bool
        Whether channels are angles and forces of the closed chain; else they are joint torques.
    plays : sequence of SimulatedTrial
    version : {"given", "calibrated", "amended"}

    Notes
    -----
    For a led arm the forces and angles are carried to the joints as if it stood: what is left of inertia when simulation and
    measurement nearly agree is neglected.
    """
    n, body, listed = dataset.model.n_joints, _armrs.Arm.from_model(dataset.model), []

    def carried(channels: np.ndarray) -> np.ndarray:
        q, force = np.ascontiguousarray(channels[:, :n]), channels[:, n:]
        through = np.einsum("tij,ti->tj", np.asarray(body.jacobian(q))[:, :2, :], force)
        return through - np.asarray(body.gravity(q))

    for trial, play in zip(dataset.trials, plays, strict=True):
        measured, simulated = play.measured, play.shown[version]
        if simulated is None:
            continue
        if led:
            q = simulated[:, :n]
            counted = np.repeat(play.counted.all(axis=1, keepdims=True), n, axis=1)
            listed.append(Discrepancy(trial, carried(measured) - carried(simulated), q, np.gradient(q, 1.0 / trial.rate, axis=0), counted))
        else:
            speed = np.gradient(trial.q, 1.0 / trial.rate, axis=0) if trial.dq is None else trial.dq
            listed.append(Discrepancy(trial, measured - simulated, np.asarray(trial.q), np.asarray(speed), play.counted))
    return listed


def places(found: Sequence[Discrepancy], most: int = 40) -> tuple[Place, ...]:
    """Return where fit trials and model disagree, the clearest first: trial, joint, and direction of motion."""
    listed = []
    for one in found:
        if one.trial.role != "fit":
            continue
        for j in range(one.q.shape[1]):
            torque, speed = one.torque[:, j], one.qd[:, j]
            limit = _MOVING * np.max(np.abs(speed), initial=0.0)
            for condition, region in (("> 0", speed > limit), ("< 0", speed < -limit), ("= 0", np.abs(speed) <= limit)):
                chosen = np.flatnonzero(region & one.valid(j))
                if len(chosen) < _FEWEST:
                    continue
                mean = float(np.mean(torque[chosen]))
                error = _standard_error(torque[chosen])
                if error > 0 and abs(mean) > 3 * error:
                    t = one.trial.t[chosen]
                    where = (one.trial.file, f"tau{j + 1}_Nm", float(t[0]), float(t[-1]), j + 1, f"dq{j + 1} {condition}")
                    listed.append(Place(*where, mean, mean / error))
    return tuple(sorted(listed, key=lambda p: -abs(p.z))[:most])


def _standard_error(values: np.ndarray) -> float:
    """Return the standard error of a mean of correlated samples: an autoregression of first order."""
    centred = values - values.mean()
    variance = float(np.mean(centred**2))
    if variance == 0.0:
        return 0.0
    memory = min(max(float(np.mean(centred[1:] * centred[:-1])) / variance, 0.0), 0.99)
    return math.sqrt(variance / len(values) * (1 + memory) / (1 - memory))


@dataclass(frozen=True, eq=False)
class Map:
    """Mean torque that a model lacks in one joint, by angle and speed.

    Attributes
    ----------
    angle, speed : ndarray, shape (a + 1,), (s + 1,)
        Edges of the cells [rad, rad/s].
    torque : ndarray, shape (s, a)
        Means over trials [N m]; NaN where too few samples fall.
    clear : ndarray of bool, shape (s, a)
        Where the mean is more than twice its standard error, by the scatter between trials.
    """

    angle: np.ndarray
    speed: np.ndarray
    torque: np.ndarray
    clear: np.ndarray


def residual_map(found: Sequence[Discrepancy], joint: int, cells: tuple[int, int] = (14, 9), role: str = "fit") -> Map:
    """Return the map of one joint (zero-based) over the trials of a role, with so many cells of angle and of speed."""
    own = [d for d in found if d.trial.role == role]
    q, qd = (np.concatenate([getattr(d, name)[d.valid(joint), joint] for d in own]) for name in ("q", "qd"))
    angle = np.linspace(q.min(), q.max() if np.ptp(q) > 0 else q.min() + 1e-9, cells[0] + 1)
    fast = float(np.quantile(np.abs(qd), 0.995)) or 1e-9
    speed = np.linspace(-fast, fast, cells[1] + 1)
    means = []
    for d in own:
        valid = d.valid(joint)
        column = np.clip(np.searchsorted(angle, d.q[valid, joint], side="right") - 1, 0, cells[0] - 1)
        row = np.clip(np.searchsorted(speed, d.qd[valid, joint], side="right") - 1, 0, cells[1] - 1)
        count, total = np.zeros((cells[1], cells[0])), np.zeros((cells[1], cells[0]))
        np.add.at(count, (row, column), 1.0)
        np.add.at(total, (row, column), d.torque[valid, joint])
        means.append(np.where(count >= _LEAST_SAMPLES, total / np.maximum(count, 1.0), np.nan))
    trials = np.array(means)
    there = np.isfinite(trials)
    number = there.sum(axis=0)
    mean = np.where(number > 0, np.where(there, trials, 0.0).sum(axis=0) / np.maximum(number, 1), np.nan)
    square = np.where(there, (trials - mean) ** 2, 0.0).sum(axis=0)
    error = np.sqrt(square / np.maximum(number - 1, 1) / np.maximum(number, 1))
    return Map(angle, speed, mean, (number > 1) & (np.abs(np.nan_to_num(mean)) > 2.0 * error))


_CLEAR = 0.15
"""Share of the square of the residual that a dependence must describe to be stated."""
_ALONE = 4.0
"""How much more than the middle one a trial must hold of what is left to be the only one."""


def shape(found: Sequence[Discrepancy]) -> str | None:
    """Describe the residual in words: in which joint it is, and on what it depends; None where there is none.

    The joint is the one with the largest residual common to the repeats of a movement. The whole residual would favour the joint with the
    longest lever arm, where the force noise is largest. Shares refer to the mean square of the torque in the fit trials, about its mean.
    """
    own = [d for d in found if d.trial.role == "fit" and all(d.valid(j).sum() >= _FEWEST for j in range(d.q.shape[1]))]
    if not own:
        return None
    size = np.array([[float(np.mean(d.torque[d.valid(j), j] ** 2)) for j in range(d.q.shape[1])] for d in own])
    shared = np.array([_shared(own, j) for j in range(size.shape[1])])
    j = int(np.argmax(shared if shared.any() else size.mean(axis=0)))
    where = f"joint {j + 1} ({math.sqrt(float(shared[j] or size[:, j].mean())):.2g} N m, root mean square)"
    if len(own) > 2 and size[:, j].max() > _ALONE * max(float(np.median(size[:, j])), 1e-300):
        worst = own[int(np.argmax(size[:, j]))]
        return f"most of it lies in {where}, and in one trial, {worst.trial.file}"
    shares = {name: _described(own, j, columns) for name, columns in _FEATURES.items()}
    name = max(shares, key=lambda k: shares[k])
    if shares[name] < _CLEAR:
        return f"most of it lies in {where}; it follows neither angle, speed nor time of the movement clearly"
    return f"most of it lies in {where}; {shares[name]:.0%} of it follows {name}"


def _shared(own: Sequence[Discrepancy], j: int) -> float:
    """Return the mean square of the residual common to repeats in joint `j` [N² m²]; without repeats, of the whole residual."""
    squares, samples = 0.0, 0
    for configuration in dict.fromkeys(d.trial.configuration for d in own):
        repeats = [np.where(d.valid(j), d.torque[:, j], np.nan) for d in own if d.trial.configuration == configuration]
        stack = np.array([r[: min(map(len, repeats))] for r in repeats])
        stack = stack[:, np.isfinite(stack).all(axis=0)]
        number, length = stack.shape
        scatter = float(stack.var(axis=0, ddof=1).sum()) / number if number > 1 else 0.0
        squares += float((stack.mean(axis=0) ** 2).sum()) - scatter
        samples += length
    return max(squares, 0.0) / max(samples, 1)


def _described(own: Sequence[Discrepancy], j: int, columns: Any) -> float:
    """Return the share of what is left in joint `j` that a linear combination of columns describes."""
    rows = [np.column_stack([np.ones(d.valid(j).sum()), *(c[d.valid(j)] for c in columns(d, j))]) for d in own]
    matrix, left = np.concatenate(rows), np.concatenate([d.torque[d.valid(j), j] for d in own])
    left = left - left.mean()
    matrix = matrix / np.maximum(np.abs(matrix).max(axis=0), 1e-300)
    solution = np.linalg.lstsq(matrix, left, rcond=None)[0]
    whole = float(left @ left)
    return 1.0 - float(np.sum((left - matrix @ solution) ** 2)) / whole if whole > 0 else 0.0


def _direction(d: Discrepancy, j: int) -> np.ndarray:
    return np.tanh(d.qd[:, j] / max(_MOVING * float(np.max(np.abs(d.qd[:, j]))), 1e-9))


def _neighbour(d: Discrepancy, j: int) -> np.ndarray:
    return d.q[:, j - 1 if j > 0 else min(1, d.q.shape[1] - 1)]


_FEATURES = {
    "the direction of motion": lambda d, j: [_direction(d, j)],
    "the speed": lambda d, j: [d.qd[:, j], d.qd[:, j] * np.abs(d.qd[:, j])],
    "the angle": lambda d, j: [d.q[:, j], d.q[:, j] ** 2, d.q[:, j] ** 3],
    "the angle of the joint beside it": lambda d, j: [_neighbour(d, j), _neighbour(d, j) ** 2],
    "the direction of motion and the angle together": lambda d, j: [_direction(d, j) * f for f in (1.0, d.q[:, j], d.q[:, j] ** 2)],
    "the acceleration": lambda d, j: [np.gradient(d.qd[:, j], 1.0 / d.trial.rate)],
    "the time since the start of a trial": lambda d, j: [d.trial.t - d.trial.t[0]],
}
