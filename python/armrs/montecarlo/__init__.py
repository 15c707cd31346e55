"""Many virtual sessions, or many resamples of one measured session: `armrs sweep`."""

from __future__ import annotations

from .run import Swept as Swept
from .run import sweep as sweep
from .sweep_file import Sweep as Sweep
from .sweep_file import load_sweep as load_sweep
