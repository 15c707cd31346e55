"""Every table and figure of the thesis that a machine can recompute: what is printed, what comes out here, and why they differ."""

from .reproduce import Reproduced, run_reproduce

__all__ = ["Reproduced", "run_reproduce"]
