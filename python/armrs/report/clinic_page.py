"""One page for a clinician, in plain words: what was measured of each joint, how certain it is, and what was unusual."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any

from .. import checks
from ..analysis.passivity_checks import NOT_SLOW
from ..catalogue import catalogue
from ..errors import BadInput, Text
from ..io import arm_side
from . import clinic_trends, html, pages, session_changes
from .clinic_lines import Line, laboratory, lines_of, once, without_reflexes, words_of
from .clinic_next import failed_checks, faults, next_steps, too_fast
from .clinic_norms import Norm
from .sentences import disturbance, is_synthetic, name, together, with_joint_names

ZERO = "the first joint counts from the horizontal, at the others 0° is straight; positive is counter-clockwise with forward to the right"
"""How armrs counts angles, in words."""
MOST_NOTES = 2
"""Notes that find room on one page."""
MOST_LINES = 14
"""Lines of the table and on what is compared beyond which the letters on paper are smaller, so that all stays one sheet."""
ANALYSED = ("identify", "passive", "gap", "spasticity")
"""Results of which a summary is made."""
_OF_EVERY_JOINT = ("elastic", "rate", "dry")
"""Families of laws that every joint has: they stand in the table of the joint."""
_MOVING = "a joint has friction and may stick, which the analysis models only roughly"


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
        _one_session(sources, results)
        results = without_reflexes(results)
        found = [line for result in results for line in lines_of(result, norms)]
        joints = results[0]["data"]["joints"]
        lines = sorted(once(found), key=lambda line: joints.index(line.joint))
        panels, compared = clinic_trends.panels(results, lines), answers(results, lines)
        intervals = _intervals([*doubts(results)])
        page = {
            "title": _title(results),
            "synthetic": any(map(is_synthetic, results)),
            "compared": compared_with(results, lines),
            "measured": measured(results),
            "lines": lines,
            "words": [words_of(line) for line in lines],
            "estimates": estimates(lines, results),
            "answers": compared,
            "unusual": unusual(lines, results),
            "notes": [*_contradictions(found), *notes(results)],
            "dense": len(lines) + sum(len(told) for _, told in compared) > MOST_LINES,
            "since": max((line.before.date for line in lines if line.before), default=None),
            "not_measured": not_measured(results, lines),
            "next": next_steps(results, lines),
            "panels": panels,
            "courses": clinic_trends.COURSES + (" Grey: what is usual." if any(line.norm for line in lines) else ""),
            "sources": list(dict.fromkeys(line.norm.source for line in lines if line.norm is not None)),
            # Plots over the sessions show the same intervals.
            "picture": None if panels else clinic_trends.picture(lines, intervals),
            "intervals": intervals,
            "made_by": results[0].get("made_by", {}),
        }
    except BadInput:
        raise
    except (KeyError, TypeError, AttributeError, ValueError, IndexError, ArithmeticError) as error:
        raise BadInput("content", Text(f"not what a result holds ({error})"), "whole results", file=sources[0]) from None
    engine = html.environment()
    html.write_page(engine, target, [html.render(engine, "summary.html.j2", page)], title="armrs summary", maker="report")
    return target


def _one_session(sources: Sequence[str | os.PathLike[str]], results: Sequence[Mapping[str, Any]]) -> None:
    """Refuse results of several sessions, or of both arms."""
    first = results[0]
    for source, result in zip(sources, results, strict=True):
        if name(result) != name(first):
            raise BadInput("data, name", name(result), f"the session of the others, {name(first)!r}", file=source)
        for key, told in (("side", _side), ("date", _date)):
            if told(result) and told(first) and told(result) != told(first):
                raise BadInput(key, told(result), f"that of the others, {told(first)!r}: one page is of one session", file=source)


def _side(result: Mapping[str, Any]) -> str | None:
    return result["data"].get("side")


def _date(result: Mapping[str, Any]) -> str | None:
    return result.get("session", {}).get("date")


def _title(results: Sequence[Mapping[str, Any]]) -> str:
    """Return whose arm was measured, which one and when."""
    said = name(results[0])
    side, date = (next(filter(None, map(told, results)), None) for told in (_side, _date))
    return ", ".join([said, *([f"{side} arm"] if side else []), *([date] if date and date not in said else [])])


def compared_with(results: Sequence[Mapping[str, Any]], lines: Sequence[Line]) -> str:
    """Return which sessions the page compares; nothing without a history."""
    kept = [result["session"] for result in results if result.get("session")]
    if not kept and not any(line.before for line in lines):
        return ""
    before, first, there = (
        sorted({change.date for line in lines if (change := getattr(line, name)) is not None}) for name in ("before", "first", "other_arm")
    )
    parts = [f"the session before it ({' and '.join(before)})"] if before else []
    parts += [f"the first one ({' and '.join(first)})"] if first else []
    side = next((s["side"] for s in kept if s.get("side")), None)
    parts += [f"the {arm_side.other(side)} arm ({' and '.join(there)})"] if there and side else []
    if not parts:
        said = "No earlier session of this arm is in the history: nothing is compared."
    else:
        said = f"This session{f' of the {side} arm' if side else ''} is compared with {_listed(parts)}."
    later = sorted({date for session in kept for date in session.get("later", ())})
    said += f" Later sessions ({', '.join(later)}) are not compared." if later else ""
    return said if side or not kept else f"{said} Which arm was measured is not stated: left and right are not distinguished."


def _listed(parts: Sequence[str]) -> str:
    """Return parts of a sentence with commas, and an `and` before the last."""
    return " and ".join(filter(None, [", ".join(parts[:-1]), parts[-1]]))


def answers(results: Sequence[Mapping[str, Any]], lines: Sequence[Line]) -> list[tuple[str, list[str]]]:
    """Return what changed since the session before and since the first, and what differs from the other arm, each under its heading."""
    side = next(filter(None, map(_side, results)), None)
    other = f"{arm_side.other(side)} arm" if side else "other arm"
    said: list[tuple[str, list[str]]] = []
    for attribute, head, what, than in (
        ("before", "What changed since", "change", ""),
        ("first", "Since the first session,", "change", ""),
        ("other_arm", f"Compared with the {other} on", "difference", f" than in the {other}"),
    ):
        date = max((c.date for line in lines if (c := getattr(line, attribute)) is not None), default=None)
        if date is not None:
            changes = session_changes.change_lines(lines, attrgetter(attribute), what, than)
            # Said once, under the first heading.
            said.append((f"{head} {date}", changes if not said else [c for c in changes if c not in _ONCE]))
    return said


_ONCE = (session_changes.SURE["change"], session_changes.EITHER_WAY)


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
    "passive": "The page of passive uses slow movements only",
    "gap": "The page of gap fits only the laws that the recordings require, together with all other effects found",
    "spasticity": "The page of spasticity fits a reflex beside resistance and friction",
}
"""Why an analysis states another number than the one before it."""


def _contradictions(lines: Sequence[Line]) -> list[str]:
    """Return the quantities for which two results contradict each other."""
    said = []
    for line in once(lines):
        own = [o for o in lines if (o.joint, o.quantity.title) == (line.joint, line.quantity.title) and o.interval is not None]
        if own and max(o.interval[0] for o in own if o.interval) > min(o.interval[1] for o in own if o.interval):
            said.append(f"{line.joint}: {line.quantity.title.lower()} differs between the analyses by more than the uncertainty of both.")
    return said


def not_measured(results: Sequence[Mapping[str, Any]], lines: Sequence[Line]) -> list[str]:
    """Return what these movements do not measure."""
    seen = {line.joint for line in lines if line.value is not None}
    said = [f"{joint}: nothing was measured of this joint." for joint in results[0]["data"]["joints"] if joint not in seen]
    if not any(line.quantity.kind == "stretch_reflex" for line in lines):
        said.append("Reflexes: they need stretches at several speeds (armrs spasticity).")
    return [*said, "Strength, voluntary movement, pain, and how far the joints can go."]


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
            sign, zero = laboratory(results[0], j)
            low, high = sorted(sign * (end - zero) for end in ends)
            moved = f"from {low:.0f}° to {high:.0f}°" if round(low) < round(high) else f"held at {low:.0f}°"
            said.append(f"{joint} {moved}".replace("-", "−"))
        lines.append(f"Range that was moved through: {', '.join(said)}. This is no test of how far the joints can go.")
    return [*lines, f"Angles: {(data.get('angles') or {}).get('words', ZERO)}."]


def unusual(lines: Sequence[Line], results: Sequence[Mapping[str, Any]] = ()) -> list[str]:
    """Return what is outside of what is usual, and whether something acts that has no name, in plain words."""
    said = []
    if any(result.get("verb") == "gap" and result.get("verdict") == "unexplained" for result in results):
        said.append("An effect acts on the arm that the analysis could not identify: the numbers of this page may contain part of it.")
    for result in results:
        if result.get("verb") == "gap":
            said += found(result)
    for line in lines:
        if line.beside_norm in ("below", "above"):
            said.append(f"{line.joint}: {line.quantity.title.lower()} is {line.beside_norm} the usual range.")
    said += [f"{joint}: moved too fast to measure its slow movement." for joint in too_fast(results)]
    return [*said, *faults(results)]


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
    said = [text for result in results for text in failed_checks(result)]
    warned = [(str(line), r["data"]["joints"]) for r in results for line in r.get("warnings", ())]
    said = together(said + [with_joint_names(line, joints) for line, joints in warned if NOT_SLOW not in line])
    more = len(said) - MOST_NOTES
    return said if more <= 0 else [*said[:MOST_NOTES], f"and {more} more, in the reports of the analysis"]


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
            yield "an effect acts on the arm that the analysis could not identify"


def _is_dry(kind: str) -> bool:
    """Whether an estimate is of dry friction."""
    known = catalogue().get(kind)
    return known is not None and known.family == "dry"


def _intervals(doubted: Sequence[str]) -> str:
    """Return the meaning of the intervals."""
    beside = f"; here they may be too narrow: {'; '.join(dict.fromkeys(doubted))}" if doubted else ""
    return f"95 % intervals. They hold if the joint behaves as a spring with resistance and friction{beside}."
