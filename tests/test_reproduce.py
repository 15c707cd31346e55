"""The thesis computed again: one run of the verb, its numbers, and its page in a browser."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from armrs import cli
from browser import opened

NEEDED = {"3.7", *(f"4.{k}" for k in (9, 10, 37, 38, 39, 40, 41))}
"""Tables and figures that some item has to be about."""


def named(title: str) -> set[str]:
    """Return the numbers that a title names; `4.1 to 4.3` names three."""
    found = set(re.findall(r"\b[34]\.\d+", title))
    for chapter, first, last in re.findall(r"(\d)\.(\d+) to \1\.(\d+)", title):
        found |= {f"{chapter}.{k}" for k in range(int(first), int(last) + 1)}
    return found


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("thesis")
    assert cli.main(["reproduce", "-o", str(folder)]) == 0
    return folder


@pytest.fixture(scope="module")
def items(made: Path) -> dict[str, dict[str, Any]]:
    data = json.loads((made / "reproduced.json").read_text(encoding="utf-8"))
    return {item["key"]: item for part in data["parts"] for item in part["items"]}


def test_every_item_says_what_is_printed_what_we_get_and_why(items: dict[str, dict[str, Any]]) -> None:
    assert set().union(*(named(item["title"]) for item in items.values())) >= NEEDED
    for key, item in items.items():
        assert all(len(item[name]) > 20 for name in ("printed", "ours", "why")), key
        assert item["tables"] or item["figures"], key


def test_the_page_is_clicked_through(made: Path, items: dict[str, dict[str, Any]]) -> None:
    with opened(made / "report.html") as seen:
        page = seen.page
        parts = page.eval_on_selector_all("nav button", "buttons => buttons.map(b => b.dataset.part)")
        pictures = films = 0
        for key in parts:
            page.click(f"nav button[data-part={key}]")
            assert page.eval_on_selector_all(".part", "parts => parts.filter(p => !p.hidden).map(p => p.id)") == [key]
            widths = page.eval_on_selector_all(f"#{key} img", "images => images.map(i => i.naturalWidth * (i.offsetWidth > 0))")
            assert all(width > 300 for width in widths)
            pictures += len(widths)
            films += page.locator(f"#{key} .film").count()
        assert pictures == sum(len(item["figures"]) for item in items.values())
        assert films == sum(len(item["animations"]) for item in items.values()) > 0
        assert page.locator("#equations tr").count() > 15
        assert page.locator("article").count() == len(items)


def test_the_animation_moves_stops_and_is_dragged(made: Path) -> None:
    with opened(made / "report.html") as seen:
        page = seen.page
        film = page.locator(".film").first
        page.goto(page.url + "#figures-4.37-4.39")
        assert film.is_visible()

        def pose() -> str:
            return str(film.locator(".stick").last.get_attribute("points"))

        first = pose()
        page.wait_for_function("before => document.querySelector('.film .stick:last-of-type').getAttribute('points') !== before", arg=first)
        film.locator("button").click()
        assert film.locator("button").inner_text() == "Play"
        still = pose()
        page.wait_for_timeout(300)
        assert pose() == still
        film.locator("input").evaluate("slider => { slider.value = slider.max / 2; slider.dispatchEvent(new Event('input')); }")
        assert pose() != still


def test_a_file_in_the_way_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    taken = tmp_path / "taken"
    taken.write_text("", encoding="utf-8")
    assert cli.main(["reproduce", "-o", str(taken)]) == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1
