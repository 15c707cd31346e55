"""What every class of results must do, and the list of these classes, read off the package."""

from __future__ import annotations

import importlib
import inspect
import json
import pkgutil
import re
import typing
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes

import armrs
from armrs import cli, cosim, online
from armrs.report import pages
from armrs.tabular import Series, Tabular

NO_RESULTS = {
    "Model", "Movement", "OwnEffect", "Sweep", "Log", "Settings", "Markers", "PlanarMotion", "ExportedModel", "FirmwareSource", "Path",
}  # fmt: skip
"""What public functions return that is an input of others, or files."""


def kinds() -> list[type[Tabular]]:
    """Return every class of results of the package, found in all of its modules."""
    for module in pkgutil.walk_packages(armrs.__path__, "armrs."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    found: set[type[Tabular]] = set()
    left: list[type[Tabular]] = [Tabular]
    while left:
        left += (below := left.pop().__subclasses__())
        found.update(below)
    return sorted(found, key=lambda kind: kind.__name__)


def returned() -> dict[str, type]:
    """Return the classes that public functions return, by the function's name, without lists and inputs of others."""
    found = {}
    for home in (armrs, online, cosim):
        for name in dir(home):
            function = None if name.startswith("_") else getattr(home, name)
            kind = typing.get_type_hints(function).get("return") if inspect.isfunction(function) else None
            if inspect.isclass(kind) and not typing.get_origin(kind) and kind.__name__ not in NO_RESULTS:
                found[name] = kind
    return found


def behind(module: ModuleType, name: str, *arguments: str) -> tuple[int, Any]:
    """Run a command, and return its status and what the function that it calls returned."""
    held: list[Any] = []
    function = getattr(module, name)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, name, lambda *given, **named: held.append(function(*given, **named)) or held[0])
        return cli.main(list(arguments)), held[0]


def faults(result: Tabular, folder: Path) -> list[str]:
    """Return what a result does not do: one line, a notebook, a data frame, JSON, a figure, a page, labelled arrays."""
    import pandas as pd

    one_line, shown, frame, axes = repr(result), result._repr_html_(), result.to_dataframe(), result.plot()
    written, page = result.to_json(folder / "result.json"), result.report(folder / "page.html").read_text(encoding="utf-8")
    rows, title = result.tidy().n_rows, re.search(r"<h1>([\w-]+)", page)
    holds = {
        f"one short line: {one_line}": len(one_line) < 500 and "\n" not in one_line and " at 0x" not in one_line,
        f"no long number: {one_line}": not re.search(r"\d[\d.]{9,}", one_line.replace(str(folder), "")),
        "a table in a notebook": 100 < len(shown) < 20_000 and shown.count("<tr>") == 1 + min(30, rows),
        "a data frame with units": len(frame) == rows and set(frame.attrs["units"]) <= set(frame.columns),
        "the same data frame by pandas": pd.DataFrame(result, columns=frame.columns).astype(frame.dtypes).equals(frame),
        "an object in JSON": isinstance(json.loads(written), dict),
        "the same in a file": json.loads((folder / "result.json").read_text(encoding="utf-8")) == json.loads(written),
        "axes": len(axes) > 0 and all(isinstance(ax, Axes) for ax in axes),
        "a page with the title of its kind": title and title[1] in {kind.title.split()[0] for kind in pages.KINDS.values()},
    }
    return [what for what, done in holds.items() if not done] + (series_faults(result) if isinstance(result, Series) else [])


def series_faults(held: Series) -> list[str]:
    """Return which labelled arrays lack a unit or hold no number, and time where it has none."""
    labelled = held.to_xarray()
    is_timed = labelled["time"].attrs["units"] == "s" and "time" in {*labelled.dims, *labelled.data_vars}
    lacking = [
        str(name)
        for name, values in labelled.data_vars.items()
        if "units" not in values.attrs or (values.dtype.kind == "f" and not np.isfinite(values).any())
    ]
    return lacking if is_timed else ["time", *lacking]
