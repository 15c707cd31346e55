"""The page: a part of the thesis at a time, every item with what is printed, what we get, and why they differ."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..report import pages, tables
from . import animation

_NEGATIVE = re.compile(r"-\d")
_CSS = """
nav { position: sticky; top: 0; z-index: 1; display: flex; flex-wrap: wrap; gap: .4rem; padding: .6rem 0; background: var(--paper);
  border-bottom: 1px solid var(--line); }
nav button { font: inherit; font-size: .92rem; padding: .25rem .8rem; border: 1px solid var(--line); border-radius: 999px;
  background: var(--tint); color: var(--ink); cursor: pointer; }
nav button[aria-current=true] { background: var(--mark); border-color: var(--mark); color: var(--paper); font-weight: 600; }
.part h2:first-child { margin-top: 1.4rem; border-top: 0; }
.list { columns: 2 20rem; font-size: .92rem; }
dl { display: grid; grid-template-columns: 7.5rem 1fr; gap: .35rem 1rem; margin: .9rem 0; max-width: 56rem; }
dt { font-weight: 600; color: var(--soft); }
dd { margin: 0; }
h3 { font-size: 1rem; margin: 1.3rem 0 .2rem; }
td code { white-space: normal; overflow-wrap: anywhere; }
.equations th, .equations td { white-space: normal; vertical-align: top; text-align: left; }
figure img { max-width: 100%; }
article { scroll-margin-top: 6.5rem; }
.part thead th { white-space: normal; vertical-align: bottom; }
.part th, .part td { padding: .32rem .4rem; }
@media (max-width: 45rem) { nav { position: static; } dl { grid-template-columns: 1fr; } article { scroll-margin-top: 1rem; } }
"""

_SCRIPT = """
const parts = [...document.querySelectorAll(".part")], buttons = [...document.querySelectorAll("nav button")];
const open = key => {
  parts.forEach(part => part.hidden = part.id !== key);
  buttons.forEach(button => button.setAttribute("aria-current", button.dataset.part === key));
};
const follow = () => {
  const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  if (!target) return;
  open(target.closest(".part").id);
  target.scrollIntoView();
};
buttons.forEach(button => button.addEventListener("click", () => { open(button.dataset.part); scrollTo(0, 0); }));
addEventListener("hashchange", follow);
open(parts[0].id);
follow();
"""


def write(path: Path, data: Mapping[str, Any], folder: Path) -> None:
    """Write the page of plain data, its figures taken from below a folder."""
    films = iter(range(1, 1000))
    parts = [_part(part, folder, films) for part in data["parts"]]
    shown = [*((p["key"], p["title"]) for p in data["parts"]), ("equations", "Equations")]
    buttons = "".join(f'<button type="button" data-part="{key}">{pages.escape(title)}</button>' for key, title in shown)
    head = "<h1>The thesis, computed again</h1>\n" + pages.paragraph(data["verdict"], "verdict")
    script = f"<script>{_SCRIPT}{animation.SCRIPT}</script>\n"
    body = [head, f"<nav>{buttons}</nav>\n", *parts, _equations(data["equations"]), _origin(data), script]
    pages.write_page(path, body, title="The thesis, computed again", css=_CSS + animation.CSS)


def _part(part: Mapping[str, Any], folder: Path, films: Any) -> str:
    listed = "".join(f'<li><a href="#{item["key"]}">{pages.escape(item["title"])}</a></li>' for item in part["items"])
    items = "".join(_item(item, folder, films) for item in part["items"])
    head = f'<section class="part" id="{part["key"]}">\n<h2>{pages.escape(part["title"])}</h2>\n<ul class="list">{listed}</ul>\n'
    return f"{head}{items}</section>\n"


def _item(item: Mapping[str, Any], folder: Path, films: Any) -> str:
    out = f'<article id="{item["key"]}">\n{pages.heading(item["title"])}' + pages.paragraph(item["place"], "soft")
    if item["virtual"]:
        out += '<p><span class="label">Virtual data: simulated, not measured</span></p>\n'
    said = (("Printed", item["printed"]), ("Here", item["ours"]), ("Why", item["why"]))
    out += "<dl>" + "".join(f"<dt>{name}</dt><dd>{_marked(text)}</dd>" for name, text in said) + "</dl>\n"
    for sheet in item["tables"]:
        rows = [[_signed(cell) for cell in row] for row in sheet["rows"]]
        out += f"<h3>{pages.escape(sheet['title'])}</h3>\n" + pages.table(tables.Table(sheet["head"], rows, sheet["left"]))
    out += "".join(animation.html(film, next(films)) for film in item["animations"])
    return out + "".join(pages.picture(entry, folder) for entry in item["figures"]) + "</article>\n"


def _signed(cell: Any) -> str | None:
    """Return the text of a cell, a number with a minus that is seen."""
    text = None if cell is None else str(cell)
    return tables.minus(text) if text and _NEGATIVE.match(text) else text


def _equations(rows: list[list[str]]) -> str:
    head, *body = rows
    out = '<section class="part" id="equations">\n' + pages.heading("Equation, function, test")
    out += pages.paragraph(
        "Where an equation is not used as printed, the number of the erratum and the correction stand here. The force is the one on the "
        "arm throughout. Functions are in the Rust crates or the Python package, tests beside them.",
        "soft",
    )
    cells = ["".join(f"<{tag}>{_marked(cell)}</{tag}>" for cell in row) for tag, row in [("th", head), *(("td", r) for r in body)]]
    return out + f'<div class="wide"><table class="equations"><tr>{"</tr><tr>".join(cells)}</tr></table></div>\n</section>\n'


def _marked(text: str) -> str:
    """Return text, its names between backticks as code."""
    pieces = text.split("`")
    return "".join(f"<code>{pages.escape(p)}</code>" if k % 2 else pages.escape(p) for k, p in enumerate(pieces))


def _origin(data: Mapping[str, Any]) -> str:
    made = data["made_by"]
    command = f"<code>{pages.escape(made['command'])}</code>, " if made.get("command") else ""
    return f'<p class="soft">{command}armrs {made["armrs"]}, {made["build_profile"]} build, Python {made["python"]}.</p>\n'
