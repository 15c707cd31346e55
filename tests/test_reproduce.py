"""The thesis computed again: one run of the verb, its numbers, and its page in a browser."""

from __future__ import annotations

import colorsys
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from armrs import cli
from armrs.thesis.simulated_arms import TABLE_4_10
from browser import OF_COLOURS, ONE_OF_A_KIND, WIDTHS, faults_on_paper, faults_on_screens, opened, violations

pytestmark = pytest.mark.long

NEEDED = {"3.5", "3.6", "3.7", "3.9", "3.10", "3.12", *(f"4.{k}" for k in range(1, 42))}
"""Tables and figures that some item has to be about."""


def named(title: str) -> set[str]:
    """Return the numbers that a title names; `4.1 to 4.3` names three."""
    found = set(re.findall(r"\b[34]\.\d+", title))
    for chapter, first, last in re.findall(r"(\d)\.(\d+) to \1\.(\d+)", title):
        found |= {f"{chapter}.{k}" for k in range(int(first), int(last) + 1)}
    return found


def numbered(text: str) -> set[str]:
    """Return `Figure 4.1`, `Table 4.3`, `Figure B.9` … that a title names, with ranges and lists written out."""
    found = set()
    for word, rest in re.findall(r"\b([Ff]igures?|[Tt]ables?)((?:[ ,;]|and|to|[A-D1-4]\.\d+|\d(?!\.))+(?:of appendix [A-D])?)", text):
        kind = word.rstrip("s").capitalize()
        appendix = re.search(r"of appendix ([A-D])", rest)
        if appendix:
            rest = re.sub(r"\b(\d)\b", rf"{appendix[1]}.\1", rest[: appendix.start()])
        found |= {f"{kind} {name}" for name in re.findall(r"[A-D1-4]\.\d+", rest)}
        for chapter, first, last in re.findall(r"([A-D1-4])\.(\d+) to \1\.(\d+)", rest):
            found |= {f"{kind} {chapter}.{k}" for k in range(int(first), int(last) + 1)}
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
    # A hand of 0.79 · 0.093 m and 0.0061 · 77 kg, a handle of 0.277 kg at 0.0844 m, and at 0.844 m as printed.
    hand, handle = 0.0061 * 77.0, 0.277
    at = [(hand * 0.79 * 0.093 + handle * place) / (hand + handle) for place in (0.0844, 0.844)]
    assert at == pytest.approx([0.0775, 0.3593], abs=5e-5)
    assert values["equations-3.14-3.20"] == pytest.approx(
        {"l3_m": at[0], "l3_printed_m": at[1], "l1_m": 0.1899, "l1_printed_m": 0.1442}, abs=6e-5
    )
    # From the printed digits of table 4.4: 0.003 where 0.005 was given, 0.008 where 0.002 was.
    assert values["table-4.4"]["printed_error_percent_τp2"] == pytest.approx(-40.0)
    assert values["table-4.4"]["printed_error_percent_τp1"] == pytest.approx(300.0)
    assert "−40 and 300 %" in items["table-4.4"]["why"]
    assert values["equations-3.4-3.10"] == pytest.approx({"b11_excess_kgm2": 0.0061, "wrist_torque_Nm": 0.715}, abs=6e-4)
    assert values["tables-4.6-4.8"] == {"deviations_that_disagree": 14, "errors_that_disagree": 23, "errors_printed": 84}


def test_moments_of_inertia_are_those_of_the_lengths_beside_them(items: dict[str, dict[str, Any]]) -> None:
    """By hand from de Leva's transverse radii of gyration, 26.9 and 26.5 % of the length, and 2.71 and 1.62 % of 77 kg."""

    def by_hand(upper: float, forearm: float) -> list[float]:
        return [0.0271 * 77.0 * (0.269 * upper) ** 2, 0.0162 * 77.0 * (0.265 * forearm) ** 2]

    found = [items["table-D.1"]["values"][f"transverse_{k}_kgm2"] for k in (1, 2, 3)]
    assert found[:2] == pytest.approx(by_hand(0.32, 0.25))
    assert [segment.inertia for segment in TABLE_4_10[:2]] == pytest.approx(by_hand(0.322, 0.264))
    assert TABLE_4_10[2].inertia == pytest.approx(0.0016, abs=5e-5)
    for value in found:
        assert f"{value:.4f}" in items["table-D.1"]["ours"]


def test_errors_of_appendix_a_are_computed_as_printed(items: dict[str, dict[str, Any]]) -> None:
    """Equation 5.5 of equation 5.3 at −45° and 55°, with 3 and 10 N, 0.1°, 0.2 N and 0.5 mm."""
    q1, q2, a2 = np.radians(-45.0), np.radians(55.0), 0.239
    angle = np.radians(0.1)
    f1 = a2 * (-np.sin(q1 + q2) * 3.0 + np.cos(q1 + q2) * 10.0)
    f2 = 9.81 * np.cos(q1 + q2) * 0.1334
    of_f1 = f1 * np.sqrt((0.0005 / a2) ** 2 + (angle / q1) ** 2 + (angle / q2) ** 2 + (0.2 / 3.0) ** 2 + (0.2 / 10.0) ** 2)
    of_f2 = f2 * np.sqrt((angle / q1) ** 2 + (angle / q2) ** 2)
    values = items["equation-5.5"]["values"]
    assert values["printed_per_sample_Nm"] == pytest.approx(2.0 * (of_f1 + of_f2))
    assert values["sigma_Nm"] < 0.5 * of_f1
    shown = [row[-1] for row in items["equation-5.5"]["tables"][0]["rows"]]
    assert [float(cell) for cell in shown] == pytest.approx([n * 2.0 * (of_f1 + of_f2) for n in (50, 200, 800, 3200)], abs=0.06)
    share = items["passive-moment-uncertainty"]["values"]["com_share_of_mass_at_shoulder"]
    com, mass = (float(items["passive-moment-uncertainty"]["tables"][0]["rows"][k][1]) for k in (1, 0))
    assert share == pytest.approx(com / mass, abs=0.01)
    assert f"contributes {share:.0%} of what the masses do" in items["passive-moment-uncertainty"]["why"]


THESIS = {
    *(f"Figure 1.{k}" for k in range(1, 4)), *(f"Figure 3.{k}" for k in range(1, 16)), *(f"Figure 4.{k}" for k in range(1, 42)),
    "Table 2.1", *(f"Table 4.{k}" for k in range(1, 11)), *(f"Figure B.{k}" for k in range(1, 10)), *(f"Figure C.{k}" for k in range(1, 7)),
    *(f"Figure D.{k}" for k in range(1, 7)),
}  # fmt: skip
"""Every numbered figure and table of chapters 1 to 4 and figure of the appended papers."""


def test_every_figure_and_table_is_recomputed_or_listed_as_left_out(made: Path, items: dict[str, dict[str, Any]]) -> None:
    data = json.loads((made / "reproduced.json").read_text(encoding="utf-8"))
    about = [item["title"] for item in items.values()]
    left = [row[0] for row in data["left_out"]["rows"]]
    seen = set().union(*map(numbered, (*about, *left)))
    assert THESIS - seen == set()
    assert not set().union(*map(numbered, about)) & set().union(*map(numbered, left))
    assert all(len(row) == 3 and len(row[2]) > 20 for row in data["left_out"]["rows"])
    assert "Timotej Kodek" in data["thesis"] and "2004" in data["thesis"]


def test_printing_gives_every_part(made: Path) -> None:
    with opened(made / "report.html") as seen:
        seen.page.emulate_media(media="print")
        assert seen.page.eval_on_selector_all(".part", "all => all.every(p => p.offsetHeight > 100)")
        assert not seen.page.locator("nav").is_visible()
        assert "Timotej Kodek" in seen.page.inner_text("main")


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


SHOWN_ALONE = """() => {
  const every = window.every ??= [...document.querySelectorAll('.part')];
  every.forEach(part => part.remove());
  document.querySelector('nav').after(every.find(part => !part.hidden));
}"""
"""Takes the parts that are hidden out of the page: axe-core finds nothing in them, and looks for half of its time."""


def test_axe_core_finds_nothing_in_any_part(made: Path) -> None:
    with opened(made / "report.html", width=1400) as seen:
        page = seen.page
        keys = page.eval_on_selector_all("nav button", "buttons => buttons.map(b => b.dataset.part)")
        for width in WIDTHS:
            page.set_viewport_size({"width": width, "height": 900})
            for key in keys:
                page.click(f"nav button[data-part={key}]")
                assert page.evaluate("document.documentElement.scrollWidth") <= width, key
        page.evaluate(ONE_OF_A_KIND)
        for key in keys:
            page.set_viewport_size({"width": 1400, "height": 900})
            page.click(f"nav button[data-part={key}]")
            page.evaluate(SHOWN_ALONE)
            for scheme, width, rules in (("light", 1400, ()), ("dark", 1400, OF_COLOURS), ("dark", 390, ())):
                page.emulate_media(color_scheme=scheme)
                page.set_viewport_size({"width": width, "height": 900})
                assert violations(page, rules) == [], (key, scheme, width)


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
        seen.until("scrollY > 500")
        assert page.locator("nav").bounding_box()["y"] < -100  # on a small screen the buttons do not stay in the way


def test_the_robot_holds_the_arm_in_every_frame(made: Path, items: dict[str, dict[str, Any]]) -> None:
    films = [film for item in items.values() for film in item["animations"]]
    for film in films:
        robot, arm = (np.array(chain["points_m"])[:, -1] for chain in film["chains"])
        assert np.hypot(*(robot - arm).T).max() < 0.005  # the contact gives way by 1 mm for 10 N
        assert np.ptp(arm, axis=0).max() > 0.05


def test_a_caption_calls_colours_what_they_are(items: dict[str, dict[str, Any]]) -> None:
    hues = {"red": (345, 15), "orange": (15, 45), "blue": (190, 250)}
    for film in (film for item in items.values() for film in item["animations"]):
        colours = {chain["name"]: colorsys.rgb_to_hsv(*to_rgb(chain["colour"]))[0] * 360 for chain in film["chains"]}
        for name, word in re.findall(r"(robot|arm) \((\w+)\)", film["text"]):
            low, high = hues[word]
            assert low <= colours[name] <= high, (name, word)
        assert "in red" not in film["text"]


def test_the_animation_moves_stops_and_is_dragged(made: Path) -> None:
    with opened(made / "report.html") as seen:
        page = seen.page
        film = page.locator(".film").first
        page.goto(page.url + "#figures-4.37-4.39")
        assert film.is_visible()

        def pose() -> str:
            return str(film.locator(".stick").last.get_attribute("points"))

        first = pose()
        seen.until("before => document.querySelector('.film .stick:last-of-type').getAttribute('points') !== before", first)
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


def test_the_page_is_read_on_every_screen_and_on_paper(made: Path) -> None:
    assert faults_on_screens(made / "report.html") == []
    assert faults_on_paper(made / "report.html") == []
