"""Run `armrs gap` on sessions with hidden effects, and score its results.

    python bench/hidden/score.py out/hidden/scored [--jobs 2] [--again] [--only-score] [--timeout 600]

The folder is what `hidden-world generate` made. Of each session the workflow is given `data/` alone; its answer goes to
`gap.json` beside it, and one line of `scores.jsonl` says how that compares with `truth.json`. Sessions that have an answer are not
run again. Then come the tables, in Markdown.

Exit status: 0 when every criterion holds, 1 when one does not, 2 for a folder that cannot be used.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any

CHANNEL_ABOVE_FLOOR = 1.1
"""A channel counts for the gap where the calibrated base is this much above the floor, and by more than that is uncertain (`floor_std`)."""
CLOSED = 0.9
"""Part of the gap that is to be closed where the naming is right."""
OPEN = 1.5
"""A channel of the test trials is open where what is left is more than this many times its floor."""
SEEN = 2.0
"""An effect counts for recall where it is at least this many times as large as the answer's `would_have_seen` says."""
SLIP_TIME = 0.5
"""A slip counts as found where its start is off by less than this [s]."""
SHAPES = [
    "rest",
    "ratio",
    "time",
    "speed",
    "threshold",
    "direction",
    "frequency",
    "phase",
    "start",
    "duration",
    "steepness",
    "upper",
    "lower",
    "breakdown",
    "recovery",
]
"""Parameters of the shape of an effect; the others are its size."""

SAME = (("inertia", 1), ("motor_inertia", 1))
"""A rotor in the first joint and inertia of the first segment are one term of the equation of motion: either name is right."""

Json = dict[str, Any]


# ---- one session


def same(truth: Json, named: Json) -> bool:
    """Whether a named effect, or an alternative, is the hidden one: kind, and joint and channel where the kind has one."""
    if (truth["kind"], truth.get("joint")) in SAME and (named.get("kind"), named.get("joint")) in SAME:
        return True
    for key in ("kind", "joint", "channel"):
        if truth.get(key) is not None and named.get(key) != truth[key]:
            return False
    # The trial of a burst is part of its name, where the answer says one.
    return truth.get("trial") is None or named.get("trial") in (None, truth["trial"])


def label(effect: Json) -> str:
    """Return `coulomb 2`, `force_bias Fy` or `backlash`."""
    where = effect.get("joint") or effect.get("channel")
    return effect["kind"] if where is None else f"{effect['kind']} {where}"


def matched(hidden: list[Json], named: list[Json]) -> list[tuple[Json, Json]]:
    """Return pairs of a hidden effect and the named one that is it."""
    pairs = []
    left = list(named)
    for truth in hidden:
        found = next((effect for effect in left if same(truth, effect)), None)
        if found is not None:
            left.remove(found)
            pairs.append((truth, found))
    return pairs


def closure(gap: Json) -> float | None:
    """Return the part of the gap above the floor that the named effects close, all channels together, each in units of its floor.

    None where no channel's calibrated base is above the floor.
    """
    closed = above = 0.0
    for channel in gap.values():
        calibrated, after, floor = (channel.get(key) for key in ("calibrated", "after", "floor"))
        if calibrated is None or after is None or not floor:
            continue
        if calibrated <= max(CHANNEL_ABOVE_FLOOR * floor, floor + (channel.get("floor_std") or 0.0)):
            continue
        closed += (calibrated - after) / floor
        above += (calibrated - floor) / floor
    return closed / above if above else None


def covered(truth: Json, named: Json) -> dict[str, bool]:
    """Return whether the 95 % interval of each parameter holds its true value, where both are known."""
    result = {}
    for name, true in truth["parameters"].items():
        estimate = named.get("parameters", {}).get(name)
        if estimate is None or not true["exact"]:
            continue
        interval = estimate.get("interval")
        if interval is None and estimate.get("std") is not None and estimate.get("value") is not None:
            half = 1.96 * estimate["std"]
            interval = (estimate["value"] - half, estimate["value"] + half)
        if interval is not None and None not in interval:
            result[name] = interval[0] <= true["value"] <= interval[1]
    return result


def errors(truth: Json, named: Json) -> dict[str, float]:
    """Return the relative error of each parameter that is known exactly and not zero."""
    result = {}
    for name, true in truth["parameters"].items():
        value = (named.get("parameters", {}).get(name) or {}).get("value")
        if value is not None and true["exact"] and true["value"]:
            result[name] = value / true["value"] - 1.0
    return result


def detectable(truth: Json, limits: list[Json]) -> bool:
    """Whether an effect is twice as large as what the answer says that it would have seen; where it says nothing it is.

    Of an effect that the answer says it would have seen at no size (`at_least` is null) none is large enough.
    """
    size = max((abs(p["value"]) for name, p in truth["parameters"].items() if name not in SHAPES), default=math.inf)
    least = [limit["at_least"] for limit in limits if same(truth, limit)]
    seen = [limit for limit in least if limit is not None]
    return bool(seen or not least) and all(size >= SEEN * limit for limit in seen)


def left_open(answer: Json) -> list[str]:
    """Return the channels whose test gap the answer leaves open."""

    def left(channel: Json) -> float | None:
        return channel["calibrated"] if channel.get("after") is None else channel["after"]

    gap = answer.get("gap") or {}
    return [name for name, c in gap.items() if c.get("floor") and (left(c) or 0.0) > OPEN * c["floor"]]


def names(truth: Json, named: list[Json]) -> Json:
    """Count names one by one: those that are decided, those that are right, and hidden effects that were found.

    A name that is not decided is one question: it is answered where the true effect is among those stated. A name of the one trial in
    which a handle or a sensor slips is neither right nor wrong.
    """
    hidden, slip = truth["effects"], truth.get("slip") or {}
    others = {id(effect): effect.get("alternatives") or [] for effect in named}
    right = matched(hidden, named)
    taken, found = [id(n) for _, n in right], [t for t, _ in right]
    counted = [n for n in named if id(n) in taken or slip.get("trial") is None or n.get("trial") != slip["trial"]]
    asked = [n for n in counted if n.get("decided") is False]
    answered = 0
    for effect in asked:
        truths = [t for t in hidden if (t not in found and any(same(t, other) for other in others[id(effect)])) or same(t, effect)]
        found += [t for t in truths[:1] if t not in found]
        answered += bool(truths)
    decided = [n for n in counted if n.get("decided") is not False]
    return {
        "decided": len(decided),
        "decided_right": sum(id(n) in taken for n in decided),
        "undecided": len(asked),
        "undecided_stated": answered,
        "found": [label(t) for t in found],
    }


def slip_told(truth: Json, named: list[Json]) -> bool | None:
    """Return whether a slip of the handle or of a sensor is named as such, in its trial and near its time; None where nothing slips."""
    slip = truth.get("slip") or {}
    if "what" not in slip:
        return None
    kind = {"handle": "handle_slip", "angle": "angle_offset"}[slip["what"]]
    own = [n for n in named if n.get("trial") == slip["trial"] and n["kind"] == kind and n["joint"] == slip.get("joint")]
    return any(abs(n["span"][0] - slip["start_s"]) < SLIP_TIME for n in own)


def judge(truth: Json, answer: Json) -> Json:
    """Return how an answer of `armrs gap` compares with the truth."""
    hidden, named = truth["effects"], answer["effects"]
    pairs = matched(hidden, named)
    stated = named + [other for effect in named for other in effect.get("alternatives") or []]
    limits = answer.get("would_have_seen") or []
    return {
        "names": names(truth, named),
        "slip_told": slip_told(truth, named),
        "detectable": [label(t) for t in hidden if detectable(t, limits)],
        "open": left_open(answer),
        "verdict": answer["verdict"],
        "named": [label(effect) for effect in named],
        "alternatives": [label(effect) for effect in stated[len(named) :]],
        "detected": answer["verdict"] != "nothing_missing",
        "right": len(pairs) == len(hidden) == len(named),
        "among_alternatives": all(any(same(effect, other) for other in stated) for effect in hidden),
        "missed": len(hidden) - len(pairs),
        "spurious": len(named) - len(pairs),
        "closure": closure(answer.get("gap") or {}),
        "covered": {f"{label(t)} {name}": held for t, n in pairs for name, held in covered(t, n).items()},
        "errors": {f"{label(t)} {name}": error for t, n in pairs for name, error in errors(t, n).items()},
    }


def as_in_file(truth: Json, force_on: str | None) -> Json:
    """Return the truth with biases and drifts of the force as the file's own channels show them.

    The world counts them as of the force on the arm; `armrs gap` reports the channel of the data set.
    """
    if force_on != "robot":
        return truth
    effects = []
    for effect in truth["effects"]:
        if effect["kind"] in ("force_bias", "force_drift"):
            turned = {name: {**p, "value": -p["value"]} for name, p in effect["parameters"].items()}
            effect = {**effect, "parameters": turned}
        effects.append(effect)
    return {**truth, "effects": effects}


def force_on(folder: Path) -> str | None:
    """Return what the forces of a data set act on."""
    path = folder / "data" / "dataset.toml"
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    found = re.search(r'^force_on *= *"(\w+)"', text, flags=re.M)
    return found[1] if found else None


def record(folder: Path) -> Json:
    """Return the line of a session: what was hidden, what was reported, how that compares."""
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    truth = as_in_file(truth, force_on(folder))
    line = {
        "session": folder.name,
        "world": truth.get("world", "rapier"),
        **{key: truth.get(key) for key in ("seed", "family", "strength", "null", "joints", "friction")},
        "memory": truth["noise"]["memory"],
        "hidden": [label(effect) for effect in truth["effects"]],
    }
    outcome = json.loads((folder / "outcome.json").read_text(encoding="utf-8"))
    line |= outcome
    if outcome["error"] is None:
        answer = json.loads((folder / "gap.json").read_text(encoding="utf-8"))
        try:
            line |= judge(truth, answer)
        except (KeyError, TypeError, AttributeError) as wrong:
            line["error"] = f"gap.json is not what it should be: {type(wrong).__name__} {wrong}"
    return line


# ---- running


def workflow(folder: Path, timeout: float) -> Json:
    """Run the command on the data of a session and return its time and what went wrong, if anything did."""
    answer = folder / "gap.json"
    answer.unlink(missing_ok=True)
    command = [sys.executable, "-m", "armrs", "gap", str(folder / "data"), "--json", str(answer)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    begin = time.monotonic()
    error = None
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=timeout, env=environment, check=False)
        # Status 1 is an answer too: something was found.
        if done.returncode not in (0, 1) or not answer.is_file():
            last = (done.stderr.strip().splitlines() or ["no message"])[-1]
            error = f"status {done.returncode}: {last}"
    except subprocess.TimeoutExpired:
        error = f"not done after {timeout:g} s"
    return {"seconds": round(time.monotonic() - begin, 2), "error": error}


def run_all(folders: list[Path], jobs: int, timeout: float, again: bool) -> None:
    """Run the workflow where there is no outcome yet."""

    def one(folder: Path) -> None:
        outcome = json.dumps(workflow(folder, timeout))
        (folder / "outcome.json").write_text(outcome + "\n", encoding="utf-8")

    left = [f for f in folders if again or not (f / "outcome.json").is_file()]
    # The pool of processes: every thread waits for one.
    with ThreadPoolExecutor(jobs) as pool:
        waiting = [pool.submit(one, folder) for folder in left]
        for count, job in enumerate(as_completed(waiting), start=1):
            job.result()
            if sys.stderr.isatty():
                print(f"\r{count} of {len(left)} sessions", end="", file=sys.stderr, flush=True)
    if left and sys.stderr.isatty():
        print(file=sys.stderr)


# ---- tables


def table(head: list[str], rows: Iterable[list[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def share(lines: list[Json], holds: Callable[[Json], bool]) -> str:
    """Return `95 % (19/20)`; what failed does not hold."""
    if not lines:
        return "–"
    count = sum(line["error"] is None and bool(holds(line)) for line in lines)
    return f"{100 * count / len(lines):.0f} % ({count}/{len(lines)})"


def median(values: list[float]) -> float:
    """Return the middle value."""
    ordered = sorted(values)
    half = len(ordered) // 2
    return ordered[half] if len(ordered) % 2 else 0.5 * (ordered[half - 1] + ordered[half])


def closures(lines: list[Json]) -> list[float]:
    """Return what was closed where the naming is right and there was something to close."""
    return [line["closure"] for line in lines if line["error"] is None and line["right"] and line["closure"] is not None]


def overview(lines: list[Json]) -> str:
    """Return a row for each family and strength."""
    groups = [
        ("null", lambda r: r["family"] == "null"),
        ("single, strong", lambda r: r["family"] == "single" and r["strength"] == "strong"),
        ("single, medium", lambda r: r["family"] == "single" and r["strength"] == "medium"),
        ("two, strong", lambda r: r["family"] == "double"),
        ("three, strong", lambda r: r["family"] == "triple"),
        ("outside the catalogue", lambda r: r["family"] == "outside"),
        ("little known", lambda r: r["family"] == "little_known"),
    ]
    rows = []
    for name, belongs in groups:
        some = [line for line in lines if belongs(line)]
        if not some:
            continue
        closed = closures(some) if name not in ("null", "outside the catalogue") else []
        held = [h for line in some if line["error"] is None for h in line["covered"].values()]
        rows.append(
            [
                name,
                str(len(some)),
                share(some, lambda r: r["detected"]),
                "–" if name.startswith(("null", "outside")) else share(some, lambda r: r["right"]),
                "–" if name.startswith(("null", "outside")) else share(some, lambda r: r["among_alternatives"]),
                share(some, lambda r: r["spurious"] > 0),
                share(some, lambda r: r["verdict"] == "unexplained"),
                f"{100 * median(closed):.0f} %" if closed else "–",
                f"{100 * sum(held) / len(held):.0f} % ({len(held)})" if held else "–",
                f"{median([line['seconds'] for line in some]):.0f} s",
                str(sum(line["error"] is not None for line in some)),
            ]
        )
    head = ["sessions", "number", "something found", "named, nothing else", "true ones among alternatives", "something wrong named"]
    head += ["“unexplained”", "gap closed (median)", "95 % interval holds", "time (median)", "failed"]
    return table(head, rows)


def answered(lines: list[Json]) -> list[Json]:
    """Return the sessions that have an answer."""
    return [line for line in lines if line["error"] is None]


def part(count: int, of: int) -> str:
    """Return `95 % (19/20)`."""
    return f"{100 * count / of:.0f} % ({count}/{of})" if of else "–"


def counted(lines: list[Json]) -> dict[str, tuple[int, int]]:
    """Return what is counted name by name, each as so many of so many.

    What has no answer has no names, and its effects are not found.
    """
    some = answered(lines)
    each = [line["names"] for line in some]
    seen = [(e, line) for line in some for e in line["detectable"]]
    held = [h for line in some for h in line["covered"].values()]
    silent = [line for line in some if line["verdict"] in ("explained", "nothing_missing")]
    closed = [
        line["closure"] for line in some if line["names"]["decided"] == line["names"]["decided_right"] and line["closure"] is not None
    ]
    slips = [line["slip_told"] for line in some if line["slip_told"] is not None]
    lost = sum(len(line["hidden"]) for line in lines if line["error"] is not None)
    return {
        "names right": (sum(n["decided_right"] for n in each), sum(n["decided"] for n in each)),
        "true one stated where undecided": (sum(n["undecided_stated"] for n in each), sum(n["undecided"] for n in each)),
        "found of those twice the limit": (sum(e in line["names"]["found"] for e, line in seen), len(seen) + lost),
        "found of all": (sum(len(n["found"]) for n in each), sum(len(line["hidden"]) for line in lines)),
        "95 % interval holds": (sum(held), len(held)),
        "“explained” or “nothing missing” above an open gap": (sum(bool(line["open"]) for line in silent), len(silent)),
        "gap closed by 90 % where no name is wrong": (sum(c >= CLOSED for c in closed), len(closed)),
        "slip named, with its trial and time": (sum(s is True for s in slips), len(slips)),
        "answered": (len(some), len(lines)),
    }


def name_by_name(lines: list[Json]) -> str:
    """Return names counted one by one, a column for the prepared and the little-known arms of each world."""
    groups = {
        f"{kind}, {world}": [line for line in lines if line["world"] == world and (line["family"] == "little_known") == little]
        for world in dict.fromkeys(line["world"] for line in lines)
        for kind, little in (("prepared", False), ("little known", True))
    }
    groups = {name: some for name, some in groups.items() if some}
    columns = [counted(some) for some in groups.values()]
    rows = [[what, *(part(*column[what]) for column in columns)] for what in columns[0]] if columns else []
    rows.append(["time, median and longest", *(longest(some) for some in groups.values())])
    return table(["counted name by name", *groups], rows)


def longest(lines: list[Json]) -> str:
    """Return the median time and the longest."""
    seconds = [line["seconds"] for line in lines]
    return f"{median(seconds):.0f} s, {max(seconds):.0f} s"


def by_kind(lines: list[Json]) -> str:
    """Return a row for each kind that was hidden alone, and for each kind of null."""
    rows = []
    single = [line for line in lines if line["family"] in ("single", "outside")]
    for kind in dict.fromkeys(line["hidden"][0].split()[0] for line in single):
        cells = [kind]
        for strength in ("strong", "medium", None):
            some = [line for line in single if line["hidden"][0].split()[0] == kind and line["strength"] == strength]
            cells.append(share(some, (lambda r: r["verdict"] == "unexplained") if strength is None else lambda r: r["right"]))
        mine = [line for line in single if line["hidden"][0].split()[0] == kind and line["error"] is None]
        cells.append(share(mine, lambda r: r["among_alternatives"]))
        wrong = [abs(e) for line in mine for e in line["errors"].values()]
        cells.append(f"{100 * median(wrong):.1f} %" if wrong else "–")
        held = [h for line in mine for h in line["covered"].values()]
        cells.append(f"{sum(held)}/{len(held)}" if held else "–")
        rows.append(cells)
    head = [
        "hidden alone",
        "named, strong",
        "named, medium",
        "“unexplained” (outside)",
        "among alternatives",
        "error (median)",
        "interval holds",
    ]
    nulls = [line for line in lines if line["family"] == "null"]
    kinds = dict.fromkeys(line["null"] for line in nulls)
    some_null = [[k, share([r for r in nulls if r["null"] == k], lambda r: r["detected"])] for k in kinds]
    return table(head, rows) + "\n\n" + table(["null", "false alarms"], some_null)


def fine(line: Json) -> bool:
    """Whether an answer is what it should be."""
    if line["family"] == "outside":
        return bool(line["verdict"] == "unexplained")
    return bool(line["right"] and (line["hidden"] or not line["detected"]))


def confusions(lines: list[Json]) -> str:
    """Return what was reported where the naming is not right, most frequent first, with the sessions."""
    said: Counter[tuple[str, str]] = Counter()
    where: dict[tuple[str, str], list[str]] = {}
    for line in lines:
        if line["error"] is not None:
            answer = f"failed: {line['error']}"
        elif fine(line):
            continue
        else:
            answer = " + ".join(line["named"]) or line["verdict"]
        key = (" + ".join(line["hidden"]) or "nothing", answer)
        said[key] += 1
        where.setdefault(key, []).append(line["session"])
    rows = [[truth, answer, str(count), " ".join(where[truth, answer])] for (truth, answer), count in said.most_common()]
    return table(["hidden", "said", "number", "sessions"], rows) if rows else "Nothing was confused."


def criteria(lines: list[Json]) -> list[tuple[str, str, bool | None]]:
    """Return what is required, what was found, and whether that holds (None where there are no data)."""

    def ratio(some: list[Json], holds: Callable[[Json], bool]) -> float:
        return sum(line["error"] is None and bool(holds(line)) for line in some) / len(some) if some else math.nan

    def family(*names: str, strength: str | None = None) -> list[Json]:
        return [r for r in lines if r["family"] in names and (strength is None or r["strength"] == strength)]

    def named(line: Json) -> Any:
        return line["right"]

    closed = closures(family("single", "double", "triple"))
    held = [h for r in family("single", "double", "triple") if r["error"] is None for h in r["covered"].values()]
    little, every = counted(family("little_known")), counted(lines)

    def of(count: tuple[int, int]) -> float:
        return count[0] / count[1] if count[1] else math.nan

    asked = [
        ("strong effects named, nothing else: ≥ 95 %", ratio(family("single", strength="strong"), named), 0.95, 1.0),
        ("medium effects named, nothing else: ≥ 90 %", ratio(family("single", strength="medium"), named), 0.90, 1.0),
        ("the true one among those stated: ≥ 98 %", ratio(family("single"), lambda r: r["among_alternatives"]), 0.98, 1.0),
        ("false alarms over nulls: ≤ 2 %", ratio(family("null"), lambda r: r["detected"]), 0.0, 0.02),
        ("outside the catalogue “unexplained”: ≥ 85 %", ratio(family("outside"), lambda r: r["verdict"] == "unexplained"), 0.85, 1.0),
        ("two at once, both named, nothing else: ≥ 90 %", ratio(family("double"), named), 0.90, 1.0),
        ("three at once, all named, nothing else: ≥ 85 %", ratio(family("triple"), named), 0.85, 1.0),
        (
            "gap closed by ≥ 90 % wherever the naming is right: ≥ 95 %",
            sum(c >= CLOSED for c in closed) / len(closed) if closed else math.nan,
            0.95,
            1.0,
        ),
        ("95 % interval holds the parameter: 90 to 98 %", sum(held) / len(held) if held else math.nan, 0.90, 0.98),
        ("little known: names right: ≥ 97 %", of(little["names right"]), 0.97, 1.0),
        ("little known: found of those twice the limit: ≥ 95 %", of(little["found of those twice the limit"]), 0.95, 1.0),
        ("little known: 95 % interval holds the parameter: 90 to 98 %", of(little["95 % interval holds"]), 0.90, 0.98),
        ("the true one stated where undecided: ≥ 98 %", of(every["true one stated where undecided"]), 0.98, 1.0),
        (
            "“explained” or “nothing missing” above an open gap: none",
            of(every["“explained” or “nothing missing” above an open gap"]),
            0.0,
            0.0,
        ),
        ("answered at all: 100 %", ratio(lines, lambda r: True), 1.0, 1.0),
    ]
    return [
        (what, "–" if math.isnan(found) else f"{100 * found:.1f} %", None if math.isnan(found) else least <= found <= most)
        for what, found, least, most in asked
    ]


def report(lines: list[Json]) -> str:
    """Return all tables."""
    marks = {True: "yes", False: "**no**", None: "–"}
    asked = table(["asked for", "found", "holds"], [[what, found, marks[holds]] for what, found, holds in criteria(lines)])
    return "\n\n".join([asked, name_by_name(lines), overview(lines), by_kind(lines), confusions(lines)])


# ---- the command


def sessions(folder: Path) -> list[Path]:
    """Return the sessions that the manifest of a folder lists."""
    path = folder / "manifest.json"
    try:
        manifest = json.loads(path.read_text(encoding="utf-8"))
        return [folder / entry["folder"] for entry in manifest["sessions"]]
    except (OSError, ValueError, KeyError) as wrong:
        raise ValueError(f"{path}: {wrong}") from wrong


def main(arguments: list[str] | None = None) -> int:
    """Run and score."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="+", help="what a world made; several are scored together, with tables in the first")
    parser.add_argument("--jobs", type=int, default=2, help="sessions at a time (2)")
    parser.add_argument("--timeout", type=float, default=600.0, help="of one session [s] (600)")
    parser.add_argument("--again", action="store_true", help="run also what has an answer")
    parser.add_argument("--only-score", action="store_true", help="score the answers that are there")
    options = parser.parse_args(arguments)
    try:
        folders = [session for folder in options.folder for session in sessions(folder)]
    except ValueError as wrong:
        print(wrong, file=sys.stderr)
        return 2
    if not options.only_score:
        run_all(folders, options.jobs, options.timeout, options.again)
    lines = [record(folder) for folder in folders if (folder / "outcome.json").is_file()]
    text = "".join(json.dumps(line) + "\n" for line in lines)
    (options.folder[0] / "scores.jsonl").write_text(text, encoding="utf-8")
    result = report(lines)
    (options.folder[0] / "scores.md").write_text(result + "\n", encoding="utf-8")
    print(result)
    return int(any(holds is False for *_, holds in criteria(lines)))


if __name__ == "__main__":
    raise SystemExit(main())
