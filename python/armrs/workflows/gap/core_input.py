"""What the search in the core is asked with: trials, channels and what is known beforehand."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

from ... import _armrs, checks
from ...io.dataset import Dataset, refuse_other_arms
from ...io.trial import refuse_moving_base
from ..identify import core_columns


def is_led(dataset: Dataset) -> bool:
    """Whether every trial has what the closed chain is simulated from: robot angles, a robot, and forces."""
    known = all(t.robot_q is not None and t.force_on_arm is not None for t in dataset.trials)
    return known and dataset.model.robot is not None


def channel_names(dataset: Dataset, led: bool) -> list[str]:
    """Return the names of the channels that are compared."""
    return _armrs.channel_names(dataset.model.n_joints, led)


def core_trials(dataset: Dataset) -> list[dict[str, Any]]:
    """Return the trials for the core."""
    refuse_other_arms(dataset)
    refuse_moving_base(dataset.trials)
    configurations = sorted({t.configuration for t in dataset.trials})
    return [core_columns(t) | {"configuration": configurations.index(t.configuration)} for t in dataset.trials]


def core_settings(dataset: Dataset, led: bool, threads: int | None, own: Sequence[str] = ()) -> dict[str, Any]:
    """Return what is known beforehand, for the core."""
    return {
        "model": dataset.model,
        "force_on_robot": dataset.force_on == "robot",
        "tolerance": dataset.tolerance,
        "led": led,
        "own": list(own),
        "threads": (os.cpu_count() or 1) if threads is None else checks.whole("threads", threads, least=1, most=1024),
    }
