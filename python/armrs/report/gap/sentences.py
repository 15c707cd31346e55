"""Sentences and tables of the gap workflow, for terminal and report. They read the plain data of a result."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ... import formatting
from ..._armrs import LACK_OF_FIT, TIE
from ...formatting import digits, number, spread, with_interval
from .. import sentences as common
from ..tables import Table, smallest_effects
from . import headline
from .headline import effect_name, joined

verdict = headline.headline
"""The result in one sentence."""
_TELLS = 5.0
"""Standard deviations from which on a movement distinguishes two effects."""


def size(effect: Mapping[str, Any]) -> str:
    """Return the size of an effect with its interval."""
    name = headline.largest(effect["parameters"]) or next(iter(effect["parameters"]))
    return f"{name} {with_interval(effect['parameters'][name])}"


def chance(effect: Mapping[str, Any]) -> str:
    """Return how probable it is that an effect improves the fit so much by chance."""
    p = effect["p_value"]
    if p < 1e-6:
        return "below one in a million"
    return formatting.percent(p) if p >= 0.01 else f"one in {number(1.0 / p, 0.1 / p)}"


def named(result: Mapping[str, Any]) -> list[str]:
    """Return the named effects, a line each: what it is, its formula, its size, and how likely it is by chance."""
    joints, sure = result["data"]["joints"], result["verdict"] != "unexplained"  # as intervals, the probability assumes the structure
    return [
        f"{effect_name(e, joints)}: {e['summary']}. {e['formula']}. {size(e)}."
        + (f" Probability of such an improvement of the fit by chance: {chance(e)}." if sure else "")
        for e in headline.by_joint(result)
    ]


def is_led(result: Mapping[str, Any]) -> bool:
    """Return whether a robot led the arm: the gap is in contact forces."""
    return any(name.endswith("_N") for name in result["gap"])


FORMULAS = (
    "In formulas, R is the torque with which a joint resists, q its angle and q̇ its speed. Tables name effects as a model file does; "
    "angles and their speeds are in degrees here and in radians there."
)


def symbols(result: Mapping[str, Any]) -> str:
    """Return a sentence that explains the names of the channels."""
    names: dict[str, list[int]] = {}
    measured = [channel for channel, g in result["gap"].items() if g["before"] is not None]
    for channel in measured or result["gap"]:
        name = channel.rsplit("_", 1)[0]
        stem = name.rstrip("0123456789")
        names.setdefault(stem, []).extend([int(name[len(stem) :])] if name != stem else [])
    joints = result["data"]["joints"]
    parts = []
    for stem, numbers in names.items():
        if stem in headline.MEANINGS:
            called = [stem if not numbers else f"{stem}{k}" for k in numbers or [0]]
            place = joined([f"{k} ({joints[k - 1]})" if stem != "qr" and k <= len(joints) else str(k) for k in numbers])
            parts.append(f"{joined(called)}: {headline.MEANINGS[stem].format(place)}")
    sentence = "; ".join(parts)
    if sentence and not is_led(result) and "q" in names:
        sentence += (
            ". Angles are those of the simulated arm under the measured torques (a free swing where there are none), in which errors of "
            "torque add up"
        )
    return f"{sentence}." if sentence else ""


_UNTESTED = "Without repeats of a movement, it cannot be tested whether the remaining difference is noise."


def others(result: Mapping[str, Any]) -> list[str]:
    """Return alternatives, a line for each effect that has some, and movements that would distinguish them."""
    lines = []
    for effect in result["effects"]:
        listed = [f"{effect_name(a)} ({_how(a)})" for a in effect["alternatives"]]
        if listed:
            lines.append(f"Instead of {effect_name(effect)} it may be {joined(listed, 'or')}.")
        # A movement that distinguishes several stands once.
        told: dict[str, list[str]] = {}
        for a in effect["alternatives"]:
            told.setdefault(_separating(a), []).append(effect_name(a))
        lines += [f"To tell {effect_name(effect)} from {joined(names, 'or')}: {how}" for how, names in told.items() if how]
    return lines


def tie(result: Mapping[str, Any]) -> str:
    """Return by how much alternatives may explain the data less and still not be distinguished."""
    worse = [a.get("worse") or 0.0 for effect in result["effects"] for a in effect["alternatives"]]
    beyond = ", or by no more than the possible error of the named law" if max(worse, default=0.0) > TIE else ""
    sentences = [
        f"These explain the data as well, or less by up to {TIE:.0f} units of twice the log-likelihood{beyond}: on these movements they "
        "cannot be distinguished."
    ]
    if min(worse, default=0.0) < -TIE:
        rare = "One that explains them better is not named, because few joints have it."
        sentences = [rare] if max(worse) < -TIE else [*sentences, rare]
    return " ".join(sentences)


def _separating(alternative: Mapping[str, Any]) -> str:
    """Return which movement would distinguish them, and how well; nothing where none was searched for."""
    separation = alternative.get("separation")
    if separation is None:
        return ""
    now, then = (digits(separation[key], 2) for key in ("now", "then"))
    if (alternative.get("worse") or 0.0) > TIE:
        now += ", which the error of the named law may cause"
    best = alternative["separating_movement"]
    if separation["then"] < _TELLS:
        best = f"no movement that was tried separates them clearly. The best: {best}"
    return f"{best}; with one such trial they would be {then} standard deviations apart (now {now})."


def _how(alternative: Mapping[str, Any]) -> str:
    worse = alternative.get("worse")
    if worse is None:
        return str(alternative["why"])
    if abs(worse) < 0.1 or -TIE < worse < 0.0:
        return str(alternative["why"])
    size = f"{abs(worse):{'.0f' if abs(worse) >= 10.0 else '.2g'}}"
    return f"{alternative['why']}, by {size} units {'less' if worse > 0.0 else 'more'}"


def single_trial_lines(result: Mapping[str, Any]) -> list[str]:
    """Return what was in one trial only, a line each."""
    lines = []
    for effect in result["effects"]:
        if there := common.disturbance(effect):
            trial, start, end = there
            lines.append(f"{effect_name(effect)} in {trial}, {start:.2f} to {end:.2f} s ({size(effect)}): left out of the fit.")
    return lines


def left(result: Mapping[str, Any]) -> list[str]:
    """Return what is left beyond noise, in words."""
    lines = []
    for which, words in (("calibrated", "Calibrated model"), ("amended", "Model with the named effects")):
        lack = result["lack_of_fit"][which]
        if lack["ratio"] is not None and lack["z"] is not None and (which == "calibrated" or result["effects"]):
            verdict = f"{'more' if lack['z'] >= LACK_OF_FIT else 'no more'} than noise explains"
            lines.append(
                f"{words}, fit trials: the part of the residuals that repeats share has {digits(lack['ratio'])} times the variance of the "
                f"part that differs between them. This is {verdict} ({_deviations(lack['z'])} standard deviations; limit {LACK_OF_FIT:g})."
            )
    if not lines:
        lines.append(_UNTESTED)
    for name in headline.still_open(result):
        channel = result["gap"][name]
        off, floor = (headline.amount(name, value) for value in (headline.left(channel), channel["floor"]))
        what, place = headline.spoken(name.rsplit("_", 1)[0]), headline.place(result, name)
        lines.append(f"{what[0].upper()}{what[1:]} is open on the test trials: off by {off} RMS{place}; repeats differ by {floor}.")
    if result["unexplained"]["share"]:
        share = formatting.percent(result["unexplained"]["share"])
        lines.append(f"Of the calibrated model's residual beyond noise on the fit trials, {share} remains.")
    if result["unexplained"]["looks_like"]:
        looks = result["unexplained"]["looks_like"]
        lines.append(f"{looks[0].upper()}{looks[1:]}.")
    return lines


def _deviations(z: float) -> str:
    """Write a number of standard deviations, without digits beyond a hundred."""
    return "more than 100" if z > 100.0 else f"{round(z, 1) + 0.0:+.1f}"


def show(result: Mapping[str, Any], written: Sequence[Path] = ()) -> None:
    """Print what the workflow found."""
    common.head(result, verdict(result))
    common.show(heading(result), missing(result))
    if lines := [*others(result), *single_trial_lines(result)]:
        print("\n".join(lines) + "\n")
    common.show("Gap on the test trials: root mean square of simulated minus measured", gap(result))
    if result["gap"]:
        print(f"{symbols(result)}\n")
    common.show("Where the calibrated model and the data disagree most", where(result))
    print("\n".join(left(result)) + "\n")
    if result["verdict"] == "nothing_missing":
        common.show("The smallest effects that these data would have shown", smallest_effects(result["would_have_seen"]))
    common.followed(result)
    common.files_written([path for path in written if path.parent.name != "figures"])


def quick(result: Mapping[str, Any]) -> None:
    """Print a screening."""
    label = " (synthetic data)" if common.is_synthetic(result) else ""
    worth = [s for s in result["suspects"] if s["gain"] > s["price"]]
    z = result["lack_of_fit"]["calibrated"]["z"]
    if not worth:
        said = "nothing alone explains enough to be named"
    elif len(worth) == 1:
        said = f"{effect_name(worth[0])} may be missing"
    else:
        said = f"{len(worth)} effects each improve the fit; several may have one cause; {effect_name(worth[0])} explains most"
    noise = ""
    if z is not None and not math.isnan(z):
        more = "more" if z >= LACK_OF_FIT else "no more"
        noise = f"; the calibrated model leaves {more} than noise ({_deviations(z)} standard deviations; limit {LACK_OF_FIT:g})"
    print(f"{common.name(result)}{label}, a first look: {said}{noise}.\n")
    common.show("Gap on the test trials: root mean square of simulated minus measured", gap({**result, "effects": []}))
    if result["gap"]:
        print(f"{symbols(result)}\n")
    common.show("What each would explain alone, to first order", suspects(result))
    print("Gain: twice the log-likelihood that the effect adds; needed: what it must exceed to be named.\n")
    print("Nothing is named yet: `armrs gap` without --quick converges by simulation, looks at several together, and confirms.")


def suspects(data: Mapping[str, Any], most: int = 10) -> Table:
    """Return the effects that would explain most, alone and to first order."""
    rows = []
    for s in data["suspects"][:most]:
        factor, held_in = formatting.read_in(s["unit"])
        sizes = ", ".join(f"{name} {factor * value:.3g}" for name, value in s["parameters"].items())
        rows.append([s["kind"], s["joint"] or s["channel"], f"{sizes} {held_in}".rstrip(), f"{s['gain']:.3g}", f"{s['price']:.3g}"])
    return Table(["effect", "at", "size", "gain", "gain needed"], rows, 3)


def heading(data: Mapping[str, Any]) -> str:
    """Return what stands above the named effects: under `unexplained` they may be no more than what comes nearest."""
    return "What comes nearest to what is missing" if headline.only_near(data) else "Missing from the model"


def _printed(given: Mapping[str, Mapping[str, Any]]) -> Mapping[str, Mapping[str, Any]]:
    """Return the parameters that say what a law is: those that are fitted, else those that are not zero, else all.

    An end-range moment is printed with its angle (`upper` with `upper_moment`); the angle of a moment of zero has no meaning.
    """
    moments = {name: given.get(f"{name}_moment") for name in given}
    if any(value["std"] is not None for value in given.values()):
        return {name: value for name, value in given.items() if value["std"] is not None or ((m := moments[name]) and m["value"])}
    return {name: value for name, value in given.items() if value["value"] and ((m := moments[name]) is None or m["value"])} or given


def missing(data: Mapping[str, Any]) -> Table:
    """Return the named effects with their estimates."""
    rows: list[list[object]] = []
    repeated = any(effect.get("without") is not None for effect in data["effects"])
    for effect in headline.by_joint(data):
        place = effect["joint"] or effect["channel"]
        alone = f"{100 * effect['share']:.0f} %" if effect["share"] > 0.005 else "< 1 %"
        if repeated:
            without = effect.get("without")
            alone = "–" if without is None else digits(without, 2)
        for k, (name, value) in enumerate(_printed(effect["parameters"]).items()):
            head = [effect["kind"], place, alone] if k == 0 else ["", "", ""]
            factor, held_in = formatting.read_in(value["unit"])
            std = value["std"] and factor * value["std"]
            ends = None if std is None else " … ".join(number(factor * end, std) for end in value["interval"])
            rows.append([*head, name, number(factor * value["value"], std), spread(std), ends, held_in])
    head = ["effect", "at", "residual without the effect" if repeated else "share", "parameter", "value", "± std", "95 % interval", "unit"]
    if all(row[6] is None for row in rows):  # nothing has an interval: there are no columns for it
        head, rows = [*head[:5], head[7]], [[*row[:5], row[7]] for row in rows]
    return Table(head, rows, 4)


def intervals(data: Mapping[str, Any]) -> str:
    """Return under which condition the intervals hold, or why there are none."""
    if data["verdict"] == "unexplained":
        return (
            "No intervals are given, and no probabilities: they assume that the structure of the model is right, but something is left "
            "that no effect explains."
        )
    return "± is one standard deviation. Interval and ± hold if the structure of the model is right."


def worth(data: Mapping[str, Any]) -> str:
    """Return the third column of `missing`."""
    if all(effect.get("without") is None for effect in data["effects"]):
        return "Share: the part of all that is explained which would be lost if this one effect were left out and everything else refitted."
    with_all = data["lack_of_fit"]["amended"]["ratio"] ** 0.5
    return (
        "Residual without the effect: RMS residual if this one effect were left out and everything else refitted, in units of what "
        f"repeats differ by. With every effect it is {digits(with_all, 2)}. Disturbances of one trial have no such number."
    )


def gap(data: Mapping[str, Any]) -> Table:
    """Return the gap of every channel: as given, calibrated, with the named effects, and the floor.

    Where nothing was named, the calibrated model is that of the last fit, as in verdict and headline.
    """
    named = any(not e.get("trial") for e in data["effects"])
    opened = headline.still_open(data)
    steps = ("before", "calibrated", "after", "floor") if named else ("before", "last", "floor")
    rows: list[list[object]] = []
    for name, channel in data["gap"].items():
        if channel["before"] is None:
            continue
        channel = {**channel, "last": headline.left(channel)}
        share = headline.closed(channel)
        label, factor = headline.channel_label(name)
        values = [None if channel[step] is None else f"{factor * channel[step]:.3g}" for step in steps]
        rows.append(
            [
                label,
                *values,
                *([None if share is None else f"{100 * share:.0f} %"] if named else []),
                "open" if name in opened else None,
            ]
        )
    head = {"before": "as given", "calibrated": "calibrated", "after": "with named effects", "floor": "repeats differ by"}
    head["last"] = head["calibrated"]
    columns = ["channel", *(head[step] for step in steps), *(["gap closed"] if named else []), ""]
    # Nothing is open: there is no column for it.
    return Table(columns, rows, 1) if opened else Table(columns[:-1], [row[:-1] for row in rows], 1)


def where(data: Mapping[str, Any], most: int = 6) -> Table:
    """Return where the calibrated model and the data disagree most."""
    joints = data["data"]["joints"]
    rows = [
        [w["trial"], _condition(w, joints), f"{w['t_start']:.3g} to {w['t_end']:.3g}", f"{w['mean']:+.3g}", f"{w['z']:+.1f}"]
        for w in data["where"][:most]
    ]
    return Table(["trial", "where", "time [s]", "missing torque [N m]", "standard deviations"], rows, 2)


def _condition(place: Mapping[str, Any], joints: Sequence[str]) -> str:
    """Return in words where the joint of a place moved."""
    moving = {">": "angle grows", "<": "angle falls", "=": "at rest"}[place["condition"].split()[1]]
    name = joints[place["joint"] - 1] if place["joint"] <= len(joints) else f"joint {place['joint']}"
    return f"{name}, {moving}"


def nearest(data: Mapping[str, Any], most: int = 8) -> Table:
    """Return what came nearest to being named and was not."""
    asked = sorted((w for w in data["would_have_seen"] if w.get("price")), key=lambda w: w["price"] - w["gain"])
    once: dict[tuple[str, Any], Mapping[str, Any]] = {}
    for w in asked:
        once.setdefault((w["kind"], w["joint"] or w["channel"]), w)  # an effect along y and z has two sizes
    rows = [[*effect, f"{w['gain']:.3g}", f"{w['price']:.3g}"] for effect, w in list(once.items())[:most]]
    return Table(["effect", "at", "gain", "gain needed"], rows, 2)


def calibration(data: Mapping[str, Any]) -> Table:
    """Return what the calibration absorbed, beside its tolerance."""
    rows = []
    for a in data["calibration"]:
        factor, held_in = formatting.read_in(a["unit"])
        note = "beyond the prior" if abs(a["value"]) > a["promised"] else None
        rows.append([a["name"], f"{factor * a['value']:+.3g}", f"± {factor * a['promised']:.3g}", held_in, note])
    beyond = any(row[-1] for row in rows)
    head = ["quantity", "refitted by", "prior (2 σ)", "unit", "note"]
    return Table(head if beyond else head[:-1], rows if beyond else [row[:-1] for row in rows], 1)
