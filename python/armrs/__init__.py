"""armrs: identify a passive planar arm that a robot guides by the hand, and find which effects its model lacks.

Everything is loaded on first use, so that `import armrs` costs next to nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from . import anthropometry as anthropometry
    from . import cosim as cosim
    from . import demo as demo
    from . import online as online
    from ._armrs import Arm as Arm
    from ._armrs import __version__ as __version__
    from .analysis.passive_curve import PassiveCurve as PassiveCurve
    from .anthropometry import Expected as Expected
    from .anthropometry import segment_expectations as segment_expectations
    from .catalogue import Parameter as Parameter
    from .cosim.fmu_export import export_fmu as export_fmu
    from .custom_effects import OwnEffect as OwnEffect
    from .custom_effects import own_effect as own_effect
    from .demo import Demonstration as Demonstration
    from .demo import run_demo as run_demo
    from .errors import ArmrsError as ArmrsError
    from .errors import ArmrsWarning as ArmrsWarning
    from .errors import BadInput as BadInput
    from .errors import IdentificationError as IdentificationError
    from .errors import SimulationError as SimulationError
    from .errors import SlaveError as SlaveError
    from .fmu.check import check_fmu as check_fmu
    from .io.dataset import Dataset as Dataset
    from .io.dataset import load_dataset as load_dataset
    from .io.dataset import write_dataset as write_dataset
    from .io.markers import Markers as Markers
    from .io.markers import PlanarMotion as PlanarMotion
    from .io.markers import planar_motion as planar_motion
    from .io.motion_files import convert_markers as convert_markers
    from .io.motion_files import convert_motion as convert_motion
    from .io.motion_files import read_markers as read_markers
    from .io.multibody import ExportedModel as ExportedModel
    from .io.multibody import export_model as export_model
    from .io.multibody import import_model as import_model
    from .io.table_conversion import convert as convert
    from .io.trial import Trial as Trial
    from .model import Contact as Contact
    from .model import Effect as Effect
    from .model import Joint as Joint
    from .model import Model as Model
    from .model import Robot as Robot
    from .model import Segment as Segment
    from .model import Subject as Subject
    from .model import Tolerance as Tolerance
    from .model import load_model as load_model
    from .montecarlo import Sweep as Sweep
    from .montecarlo import Swept as Swept
    from .montecarlo import load_sweep as load_sweep
    from .montecarlo import sweep as sweep
    from .report import plotting as plotting
    from .report.pages import write_report as write_report
    from .workflows import gap as gap
    from .workflows.check_dataset import Checked as Checked
    from .workflows.check_dataset import check_dataset as check_dataset
    from .workflows.cohort import Cohort as Cohort
    from .workflows.cohort import cohort as cohort
    from .workflows.firmware import FirmwareSource as FirmwareSource
    from .workflows.firmware import export_c as export_c
    from .workflows.fitting import SimulationFit as SimulationFit
    from .workflows.fitting import fit_by_simulation as fit_by_simulation
    from .workflows.gap import GapFound as GapFound
    from .workflows.gap import find_gap as find_gap
    from .workflows.identify import Estimate as Estimate
    from .workflows.identify import Identified as Identified
    from .workflows.identify import identify as identify
    from .workflows.importing import Imported as Imported
    from .workflows.importing import import_recordings as import_recordings
    from .workflows.initialise import Worn as Worn
    from .workflows.initialise import initialise as initialise
    from .workflows.movement import Movement as Movement
    from .workflows.movement import load_movement as load_movement
    from .workflows.passive import PassiveMoments as PassiveMoments
    from .workflows.passive import passive_moments as passive_moments
    from .workflows.plan import Instruments as Instruments
    from .workflows.plan import Limits as Limits
    from .workflows.plan import Plan as Plan
    from .workflows.plan import forecast as forecast
    from .workflows.plan import plan as plan
    from .workflows.record import Recorded as Recorded
    from .workflows.record import record as record
    from .workflows.simulate import Channel as Channel
    from .workflows.simulate import Sensors as Sensors
    from .workflows.simulate import Simulated as Simulated
    from .workflows.simulate import simulate as simulate
    from .workflows.spasticity import Spasticity as Spasticity
    from .workflows.spasticity import spasticity as spasticity

# No module or package directly below `armrs` is named like a public function: importing it would put it in the place of the function.
_HOMES = {
    "_armrs": ("Arm", "__version__", "build_profile"),
    "anthropometry": ("Expected", "segment_expectations"),
    "catalogue": ("Parameter",),
    "io.table_conversion": ("convert",),
    "io.dataset": ("Dataset", "load_dataset", "write_dataset"),
    "io.multibody": ("ExportedModel", "export_model", "import_model"),
    "workflows.check_dataset": ("Checked", "check_dataset"),
    "workflows.importing": ("Imported", "import_recordings"),
    "workflows.initialise": ("Worn", "initialise"),
    "workflows.cohort": ("Cohort", "cohort"),
    "workflows.spasticity": ("Spasticity", "spasticity"),
    "demo": ("Demonstration", "run_demo"),
    "workflows.firmware": ("FirmwareSource", "export_c"),
    "workflows.gap": ("GapFound", "find_gap"),
    "errors": ("ArmrsError", "ArmrsWarning", "BadInput", "IdentificationError", "SimulationError", "SlaveError"),
    "workflows.fitting": ("SimulationFit", "fit_by_simulation"),
    "fmu.check": ("check_fmu",),
    "cosim.fmu_export": ("export_fmu",),
    "workflows.identify": ("Estimate", "Identified", "identify"),
    "workflows.record": ("Recorded", "record"),
    "io.markers": ("Markers", "PlanarMotion", "planar_motion"),
    "model": ("Contact", "Effect", "Joint", "Model", "Robot", "Segment", "Subject", "Tolerance", "load_model"),
    "analysis.passive_curve": ("PassiveCurve",),
    "workflows.passive": ("PassiveMoments", "passive_moments"),
    "montecarlo": ("Sweep", "Swept", "load_sweep", "sweep"),
    "io.motion_files": ("convert_markers", "convert_motion", "read_markers"),
    "custom_effects": ("OwnEffect", "own_effect"),
    "workflows.plan": ("Instruments", "Limits", "Plan", "forecast", "plan"),
    "report.pages": ("write_report",),
    "workflows.movement": ("Movement", "load_movement"),
    "workflows.simulate": ("Channel", "Sensors", "Simulated", "simulate"),
    "io.trial": ("Trial",),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

_MODULES = {
    "anthropometry": "anthropometry",
    "cosim": "cosim",
    "demo": "demo",
    "gap": "workflows.gap",
    "online": "online",
    "plotting": "report.plotting",
}
"""Modules that are of use by themselves; `armrs.demo` loads the module."""

__all__ = sorted(_HOME_OF)


def __getattr__(name: str) -> Any:
    if name in _MODULES:
        return importlib.import_module(f".{_MODULES[name]}", __name__)
    module = _HOME_OF.get(name)
    if module is None:
        raise AttributeError(f"module 'armrs' has no attribute {name!r}")
    value = getattr(importlib.import_module(f".{module}", __name__), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_MODULES})
