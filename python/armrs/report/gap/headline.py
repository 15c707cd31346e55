"""The result of the gap workflow in one sentence, borne out by its own table of gaps."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ..._armrs import OPEN_GAP, TIE
from ...catalogue import catalogue, title
from ...formatting import digits, read_in, with_interval, with_unit

_AS_REPEATS = 1.1
"""A channel whose gap exceeds its floor by a tenth at most is within the scatter of repeats; a wider one is stated with its factor."""
_FAMILIES = {
    "dry": "dry friction",
    "rate": "damping",
    "elastic": "elasticity",
    "two_joints": "elasticity over two joints",
    "muscle": "muscle",
}
"""Families as they are called where their members tie."""
MEANINGS = {
    "q": "the angle of joint {}",
    "qr": "the angle of joint {} of the robot",
    "tau": "the torque of joint {}",
    "Fy": "the contact force forward",
    "Fz": "the contact force upward",
    "Mx": "the contact moment",
}
"""What a channel measures, by its name without the number."""
_CLOSES = 0.9
"""Share of an open gap above its floor that names close at least where they are what the model lacks, as they do on judgement seeds; where
something outside the catalogue is missing, false names close up to three quarters (docs/gap.md)."""
_COUNTS = 0.1
"""Share of the floor by which a gap lies above it at least where the share of it that is closed is worth a number."""
_NAMELESS = "something that no effect of the catalogue explains"
_SMALL = "something too small to show on test trials, which no effect of the catalogue explains"
_NO_TEST = "there is no test trial to measure the gap on"
_SIZED = 2
"""Effects whose sizes stand in the sentence; of more it only gives the names."""


def place_of(kind: str, joint: int | None, channel: str | None, joints: Sequence[str] = ()) -> str:
    """Return an effect with its place, in words."""
    known = catalogue().get(kind)
    if joint and known and known.where == "segment":
        return f"{title(kind)} of segment {joint}"
    name = f" ({joints[joint - 1]})" if joint and joint <= len(joints) and joints[joint - 1] != f"joint {joint}" else ""
    return title(kind) + (f" in joint {joint}{name}" if joint else f" of {channel}" if channel else "")


def effect_name(effect: Mapping[str, Any], joints: Sequence[str] = ()) -> str:
    """Return a named effect, an alternative or a limit with its place, in words."""
    return place_of(effect["kind"], effect["joint"], effect["channel"], joints)


def rank(joint: int | None) -> float:
    """Return by what effects are sorted: joint by joint, as on the page for a clinician; behind them those of no joint."""
    return joint or math.inf


def by_joint(result: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the named effects in the order of `rank`."""
    return sorted(result["effects"], key=lambda effect: rank(effect["joint"]))


def joined(names: Sequence[str], last: str = "and") -> str:
    """Return `a, b and c`."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} {last} {names[-1]}" if names else ""


def left(channel: Mapping[str, Any]) -> float | None:
    """Return what the last model leaves of a channel."""
    value = channel["calibrated"] if channel["after"] is None else channel["after"]
    return None if value is None else float(value)


def still_open(result: Mapping[str, Any]) -> list[str]:
    """Return the channels whose gap on the test trials the named effects leave open, the widest first.

    What the result lists as `open` counts; for a result without such a list the limit is `OPEN_GAP`.
    """
    listed = result.get("open")
    if listed is None:
        pairs = [(name, left(g), g["floor"]) for name, g in result["gap"].items()]
        names = [name for name, value, floor in pairs if value is not None and floor and value > OPEN_GAP * floor]
    else:
        names = list(dict.fromkeys(entry["channel"] for entry in listed))
    return sorted(names, key=lambda name: -_times(result["gap"].get(name, {}), "last"))


def closed(channel: Mapping[str, Any]) -> float | None:
    """Return which share of the gap above its floor the named effects close, 1 at most; nothing where it hardly lies above it."""
    floor, before, after = (channel[step] for step in ("floor", "calibrated", "after"))
    if None in (floor, before, after) or before - floor <= _COUNTS * floor:
        return None
    return float(min((before - after) / (before - floor), 1.0))


def only_near(result: Mapping[str, Any]) -> bool:
    """Whether named effects are not what the model lacks but what comes nearest: too much of an open gap stays, and nothing explains it."""
    if result["verdict"] != "unexplained" or not result["effects"]:
        return False
    opened = still_open(result)
    wide = [result["gap"][name] for name in opened if _times(result["gap"].get(name, {}), "after") > OPEN_GAP]
    shares = [share for channel in wide if (share := closed(channel)) is not None]
    return min(shares, default=1.0) < _CLOSES and _beyond(result, opened) == _NAMELESS


def headline(result: Mapping[str, Any]) -> str:
    """Return the result in one sentence: what the model lacks, and the gap on the test trials before and after."""
    joints, effects = result["data"]["joints"], by_joint(result)
    opened, unexplained = still_open(result), result["verdict"] == "unexplained"
    tested = result["lack_of_fit"]["amended"]["z"] is not None
    held_out = any(g["calibrated"] for g in result["gap"].values())
    if not effects and not unexplained and not opened:
        if not tested:
            return "No missing effect was found; without repeats, it cannot be tested whether the remaining difference is noise."
        if not held_out:
            return f"Nothing is missing that these data could show; {_NO_TEST}."
        return f"Nothing is missing that these data could show: on test trials, no channel is off by more than {_near(result['gap'])}."
    if only_near(result):
        are, do = ("is", "does") if len(effects) == 1 else ("are", "do")
        lacks = f"Something is missing that no effect of the catalogue explains; nearest to it {are} {_names(effects, joints)}, "
        lacks += f"which {do} not close the gap"
    elif effects:
        one = len(effects) == 1
        lacks = f"Missing from the model {'is' if one else 'are'} {_names(effects, joints)}"
        lacks += f", and {_beyond(result, opened)}" if unexplained else ", and that is not all" if opened else ""
    else:
        lacks = "Something is missing that no effect of the catalogue explains" if unexplained else "No effect of the catalogue was found"
        lacks += "" if unexplained else ", yet something is missing"
    return f"{lacks}: {_gap(result, opened)}." if held_out else f"{lacks}; {_NO_TEST}."


def _beyond(result: Mapping[str, Any], opened: Sequence[str]) -> str:
    """Return what is missing beyond the names: a small remainder, something without a name, or the laws of joints that friction holds."""
    if not opened and any(g["after"] is not None for g in result["gap"].values()):
        return _SMALL
    held = {w["joint"] for w in result["would_have_seen"] if w["at_least"] is None and not w["price"]}
    stuck = sorted(j for j in held if j and any(name.startswith(f"q{j}_") for name in opened))
    if not stuck or len(stuck) < len(opened):
        return _NAMELESS
    one = place_of("the laws", stuck[0], None, result["data"]["joints"])
    where = one if len(stuck) == 1 else f"the laws in joints {joined([str(j) for j in stuck])}"
    held_joints = "the joint" if len(stuck) == 1 else "these joints"
    return f"{where}, which these movements cannot show because friction holds {held_joints} nearly all the time"


def _near(gap: Mapping[str, Mapping[str, Any]]) -> str:
    """Return what the widest channel is off by at most: what repeats differ by, in tenths of it where it is a tenth more or wider."""
    widest = max((value / g["floor"] for g in gap.values() if (value := left(g)) is not None and g["floor"]), default=1.0)
    one = "what repeats differ by"
    return f"about {one}" if widest <= _AS_REPEATS else f"{math.ceil(10.0 * widest - 1e-9) / 10.0:.1f} times {one}"


def _names(effects: Sequence[Mapping[str, Any]], joints: Sequence[str]) -> str:
    """Return the named effects, with their sizes where they are few; of one kind in several joints once."""
    if len(effects) <= _SIZED:
        return joined([_sized(e, joints) for e in effects])
    together: dict[str, list[int]] = {}
    for e in effects:
        if e["joint"] and _decided(e) and not e.get("trial"):
            together.setdefault(e["kind"], []).append(e["joint"])
    names = []
    for kind, places in together.items():
        one = place_of(kind, places[0], None)
        numbers = joined([str(j) for j in sorted(places)])
        names.append(one if len(places) == 1 else f"{one.removesuffix(f' {places[0]}')}s {numbers}")
    # The list stands in brackets: joints go by their number, so that there are no brackets within brackets within brackets.
    names += [_name(e, ()) for e in effects if not (e["joint"] and _decided(e) and not e.get("trial"))]
    return f"{len(effects)} effects ({'; '.join(names)})"


def _decided(effect: Mapping[str, Any]) -> bool:
    return effect.get("decided") is not False


def family(kind: str) -> str:
    """Return the family of a kind, empty where the catalogue has none for it."""
    known = catalogue().get(kind)
    return str(getattr(known, "family", "") or "")


def undecided(effect: Mapping[str, Any], joints: Sequence[str] = ()) -> str:
    """Return what an effect may be where the data do not decide: a family where all that is stated belongs to one, in one place."""
    stated = [effect, *effect["alternatives"]]
    here = {(e["joint"], e["channel"]) for e in stated}
    families = {family(e["kind"]) for e in stated}
    kinds = joined([title(e["kind"]) for e in stated], "or")
    where = _trial(effect)
    if better := [e for e in effect["alternatives"] if (e.get("worse") or 0.0) < -TIE]:
        closer = joined([title(e["kind"]) if len(here) == 1 else effect_name(e, joints) for e in better], "or")
        return effect_name(effect, joints) + f"{where} (rarer, but closer to the data: {closer})"
    if len(here) > 1:
        return joined([effect_name(e, joints) for e in stated], "or") + f"{where}, which these movements cannot distinguish"
    if len(families) == 1 and (name := _FAMILIES.get(families.pop())):
        return effect_name({**effect, "kind": name}, joints) + f"{where} ({kinds}: not distinguished)"
    return effect_name({**effect, "kind": kinds}, joints) + f"{where}, which these movements cannot distinguish"


def _trial(effect: Mapping[str, Any]) -> str:
    return f" in {effect['trial']} only" if effect.get("trial") else ""


def _name(effect: Mapping[str, Any], joints: Sequence[str]) -> str:
    """Return an effect in words: where the data do not decide, with what it may be instead."""
    return effect_name(effect, joints) + _trial(effect) if _decided(effect) else undecided(effect, joints)


def _sized(effect: Mapping[str, Any], joints: Sequence[str]) -> str:
    name = _name(effect, joints)
    parameter = largest(effect["parameters"])
    if not _decided(effect) or parameter is None:
        return name
    return f"{name}, {parameter} {with_interval(effect['parameters'][parameter])}"


def largest(parameters: Mapping[str, Mapping[str, Any]]) -> str | None:
    """Return the name of the value that is the size of an effect: of those fitted that have the unit of the first, the largest."""
    fitted = {name: p for name, p in parameters.items() if p["std"] is not None}
    alike = [name for name, p in fitted.items() if p["unit"] == next(iter(fitted.values()))["unit"]]
    return max(alike, key=lambda name: abs(fitted[name]["value"]), default=None)


def _gap(result: Mapping[str, Any], opened: Sequence[str]) -> str:
    """Return a clause on the gap of one channel: of an open one if there is one, else of that with the widest gap."""
    gap = {name: g for name, g in result["gap"].items() if g["calibrated"]}
    shown = [name for name in opened if name in gap]
    name = shown[0] if shown else max(gap, key=lambda n: _times(gap[n], "calibrated"))
    channel = gap[name]
    quantity = spoken(name.rsplit("_", 1)[0])
    floor = f"; repeats differ by {amount(name, channel['floor'])}" if channel["floor"] else ""
    value = left(channel)
    if shown or channel["after"] is None or not any(not e.get("trial") for e in result["effects"]):
        still = "still " if shown and result["effects"] else ""
        return f"on test trials, {quantity} is {still}off by {amount(name, value)} RMS{place(result, name) if shown else ''}{floor}"
    them = "it" if len(result["effects"]) == 1 else "them"
    return (
        f"with {them}, the gap of {quantity} on test trials falls from {amount(name, channel['calibrated'])} to "
        f"{amount(name, value)} RMS{floor}"
    )


def shown_in(name: str) -> tuple[float, str]:
    """Return in which unit people read a channel, and how many of it are one of the unit in its name: angles in degrees."""
    return read_in(name.rsplit("_", 1)[1])


def channel_label(name: str) -> tuple[str, float]:
    """Return how a channel is labelled, and the factor to the unit in which it is shown.

    >>> channel_label("Fz_N"), channel_label("tau2_Nm")
    (('Fz [N]', 1.0), ('tau2 [N m]', 1.0))
    """
    factor, held_in = shown_in(name)
    return f"{name.rsplit('_', 1)[0]} [{held_in}]", factor


def amount(name: str, value: float | None) -> str:
    """Return a value of a channel with the unit in which people read it.

    >>> amount("Fz_N", 0.1623), amount("q3_rad", 0.01)
    ('0.16 N', '0.57°')
    """
    factor, called = shown_in(name)
    return with_unit("–" if value is None else digits(factor * value, 2), called)


def spoken(name: str) -> str:
    """Return the name of a channel with what it measures.

    >>> spoken("tau2"), spoken("Fy")
    ('the torque of joint 2 (tau2)', 'the contact force forward (Fy)')
    """
    stem = name.rstrip("0123456789")
    return f"{MEANINGS[stem].format(name[len(stem) :])} ({name})" if stem in MEANINGS else name


def place(result: Mapping[str, Any], name: str) -> str:
    """Return where the gap of an open channel is widest, if the result states that: ` (widest in trials/fast_2.csv, 3.1 to 4.6 s)`."""
    entry = next((o for o in result.get("open") or [] if o["channel"] == name), None)
    if entry is None or not entry.get("trial"):
        return ""
    span = f", {entry['t_start']:.1f} to {entry['t_end']:.1f} s" if entry.get("t_start") is not None else ""
    return f" (widest in {entry['trial']}{span})"


def _times(channel: Mapping[str, Any], step: str) -> float:
    """Return a gap in units of its floor, or in its own where there is none."""
    value = (left(channel) if step == "last" else channel.get(step)) if channel else None
    return 0.0 if value is None else float(value) / float(channel["floor"] or 1.0)
