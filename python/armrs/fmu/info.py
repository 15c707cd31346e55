"""The description of an FMU, as plain data and as text."""

from __future__ import annotations

import os
from typing import Any

from ..report import console
from .archive import archive
from .description import read_description

_NUMBERS = ("maxOutputDerivativeOrder", "fixedInternalStepSize", "recommendedIntermediateInputSmoothness")
"""Capabilities that are no truth values."""


def about(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the description of an FMU, as it is written to JSON."""
    description = read_description(path)
    with archive(path) as files:
        platforms = sorted({name.split("/")[1] for name in files.namelist() if name.startswith("binaries/") and name.count("/") > 1})
    keys = ("name", "causality", "variability", "type", "unit", "start", "min", "max", "description")
    return {
        "verb": "fmu info",
        "file": os.fspath(path),
        "fmi_version": description.version,
        "model": description.model_name,
        "description": description.text,
        "tool": description.tool,
        "token": description.token,
        "interfaces": list(description.interfaces),
        "platforms": platforms,
        "capabilities": {key: _flag(key, value) for key, value in description.flags.items() if key != "modelIdentifier"},
        "experiment": description.experiment,
        "variables": [{key: getattr(v, key) for key in keys} for v in description.variables],
    }


def _flag(key: str, value: str) -> str:
    """Return a capability as it is written by most: XML also has 1 and 0 for truth values."""
    return value if key in _NUMBERS else {"1": "true", "0": "false"}.get(value.strip(), value)


def info_words(data: dict[str, Any]) -> None:
    """Print what `about` returns."""
    lines = {
        "model": data["model"],
        "FMI": data["fmi_version"],
        "made by": data["tool"] or "unknown",
        "token": data["token"],
        "offers": ", ".join(data["interfaces"]),
        "machines": ", ".join(data["platforms"]) or "none",
        **data["capabilities"],
    }
    width = max(map(len, lines))
    for name, value in lines.items():
        print(f"{name.ljust(width)}  {value}")
    if data["description"]:
        print(f"\n{data['description']}")
    print()
    rows = [(v["name"], v["causality"], v["unit"] or "-", _start(v["start"])) for v in data["variables"]]
    console.table(("variable", "causality", "unit", "start"), rows, left=4)


def _start(value: Any) -> str:
    """Return a start value as it is written in TOML; the values of an array with spaces between them."""
    if isinstance(value, tuple):
        return " ".join(map(_start, value))
    return "-" if value is None else str(value).lower() if isinstance(value, bool) else str(value)
