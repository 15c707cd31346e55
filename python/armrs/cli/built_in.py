"""The verbs `demo` and `reproduce`, which need no data."""

from __future__ import annotations

from pathlib import Path

import typer

from ..report import console
from .common import JsonFile, OutFolder, command_line, present, writable


def demo(context: typer.Context, out: OutFolder = Path("armrs-demo"), json: JsonFile = None) -> None:
    """Run the whole workflow on built-in data: simulate an experiment, find what the model lacks, show the gap before and after."""
    from ..demo import run_demo
    from ..report import sentences
    from ..report.pages import read_result

    writable(out, json, verb="demo")
    with console.stages("demo") as tell:
        result = run_demo(out, command=command_line(context), tell=tell)
    plain = read_result(out / "demo.json")
    present(lambda: plain, json, lambda: sentences.demo(plain, result.files))


def reproduce(context: typer.Context, out: OutFolder = Path("armrs-thesis"), json: JsonFile = None) -> None:
    """Recompute every table and figure of the thesis that can be recomputed: printed value, result, and why they differ.

    Takes about 40 seconds of one core; what is being computed is shown.
    """
    from ..report import sentences
    from ..thesis import run_reproduce

    writable(out, json, verb="reproduce")
    with console.stages("the thesis") as tell:
        result = run_reproduce(out, command=command_line(context), tell=tell)
    present(lambda: result.data, json, lambda: sentences.reproduced(result.data, result.files))
