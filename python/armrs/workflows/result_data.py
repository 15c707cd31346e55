"""Results as plain data: the JSON of a verb, which reports read."""

from __future__ import annotations

import platform
from typing import Any

import numpy as np

from .. import _armrs
from ..analysis.passive_curve import LEVEL
from ..analysis.quantity_expressions import value_in
from ..errors import BadInput
from ..io.dataset import IMPORT_FILE, Dataset
from ..model import Contact
from .identify import Estimate, Identified
from .passive import PassiveMoments
from .simulate import Run, Simulated


def origin(command: str | None) -> dict[str, Any]:
    """Return what made a result: version and build of armrs, Python, and the command where there was one."""
    return {
        "armrs": _armrs.__version__,
        "build_profile": _armrs.build_profile,
        "python": platform.python_version(),
        "command": command,
    }


def data_of(dataset: Dataset) -> dict[str, Any]:
    """Return the lines of a report on a data set."""

    def of(role: str) -> dict[str, Any]:
        trials = [t for t in dataset.trials if t.role == role]
        return {
            "trials": len(trials),
            "duration_s": float(sum(t.t[-1] - t.t[0] for t in trials)),
            "samples": sum(len(t) for t in trials),
        }

    return {
        "name": dataset.name,
        "subject": dataset.subject.name,
        "side": dataset.subject.side,
        "synthetic": dataset.synthetic,
        "joints": [joint.name for joint in dataset.model.joints],
        "range_deg": ranges(dataset),
        "angles": laboratory_angles(dataset),
        "configurations": list(dict.fromkeys(t.configuration for t in dataset.trials)),
        "fit": of("fit"),
        "test": of("test"),
        "forces": any(t.force_on_arm is not None for t in dataset.trials),
        "torques": any(t.tau is not None for t in dataset.trials),
        "warnings": list(dataset.warnings),
    }


def laboratory_angles(dataset: Dataset) -> dict[str, Any] | None:
    """Return how the laboratory counts angles, where `armrs import` wrote the data set: sign and zero of each joint, and words.

    None elsewhere, and where the laboratory's angles are no angles of joints.
    """
    path = None if dataset.folder is None else dataset.folder / IMPORT_FILE
    if path is None or not path.is_file():
        return None
    # Few data sets need the modules of an import.
    from .importing.recipe import load_recipe

    try:
        convention = load_recipe(path).convention
    except BadInput:  # no longer whole: the angles are then counted as armrs does
        return None
    n = dataset.model.n_joints
    if convention.reference != "relative" or len(convention.signs) != n:
        return None
    first = 0.0 if convention.zero == "horizontal" else -90.0
    said = f"as in the laboratory: {convention.angles([joint.name for joint in dataset.model.joints])}"
    return {"signs": list(convention.signs), "zero_deg": [first] + [0.0] * (n - 1), "words": said}


def ranges(dataset: Dataset) -> list[list[float]] | None:
    """Return the smallest and the largest angle of each joint [deg], None without a complete sample."""
    q = np.concatenate([t.q[t.valid] for t in dataset.trials]) if dataset.trials else np.empty((0, 0))
    return np.degrees(np.column_stack([q.min(axis=0), q.max(axis=0)])).tolist() if len(q) else None


def identified_data(result: Identified, command: str | None = None) -> dict[str, Any]:
    """Return an identification as it is written to JSON: that of `Identified.to_dict`, what it rests on, and the model's own values."""
    data = {"verb": "identify", **result.to_dict(), "data": data_of(result.dataset), "made_by": origin(command)}
    for name in ("parameters", "combinations"):
        data[name] = [_with_given(estimate, result) for estimate in getattr(result, name)]
    return data


def _with_given(estimate: Estimate, result: Identified) -> dict[str, Any]:
    given = value_in(result.dataset.model, estimate.name, kind=estimate.kind, joint=estimate.joint)
    return {**estimate.to_dict(), "given": given}


def simulated_data(result: Run, name: str, command: str | None = None) -> dict[str, Any]:
    """Return what a run came to, as it is written to JSON; its samples stand in a file of their own."""
    fastest = 0.0
    largest = (-1.0, 0.0)
    first: Simulated | None = None
    last: Simulated | None = None
    for piece in result.pieces():
        force = np.hypot(*piece.force_on_arm.T)
        at = int(np.argmax(force))
        if force[at] > largest[0]:
            largest = (force[at], piece.t[at])
        fastest = max(fastest, np.abs(piece.qd).max())
        first, last = piece if first is None else first, piece
    assert first is not None and last is not None
    balance = result.balance
    stored = sum(last.columns[f"energy.{part}"][-1] - first.columns[f"energy.{part}"][0] for part in ("kinetic", "potential", "contact"))
    return {
        "verb": "simulate",
        "data": {"name": name, "synthetic": True, "joints": [joint.name for joint in result.model.joints]},
        **result.settings,
        "duration_s": last.t[-1],
        "samples": result.samples,
        "digest": result.digest,
        "assumed": _assumed(first),
        "largest_force_N": largest[0],
        "largest_force_at_s": largest[1],
        "largest_speed_rad_s": fastest,
        "energy": {
            "stored_J": stored,
            **{f"{part}_J": last.columns[f"work.{part}"][-1] for part in ("handle", "drive", "resisted", "damped")},
            "error_J": balance.error,
            "exchanged_J": balance.exchanged,
            "error_share": balance.share,
        },
        "made_by": origin(command),
    }


def _assumed(result: Simulated) -> list[str]:
    """Return the assumptions of a run of a led arm on what its model does not state, a sentence each."""
    lines: list[str] = []
    if result.columns.get("handle") is None:
        return lines
    if result.model.contact is None and result.settings["coupling"] == "compliant":
        assumed = Contact.assumed()
        (stiffness, _), (damping, _) = assumed.stiffness, assumed.damping
        lines.append(f"The model has no [contact]: {stiffness:g} N/m and {damping:g} N s/m along y and z were taken.")
    if result.model.robot is None:
        lines.append("The model has no [robot]: its angles were not computed, and whether it reaches the path was not checked.")
    return lines


def passive_data(result: PassiveMoments, command: str | None = None) -> dict[str, Any]:
    """Return passive moments as they are written to JSON."""
    joints = [joint.name for joint in result.dataset.model.joints]
    curves = []
    for curve in result.curves:
        deviation = curve.half_width_std[np.isfinite(curve.half_width_std)]
        curves.append(
            curve.to_dict()
            | {"joint_name": joints[curve.joint - 1], "half_width_std_mean_Nm": float(np.mean(deviation)) if deviation.size else None}
        )
    return {
        "verb": "passive",
        "data": data_of(result.dataset),
        "joint_centres": list(result.centres),
        "cutoff_Hz": result.cutoff,
        "curves": curves,
        "dependence": [
            d.to_dict() | {"joint_name": joints[d.joint - 1], "adjacent_name": joints[d.adjacent - 1]} for d in result.dependence
        ],
        "couplings": [c.to_dict() | {"joint_names": [joints[j - 1] for j in c.joints]} for c in result.couplings],
        "repeated": [e.to_dict() for e in result.followed()],
        "checks": [{"name": c.name, "passed": c.passed, "text": c.text} for c in result.checks],
        "level": LEVEL,
        "warnings": list(result.warnings),
        "made_by": origin(command),
    }
