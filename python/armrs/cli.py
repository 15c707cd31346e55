"""The command line: `armrs <verb>`.

A verb parses, calls one public function and writes. `main` is the only place that turns errors into lines and exit statuses:
0 done, 1 ran and found something that needs the user, 2 bad input (one line, nothing written).

To add a verb, write a function with `@app.command()`; its docstring is the help. Return 1 for a finding, nothing otherwise.
"""

from __future__ import annotations

import enum
import math
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from . import files
from .errors import ArmrsError, BadInput, one_line, unknown_name

app = typer.Typer(name="armrs", add_completion=False, context_settings={"help_option_names": ["-h", "--help"]})

JsonFile = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="Write the result as JSON; - is standard output.")]
OutFolder = Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Folder to write below; made when it does not exist.")]
Source = Annotated[Path, typer.Argument(metavar="DATASET", help="Folder with dataset.toml, or that file.")]

_STDOUT = Path("-")
# Typer brings its own copy of click in newer versions and uses the package in older ones; this is the class that both raise.
_USAGE: type[Exception] = next(c for c in typer.BadParameter.__mro__ if c.__name__ == "ClickException")


class Format(str, enum.Enum):
    """Formats of trial files."""

    csv = "csv"
    parquet = "parquet"


def present(data: Callable[[], Any], to: Path | None, human: Callable[[], None]) -> None:
    """Give a result to the user: JSON where `--json` says, and words on standard output unless the JSON is there.

    Parameters
    ----------
    data : callable
        Makes the result as plain data; called only when JSON is asked for.
    to : Path or None
        The value of `--json`.
    human : callable
        Prints the result in words.
    """
    if to == _STDOUT:
        sys.stdout.write(files.json_text(data()))
        return
    if to is not None:
        files.write_json(to, data())
    human()


def _version(wanted: bool) -> None:
    if wanted:
        import armrs

        print(f"armrs {armrs.__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and end.")] = False,
) -> None:
    """Find out what an arm is made of, when a robot leads it.

    Simulate the experiment, identify the arm, and name what the model lacks. SI units and radians unless a name says otherwise.

    Exit status: 0 done, 1 found something that needs you, 2 bad input.
    """


@app.command()
def effects(
    kind: Annotated[str | None, typer.Argument(metavar="KIND", help="Only this kind.")] = None,
    json: JsonFile = None,
) -> None:
    """Print the catalogue of effects: where each acts, its formula, its parameters with units and bounds."""
    from .catalogue import catalogue

    known = catalogue()
    if not known:
        raise ArmrsError("the compiled module armrs._armrs is missing: build it with make, or install the wheel")
    if kind is not None and kind not in known:
        raise unknown_name("KIND", kind, known, what="kind of effect")
    chosen = list(known.values()) if kind is None else [known[kind]]

    def data() -> Any:
        import dataclasses

        return {"effects": [dataclasses.asdict(entry) for entry in chosen]}

    def human() -> None:
        for entry in chosen:
            needs = f", needs {entry.address}" if entry.address else ""
            print(f"{entry.kind} ({entry.where}{needs}): {entry.summary}")
            print(f"    {entry.formula}    [{entry.reference}]")
            for p in entry.parameters:
                print(f"    {p.name}: {_range(p.min, p.max)} {p.unit}, default {p.default:g}")
            print()

    present(data, json, human)


@app.command()
def convert(
    source: Annotated[Path, typer.Argument(metavar="SOURCE", help="Data set folder, dataset.toml, or one .csv or .parquet file.")],
    out: OutFolder,
    to: Annotated[Format, typer.Option("--to", help="Format to write.")] = Format.parquet,
    json: JsonFile = None,
) -> None:
    """Convert trial files between CSV and Parquet; every column and every value is kept to the bit."""
    from .conversion import convert as run_conversion

    written = run_conversion(source, out, to=to.value)
    present(lambda: {"files": written}, json, lambda: print("\n".join(os.fspath(path) for path in written)))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    command = typer.main.get_command(app)
    try:
        # Not `command.main`, which turns some errors into exits of its own.
        with command.make_context("armrs", given or ["--help"]) as context:
            result = command.invoke(context)
        sys.stdout.flush()
    except typer.Exit as end:
        return end.exit_code
    except BadInput as error:
        return _refuse(str(error))
    except ArmrsError as error:
        print(f"armrs: {one_line(error)}", file=sys.stderr)
        return 1
    except _USAGE as error:
        return _refuse(f"{_usage_text(error)} (see armrs --help)")
    except (KeyboardInterrupt, typer.Abort):
        print("armrs: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The reader of our output has seen enough. Standard output is turned away, or its last flush would complain.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return result if isinstance(result, int) else 0


def run() -> None:
    """Entry point of the command `armrs`."""
    sys.exit(main())


def _refuse(line: str) -> int:
    print(f"armrs: {one_line(line)}", file=sys.stderr)
    return 2


def _usage_text(error: Exception) -> str:
    text: str = getattr(error, "format_message", error.__str__)()
    return text.rstrip(".")


def _range(low: float, high: float) -> str:
    if math.isinf(low) and math.isinf(high):
        return "any"
    if math.isinf(high):
        return f">= {low:g}"
    return f"<= {high:g}" if math.isinf(low) else f"{low:g} to {high:g}"
