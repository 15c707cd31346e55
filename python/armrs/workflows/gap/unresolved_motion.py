"""Movements whose path between the samples is too uncertain for simulating the forces."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from ...io.dataset import Dataset
from ...io.plausibility import handle_path
from ...io.trial import Trial
from ...model import Contact, Model

_SHARE = 1.0 / 16.0
"""Error of the path through all samples, as a share of what a cubic through every second one misses of the others: about a twelfth
where the acceleration jumps, less where it does not. The force predicted with it is that which development sessions leave."""
_PLAIN = 0.5
"""A path is not known where it is uncertain by that many times what repeats of the movement differ by: a contact that rings makes two to
three times as much of it, and a gap is open from half its floor on."""
_LEAST = 8
"""Fewest samples of a trial from which its path is estimated."""


def unresolved(dataset: Dataset, led: bool) -> list[str]:
    """Return a warning of the movements whose forces hang on what the robot did between the samples, or nothing."""
    if not led:
        return []
    uncertain = [
        f"{name!r} (by {missed:.2g} N, where repeats differ by {differ:.2g} N)"
        for name, (missed, differ) in unresolved_movements(dataset).items()
    ]
    if not uncertain:
        return []
    return [
        f"what the robot does between its samples is not known well enough for the force in {', '.join(uncertain)}: the gap of the force "
        "is measured below 5 Hz or a fifth of the sampling rate there; to see more, record the robot at a higher rate, or let it start and "
        "stop smoothly"
    ]


def unresolved_movements(dataset: Dataset) -> dict[str, tuple[float, float]]:
    """Return by movement the force that its path is uncertain by, and what its repeats differ by [N], where the first is too much.

    With a stiff contact the handle's path between the samples causes a force, which a simulation misses with any model of the arm.
    """
    found = {}
    for name in dict.fromkeys(t.configuration for t in dataset.trials):
        trials = [t for t in dataset.trials if t.configuration == name]
        missed, differ = max(_missed(dataset.model, t) for t in trials), _scatter(trials)
        if differ is not None and missed > _PLAIN * differ:
            found[name] = (missed, differ)
    return found


def _missed(model: Model, trial: Trial) -> float:
    """Return the force that the path between the samples is uncertain by [N, root mean square of the worse component]."""
    if model.robot is None or trial.robot_q is None or len(trial) < _LEAST:
        return 0.0
    path = handle_path(model.robot, trial.robot_q)
    # A cubic through four of every second sample, at the one in their middle.
    between = (9.0 * (path[2:-4] + path[4:-2]) - path[:-6] - path[6:]) / 16.0 - path[3:-3]
    between = between[np.isfinite(between).all(axis=1)]
    if not len(between):
        return 0.0
    contact = model.contact or Contact.assumed()
    return float(np.max(np.asarray(contact.stiffness) * _SHARE * np.sqrt(np.mean(between**2, axis=0))))


def _scatter(trials: list[Trial]) -> float | None:
    """Return what the forces of repeats differ by [N, root mean square of the worse component]; None without repeats."""
    forces = [t.force_on_arm for t in trials if t.force_on_arm is not None]
    squares = []
    for a, b in combinations(forces, 2):
        n = min(len(a), len(b))
        difference = a[:n] - b[:n]
        squares.append(np.nanvar(difference, axis=0) / 2.0)
    return float(np.sqrt(np.median(squares, axis=0).max())) if squares else None
