"""Sentences and tables of `spasticity` and `cohort`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import formatting
from . import sentences
from .tables import Table

LAW = (
    "The reflex torque is the gain times the speed beyond the threshold, delayed by the latency. Where a tonic angle is stated, the "
    "threshold rises by the slope for every radian short of it. A spring, viscosity, dry friction and an error of the model's inertia are "
    "fitted together with the reflex, and an offset in every trial."
)
STRETCHES = (
    "Means over the repeats of each movement, the slowest first. Speed: the largest of the stretch. Peak: largest moment less that at the "
    "beginning. Work: done on the joint. Elastic, viscous and dry, reflex: the largest of each part of the fitted law. Catch: where the "
    "reflex reaches a tenth of its largest moment."
)


def verdict(result: Mapping[str, Any]) -> str:
    """Return a result in a sentence or two."""
    return _cohort(result) if result["verb"] == "cohort" else _spasticity(result)


def _spasticity(result: Mapping[str, Any]) -> str:
    joints, said = result["data"]["joints"], []
    for effect in result["effects"]:
        name, p = joints[effect["joint"] - 1], effect["parameters"]
        if not effect["decided"]:
            said.append(f"{name}: no stretch reflex was detected in these stretches.")
            continue
        from_on, gain, latency = (formatting.with_interval(p[key], formatting.read_followed) for key in ("threshold", "gain", "latency"))
        way = "grows" if p["direction"]["value"] > 0 else "falls"
        said.append(f"{name}: a stretch reflex resists where the angle {way} faster than {from_on}; gain {gain}; latency {latency}.")
    return " ".join(said)


def reflexes(result: Mapping[str, Any]) -> Table:
    """Return gain, threshold and latency of each reflex, viscosity and friction besides it."""
    joints, rows = result["data"]["joints"], []
    for effect, besides in zip(result["effects"], result["besides"], strict=True):
        own = {k: v for k, v in effect["parameters"].items() if k != "direction"} if effect["decided"] else {}
        own |= {"viscosity besides reflex": besides["viscosity"], "dry friction besides reflex": besides["dry"]}
        for name, value in own.items():
            factor, held_in = formatting.read_followed(value["unit"])
            std = factor * value["std"]
            shown = [formatting.number(factor * x, std) for x in (value["value"], *value["interval"])]
            rows.append([joints[effect["joint"] - 1], name, shown[0], formatting.spread(std), f"{shown[1]} … {shown[2]}", held_in])
    return Table(["joint", "quantity", "estimate", "± std", "95 % interval", "unit"], rows, left=2)


def stretches(result: Mapping[str, Any]) -> Table:
    """Return the stretches, each movement's means over its repeats, the slowest first."""
    joints, rows = result["data"]["joints"], []
    for joint, configuration in dict.fromkeys((s["joint"], s["configuration"]) for s in result["stretches"]):
        own = [s for s in result["stretches"] if (s["joint"], s["configuration"]) == (joint, configuration)]

        def mean(name: str, factor: float = 1.0, own: Sequence[Mapping[str, Any]] = own) -> str:
            values = [factor * s[name] for s in own if s[name] is not None and math.isfinite(s[name])]
            return f"{np.mean(values):.3g}" if values else "–"

        degrees = 180.0 / math.pi
        cells = [mean("speed", degrees), mean("peak_moment"), mean("work"), mean("elastic"), mean("resisting"), mean("reflex")]
        cells += [mean("catch_angle", degrees), mean("catch_speed", degrees), mean("emg_latency", 1000.0), mean("co_contraction")]
        rows.append([joints[joint - 1], configuration, len(own), *cells])
    head = ["joint", "movement", "repeats", "speed [°/s]", "peak [N m]", "work [J]", "elastic [N m]", "viscous and dry [N m]"]
    head += ["reflex [N m]", "catch angle [°]", "speed there [°/s]", "EMG latency [ms]", "co-contraction"]
    used = [k for k in range(len(head)) if k < len(head) - 2 or any(row[k] != "–" for row in rows)]
    return Table([head[k] for k in used], [[row[k] for k in used] for row in rows], left=2)


def show(result: Mapping[str, Any], written: Sequence[Path] = ()) -> None:
    """Print the reflexes of a data set."""
    sentences.head(result, verdict(result))
    sentences.show("Reflex, and what resists besides it", reflexes(result))
    sentences.show("Stretches, means over repeats", stretches(result))
    sentences.followed(result)
    sentences.files_written(written)


def _cohort(result: Mapping[str, Any]) -> str:
    differ = [c for c in result["contrasts"] if c["p_value"] is not None and c["p_value"] < 0.05]
    higher: dict[str, list[str]] = {}
    for c in differ:
        first, second = c["between"]
        where = f" (group {c['within']})" if c["within"] else ""
        higher.setdefault(_named(c), []).append(f"{'higher' if c['difference'] > 0.0 else 'lower'} in {second} than in {first}{where}")
    named = "; ".join(f"{name} is {' and '.join(ways)}" for name, ways in higher.items())
    named = named[:1].upper() + named[1:] or "No difference between groups or sides was detected"
    compared = f" {named} (level of 5 % for all comparisons together)." if result["contrasts"] else ""
    count = len({q["name"] for q in result["quantities"]})
    return f"{result['subjects']} subjects, {result['sessions']} sessions, {count} {'quantity' if count == 1 else 'quantities'}.{compared}"


def _named(item: Mapping[str, Any]) -> str:
    """Return the name of a quantity in words."""
    return str(item["name"]).replace("_", " ")


def _with_unit(item: Mapping[str, Any]) -> str:
    return f"{_named(item)} [{item['unit']}]" if item["unit"] else _named(item)


def quantities(result: Mapping[str, Any]) -> Table:
    """Return mean, scatter between and within subjects, and the norm band of each quantity."""
    rows = []
    for q in result["quantities"]:
        mean = formatting.plus_minus(q["mean"], q["mean_std"])
        scatter = [q[name] for name in ("between_std", "within_std")]
        between, within = ("–" if std is None else formatting.number(std, 0.1 * std if std else None) for std in scatter)
        known = [0.25 * (q[name][1] - q[name][0]) for name in ("norm_low_interval", "norm_high_interval")]
        ends = [
            f"{formatting.number(end, std)} ({' … '.join(formatting.number(x, std) for x in q[name])})"
            for end, name, std in zip(q["norm"], ("norm_low_interval", "norm_high_interval"), known, strict=True)
        ]
        group = ", ".join(filter(None, (q["group"], q["side"])))
        rows.append([_with_unit(q), group, q["subjects"], mean, f"{between}, {within}", *ends])
    head = [
        "quantity",
        "group",
        "n",
        "mean ± standard error",
        "std between, within",
        "norm band from (95 % interval)",
        "to (95 % interval)",
    ]
    return Table(head, rows, left=2)


def contrasts(result: Mapping[str, Any]) -> Table:
    """Return the differences between groups and between sides."""
    rows = [
        [
            _with_unit(c),
            f"{c['between'][1]} − {c['between'][0]}{', ' * bool(c['within'])}{c['within']}",
            formatting.plus_minus(c["difference"], c["std"]),
            " … ".join(formatting.number(x, c["std"]) for x in c["interval"]),
            f"{c['p_value']:.2g}",
        ]
        for c in result["contrasts"]
    ]
    return Table(["quantity", "difference", "estimate ± standard error", "95 % interval", "p (Holm)"], rows, left=2)


def show_cohort(result: Mapping[str, Any], written: Sequence[Path] = ()) -> None:
    """Print a cohort."""
    sentences.head(result, verdict(result))
    sentences.show("Between and within subjects", quantities(result))
    if result["contrasts"]:
        sentences.show("Differences", contrasts(result))
    sentences.files_written(written)
