"""armrs: what is an arm made of, when a robot leads it.

Everything is loaded on first use, so that `import armrs` costs next to nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._armrs import Arm as Arm
    from ._armrs import __version__ as __version__
    from .catalogue import Parameter as Parameter
    from .conversion import convert as convert
    from .dataset import Dataset as Dataset
    from .dataset import Subject as Subject
    from .dataset import Tolerance as Tolerance
    from .dataset import load_dataset as load_dataset
    from .dataset import write_dataset as write_dataset
    from .demo import Demonstration as Demonstration
    from .demo import run_demo as run_demo
    from .discrepancy import GapFound as GapFound
    from .discrepancy import find_gap as find_gap
    from .errors import ArmrsError as ArmrsError
    from .errors import BadInput as BadInput
    from .errors import IdentificationError as IdentificationError
    from .errors import SimulationError as SimulationError
    from .errors import SlaveError as SlaveError
    from .fitting import SimulationFit as SimulationFit
    from .fitting import fit_by_simulation as fit_by_simulation
    from .fmu.check import check_fmu as check_fmu
    from .fmu.export import export_fmu as export_fmu
    from .identification import Estimate as Estimate
    from .identification import Identified as Identified
    from .identification import identify as identify
    from .laboratory import Recorded as Recorded
    from .laboratory import record as record
    from .markers import Markers as Markers
    from .markers import PlanarMotion as PlanarMotion
    from .markers import planar_motion as planar_motion
    from .model import Contact as Contact
    from .model import Effect as Effect
    from .model import Joint as Joint
    from .model import Model as Model
    from .model import Robot as Robot
    from .model import Segment as Segment
    from .model import load_model as load_model
    from .moments import PassiveCurve as PassiveCurve
    from .moments import PassiveMoments as PassiveMoments
    from .moments import passive_moments as passive_moments
    from .montecarlo import Sweep as Sweep
    from .montecarlo import Swept as Swept
    from .montecarlo import load_sweep as load_sweep
    from .montecarlo import sweep as sweep
    from .motions import convert_markers as convert_markers
    from .motions import convert_motion as convert_motion
    from .motions import read_markers as read_markers
    from .own import OwnEffect as OwnEffect
    from .own import own_effect as own_effect
    from .planning import Instruments as Instruments
    from .planning import Limits as Limits
    from .planning import Plan as Plan
    from .planning import forecast as forecast
    from .planning import plan as plan
    from .report import write_report as write_report
    from .simulation import Channel as Channel
    from .simulation import Movement as Movement
    from .simulation import Sensors as Sensors
    from .simulation import Simulated as Simulated
    from .simulation import load_movement as load_movement
    from .simulation import simulate as simulate
    from .trial import Trial as Trial

# A module is never named like a public function: importing it would put the module in the place of the function.
_HOMES = {
    "_armrs": ("Arm", "__version__", "build_profile"),
    "catalogue": ("Parameter",),
    "conversion": ("convert",),
    "dataset": ("Dataset", "Subject", "Tolerance", "load_dataset", "write_dataset"),
    "demo": ("Demonstration", "run_demo"),
    "discrepancy": ("GapFound", "find_gap"),
    "errors": ("ArmrsError", "BadInput", "IdentificationError", "SimulationError", "SlaveError"),
    "fitting": ("SimulationFit", "fit_by_simulation"),
    "fmu.check": ("check_fmu",),
    "fmu.export": ("export_fmu",),
    "identification": ("Estimate", "Identified", "identify"),
    "laboratory": ("Recorded", "record"),
    "markers": ("Markers", "PlanarMotion", "planar_motion"),
    "model": ("Contact", "Effect", "Joint", "Model", "Robot", "Segment", "load_model"),
    "moments": ("PassiveCurve", "PassiveMoments", "passive_moments"),
    "montecarlo": ("Sweep", "Swept", "load_sweep", "sweep"),
    "motions": ("convert_markers", "convert_motion", "read_markers"),
    "own": ("OwnEffect", "own_effect"),
    "planning": ("Instruments", "Limits", "Plan", "forecast", "plan"),
    "report": ("write_report",),
    "simulation": ("Channel", "Movement", "Sensors", "Simulated", "load_movement", "simulate"),
    "trial": ("Trial",),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

_MODULES = ("cosim", "demo", "discrepancy", "plotting")
"""Modules that are of use by themselves; `armrs.demo` loads the module."""

__all__ = sorted(_HOME_OF)


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return importlib.import_module(f".{name}", __name__)
    module = _HOME_OF.get(name)
    if module is None:
        raise AttributeError(f"module 'armrs' has no attribute {name!r}")
    value = getattr(importlib.import_module(f".{module}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_MODULES})
