"""The fixture of the browser tests: it sees what it must see."""

from __future__ import annotations

from pathlib import Path

import pytest

from browser import opened


def page(tmp_path: Path, body: str) -> Path:
    path = tmp_path / "page.html"
    path.write_text(f'<!doctype html><html><head><meta charset="utf-8"></head><body>{body}</body></html>', encoding="utf-8")
    return path


def test_a_page_that_is_whole(tmp_path: Path) -> None:
    with opened(
        page(tmp_path, '<p>here</p><img src="data:image/gif;base64,R0lGODlhAQABAIAAAAAAAP///yH5BAEAAAAALAAAAAABAAEAAAIBRAA7">')
    ) as seen:
        assert seen.page.inner_text("p") == "here"


@pytest.mark.parametrize(
    "body", ["<script>nothing.there()</script>", '<img src="https://example.org/a.png">', "<script>console.error('x')</script>"]
)
def test_a_page_that_is_not(tmp_path: Path, body: str) -> None:
    path = page(tmp_path, body)
    with pytest.raises(AssertionError), opened(path):
        pass
