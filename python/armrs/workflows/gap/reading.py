"""From what the core returned to what a user reads: kinds with joints and channels, values with units, gaps in root mean square."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ... import _armrs
from ...catalogue import catalogue
from ...io.dataset import Dataset
from ...model import Contact, Effect, Joint, Model, Segment
from . import maps
from .found import Absorbed, Alternative, ChannelGap, GapFound, Limit, Missing, Open, Rung, Tried, Value

MISFIT = 6.0
"""Lack of fit beyond which something is left, in standard deviations of white rows.

Coloured noise is never quite white, and nulls reach 4.3.
"""
_NEGLIGIBLE = 0.05
"""Share of the calibrated model's lack of fit that may be left where effects were named: shapes are never exact."""
_NEAR_NOISE = 2.0
"""Misfit for each degree of freedom beyond which no share is negligible: what is left is then larger than the noise."""


def found(dataset: Dataset, led: bool, raw: Mapping[str, Any], warnings: Sequence[str]) -> GapFound:
    """Return what the core found in a data set as objects."""
    (before_ratio, before_z, before), (after_ratio, after_z, after) = raw["lack"]
    together = tuple(_with_rest(_missing(item, dataset), before_ratio, after_ratio) for item in raw["named"])
    apart = tuple(_apart(item, dataset, raw) for item in raw["apart"])
    effects = tuple(sorted(map(_in_family, (*together, *apart)), key=lambda e: -e.share))
    share = max(after, 0.0) / before if math.isfinite(before) and before > 0 else 0.0
    gap = gaps(dataset, led, raw)
    is_open = any(g.open is not None for g in gap.values())
    verdict = verdict_of(named=bool(effects), is_open=is_open, z=after_z, ratio=after_ratio, share=share)
    if verdict == "unexplained":
        # An interval rests on the structure, and that was rejected.
        effects = tuple(_without_intervals(effect) for effect in effects)
    return GapFound(
        verdict=verdict,
        effects=effects,
        where=maps.places(maps.discrepancies(dataset, led, raw["trials"], "calibrated")),
        gap=gap,
        would_have_seen=_limits(raw),
        unexplained=min(share, 1.0) if verdict == "unexplained" or effects else 0.0,
        looks_like=maps.shape(maps.discrepancies(dataset, led, raw["trials"], "amended")) if verdict == "unexplained" else None,
        absorbed=absorbed(dataset, raw),
        lack=((before_ratio, before_z), (after_ratio, after_z)),
        ladder=tuple(_rung(tried, before, after) for tried, before, after in raw["ladder"]),
        warnings=tuple(warnings),
        model=amended(dataset.model, raw["amended"], rhythms=raw["locked"]),
        dataset=dataset,
        raw=raw,
    )


def verdict_of(*, named: bool, is_open: bool, z: float, ratio: float, share: float) -> str:
    """Return the verdict of a search.

    Parameters
    ----------
    named : bool
        Whether an effect was named.
    is_open : bool
        Whether a channel of the test trials is open.
    z, ratio : float
        Lack of fit on the fit trials: in standard deviations, and of the residual to the scatter of repeats.
    share : float
        What of the calibrated model's lack of fit is left.
    """
    negligible = named and share < _NEGLIGIBLE and ratio < _NEAR_NOISE
    if is_open or (z >= MISFIT and not negligible):
        return "unexplained"
    return "explained" if named else "nothing_missing"


def _in_family(effect: Missing) -> Missing:
    return dataclasses.replace(effect, family=catalogue()[effect.kind].family, decided=not effect.alternatives)


def _with_rest(effect: Missing, before: float, after: float) -> Missing:
    """Return an effect with what is left without it: its share of the squares lies between those of the two models."""
    left = after + effect.share * (before - after)
    return dataclasses.replace(effect, without=math.sqrt(left) if math.isfinite(left) and left >= 0.0 else None)


def _without_intervals(effect: Missing) -> Missing:
    values = {name: dataclasses.replace(value, std=None, interval=None) for name, value in effect.parameters.items()}
    return dataclasses.replace(effect, parameters=values)


def is_led(dataset: Dataset) -> bool:
    """Whether every trial has what the closed chain is simulated from: robot angles, a robot, and forces."""
    known = all(t.robot_q is not None and t.force_on_arm is not None for t in dataset.trials)
    return known and dataset.model.robot is not None


def channel_names(dataset: Dataset, led: bool) -> list[str]:
    """Return the names of the channels that are compared."""
    n = dataset.model.n_joints
    return [*(f"q{j}_rad" for j in range(1, n + 1)), "Fy_N", "Fz_N"] if led else [f"tau{j}_Nm" for j in range(1, n + 1)]


def in_file(kind: str, dataset: Dataset) -> float:
    """Return the sign of an effect in the files: biases and drifts are of the channel as it stands there, not of the force on the arm."""
    return -1.0 if dataset.force_on == "robot" and kind in ("force_bias", "force_drift") else 1.0


def _missing(item: Mapping[str, Any], dataset: Dataset) -> Missing:
    name, index, values = item["effect"]
    kind = catalogue()[name]
    known = dict(item["sd"])
    own = in_file(name, dataset)
    parameters = {}
    for k, (p, value) in enumerate(zip(kind.parameters, values, strict=True)):
        sign = own if p.linear else 1.0
        low, high = sorted((sign * p.min, sign * p.max))
        std = known[k] if k in known and math.isfinite(known[k]) else None
        parameters[p.name] = Value.of(sign * value, std, p.unit, (low, high))
    alternatives = []
    for (entry, _), worse, likeness in item["alternatives"]:
        why = "explains these movements as well" if worse < 2.0 else "explains these movements nearly as well"
        alternatives.append(Alternative(entry[0], *catalogue()[entry[0]].place(entry[1]), why, float(worse), float(likeness)))
    return Missing(name, *kind.place(index), parameters, item["p_value"], item["share"], tuple(alternatives))


def _apart(item: Sequence[Any], dataset: Dataset, raw: Mapping[str, Any]) -> Missing:
    """Return a rhythm, or what happened in one trial."""
    (name, index, values), sd, trial, (start, end), gain, rivals = item
    kind = catalogue()[name]
    first = next((k for k, p in enumerate(kind.parameters) if values[k] and p.name not in ("frequency", "phase", "start", "duration")), 0)
    parameters = {
        p.name: Value.of(v, sd if k == first else None, p.unit, (p.min, p.max))
        for k, (p, v) in enumerate(zip(kind.parameters, values, strict=True))
    }
    if trial is not None and "start" not in parameters:
        parameters["start"] = Value(start, None, "s")
    alternatives = tuple(
        Alternative(other, *catalogue()[other].place(place), "swings these channels as much", float(worse), math.nan)
        for (other, place, _), worse in rivals
    )
    explained = gain + raw["calibrated"]["cost"] - raw["amended"]["cost"]
    chance = math.exp(-min(gain / 2.0, 700.0))
    where, span = (
        (None, None) if trial is None else (dataset.trials[trial].file, (float(start), min(float(end), float(dataset.trials[trial].t[-1]))))
    )
    return Missing(name, *kind.place(index), parameters, chance, gain / explained, alternatives, where, span)


def _limits(raw: Mapping[str, Any]) -> tuple[Limit, ...]:
    best: dict[tuple[str, int, int], Limit] = {}
    named = [tuple(item["effect"][:2]) for item in raw["named"]]
    for (entry, free), gain, price, smallest in raw["ruled"]:
        name, index, _values = entry
        if not math.isfinite(smallest) or (name, index) in named:
            continue
        kind = catalogue()[name]
        parameter = kind.parameters[free[0]]
        key = (name, index, free[0])
        known = best.get(key)
        # Of several shapes that which shows most clearly, and the most that any of them explains.
        most = max([(float(gain), float(price)), *([(known.gain, known.price)] if known else [])], key=lambda g: g[0] - g[1])
        least = float(smallest) if known is None else min(known.at_least, float(smallest))
        best[key] = Limit(name, *kind.place(index), parameter.name, least, parameter.unit, *most)
    return tuple(best.values())


def _rung(tried: Sequence[Any], before: float, after: float) -> Rung:
    def where(asked: Sequence[Any]) -> tuple[str, int | None, str | None]:
        (name, index, _values), _free = asked
        return (name, *catalogue()[name].place(index))

    return Rung(tuple(Tried(tuple(map(where, members)), float(gain)) for members, gain in tried), float(before), float(after))


def absorbed(dataset: Dataset, raw: Mapping[str, Any]) -> tuple[Absorbed, ...]:
    """Return what was refitted, from the core's list of unknowns."""
    items = []
    modelled = dataset.model.all_effects
    for what, index, part, value, before, _after in raw["unknowns"]:
        if what in ("mass", "com", "inertia"):
            items.append(Absorbed(f"{what} of segment {index + 1}", value, 2 * before, "of its value"))
        elif what == "known":
            if index >= len(modelled):
                # A law of the passive base, which is named.
                continue
            own = modelled[index]
            parameter = catalogue()[own.kind].parameters[part]
            name = f"{parameter.name} of {_worded(own.kind, own.joint, own.channel)}"
            given = own.parameters.get(parameter.name, parameter.default)
            items.append(Absorbed(name, value / given - 1.0, 2 * before / abs(given), "of its value"))
        elif what in ("compliance", "damping"):
            items.append(Absorbed(f"{what} of the contact, {'yz'[part]}", value, 2 * before, "of its value"))
        elif what == "shift":
            items.append(Absorbed(f"place of the robot, {'yz'[part]}", value, 2 * before, "m"))
        elif what == "eccentricity":
            wave = ("cosine", "sine")[part]
            items.append(Absorbed(f"once-per-turn error of angle {index + 1}, {wave}", value, 2 * before, "rad"))
        elif what in catalogue():
            kind = catalogue()[what]
            items.append(Absorbed(_worded(what, *kind.place(index)), value, 2 * before, kind.parameters[0].unit))
    return tuple(items)


def _worded(kind: str, joint: int | None, channel: str | None) -> str:
    return kind.replace("_", " ") + (f" of joint {joint}" if joint else f" of {channel}" if channel else "")


def lasting(result: GapFound) -> Model:
    """Return the amended model without rhythms, which are set apart from what is fitted."""
    effects = result.model.effects
    return result.model.replace(effects=effects[: len(effects) - len(result.raw["locked"])])


def amended(model: Model, fitted: Mapping[str, Any], *, joints: bool = True, rhythms: Sequence[Any] = ()) -> Model:
    """Return the model with refitted segments and known effects, and the named effects added; without `joints` no effect of it."""
    segments = tuple(
        Segment(
            s.name,
            s.length,
            s.mass * (1 + m),
            min(max(s.com * (1 + c), 0.0), s.length),
            s.inertia * (1 + i),
            com_normal=s.com_normal * (1 + c),
        )
        for s, (m, c, i) in zip(model.segments, fitted["segments"], strict=True)
    )
    contact = model.contact
    if contact is not None:
        compliance, damping = fitted["contact"]
        contact = Contact(
            (contact.stiffness[0] / (1 + compliance[0]), contact.stiffness[1] / (1 + compliance[1])),
            (contact.damping[0] * (1 + damping[0]), contact.damping[1] * (1 + damping[1])),
        )
    if not joints:
        return model.replace(segments=segments, contact=contact, joints=tuple(Joint(j.name) for j in model.joints), effects=())
    rest = iter([effect(entry) for entry in fitted["known"]])
    listed = []
    for joint in model.joints:
        values = {}
        if joint.stiffness:
            values["stiffness"] = next(rest).parameters["stiffness"]
        if joint.viscosity:
            values["viscosity"] = next(rest).parameters["viscosity"]
        if joint.coulomb:
            values["coulomb"] = next(rest).parameters["torque"]
        listed.append(joint.replace(**values))
    effects = (*rest, *map(effect, fitted["named"]), *map(effect, rhythms))
    return model.replace(segments=segments, joints=tuple(listed), contact=contact, effects=effects)


def effect(entry: Sequence[Any]) -> Effect:
    """Return an effect of the core."""
    name, index, values = entry
    kind = catalogue()[name]
    return Effect(name, *kind.place(index), parameters=kind.values(values))


def gaps(dataset: Dataset, led: bool, raw: Mapping[str, Any], last: str = "amended") -> dict[str, ChannelGap]:
    """Return the gap of every channel on the test trials; `last` is the last model that there is.

    Of a rig without a robot these are joint torques by inverse dynamics of the measured angles, both low-passed at the common band, away
    from ends and gaps, reversals and rests included; and the angles of a run from the state that explains the first second best: a free
    swing to the end of the trial, a driven arm for that second, with the measured torques.
    """
    tests = [k for k, t in enumerate(dataset.trials) if t.role == "test"]
    plays = [raw["trials"][k] for k in tests]
    result = {}
    tested = held_out(dataset, raw["trials"], raw["groups"], last)
    for c, name in enumerate(channel_names(dataset, led)):
        given, calibrated, after = (size(plays, version, c) for version in ("given", "calibrated", "amended"))
        floor, floor_std, opened = tested[c] if tested else (None, None, None)
        result[name] = ChannelGap(given, calibrated, after, floor, floor_std, opened)
    if not led:
        for j in range(dataset.model.n_joints):
            given, calibrated, after = (_free_size(dataset, raw, version, j) for version in ("given", "calibrated", "amended"))
            result[f"q{j + 1}_rad"] = ChannelGap(given, calibrated, after, None)
    return result


def _free_size(dataset: Dataset, raw: Mapping[str, Any], version: str, joint: int) -> float | None:
    """Return the root mean square of free runs less measured angles over the test trials; None where nothing could be simulated."""
    rows = []
    for trial, play in zip(dataset.trials, raw["trials"], strict=True):
        angles = play["free"].get(version) if trial.role == "test" else None
        if angles is not None:
            off = (angles - trial.q)[:, joint]
            rows.append(off[np.isfinite(off)])
    return float(np.sqrt(np.mean(np.square(np.concatenate(rows))))) if rows and sum(map(len, rows)) else None


def size(plays: Sequence[Mapping[str, Any]], version: str, channel: int) -> float | None:
    """Return the root mean square of simulated less measured of one channel; None where nothing could be simulated."""
    known = [p for p in plays if p.get(version) is not None]
    rows = [(p[version] - p["measured"])[p["counted"]][:, channel] for p in known]
    return float(np.sqrt(np.mean(np.square(np.concatenate(rows))))) if rows and sum(map(len, rows)) else None


def held_out(
    dataset: Dataset, plays: Sequence[Mapping[str, Any]], groups: Sequence[int], version: str
) -> list[tuple[float | None, float | None, Open | None]]:
    """Return floor, its standard deviation and where the gap is open, for each channel; nothing where no trial can be simulated.

    The floor is what test trials differ by from repeats of them, after their own simulated differences: their own noise, and not that of
    all trials, for it is in what is left on them as well. Where no test trial has a repeat, what the repeats of other movements differ by.
    """
    columns = []
    for trial, play, group in zip(dataset.trials, plays, groups, strict=True):
        shown = play.get(version)
        left = None if shown is None else np.ascontiguousarray((play["measured"] - shown).T).tolist()
        columns.append((group, trial.role == "test", trial.rate, left, play["counted"].tolist()))
    result = []
    for _, floor, floor_std, opened in _armrs.held_out(columns):
        place = None
        if opened is not None:
            number, start, end, size = opened
            place = Open(dataset.trials[number].file, start, end, size if math.isfinite(size) else None)
        result.append((floor, floor_std, place))
    return result
