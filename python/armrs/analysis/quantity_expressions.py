"""Values of expressions of model parameters such as `m1*l1 + a1*m2`, the names of quantities in results."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from ..catalogue import catalogue
from ..model import Model, Segment

_FACTOR = re.compile(r"([mlaIn])([1-9][0-9]?)(?:\^([1-9]))?")
_BRACKET = re.compile(r"((?:[^\s+*]+\*)+)\(([^()]*)\)")
_READ: dict[str, Callable[[Segment], float]] = {
    "m": lambda s: s.mass,
    "l": lambda s: s.com,
    "n": lambda s: s.com_normal,
    "a": lambda s: s.length,
    "I": lambda s: s.inertia,
}


def value_in(model: Model, name: str, *, kind: str = "segment", joint: int | None = None) -> float | None:
    """Return the value that a model gives to a quantity of an identification.

    Parameters
    ----------
    model : Model
    name : str
        A sum of products, brackets not nested, of masses `m1`, centres of mass `l1` (along) and `n1` (normal), lengths `a1` and inertias
        `I1` about the centre of mass, or the name of a parameter of an effect, or a product of such.
    kind : str
        "segment", "combination", or a kind of effect.
    joint : int, optional
        Joint of the effect.

    Returns
    -------
    float or None
        In SI units. None for what no model states. An effect that the model lacks has the value 0.
    """
    if kind in ("segment", "combination"):
        return _sum(model, name)
    if kind not in catalogue():
        return None
    factors = name.split("*")
    own = [e.parameters for e in model.all_effects if e.kind == kind and e.joint == joint and e.parameters.keys() >= {*factors}]
    return sum(math.prod(parameters[factor] for factor in factors) for parameters in own)


def _sum(model: Model, name: str) -> float | None:
    name = _BRACKET.sub(lambda found: " + ".join(f"{found[1]}{term.strip()}" for term in found[2].split("+")), name)
    factors = [[_FACTOR.fullmatch(factor.strip()) for factor in term.split("*")] for term in name.split("+")]
    total = 0.0
    for term in factors:
        values = []
        for factor in term:
            if factor is None or int(factor[2]) > model.n_joints:
                return None
            values.append(_READ[factor[1]](model.segments[int(factor[2]) - 1]) ** int(factor[3] or 1))
        total += math.prod(values)
    return total
