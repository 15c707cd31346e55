"""A sweep as plain data and as files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..io import files
from ..report.figures import draw
from ..report.result_files import write_result
from ..report.view import View
from ..workflows.result_data import origin
from . import figures
from .store import KINDS, Store
from .summary import Summary, summarise
from .sweep_file import Sweep
from .variation import Vary


def sweep_data(sweep: Sweep, summary: Summary, command: str | None = None) -> dict[str, Any]:
    """Return the summary as it is written to JSON; but for the command the same on every run."""
    question = sweep.question
    model = sweep.dataset.model if sweep.dataset is not None else sweep.experiment(sweep.seed_of(1), []).truth
    synthetic = sweep.dataset is None or sweep.dataset.synthetic
    level = 0.95 if question is None else question.level
    return {
        "verb": "sweep",
        "data": {"name": sweep.name, "synthetic": synthetic, "joints": [joint.name for joint in model.joints]},
        "seed": sweep.seed,
        "source": "experiment" if sweep.dataset is None else "dataset",
        "identified": question is not None,
        "level": level,
        **summary.cases,
        "vary": [_varied(v) for v in sweep.vary],
        "quantities": [q.to_dict(level) for q in summary.quantities],
        "tables": [f"{kind}.parquet" for kind in KINDS],
        "made_by": origin(command) | {"input_sha256": sweep.digest},
    }


def _varied(vary: Vary) -> dict[str, Any]:
    return {"key": vary.key, vary.kind: list(vary.numbers), "within": vary.within, "apply": vary.apply}


def write_sweep(store: Store, data: dict[str, Any], summary: Summary) -> list[Path]:
    """Write `sweep.json`, figures and `report.html` beside the tables; return all files, the report last."""
    drawn = draw(figures.sweep(summary, data))
    written = files.write_whole(store.folder, lambda out: write_result(out, "sweep", data, drawn))
    return [*(store.final(kind) for kind in KINDS), store.mark, *written]


SWEPT = View(
    lambda swept: swept.data,
    lambda swept, data: figures.sweep(summarise(Store(swept.sweep, swept.cases.parent)), data),
)
