"""Options and output functions that several verbs share."""

from __future__ import annotations

import enum
import os
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import BadInput, Text
from ..io import files


def _named(value: str | Path) -> Path:
    """Return where to write; an empty text, as of a variable of the shell that is not set, is not the current folder."""
    if value == "":
        raise typer.BadParameter("found '', allowed the name of a file or folder; . is the current folder")
    return Path(value)


JsonFile = Annotated[
    Path | None, typer.Option("--json", metavar="FILE", parser=_named, help="Write the result as JSON; - is standard output.")
]
OutFolder = Annotated[Path, typer.Option("-o", "--out", metavar="DIR", parser=_named, help="Output folder; created if it does not exist.")]
MaybeFolder = Annotated[
    Path | None,
    typer.Option("-o", "--out", metavar="DIR", parser=_named, help="Output folder for files and report; created if it does not exist."),
]
OutFile = Annotated[
    Path | None, typer.Option("-o", "--out", metavar="FILE", parser=_named, help="The FMU to write; MODEL.fmu when absent.")
]
ArchiveFile = Annotated[
    Path | None, typer.Option("-o", "--out", metavar="FILE", parser=_named, help="The archive to write; SYSTEM.ssp when absent.")
]
Source = Annotated[Path, typer.Argument(metavar="DATASET", help="Folder with dataset.toml, or that file.")]

_STDOUT = Path("-")


class Format(str, enum.Enum):
    """Formats of trial files."""

    csv = "csv"
    parquet = "parquet"


SamplesFormat = Annotated[Format | None, typer.Option("--to", help="Format of the samples below -o; csv when absent.")]


def samples_suffix(to: Format | None, out: Path | None) -> str:
    """Return the suffix of the file of samples; a format without a folder to write them to is refused."""
    if to is not None and out is None:
        raise BadInput("--to", Text("no -o"), "--to beside -o: samples are written only there")
    return f".{(to or Format.csv).value}"


def present(data: Callable[[], Any], to: Path | None, human: Callable[[], None], step: str | None = None) -> None:
    """Give a result to the user: JSON where `--json` says, and words on standard output unless the JSON is there.

    Parameters
    ----------
    data : callable
        Makes the result as plain data; called only when JSON is asked for.
    to : Path or None
        The value of `--json`.
    human : callable
        Prints the result in words.
    step : str, optional
        What the user may do next; the last line.
    """
    if to == _STDOUT:
        sys.stdout.write(files.json_text(data()))
        return
    if to is not None:
        files.write_json(to, data())
    human()
    if step:
        print(f"Next: {step}")


def quoted(path: Path) -> str:
    """Return a path as a shell takes it."""
    return shlex.quote(str(path))


def writable(out: Path | None, json: Path | None = None, *, verb: str | None = None) -> Path | None:
    """Refuse outputs that cannot be written before any work is done, and a folder with the report of another verb."""
    if json is not None and json != _STDOUT:
        files.may_replace(json, ".json")
        files.must_be_writable(json)
        if out is not None and _is_inside(json, out) and json.suffix != ".json":
            raise BadInput("--json", os.fspath(json), f"a name outside of {out}, where the results go, or a .json file in it")
    if out is None:
        return None
    files.must_be_writable(out)
    folder = files.output_folder(out, "-o")
    if verb is not None:
        files.refuse_page_of_another(folder / "report.html", verb)
    return folder


def _is_inside(path: Path, folder: Path) -> bool:
    return path.resolve().is_relative_to(folder.resolve())


def on_a_terminal() -> bool:
    """Whether somebody is there who can answer a question; scripts are asked nothing."""
    return sys.stdin.isatty() and sys.stderr.isatty()


def command_line(context: typer.Context) -> str:
    """Return the command as it was given, for the origin of a result."""
    return shlex.join(["armrs", *(context.find_root().obj or [])])


def listed(text: str) -> list[str]:
    """Return what stands between commas."""
    return [part.strip() for part in text.split(",") if part.strip()]
