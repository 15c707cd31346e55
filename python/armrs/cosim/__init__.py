"""Co-simulation: the arm as a slave with the life cycle of FMI 3.0, imported FMUs, and a master that couples them."""

from ..fmu.slave_interface import Partner, Status, StepResult, Variable
from .slave import Slave

__all__ = ["Partner", "Slave", "Status", "StepResult", "Variable"]
