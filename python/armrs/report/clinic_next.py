"""What next: measurements that would decide what is open, from the figures of the results."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from statistics import NormalDist
from typing import Any

from ..analysis.significance import CHANGE_LEVEL
from ..io import arm_side
from .clinic_lines import Line
from .sentences import with_joint_names
from .session_changes import Change

MOST_REPEATS = 10
"""Repeats of a movement beyond which no session goes."""
HELD = 10.0
"""A joint that moves less than this beside one that moves more was only held [deg]."""
ACTIVE = "muscles are active for"
"""Words of the warning that a muscle was active in some trials."""
MOST_STEPS = 2
"""Steps of one kind that are named."""
FEWEST_FAST = 2
"""Speeds above the onset of a reflex from which its strength is told."""


def next_steps(results: Sequence[Mapping[str, Any]], lines: Sequence[Line]) -> list[str]:
    """Return measurements that would decide what is open, the first that comes first."""
    said = [*_correct(results), *_slower(results), *_faster(results), *_repeats(results, lines)]
    compared = (("change", "before"), ("difference between the arms", "other_arm"))
    clear = [what for what, name in compared if any(c.clear for line in lines if (c := getattr(line, name)) is not None)]
    if clear:
        said.append(
            f"Repeat the session within days before acting on a {' or a '.join(clear)}: strapping and posture differ from day to day."
        )
    if lines and not any(result.get("session") or result.get("history") for result in results):
        said.append("Keep the sessions of this person in one file (--history FILE): the next page then states what changed.")
    return [*said, *_other_arm(results, lines)]


def faults(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return what the checks of the recordings found, in a line at most."""
    # In a stretch that a reflex resists, the muscle is active.
    reflex = any(result["verb"] == "spasticity" and any(e["decided"] for e in result["effects"]) for result in results)
    failed = [text for result in results for text in failed_checks(result, ("slow", "muscles silent") if reflex else ("slow",))]
    warned = [with_joint_names(str(line), r["data"]["joints"]) for r in results for line in r.get("data", {}).get("warnings", ())]
    found = [line for line in dict.fromkeys([*failed, *warned]) if not (reflex and ACTIVE in line)]
    more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    return [f"{found[0].rstrip('.')}{more}."] if found else []


def failed_checks(result: Mapping[str, Any], but: Sequence[str] = ("slow",)) -> list[str]:
    """Return what the checks of a result found, but some; a movement that was not slow is stated by `too_fast`."""
    failed = [str(c["text"]) for c in result.get("checks", ()) if c["passed"] is False and c["name"] not in but]
    return [with_joint_names(text, result["data"]["joints"]) for text in failed]


def too_fast(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the joints that were moved, and never slowly; one that was held beside another that moved is none."""
    found = []
    for result in results:
        moved: dict[str, bool] = {}
        for curve in result.get("curves", ()):
            spans = {c["joint"]: max(c["angle_deg"]) - min(c["angle_deg"]) for c in result["curves"] if _beside(c, curve)}
            if spans[curve["joint"]] >= HELD or max(spans.values()) < HELD:
                name = result["data"]["joints"][curve["joint"] - 1]
                moved[name] = moved.get(name, False) or curve.get("slow", True)
        found += [name for name, slowly in moved.items() if not slowly]
    return list(dict.fromkeys(found))


def _beside(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    return bool(one["configuration"] == other["configuration"])


def _correct(results: Sequence[Mapping[str, Any]]) -> list[str]:
    return [f"Correct before the next session: {line}" for line in faults(results)]


def _slower(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return which joints to move more slowly."""
    return [f"Move the {joint} more slowly: resistance and stiffness of slow movement are then measured." for joint in too_fast(results)]


def _faster(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the joints whose stretches were too slow for their reflex."""
    said = []
    for result in results:
        if result["verb"] != "spasticity":
            continue
        for effect in result["effects"]:
            joint, speeds = result["data"]["joints"][effect["joint"] - 1], _speeds(result, effect["joint"])
            if not speeds:
                continue
            fastest = f"{math.degrees(speeds[-1]):.0f} °/s"
            planned = f"armrs plan … --spasticity {effect['joint']} finds the fastest stretch within the stated limits"
            if not effect["decided"]:
                said.append(f"{joint}: no reflex up to {fastest}. Only faster stretches can show one with a higher onset; {planned}.")
                continue
            onset = effect["parameters"]["threshold"]["value"]
            above = sum(speed > onset for speed in speeds)
            if above < FEWEST_FAST:
                verb = "was" if above == 1 else "were"
                told = f"{above} of {len(speeds)} speeds {verb} above the reflex onset of {math.degrees(onset):.0f} °/s"
                said.append(f"{joint}: only {told} (fastest {fastest}). Add faster stretches; {planned}.")
    return said


def _speeds(result: Mapping[str, Any], joint: int) -> list[float]:
    """Return the mean speed of each movement that stretches a joint, the slowest first [rad/s]."""
    by_movement: dict[str, list[float]] = {}
    for stretch in result.get("stretches", ()):
        if stretch["joint"] == joint:
            by_movement.setdefault(stretch["configuration"], []).append(float(stretch["speed"]))
    return sorted(sum(own) / len(own) for own in by_movement.values())


def _repeats(results: Sequence[Mapping[str, Any]], lines: Sequence[Line]) -> list[str]:
    """Return how many repeats would make the changes certain that are more than their deviation, the fewest first."""
    open_changes = [(line, line.before) for line in lines if line.before is not None and not line.before.clear]
    if not open_changes:
        return []
    data = results[0]["data"]
    trials = data["fit"]["trials"] + data["test"]["trials"]
    now = max(1, round(trials / max(1, len(data["configurations"]))))
    needed = [(repeats_needed(change, now), line) for line, change in open_changes if 1.96 * abs(change.value) > change.either_way]
    said = [
        f"{line.joint}, {line.quantity.title.lower()}: about {count:.0f} repeats of each movement instead of {now} would make a change of "
        "this size clear, if the scatter of repeats is what limits it."
        for count, line in sorted(needed, key=lambda n: n[0])[:MOST_STEPS]
        if count <= MOST_REPEATS
    ]
    if not said:
        said.append(
            "Where no clear change is stated, a change smaller than the number after ± could not be detected. More repeats of each "
            "movement reduce that number: four times as many repeats halve it."
        )
    return said


def repeats_needed(change: Change, now: int) -> float:
    """Return with how many repeats in a session a change becomes clear; infinite where the other session is too uncertain.

    The variance of this session is taken as that of the mean of its repeats, `s² n / n'` for n' instead of n; that of the other session
    stays. Over all quantities compared the limit is that of Bonferroni, which no step of Holm's exceeds.
    """
    limit = NormalDist().inv_cdf(1.0 - 0.5 * CHANGE_LEVEL / max(1, change.compared))
    both = (change.either_way / 1.96) ** 2
    allowed = (change.value / limit) ** 2 - max(0.0, both - change.own_std**2)
    if allowed <= 0.0:
        return math.inf
    return max(float(now + 1), math.ceil(now * change.own_std**2 / allowed))


def _other_arm(results: Sequence[Mapping[str, Any]], lines: Sequence[Line]) -> list[str]:
    """Return that the other arm, or an arm at all, can be compared with."""
    sessions = [result["session"] for result in results if result.get("session")]
    if not sessions or any(line.other_arm or line.norm for line in lines):
        return []
    side = next((s["side"] for s in sessions if s.get("side")), None)
    if side is None:
        return ['State which arm it is (side = "left" or "right" in [subject] of dataset.toml): sessions of one arm are then compared.']
    return [f"Measure the {arm_side.other(side)} arm in the same way, into the same history: the page then compares both arms."]
