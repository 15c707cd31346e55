"""The result of the gap workflow as plain data and as files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...catalogue import catalogue
from ...io import files, tomlfile
from ...workflows.gap.gap_result import GapFound
from ...workflows.result_data import data_of, origin
from ..figures import draw, history
from ..result_files import write_result
from ..view import View
from . import figures
from .animation import moving


def gap_data(result: GapFound, command: str | None = None) -> dict[str, Any]:
    """Return the result as it is written to JSON: that of `GapFound.to_dict`, what its effects are, and what it rests on."""
    data = {"verb": "gap", **result.to_dict(), "data": data_of(result.dataset), "made_by": origin(command)}
    for effect in data["effects"]:
        effect |= {"summary": catalogue()[effect["kind"]].summary, "formula": formula_of(effect)}
    for number, alternative in enumerate(_separated(data), start=1):
        alternative["separation"]["file"] = f"separating-{number}.toml"
    data["made_by"] |= {"input_sha256": result.dataset.digest(), "random_numbers": "none"}
    return data


def formula_of(effect: Mapping[str, Any]) -> str:
    """Return the formula of an effect's law; friction that is not smoothed has the sign of the speed."""
    kind = catalogue()[effect["kind"]]
    formula = kind.formula
    for smoothing in (p.name for p in kind.parameters if p.or_zero):
        if effect["parameters"].get(smoothing, {}).get("value") == 0.0:
            formula = formula.replace(f"tanh(q̇/{smoothing})", "sgn(q̇)")
    return formula


def _separated(data: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the alternatives that a movement was found for."""
    return [a for e in data["effects"] for a in e["alternatives"] if a["separation"] is not None]


def _write_movement(separation: Mapping[str, Any], folder: Path) -> Path:
    """Write a movement as a file for `armrs simulate`."""
    table = {key: separation[key] for key in ("waypoints_deg", "speed_rad_s", "acceleration_rad_s2", "shape")}
    table["waypoints_deg"] = [list(row) for row in table["waypoints_deg"]]
    path = folder / str(separation["file"])
    files.write_text(path, "\n".join(["[movement]", *tomlfile.lines(table), ""]), kind=".toml")
    return path


def write_gap(result: GapFound, data: dict[str, Any], folder: Path) -> list[Path]:
    """Write `amended.toml`, movements that separate alternatives, `gap.json`, figures and `report.html` below a folder.

    Returns the files, the report last.

    `data` is that of `gap_data`; the list of figures is added to it.
    """
    name = "amended.toml"
    files.not_an_input([folder / name], [result.dataset.model_path] if result.dataset.model_path else [])
    drawn = draw(figures.gap(result)) + draw(history(data.get("history", ())))
    shown = moving(result)

    def write(out: Path) -> list[Path]:
        result.model.write(out / name)
        movements = [_write_movement(a["separation"], out) for a in _separated(data)]
        return [out / name, *movements, *write_result(out, "gap", data, drawn, shown)]

    return files.write_whole(folder, write)


GAP = View(gap_data, lambda result, _: figures.gap(result), moving)
