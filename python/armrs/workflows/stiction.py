"""Dry friction that a simulation solves as set-valued, because the usual step cannot resolve the smooth law."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .. import _armrs
from ..catalogue import Parameter, catalogue
from ..model import Effect, Model

DEFAULT_DT = 0.25e-3
"""Step of a simulation [s]."""
FINER = (1, 4, 16, 64)
"""Steps within `DEFAULT_DT` that are tried in turn, until one resolves the dry friction."""


def sticking(model: Model) -> Model:
    """Return the model with set-valued friction where the usual step cannot follow it.

    The default smoothing, 0.01 rad/s, serves an explicit step and is no property of an arm. Friction of constant size whose slope at rest
    makes speeds decay faster than the fourth-order method follows in steps of 0.25 ms is solved as set-valued instead: the joint sticks.
    The stretched arm decides, before the run and whatever its movement and step. Another smoothing is kept as it is stated.

    Examples
    --------
    >>> from armrs.demo import true_model
    >>> sticking(true_model()) == true_model()
    True
    """
    laws = dict(_too_steep(model))
    if not laws:
        return model
    solved = {law: law.replace(parameters={**law.parameters, smoothing: 0.0}) for law, smoothing in laws.items()}
    stated = {law.joint for law in laws if law not in model.effects}
    joints = tuple(joint.replace(coulomb=0.0) if k in stated else joint for k, joint in enumerate(model.joints, start=1))
    of_joints = tuple(solved[law] for law in laws if law not in model.effects)
    return model.replace(joints=joints, effects=(*of_joints, *(solved.get(e, e) for e in model.effects)))


def sticking_warnings(model: Model) -> tuple[str, ...]:
    """Return what `sticking` changes in a model, in a line."""
    laws = [f"{law.kind} in joint {law.joint}" for law, _ in _too_steep(model)]
    if not laws:
        return ()
    why = f"with the default smoothing too steep for steps of {DEFAULT_DT:g} s"
    return (f"{', '.join(laws)}: {why}, so solved as set-valued friction, which sticks.",)


def too_steep_warnings(model: Model, dt: float) -> tuple[str, ...]:
    """Return what `sticking` would change in a model that is simulated as it is, with steps of `dt` [s], in a line."""
    laws = [f"{law.kind} in joint {law.joint}" for law, _ in _too_steep(model, dt)]
    if not laws:
        return ()
    return (
        f"{', '.join(laws)}: the default smoothing is too steep for inner steps of {dt:g} s -> smoothing = 0, with which a joint sticks",
    )


def _too_steep(model: Model, dt: float = DEFAULT_DT) -> Iterator[tuple[Effect, str]]:
    """Give the dry laws with the default smoothing whose slope at rest a step cannot follow, and the name of that parameter."""
    # Not friction whose size is a share of the force through the joint: so steep, it mostly has no unique solution if set-valued.
    for law, longest in zip(model.all_effects, _armrs.Rig(model).longest_steps(), strict=True):
        for smoothing in _smoothings(law):
            if dt > longest and law.parameters[smoothing.name] == smoothing.default:
                yield law, smoothing.name


def _smoothings(effect: Effect) -> list[Parameter]:
    """Return the parameter that makes dry friction smooth, where a law has some."""
    return [p for p in catalogue()[effect.kind].parameters if p.or_zero]


def steps_to_try(model: Model, *, engine: str, integrator: str | None, dt: float | None) -> tuple[float, ...]:
    """Return the steps that a run is made with in turn, until one resolves its dry friction [s].

    A step that is asked for is taken. Smooth dry friction is so steep at rest that an explicit step has to follow it: with the
    fourth-order method, whose energy says whether it does, shorter steps are tried. Set-valued friction is solved at any step.
    """
    if dt is not None:
        return (dt,)
    explicit = engine == "native" and integrator in (None, "rk4")
    return tuple(DEFAULT_DT / n for n in (FINER if explicit and any(speed > 0.0 for speed in smoothings(model)) else FINER[:1]))


def smoothings(model: Model) -> list[float]:
    """Return the speeds over which dry friction changes its sign [rad/s]; infinite for what joints state."""
    speeds = [effect.parameters[p.name] for effect in model.effects for p in _smoothings(effect)]
    return speeds + [np.inf for joint in model.joints if joint.coulomb > 0.0]
