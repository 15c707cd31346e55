"""What the search in the core is asked with: trials and what is known beforehand."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

from ... import checks
from ...io.dataset import Dataset, refuse_added
from ...io.trial import refuse_moving_base
from ..identify import core_columns


def core_trials(dataset: Dataset) -> list[dict[str, Any]]:
    """Return the trials for the core."""
    refuse_added(dataset)
    refuse_moving_base(dataset.trials)
    configurations = sorted({t.configuration for t in dataset.trials})
    return [core_columns(t) | {"configuration": configurations.index(t.configuration)} for t in dataset.trials]


def core_settings(dataset: Dataset, led: bool, threads: int | None, own: Sequence[str] = ()) -> dict[str, Any]:
    """Return what is known beforehand, for the core."""
    return {
        "segment_uncertainty": dataset.model.segment_uncertainty,
        "tolerance": dataset.tolerance,
        "led": led,
        "own": list(own),
        "threads": (os.cpu_count() or 1) if threads is None else checks.whole("threads", threads, least=1, most=1024),
    }
