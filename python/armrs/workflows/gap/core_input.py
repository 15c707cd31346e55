"""Input of the search in the core: trials, channels and prior knowledge."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ... import _armrs, checks
from ...catalogue import catalogue
from ...errors import BadInput
from ...io.dataset import Dataset, refuse_other_arms
from ...io.trial import Trial, bridged
from ...model import Model, Tolerance
from .unresolved_motion import unresolved_movements


def is_led(dataset: Dataset) -> bool:
    """Whether every trial has what the closed chain is simulated from: robot angles, a robot, and forces."""
    known = all(t.robot_q is not None and t.force_on_arm is not None for t in dataset.trials)
    return known and dataset.model.robot is not None


def channel_names(dataset: Dataset, led: bool) -> list[str]:
    """Return the names of the channels that are compared."""
    return _armrs.channel_names(dataset.model.n_joints, led)


@dataclass(frozen=True)
class SearchSettings:
    """Prior knowledge.

    The model, and the body on which forces are stated, are those of the files; `weights` are those of the samples of each trial,
    less than one where the path of its robot between the samples is not known; `own` are user-defined kinds that are tested besides.
    """

    model: Model
    force_on_robot: bool
    tolerance: Tolerance
    led: bool
    weights: list[float]
    own: list[str]
    threads: int


def core_trials(dataset: Dataset) -> list[Trial]:
    """Return the trials for the core."""
    refuse_other_arms(dataset)
    for effect in dataset.model.all_effects:
        if catalogue()[effect.kind].feels_activity:
            found, allowed = (
                effect.kind,
                "effects that act alike in all repeats: no two have the same muscle activity; identify fits this one",
            )
            raise BadInput("effects of the model", found, allowed, file=dataset.model_path)
    return [bridged(t) for t in dataset.trials]


def core_settings(dataset: Dataset, led: bool, threads: int | None, own: Sequence[str] = ()) -> SearchSettings:
    """Return the prior knowledge; as many threads as processors when none are given."""
    unknown = unresolved_movements(dataset) if led else {}
    weights = {name: differ / math.hypot(missed, differ) for name, (missed, differ) in unknown.items()}
    return SearchSettings(
        model=dataset.model,
        force_on_robot=dataset.force_on == "robot",
        tolerance=dataset.tolerance,
        led=led,
        weights=[weights.get(t.configuration, 1.0) for t in dataset.trials],
        own=list(own),
        threads=checks.threads(threads),
    )
