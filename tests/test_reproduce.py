"""The thesis computed again: one run of the verb, its numbers, and its page in a browser."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from armrs import cli
from browser import opened

NEEDED = {"3.5", "3.6", "3.7", "3.9", "3.10", "3.12", *(f"4.{k}" for k in range(1, 42))}
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


def test_arithmetic_on_what_is_printed(items: dict[str, dict[str, Any]]) -> None:
    """Against numbers that were found by hand and by interval arithmetic on the printed digits."""
    values = {key: item["values"] for key, item in items.items()}
    assert values["table-4.3"] == pytest.approx({"m2·l2": 0.1334, "m1·l1": 0.26496, "m1·l1 + a1·m2": 0.70112})
    assert values["equations-3.14-3.20"] == pytest.approx({"l3_m": 0.0747, "l1_m": 0.1899, "l1_printed_m": 0.1442}, abs=6e-5)
    assert values["equations-3.4-3.10"] == pytest.approx({"b11_excess_kgm2": 0.0061, "wrist_torque_Nm": 0.715}, abs=6e-4)
    assert values["tables-4.6-4.8"] == {"deviations_that_disagree": 14, "errors_that_disagree": 23, "errors_printed": 84}


def test_the_virtual_experiments_find_what_was_simulated(items: dict[str, dict[str, Any]]) -> None:
    values = {key: item["values"] for key, item in items.items()}
    for key in ("table-4.4", "table-4.5"):
        assert all(abs(values[key][f"joint_error_percent_{name}"]) < 1.0 for name in ("m1·l1 + a1·m2", "m2·l2"))
    assert all(abs(values["table-4.5"][f"joint_error_percent_{name}"]) < 3.0 for name in ("τp1", "τp2"))
    # Twice the deviation to be expected stays within 1 % for sums of masses and within 3 % for the brakes, with the noise of the sensors.
    for name, limit in {"m1·l1 + a1·m2": 1.0, "m2·l2": 1.0, "τp1": 3.0, "τp2": 3.0}.items():
        assert 2.0 * values["table-4.5"][f"expected_std_percent_{name}"] < limit
    active, led = (values["figures-3.5-3.6"][f"{way}_uV"]["emg_elbow_flexor_uV"] for way in ("voluntary", "led"))
    assert active > 5.0 * led and led == pytest.approx(3.0, rel=0.05)
    hysteresis = values["figure-3.10"]
    assert hysteresis["half_width_Nm"] == pytest.approx(hysteresis["half_width_simulated_Nm"], rel=0.05)
    assert hysteresis["elastic_rms_error_Nm"] < 0.05
    for key in ("equation-5.3", "passive-moment-uncertainty"):
        assert values[key]["jacobian_over_monte_carlo_most_off"] < 0.05
    assert values["tables-4.6-4.8-virtual"]["intervals_that_hold"] >= 0.9 * values["tables-4.6-4.8-virtual"]["intervals"]
    spread = values["figures-D.4-D.5"]
    assert all(0.0 < spread[f"angle_std_{joint}_rad"] < most for joint, most in {"shoulder": 0.05, "elbow": 0.1, "wrist": 0.2}.items())
    slow = values["figure-3.7"]
    assert slow["inertial_most_at_0.25_rad_s_Nm"] == pytest.approx(0.2, abs=0.1)
    assert 0.0027 < slow["velocity_most_at_0.25_rad_s_Nm"] < 0.0082


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
            cut = page.eval_on_selector_all(f"#{key} .wide", "boxes => boxes.filter(b => b.scrollWidth > b.clientWidth + 1).length")
            assert cut == 0, key
            assert "`" not in page.locator(f"#{key}").inner_text()
        assert pictures == sum(len(item["figures"]) for item in items.values())
        assert films == sum(len(item["animations"]) for item in items.values()) > 0
        assert page.locator("#equations tr").count() > 15
        assert page.locator("article").count() == len(items)


def test_links_jump_to_what_they_name(made: Path) -> None:
    """The heading stands below the buttons, which stay where they are."""
    with opened(made / "report.html") as seen:
        page = seen.page
        page.goto(page.url + "#table-4.5")
        top = page.locator("[id='table-4.5'] h2").bounding_box()["y"]
        buttons = page.locator("nav").bounding_box()
        assert buttons["y"] + buttons["height"] <= top < 300
    with opened(made / "report.html", width=400) as seen:
        page = seen.page
        page.click("nav button[data-part=humans]")
        assert page.evaluate("document.documentElement.scrollWidth") <= 400
        page.mouse.wheel(0, 3000)
        page.wait_for_function("scrollY > 500")
        assert page.locator("nav").bounding_box()["y"] < -100  # on a small screen the buttons do not stay in the way


def test_the_robot_holds_the_arm_in_every_frame(made: Path, items: dict[str, dict[str, Any]]) -> None:
    films = [film for item in items.values() for film in item["animations"]]
    for film in films:
        robot, arm = (np.array(chain["points_m"])[:, -1] for chain in film["chains"])
        assert np.hypot(*(robot - arm).T).max() < 0.005  # the contact gives way by 1 mm for 10 N
        assert np.ptp(arm, axis=0).max() > 0.05


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
