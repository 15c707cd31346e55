"""The gap workflow: where simulation and data disagree, which effect is missing, and what adding it gains.

`find_gap` does it all. Its stages by themselves: `compare`, `calibrate`, `find_gap(…, separate=False)`, which names, `separate`, `confirm`.
"""

from ..._armrs import (
    Absorbed,
    Alternative,
    ChannelGap,
    Fitted,
    GapResult,
    Limit,
    Missing,
    Open,
    Place,
    Screening,
    SearchStep,
    Separation,
    SimulatedTrial,
    Suspect,
    Tried,
    Value,
)
from .detectable_effects import detectable
from .discriminating_movements import separate
from .gap_result import GapFound
from .search import find_gap
from .single_stages import Calibrated, Compared, calibrate, compare, confirm

__all__ = [
    "Absorbed",
    "Alternative",
    "Calibrated",
    "ChannelGap",
    "Compared",
    "Fitted",
    "GapFound",
    "GapResult",
    "Limit",
    "Missing",
    "Open",
    "Place",
    "Screening",
    "SearchStep",
    "Separation",
    "SimulatedTrial",
    "Suspect",
    "Tried",
    "Value",
    "calibrate",
    "compare",
    "confirm",
    "detectable",
    "find_gap",
    "separate",
]
