"""The notebooks run from the first cell to the last, are stored without outputs, say that their data are synthetic, and are linked."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import matplotlib
import pytest

ROOT = Path(__file__).parents[1]
NOTEBOOKS = sorted((ROOT / "examples" / "notebooks").glob("*.ipynb"))


def cells(path: Path, kind: str) -> list[dict[str, Any]]:
    return [cell for cell in json.loads(path.read_text(encoding="utf-8"))["cells"] if cell["cell_type"] == kind]


@pytest.fixture(params=NOTEBOOKS, ids=lambda path: path.stem)
def notebook(request: pytest.FixtureRequest) -> Path:
    return request.param


@pytest.mark.long
def test_it_runs_and_draws(notebook: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a namespace of its own, as plain Python: there are no magics in it, and warnings are errors."""
    matplotlib.use("Agg")
    from matplotlib import pyplot

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(pyplot, "show", lambda: None)
    names: dict[str, Any] = {"__name__": "__main__"}
    try:
        for number, cell in enumerate(cells(notebook, "code"), start=1):
            exec(compile("".join(cell["source"]), f"{notebook.name}, cell {number}", "exec"), names)
        assert pyplot.get_fignums()
        for figure in map(pyplot.figure, pyplot.get_fignums()):
            figure.draw_without_rendering()
    finally:
        pyplot.close("all")


def test_it_is_stored_without_outputs_and_says_what_the_data_are(notebook: Path) -> None:
    document = json.loads(notebook.read_text(encoding="utf-8"))
    assert (document["nbformat"], document["nbformat_minor"]) == (4, 5)
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in cells(notebook, "code"))
    first = "".join(cells(notebook, "markdown")[0]["source"])
    assert first.startswith("# ") and ("data are synthetic" in first or "Everything here is simulated" in first)


def test_the_documents_link_each() -> None:
    assert len(NOTEBOOKS) == 6
    page = (ROOT / "docs" / "notebooks.md").read_text(encoding="utf-8")
    assert all(f"examples/notebooks/{path.name}" in page for path in NOTEBOOKS)
    assert "docs/notebooks.md" in (ROOT / "README.md").read_text(encoding="utf-8")
