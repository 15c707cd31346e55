"""Figures and files of `spasticity` and `cohort`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..io import files
from ..workflows import result_data
from . import figures, plotting
from .clinic_norms import norms_of
from .figures import Drawn, Figures
from .result_files import write_result
from .view import View

if TYPE_CHECKING:
    from ..workflows.cohort import Cohort
    from ..workflows.spasticity import JointReflex, Spasticity

MOST_QUANTITIES = 12
"""Quantities of a cohort that are drawn."""


def spasticity_data(result: Spasticity, command: str | None = None) -> dict[str, Any]:
    """Return reflexes as they are written to JSON."""
    return {
        "verb": "spasticity",
        "data": result_data.data_of(result.dataset),
        **result.to_dict(),
        "level": result.level,
        "made_by": result_data.origin(command),
    }


def cohort_data(result: Cohort, command: str | None = None) -> dict[str, Any]:
    """Return a cohort as it is written to JSON."""
    return {"verb": "cohort", "data": {"name": result.name}, **result.to_dict(), "made_by": result_data.origin(command)}


def spasticity_figures(result: Spasticity) -> Figures:
    """Return the figures of reflexes, one a joint."""
    names = [joint.name for joint in result.dataset.model.joints]
    arm = partial(figures.arm, result.dataset.model, result.dataset.trials, [_reflex(j, names[j.joint - 1]) for j in result.joints])
    return {"arm": arm} | {f"stretches-{j.joint}": partial(_stretches, result, j, names[j.joint - 1]) for j in result.joints}


def _reflex(found: JointReflex, name: str) -> tuple[int, str]:
    """Return the number of a joint, and what was found of its reflex."""
    if not found.reflex.found:
        return found.joint, f"{name}: no stretch reflex was detected"
    return found.joint, f"{name}: stretch reflex from {np.degrees(found.reflex.parameters['threshold'].value):.3g} °/s on"


def _stretches(result: Spasticity, found: JointReflex, name: str) -> Drawn:
    """Draw peak moments against speed with what they are made of, and where the reflex begins."""
    figure = plotting.figure(8.6, 3.6)
    left, right = figure.subplots(1, 2)
    degrees = 180.0 / np.pi
    speed = degrees * np.array([s.speed for s in found.stretches])
    for part, label, colour in (
        ("elastic", "elastic", plotting.GREEN),
        ("resisting", "viscous and dry", plotting.GREY),
        ("reflex", "reflex", plotting.RED),
    ):
        left.plot(speed, [getattr(s, part) for s in found.stretches], "o", color=colour, ms=5, clip_on=False, label=label)
    left.plot(
        speed, [s.peak_moment for s in found.stretches], "D", color=plotting.BLUE, ms=6, mfc="none", clip_on=False, label="peak, measured"
    )
    left.set(xlabel="speed of the stretch [°/s]", ylabel="largest moment [N m]", title="What resists")
    left.set_ylim(bottom=0.0)
    left.legend(fontsize="small")
    caught = [s for s in found.stretches if np.isfinite(s.catch_angle)]
    right.plot(
        [degrees * s.catch_angle for s in caught],
        [degrees * s.catch_speed for s in caught],
        "o",
        color=plotting.RED,
        label="onset of the reflex",
    )
    if found.reflex.found:
        threshold = found.reflex.parameters["threshold"]
        right.axhline(degrees * threshold.value, color=plotting.INK, lw=1.2, label="threshold")
        right.axhspan(*(degrees * x for x in threshold.interval), color=plotting.FAINT, zorder=0)
    right.set(xlabel="angle [°]", ylabel="speed [°/s]", title="Where the reflex begins")
    right.set_ylim(bottom=0.0)
    if right.get_legend_handles_labels()[0]:
        right.legend(fontsize="small")
    text = (
        "One point per stretch. Left: its largest moment, and the largest of each part of the fitted law. Right: angle and speed "
        "at the onset of the reflex, where it reaches a tenth of its largest moment. The line is the threshold of the reflex, grey its "
        "interval. With a latency, points lie off the line, because the speed changes before the reflex acts."
    )
    return Drawn(f"stretches-{found.joint}", f"Stretches of {name}", text, figure)


def cohort_figures(result: Cohort) -> Figures:
    """Return the figure of a cohort."""
    return {"cohort": partial(_cohort, result)} if result.quantities else {}


def _cohort(result: Cohort) -> Drawn:
    """Draw every quantity: subjects by group, norm bands behind."""
    names = list(dict.fromkeys(q.name for q in result.quantities))[:MOST_QUANTITIES]
    rows, columns = plotting.grid(len(names))
    figure = plotting.figure(3.3 * columns, 2.6 * rows)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for ax, name in zip(axes, names, strict=False):
        own = [q for q in result.quantities if q.name == name]
        for place, q in enumerate(own):
            ax.add_patch(_band(place, q.norm))
            values = np.array(result.values_of(q))
            ax.plot(place + np.linspace(-0.22, 0.22, len(values)), values, "o", ms=3.5, color=plotting.BLUE)
            ax.hlines(q.mean, place - 0.34, place + 0.34, color=plotting.INK, lw=1.6)
        ax.set_xticks(range(len(own)), ["\n".join(filter(None, (q.group, q.side))) for q in own])
        ax.set(title=name, ylabel=own[0].unit, xlim=(-0.6, len(own) - 0.4))
        ax.title.set_fontsize("small")
        ax.autoscale_view(scalex=False)
        ax.grid(visible=False, axis="x")
    for ax in axes[len(names) :]:
        ax.remove()
    text = "One point per session; the line is the mean, the grey band holds 95 of 100 sessions of other subjects of the group and side."
    return Drawn("cohort", "The cohort", text, figure)


def _band(place: float, norm: tuple[float, float]) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((place - 0.34, norm[0]), 0.68, norm[1] - norm[0], color=plotting.FAINT, zorder=0)


def write_spasticity(result: Spasticity, data: dict[str, Any], folder: Path) -> list[Path]:
    """Write `spasticity.json`, figures and `report.html` below a folder; return the files, the report last."""
    drawn = figures.draw(spasticity_figures(result)) + figures.draw(figures.history(data.get("history", ())))
    return files.write_whole(folder, lambda out: write_result(out, "spasticity", data, drawn))


def write_cohort(result: Cohort, data: dict[str, Any], folder: Path) -> list[Path]:
    """Write `cohort.json`, `cohort.csv` (tidy, one value a row), `norms.toml`, a figure and `report.html` below a folder.

    Returns the files. Norm bands of several groups are in a file each.
    """
    drawn = figures.draw(cohort_figures(result))
    norms = norms_of(result)

    def write(out: Path) -> list[Path]:
        result.write_table(out / "cohort.csv")
        for name, text in norms.items():
            files.write_text(out / name, text, kind=".toml")
        return [out / "cohort.csv", *(out / name for name in norms), *write_result(out, "cohort", data, drawn)]

    return files.write_whole(folder, write)


def _spasticity_view(result: Spasticity, _: Mapping[str, Any]) -> Figures:
    return spasticity_figures(result)


def _cohort_view(result: Cohort, _: Mapping[str, Any]) -> Figures:
    return cohort_figures(result)


SPASTICITY = View(spasticity_data, _spasticity_view)
COHORT = View(cohort_data, _cohort_view)
__all__: Sequence[str] = ("COHORT", "SPASTICITY", "cohort_data", "spasticity_data", "write_cohort", "write_spasticity")
