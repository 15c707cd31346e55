"""Figures of the single stages: the model as given beside its data, and the screening after calibration."""

from __future__ import annotations

from ...errors import BadInput, Text
from ...workflows.gap.single_stages import Calibrated, Compared
from ...workflows.result_data import origin
from ..figures import Figures
from ..view import View
from . import figures


def _compared(result: Compared) -> Figures:
    """Return the torque that the model lacks over angle and speed of each joint, in the fit trials."""
    found = [d for d in result.discrepancies if d.trial.role == "fit"]
    if not found:
        raise BadInput("plot", Text("no fit trial that the model could be simulated on"), "one or more")
    joints = [f"joint {j}" for j in range(1, found[0].torque.shape[1] + 1)]
    return {"missing": lambda: figures.missing_torque(joints, {"given": found})}


def _calibrated(result: Calibrated) -> Figures:
    """Return what each effect alone would explain, the likeliest first."""
    if not result.suspects:
        raise BadInput("plot", Text("no effect that was tested"), "one or more")
    return {"first_look": lambda: figures.first_look(result.suspects, [j.name for j in result.dataset.model.joints])}


COMPARED = View(lambda result: {"made_by": origin(None)}, lambda result, _: _compared(result))
CALIBRATED = View(lambda result: result.to_dict(), lambda result, _: _calibrated(result))
