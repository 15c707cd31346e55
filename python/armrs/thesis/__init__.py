"""The tables and figures of the thesis recomputed: printed value, our value, and why they differ."""

from .reproduce import Reproduced, run_reproduce

__all__ = ["Reproduced", "run_reproduce"]
