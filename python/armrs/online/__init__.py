"""What a device runs, in Python: the estimator, the gravity compensation and the monitor of the C interface, with the same bits.

Sample by sample, or over the log of a device: `replay` shows what the device would have learned, refused and carried, and `watch` where
its monitor would have stopped it.
"""

from __future__ import annotations

from .estimator import Compensation, Estimator, Health, OnlineEstimate
from .log import Log, load_log
from .log_replay import Replay, replay
from .monitor import Channel, Monitor, Stop, watch
from .settings import Settings, default_settings

__all__ = [
    "Channel",
    "Compensation",
    "Estimator",
    "Health",
    "Log",
    "Monitor",
    "OnlineEstimate",
    "Replay",
    "Settings",
    "Stop",
    "default_settings",
    "load_log",
    "replay",
    "watch",
]
