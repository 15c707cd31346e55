"""Sentences and tables of a sweep, for terminal and report. They read the plain data of `sweep.json`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from .. import formatting
from ..report import sentences, tables
from ..report.tables import Table

MEANING = (
    "Error is what was found less the truth; claimed is the mean of the standard deviations that the identifications state. Coverage is "
    "the share of intervals that hold the truth, with what chance makes of it (one standard deviation). By data is the share of cases in "
    "which the measurement determined the value."
)


_ROUNDING = 1e-12
"""Part of a value below which its error is that of the arithmetic."""


def verdict(data: Mapping[str, Any]) -> str:
    """Return a sweep in a sentence or two."""
    what = "resamples of a data set" if data["source"] == "dataset" else "cases simulated"
    text = f"{data['cases']} {what}{' and identified' if data['identified'] else ''}."
    if data["failed"]:
        text += f" {data['failed']} of them failed."
    if data["not_sound"]:
        text += f" {data['not_sound']} identifications are not to be trusted; they are in the numbers all the same."
    off = [q for q in data["quantities"] if q["coverage"] is not None and _is_off(q, data["level"])]
    if off:
        text += f" Intervals of {len(off)} of {len(data['quantities'])} quantities hold the truth less often than they promise."
    return text


def recovered(data: Mapping[str, Any]) -> Table:
    """Return what was found of every quantity."""
    rows = []
    for q in data["quantities"]:
        value, error, spread = q["value"], q["error"], q["value"]["std"]
        rows.append(
            [
                tables.label(q),
                tables.where(q, data["data"]["joints"]),
                formatting.unit(q["unit"]),
                q["cases"],
                formatting.number(value["mean"], spread),
                formatting.spread(spread),
                "{} … {}".format(*(formatting.number(v, spread) for v in value["interval"])) if data["source"] == "dataset" else None,
                _error(error["mean"], value["mean"]),
                _error(error["std"], value["mean"]),
                _short(q["claimed_std"]),
                _share(q["coverage"], q["cases"]),
                None if q["bootstrap"] is None else _short(q["bootstrap"]["std"]),
                None if q["bootstrap"] is None else _share(q["bootstrap"]["coverage"], q["cases"]),
                f"{100 * q['decided_by'].get('data', 0) / q['cases']:.0f} %",
            ]
        )
    head = [
        "quantity",
        "where",
        "unit",
        "cases",
        "mean",
        "± spread",
        f"{100 * data['level']:g} % of cases",
        "error",
        "± error",
        "claimed ±",
    ]
    head += ["coverage", "bootstrap ±", "its coverage", "by data"]
    used = [k for k in range(len(head)) if any(row[k] not in (None, "") for row in rows)]
    return Table([head[k] for k in used], [[row[k] for k in used] for row in rows], left=2 if 1 in used else 1, symbols=True)


def varied(data: Mapping[str, Any]) -> Table:
    """Return what was drawn."""
    rows = []
    for item in data["vary"]:
        kind = next(name for name in ("range", "normal", "values") if name in item)
        numbers = item[kind]
        drawn = {
            "range": lambda n=numbers: f"uniform {n[0]:g} to {n[1]:g}",
            "normal": lambda n=numbers: f"normal {n[0]:g} ± {n[1]:g}",
            "values": lambda n=numbers: f"one of {len(n)}",
        }[kind]()
        limits = "" if item["within"] is None else ", within {:g} to {:g}".format(*item["within"])
        rows.append([item["key"], {"replace": "as value", "scale": "as factor", "add": "as addend"}[item["apply"]], drawn + limits])
    return Table(["what", "applied", "drawn"], rows, left=3)


def count_lines(data: Mapping[str, Any]) -> list[str]:
    """Return further remarks on the cases, a line each."""
    force = data["force"]
    lines = []
    if force["peak_mean_N"] is not None:
        spread = "" if force["peak_std_N"] is None else f" ± {force['peak_std_N']:.3g}"
        lines.append(
            f"Largest force on the arm: {force['peak_mean_N']:.3g}{spread} N over the cases, {force['peak_largest_N']:.3g} N in one."
        )
    if data["with_stopped_trials"]:
        lines.append(f"In {data['with_stopped_trials']} cases the supervisor stopped a trial.")
    return lines + [f"{item['cases']} × {item['reason']}" for item in data["reasons"]]


def swept(data: Mapping[str, Any], run: Mapping[str, Any], written: Sequence[Path]) -> None:
    """Print a sweep, what this run of it took, and where its files are."""
    sentences.head(data, verdict(data))
    if data["vary"]:
        sentences.show("What was drawn", varied(data))
    if data["quantities"]:
        sentences.show("What was found", recovered(data))
        print(f"{sentences.SYMBOLS}\n\n{MEANING}\n")
    for line in count_lines(data):
        print(line)
    print(run_line(run))
    sentences.files_written(written)


def run_line(run: Mapping[str, Any]) -> str:
    """Return what a run took."""
    if not run["computed"]:
        return "Nothing was left to compute."
    memory = "" if run["largest_process_MB"] is None else f"; largest process {run['largest_process_MB']:.0f} MB"
    return f"Computed {run['computed']} cases in {run['seconds']:.1f} s, {run['computed'] / run['seconds']:.3g} a second{memory}."


def _is_off(q: Mapping[str, Any], level: float) -> bool:
    """Return whether intervals hold the truth significantly less often than stated."""
    return bool(q["coverage"] < level - 3.0 * (level * (1.0 - level) / q["cases"]) ** 0.5)


def _share(share: float | None, n: int) -> str | None:
    if share is None:
        return None
    return f"{100 * share:.1f} ± {100 * max(share * (1 - share), 1 / (4 * n)) ** 0.5 / n**0.5:.1f} %"


def _error(error: float | None, value: float | None) -> str | None:
    """Return an error; what is rounding beside the value is none."""
    return "0" if error is not None and value and abs(error) < _ROUNDING * abs(value) else _short(error)


def _short(value: float | None) -> str | None:
    return None if value is None else f"{value:.2g}"
