"""Strings of a result that try to become markup in its report."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import armrs

PAYLOAD = "\"'><evil onevil=1><!-- evil{{ 7*7 }} </style></script>"
CLASSES = {
    "contents",
    "verdict",
    "soft",
    "label",
    "care",
    "wide",
    "wide many",
    "left",
    "data",
    "prior",
    "bound",
    "swipe",
    "broad",
    "tall",
    "broad tall",
}
"""Every class that a report gives to an element."""
# One pixel.
PNG = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108060000001f15c4890000000d49444154789c6360000002000001e221bc330000000049454e44ae426082"
)


class Markup(HTMLParser):
    """Fails where a page has markup that is not that of the templates."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.text: list[str] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        assert tag not in ("evil", "script"), tag
        for name, value in attrs:
            assert name in (
                "alt",
                "aria-label",
                "charset",
                "class",
                "data-head",
                "content",
                "href",
                "http-equiv",
                "id",
                "lang",
                "name",
                "src",
                "tabindex",
            ), name
            assert name != "class" or value in CLASSES, value
            assert name != "href" or str(value).startswith("#part-"), value
            assert name != "src" or str(value).startswith("data:image/png;base64,"), value

    def handle_comment(self, data: str) -> None:
        raise AssertionError(data)

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def places(data: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[tuple[Any, ...], bool]]:
    """Yield where every string of plain data is, and whether it is a key."""
    if isinstance(data, str):
        yield path, False
    elif isinstance(data, dict):
        for key, value in data.items():
            yield (*path, key), True
            yield from places(value, (*path, key))
    elif isinstance(data, list):
        for k, value in enumerate(data):
            yield from places(value, (*path, k))


def mutated(data: Any, path: tuple[Any, ...], is_key: bool) -> Any:
    """Return a copy of plain data with one string that holds markup."""
    data = copy.deepcopy(data)
    inner = data
    for step in path[:-1]:
        inner = inner[step]
    if is_key:
        items = list(inner.items())
        inner.clear()
        inner.update({(f"{key}{PAYLOAD}" if key == path[-1] else key): value for key, value in items})
    else:
        inner[path[-1]] = f"{inner[path[-1]]}{PAYLOAD}"
    return data


def unescaped(result: Path, folder: Path, *, most: int = 4) -> list[str]:
    """Mutate every string of a result, one at a time, and return where its page shows it as anything but text; a refusal is no fault.

    Of lists of objects the first `most` are kept. What moves stands in a file of its own: tests/test_pages.py.
    """
    data = shortened(json.loads(result.read_text(encoding="utf-8")), most)
    data.pop("live", None)
    (folder / "pixel.png").write_bytes(PNG)
    for figure in data.get("figures", []):
        figure["file"] = "pixel.png"
    shown, source, page, faults = 0, folder / "mutated.json", folder / "mutated.html", []
    for path, is_key in places(data):
        source.write_text(json.dumps(mutated(data, path, is_key)), encoding="utf-8")
        try:
            armrs.write_report([source], page)
        except armrs.BadInput:
            continue
        text = page.read_text(encoding="utf-8")
        if "default-src 'none'" not in text.split("<title>")[0].replace("&#39;", "'"):
            faults.append(f"{path}: no policy")
        if "evil49" in text:
            faults.append(f"{path}: evaluated")
        try:
            shown += PAYLOAD.partition("<")[0] in "".join(Markup(text).text)
        except AssertionError as error:
            faults.append(f"{path}: {error}")
    return faults if shown > 5 else [*faults, f"only {shown} strings are shown"]


def shortened(data: Any, most: int) -> Any:
    """Return plain data with no more than the first few of every list of objects."""
    if isinstance(data, dict):
        return {key: shortened(value, most) for key, value in data.items()}
    if isinstance(data, list):
        return [shortened(value, most) for value in (data[:most] if data and isinstance(data[0], dict) else data)]
    return data
