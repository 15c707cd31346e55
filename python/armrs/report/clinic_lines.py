"""The lines of the page for a clinician: each quantity of each joint, its interval, what is usual, and what it is compared with."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from .clinic_norms import Norm, usual_of
from .clinic_quantities import ANGLES, AS_ARMRS, HALF_WIDTH, QUANTITIES, SLOW, Key, Quantity
from .session_changes import Change


@dataclass(frozen=True)
class Line:
    """One quantity of one joint, in its unit, and what it is compared with.

    `value` is None where these movements do not measure it, with `at_limit` it may be 0.
    """

    joint: str
    quantity: Quantity
    value: float | None
    interval: tuple[float, float] | None
    norm: Norm | None
    before: Change | None
    first: Change | None = None
    other_arm: Change | None = None
    at_limit: bool = False
    counted: tuple[float, float] = AS_ARMRS

    def norm_band(self) -> tuple[float, float] | None:
        """Return the usual range in the unit of the quantity."""
        return None if self.norm is None else _between((self.norm.low, self.norm.high), self.quantity, self.counted)

    @property
    def trend(self) -> str | None:
        """Describe what changed since the session before."""
        return None if self.before is None else self.before.words

    @property
    def beside_norm(self) -> str | None:
        """Describe where the interval lies beside the usual range."""
        band = self.norm_band()
        if band is None or self.interval is None:
            return None
        if self.interval[1] < band[0] or self.interval[0] > band[1]:
            return "below" if self.interval[1] < band[0] else "above"
        return "within" if band[0] <= self.interval[0] and self.interval[1] <= band[1] else "not clear"


def lines_of(result: Mapping[str, Any], norms: Sequence[Norm] = (), *, bare: bool = False) -> list[Line]:
    """Return the lines of a result, joint by joint; with `bare` also of effects that have no interval."""
    joints = result["data"]["joints"]
    courses = {(c["kind"], c["name"], c["joint"]): c for c in result.get("history", ())}
    if result["verb"] == "passive":
        return _slow_lines(result, norms, courses)
    usual = usual_of(norms, result)
    if result["verb"] in ("gap", "spasticity"):
        return _effect_lines(result, usual, courses, bare)
    lines = []
    for j, joint in enumerate(joints, start=1):
        for quantity in QUANTITIES:
            key = (quantity.kind, quantity.parameter, j)
            item = next((e for e in result["parameters"] if (e["kind"], e["name"], e["joint"]) == key), None)
            if item is None:
                continue
            known, own = item["decided_by"] != "prior", counted(result, j, quantity)
            interval = _between(item["interval"], quantity, own) if known else None
            value = in_unit(item["value"], quantity, own) if known else None
            compared = _compared(courses, key, quantity, own)
            at_limit = known and quantity.parameter not in ANGLES and item["interval"][0] <= 0.0
            lines.append(Line(joint, quantity, value, interval, usual.get(key), *compared, at_limit=at_limit, counted=own))
    return lines


def once(lines: Sequence[Line]) -> list[Line]:
    """Return each quantity of a joint once: from the first result that measures it."""
    first: dict[tuple[str, str], Line] = {}
    for line in lines:
        key = (line.joint, line.quantity.title)
        if key not in first or (first[key].value is None and line.value is not None):
            first[key] = line
    return list(first.values())


def _slow_lines(result: Mapping[str, Any], norms: Sequence[Norm], courses: Mapping[Key, Mapping[str, Any]]) -> list[Line]:
    """Return the results of slow movements for each joint, of the movement with an interval and with most repeats, which is known best."""
    lines = []
    for j, joint in enumerate(result["data"]["joints"], start=1):
        curve = best_known(result, j)
        if curve is None:
            continue
        usual = usual_of(norms, result, curve["configuration"])
        for quantity in SLOW:
            key = (quantity.kind, f"{quantity.parameter} in {curve['configuration']}", j)
            if quantity is HALF_WIDTH:
                value, (low, high) = (
                    curve["half_width_mean_Nm"],
                    whole(curve, quantity) or curve.get("half_width_interval_Nm") or (None, None),
                )
            else:
                found = next(
                    (
                        e
                        for e in result.get("repeated", ())
                        if e["joint"] == j and e["name"] == f"{quantity.parameter} in {curve['configuration']}"
                    ),
                    None,
                )
                if found is None or found["value"] is None:
                    continue
                value, (low, high) = (
                    quantity.factor * found["value"],
                    (quantity.factor * x for x in whole(curve, quantity) or found["interval"]),
                )
            interval = None if low is None or high is None else (low, high)
            norm, none_seen = usual.get((quantity.kind, quantity.parameter, j)), quantity is HALF_WIDTH and low is not None and low <= 0.0
            # How far a joint was moved was chosen: that it differs is no change of the arm.
            compared = _NOTHING if quantity.parameter == "range" else _compared(courses, key, quantity)
            lines.append(Line(joint, quantity, value, interval, norm, *compared, at_limit=none_seen))
    return lines


def whole(curve: Mapping[str, Any], quantity: Quantity) -> list[float] | None:
    """Return the interval with the errors that sessions share, such as those of masses; results of older versions have none."""
    found = curve.get(f"{quantity.parameter}_whole_interval_{'Nm' if quantity is HALF_WIDTH else 'Nm_rad'}")
    return None if found is None or None in found or not all(map(math.isfinite, found)) else list(found)


def best_known(result: Mapping[str, Any], joint: int) -> Mapping[str, Any] | None:
    """Return the curve of a joint from the slow movement with an interval and with most repeats, the slowest of these."""
    own = [c for c in result["curves"] if c["joint"] == joint and c.get("slow", True) and c.get("half_width_mean_Nm") is not None]

    def rank(c: Mapping[str, Any]) -> tuple[bool, int, float]:
        return None not in (c.get("half_width_interval_Nm") or (None,)), c["repeats"], -(c.get("bandwidth_Hz") or math.inf)

    return max(own, key=rank, default=None)


def without_reflexes(results: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return results in which no movement is slow in which the reflex of its joint acts, by the stretches of `spasticity` beside it."""
    reflexes = [(result, e) for result in results if result["verb"] == "spasticity" for e in result["effects"] if e["decided"]]
    caught = {
        (stretch["configuration"], stretch["joint"])
        for result, effect in reflexes
        for stretch in result.get("stretches", ())
        if stretch["joint"] == effect["joint"] and stretch["speed"] > effect["parameters"]["threshold"]["value"]
    }

    def slow(curve: Mapping[str, Any]) -> bool:
        return curve.get("slow", True) and (curve["configuration"], curve["joint"]) not in caught

    return [
        {**result, "curves": [{**curve, "slow": slow(curve)} for curve in result["curves"]]} if "curves" in result else dict(result)
        for result in results
    ]


def _effect_lines(result: Mapping[str, Any], usual: Mapping[Key, Norm], courses: Mapping[Key, Mapping[str, Any]], bare: bool) -> list[Line]:
    """Return the effects of joints that were found, in all trials and without an alternative."""
    lines = []
    besides = [
        {"kind": kind, "joint": found["joint"], "parameters": {name: found[key]}}
        for found in result.get("besides", ())
        for kind, name, key in (("viscous", "viscosity", "viscosity"), ("coulomb", "torque", "dry"))
    ]
    for effect in [*result["effects"], *besides]:
        if effect["joint"] is None or not effect.get("decided", True) or effect.get("trial"):
            continue
        for quantity in QUANTITIES:
            found = effect["parameters"].get(quantity.parameter) if effect["kind"] == quantity.kind else None
            if found is None or (found.get("interval") is None and not bare):
                continue
            key = (quantity.kind, quantity.parameter, effect["joint"])
            own = counted(result, effect["joint"], quantity)
            joint = result["data"]["joints"][effect["joint"] - 1]
            value = in_unit(found["value"], quantity, own)
            ends = None if found.get("interval") is None else _between(found["interval"], quantity, own)
            compared = _compared(courses, key, quantity, own)
            lines.append(Line(joint, quantity, value, ends, usual.get(key), *compared, counted=own))
    return lines


def counted(result: Mapping[str, Any], joint: int, quantity: Quantity) -> tuple[float, float]:
    """Return how a quantity of a joint is counted: an angle as the laboratory does, where the data set says how."""
    if quantity.parameter not in ANGLES:
        return AS_ARMRS
    return laboratory(result, joint)


def laboratory(result: Mapping[str, Any], joint: int) -> tuple[float, float]:
    """Return how the laboratory counts the angle of a joint, as `AS_ARMRS` where the data set does not say."""
    angles = result["data"].get("angles")
    return AS_ARMRS if angles is None else (float(angles["signs"][joint - 1]), float(angles["zero_deg"][joint - 1]))


def in_unit(value: float, quantity: Quantity, own: tuple[float, float]) -> float:
    """Return a value in the unit of its quantity, counted as `own` says."""
    return own[0] * (quantity.factor * value - own[1])


def _between(interval: Sequence[float], quantity: Quantity, own: tuple[float, float]) -> tuple[float, float]:
    low, high = sorted(in_unit(end, quantity, own) for end in interval)
    return low, high


_Compared = tuple[Change | None, Change | None, Change | None]
_NOTHING: _Compared = (None, None, None)


def _compared(courses: Mapping[Key, Mapping[str, Any]], key: Key, quantity: Quantity, own: tuple[float, float] = AS_ARMRS) -> _Compared:
    """Return how a quantity differs from the session before, from the first one, and from the other arm."""
    course = courses.get(key)
    if course is None:
        return _NOTHING
    before, first, other = (_change(courses, course, name, quantity, own) for name in ("before", "first", "other_arm"))
    # With two sessions the first is the one before.
    return before, None if first is None or before is None or first.date == before.date else first, other


def _change(
    courses: Mapping[Key, Mapping[str, Any]], course: Mapping[str, Any], name: str, quantity: Quantity, own: tuple[float, float]
) -> Change | None:
    found = _difference(course, name)
    if found is None:
        return None
    value, last = quantity.factor * found["value"], quantity.factor * course["values"][-1]
    # The zero of an angle is a convention: a share of it means nothing.
    share_of = None if quantity.parameter in ANGLES else last - value
    return Change(
        own[0] * value,
        quantity.factor * 1.96 * found["std"],
        share_of,
        bool(found["clear"]),
        str(found["date"]),
        sum(_difference(c, name) is not None for c in courses.values()),
        quantity.factor * course["stds"][-1],
    )


def _difference(course: Mapping[str, Any], name: str) -> Mapping[str, Any] | None:
    """Return a comparison of a course, where there is one; results of version 0.1.0 have only that with the session before."""
    found = course.get(name)
    known = found is not None and found["value"] is not None and math.isfinite(found["value"])
    return found if known else None


def words_of(line: Line) -> list[str]:
    """Return the cells of a line: joint, quantity with unit, value, interval, what is usual, trend."""
    band = line.norm_band()
    usual = "" if band is None else f"{_number(band[0])} to {_number(band[1])}"
    if line.beside_norm is not None:
        usual += {"within": ", usual", "not clear": ", not clear"}.get(line.beside_norm, f", {line.beside_norm} it")
    value = "not measured" if line.value is None else _number(line.value, line)
    between = "" if line.interval is None else f"{_number(line.interval[0], line)} to {_number(line.interval[1], line)}"
    if between == f"{value} to {value}":
        between = ""
    if line.at_limit and line.interval is not None:
        value, between = "none seen", f"at most {_number(line.interval[1], line)}"
    return [line.joint, f"{line.quantity.title} [{line.quantity.unit}]", value, between, usual, line.trend or ""]


def _number(value: float, line: Line | None = None) -> str:
    """Write a number with two digits of its uncertainty, as the norm and the change beside it, or three of its own."""
    width = 0.0 if line is None or line.interval is None else 0.25 * (line.interval[1] - line.interval[0])
    size = width if width > 0.0 else 0.1 * abs(value)
    finest = 3 if line is None or line.quantity.unit != "°" else 1
    decimals = 0 if size <= 0.0 else min(max(1 - math.floor(math.log10(size)), 0), finest)
    return f"{value:.{decimals}f}".replace("-", "−")
