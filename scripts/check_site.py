"""Look at the built site in Chromium: nothing is loaded from elsewhere, no script fails, axe-core finds nothing, the first page is light.

`make docs` runs it after MkDocs. Needs playwright, axe-playwright-python and Chromium (environment variable CHROMIUM, or on the path).
"""

from __future__ import annotations

import functools
import gzip
import os
import shutil
import sys
import threading
import time
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, sync_playwright

SITE = Path(__file__).parents[1] / "out" / "site"
HEAVIEST_START = 200_000
"""Bytes of the first page with everything that it loads, compressed as web servers send it."""
CHROMIUM = ("chromium", "chromium-browser", "google-chrome", "chrome")
LOOKS = [("light", 1400), ("dark", 390)]


class Quiet(SimpleHTTPRequestHandler):
    """Serves the site without a line for each request."""

    def log_message(self, *_: Any) -> None:
        """Say nothing."""


def main() -> None:
    """Check every page, and return what is wrong with it."""
    program = os.environ.get("CHROMIUM") or next(filter(None, map(shutil.which, CHROMIUM)), None)
    if program is None:
        sys.exit("check_site: no Chromium: install it, or set CHROMIUM to the program")
    server = ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=str(SITE)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    home = f"http://127.0.0.1:{server.server_port}/"
    pages = sorted(path.name for path in SITE.glob("*.html"))
    found = []
    started = time.monotonic()
    with sync_playwright() as tool:
        browser = tool.chromium.launch(executable_path=program, args=["--no-sandbox", "--disable-dev-shm-usage"])
        for scheme, width in LOOKS:
            for name in pages:
                found += [f"{name}, {scheme}, {width} px: {line}" for line in problems(browser, home, name, scheme, width)]
        browser.close()
    if found:
        sys.exit("\n".join(found))
    took, size = time.monotonic() - started, weight(home)
    print(f"{len(pages)} pages looked at in {len(LOOKS)} ways within {took:.0f} s; the first one is {size} bytes, compressed")


def problems(browser: Browser, home: str, name: str, scheme: Any, width: int) -> list[str]:
    """Return what is wrong with one page."""
    context = browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme)
    page = context.new_page()
    said: list[str] = []
    asked: list[str] = []
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("console", lambda message: said.append(message.text) if message.type == "error" else None)
    page.on("request", lambda request: asked.append(request.url))
    page.goto(home + name, wait_until="load")
    said += [f"asks for {url}" for url in asked if not url.startswith((home, "data:", "blob:"))]
    wide = page.evaluate("document.documentElement.scrollWidth - innerWidth")
    if wide > 0:
        said.append(f"{wide} px wider than the window")
    for violation in Axe().run(page).response["violations"]:
        said.append(f"{violation['id']} ({violation['impact']}): " + "; ".join(str(n["target"]) for n in violation["nodes"][:4]))
    if name == "index.html":
        loaded.update(asked)
    context.close()
    return said


loaded: set[str] = set()
"""Requests of the first page."""


def weight(home: str) -> int:
    """Return the size of the first page with all that it loads; too heavy ends the check."""
    files = [SITE / url.removeprefix(home).split("?")[0].split("#")[0] for url in loaded if url.startswith(home)]
    size = sum(len(gzip.compress(path.read_bytes(), 6)) for path in files if path.is_file())
    if size >= HEAVIEST_START:
        sys.exit(f"index.html: found {size} bytes with all that it loads, compressed, allowed below {HEAVIEST_START}")
    return size


if __name__ == "__main__":
    main()
