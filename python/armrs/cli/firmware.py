"""The verb `export-c`."""

from __future__ import annotations

import enum
from pathlib import Path
from typing import Annotated

import typer

from .common import JsonFile, OutFolder, present, writable


class Precision(str, enum.Enum):
    """Numbers that the firmware computes with."""

    single = "single"
    double = "double"


def export_c(
    model: Annotated[Path, typer.Argument(metavar="MODEL", help="model.toml, such as identified.toml")],
    out: OutFolder,
    precision: Annotated[Precision, typer.Option(help="Precision of the library that the firmware links.")] = Precision.double,
    identified: Annotated[
        Path | None, typer.Option("--identified", metavar="FILE", help="JSON of armrs identify, for the covariance.")
    ] = None,
    json: JsonFile = None,
) -> None:
    """Write the arm of a model as C source: segments, effects, covariance, calibration of the sensors, and a self-test.

    Effects that a device cannot apply (of the contact, of the robot, a drift) are refused by name. See docs/firmware.md.
    """
    from ..workflows import firmware as workflow

    folder = writable(out, json)
    source = workflow.export_c(model, precision=precision.value, identified=identified)
    written = source.write(folder or out)
    data = {"verb": "export-c", "files": written, "precision": precision.value, "hash": source.hash, "vectors": len(source.vectors)}
    present(lambda: data, json, lambda: print(*written, sep="\n"))
