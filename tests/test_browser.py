"""The fixture of the browser tests: it sees what it must see."""

from __future__ import annotations

from pathlib import Path

import pytest

from browser import faults_on_screens, opened


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


@pytest.mark.parametrize("pale", ["", '<td style="color: #ddd">pale</td>', '<td>5 <b style="color: #ddd">pale</b></td>'])
def test_one_row_of_every_kind_is_looked_at(tmp_path: Path, pale: str) -> None:
    """A pale cell is found wherever it is; of rows that are alike one is looked at."""
    rows = "".join(f"<tr><td>{k}</td></tr>" for k in range(20))
    path = page(tmp_path, f"<main><h1>x</h1><table><tr><th>n</th></tr>{rows}<tr>{pale}</tr>{rows}</table></main>")
    text = path.read_text(encoding="utf-8").replace(
        "<html><head>", '<html lang="en"><head><title>x</title><meta name="viewport" content="width=device-width">'
    )
    path.write_text(text, encoding="utf-8")
    assert [fault.split(":")[0:2] for fault in faults_on_screens(path)] == (
        [[f"{scheme}, {width} px", " color-contrast"] for scheme in ("light", "dark") for width in (1400, 390)] if pale else []
    )
