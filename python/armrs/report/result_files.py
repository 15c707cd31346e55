"""Results as files: JSON, model, figures and report below one folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..io import files
from ..io.samples import write_pieces
from ..io.trial import Trial
from ..workflows import result_data
from ..workflows.identify import Identified
from ..workflows.passive import PassiveMoments
from ..workflows.plan import Plan, plan_data, write_movements
from ..workflows.record import Recorded
from ..workflows.simulate import Run, Simulated
from . import dataset_pages, figures, interactive, pages, run_animation
from .view import View

if TYPE_CHECKING:
    from ..workflows.courses import History


def history_data(result: History) -> dict[str, Any]:
    """Return a history as a report reads it."""
    data = {"name": result.subject or "a subject without a name", "joints": []}
    return {"verb": "history", **result.to_dict(), "data": data, "made_by": result_data.origin(None)}


IDENTIFIED = View(result_data.identified_data, figures.identified)
SIMULATED = View(
    lambda run: result_data.simulated_data(run, "a simulated run"),
    lambda run, _: figures.simulated(figures.outline(run)),
    run_animation.simulated,
)
PASSIVE = View(result_data.passive_data, lambda result, _: figures.passive(result))
PLANNED = View(plan_data, lambda plan, data: figures.planned(data, plan.model))
HISTORY = View(history_data, lambda _, data: figures.history(data["courses"]))


def write_identified(result: Identified, data: dict[str, Any], folder: Path) -> list[Path]:
    """Write `identified.toml`, `identified.json`, figures and `report.html` below a folder.

    `data` is that of `identified_data`; the list of figures is added to it. Returns the files, the report last.
    """
    name = "identified.toml"
    files.not_an_input([folder / name], [result.dataset.model_path] if result.dataset.model_path else [])
    drawn = figures.draw(figures.identified(result, data)) + figures.draw(figures.history(data.get("history", ())))

    def write(out: Path) -> list[Path]:
        result.model.write(out / name)
        return [out / name, *write_result(out, "identified", data, drawn)]

    return files.write_whole(folder, write)


def write_result(
    folder: Path, stem: str, data: dict[str, Any], drawn: list[figures.Image], shown: interactive.Live = interactive.NOTHING
) -> list[Path]:
    """Write figures and what moves, then the JSON that names them, then the report of all; return the files, the report last."""
    pictures = []
    for item in drawn:
        path = folder / "figures" / f"{item.name}.png"
        files.may_replace(path, ".png")
        with files.replacing(path) as temporary:
            temporary.write_bytes(item.png)
        pictures.append(path)
    data["figures"] = [
        {"file": f"figures/{d.name}.png", "title": d.title, "text": d.text} | ({"section": d.section} if d.section else {}) for d in drawn
    ]
    if shown:
        data["live"] = interactive.write(shown, folder)
        pictures.append(folder / interactive.FILE)
    document, page = folder / f"{stem}.json", folder / "report.html"
    files.write_json(document, data)
    pages.write_report([document], page, maker=data["verb"])
    return [*pictures, document, page]


def simulated_columns(result: Simulated) -> dict[str, np.ndarray]:
    """Return every recorded column by a name that carries its unit."""
    table = {"t_s": result.t}

    def add(form: str, values: np.ndarray | None, names: Sequence[object]) -> None:
        if values is not None:
            table.update({form.format(name): values[:, k] for k, name in enumerate(names)})

    joints, axes, robot = range(1, result.q.shape[1] + 1), "yz", (1, 2)
    columns = result.columns
    for form, key, names in (
        ("q{}_rad", "q", joints),
        ("dq{}_rad_s", "qd", joints),
        ("ddq{}_rad_s2", "qdd", joints),
        ("tip_{}_m", "tip", axes),
        ("handle_{}_m", "handle", axes),
        ("qr{}_rad", "robot_q", robot),
        ("dqr{}_rad_s", "robot_qd", robot),
        ("ddqr{}_rad_s2", "robot_qdd", robot),
        ("force_on_arm_{}_N", "force_on_arm", axes),
    ):
        add(form, columns.get(key), names)
    for key, values in columns.items():
        family, _, part = key.partition(".")
        if family == "torque":
            add(f"{part}{{}}_Nm", values, joints)
        elif family in ("energy", "work"):
            table[f"{key.replace('.', '_')}_J"] = values
    acting = [f"{kind}_joint{index + 1}" for kind, index in columns["effects"]]
    labels = [name if acting.count(name) == 1 else f"{name}_{acting[: k + 1].count(name)}" for k, name in enumerate(acting)]
    add("resisting_{}_Nm", columns.get("resisting"), labels)
    return table


def write_simulated(result: Run, data: dict[str, Any], folder: Path, *, suffix: str = ".csv", trial: Trial | None = None) -> list[Path]:
    """Write all samples, `simulated.json`, a figure and `report.html` below a folder; return the files, the report last."""
    name = f"simulated{suffix}"
    drawn = figures.draw(figures.simulated(figures.outline(result), trial))
    shown = run_animation.simulated(result, trial)
    data["file"] = name

    def write(out: Path) -> list[Path]:
        write_pieces(out / name, (simulated_columns(piece) for piece in result.pieces()))
        return [out / name, *write_result(out, "simulated", data, drawn, shown)]

    return files.write_whole(folder, write)


def write_recorded(result: Recorded, data: dict[str, Any], folder: Path) -> list[Path]:
    """Write `record.json`, figures and `report.html` beside a session of the virtual laboratory; return the files, the report last."""
    drawn = figures.draw(dataset_pages.recorded_figures(result))
    shown = dataset_pages.first_trial(result.dataset)
    return files.write_whole(folder, lambda out: write_result(out, "record", data, drawn, shown))


def write_passive(result: PassiveMoments, data: dict[str, Any], folder: Path) -> list[Path]:
    """Write `passive.json`, figures and `report.html` below a folder; return the files, the report last."""
    drawn = figures.draw(figures.passive(result)) + figures.draw(figures.history(data.get("history", ())))
    return files.write_whole(folder, lambda out: write_result(out, "passive", data, drawn))


def write_planned(result: Plan, data: dict[str, Any], folder: Path) -> list[Path]:
    """Write movement files, `plan.toml`, `plan.json`, a figure and `report.html` below a folder; return the files, the report last."""
    drawn = figures.draw(figures.planned(data, result.model))
    return files.write_whole(folder, lambda out: [*write_movements(result, data, out), *write_result(out, "plan", data, drawn)])
