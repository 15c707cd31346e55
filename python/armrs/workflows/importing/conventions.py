"""How raw angles and forces are counted, read off the static balance of the arm.

In slow motion the torques of the contact force balance gravity and the passive joint laws. For each convention that laboratories use, the
torques are regressed on gravity moments near those of the model, springs, dampers and constants; the wrong convention leaves most of them
unexplained.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import BadInput, Text
from ...model import Model
from .recipe import REFERENCES, ZEROS, Convention

_SAMPLES = 1200
"""Samples that are regressed: more tell no more about a convention."""
_MASS_BAND = (0.5, 1.6)
"""Gravity moments relative to the model's: literature values are that far off at most."""
_CLEAR = 1.3
"""A convention is taken when every other leaves that many times as much unexplained."""
_CLOSE = 1.1
"""The usual convention is kept when it leaves at most this many times what the best does."""
_UNEXPLAINED = 0.6
"""With more than this unexplained, no convention fits."""


@dataclass(frozen=True)
class Balance:
    """A convention and the share of the contact torques that it leaves unexplained, 0 to 1."""

    convention: Convention
    unexplained: float


def to_model_angles(raw: np.ndarray, convention: Convention) -> np.ndarray:
    """Return joint angles in the convention of armrs.

    Parameters
    ----------
    raw : ndarray, shape (n, n_joints)
        [rad], as recorded.
    convention : Convention

    Returns
    -------
    ndarray, shape (n, n_joints)
        First from +y, the others relative, counter-clockwise positive [rad].
    """
    angles = raw * np.asarray(convention.signs, dtype=float)
    shift = 0.0 if convention.zero == "horizontal" else -0.5 * np.pi
    if convention.reference == "relative":
        angles[:, 0] += shift
        return angles
    angles = angles + shift
    return np.diff(angles, axis=1, prepend=0.0)


def candidates(n_joints: int, given: Mapping[str, object], has_force: bool) -> Iterator[Convention]:
    """Give the conventions that agree with what is given, the usual one first.

    `given` may hold `reference`, `zero`, `signs` and `force_on`.
    """
    references = REFERENCES if "reference" not in given and n_joints > 1 else (given.get("reference", "relative"),)
    zeros = ZEROS if "zero" not in given else (given["zero"],)
    signs = itertools.product((1, -1), repeat=n_joints) if "signs" not in given else [given["signs"]]
    sides = (("robot", "arm") if "force_on" not in given else (given["force_on"],)) if has_force else (None,)
    for turned, reference, zero, side in itertools.product(list(signs), references, zeros, sides):
        yield Convention(reference, zero, tuple(turned), side)  # type: ignore[arg-type]


def decide(
    model: Model,
    recordings: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]],
    given: Mapping[str, object],
    problems: list[BadInput],
) -> Convention:
    """Return the convention in which the arm balances.

    Parameters
    ----------
    model : Model
        Lengths, and masses as far as the literature knows them.
    recordings : sequence of (t, q, force)
        Time [s], raw angles (n, n_joints) [rad] and raw force (n, 2) [N] of each trial.
    given : mapping
        What the caller states; see `candidates`.
    problems : list of BadInput
        Gets a refusal where several conventions balance the arm equally well, or none does.
    """
    prepared = [_slow(*recording) for recording in recordings]
    share = max(1, _SAMPLES // max(1, len(prepared)))
    thinned = [tuple(a[:: max(1, len(a) // share)] for a in recording) for recording in prepared]
    q, speed, force = (np.concatenate([recording[k] for recording in thinned]) for k in range(3))
    found = [
        Balance(c, _unexplained(model, to_model_angles(q, c), to_model_speeds(speed, c), force if c.force_on == "arm" else -force))
        for c in candidates(model.n_joints, given, has_force=True)
    ]
    usual = found[0]
    ranked = sorted(found, key=lambda b: b.unexplained)
    best = usual if usual.unexplained <= _CLOSE * ranked[0].unexplained else ranked[0]
    rivals = [b for b in ranked if b is not best and not _equivalent(b.convention, best.convention, q)]
    if best.unexplained > _UNEXPLAINED:
        said = Text(f"{100 * best.unexplained:.0f} % of the contact torques unexplained by the best convention ({best.convention.words()})")
        problems.append(BadInput("angles and forces", said, "an arm that balances", hint="lengths, units, axes of the force?"))
    elif rivals and best is not usual and rivals[0].unexplained < _CLEAR * best.unexplained:
        both = Text(f"two conventions that balance the arm alike: {best.convention.words()}; or {rivals[0].convention.words()}")
        problems.append(BadInput("angles and forces", both, "one; state it with --angles, --zero, --clockwise or --force-on"))
    c = best.convention
    next_best = f", the next best {100 * rivals[0].unexplained:.0f} %" if rivals else ""
    why = f"static balance leaves {100 * best.unexplained:.0f} % of the contact torques unexplained{next_best}"
    return Convention(c.reference, c.zero, c.signs, c.force_on, why)


def _equivalent(a: Convention, b: Convention, raw: np.ndarray) -> bool:
    """Whether two conventions read these angles and forces alike, as for a joint that hardly moves."""
    return a.force_on == b.force_on and bool(np.abs(to_model_angles(raw, a) - to_model_angles(raw, b)).max() < 1e-3)


def _slow(t: np.ndarray, q: np.ndarray, force: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return angles, speeds and forces of the slower half of the complete samples."""
    good = np.isfinite(q).all(axis=1) & np.isfinite(force).all(axis=1)
    t, q, force = t[good], q[good], force[good]
    width = max(1, round(0.1 / max(float(np.median(np.diff(t))), 1e-6)))
    smooth = np.column_stack(
        [np.convolve(np.pad(c, width, mode="edge"), np.full(2 * width + 1, 1.0 / (2 * width + 1)), "valid") for c in q.T]
    )
    speed = np.gradient(smooth, t, axis=0)
    total = np.linalg.norm(speed, axis=1)
    slow = total <= np.median(total)
    return q[slow], speed[slow], force[slow]


def to_model_speeds(raw: np.ndarray, convention: Convention) -> np.ndarray:
    """Return joint speeds in the convention of armrs, as `to_model_angles` does angles."""
    speeds = raw * np.asarray(convention.signs, dtype=float)
    return speeds if convention.reference == "relative" else np.diff(speeds, axis=1, prepend=0.0)


def _unexplained(model: Model, q: np.ndarray, speed: np.ndarray, force_on_arm: np.ndarray) -> float:
    """Return the share (root mean square) of the contact torques that gravity and passive laws leave."""
    from scipy.optimize import lsq_linear

    n, joints = q.shape
    absolute = np.cumsum(q, axis=1)
    lengths = np.array([s.length for s in model.segments])
    # Moment arms of the hand about each joint: sums over the links beyond it.
    reach_y = np.cumsum((lengths * np.cos(absolute))[:, ::-1], axis=1)[:, ::-1]
    reach_z = np.cumsum((lengths * np.sin(absolute))[:, ::-1], axis=1)[:, ::-1]
    torque = reach_y * force_on_arm[:, 1:] - reach_z * force_on_arm[:, :1]
    beyond = [sum(s.mass for s in model.segments[k + 1 :]) for k in range(joints)]
    moments = model.gravity * np.array([s.mass * s.com + s.length * m for s, m in zip(model.segments, beyond, strict=True)])
    columns, low, high = [], [], []
    for k in range(joints):  # gravity of link k loads every joint up to k
        column = np.zeros((n, joints))
        column[:, : k + 1] = (moments[k] * np.cos(absolute[:, k]))[:, None]
        columns.append(column.ravel())
        low.append(_MASS_BAND[0])
        high.append(_MASS_BAND[1])
    for j in range(joints):
        for values, least in ((q[:, j], 0.0), (speed[:, j], 0.0), (np.ones(n), -np.inf)):
            column = np.zeros((n, joints))
            column[:, j] = values
            columns.append(column.ravel())
            low.append(least)
            high.append(np.inf)
    solved = lsq_linear(np.column_stack(columns), torque.ravel(), (low, high))
    size = float(np.sqrt(np.mean(torque**2)))
    return float(np.sqrt(np.mean(solved.fun**2))) / size if size > 0.0 else 1.0
