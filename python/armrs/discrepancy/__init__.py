"""The gap workflow: where simulation and data disagree, which effect is missing, and what adding it gains."""

from .found import Absorbed, Alternative, ChannelGap, GapFound, Limit, Missing, Place, Rung, Value
from .search import find_gap

__all__ = ["Absorbed", "Alternative", "ChannelGap", "GapFound", "Limit", "Missing", "Place", "Rung", "Value", "find_gap"]
