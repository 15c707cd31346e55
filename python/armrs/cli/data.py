"""The verbs `effects`, `convert` and `report`."""

from __future__ import annotations

import enum
import math
import os
from pathlib import Path
from typing import Annotated, Any

import typer

from ..errors import NO_FILE, ArmrsError, BadInput, Text, unknown_name
from ..io import files
from ..report import console
from .common import JsonFile, OutFolder, listed, present, writable


class TableFormat(str, enum.Enum):
    """Formats of tables over time, and of models."""

    csv = "csv"
    parquet = "parquet"
    mot = "mot"
    sto = "sto"
    urdf = "urdf"
    mjcf = "mjcf"
    osim = "osim"
    toml = "toml"


_MODEL_SUFFIX = {"urdf": ".urdf", "mjcf": ".xml", "osim": ".osim", "toml": ".toml"}
"""Formats of models, with the suffix of their files."""


def effects(
    kind: Annotated[str | None, typer.Argument(metavar="KIND", help="Print only this kind.")] = None,
    json: JsonFile = None,
) -> None:
    """Print the catalogue of effects: where each acts, its formula, its parameters with units and bounds."""
    from ..catalogue import catalogue

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
            print(f"{entry.kind} ({entry.where}{needs}): {entry.summary}{'' if entry.searched else '; gap does not search for it'}")
            print(f"    {entry.formula}    [{entry.reference}]")
            for p in entry.parameters:
                print(f"    {p.name}: {'0 or ' if p.or_zero else ''}{_range(p.min, p.max)} {p.unit}, default {p.default:g}")
            print()
        if kind is None:
            searched = sum(entry.searched for entry in chosen)
            print(f"{len(chosen)} effects; armrs gap searches for {searched} of them. The others are for models and armrs identify --with.")

    present(data, json, human)


def convert(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="SOURCE",
            help="Data set folder, dataset.toml, one .csv, .parquet, .mot, .sto, .c3d or .trc file, or a model (.toml, .urdf, .xml).",
        ),
    ],
    out: OutFolder,
    to: Annotated[TableFormat, typer.Option("--to", help="Format to write.")] = TableFormat.parquet,
    points: Annotated[str, typer.Option(metavar="A,B+C,…", help="Markers of the joints, first joint to handle; B+C is the midpoint.")] = "",
    up: Annotated[
        str | None, typer.Option(metavar="AXIS", help="Axis of the markers that points up: z in C3D, y in TRC when absent.")
    ] = None,
    forward: Annotated[
        str | None, typer.Option(metavar="AXIS", help="Axis that points forward; where the arm reaches when absent.")
    ] = None,
    coordinates: Annotated[str, typer.Option(metavar="NAME,…", help="Joint angles of a MOT or STO file, first joint first.")] = "",
    force: Annotated[bool, typer.Option("--force", help="Replace a model file that exists.")] = False,
    json: JsonFile = None,
) -> None:
    """Convert between file formats, every value bit-identical; turn marker trajectories into joint angles and segment lengths."""
    from ..io import motion_files
    from ..io.markers import MARKER_SUFFIXES
    from ..io.opensim import MOTION_SUFFIXES
    from ..io.samples import SUFFIXES
    from ..io.table_conversion import convert as run_conversion
    from ..report import sentences

    if to.value in _MODEL_SUFFIX:
        _convert_model(source, out, to.value, force, json)
        return
    suffix = _suffix_of(source, (*SUFFIXES, *MOTION_SUFFIXES, *MARKER_SUFFIXES))
    chosen, named = listed(points), listed(coordinates)
    writable(out, json)
    if suffix in MARKER_SUFFIXES:
        file, motion, notes = motion_files.convert_markers(source, out, to=to.value, points=chosen, up=up, forward=forward)
        console.warn(notes)
        present(
            lambda: {"files": [file], "points": chosen, **motion.to_dict(), "warnings": notes},
            json,
            lambda: sentences.planar(motion, chosen, file),
        )
        return
    for option, given in (("--points", points), ("--up", up), ("--forward", forward)):
        if given:
            raise BadInput(option, Text(f"a {suffix or 'data set'} source"), f"{option} with {' or '.join(MARKER_SUFFIXES)} files only")
    if suffix in MOTION_SUFFIXES or f".{to.value}" in MOTION_SUFFIXES or named:
        written = [motion_files.convert_motion(source, out, to=to.value, coordinates=named)]
    else:
        written = run_conversion(source, out, to=to.value)
    present(lambda: {"files": written}, json, lambda: print("\n".join(os.fspath(path) for path in written)))


def _convert_model(source: Path, out: Path, to: str, force: bool, json: Path | None) -> None:
    """Write a model in another format: from `model.toml` to URDF, MJCF or OSIM, or from URDF or MJCF to `model.toml`."""
    from ..io.multibody import export_model, read_model

    writable(out, json)
    target = out / f"{source.stem}{_MODEL_SUFFIX[to]}"
    files.not_an_input([target], [source])
    if target.exists() and not force:
        raise BadInput("-o", Text(f"a {target.name} that exists"), "a folder without one, or --force", file=out)
    lost: tuple[str, ...] = ()
    if to == "toml":
        found = read_model(source)
        found.model.write(target)
        console.warn(found.notes)
    else:
        lost = export_model(source, target).lost
    console.warn(f"{to} cannot hold {line}" for line in lost)
    present(lambda: {"files": [target], "lost": list(lost)}, json, lambda: print(target))


def _suffix_of(source: Path, readable: tuple[str, ...]) -> str:
    """Return the suffix that says how a source is read, nothing for a folder; one that says nothing is refused with all that are read."""
    suffix = source.suffix.lower()
    if source.is_dir() or suffix in (*readable, ".toml"):
        return "" if source.is_dir() else suffix
    allowed = f"a data set's folder or dataset.toml, or a file of {', '.join(readable)}"
    if os.path.lexists(source):
        raise BadInput("file", Text(f"suffix {source.suffix!r}"), allowed, file=source)
    raise BadInput("file", NO_FILE, allowed, file=source, kind="missing_source")


def report(
    sources: Annotated[list[Path], typer.Argument(metavar="RESULT.json…", help="Results that other verbs wrote.")],
    out: OutFolder = Path(),
    summary: Annotated[bool, typer.Option("--summary", help="One page in plain words for a clinician, summary.html, instead.")] = False,
    norms: Annotated[Path | None, typer.Option(metavar="FILE", help="TOML file with the usual ranges, shown in the summary.")] = None,
) -> None:
    """Make one self-contained HTML report, report.html, of any results.

    With --summary one page in plain words for a clinician, from results of identify, gap, passive and spasticity of one session.
    """
    if norms is not None and not summary:
        raise BadInput("--norms", Text("no --summary"), "--norms beside --summary")
    if summary:
        from ..report.clinic_norms import load_norms
        from ..report.clinic_page import write_summary

        usual = () if norms is None else load_norms(norms)
        page = files.output_folder(out, "-o") / "summary.html"
        files.refuse_page_of_another(page, "report")
        print(write_summary(sources, page, usual))
        return
    from ..report.pages import write_report

    page = files.output_folder(out, "-o") / "report.html"
    files.refuse_page_of_another(page, "report")
    print(write_report(sources, page))


def _range(low: float, high: float) -> str:
    if math.isinf(low) and math.isinf(high):
        return "any"
    if math.isinf(high):
        return f">= {low:g}"
    return f"<= {high:g}" if math.isinf(low) else f"{low:g} to {high:g}"
