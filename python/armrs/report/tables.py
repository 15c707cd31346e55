"""Tables of results, for terminal and reports. They read the plain data of a result."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..formatting import (
    digits,
    number,
    parameter_label,
    percent,
    plus_minus,
    probability,
    read_followed,
    read_in,
    spread,
    symbol,
    unit,
)

_SYMMETRIC = 0.95
"""An interval ends at a limit if the ratio of its shorter to its longer side is less."""
DECIDED_BY = {
    "data": "the measurement",
    "prior": "the model as given, because these movements do not show it",
    "bound": "a physical limit that the fit ran into",
}
"""What decided a value, in plain words."""


@dataclass(frozen=True)
class Table:
    """Head and rows; the first `left` columns hold words, and with `symbols` the first names quantities."""

    head: Sequence[str]
    rows: Sequence[Sequence[object]]
    left: int = 1
    symbols: bool = False

    def __post_init__(self) -> None:
        shown = [[digits(cell, 4) if isinstance(cell, float) else cell for cell in row] for row in self.rows]
        object.__setattr__(self, "rows", shown)


def estimates(items: Iterable[Mapping[str, Any]], joints: Sequence[str], level: float) -> Table:
    """Return estimates with uncertainty, interval and what decided them."""
    rows = [
        [
            label(item),
            where(item, joints),
            number(item["value"], item["std"]),
            spread(item["std"]),
            "{} … {}".format(*(number(v, item["std"]) for v in item["interval"])),
            unit(item["unit"]),
            item["decided_by"],
            _note(item),
            None if item.get("given") is None else f"{item['given']:.4g}",
        ]
        for item in items
    ]
    head = ["quantity", "where", "estimate", "± std", f"{100 * level:g} % interval", "unit", "decided by", "note", "in the model"]
    used = [k for k in range(len(head)) if any(row[k] not in (None, "") for row in rows)]
    return Table([head[k] for k in used], [[row[k] for k in used] for row in rows], left=2 if 1 in used else 1, symbols=True)


def _note(item: Mapping[str, Any]) -> str | None:
    """Return the reservations about an estimate: its caveat, and that its interval ends at a physical limit."""
    said = [item["caveat"]] if item.get("caveat") else []
    below, above = (abs(end - item["value"]) for end in item["interval"])
    if min(below, above) < _SYMMETRIC * max(below, above):
        said.append(f"interval ends at {item['interval'][int(above < below)] + 0.0:.3g}")
    return ", ".join(said) or None


def deciding(items: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return what decided each estimate, as a word of `DECIDED_BY`; nothing for any other word."""
    return [item["decided_by"] if item["decided_by"] in DECIDED_BY else "" for item in items]


def measured(result: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the estimates of an identification that rest on the measurement and are reliable, combinations first, each once."""
    found = {
        (label(e), e["joint"]): e
        for e in (*result["combinations"], *result["parameters"])
        if e["decided_by"] == "data" and e.get("caveat") is None
    }
    return list(found.values())


def residuals(rms: Mapping[str, Mapping[str, float]], joints: Sequence[str]) -> Table:
    """Return the root mean square of the torque residual by joint, fit trials beside test trials."""
    roles = [role for role in ("fit", "test") if role in rms]
    channels = list(next(iter(rms.values()), {}))
    rows = [[joints[k] if k < len(joints) else name, *(f"{rms[role][name]:.4g}" for role in roles)] for k, name in enumerate(channels)]
    return Table(["joint", *(f"{role} trials [N m]" for role in roles)], rows)


def label(item: Mapping[str, Any]) -> str:
    """Name a quantity so that it can stand alone: a parameter of an effect with its kind."""
    name = symbol(str(item["name"]))
    return name if item["kind"] in ("segment", "combination", "calibration") else f"{item['kind']} {name}"


def where(item: Mapping[str, Any], joints: Sequence[str]) -> str:
    """Name the joint or segment, by number and name."""
    joint = item.get("joint")
    if joint is None:
        return ""
    name = joints[joint - 1] if joint <= len(joints) else ""
    return name if name == f"joint {joint}" else f"{joint} {name}".strip()


def run(data: Mapping[str, Any]) -> Table:
    """Return what a simulation was made with and what came out."""
    energy = data["energy"]
    # An arm that rests at both ends, and a handle without a spring, store nothing: what is below the error is rounding.
    stored = energy["stored_J"] if abs(energy["stored_J"]) > energy["error_J"] else 0.0
    made_with = " ".join(filter(None, (data["engine"], data["integrator"])))
    step = f"step {1e3 * data['dt_s']:.4g} ms"
    if "angle_error_rad" in data:
        step += f" (angles right to about {data['angle_error_rad']:.2g} rad)"
    rows = [
        ["duration", f"{data['duration_s']:.6g} s, {data['samples']} samples"],
        ["engine", f"{made_with}, {step}, {data['coupling']} coupling"],
        ["largest force on the arm", f"{data['largest_force_N']:.4g} N at {data['largest_force_at_s']:.4g} s"],
        ["largest joint speed", f"{data['largest_speed_rad_s']:.4g} rad/s"],
        ["stored energy", f"changed by {stored:.4g} J"],
        ["work of the handle", f"{energy['handle_J']:.4g} J"],
        ["work of the motors", f"{energy['drive_J']:.4g} J"],
        ["taken up by the joints", f"{energy['resisted_J']:.4g} J"],
        ["lost in the contact", f"{energy['damped_J']:.4g} J"],
        ["energy not accounted for", f"{energy['error_J']:.2g} J, {100 * energy['error_share']:.2g} % of what was exchanged"],
        ["digest", data["digest"]],
    ]
    if "half_step" in data:
        halved = data["half_step"]
        changed = f"angles by up to {math.degrees(halved['angle']):.2g}°, force by up to {halved['force']:.2g} N"
        rows.insert(-1, ["half the step changes", changed])
    return Table(["quantity", "value"], rows, left=2)


def coupling(data: Mapping[str, Any]) -> Table:
    """Return how a system was run."""
    slaves = ", ".join(slave["name"] for slave in data["slaves"])
    rows = [
        ["slaves", slaves],
        ["algorithm", f"{data['algorithm']}, communication step {1e3 * data['step_s']:.4g} ms"],
        ["time", f"{data['duration_s']:.6g} of {data['asked_s']:.6g} s, {data['samples']} communication points"],
        ["work", f"{data['steps_of_slaves_a_step']:.3g} steps of a slave for each communication step"],
    ]
    return Table(["quantity", "value"], rows, left=2)


def connections(data: Mapping[str, Any]) -> Table:
    """Return what each connection did: how far inputs were off, and the energy that went through and was created."""
    keys = ("residual_max", "residual_rms", "unit", "energy_exchanged_J", "energy_created_J")
    rows = [[f"{c['from']} -> {c['to']}", c["within"], *(c[key] for key in keys)] for c in data["connections"]]
    return Table(["connection", "held at", "residual, max", "rms", "unit", "transferred [J]", "created [J]"], rows, left=2)


def coupling_errors(data: Mapping[str, Any]) -> Table:
    """Return how far each variable at an interface, and each angle, is estimated to be off; empty where that was not estimated."""
    rows = [[e["name"], e["estimated_error"], e["largest_error"], e["allowed"], e["unit"]] for e in data["errors"]]
    return Table(["variable", "estimated error", "at most", "allowed", "unit"], rows, left=1)


def online(data: Mapping[str, Any]) -> Table:
    """Return the estimate of every unknown by an online estimator."""
    joints = data["data"]["joints"]
    rows = [
        [symbol(e["name"]), where(e, joints), number(e["value"], e["std"]), spread(e["std"]), unit(e["unit"]), e["decided_by"]]
        for e in data["estimates"]
    ]
    return Table(["unknown", "joint", "value", "± std", "unit", "decided by"], rows, left=2, symbols=True)


def statuses(data: Mapping[str, Any]) -> Table:
    """Return how many samples became what."""
    rows = [[name, count, f"{100 * count / data['periods']:.3g}"] for name, count in data["statuses"].items()]
    return Table(["sample", "control periods", "[%]"], rows)


def passive(data: Mapping[str, Any]) -> Table:
    """Return the passive moment of every configuration and joint, averaged over the bins."""
    rows = [
        [
            c["configuration"],
            f"{c['joint']} {c['joint_name']}".strip(),
            c["repeats"],
            "{:.1f} … {:.1f}".format(c["angle_deg"][0], c["angle_deg"][-1]),
            f"{c['elastic_mean_Nm']:.4g}",
            f"{c['half_width_mean_Nm']:.3g}",
            _ends(c.get("half_width_whole_interval_Nm", c["half_width_interval_Nm"])),
            f"{100 * c['inertial_share']:.1f}",
        ]
        for c in data["curves"]
    ]
    head = [
        "configuration",
        "joint",
        "repeats",
        "angles [°]",
        "elastic mean [N m]",
        "half width [N m]",
        "95 % interval [N m]",
        "inertial share [%]",
    ]
    return Table(head, rows, left=2)


def _ends(interval: Sequence[float | None]) -> str:
    """Write an interval; a single repeat has none."""
    low, high = interval
    if low is None or high is None or not math.isfinite(high - low):
        return "–"
    return " … ".join(number(end, 0.25 * (high - low)) for end in (low, high))


def dependence(data: Mapping[str, Any]) -> Table:
    """Return how passive moments depend on the adjacent angle, a quantity a row and a joint a column."""
    found = data["dependence"]
    by_name = [{c["name"]: c for c in d["coefficients"]} for d in found]
    rows: list[list[object]] = [
        [name.replace("_", " ") + ("" if own["unit"] == "1" else f" [{unit(own['unit'])}]"), *(_in_brackets(c[name]) for c in by_name)]
        for name, own in by_name[0].items()
        if any(c[name]["value"] != 0.0 for c in by_name)
    ]
    rows.append(["mean coupling [N m/rad]", *(_in_brackets(d["mean_coupling"]) for d in found)])
    rows.append(
        ["mean coupling not zero, by this joint alone", *(f"{'yes' if d['coupled'] else 'no'} (p {_chance(d['p_value'])})" for d in found)]
    )
    rows.append(["linear law is enough", *(f"{'yes' if d['linear'] else 'no'} (p {_chance(d['linear_p_value'])})" for d in found)])
    return Table(["", *(f"{d['joint_name']}, {d['adjacent_name']} held" for d in found)], rows)


def _chance(p: float) -> str:
    """Write a probability behind its symbol."""
    text = probability(p)
    return text if text.startswith("<") else f"= {text}"


def _in_brackets(found: Mapping[str, Any]) -> str:
    low, high = found["interval"]
    return f"{found['value']:.3g} ({low:.3g} to {high:.3g})" if found["value"] != 0.0 or low != high else "0"


def predictions(data: Mapping[str, Any]) -> Table:
    """Return how well each parameter will be known, beside another movement where one is compared."""
    other = data.get("compared")
    rows: list[list[object]] = []
    for k, p in enumerate(data["predictions"]):
        row: list[object] = [
            label(p),
            where(p, data["data"]["joints"]),
            *(_known(p[key]) for key in ("value", "std", "std_of_data")),
            unit(p["unit"]),
            percent(p["relative"]),
        ]
        rows.append(row if other is None else [*row, percent(other["predictions"][k]["relative"])])
    head = ["quantity", "where", "assumed", "± std to expect", "± std of the data", "unit", "relative"]
    return Table(head if other is None else [*head, "compared"], rows, left=2, symbols=True)


def _known(value: float | None) -> str:
    return "unknown" if value is None or not math.isfinite(value) else f"{value:.4g}"


def recorded(data: Mapping[str, Any]) -> Table:
    """Return the trials of the virtual laboratory: how well the robot followed, and how each ended."""
    rows = []
    for trial in data["trials"]:
        stop = trial["stop"]
        end = "complete" if stop is None else f"stopped at {stop['at_s']:.4f} s: {stop['what']} {stop['reason']}"
        off = trial["tracking_error_rad"]
        rows.append([trial["configuration"], str(trial["repeat"]), "yields" if off is None else f"{1e3 * off:.3g}", end])
    return Table(["configuration", "repeat", "tracking error of the robot [mrad]", "end"], rows)


RUNS = {"run": "carried", "without_support": "not carried"}
"""Runs of a trial with a handle that yields, and how tables and legends name them where there are both."""


def run_named(key: str, count: int) -> str:
    """Name a run of so many."""
    return RUNS[key] if count > 1 else "the run"


def interactions(data: Mapping[str, Any]) -> Table:
    """Return how each run went."""
    rows = []
    for trial in data["trials"]:
        story = trial["interaction"]
        count = sum(story[key] is not None for key in RUNS)
        for key in RUNS:
            run = story[key]
            if run is not None:
                numbers = [f"{run[name]:.3g}" for name in ("force_rms_N", "force_largest_N")]
                speed = run["speed_at_end_m_s"]
                far = [f"{1e3 * run['handle_off_m']:.3g}", "–" if speed is None else f"{1e3 * speed:.2g}"]
                end = "stopped" if speed is None else "at rest" if run["stable"] else "not at rest"
                rows.append([trial["configuration"], str(trial["repeat"]), run_named(key, count), *numbers, *far, end])
    head = ["configuration", "repeat", "run", "force, RMS [N]", "largest [N]", "handle off by [mm]", "speed at end [mm/s]", "end"]
    return Table(head, rows, left=3)


def movements(data: Mapping[str, Any]) -> Table:
    """Return planned movements: repeats and speeds."""
    rows = [
        [
            str(k),
            m["repeats"],
            f"{m['speed_rad_s']:.3g}",
            f"{m['acceleration_rad_s2']:.3g}",
        ]
        for k, m in enumerate(data["movements"], start=1)
    ]
    return Table(["movement", "repeats", "speed [rad/s]", "acceleration [rad/s²]"], rows)


def history(courses: Sequence[Mapping[str, Any]]) -> Table:
    """Return every parameter over sessions: the last value, and how it differs from the session before and from all before."""
    rows = []
    for c in courses:
        several = c["change"] is not None and math.isfinite(c["change"])
        factor, held_in = read_followed(c["unit"])
        cells = []
        before = c["before"]
        for value, std, p, changed in (
            (before["value"], before["std"], before["p_value"], before["clear"]),
            (c["change"], c["change_std"], c["p_value"], c["changed"]),
        ):
            tested = f"{'yes' if changed else 'no'} (p {_chance(p)})" if several else "–"
            cells += [plus_minus(factor * value, factor * std, "+") if several else "–", tested]
        last = plus_minus(factor * c["values"][-1], factor * c["stds"][-1])
        rows.append([parameter_label(c), held_in, len(c["dates"]), last, *cells])
    head = ["parameter", "unit", "sessions", "last ± std", "since the session before", "changed", "since all before", "changed"]
    # The session before is all before the second one.
    shown = {0: 4, 1: 4, 2: 6}.get(max((len(c["dates"]) for c in courses), default=0), len(head))
    return Table(head[:shown], [row[:shown] for row in rows], left=2, symbols=True)


def comparison(data: Mapping[str, Any]) -> Table:
    """Return identified values beside known ones, and beside the relative errors that the thesis reports."""
    rows = [
        [
            label(c) if c["joint"] is None or c["kind"] in ("segment", "combination") else f"{label(c)} {c['joint']}",
            unit(c["unit"]),
            f"{c['reference']:.4g}",
            number(c["value"], c["std"]),
            spread(c["std"]),
            f"{c['error_percent']:+.1f}",
            None if c["thesis_error_percent"] is None else f"{c['thesis_error_percent']:+.1f}",
            c["decided_by"],
        ]
        for c in data["comparison"]
    ]
    head = ["quantity", "unit", "known", "identified", "± std", "error [%]", "error in the thesis [%]", "decided by"]
    return Table(head, rows, left=2, symbols=True)


def smallest_effects(would_show: Sequence[Mapping[str, Any]]) -> Table:
    """Return the smallest effects that `armrs gap` would name, one row for each kind and its joints side by side."""
    most = max([w["joint"] or 0 for w in would_show], default=0)
    rows: dict[tuple[str, str, str], list[object]] = {}
    for w in would_show:
        key = (w["kind"], w["parameter"], w["unit"])
        cells = rows.setdefault(key, [None] * (most + 2))
        at = w["joint"] - 1 if w["joint"] else most + ({"Fy": 0, "Fz": 1}.get(w["channel"], 0) if w["channel"] else 0)
        cells[at] = "no size" if w["at_least"] is None else digits(read_in(w["unit"])[0] * w["at_least"], 2)
    head = ["effect", "parameter", "unit", *(f"joint {j + 1}" for j in range(most)), "whole arm or Fy", "Fz"]
    return Table(head, [[kind, parameter, read_in(held_in)[1], *cells] for (kind, parameter, held_in), cells in rows.items()], 3)
