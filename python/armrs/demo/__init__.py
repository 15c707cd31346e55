"""The demonstration on built-in data (`armrs demo`): the simulated sessions, and the whole workflow on them."""

from .run import Demonstration, run_demo
from .session import BRAKES, MASS_FACTOR, given_model, measure, measure_two_speeds, true_model

__all__ = ["BRAKES", "MASS_FACTOR", "Demonstration", "given_model", "measure", "measure_two_speeds", "run_demo", "true_model"]
