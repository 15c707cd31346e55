"""A page in a headless Chromium: what it asked the network for, and what went wrong in it."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
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
def opened(path: Path, *, width: int = 1280, height: int = 900) -> Iterator[Opened]:
    """Open a file in a browser without a network.

    At the end the test fails when a script failed, something was written to the console as an error, or anything but the file itself
    and what it carries (`data:`, `blob:`) was asked for. Skips where there is no Chromium, which no Python package brings.
    """
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        _missing("the Python package playwright")
    home = os.fspath(path.resolve().as_uri())
    with sync_playwright() as tool:
        browser = tool.chromium.launch(executable_path=_chromium(), args=FLAGS)
        try:
            context = browser.new_context(viewport={"width": width, "height": height}, offline=True)
            seen = Opened(context.new_page())
            seen.page.on("pageerror", lambda error: seen.errors.append(str(error)))
            seen.page.on("console", lambda message: seen.errors.append(message.text) if message.type == "error" else None)
            seen.page.on("request", lambda request: seen.requests.append(request.url))
            seen.page.goto(home)
            yield seen
        finally:
            browser.close()
    assert not seen.errors
    assert [url for url in seen.requests if not url.startswith(("data:", "blob:"))] == [home]


def _chromium() -> str:
    """Return the program: that of the environment variable CHROMIUM, or the first on the path."""
    found = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, NAMES)), None)
    return found if found is not None else _missing("Chromium: install it, or set CHROMIUM to the program")


def _missing(what: str) -> Any:
    pytest.skip(f"no {what}")
