"""The catalogue of effects, as the compiled core states it.

The list is in the core: no effect is named here. Where the compiled module is absent, `catalogue()` is empty and
effects are only checked for their form.
"""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import Any

from . import checks

FORCE_CHANNELS = ("Fy", "Fz", "Mx")
"""Channels of the force sensor in the order of the core."""


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect.

    Attributes
    ----------
    name, unit : str
        Name and SI unit.
    min, max : float
        Bounds, both included; infinite where there is none.
    default : float
        Value when it is left out.
    linear : bool
        Whether the effect is linear in it; a fit takes such parameters as unknowns.
    or_zero : bool
        Whether zero is allowed beside the bounds, for the limit of the law.
    """

    name: str
    unit: str
    min: float
    max: float
    default: float
    linear: bool = True
    or_zero: bool = False

    def __post_init__(self) -> None:
        checks.text("name", self.name)
        checks.instance("unit", self.unit, str)
        for name in ("min", "max"):
            checks.extent(name, getattr(self, name))
        checks.number("default", self.default)
        checks.flag("linear", self.linear)
        checks.flag("or_zero", self.or_zero)


@dataclass(frozen=True)
class Kind:
    """One kind of effect: name, what it is called in a sentence, where it acts, what it does, its formula and its source."""

    kind: str
    title: str
    where: str
    summary: str
    formula: str
    reference: str
    parameters: tuple[Parameter, ...]
    address: str | None = None
    """What else an effect of this kind must state: "joint", "channel" or nothing (None)."""
    first_joint: int = 1
    """Lowest joint at which it can stand; 2 where it also acts in the joint before."""
    family: str = ""
    """The family of effects that it belongs to: its members may be indistinguishable by movements."""
    feels_activity: bool = False
    """Whether it depends on the activity of muscles, given by `emg_*` columns and `[[muscle]]` of a data set."""
    rate_independent: bool = False
    """Whether its torque is a constant, or one whose sign alone follows the motion: what a quasi-static analysis can find."""
    searched: bool = True
    """Whether `armrs gap` searches for it; others are simulated and identified where a model or `with_effects` has them."""
    own: bool = False
    """Whether it was declared by `armrs.own_effect`, and is no part of the catalogue that every installation has."""

    def values(self, numbers: Sequence[float]) -> dict[str, float]:
        """Return numbers in the order of the parameters by name; what rounding has put beyond a bound is at the bound."""
        return {p.name: v if p.or_zero and v == 0.0 else min(max(v, p.min), p.max) for p, v in zip(self.parameters, numbers, strict=True)}

    def place(self, index: int) -> tuple[int | None, str | None]:
        """Return joint and channel of the core's index."""
        return (index + 1 if self.address == "joint" else None, FORCE_CHANNELS[index] if self.address == "channel" else None)


@functools.cache
def catalogue() -> Mapping[str, Kind]:
    """Return every kind of effect by name, in the order of the core; empty without the compiled module."""
    try:
        from . import _armrs

        entries = _armrs.effects()
    except (ImportError, AttributeError):
        return MappingProxyType({})
    return MappingProxyType({entry["kind"]: _kind(entry) for entry in entries})


def title(kind: str) -> str:
    """Return what a kind is called in a sentence.

    >>> title("coulomb"), title("contact_damping")
    ('Coulomb friction', 'contact damping')
    """
    known = catalogue().get(kind)
    return known.title if known else kind.replace("_", " ")


def _kind(entry: Mapping[str, Any]) -> Kind:
    own = {f.name for f in fields(Parameter)}
    parameters = tuple(Parameter(**{k: v for k, v in p.items() if k in own}) for p in entry["parameters"])
    plain = {f.name: entry[f.name] for f in fields(Kind) if f.name in entry}
    return Kind(**{**plain, "parameters": parameters})
