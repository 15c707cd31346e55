"""HTML from Jinja2 templates: everything is escaped, and a page loads and runs only what it contains."""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined, TemplateError
from markupsafe import Markup, escape

from .. import formatting
from ..errors import BadInput, Text
from ..io import files

TEMPLATES = Path(__file__).with_name("templates")
CONTENTS = Markup("<!-- contents -->")
"""Where a part of a page has its table of contents."""
_PHONE = 640
"""Widest image that a phone shows whole [pixels]."""
_BETWEEN_PARTS = re.compile(r"(?<=[\w\]]{2})([._/])(?=[A-Za-z]{2})")  # units have parts of one letter
_HEADING = re.compile(r"<h2>(.*?)</h2>", flags=re.S)

__all__ = [
    "CONTENTS",
    "Environment",
    "Picture",
    "TemplateError",
    "data_uri",
    "environment",
    "picture",
    "render",
    "source",
    "with_contents",
    "write_page",
]


@dataclass(frozen=True)
class Picture:
    """A figure in a page. `source` is the image as a data URI, or `None` where its file is gone."""

    file: str
    title: str
    text: str
    source: str | None

    @property
    def shape(self) -> str:
        """`broad` where a phone, which shows it at half its size, does not show all of it at once; `tall` where it is higher than wide."""
        if self.source is None:
            return ""
        # Width and height stand behind 16 bytes of every PNG image.
        head = base64.b64decode(self.source.partition(",")[2][:32])
        width, height = (int.from_bytes(head[k : k + 4], "big") for k in (16, 20))
        return " ".join(name for name, true in (("broad", width > _PHONE), ("tall", height > width)) if true)


@cache
def environment(*folders: Path) -> Environment:
    """Return the environment of the templates of reports and of those in `folders`: escaping always, a missing value is an error."""
    engine = Environment(
        loader=FileSystemLoader([TEMPLATES, *folders]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        keep_trailing_newline=True,
    )
    engine.filters["typeset"] = formatting.typeset
    engine.filters["breakable"] = _breakable
    return engine


def _breakable(cell: object) -> Markup:
    """Return a cell in which a line may end between the parts of a key or of a file's name."""
    return Markup(_BETWEEN_PARTS.sub(r"\1<wbr>", str(escape(cell))))


def render(engine: Environment, template: str, values: Mapping[str, Any]) -> Markup:
    """Return what a template makes of values, as HTML that is not escaped again."""
    return Markup(engine.get_template(template).render(values))


def with_contents(part: Markup, number: int) -> Markup:
    """Return a part of a page whose headings can be linked to, with the list of them at `CONTENTS`."""
    places: list[str] = []

    def marked(found: re.Match[str]) -> str:
        place = f"part-{number}-{len(places) + 1}"
        places.append(f'<li><a href="#{place}">{found[1]}</a></li>')
        return f'<h2 id="{place}">{found[1]}</h2>'

    # Text from a file is escaped, so that no heading is in it.
    text = _HEADING.sub(marked, str(part))
    listed = f'<nav class="contents" aria-label="Contents, part {number}"><ul>{"".join(places)}</ul></nav>' if len(places) > 2 else ""
    return Markup(text.replace(str(CONTENTS), listed))


def source(engine: Environment, name: str) -> Markup:
    """Return a file beside the templates (styles, scripts) as it is."""
    assert engine.loader is not None
    return Markup(engine.loader.get_source(engine, name)[0])


def picture(entry: Mapping[str, Any], folder: Path) -> Picture:
    """Return a figure that a result names, its image taken from below the folder of the result.

    Raises
    ------
    BadInput
        When the file is outside the folder, or is no PNG image.
    """
    file, title, text = (str(entry[key]) for key in ("file", "title", "text"))
    path = folder / file
    try:
        inside = path.resolve().is_relative_to(folder.resolve())
        raw = path.read_bytes() if inside and path.is_file() else None
    except (OSError, ValueError, RuntimeError):
        return Picture(file, title, text, None)
    if not inside:
        raise BadInput("figures", Text(f"{file}, which is outside the folder of the result"), "PNG images below it", file=path)
    if raw is None:
        return Picture(file, title, text, None)
    if not raw.startswith(b"\x89PNG"):
        raise BadInput("figures", Text(f"{file} is no PNG image"), "PNG images", file=path)
    return Picture(file, title, text, data_uri(raw))


def data_uri(png: bytes) -> str:
    """Return a PNG image as it stands in a page."""
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")


def write_page(
    engine: Environment,
    path: Path,
    parts: Iterable[Markup],
    *,
    title: str,
    maker: str,
    styles: Sequence[str] = (),
    scripts: Sequence[str] = (),
) -> None:
    """Write a page of finished parts, with styles and scripts from files beside the templates; it states the verb that was its `maker`.

    Its Content-Security-Policy allows these styles and scripts, by their SHA-256, and images that are in the page; nothing else.
    """
    style = Markup("").join(source(engine, name) for name in ("page.css", *styles))
    script = Markup("").join(source(engine, name) for name in scripts)
    values = {"title": title, "parts": list(parts), "style": style, "script": script, "maker": maker, "policy": _policy(style, script)}
    files.write_text(path, render(engine, "page.html.j2", values), kind=".html")


def _policy(style: str, script: str) -> str:
    allowed = {
        "default-src": "'none'",
        "img-src": "data:",
        "style-src": _digest(style),
        "script-src": _digest(script) if script else "'none'",
    }
    return "; ".join(f"{key} {value}" for key, value in (allowed | {"base-uri": "'none'", "form-action": "'none'"}).items())


def _digest(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode('ascii')}'"
