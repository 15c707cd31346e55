"""A coupled run as plain data and as files: JSON, samples, figures, report."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..io import files
from ..io.samples import write_samples
from ..report import figures, plotting, result_files
from ..report.view import View
from ..workflows import result_data
from .coupled_run import RESULTS, CoupledRun


def coupled_data(run: CoupledRun, name: str, command: str | None = None) -> dict[str, Any]:
    """Return what a run came to, as it is written to JSON."""
    system = run.system
    return {
        "verb": "fmu run",
        "data": {"name": name, "synthetic": False},
        "verdict": run.verdict,
        "why": run.why,
        "algorithm": system.algorithm,
        "step_s": system.step,
        "shortest_step_s": system.shortest_step,
        "duration_s": float(run.t[-1]),
        "asked_s": system.duration,
        "samples": len(run.t),
        "steps_of_slaves_a_step": run.evaluations,
        "slaves": [
            {"name": slave.name, "kind": type(slave).__name__, "can_go_back": slave.can_rollback, "inner_step_s": slave.internal_step}
            for slave in system.slaves.values()
        ],
        "connections": [
            {
                "from": ".".join(report.connection.source),
                "to": ".".join(report.connection.target),
                "within": report.connection.within,
                "unit": report.unit,
                "residual_max": report.residual_max,
                "residual_rms": report.residual_rms,
                "energy_exchanged_J": report.energy_exchanged,
                "energy_created_J": report.energy_created,
            }
            for report in run.connections
        ],
        "accuracy": system.accuracy,
        "resolution_s": run.resolution,
        "errors": [
            {"name": e.name, "unit": e.unit, "estimated_error": e.error, "largest_error": e.most, "allowed": e.allowed, "at_s": e.at}
            for e in run.estimates
        ],
        "not_connected": system.unconnected,
        "warnings": list(run.warnings),
        "made_by": result_data.origin(command),
    }


def write_coupled(run: CoupledRun, data: dict[str, Any], folder: Path, *, suffix: str = ".csv") -> list[Path]:
    """Write `coupled.json`, figures, `report.html`, and the samples of a run that is a result below a folder.

    The files are returned, the report last.

    Of a run that is no result only the diagnosis is written: no samples.
    """
    drawn = figures.draw(_figures(run))
    good = run.verdict in RESULTS
    data["file"] = f"coupled{suffix}" if good else None

    def write(out: Path) -> list[Path]:
        written = []
        if good:
            table = samples(run)
            write_samples(out / data["file"], list(table), list(table.values()))
            written.append(out / data["file"])
        return [*written, *result_files.write_result(out, "coupled", data, drawn)]

    return files.write_whole(folder, write)


def samples(run: CoupledRun) -> dict[str, np.ndarray]:
    """Return every output at every communication point, with its unit in the name of the column."""
    table = run.tidy()
    return {f"{name}_{table.units[name]}" if name in table.units else name: np.asarray(values) for name, values in table.columns.items()}


def _figures(run: CoupledRun) -> figures.Figures:
    return {"interface": lambda: _drawn(run)}


COUPLED = View(lambda run: coupled_data(run, "a coupled run"), lambda run, _: _figures(run))


def _drawn(run: CoupledRun) -> figures.Drawn:
    """Draw inputs over time, what they were off, and the energy that the coupling has created."""
    places = run.system.connections
    units = [report.unit for report in run.connections]
    forces = [k for k, unit in enumerate(units) if unit in ("N", "N.m")] or list(range(len(places)))
    with plotting.style():
        figure = plotting.figure(9.2, 7.2)
        held, off, created = figure.subplots(3, 1, sharex=True)
        n = len(run.used)
        for k in forces:
            label = f"{'.'.join(places[k].target)} [{units[k] or '?'}]"
            held.plot(run.t[:n], run.used[:, k], drawstyle="steps-post", label=label)
            off.plot(run.t[1 : n + 1], np.abs(run.residual[:, k]), label=label)
        for k in range(len(places)):
            if places[k].dual is not None:
                created.plot(run.t, run.created[:, k], label=".".join(places[k].target))
        held.set(title="Inputs held in each step", ylabel="value")
        off.set(title="Coupling residual", ylabel="magnitude")
        created.set(title="Energy created by the coupling", ylabel="energy [J]", xlabel="time [s]")
        for ax in (held, off, created):
            if ax.get_legend_handles_labels()[0]:
                ax.legend(loc="best")
    text = (
        "Top: the inputs held in each step. Middle: the coupling residual, by which the held inputs differ from the correct ones; it is "
        "known only after the step. Bottom: the energy created by the coupling, received minus given; if it is large, do not trust the run."
    )
    return figures.Drawn("interface", "Interface", text, figure)
