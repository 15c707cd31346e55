"""The comparison as tables in Markdown and as plots.

    report.py [RESULT]

puts the tables of a run into docs/performance.md, and keeps the run beside this file, so that a test can repeat the first from the
second. `make bench` writes RESULT to out/bench/result.json; without it, the kept one is taken.
"""

from __future__ import annotations

import json
import statistics
import sys
from pathlib import Path
from typing import Any

import problem
from workloads import GROUPS, JOINTS, MEASURED, Measured

PAGE = Path(__file__).parents[2] / "docs" / "performance.md"
KEPT = Path(__file__).parent / "result.json"
BEGIN, END = "<!-- bench: begin -->\n", "<!-- bench: end -->\n"
TITLES = {
    "W1": "W1: kernels of the arm with three joints, a call",
    "W2": "W2: one run of 20 s, a step",
    "W2a": "W2a: one run of 20 s, every angle right to 1e-6 rad, the whole run",
    "W3": "W3: 1000 runs of 2 s, a step of one run",
    "W3a": "W3a: 1000 runs of 2 s, every angle right to 1e-6 rad, all runs",
    "W4": "W4: the cascade, the whole of it",
    "W6": "W6: six parameters of the joints fitted to 20 s by simulation",
}


def medians(times: dict[str, list[float]]) -> dict[str, float]:
    """Return the median of every measurement."""
    return {key: statistics.median(values) for key, values in times.items()}


def time_of(seconds: float) -> str:
    """Return a time with three digits and the unit that suits it."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


def words(result: dict[str, Any]) -> str:
    """Return the report as Markdown, headings of the third level."""
    middle = medians(result["seconds"])
    rounds = max(len(values) for values in result["seconds"].values())
    versions = result["versions"]
    machine = "; ".join(f"{name} {value}" for name, value in versions.items() if name != "date")
    lines = [
        f"{versions['date']}, {rounds} round{'s' if rounds > 1 else ''}; {machine}.",
        "Medians of processor time, unless a line says wall clock. Each round measures every tool in turn.",
        "",
    ]
    if result["missing"]:
        lines += ["Not measured: " + "; ".join(f"{tool} ({reason})" for tool, reason in result["missing"].items()) + ".", ""]
    lines += ["### Goals", "", "| ratio | found | aimed at | | limit, nothing fused |", "| --- | --- | --- | --- | --- |"]
    for goal in result["goals"]:
        found = "not measured" if goal["found"] is None else f"{goal['found']:.3g}".replace("-", "−")
        mark = {None: "", True: "met", False: "**not met**"}[goal["met"]]
        unfused = "" if goal.get("unfused") is None else f"{goal['unfused']:.3g}"
        lines.append(f"| {goal['what']} | {found} | {'≤' if goal['at_most'] else '≥'} {goal['limit']:g} | {mark} | {unfused} |")
    lines += _imports(middle)
    for workload, title in TITLES.items():
        lines += ["", f"### {title}", "", *_table(workload, result, middle)]
    lines += [
        "",
        "### Do all solve the same problem?",
        "",
        "Each against armrs.",
        "",
        "| what | tool | found | allowed |",
        "| --- | --- | --- | --- |",
    ]
    for check in result["checks"]:
        mark = "" if check["agrees"] else " **no**"
        lines.append(f"| {check['what']} | {check['tool']} | {check['found']:.2g}{mark} | {check['allowed']:.2g} |")
    return "\n".join(lines) + "\n"


def page(result: dict[str, Any], text: str) -> str:
    """Return the page with the tables of a run in place of those between its marks. Only a whole run takes their place."""
    lacking = [f"{tool}: {reason}" for tool, reason in result["missing"].items()]
    lacking += [f"{check['what']} of {check['tool']} does not agree" for check in result["checks"] if not check["agrees"]]
    lacking += [f"{goal['what']}: not measured" for goal in result["goals"] if goal["found"] is None]
    if lacking:
        raise SystemExit(f"report.py: the page takes a whole run: {lacking[0]}" + (f", and {len(lacking) - 1} more" if lacking[1:] else ""))
    before, _, rest = text.partition(BEGIN)
    _, found, after = rest.partition(END)
    if not found:
        raise SystemExit(f"report.py: {PAGE.name}: no tables between {BEGIN.strip()} and {END.strip()}")
    return before + BEGIN + words(result) + END + after


def _table(workload: str, result: dict[str, Any], middle: dict[str, float]) -> list[str]:
    """Return the lines of a workload's table; where a step or tolerance was chosen, with it and the errors."""
    items = [item for item in MEASURED if item.workload == workload and item.key in middle]
    counts, chosen = result.get("instructions", {}), result["accuracy"]
    head = ["what", "tool"]
    if workload in ("W2a", "W3a"):
        head += ["step or tolerance", "error [rad]", "error at the one before"]
    head.append("time")
    if any(item.key in counts for item in items):
        head.append("instructions")
    lines = [f"| {' | '.join(head)} |", "| --- " * len(head) + "|"]
    for item in items:
        cells = {"what": _what(item), "tool": item.tool, "time": time_of(middle[item.key])}
        if item.ladder:
            cells |= _chosen(chosen[item.key])
        if item.key in counts:
            cells["instructions"] = f"{counts[item.key]:.4g}" if counts[item.key] < 1e5 else f"{counts[item.key] / 1e6:.4g} million"
        lines.append(f"| {' | '.join(cells.get(name, '') for name in head)} |")
    return lines


def _what(item: Measured) -> str:
    kernel = item.task.split(":")[0].replace("_", " ") if item.workload == "W1" else ""
    size = ""
    if item.workload == "W4":
        samples = int(item.task.split(":")[-1])
        # Three angles and two components of a force.
        size = f"{samples:,} samples ({40 * samples / 1e6:g} MB)".replace(",", " ")
    return ", ".join(part for part in (kernel, size, item.name) if part)


def _chosen(rung: dict[str, Any]) -> dict[str, str]:
    """Return the cells of what was chosen: steps from one sample at 50 Hz to the next are whole numbers, tolerances are not."""
    text, before = rung["rung"], rung["error_before"]
    step = f"{1e3 * problem.RECORD * problem.STEP / int(text):.3g} ms" if text.isdigit() else text
    return {
        "step or tolerance": step,
        "error [rad]": f"{rung['error']:.2g}",
        "error at the one before": "" if before is None else f"{before:.2g}",
    }


def _imports(middle: dict[str, float]) -> list[str]:
    empty = middle["import/empty"]
    lines = ["", "### W5: import, beyond an empty start of Python", "", "| module | time |", "| --- | --- |"]
    for key, seconds in middle.items():
        if key.startswith("import/") and key != "import/empty":
            lines.append(f"| {key.removeprefix('import/')} | {time_of(max(seconds - empty, 0.0))} |")
    return lines


def plots(result: dict[str, Any], folder: Path) -> None:
    """Write the plots of cost against size."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    middle = medians(result["seconds"])
    series = {
        "SciPy least_squares": "cascade:least_squares:{}/SciPy",
        "SciPy lsq_linear": "cascade:lsq_linear:{}/SciPy",
        "armrs": "cascade:{}/armrs, Rust",
        "one AVX2 pass": "gram:avx2:{}/limit",
    }
    panels = [
        ("cascade", "samples", "Cascade: wrist, elbow, shoulder [s]", series, problem.SIZES),
        ("joints", "joints", "Forward dynamics, a call [s]", {"armrs": "forward_dynamics:joints:{}/armrs, Rust"}, JOINTS),
        ("runs", "runs in a batch", "A step of one run [s]", {"armrs": "batch:runs:{}/armrs, Rust"}, GROUPS),
    ]
    for name, size, title, curves, sizes in panels:
        figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
        for label, key in curves.items():
            points = [(n, middle[key.format(n)]) for n in sizes if key.format(n) in middle]
            if points:
                axes.plot(*zip(*points, strict=True), "o-", label=label)
        axes.set(xlabel=size, ylabel="processor time", title=title)
        if name != "joints":
            axes.set_xscale("log")
        if name == "cascade":
            axes.set_yscale("log")
        else:
            axes.set_ylim(bottom=0)
        axes.legend()
        axes.grid(alpha=0.3)
        figure.savefig(folder / f"{name}.svg")
        plt.close(figure)


def main() -> None:
    """Write the page, and keep the run."""
    text = Path(sys.argv[1] if sys.argv[1:] else KEPT).read_text(encoding="utf-8")
    PAGE.write_text(page(json.loads(text), PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    KEPT.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
