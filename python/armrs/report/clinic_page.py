"""One page for a clinician, in plain words: what was measured of each joint, how certain it is, and what was unusual."""

from __future__ import annotations

import io
import math
import os
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import checks
from ..catalogue import catalogue
from ..errors import BadInput, Text
from ..io import tomlfile
from . import figures, html, pages, plotting, session_changes
from .sentences import disturbance, is_synthetic, name, together, with_joint_names


@dataclass(frozen=True)
class Quantity:
    """A parameter of a joint as a clinician reads it."""

    kind: str
    parameter: str
    title: str
    meaning: str
    unit: str
    factor: float


QUANTITIES = (
    Quantity(
        "elastic",
        "stiffness",
        "Stiffness",
        "how strongly the joint pulls back for every 10° away from its resting angle",
        "N m per 10°",
        math.pi / 18.0,
    ),
    Quantity("elastic", "rest", "Resting angle", "angle to which the relaxed joint returns by itself, gravity aside", "°", 180.0 / math.pi),
    Quantity("viscous", "viscosity", "Resistance to speed", "what turning at 90° per second adds", "N m", math.pi / 2.0),
    Quantity("coulomb", "torque", "Friction", "resistance to any movement, however slow", "N m", 1.0),
    Quantity(
        "stretch_reflex",
        "gain",
        "Reflex strength",
        "what every 90° per second of stretch beyond the reflex onset adds",
        "N m",
        math.pi / 2.0,
    ),
    Quantity("stretch_reflex", "threshold", "Reflex onset", "speed of stretch above which the muscle resists", "°/s", 180.0 / math.pi),
    Quantity("stretch_reflex", "tonic", "Reflex angle", "angle beyond which the onset is lowest", "°", 180.0 / math.pi),
    Quantity("stretch_reflex", "latency", "Reflex delay", "time from stretch to resistance", "ms", 1000.0),
)
HALF_WIDTH = Quantity(
    "passive",
    "half_width",
    "Resistance to slow movement",
    "half of the difference between both directions of movement; it contains friction and resistance to speed",
    "N m",
    1.0,
)
SLOW = (
    HALF_WIDTH,
    Quantity(
        "passive",
        "stiffness",
        "Stiffness, slow movement",
        "how much more the joint pulls back for every 10° further; errors in the assumed weight of the arm can make it negative",
        "N m per 10°",
        math.pi / 18.0,
    ),
    Quantity(
        "passive",
        "range",
        "Range moved through",
        "how far the joint was moved in one movement; this is no test of how far it can go",
        "°",
        180.0 / math.pi,
    ),
)
"""Results of slow movements for a joint."""
Key = tuple[str, str, int]
"""Kind, parameter and joint of a quantity."""
AS_ARMRS = (1.0, 0.0)
"""How an angle is counted: sign, and the angle of armrs that is called zero [deg]."""
ANGLES = ("rest", "tonic")
"""Parameters that are angles."""
ZERO = "the first joint counts from the horizontal, at the others 0° is straight; positive is counter-clockwise with forward to the right"
"""How armrs counts angles, in words."""
MOST_TRENDS, PANEL, WIDEST = 6, (2.4, 1.55), 20
"""Plots over the sessions that find room on a page, the size of one [inch], and the letters in a line above it."""
MOST_NOTES = 2
"""Notes that find room on one page."""
ANALYSED = ("identify", "passive", "gap", "spasticity")
"""Results of which a summary is made."""
_OF_EVERY_JOINT = ("elastic", "rate", "dry")
"""Families of laws that every joint has: they stand in the table of the joint."""
_MOVING = "a joint has friction and may stick, which the analysis models only roughly"


@dataclass(frozen=True)
class Norm:
    """The usual range of a parameter: `low` to `high`, in SI units, and its source."""

    kind: str
    name: str
    joint: int
    low: float
    high: float
    source: str


@dataclass(frozen=True)
class Line:
    """One quantity of one joint, in its unit: `value` is None where these movements do not measure it, with `at_limit` it may be 0."""

    joint: str
    quantity: Quantity
    value: float | None
    interval: tuple[float, float] | None
    norm: Norm | None
    trend: str | None
    at_limit: bool = False
    counted: tuple[float, float] = AS_ARMRS

    def norm_band(self) -> tuple[float, float] | None:
        """Return the usual range in the unit of the quantity."""
        return None if self.norm is None else _between((self.norm.low, self.norm.high), self.quantity, self.counted)

    @property
    def beside_norm(self) -> str | None:
        """Describe where the interval lies beside the usual range."""
        band = self.norm_band()
        if band is None or self.interval is None:
            return None
        if self.interval[1] < band[0] or self.interval[0] > band[1]:
            return "below" if self.interval[1] < band[0] else "above"
        return "within" if band[0] <= self.interval[0] and self.interval[1] <= band[1] else "not clear"


def load_norms(path: str | os.PathLike[str]) -> tuple[Norm, ...]:
    """Read what is usual: `[[norm]]` tables with `kind`, `name`, `joint`, `low`, `high` in SI units, and `source`."""
    return tomlfile.load(path, _norms)


def _norms(document: Mapping[str, Any], _: Path) -> tuple[Norm, ...]:
    checks.keys("", document, required=["norm"])
    norms = []
    for k, table in enumerate(checks.tables("norm", document["norm"]), start=1):
        place = f"[[norm]] {k}"
        checks.keys(place, table, required=["kind", "name", "joint", "low", "high", "source"])
        known = [(q.kind, q.parameter) for q in (*QUANTITIES, *SLOW)]
        if (table["kind"], table["name"]) not in known:
            allowed = " or ".join(f"{kind} {parameter}" for kind, parameter in known)
            raise BadInput(place, Text(f"{table['kind']} {table['name']}"), allowed)
        low = checks.number(f"{place}, low", table["low"])
        norms.append(
            Norm(
                table["kind"],
                table["name"],
                checks.whole(f"{place}, joint", table["joint"], least=1),
                low,
                checks.number(f"{place}, high", table["high"], above=low),
                checks.text(f"{place}, source", table["source"]),
            )
        )
    return tuple(norms)


def write_summary(sources: Sequence[str | os.PathLike[str]], path: str | os.PathLike[str], norms: Sequence[Norm] = ()) -> Path:
    """Write one page about the results of one session.

    Parameters
    ----------
    sources : sequence of path
        JSON of `identify`, `passive`, `gap`, `spasticity`, or several of them.
    path : path
        The HTML file.
    norms : sequence of Norm
        What is usual, where it is known.
    """
    target = checks.path("path", path)
    results = [pages.read_result(source) for source in sources]
    for source, result in zip(sources, results, strict=True):
        if result["verb"] not in ANALYSED:
            raise BadInput("verb", result["verb"], f"a result of armrs {' or '.join(ANALYSED)}", file=source)
    try:
        for source, result in zip(sources, results, strict=True):
            if name(result) != name(results[0]):
                raise BadInput("data, name", name(result), f"the session of the others, {name(results[0])!r}", file=source)
        found = [line for result in results for line in lines_of(result, norms)]
        joints = results[0]["data"]["joints"]
        lines = sorted(_once(found), key=lambda line: joints.index(line.joint))
        trends = _trends(results, lines)
        page = {
            "name": name(results[0]),
            "synthetic": any(map(is_synthetic, results)),
            "measured": measured(results),
            "lines": lines,
            "words": [words_of(line) for line in lines],
            "estimates": estimates(lines, results),
            "changes": session_changes.change_lines(lines),
            "unusual": unusual(lines, results),
            "notes": [*_contradictions(found), *notes(results)],
            "since": max((c["dates"][-2] for r in results for c in r.get("history", ()) if len(c["dates"]) > 1), default=None),
            "not_measured": not_measured(results, lines),
            "next": next_steps(results, lines),
            "trends": trends,
            "sources": list(dict.fromkeys(line.norm.source for line in lines if line.norm is not None)),
            # Plots over the sessions show the same intervals.
            "picture": None if trends and not norms else _picture(lines, _intervals([*doubts(results)])),
            "intervals": _intervals([*doubts(results)]),
            "made_by": results[0].get("made_by", {}),
        }
    except BadInput:
        raise
    except (KeyError, TypeError, AttributeError, ValueError, IndexError, ArithmeticError) as error:
        raise BadInput("content", Text(f"not what a result holds ({error})"), "whole results", file=sources[0]) from None
    engine = html.environment()
    html.write_page(engine, target, [html.render(engine, "summary.html.j2", page)], title="armrs summary", maker="report")
    return target


def lines_of(result: Mapping[str, Any], norms: Sequence[Norm] = (), *, bare: bool = False) -> list[Line]:
    """Return the lines of a result, joint by joint; with `bare` also of effects that have no interval."""
    joints = result["data"]["joints"]
    usual = {(n.kind, n.name, n.joint): n for n in norms}
    courses = {(c["kind"], c["name"], c["joint"]): c for c in result.get("history", ())}
    if result["verb"] == "passive":
        return _slow_lines(result, usual, courses)
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
            value = _in_unit(item["value"], quantity, own) if known else None
            trend = _trend(courses.get(key), quantity, own)
            at_limit = known and quantity.parameter not in ANGLES and item["interval"][0] <= 0.0
            lines.append(Line(joint, quantity, value, interval, usual.get(key), trend, at_limit, own))
    return lines


def _once(lines: Sequence[Line]) -> list[Line]:
    """Return each quantity of a joint once: from the first result that measures it."""
    first: dict[tuple[str, str], Line] = {}
    for line in lines:
        key = (line.joint, line.quantity.title)
        if key not in first or (first[key].value is None and line.value is not None):
            first[key] = line
    return list(first.values())


def estimates(lines: Sequence[Line], results: Sequence[Mapping[str, Any]]) -> str:
    """Return whose values a page shows, and what the other analyses state where it is another number, and why."""
    left, sources, others = list(lines), [], []
    for result in results:
        stated = {(line.joint, line.quantity.title): line for line in lines_of(result, bare=True) if line.value is not None}
        pairs = [(own, stated[key]) for own in lines if (key := (own.joint, own.quantity.title)) in stated]
        told = []
        for own, line in pairs:
            cells = words_of(line)
            if own in left and (own.value, own.interval) == (line.value, line.interval):
                left.remove(own)
                sources.append(result["verb"])
            elif cells[2] != words_of(own)[2]:
                told.append(f"{own.joint}, {own.quantity.title.lower()} {cells[2]}{cells[3] and f' ({cells[3]})'}")
        if told:
            others.append(f"{_WHY[result['verb']]}, and states {'; '.join(told)}.")
    return f"The table has the values of armrs {' and '.join(dict.fromkeys(sources))}. {' '.join(others)}" if others else ""


_WHY = {
    "identify": "The page of identify fits a spring, resistance to speed and friction to every joint",
    "passive": "The page of passive reads slow movements alone",
    "gap": "The page of gap fits only what the recordings ask for, together with everything else that it found",
    "spasticity": "The page of spasticity fits a reflex beside resistance and friction",
}
"""Why an analysis states another number than the one before it."""


def _contradictions(lines: Sequence[Line]) -> list[str]:
    """Return the quantities for which two results contradict each other."""
    said = []
    for line in _once(lines):
        own = [o for o in lines if (o.joint, o.quantity.title) == (line.joint, line.quantity.title) and o.interval is not None]
        if own and max(o.interval[0] for o in own if o.interval) > min(o.interval[1] for o in own if o.interval):
            said.append(f"{line.joint}: {line.quantity.title.lower()} differs between the analyses by more than the uncertainty of both.")
    return said


def _slow_lines(result: Mapping[str, Any], usual: Mapping[Key, Norm], courses: Mapping[Key, Mapping[str, Any]]) -> list[Line]:
    """Return the results of slow movements for each joint, of the movement with an interval and with most repeats, which is known best."""
    lines = []
    for j, joint in enumerate(result["data"]["joints"], start=1):
        curve = _best_known(result, j)
        if curve is None:
            continue
        for quantity in SLOW:
            course = courses.get((quantity.kind, f"{quantity.parameter} in {curve['configuration']}", j))
            if quantity is HALF_WIDTH:
                value, (low, high) = curve["half_width_mean_Nm"], curve.get("half_width_interval_Nm") or (None, None)
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
                value, (low, high) = quantity.factor * found["value"], (quantity.factor * x for x in found["interval"])
            interval = None if low is None or high is None else (low, high)
            norm, none_seen = usual.get((quantity.kind, quantity.parameter, j)), quantity is HALF_WIDTH and low is not None and low <= 0.0
            # How far a joint was moved was chosen: that it differs is no change of the arm.
            trend = None if quantity.parameter == "range" else _trend(course, quantity)
            lines.append(Line(joint, quantity, value, interval, norm, trend, none_seen))
    return lines


def _best_known(result: Mapping[str, Any], joint: int) -> Mapping[str, Any] | None:
    """Return the curve of a joint from the movement with an interval and with most repeats."""
    own = [c for c in result["curves"] if c["joint"] == joint and c.get("half_width_mean_Nm") is not None]
    return max(own, key=lambda c: (None not in (c.get("half_width_interval_Nm") or (None,)), c["repeats"]), default=None)


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
            value = _in_unit(found["value"], quantity, own)
            ends = None if found.get("interval") is None else _between(found["interval"], quantity, own)
            lines.append(Line(joint, quantity, value, ends, usual.get(key), _trend(courses.get(key), quantity, own), counted=own))
    return lines


def counted(result: Mapping[str, Any], joint: int, quantity: Quantity) -> tuple[float, float]:
    """Return how a quantity of a joint is counted: an angle as the laboratory does, where the data set says how."""
    if quantity.parameter not in ANGLES:
        return AS_ARMRS
    return _laboratory(result, joint)


def _laboratory(result: Mapping[str, Any], joint: int) -> tuple[float, float]:
    angles = result["data"].get("angles")
    return AS_ARMRS if angles is None else (float(angles["signs"][joint - 1]), float(angles["zero_deg"][joint - 1]))


def _in_unit(value: float, quantity: Quantity, own: tuple[float, float]) -> float:
    return own[0] * (quantity.factor * value - own[1])


def _between(interval: Sequence[float], quantity: Quantity, own: tuple[float, float]) -> tuple[float, float]:
    low, high = sorted(_in_unit(end, quantity, own) for end in interval)
    return low, high


def _trend(course: Mapping[str, Any] | None, quantity: Quantity, own: tuple[float, float] = AS_ARMRS) -> str | None:
    """Describe how the last session differs from the one before it, and how certain that is."""
    if course is None or len(course["dates"]) < 2 or course.get("since_last") is None or not math.isfinite(course["since_last"]):
        return None
    change, either_way = own[0] * quantity.factor * course["since_last"], quantity.factor * 1.96 * course["since_last_std"]
    # The zero of an angle is a convention: a share of it means nothing.
    before = None if quantity.parameter in ANGLES else quantity.factor * course["values"][-2]
    return session_changes.trend(change, either_way, before, clear=course["changed_since_last"])


def not_measured(results: Sequence[Mapping[str, Any]], lines: Sequence[Line]) -> list[str]:
    """Return what these movements do not measure."""
    seen = {line.joint for line in lines if line.value is not None}
    said = [f"{joint}: nothing was measured of this joint." for joint in results[0]["data"]["joints"] if joint not in seen]
    if not any(line.quantity.kind == "stretch_reflex" for line in lines):
        said.append("Reflexes: they need stretches at several speeds (armrs spasticity).")
    return [*said, "Strength, voluntary movement, pain, and how far the joints can go."]


def next_steps(results: Sequence[Mapping[str, Any]], lines: Sequence[Line]) -> list[str]:
    """Return measurements that would decide what is open."""
    said = []
    unclear = [line for line in lines if line.trend is not None and line.trend.startswith(session_changes.NO_CHANGE)]
    if unclear:
        said.append(
            "Where no clear change is stated, a change smaller than the number behind ± could not have been seen. More repeats of each "
            "movement make that number smaller: four times the repeats halve it."
        )
    if any(line.trend is not None and line.trend.startswith(session_changes.CLEAR) for line in lines):
        said.append("Repeat the session within days before acting on a change: strapping and posture differ from day to day.")
    if lines and all(line.trend is None for line in lines):
        said.append("Keep the sessions of this person in one file (--history FILE): the next page then says what changed.")
    return said


def _trends(results: Sequence[Mapping[str, Any]], lines: Sequence[Line]) -> html.Picture | None:
    """Draw what the table has over the sessions, where there are several."""
    listed = [f"{line.joint}: {line.quantity.title.lower()}" for line in lines]
    known = sorted((c for c in followed(results) if c["name"] in listed), key=lambda c: not c["changed"])[:MOST_TRENDS]
    if not known:
        return None
    with plotting.style():
        drawn = figures.history([c | {"name": textwrap.fill(c["name"], WIDEST)} for c in known], PANEL)["history"]()
        image = io.BytesIO()
        plotting.write_png(drawn.figure, image)
    return html.Picture("trends.png", drawn.title, drawn.text, html.data_uri(image.getvalue()))


def followed(results: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return what is followed over the sessions with the names, the units and the zero of the table."""
    by_name = {(q.kind, q.parameter): q for q in (*QUANTITIES, *SLOW)}
    found = []
    for result in results:
        for course in result.get("history", ()):
            parameter, _, movement = str(course["name"]).partition(" in ")
            quantity = by_name.get((course["kind"], parameter))
            if quantity is None or parameter == "range" or len(course["dates"]) < 2:
                continue
            if movement and movement != (_best_known(result, course["joint"]) or {}).get("configuration"):
                continue
            own = counted(result, course["joint"], quantity)
            said = f"{result['data']['joints'][course['joint'] - 1]}: {quantity.title.lower()}"
            values = [_in_unit(value, quantity, own) for value in course["values"]]
            stds = [quantity.factor * std for std in course["stds"]]
            drawn = {"name": said, "joint": None, "unit": quantity.unit, "values": values, "stds": stds}
            found.append({**course, **drawn, "changed": course["changed_since_last"]})
    return found


def measured(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what was measured, a sentence each."""
    data = results[0]["data"]
    trials = data["fit"]["trials"] + data["test"]["trials"]
    seconds = data["fit"]["duration_s"] + data["test"]["duration_s"]
    lines = [
        f"The relaxed arm was moved and measured {trials} times, {seconds / 60.0:.1f} minutes in all, in {len(data['configurations'])} "
        f"{'different movements' if len(data['configurations']) > 1 else 'movement'}."
    ]
    ranges = data.get("range_deg")
    if ranges:
        said = []
        for j, (joint, ends) in enumerate(zip(data["joints"], ranges, strict=True), start=1):
            sign, zero = _laboratory(results[0], j)
            low, high = sorted(sign * (end - zero) for end in ends)
            said.append(f"{joint} from {low:.0f}° to {high:.0f}°".replace("-", "−"))
        lines.append(f"Range that was moved through: {', '.join(said)}. This is no test of how far the joints can go.")
    return [*lines, f"Angles: {(data.get('angles') or {}).get('words', ZERO)}."]


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


def unusual(lines: Sequence[Line], results: Sequence[Mapping[str, Any]] = ()) -> list[str]:
    """Return what is outside of what is usual, and whether something acts that has no name, in plain words."""
    said = []
    if any(result.get("verb") == "gap" and result.get("verdict") == "unexplained" for result in results):
        said.append("Something acts on the arm that the analysis could not name: the numbers of this page may contain part of it.")
    for result in results:
        if result.get("verb") == "gap":
            said += found(result)
    for line in lines:
        if line.beside_norm in ("below", "above"):
            said.append(f"{line.joint}: {line.quantity.title.lower()} is {line.beside_norm} the usual range.")
    return said


def found(result: Mapping[str, Any]) -> list[str]:
    """Return what the search for missing effects found besides the laws that every joint has, and what disturbed single recordings."""
    said = []
    for effect in result.get("effects", ()):
        joint = effect.get("joint")
        what = effect.get("summary", effect["kind"]) + ("" if joint is None else f" ({result['data']['joints'][joint - 1]})")
        if there := disturbance(effect):
            trial, start, end = there
            said.append(f"In the recording {Path(trial).stem}, {start:.1f} to {end:.1f} s: {what}. This part was left out.")
        elif effect.get("family", "elastic") not in _OF_EVERY_JOINT:
            said.append(f"The analysis found: {what}.")
    return said


def notes(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the reservations of the analysis about its own numbers."""
    said = [str(check["text"]) for result in results for check in result.get("checks", ()) if check["passed"] is False]
    said = together(said + [with_joint_names(str(line), r["data"]["joints"]) for r in results for line in r.get("warnings", ())])
    more = len(said) - MOST_NOTES
    return said if more <= 0 else [*said[:MOST_NOTES], f"and {more} more, in the reports of the analysis"]


def _number(value: float, line: Line | None = None) -> str:
    """Write a number with two digits of its uncertainty, as the norm and the change beside it, or three of its own."""
    width = 0.0 if line is None or line.interval is None else 0.25 * (line.interval[1] - line.interval[0])
    size = width if width > 0.0 else 0.1 * abs(value)
    finest = 3 if line is None or line.quantity.unit != "°" else 1
    decimals = 0 if size <= 0.0 else min(max(1 - math.floor(math.log10(size)), 0), finest)
    return f"{value:.{decimals}f}".replace("-", "−")


def doubts(results: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Give why the intervals of these results may be too narrow."""
    for result in results:
        estimates = [*result.get("parameters", ()), *result.get("combinations", ())] if result["verb"] == "identify" else []
        if any(str(warning).startswith("the residual of joint") for warning in result.get("warnings", ())):
            yield "the analysis does not describe all that was measured"
        if any(e.get("caveat") for e in estimates):
            yield "a large part of the speeds is noise"
        if any(_is_dry(e["kind"]) and e["decided_by"] == "data" and e["interval"][0] > 0.0 for e in estimates):
            yield _MOVING
        if result.get("verdict") == "unexplained":
            yield "something acts on the arm that has no name"


def _is_dry(kind: str) -> bool:
    """Whether an estimate is of dry friction."""
    known = catalogue().get(kind)
    return known is not None and known.family == "dry"


def _intervals(doubted: Sequence[str]) -> str:
    """Return the meaning of the intervals."""
    beside = f"; here they may be too narrow: {'; '.join(dict.fromkeys(doubted))}" if doubted else ""
    return f"95 % intervals. They hold if the joint behaves as a spring with resistance and friction{beside}."


def _picture(lines: Sequence[Line], intervals: str) -> html.Picture | None:
    """Draw every quantity with its interval, one panel each, the usual range behind."""
    # How far a joint was moved was chosen: the table states it.
    shown = [
        q for q in (*QUANTITIES, *SLOW) if q.parameter != "range" and any(line.quantity is q and line.value is not None for line in lines)
    ]
    if not shown:
        return None
    with plotting.style():
        joints = list(dict.fromkeys(line.joint for line in lines))
        rows, columns = plotting.grid(len(shown))
        figure = plotting.figure(3.1 * columns + 0.8, (0.36 * len(joints) + 1.0) * rows)
        axes = figure.subplots(rows, columns, squeeze=False, sharey=True).ravel()
        for ax in axes[len(shown) :]:
            ax.remove()
        for ax, quantity in zip(axes, shown, strict=False):
            for line in lines:
                if line.quantity is not quantity or line.value is None:
                    continue
                row = joints.index(line.joint)
                band = line.norm_band()
                if band is not None:
                    ax.barh(row, band[1] - band[0], left=band[0], height=0.62, color=plotting.FAINT)
                if line.interval is not None:
                    low = max(line.interval[0], 0.0) if line.at_limit else line.interval[0]
                    ax.hlines(row, low, line.interval[1], color=plotting.BLUE, lw=2.6)
                ax.plot(line.value, row, "o", color=plotting.BLUE, ms=7)
            ax.set_title(quantity.title)
            ax.set_xlabel(f"[{quantity.unit}]")
            ax.grid(visible=False, axis="y")
            ax.locator_params(axis="x", nbins=4)
            if quantity.unit != "°":
                ax.set_xlim(left=min(0.0, ax.get_xlim()[0]))
        axes[0].set_yticks(range(len(joints)), joints)
        axes[0].set_ylim(len(joints) - 0.4, -0.6)
        image = io.BytesIO()
        plotting.write_png(figure, image)
    grey = " The grey bar is what is usual." if any(line.norm for line in lines) else ""
    text = f"Points are what was measured. The lines are {intervals}{grey}"
    return html.Picture("summary.png", "Each joint", text, html.data_uri(image.getvalue()))
