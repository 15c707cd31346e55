"""Angle convention and direction of the force, inferred from the balance of the arm.

For each convention that laboratories use, the torques of the contact force are regressed on gravity, inertia and passive joint laws
(`armrs.analysis.torque_balance`); the wrong convention leaves most of them unexplained.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...analysis.torque_balance import BALANCED, Motion, motion_of, unexplained
from ...errors import BadInput, Text
from ...io.column_conventions import AlternativeConvention
from ...model import Model
from ..setup_check import OTHER_UNITS
from .recipe import REFERENCES, ZEROS, Convention

_CLEAR = 1.3
"""A convention is taken when every other leaves that many times as much unexplained."""
_CLOSE = 1.1
"""The usual convention is kept when it leaves at most this many times what the best does."""
_UNEXPLAINED = 0.6
"""With more than this unexplained, no convention fits."""
_OTHER_UNIT = 3.0
"""Another unit of the forces is suggested that balances the arm and leaves so many times less than the stated one."""
_SAMPLES_OF_UNIT = 160
"""Samples with which units are compared."""
_CONTRADICTED, _BY = 0.04, 2.0
"""What is stated is refused when it leaves at least this share, and so many times what the best convention leaves."""
OF_MARKERS = "of markers"
"""Key of what is given: whether the angles are those of markers, which are computed in the convention of armrs."""
_STATED = {"reference": "--angles", "zero": "--zero", "signs": "--clockwise", "force_on": "--force-on"}


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

    `given` may hold `reference`, `zero`, `signs` and `force_on`, and `OF_MARKERS`, which leaves the body that the force acts on.
    """
    if given.get(OF_MARKERS):
        given = {"reference": "relative", "zero": "horizontal", "signs": (1,) * n_joints, **given}
    references = REFERENCES if "reference" not in given and n_joints > 1 else (given.get("reference", "relative"),)
    zeros = ZEROS if "zero" not in given else (given["zero"],)
    signs = itertools.product((1, -1), repeat=n_joints) if "signs" not in given else [given["signs"]]
    sides = (("robot", "arm") if "force_on" not in given else (given["force_on"],)) if has_force else (None,)
    for turned, reference, zero, side in itertools.product(list(signs), references, zeros, sides):
        yield Convention(reference, zero, tuple(turned), side)  # type: ignore[arg-type]


def balance(model: Model, motion: Motion | None, convention: Convention) -> Balance:
    """Return what a motion leaves unexplained in a convention; all of it where there is no motion."""
    left = 1.0 if motion is None else unexplained(model, motion.read_as(_reading(convention, model.n_joints)))
    return Balance(convention, left)


def ranked(model: Model, recordings: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]], given: Mapping[str, object]) -> list[Balance]:
    """Return the conventions that agree with what is given, the one in which recordings balance best first; arguments as in `decide`."""
    motion = motion_of([(*recording, None) for recording in recordings])
    return sorted((balance(model, motion, c) for c in candidates(model.n_joints, given, has_force=True)), key=lambda b: b.unexplained)


def decide(
    model: Model,
    recordings: Sequence[tuple[np.ndarray, np.ndarray, np.ndarray]],
    given: Mapping[str, object],
    problems: list[BadInput],
    doubts: list[str],
) -> Convention:
    """Return the convention in which the arm balances.

    Parameters
    ----------
    model : Model
        Lengths, and masses from the literature.
    recordings : sequence of (t, q, force)
        Time [s], raw angles (n, n_joints) [rad] and raw force (n, 2) [N] of each trial.
    given : mapping
        Settings of the caller; see `candidates`.
    problems : list of BadInput
        Gets a refusal where several conventions balance the arm equally well, or none does.
    doubts : list of str
        Gets a line where the arm balances only roughly.
    """
    motion = motion_of([(t, q, force, None) for t, q, force in recordings])
    found = [balance(model, motion, c) for c in candidates(model.n_joints, given, has_force=True)]
    usual = found[0]
    ranked = sorted(found, key=lambda b: b.unexplained)
    best = usual if usual.unexplained <= _CLOSE * ranked[0].unexplained else ranked[0]
    rivals = [b for b in ranked if b is not best and not _equivalent(b.convention, best.convention, motion)]
    contradicted = _contradicted(model, motion, given, best)
    if contradicted is not None:
        problems.append(contradicted)
    elif best.unexplained > _UNEXPLAINED:
        said = Text(f"{100 * best.unexplained:.0f} % of the contact torques unexplained by the best convention ({best.convention.words()})")
        allowed = f"at most {100 * _UNEXPLAINED:.0f} %"
        problems.append(
            BadInput("angles and forces", said, allowed, hint=_unit(model, motion, given, best) or "wrong lengths, units or force axes?")
        )
    elif rivals and best is not usual and rivals[0].unexplained < _CLEAR * best.unexplained:
        both = Text(f"two conventions that explain the forces equally well: {best.convention.words()}; or {rivals[0].convention.words()}")
        problems.append(
            BadInput(
                "angles and forces",
                both,
                "one; state it with --angles, --zero, --clockwise or --force-on",
                hint=_unit(model, motion, given, best),
            )
        )
    elif best.unexplained > _CONTRADICTED:
        if best.unexplained > BALANCED:
            doubts.append(
                f"gravity, inertia and passive joints leave {100 * best.unexplained:.3g} % of the contact torques unexplained, more than "
                f"{100 * BALANCED:.0f} %: a zero of an angle, an axis or a zero of the force, or a clock is wrong, or the convention is "
                "another one; compare recording.png with the laboratory"
            )
        # Springs may balance forces in another unit where the movements are small.
        doubts += filter(None, [_unit(model, motion, given, best)])
    c = best.convention
    next_best = f", the next best {100 * rivals[0].unexplained:.0f} %" if rivals else ""
    why = f"the balance leaves {100 * best.unexplained:.0f} % of the contact torques unexplained{next_best}"
    return Convention(c.reference, c.zero, c.signs, c.force_on, why)


def _unit(model: Model, motion: Motion | None, given: Mapping[str, object], best: Balance) -> str | None:
    """Return the unit of the forces in which the arm balances much better, None where there is none."""
    if motion is None:
        return None
    thin = max(1, len(motion.q) // _SAMPLES_OF_UNIT)
    few = Motion(*(values[::thin] for values in vars(motion).values()))
    tried = [
        (balance(model, replace(few, force=few.force / ratio), c).unexplained, words)
        for ratio, words in OTHER_UNITS
        for c in candidates(model.n_joints, given, has_force=True)
    ]
    left, words = min(tried)
    if left > BALANCED or _OTHER_UNIT * left > best.unexplained:
        return None
    return f"{words}? Then {100 * left:.2g} % are unexplained, as stated {100 * best.unexplained:.2g} %"


def _contradicted(model: Model, motion: Motion | None, given: Mapping[str, object], best: Balance) -> BadInput | None:
    """Return the refusal of what is stated where the arm balances in another convention and not in any that agrees with it."""
    stated = {key: value for key, value in given.items() if key in _STATED}
    if not stated or best.unexplained < _CONTRADICTED:
        return None
    others = {key: value for key, value in given.items() if key not in _STATED}
    free = min((balance(model, motion, c) for c in candidates(model.n_joints, others, has_force=True)), key=lambda b: b.unexplained)
    if free.unexplained > _UNEXPLAINED or best.unexplained < _BY * free.unexplained:
        return None
    wrong = [_STATED[key] for key, value in stated.items() if getattr(free.convention, key) != value]
    found = Text(f"{100 * best.unexplained:.0f} % of the contact torques unexplained in every convention that agrees with it")
    allowed = f"{free.convention.words()}, which leaves {100 * free.unexplained:.2g} %"
    other = _unit(model, motion, given, best) or "leave the option out, and compare recording.png with the laboratory"
    return BadInput(" and ".join(wrong), found, allowed, hint=other)


def _equivalent(a: Convention, b: Convention, motion: Motion | None) -> bool:
    """Whether two conventions read these angles and forces alike, as for a joint that hardly moves."""
    if motion is None or a.force_on != b.force_on:
        return False
    return bool(np.abs(to_model_angles(motion.q, a) - to_model_angles(motion.q, b)).max() < 1e-3)


def _reading(c: Convention, n: int) -> AlternativeConvention:
    """Return how a convention makes angles of the model, and the force on the arm, of what was recorded."""
    shift = to_model_angles(np.zeros((1, n)), c)[0]
    return AlternativeConvention(
        "", "", to_model_angles(np.eye(n), c).T - shift[:, None], shift, np.eye(2) * (1.0 if c.force_on == "arm" else -1.0)
    )


def to_model_speeds(raw: np.ndarray, convention: Convention) -> np.ndarray:
    """Return joint speeds in the convention of armrs, as `to_model_angles` does angles."""
    speeds = raw * np.asarray(convention.signs, dtype=float)
    return speeds if convention.reference == "relative" else np.diff(speeds, axis=1, prepend=0.0)
