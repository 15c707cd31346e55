"""What every class of results must do, and the list of these classes, read off the package."""

from __future__ import annotations

import importlib
import inspect
import json
import pkgutil
import re
import typing
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

import armrs
from armrs import cosim, online
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


def check(result: Tabular, folder: Path) -> None:
    """Assert that a result shows itself in one line and in a notebook, and is a data frame, JSON, a figure, a page, labelled arrays."""
    import pandas as pd

    one_line = repr(result)
    assert len(one_line) < 500 and "\n" not in one_line and " at 0x" not in one_line
    assert not re.search(r"\d[\d.]{9,}", one_line.replace(str(folder), "")), one_line
    shown = result._repr_html_()
    assert 100 < len(shown) < 20_000 and shown.count("<tr>") == 1 + min(30, result.tidy().n_rows)
    frame = result.to_dataframe()
    assert len(frame) == result.tidy().n_rows and set(frame.attrs["units"]) <= set(frame.columns)
    pd.testing.assert_frame_equal(pd.DataFrame(result, columns=frame.columns), frame, check_dtype=False)
    assert isinstance(json.loads(result.to_json(folder / "result.json")), dict)
    assert json.loads((folder / "result.json").read_text(encoding="utf-8")) == json.loads(result.to_json())
    axes = result.plot()
    assert len(axes) > 0 and all(isinstance(ax, Axes) for ax in axes)
    page = result.report(folder / "page.html").read_text(encoding="utf-8")
    assert re.search(r"<h1>([\w-]+)", page)[1] in {kind.title.split()[0] for kind in pages.KINDS.values()}  # type: ignore[index]
    if isinstance(result, Series):
        check_series(result)


def check_series(held: Series) -> None:
    """Assert that labelled arrays have names for all dimensions, and that time and what is not named in its channel has a unit."""
    labelled = held.to_xarray()
    assert labelled["time"].attrs["units"] == "s" and "time" in {*labelled.dims, *labelled.data_vars}
    for name, values in labelled.data_vars.items():
        assert "units" in values.attrs, name
        assert values.dtype.kind != "f" or np.isfinite(values).any(), name
