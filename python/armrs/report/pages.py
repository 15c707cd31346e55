"""One self-contained HTML page of any result: styles and pictures are in it, and nothing is loaded from elsewhere.

It arranges what a result says as plain data (its JSON) and the figures beside it; nothing is computed here.
"""

from __future__ import annotations

import base64
import html
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from .. import checks
from ..errors import BadInput, Text
from ..io import files
from . import tables, words

_CSS = """
:root { color-scheme: light dark; --ink: #1d1f23; --soft: #5d6470; --line: #d9dde3; --paper: #ffffff; --tint: #f3f5f8; --mark: #0072B2;
  --warn: #fff4e0; --warn-line: #e69f00; }
@media (prefers-color-scheme: dark) { :root { --ink: #e7e9ec; --soft: #a3aab5; --line: #3a4049; --paper: #16181c; --tint: #1f2329;
  --mark: #6db8e8; --warn: #33290f; --warn-line: #b98a1f; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; }
main { max-width: 66rem; margin: 0 auto; padding: 2rem 1.25rem 4rem; }
h1 { font-size: 1.7rem; line-height: 1.2; margin: 0 0 .4rem; }
h1:not(:first-child) { margin-top: 5rem; padding-top: 1.5rem; border-top: 4px solid var(--line); }
h2 { font-size: 1.2rem; margin: 2.6rem 0 .6rem; padding-top: .9rem; border-top: 1px solid var(--line); }
p { max-width: 46rem; margin: .5rem 0; }
.verdict { font-size: 1.1rem; border-left: 4px solid var(--mark); padding: .2rem 0 .2rem .9rem; margin: 1rem 0; }
.soft, figcaption { color: var(--soft); font-size: .92rem; }
.label { display: inline-block; background: var(--warn); border: 1px solid var(--warn-line); border-radius: 4px; padding: .1rem .6rem;
  font-weight: 600; font-size: .88rem; }
.care { background: var(--warn); border: 1px solid var(--warn-line); border-radius: 6px; padding: .2rem 1rem .4rem; margin: 1.2rem 0; }
.care h2 { border: 0; margin: .4rem 0 .2rem; padding: 0; font-size: 1.05rem; }
.wide { overflow-x: auto; margin: .8rem 0; }
table { border-collapse: collapse; font-size: .92rem; font-variant-numeric: tabular-nums; }
th, td { padding: .32rem .75rem; border-bottom: 1px solid var(--line); text-align: right; white-space: nowrap; }
th { background: var(--tint); font-weight: 600; }
.left { text-align: left; }
td.left { font-family: Georgia, "Times New Roman", serif; }
tr.prior td, tr.bound td { color: var(--soft); font-style: italic; }
figure { margin: 1.2rem 0; }
figure div { background: #fff; border: 1px solid var(--line); border-radius: 6px; padding: .5rem; }
img { display: block; max-width: 100%; height: auto; margin: 0 auto; }
figcaption { margin-top: .4rem; max-width: 46rem; }
ul { margin: .5rem 0; padding-left: 1.3rem; } li { max-width: 46rem; }
code { font: .88rem/1.5 ui-monospace, "Cascadia Mono", Menlo, Consolas, monospace; background: var(--tint); padding: .1rem .35rem;
  border-radius: 4px; overflow-wrap: anywhere; }
@media print { main { max-width: none; padding: 0; } figure, table { break-inside: avoid; } }
"""

KINDS = {
    "identify": "Identification",
    "simulate": "Simulation",
    "passive": "Passive joint moments",
    "demo": "Demonstration",
    "gap": "Gap between model and measurement",
    "fmu run": "Co-simulation",
    "sweep": "Sweep",
}
"""What a report can be made of: the `verb` of a result, and its title."""
INPUT = "SHA-256 of dataset.toml, the model and the trials, one after the other in their order:"
INPUT_OF = {"sweep": "SHA-256 of what SWEEP.toml and the files that it names say, and of the version of armrs:"}
"""What the digest of a result's input is made of."""


def read_result(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a result that a verb wrote with `--json` or below `-o`.

    Raises
    ------
    BadInput
        When it is not JSON, or not a result that a report is made of.
    """
    from ..io.tomlfile import read_text

    content = read_text(path, "a JSON file")
    try:
        data = json.loads(content)
    except (ValueError, RecursionError) as error:
        raise BadInput("file", Text(str(error)), "JSON", file=path) from None
    verb = data.get("verb") if isinstance(data, dict) else None
    if not isinstance(verb, str) or verb not in KINDS:
        found = Text("no key verb") if verb is None else verb
        raise BadInput("verb", found, "a result of armrs " + ", ".join(KINDS), file=path)
    return data


def write_report(sources: Sequence[str | os.PathLike[str]], path: str | os.PathLike[str]) -> Path:
    """Write one page about one or more results.

    Parameters
    ----------
    sources : sequence of path
        JSON files of results. Figures are taken from where these say, relative to themselves.
    path : path
        The HTML file.

    Raises
    ------
    BadInput
        For a file that is no result; nothing is written then.
    """
    target = checks.path("path", path)
    if isinstance(sources, (str, bytes)) or not isinstance(sources, Iterable):
        raise BadInput("sources", sources, "a sequence of paths")
    write_page(target, [_part(checks.path(f"sources[{k}]", source)) for k, source in enumerate(sources)])
    return target


def _part(source: str | os.PathLike[str]) -> str:
    try:
        return _result(read_result(source), Path(source).parent)
    except BadInput:
        raise
    except (KeyError, TypeError, AttributeError, ValueError, IndexError) as error:
        raise BadInput("content", Text(f"not what a result holds ({error})"), "a whole result", file=source) from None


def write_page(path: str | os.PathLike[str], parts: Sequence[str], *, title: str = "armrs report", css: str = "") -> None:
    """Write a page from finished parts, with further styles where they need some."""
    content = (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>{title}</title>\n'
        f"<style>{_CSS}{css}</style>\n</head>\n<body>\n<main>\n{''.join(parts)}</main>\n</body>\n</html>\n"
    )
    files.write_text(path, content, kind=".html")


def escape(text: object) -> str:
    """Return text as it stands in HTML."""
    return html.escape(str(text))


def paragraph(text: str, kind: str = "") -> str:
    """Return a paragraph of escaped text."""
    return f"<p{_class(kind)}>{escape(text)}</p>\n"


def heading(text: str) -> str:
    """Return the heading of a section."""
    return f"<h2>{escape(text)}</h2>\n"


def bullets(lines: Iterable[str]) -> str:
    """Return a list of lines, or nothing for none."""
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f"<ul>{items}</ul>\n" if items else ""


def table(content: tables.Table, kinds: Sequence[str] = ()) -> str:
    """Return a table; `kinds` are classes of its rows."""

    def row(cells: Sequence[object], tag: str, kind: str = "") -> str:
        texts = "".join(
            f"<{tag}{_class('left' if k < content.left else '')}>{escape('–' if c is None else c)}</{tag}>" for k, c in enumerate(cells)
        )
        return f"<tr{_class(kind)}>{texts}</tr>"

    body = "".join(row(cells, "td", kinds[k] if k < len(kinds) else "") for k, cells in enumerate(content.rows))
    return f'<div class="wide"><table><thead>{row(content.head, "th")}</thead><tbody>{body}</tbody></table></div>\n'


def picture(entry: Mapping[str, Any], folder: Path) -> str:
    """Return a figure with its words; the image is part of the page. A file that is gone is said to be."""
    try:
        raw = (folder / str(entry["file"])).read_bytes()
    except (OSError, ValueError):
        return paragraph(f"The figure {entry['file']} is no longer beside the result.", "soft")
    if not raw.startswith(b"\x89PNG"):
        raise BadInput("figures", Text(f"{entry['file']} is no PNG image"), "PNG images", file=folder / str(entry["file"]))
    source = "data:image/png;base64," + base64.b64encode(raw).decode("ascii")
    return (
        f'<figure><div><img alt="{escape(entry["title"])}" src="{source}"></div>'
        f"<figcaption><strong>{escape(entry['title'])}.</strong> {escape(entry['text'])}</figcaption></figure>\n"
    )


def _class(kind: str) -> str:
    return f' class="{kind}"' if kind else ""


def _result(data: Mapping[str, Any], folder: Path) -> str:
    figures: dict[str, str] = {}
    for entry in data.get("figures", []):
        figures[entry.get("section", "")] = figures.get(entry.get("section", ""), "") + picture(entry, folder)
    drawn = heading("Figures") + figures[""] if "" in figures else ""
    head = f"<h1>{escape(KINDS[data['verb']])}: {escape(words.name(data))}</h1>\n"
    if words.is_synthetic(data):
        head += '<p><span class="label">Synthetic data: simulated, not measured</span></p>\n'
    return head + paragraph(words.verdict(data), "verdict") + figures.get("first", "") + _sections(data, figures) + drawn + _origin(data)


def _sections(data: Mapping[str, Any], figures: Mapping[str, str]) -> str:
    """Return what is between the verdict and the figures that belong to no section."""
    from ..montecarlo import words as sweep
    from ..workflows.gap import page

    if data["verb"] == "gap":
        return page.sections(data, figures)
    sections = {
        "identify": _identified,
        "simulate": _simulated,
        "passive": _passive,
        "demo": _demo,
        "fmu run": _coupled,
        "sweep": sweep.page,
    }
    return sections[data["verb"]](data)


def _identified(data: Mapping[str, Any]) -> str:
    joints, level = data["data"]["joints"], data["level"]
    out = heading("Data set") + bullets(words.data_lines(data["data"]))
    out += heading("What these movements determine")
    if measured := tables.measured(data):
        out += paragraph("This is what the measurement shows, whatever the model says.", "soft")
        out += table(tables.estimates(measured, joints, level))
    else:
        out += paragraph("No value by the measurement alone: every one below also rests on what the model was given.", "soft")
    out += heading("Parameters")
    out += _decided(data["parameters"])
    out += table(tables.estimates(data["parameters"], joints, level), [e["decided_by"] for e in data["parameters"]])
    if data["warnings"]:
        out += heading("Take care") + bullets(data["warnings"])
    lines = words.cannot_tell(data)
    if lines:
        out += heading("What cannot be told apart") + bullets(lines)
    if data["calibration"]:
        out += heading("Calibration of the sensors")
        out += paragraph(
            "Small imperfections of the sensors, refitted together with the arm. The tolerance that the data set declares is what was "
            "believed of them beforehand, their prior; a value far beyond it says that the model lacks something.",
            "soft",
        )
        out += table(tables.estimates(data["calibration"], joints, level))
    out += heading("What is left")
    cutoff = f"Joint torque that the model does not explain, root mean square below {data['cutoff_Hz']:.3g} Hz."
    return out + paragraph(cutoff, "soft") + table(tables.residuals(data["residual_rms"], joints))


def _decided(items: Sequence[Mapping[str, Any]]) -> str:
    present = {e["decided_by"] for e in items}
    return bullets(f"Decided by {key}: it rests on {meaning}." for key, meaning in tables.DECIDED_BY.items() if key in present)


def _simulated(data: Mapping[str, Any]) -> str:
    return heading("The run") + table(tables.run(data)) + bullets(data.get("assumed", ()))


def _coupled(data: Mapping[str, Any]) -> str:
    out = heading("The run") + table(tables.coupling(data)) + heading("Connections") + table(tables.connections(data))
    if data["not_connected"]:
        out += heading("Not connected") + bullets(data["not_connected"])
    return out + (heading("Take care") + bullets(data["warnings"]) if data["warnings"] else "")


def _passive(data: Mapping[str, Any]) -> str:
    out = heading("Data set") + bullets(words.data_lines(data["data"]))
    out += heading("Passive moments") + paragraph(words.PASSIVE_MEANING, "soft") + table(tables.passive(data))
    if data.get("dependence"):
        out += heading("Own and adjacent angle") + paragraph(words.DEPENDENCE_MEANING, "soft") + table(tables.dependence(data))
        out += bullets(words.couplings(data))
    out += heading("Assumptions") + bullets(c["text"] for c in data.get("checks", ()))
    return out + (heading("Take care") + bullets(data["warnings"]) if data["warnings"] else "")


def _demo(data: Mapping[str, Any]) -> str:
    out = heading("What was done") + bullets(data["story"])
    out += (
        heading("Identified beside known")
        + paragraph(data["comparison_text"], "soft")
        + table(tables.comparison(data), [row["decided_by"] for row in data["comparison"]])
    )
    return out + heading("What the model handed over lacked") + paragraph(data["missing_text"])


def _origin(data: Mapping[str, Any]) -> str:
    made = data.get("made_by", {})
    out = heading("How to repeat")
    if made.get("command"):
        out += f"<p><code>{escape(made['command'])}</code></p>\n"
    out += paragraph(f"armrs {made.get('armrs')}, {made.get('build_profile')} build, Python {made.get('python')}.", "soft")
    if made.get("random_numbers") == "none":
        out += paragraph(
            "No random numbers are drawn, and the number of threads changes nothing: the same input gives the same result.", "soft"
        )
    if made.get("input_sha256"):
        out += paragraph(INPUT_OF.get(data["verb"], INPUT), "soft")
        out += f"<p><code>{escape(made['input_sha256'])}</code></p>\n"
    return out
