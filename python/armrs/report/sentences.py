"""Sentences about results, for terminal and reports. Each function reads the plain data of a result."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

from .. import formatting
from ..analysis.significance import CHANGE_LEVEL
from ..tabular import SYMBOLS as SYMBOLS
from . import console, tables

if TYPE_CHECKING:
    from ..io.markers import PlanarMotion

SYMBOLS_ON_PAGES = SYMBOLS.replace(", l the", ", ℓ the")
"""The same for pages, on which `tables.typeset` sets the names."""
HISTORY_MEANING = (
    "What was measured in each session; ± is half of the 95 % interval divided by 1.96, without errors that are the same in all "
    "sessions: it differs from the standard deviation of this session alone. A change has the uncertainty of both sessions, from the "
    "scatter of their own repeats. Differences between days that are no change of the joint, such as another strapping of the arm, are not "
    "in this scatter. p is the probability of a difference at least as large without a change, corrected for the number of parameters "
    "(Holm). A parameter counts as changed if p is below "
    f"{100.0 * CHANGE_LEVEL:.0f} %."
)
PASSIVE_MEANING = (
    "The passive moment is the torque with which a relaxed joint resists: the torque of the contact force minus gravity and inertia, "
    "positive where it acts against a growing angle. Elastic mean: mean of both directions of motion, which also contains errors in the "
    "masses of the model. Half width: half of their difference, the dissipative part, averaged over the angles; its 95 % interval is from "
    "the scatter of the repeats and the errors that they share. Inertial share: size of the inertial torque that was subtracted, relative "
    "to the moment. Only gravity and inertia of the model are subtracted: its springs, friction and other effects remain in these moments."
)

DEPENDENCE_MEANING = (
    "The elastic moment of a joint as a function of its own and of the adjacent angle: an exponential at each end of the measured range "
    "(upper and lower: its moment at that end; steepness: how fast it rises), a straight line (stiffness), a coupling (change with the "
    "adjacent angle) and a constant (moment). 95 % intervals are in brackets; a term of zero is not needed. If this law, which is linear "
    "in the adjacent angle, is not enough, each end moves with the adjacent angle as well: by minus its ratio for each degree of it. The "
    "mean coupling is that of the linear law; a small p indicates a coupling, or an error of the linear law."
)

INTERVALS = (
    "± is one standard deviation. Intervals use Student's t with Satterthwaite's degrees of freedom. If the scatter of the data alone "
    "makes up the standard deviation, these are the number of independent data blocks minus one. The more of it comes from the model as "
    "given or from the tolerances of the sensors, the closer the interval is to that of the normal distribution. Intervals end at "
    "physical limits."
)

PREDICTED = (
    "± std to expect: standard deviation of the estimate with what is known beforehand. ± std of the data: from the data alone. What the "
    "model lacks is in neither. Relative: ± std of the data divided by the value; a small parameter of an effect counts as 0.05."
)

NO_TEST_TRIALS = "No test trials: the result was not checked on data outside the fit."
COUPLING_OR_MASS = (
    "Tissue that spans both joints couples them. A wrong mass or centre of mass in the model does the same, because the gravity moment "
    "depends on the sum of both angles: compare with the first moments of armrs identify."
)


def name(result: Mapping[str, Any]) -> str:
    """Return what a result is about."""
    return str(result["data"]["name"])


def is_synthetic(result: Mapping[str, Any]) -> bool:
    """Return whether a result rests on simulated data."""
    return bool(result["data"].get("synthetic"))


def disturbance(effect: Mapping[str, Any]) -> tuple[str, float, float] | None:
    """Return trial, start and end [s] of an effect that was in one trial only and is left out there; None of any other."""
    trial, span = effect.get("trial"), effect.get("span")
    return (trial, span[0], span[1]) if trial and span else None


def verdict(result: Mapping[str, Any]) -> str:
    """Return a result in a sentence or two; results of `gap` and `sweep` have words of their own."""
    sentences = {
        "identify": _identified,
        "simulate": _simulated,
        "passive": _passive,
        "plan": _planned,
        "history": _followed,
        "online replay": _replayed,
        "record": _recorded,
        "demo": _demo,
        "fmu run": _coupled,
    }
    return sentences[result["verb"]](result)


def _identified(result: Mapping[str, Any]) -> str:
    by = [e["decided_by"] for e in result["parameters"]]
    counts = [f"the measurement decides {by.count('data')}", f"the model as given {by.count('prior')}"]
    if "bound" in by:
        counts.append(f"a physical limit {by.count('bound')}")
    ending = "" if result["status"] == "solved" else f" The solver ended {result['status']}: take the values with care."
    if any(e.get("caveat") for e in (*result["parameters"], *result["combinations"])):
        ending += " The speeds are largely noise: what is determined by the measurement is off by more than its intervals say."
    shown = tables.measured(result)
    measured = formatting.how_many(len(shown), "quantity", "quantities") + (" (first table)" if shown else "")
    return f"Measured: {measured}. Of the {len(by)} parameters, {', '.join(counts)}.{ending}"


def _simulated(result: Mapping[str, Any]) -> str:
    return (
        f"{result['duration_s']:.4g} s simulated; the force on the arm reaches {result['largest_force_N']:.4g} N. "
        f"The error of the energy balance is {result['energy']['error_J']:.2g} J."
    )


def _replayed(result: Mapping[str, Any]) -> str:
    by = [e["decided_by"] for e in result["estimates"]]
    share = result["untrusted_share"]
    ending = f" In {100 * share:.3g} % of the recorded states the device would give no carrying torque." if share else ""
    return (
        f"Of {result['periods']} control periods {result['refused']} had no sample or one that was refused; "
        f"{by.count('data')} of {len(by)} unknowns are decided by the data.{ending}"
    )


def _recorded(result: Mapping[str, Any]) -> str:
    movements = len({trial["configuration"] for trial in result["trials"]})
    ending = f"; the supervisor stopped {result['stopped']}, which are not in the data set" if result["stopped"] else ""
    of = f"{movements} movement{'s' * (movements != 1)}"
    return f"{len(result['trials'])} trials of {of} were simulated as a laboratory measures them{ending}."


def _coupled(result: Mapping[str, Any]) -> str:
    coupled = f"{result['duration_s']:.4g} s coupled; {result['why']}."
    good = {"good": coupled, "stable": f"{coupled} The error is not estimated.", "ended": coupled}
    no_result = f"{result['verdict'].upper()}, no result: {result['why']}."
    return good.get(result["verdict"], no_result)


def _passive(result: Mapping[str, Any]) -> str:
    if not result["curves"]:
        return "No joint moved far enough in both directions to determine its passive moment."
    parts: dict[str, list[str]] = {}
    for curve in result["curves"]:
        low, high = curve.get("half_width_interval_Nm") or (None, None)
        unclear = low is not None and high is not None and low <= 0.0 < high
        size = f"at most {high:.2g}" if unclear else f"{curve['half_width_mean_Nm']:.3g}"
        parts.setdefault(curve["joint_name"], []).append(
            f"{size} N m ({curve['configuration']}{'' if curve.get('slow', True) else ', not slow'})"
        )
    said = "; ".join(f"{joint} {', '.join(sizes)}" for joint, sizes in parts.items())
    return f"Half width of the hysteresis, with the movement in brackets: {said}."


def _planned(result: Mapping[str, Any]) -> str:
    return (
        f"{len(result['movements'])} movements take {result['duration_s']:.3g} s with all repeats. "
        f"The parameter that is known worst has a relative standard deviation of {formatting.percent(result['worst_relative_std'])}."
    )


def _followed(result: Mapping[str, Any]) -> str:
    courses = result["courses"]
    changed = [formatting.parameter_label(c) for c in courses if c["changed"]]
    said = f"{', '.join(changed)} changed in the last session" if changed else "No parameter changed in the last session"
    return (
        f"{len(courses)} parameters are tracked over the sessions. {said} (level of {100.0 * CHANGE_LEVEL:.0f} % for all of them together)."
    )


def _demo(result: Mapping[str, Any]) -> str:
    return str(result["verdict"])


def data_lines(data: Mapping[str, Any]) -> list[str]:
    """Return what a result rests on."""
    lines = []
    for role, meaning in (("fit", ""), ("test", ", not used in any fit")):
        part = data[role]
        if part["trials"]:
            lines.append(
                f"{formatting.how_many(part['trials'], f'{role} trial')}{meaning}: {part['duration_s']:.0f} s, {part['samples']} samples."
            )
    if not data["test"]["trials"]:
        lines.append(NO_TEST_TRIALS)
    lines.append(f"Movements: {', '.join(data['configurations'])}.")
    held = [word for word, there in (("contact forces", data["forces"]), ("joint torques", data["torques"])) if there]
    lines.append(f"Measured: angles, {', '.join(held)}.")
    return lines + [f"Warning: {line}" for line in data["warnings"]]


def decided_lines(items: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the meaning of the words for what decided these estimates."""
    present = {e["decided_by"] for e in items}
    return [f"Decided by {key}: determined by {meaning}." for key, meaning in tables.DECIDED_BY.items() if key in present]


def check_lines(result: Mapping[str, Any]) -> list[str]:
    """Return what the checks of passive moments came to, a line each."""
    return [str(check["text"]) for check in result.get("checks", ())]


def not_separable(result: Mapping[str, Any]) -> list[str]:
    """Return what the data cannot determine, a line each."""
    units = {formatting.symbol(item["name"]): formatting.unit(item["unit"]) for item in (*result["parameters"], *result["combinations"])}
    lines = [_trade(line, units) for line in result["not_separable"]]
    if result["scale_free"]:
        lines.append("No torque acted: all values are known up to one common factor, which was taken from the model.")
    return lines


def independent(result: Mapping[str, Any]) -> str:
    """Describe how much of the segments and joints the movements determine."""
    return f"the movements determine {result['rank']} independent combinations of the segment and joint parameters"


def _trade(line: str, units: Mapping[str, str]) -> str:
    """Write a sentence on which quantities trade: `m2 and m1*l1 trade 1 : -0.376`."""
    names, trades, ratio = formatting.symbol(line).partition(" trade ")
    if not trades:
        return f"{names}."
    first, last = names.rsplit(" and ", 1)
    pairs = zip((*first.split(", "), last), ratio.split(" : "), strict=True)
    changes = [f"{name} by {share} {units.get(name, '')}".rstrip() for name, share in pairs]
    return f"Changing {', '.join(changes[:-1])} and {changes[-1]} together leaves every measurement unchanged: none is measured alone."


def identified(result: Mapping[str, Any], written: Sequence[Path] = ()) -> None:
    """Print an identification."""
    data, joints, level = result["data"], result["data"]["joints"], result["level"]
    head(result, verdict(result))
    show("What these movements determine", tables.estimates(tables.measured(result), joints, level))
    show("Parameters", tables.estimates(result["parameters"], joints, level))
    print("\n".join([SYMBOLS, INTERVALS, *decided_lines(result["parameters"]), *sticking_lines(result)]) + "\n")
    show(
        "Sensor calibration; the prior is the declared tolerance, one standard deviation",
        tables.estimates(result["calibration"], joints, level),
    )
    show(f"Torque residual below {result['cutoff_Hz']:.3g} Hz, root mean square", tables.residuals(result["residual_rms"], joints))
    lines = not_separable(result)
    if lines:
        print(f"What cannot be distinguished: {independent(result)}.")
        print("\n".join(f"  {line}" for line in lines))
    if not data["test"]["trials"]:
        print(NO_TEST_TRIALS)
    followed(result)
    files_written(written)


def sticking_lines(result: Mapping[str, Any]) -> list[str]:
    """Return in which joints dry friction that sticks replaced smooth friction, a line each."""
    why = "sticks (smoothing 0): with the smooth law, simulated angles and forces are further from the recorded ones."
    return [f"Dry friction in joint {j} {why}" for j in result.get("sticks", ())]


def followed(result: Mapping[str, Any]) -> None:
    """Print the history that a result was added to."""
    if result.get("history"):
        show("Over the sessions, what the data decided in the last one", tables.history(result["history"]))
        print(f"{HISTORY_MEANING}\n")


def demo(result: Mapping[str, Any], written: Sequence[Path] = ()) -> None:
    """Print what the demonstration came to: the result of the search, where the report is, and then the details."""
    print(verdict(result))
    files_written(written[-1:])
    print()
    print("\n".join(result["story"]))
    print()
    show(result["comparison_text"], tables.comparison(result))
    print(f"{SYMBOLS}\n")
    print(result["missing_text"])
    print()
    print("The slow movements alone do not separate all effects:")
    print("\n".join(f"  {line}" for line in result["slow_alone"]["lines"]))
    sessions = [path.parent for path in written if path.name == "dataset.toml"]
    if sessions:
        print(f"\nGo on with: armrs identify {sessions[0]} --with coulomb, or armrs gap {sessions[-1]}")


def simulated(result: Mapping[str, Any], written: Sequence[Path] = ()) -> None:
    """Print what a run came to."""
    head(result, verdict(result))
    show("", tables.run(result))
    for line in result.get("assumed", ()):
        print(line)
    files_written(written)


def coupled(result: Mapping[str, Any], written: Sequence[Path] = ()) -> None:
    """Print what a co-simulation came to."""
    head(result, verdict(result))
    show("", tables.coupling(result))
    show("Connections", tables.connections(result))
    show("Estimated errors", tables.coupling_errors(result))
    for name in result["not_connected"]:
        print(f"not connected: {name}")
    files_written(written)


def passive(result: Mapping[str, Any], written: Sequence[Path] = ()) -> None:
    """Print passive moments."""
    head(result, verdict(result))
    show(f"Passive moments below {result['cutoff_Hz']:.3g} Hz, averaged over angles", tables.passive(result))
    print(f"{PASSIVE_MEANING}\n")
    if result["dependence"]:
        show("Elastic moment against own and adjacent angle", tables.dependence(result))
        print(f"{DEPENDENCE_MEANING}\n")
    for line in couplings(result):
        print(line)
    for check in result["checks"]:
        print(check["text"])
    followed(result)
    files_written(written)


_COUPLED = {
    True: "the elastic moment of each depends on the angle of the other",
    False: "no dependence of the elastic moment of one on the angle of the other was detected",
}


def couplings(result: Mapping[str, Any]) -> list[str]:
    """Return for each pair of joints whether their elastic moments depend on one another."""
    found = result.get("couplings", ())
    lines = [
        f"{' and '.join(c['joint_names'])}: {_COUPLED[c['coupled']]}, "
        f"{formatting.plus_minus(c['value_Nm_rad'], c['std_Nm_rad'])} N m/rad, from the moments of both joints "
        f"(± is one standard deviation, p = {c['p_value']:.2g})."
        for c in found
    ]
    lines += [COUPLING_OR_MASS] * any(c["coupled"] for c in found)
    moving = [d for d in result.get("dependence", ()) if not d["linear"]]
    return lines + [
        f"{d['joint_name']}: the linear law is not enough; the ends of its range move with the {d['adjacent_name']}." for d in moving
    ]


def show(title: str, table: tables.Table) -> None:
    """Print a table under a title, and an empty line; nothing when it has no rows."""
    if table.rows:
        if title:
            print(title)
        console.table(table.head, table.rows, left=table.left)
        print()


def files_written(written: Sequence[Path]) -> None:
    """Print the names of files; the last is the one to open."""
    if written:
        print("\n".join(str(path) for path in written))


def head(result: Mapping[str, Any], sentence: str) -> None:
    """Print what a result is about and its verdict."""
    label = " (synthetic data)" if is_synthetic(result) else ""
    print(f"{name(result)}{label}: {sentence}")
    print()


def planar(motion: PlanarMotion, points: Sequence[str], file: Path) -> None:
    """Print what markers show of a planar arm."""
    plain = motion.to_dict()
    bends = [None, *(f"{low:.1f} to {high:.1f}" for low, high in plain["flexion_deg"])]
    rows = [
        (f"{a} to {b}", length, std, f"{q[0]:.1f} to {q[1]:.1f}", bend)
        for a, b, length, std, q, bend in zip(
            points, points[1:], plain["lengths_m"], plain["length_stds_m"], plain["q_range_deg"], bends, strict=False
        )
    ]
    console.table(["segment", "length [m]", "std [m]", "angle in the plane [deg]", "between segments [deg]"], rows)
    plane = plain["plane"]
    print(
        f"\n{'planar' if plane['planar'] else 'not planar'}: the segments leave the plane by {plane['out_of_plane_rms_deg']:.3g}° (rms), "
        f"{plane['out_of_plane_most_deg']:.3g}° at most; the plane is tilted by {plane['tilt_deg']:.3g}° from the vertical"
    )
    print(file)


def recorded(result: Mapping[str, Any], report: Path) -> None:
    """Print what the virtual laboratory did."""
    show("", tables.recorded(result))
    if said := interacted(result):
        print(f"\n{said}")
    if lines := saturated(result):
        print("\n" + "\n".join(lines))
    print("\n" + "\n".join([*result["files"][:3], str(report)]))


def interacted(data: Mapping[str, Any]) -> str:
    """Return in a sentence what the support does; empty where the handle does not yield."""
    stories = [t["interaction"] for t in data["trials"] if t.get("interaction")]
    if not stories:
        return ""
    runs = [s["run"] for s in stories]
    end = f"{sum(r['stable'] for r in runs)} of {len(runs)} came to rest"
    force = median(r["force_rms_N"] for r in runs)
    both = [s for s in stories if s["lowered"] is not None]
    if not both:
        return f"The robot holds the arm with {force:.3g} N (RMS, median of the runs); {end}."
    force, before = (median(s[key]["force_rms_N"] for s in both) for key in ("run", "without_support"))
    lowered = min(s["lowered"] for s in both)
    return (
        f"Carried by the model of [support], the arm takes {force:.3g} N at the hand instead of {before:.3g} N (RMS, medians of the runs): "
        f"less by at least {100 * lowered:.3g} %. {end[0].upper() + end[1:]}."
    )


def saturated(data: Mapping[str, Any]) -> list[str]:
    """Return which channels of a six-axis force sensor were at the end of their range, a line a trial."""
    lines = []
    for trial in data["trials"]:
        if counts := trial.get("six_axis", {}).get("saturated"):
            channels = ", ".join(f"{name.partition('_')[0]} in {formatting.how_many(count, 'sample')}" for name, count in counts.items())
            lines.append(f"{trial['configuration']} {trial['repeat']}: the force sensor is at the end of its range: {channels}.")
    return lines


def planned(result: Mapping[str, Any], written: Sequence[Path] = ()) -> None:
    """Print a plan and what it will show."""
    other = result.get("compared")
    robot = (
        f"the robot's up to {result['largest_robot_speed_rad_s']:.3g} rad/s and {result['largest_robot_acceleration_rad_s2']:.3g} rad/s²; "
        if result["largest_robot_speed_rad_s"]
        else "no robot in the model; "
    )
    show("", tables.predictions(result))
    print(f"{SYMBOLS}\n\n{PREDICTED}\n")
    print(
        f"{len(result['movements'])} movements, {result['duration_s']:.3g} s with all repeats; force on the arm up to "
        f"{result['largest_force_N']:.3g} N, joints up to {result['largest_speed_rad_s']:.3g} rad/s, {robot}"
        f"largest relative standard deviation {formatting.percent(result['worst_relative_std'])}"
        + ("" if other is None else f", {other['worst_ratio']:.3g} times better than the movement compared")
    )
    for line in slowed(result):
        print(line)
    if result.get("would_show"):
        print()
        show("The smallest effects that `armrs gap` would name on such a session", tables.smallest_effects(result["would_show"]))
    print("\n".join(str(path) for path in written))


def waypoints(result: Mapping[str, Any]) -> list[str]:
    """Return the angles that each planned movement goes through, a line each."""
    lines = []
    for k, m in enumerate(result["movements"], start=1):
        points = "; ".join(", ".join(f"{angle:.0f}" for angle in point) for point in m["waypoints_deg"])
        lines.append(f"movement {k} goes through {points}.".replace("-", "−"))
    return lines


def slowed(result: Mapping[str, Any]) -> list[str]:
    """Return the planned movements that had to be slowed, a line each."""
    from ..workflows.plan import Slowed

    return [str(Slowed(**slow)) for slow in result["slowed"]]


def reproduced(result: Mapping[str, Any], written: Sequence[Path] = ()) -> None:
    """Print what came out for every item of the thesis."""
    import textwrap

    for part in result["parts"]:
        for item in part["items"]:
            print(item["title"])
            print(textwrap.fill(item["ours"], 110, initial_indent="    ", subsequent_indent="    "))
    print("\n" + textwrap.fill(result["verdict"], 110))
    files_written(written[-1:])


def together(lines: Sequence[str]) -> list[str]:
    """Return lines that are the same for several movements or recordings (`NAME: what`) as one, at the place of the first."""
    said: dict[str, list[str]] = {}
    for line in lines:
        name, colon, what = line.partition(": ")
        said.setdefault(what if colon else line, []).append(name if colon else "")
    return [f"{', '.join(dict.fromkeys(names))}: {what}" if names[0] else what for what, names in said.items()]


def with_joint_names(line: str, joints: Sequence[str]) -> str:
    """Return a line in which joints have their names in place of their numbers."""
    return re.sub(r"\bjoint ([1-9])\b", lambda found: joints[int(found[1]) - 1], line)
