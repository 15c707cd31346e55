"""Drawing random values, and replacing values in nested tables or in a model."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

import numpy as np

from .. import checks
from ..errors import BadInput, Text, unknown_name
from ..model import Contact, Effect, Joint, Model, Segment

Path = tuple[str | int, ...]
"""Names and positions, from 1."""

_STEP = re.compile(r"\.?([A-Za-z_][A-Za-z0-9_]*)|\[([0-9]{1,6})\]")
_PLURAL = {"segment": "segments", "joint": "joints", "effect": "effects"}
OF_TRUTH = (*_PLURAL, "contact")
"""What a key may begin with to change the arm that is simulated."""
OF_EXPERIMENT = ("subject", "handle", "movement", "sensors", "variation", "controller", "safety", "robot", "fault", "tolerance")
"""What it may begin with to change the experiment."""
APPLY = ("replace", "scale", "add")
DISTRIBUTIONS = ("range", "normal", "values")
_LEAST_INSIDE = 1e-3
"""Share of a normal distribution that must lie within its limits."""


@dataclass(frozen=True)
class Vary:
    """One value that is drawn anew for every case.

    Attributes
    ----------
    key : str
        Where it stands, such as `segment[1].mass` or `sensors.force_noise_N`.
    kind : {"range", "normal", "values"}
        Uniform; normal; one of a list, each as likely.
    numbers : tuple
        Low and high; mean and standard deviation; or the values.
    within : (float, float), optional
        Limits of a normal distribution: what falls outside is drawn again.
    apply : {"replace", "scale", "add"}
        What the draw does with the value that stands there.
    """

    key: str
    kind: str
    numbers: tuple[Any, ...]
    within: tuple[float, float] | None = None
    apply: str = "replace"

    @property
    def of_truth(self) -> bool:
        """Whether it changes the arm that is simulated, and not the experiment."""
        return path_of(self.key)[0] in OF_TRUTH

    @property
    def numeric(self) -> bool:
        """Whether every draw is a number."""
        return self.kind != "values" or all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in self.numbers)

    def draw(self, seed: int, position: int) -> Any:
        """Return the value for a case; it depends on the seed of the case and the position in the list alone."""
        source = np.random.default_rng([seed, 1, position])
        if self.kind == "values":
            return self.numbers[int(source.integers(len(self.numbers)))]
        first, second = self.numbers
        if self.kind == "range":
            return float(first + (second - first) * source.random())
        while True:
            value = float(first + second * source.standard_normal())
            if self.within is None or self.within[0] <= value <= self.within[1]:
                return value

    def extremes(self) -> tuple[Any, ...]:
        """Return draws to check beforehand whether the key can take them."""
        return self.numbers if self.kind != "normal" else (self.numbers[0], *(self.within or ()))

    def change(self, target: Any, value: Any) -> Any:
        """Return tables or a model with this value drawn; what is given stays as it is."""

        def new(old: Any) -> Any:
            if self.apply == "replace":
                return value
            if old is None:
                raise BadInput("apply", self.apply, f"a value of {self.key} in the experiment to {self.apply}")
            number = checks.number(f"{self.key} before the draw", old)
            return number * value if self.apply == "scale" else number + value

        return _changed(target, path_of(self.key), new, self.key)


def vary_of(place: str, table: Mapping[str, Any]) -> Vary:
    """Return the contents of a table `[[vary]]`."""
    checks.keys(place, table, required=["key"], optional=[*DISTRIBUTIONS, "within", "apply"])
    key = checks.text(f"{place}, key", table["key"])
    place = f"{place} ({key})"
    try:
        path_of(key)
        given = [name for name in DISTRIBUTIONS if name in table]
        if len(given) != 1:
            raise BadInput(", ".join(given) or "range", Text(f"{len(given)} distributions"), "one of range, normal, values")
        kind = given[0]
        within = None
        if kind == "values":
            numbers = _values(table[kind])
        else:
            numbers = checks.pair(kind, table[kind])
            if kind == "range" and not numbers[0] < numbers[1]:
                raise BadInput(kind, list(numbers), "low and high, low first")
            if kind == "normal":
                checks.number("normal[1]", numbers[1], above=0.0)
        if "within" in table:
            within = _within(table["within"], kind, numbers)
        apply = checks.choice("apply", table.get("apply", "replace"), APPLY)
        vary = Vary(key, kind, numbers, within, apply)
        if apply != "replace" and not vary.numeric:
            raise BadInput("values", table["values"], f'numbers, with apply = "{apply}"')
        return vary
    except BadInput as error:
        raise error.within(place=place) from None


def path_of(key: str) -> Path:
    """Split a key such as `movement[1].waypoints_deg[2][1]`."""
    steps: list[str | int] = []
    at = 0
    while at < len(key):
        found = _STEP.match(key, at)
        if found is None or (found[1] is not None and (at == 0) == key.startswith(".", at)) or (at == 0 and found[1] is None):
            raise BadInput("key", key, "names with points between them and positions from 1, as in segment[1].mass")
        steps.append(found[1] if found[1] is not None else int(found[2]))
        at = found.end()
    if not steps or steps[0] not in (*OF_TRUTH, *OF_EXPERIMENT):
        raise unknown_name("key", str(steps[0] if steps else key), (*OF_TRUTH, *OF_EXPERIMENT), what="first name")
    return tuple(steps)


def _values(value: object) -> tuple[Any, ...]:
    if not isinstance(value, list) or not value:
        raise BadInput("values", value, "a list of at least one value")
    for k, item in enumerate(value, start=1):
        if isinstance(item, float):
            checks.number(f"values, {k}", item)
    return tuple(value)


def _within(value: object, kind: str, numbers: tuple[float, ...]) -> tuple[float, float]:
    if kind != "normal":
        raise BadInput("within", value, "only beside normal")
    low, high = checks.pair("within", value)
    if not low < high:
        raise BadInput("within", [low, high], "low and high, low first")
    normal = NormalDist(*numbers)
    inside = normal.cdf(high) - normal.cdf(low)
    if inside < _LEAST_INSIDE:
        raise BadInput("within", [low, high], f"limits that hold at least {_LEAST_INSIDE:g} of the distribution, here {inside:.2g}")
    return low, high


def _changed(item: Any, path: Path, new: Callable[[Any], Any], key: str) -> Any:
    """Return `item` with the value at `path` replaced by what `new` makes of it; only what lies on the way is copied."""
    if not path:
        return new(item)
    head, rest = path[0], path[1:]
    if isinstance(head, int):
        if not isinstance(item, Sequence) or isinstance(item, str):
            raise BadInput("key", key, f"no position [{head}]: there is no list")
        if not 1 <= head <= len(item):
            raise BadInput("key", key, f"a position [1] to [{len(item)}]" if item else "no position: the list is empty")
        changed = [_changed(part, rest, new, key) if k == head else part for k, part in enumerate(item, start=1)]
        return changed if isinstance(item, list) else tuple(changed)
    if isinstance(item, Effect):
        return item.replace(parameters=_changed(dict(item.parameters), path, new, key))
    if isinstance(item, Mapping):
        # A table whose values all have their defaults may be absent; an unknown key is refused when it is read.
        there = item.get(head, {} if rest and isinstance(rest[0], str) else None)
        return {**item, head: _changed(there, rest, new, key)}
    if isinstance(item, (Model, Segment, Joint, Contact)):
        name = _PLURAL.get(head, head) if isinstance(item, Model) else head
        attributes = [n for n in item.__match_args__ if n != "name"]
        if name not in attributes:
            raise unknown_name("key", head, attributes)
        return item.replace(**{name: _changed(getattr(item, name), rest, new, key)})
    raise BadInput("key", key, f"no {head} below a single value")
