"""A model as the compiled core computes with it."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from . import _armrs
from .catalogue import FORCE_CHANNELS, catalogue
from .model import Effect, Model

if TYPE_CHECKING:
    from .io.dataset import Tolerance

NO_CONTACT = ((10_000.0, 10_000.0), (25.0, 25.0))
"""Stiffness [N/m] and damping [N s/m] of the thesis' contact, where a model says nothing."""


def joint_effects(model: Model) -> list[Effect]:
    """Return what the joints of a model say of themselves as effects, joint by joint; zero means that there is none."""
    effects = []
    for number, joint in enumerate(model.joints, start=1):
        if joint.stiffness:
            effects.append(Effect("elastic", number, parameters={"stiffness": joint.stiffness, "rest": joint.rest}))
        if joint.viscosity:
            effects.append(Effect("viscous", number, parameters={"viscosity": joint.viscosity}))
        if joint.coulomb:
            effects.append(Effect("coulomb", number, parameters={"torque": joint.coulomb}))
    return effects


def all_effects(model: Model) -> list[Effect]:
    """Return every effect of a model, those of its joints first."""
    return [*joint_effects(model), *model.effects]


def arm(model: Model) -> _armrs.Arm:
    """Return the rigid arm of a model."""
    segments = model.segments
    return _armrs.Arm(
        [s.length for s in segments],
        [s.mass for s in segments],
        [s.com for s in segments],
        [s.inertia for s in segments],
        com_normals=[s.com_normal for s in segments],
        gravity=model.gravity,
        base=model.base,
    )


def rig(model: Model, effects: Iterable[Effect] | None = None) -> _armrs.Rig:
    """Return a model with all its effects, or with the effects given, ready for the core."""
    listed = all_effects(model) if effects is None else list(effects)
    contact = NO_CONTACT if model.contact is None else (model.contact.stiffness, model.contact.damping)
    robot = None if model.robot is None else (model.robot.lengths, model.robot.base, model.robot.elbow)
    return _armrs.Rig(arm(model), [_entry(e) for e in listed], contact, robot)


def core_tolerance(tolerance: Tolerance) -> dict[str, float]:
    """Return what the calibration promises for the core, in SI units and radians."""
    return {
        "angle_offset": tolerance.angle_offset,
        "force_bias": tolerance.force_bias_N,
        "force_gain": tolerance.force_gain,
        "time_delay": tolerance.time_delay_s,
        "handle_placement": tolerance.handle_placement_m,
    }


def _entry(effect: Effect) -> tuple[str, int, list[float]]:
    index = FORCE_CHANNELS.index(effect.channel) if effect.channel is not None else (effect.joint or 1) - 1
    return effect.kind, index, [effect.parameters.get(p.name, p.default) for p in catalogue()[effect.kind].parameters]
