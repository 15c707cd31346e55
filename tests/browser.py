"""A page in a headless Chromium: what it asked the network for, and what went wrong in it."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome", "chromium-headless-shell")
FLAGS = ["--no-sandbox", "--disable-dev-shm-usage"]
"""As in containers, where Chromium may neither make a sandbox of its own nor use much shared memory."""


@dataclass
class Opened:
    """An open page (`page` as Playwright has it), and what was noticed since."""

    page: Any
    errors: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def until(self, predicate: str, argument: Any = None, *, seconds: float = 30.0) -> None:
        """Wait for a condition in the page, asked from outside: `wait_for_function` asks again from within, which the policy of a page
        forbids."""
        end = time.monotonic() + seconds
        while not self.page.evaluate(predicate, argument):
            assert time.monotonic() < end, f"not within {seconds:g} s: {predicate}"
            self.page.wait_for_timeout(20)


@contextmanager
def launched() -> Iterator[Any]:
    """Start a browser. Skips where there is no Chromium, which no Python package brings."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        _missing("the Python package playwright")
    with sync_playwright() as tool:
        browser = tool.chromium.launch(executable_path=_chromium(), args=FLAGS)
        try:
            yield browser
        finally:
            browser.close()


_running: list[Any] = []
"""The browser in which pages are opened, if any yet."""
_ends = ExitStack()


@contextmanager
def shared() -> Iterator[None]:
    """Close at the end the browser in which pages were opened, each in a context of its own: a start takes three times as long as a page."""
    try:
        yield
    finally:
        _running.clear()
        _ends.close()


@contextmanager
def opened(path: Path, *, width: int = 1280, height: int = 900) -> Iterator[Opened]:
    """Open a file in a browser without a network.

    At the end the test fails when a script failed, something was written to the console as an error, or anything but the file itself
    and what it carries (`data:`, `blob:`) was asked for.
    """
    home = os.fspath(path.resolve().as_uri())
    if not _running:
        _running.append(_ends.enter_context(launched()))
    context = _running[0].new_context(viewport={"width": width, "height": height}, offline=True)
    try:
        seen = Opened(context.new_page())
        seen.page.on("pageerror", lambda error: seen.errors.append(str(error)))
        seen.page.on("console", lambda message: seen.errors.append(message.text) if message.type == "error" else None)
        seen.page.on("request", lambda request: seen.requests.append(request.url))
        seen.page.goto(home)
        yield seen
    finally:
        context.close()
    assert not seen.errors
    assert [url for url in seen.requests if not url.startswith(("data:", "blob:"))] == [home]


def _chromium() -> str:
    """Return the program: that of the environment variable CHROMIUM, or the first on the path."""
    found = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
    return found if found is not None else _missing("Chromium: install it, or set CHROMIUM to the program")


def _missing(what: str) -> Any:
    pytest.skip(f"no {what}")


WIDER = "[...document.querySelectorAll('.wide')].filter(e => e.scrollWidth > e.clientWidth).map(e => e.innerText)"
"""Tables that must be scrolled."""
WIDTHS = (1400, 390)
"""Of a window and of a phone [px]."""
SHEET = 794
"""Width of a window that shows a page as wide as A4 [px]."""
A4 = {"width": 718, "height": 1047}
"""Within margins of 1 cm, in CSS pixels."""


OF_COLOURS = ["color-contrast", "link-in-text-block"]
"""The rules of axe-core that look at colours, the only thing that our pages have dark."""
ONE_OF_A_KIND = """() => {
  const kind = e => e.tagName + [...e.attributes].map(a => a.name + (['class', 'style'].includes(a.name) ? a.value : ''))
    + Math.min(e.textContent.trim().length, 2);
  const again = [...document.querySelectorAll('table')].flatMap(table => {
    const seen = new Set();
    return [...table.rows].filter(row => {
      const key = [row, ...row.querySelectorAll('*')].map(kind).join();
      return seen.has(key) || !seen.add(key);
    });
  });
  again.forEach(row => row.remove());
}"""
"""Removes rows of a table that have the elements, attributes, classes and filled cells of one before: of them axe-core would say the same,
and it takes a second for three hundred cells. Of the colour of a single letter it says nothing."""


def violations(page: Any, rules: Sequence[str] = ()) -> list[str]:
    """Return what axe-core finds in a page, by all of its rules or by some."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    if not page.evaluate("'axe' in window"):
        page.evaluate(axe.axe_script)
    only = {"runOnly": {"type": "rule", "values": list(rules)}} if rules else {}
    found = page.evaluate("options => axe.run(options)", {"resultTypes": ["violations"]} | only)["violations"]
    return [f"{v['id']}: {[n['target'] for n in v['nodes']]}" for v in found]


def faults_on_screens(path: Path) -> list[str]:
    """Return what is wider than a window of 1400 px, of A4 and of 390 px, and what axe-core finds at each, in light and dark."""
    with opened(path, width=1400) as seen:
        return [*too_wide(seen.page), *inaccessible(seen.page)]


def too_wide(page: Any) -> Iterator[str]:
    """Give what is wider than the window."""
    for width in (*WIDTHS, SHEET):
        page.set_viewport_size({"width": width, "height": 800})
        if page.evaluate("document.documentElement.scrollWidth") > width:
            yield f"wider than {width} px"
        yield from (f"table wider than {width} px: {text}" for text in page.evaluate(WIDER))


def inaccessible(page: Any) -> Iterator[str]:
    """Give what axe-core finds; the page is not whole any more after it. What is hidden it passes over, but slowly."""
    page.evaluate("document.querySelectorAll('[hidden]').forEach(e => e.remove())")
    page.evaluate(ONE_OF_A_KIND)
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        for width in WIDTHS:
            page.set_viewport_size({"width": width, "height": 800})
            yield from (f"{scheme}, {width} px: {one}" for one in violations(page, OF_COLOURS if scheme == "dark" else ()))


def faults_on_paper(path: Path) -> list[str]:
    """Return what is cut on A4, what can break that must not, and colours of a screen: paper is light whatever the screen is."""
    with opened(path) as seen:
        seen.page.emulate_media(media="print", color_scheme="dark")
        seen.page.set_viewport_size(A4)
        found = [f"table wider than A4: {text}" for text in seen.page.evaluate(WIDER)]
        if (colour := seen.page.evaluate("getComputedStyle(document.body).color")) != "rgb(29, 31, 35)":
            found.append(f"text in {colour}")
        if seen.page.evaluate("document.documentElement.scrollWidth") > A4["width"]:
            found.append("wider than A4")
        for part in seen.page.evaluate(PARTS):
            if part["inside"] != "avoid":
                found.append(f"may break: {part['text']}")
            if part["height"] > A4["height"]:
                found.append(f"higher than A4: {part['text']}")
        return found


PARTS = """[...document.querySelectorAll('figure, tr')].map(e => ({
  text: e.innerText.slice(0, 60), inside: getComputedStyle(e).breakInside, height: e.getBoundingClientRect().height}))"""
"""Figures and rows of tables."""
