"""One self-contained HTML page of any result: styles and pictures are in it, and nothing is loaded from elsewhere.

It arranges a result as plain data (its JSON) and the figures beside it; nothing is computed here. The text stands in
`templates/`, a template a verb.
"""

from __future__ import annotations

import json
import os
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markupsafe import Markup

from .. import checks, view_registry
from ..errors import BadInput, Text
from ..io import files, jsonfile
from . import html, interactive, sentences, tables

INPUT = "SHA-256 of dataset.toml, the model and the trials, one after the other in their order:"


@dataclass(frozen=True)
class Kind:
    """A kind of result.

    Attributes
    ----------
    title : str
    template : str
        In `templates/`.
    digest_of : str
        What the digest of its input is made of.
    """

    title: str
    template: str
    digest_of: str = INPUT


KINDS = {
    "identify": Kind("Identification", "identify.html.j2"),
    "simulate": Kind("Simulation", "simulate.html.j2"),
    "passive": Kind("Passive joint moments", "passive.html.j2"),
    "spasticity": Kind("Stretch reflexes", "spasticity.html.j2"),
    "cohort": Kind("Cohort", "cohort.html.j2", "SHA-256 of the table:"),
    "demo": Kind("Demonstration", "demo.html.j2"),
    "plan": Kind("Plan of an experiment", "plan.html.j2"),
    "history": Kind("Over the sessions", "history.html.j2"),
    "gap": Kind("Gap between model and measurement", "gap.html.j2"),
    "online replay": Kind("Replay of a device log", "replay.html.j2"),
    "record": Kind("Virtual laboratory", "record.html.j2"),
    "check": Kind("Check", "check.html.j2"),
    "import": Kind("Import", "import.html.j2"),
    "fmu run": Kind("Co-simulation", "fmu_run.html.j2"),
    "sweep": Kind(
        "Sweep",
        "sweep.html.j2",
        "SHA-256 of what SWEEP.toml and the files that it names say, and of the version of armrs:",
    ),
}
"""What a report can be made of, by the `verb` of a result."""
RESULT = "the JSON of a result that a verb wrote (identified.json, passive.json, …, or the file given with --json)"


def read_result(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a result that a verb wrote with `--json` or below `-o`.

    Raises
    ------
    BadInput
        When it is not JSON, or not a result that a report is made of.
    """
    data = jsonfile.read(path, RESULT)
    verb = data.get("verb") if isinstance(data, dict) else None
    if not isinstance(verb, str) or verb not in KINDS:
        found = Text("no key verb") if verb is None else verb
        raise BadInput("verb", found, "a result of armrs " + ", ".join(KINDS), file=path)
    for courses in (data.get("history"), data.get("courses")):
        for course in courses if isinstance(courses, list) else ():
            _renamed(course)
    return data


def _renamed(course: Any) -> None:
    """Give the comparison with the session before its name; results of version 0.1.0 have it by others."""
    if not isinstance(course, dict) or "before" in course or "changed_since_last" not in course:
        return
    old = {"value": "since_last", "std": "since_last_std", "p_value": "since_last_p_value", "clear": "changed_since_last"}
    dates = course.get("dates")
    before = dates[-2] if isinstance(dates, list) and len(dates) > 1 else None
    course["before"] = {"date": before} | {key: course.get(name) for key, name in old.items()}


def write_report(sources: Sequence[str | os.PathLike[str]], path: str | os.PathLike[str], *, maker: str = "report") -> Path:
    """Write one page about one or more results.

    Parameters
    ----------
    sources : sequence of path
        JSON files of results. Figures are taken from the paths in these, relative to themselves.
    path : path
        The HTML file.
    maker : str
        The verb that made the page, as stated in it: no other verb replaces it.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    BadInput
        For a file that is no result; nothing is written then.
    """
    target = checks.path("path", path)
    if isinstance(sources, (str, bytes)) or not isinstance(sources, Iterable):
        raise BadInput("sources", sources, "a sequence of paths")
    engine = html.environment()
    parts = [_part(engine, checks.path(f"sources[{k}]", source), k + 1) for k, source in enumerate(sources)]
    _write(engine, target, parts, maker)
    return target


def write_page_of(
    data: Mapping[str, Any], figures: Mapping[str, list[html.Picture]], path: Path, moving: interactive.Live = interactive.NOTHING
) -> Path:
    """Write one page about a result that is in memory; `figures` are its pictures by the section that they belong to."""
    engine = html.environment()
    # What a file would hold: NaN is absent there, and arrays are lists.
    plain = json.loads(files.json_text(data))
    _write(engine, path, [_result(engine, plain, defaultdict(list, figures), moving, 1)], str(plain["verb"]))
    return path


def _write(engine: html.Environment, path: Path, parts: Sequence[Markup], maker: str) -> None:
    """Write a page with the scripts that something in it needs."""
    whole = "".join(parts)
    scripts = [f"{name}.js" for name in ("film", "series") if f'class="{name}"' in whole]
    html.write_page(engine, path, parts, title="armrs report", maker=maker, scripts=scripts)


def _part(engine: html.Environment, source: Path, number: int) -> Markup:
    """Return one result as it stands in a page."""
    data = read_result(source)
    try:
        figures: defaultdict[str, list[html.Picture]] = defaultdict(list)
        for entry in data.get("figures", []):
            figures[entry.get("section", "")].append(html.picture(entry, source.parent))
        return _result(engine, data, figures, interactive.read(data.get("live"), source.parent), number)
    except BadInput:
        raise
    except (KeyError, TypeError, AttributeError, ValueError, IndexError, ArithmeticError, html.TemplateError) as error:
        raise BadInput("content", Text(f"not what a result holds ({error})"), "a whole result", file=source) from None


def _result(
    engine: html.Environment, data: Mapping[str, Any], figures: Mapping[str, list[html.Picture]], moving: interactive.Live, number: int
) -> Markup:
    kind = KINDS[data["verb"]]
    values = {
        "kind": kind.title,
        "digest_of": kind.digest_of,
        "data": data,
        "figures": figures,
        "made_by": defaultdict(lambda: None, data.get("made_by", {})),
        "said": view_registry.words_of(data["verb"]),
        "tables": tables,
        "words": sentences,
        "contents": html.CONTENTS,
        "number": number,
        **moving.shown(),
    }
    return html.with_contents(html.render(engine, kind.template, values), number)
