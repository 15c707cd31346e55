"""Pages as readers use them, in Chromium: accessible by axe-core, light and dark, on a phone and on paper; what moves, moves."""

from __future__ import annotations

import importlib
import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armrs
import patients
import results
from armrs import cli, demo, online
from armrs.report import interactive_series
from armrs.tabular import Tabular
from armrs.workflows import history
from browser import faults_on_paper, faults_on_screens, opened
from results import kinds
from sessions import folder_again
from test_cohort import population, table
from test_docs import DOCS, ROOT, blocks
from test_sweep import EXPERIMENT as ONE_ARM

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def made(slow_arm: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Tabular]]:
    """The report of every verb, in a folder of its name; and a result of every kind but the demonstration, by its class."""
    out = tmp_path_factory.mktemp("pages")
    truth, trial = str(slow_arm / "truth.toml"), str(next((slow_arm / "trials").glob("*.csv")))
    experiment = next(content for _, name, content in blocks(DOCS / "files.md") if name == "EXPERIMENT.toml")
    (out / "EXPERIMENT.toml").write_text(experiment, encoding="utf-8")
    dated = ["--with", "coulomb", "--history", str(out / "history.sqlite"), "--date"]
    assert cli.main(["identify", str(folder_again(slow_arm, out / "before")), *dated, "2026-01-02"]) == 0
    (out / "one.toml").write_text(ONE_ARM, encoding="utf-8")
    (out / "SWEEP.toml").write_text(SWEEP, encoding="utf-8")
    shutil.copytree(ROOT / "examples" / "cosim", out / "cosim")
    assert cli.main(["simulate", truth, "--trial", trial, "-o", str(out / "simulate")]) == 0
    every: list[Any] = []
    for module, function, *arguments in (
        ["workflows.identify", "identify", "identify", str(slow_arm), *dated, "2026-02-02"],
        ["workflows.passive", "passive_moments", "passive", str(slow_arm)],
        ["workflows.record", "record", "record", str(out / "EXPERIMENT.toml")],
        ["workflows.plan", "plan", "plan", truth, "--angles-deg=-80:-20,30:90", "--evaluations", "20"],
        ["montecarlo", "sweep", "sweep", str(out / "SWEEP.toml"), "--jobs", "1"],
        ["cosim.error_estimate", "run_checked", "fmu", "run", str(out / "cosim" / "wall.toml")],
    ):
        place = ["-o", str(out / arguments[0])]
        status, returned = results.behind(importlib.import_module(f"armrs.{module}"), function, *arguments, *place)
        assert status in ((0,) if arguments[0] in ("sweep", "fmu") else (0, 1))
        every.append(returned)
    source = table(out / "cohort.csv", population(np.random.default_rng(3), 12, 2, 1.0, "a"))
    assert cli.main(["cohort", str(source), "-o", str(out / "cohort")]) == 0
    followed = armrs.cohort(source)
    (out / "spasticity").mkdir()
    reflexes = armrs.spasticity(patients.session(patients.Patient(), 7001, emg=True))
    reflexes.report(out / "spasticity" / "report.html")
    for name in ("check", "import", "history", "replay"):
        (out / name).mkdir()
    recordings = [shutil.copy(path, out / "import") for path in sorted((slow_arm / "trials").glob("*.csv"))]
    imported = armrs.import_recordings(recordings, out / "import" / "set", model=slow_arm / "model.toml")
    imported.report(out / "import" / "report.html")
    data = (imported.folder / "dataset.toml").read_text(encoding="utf-8")
    (imported.folder / "dataset.toml").write_text(data.replace('role = "test"', 'role = "fit"'), encoding="utf-8")
    checked = armrs.check_dataset(imported.folder)
    checked.report(out / "check" / "report.html")
    sessions = history.read(out / "history.sqlite")
    sessions.report(out / "history" / "report.html")
    moved = armrs.simulate(demo.true_model(), duration=3.0, start=[-1.0, 0.6], rate=1000.0)
    device = online.Log(moved.t, moved.q, moved.force_on_arm)
    replayed = online.replay(device, demo.given_model(demo.true_model()), every=10)
    replayed.report(out / "replay" / "report.html")
    result = armrs.find_gap(demo.measure_two_speeds(demo.true_model()), separate=False)
    (out / "gap").mkdir()
    result.report(out / "gap" / "report.html")
    every += [result, reflexes, checked, imported, replayed, followed, sessions, moved]
    notebook(out / "notebook", [*every, armrs.load_dataset(slow_arm)])
    cli.main(["report", str(out / "identify" / "identified.json"), "--summary", "-o", str(out / "summary")])
    (out / "summary" / "summary.html").rename(out / "summary" / "report.html")
    both = [str(out / "simulate" / "simulated.json"), str(out / "record" / "record.json")]
    cli.main(["report", *both, "-o", str(out / "both")])
    return out, {type(one).__name__: one for one in every}


@pytest.fixture(scope="module")
def pages(made: tuple[Path, dict[str, Tabular]]) -> Path:
    """The pages of `made`."""
    return made[0]


@pytest.mark.parametrize("kind", [kind.__name__ for kind in kinds() if kind is not armrs.Demonstration])
def test_every_result_is_a_line_a_table_json_a_figure_and_a_page(made: tuple[Path, dict[str, Tabular]], kind: str, tmp_path: Path) -> None:
    """The demonstration's is in tests/test_demo.py."""
    assert results.faults(made[1][kind], tmp_path) == []


def notebook(folder: Path, results: list[Any]) -> None:
    """Write what a notebook shows of results, between the least of a page."""
    folder.mkdir()
    shown = "".join(f"<section>{result._repr_html_()}</section>" for result in results)
    head = '<!doctype html><html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width"><title>x</title></head>'
    (folder / "report.html").write_text(f"{head}<body><main><h1>Results</h1>{shown}</main></body></html>", encoding="utf-8")


EVERY = [
    "simulate",
    "identify",
    "passive",
    "record",
    "plan",
    "gap",
    "cohort",
    "fmu",
    "summary",
    "both",
    "sweep",
    "spasticity",
    "check",
    "import",
    "history",
    "replay",
]
SWEEP = """\
name = "small"
cases = 3
seed = 5
experiment = "one.toml"

[identify]
with = ["coulomb"]

[[vary]]
key = "segment[2].com"
range = [0.9, 1.1]
apply = "scale"
"""


@pytest.mark.parametrize("verb", [*EVERY, "notebook"])
def test_axe_core_finds_nothing_and_nothing_is_wider_than_the_window(pages: Path, verb: str) -> None:
    assert faults_on_screens(pages / verb / "report.html") == []


@pytest.mark.parametrize("verb", EVERY)
def test_nothing_is_cut_on_a4(pages: Path, verb: str) -> None:
    assert faults_on_paper(pages / verb / "report.html") == []


def test_the_summary_of_all_analyses_is_one_page(pages: Path, tmp_path: Path) -> None:
    sources = [str(pages / verb / f"{stem}.json") for verb, stem in (("identify", "identified"), ("passive", "passive"))]
    assert cli.main(["report", *sources, "--summary", "-o", str(tmp_path / "clinic")]) == 0
    margins = dict.fromkeys(("top", "bottom", "left", "right"), "1cm")
    with opened(tmp_path / "clinic" / "summary.html") as seen:
        paper = seen.page.pdf(format="A4", margin=margins, print_background=True)
    assert re.search(rb"/Type /Pages\s[^>]*/Count 1\b|/Count 1\s[^>]*/Type /Pages", paper)


@pytest.mark.parametrize("verb", EVERY)
def test_pictures_say_what_is_seen_and_headings_are_listed(pages: Path, verb: str) -> None:
    with opened(pages / verb / "report.html") as seen:
        texts = seen.page.evaluate("[...document.querySelectorAll('img')].map(i => i.alt)")
        assert all(len(text) > 60 for text in texts)
        if verb != "summary":
            listed = seen.page.evaluate("[...document.querySelectorAll('.contents a')].map(a => document.querySelector(a.hash).innerText)")
            assert listed == seen.page.evaluate("[...document.querySelectorAll('h2[id]')].map(h => h.innerText)")
            assert len(listed) > 2


@pytest.mark.parametrize("verb", ["identify", "passive", "plan", "gap", "spasticity"])
def test_a_sketch_of_the_arm_heads_the_report(pages: Path, verb: str) -> None:
    with opened(pages / verb / "report.html") as seen:
        first = seen.page.evaluate("document.querySelector('img, h2').outerHTML.slice(0, 400)")
        assert first.startswith("<img") and "arm" in first


@pytest.mark.parametrize("verb", [*EVERY, "notebook"])
def test_no_number_has_ten_digits(pages: Path, verb: str) -> None:
    """But seeds, which are exact."""
    with opened(pages / verb / "report.html") as seen:
        seen.page.evaluate("document.querySelectorAll('code').forEach(e => e.remove())")
        cells = seen.page.evaluate("[...document.querySelectorAll('p, li, td, th, figcaption')].map(e => e.innerText)")
        assert [cell for cell in cells if re.search(r"\d[\d.]{9,}", cell) and not cell.isdecimal()] == []


SYMBOLS = {
    "identify": ["m is the mass of a segment, ℓ the distance", "I₁ + m₁·ℓ₁²", "stiffness·rest is the torque of that spring at angle zero"],
    "sweep": ["m is the mass of a segment", "By data is the share"],
    "notebook": ["m is the mass of a segment"],
    "history": ["m is the mass of a segment, ℓ the distance", "p is the probability of a difference at least as large without a change"],
    "cohort": ["Between and within are the standard deviations of subjects and of their sessions"],
    "gap": ["q1 and q2: the angle of joint 1", "Fz: the contact force upward", "In formulas, R is the torque with which a joint resists"],
}


@pytest.mark.parametrize("verb", ["identify", "plan", "sweep"])
def test_every_value_is_seen_on_a_phone(pages: Path, verb: str) -> None:
    """Columns from the fourth on lay beyond the edge."""
    with opened(pages / verb / "report.html", width=390) as seen:
        outside = "[...document.querySelectorAll('.many td')].filter(e => e.getBoundingClientRect().right > 390).map(e => e.innerText)"
        assert seen.page.locator(".many td").count() > 0
        assert seen.page.evaluate(outside) == []


def test_names_of_joints_are_whole_on_a_phone(pages: Path) -> None:
    """The clinician's page had `shou / lder` and `elbo / w` in its first column."""
    broken = """[...document.querySelectorAll('.brief tr > :first-child')].filter(e => {
      const range = document.createRange(); range.selectNodeContents(e); return range.getClientRects().length > 1 }).map(e => e.innerText)"""
    with opened(pages / "summary" / "report.html", width=390) as seen:
        assert seen.page.locator(".brief tbody td:first-child").count() > 0
        assert seen.page.evaluate(broken) == []


def test_keys_break_between_their_parts_on_a_phone(pages: Path) -> None:
    """The table of what a sweep drew had `appli / ed`, `segment[2].c / om` and `joint[2].coulo / mb`."""
    ends = """[...document.querySelectorAll('.wide:not(.many) th, .wide:not(.many) td:first-child')].flatMap(cell => {
      const letters = [], walker = document.createTreeWalker(cell, NodeFilter.SHOW_TEXT);
      while (walker.nextNode()) for (let k = 0; k < walker.currentNode.length; k++) {
        const range = document.createRange(); range.setStart(walker.currentNode, k); range.setEnd(walker.currentNode, k + 1);
        letters.push([walker.currentNode.data[k], range.getBoundingClientRect().top]) }
      return letters.filter((one, k) => k + 1 < letters.length && letters[k + 1][1] > one[1] + 2).map(one => one[0]) })"""
    with opened(pages / "sweep" / "report.html", width=390) as seen:
        assert seen.page.locator(".wide:not(.many) td:first-child").count() > 0
        assert set(seen.page.evaluate(ends)) <= set(" ._/")


@pytest.mark.parametrize("verb", SYMBOLS)
def test_symbols_are_explained_where_they_stand(pages: Path, verb: str) -> None:
    with opened(pages / verb / "report.html") as seen:
        text = seen.page.inner_text("main")
        assert [words for words in SYMBOLS[verb] if words not in text] == []


@pytest.mark.parametrize("verb", ["simulate", "gap", "record"])
def test_arm_and_robot_move(pages: Path, verb: str) -> None:
    with opened(pages / verb / "report.html") as seen:
        film = seen.page.locator(".film")
        before = film.locator(".stick").last.get_attribute("points")
        seen.until("before => [...document.querySelectorAll('.film .stick')].pop().getAttribute('points') !== before", before)
        film.locator("button").click()
        assert film.locator("button").inner_text() == "Play"
        assert film.locator(".key").inner_text().split()[:2] == ["robot", "arm"]


def test_series_are_zoomed_read_and_switched(pages: Path) -> None:
    with opened(pages / "simulate" / "report.html", width=1400) as seen:
        section = seen.page.locator(".series")
        panel = section.locator(".panels svg").first
        ticks = panel.locator(".tick.middle").all_text_contents()
        lines = section.locator("path.line").count()
        section.get_by_label("simulated").uncheck()
        assert section.locator("path.line").count() == lines - 4  # two angles and two forces
        section.get_by_role("button", name="Zoom in").click()
        zoomed = panel.locator(".tick.middle").all_text_contents()
        assert zoomed != ticks
        panel.scroll_into_view_if_needed()
        box = panel.bounding_box()
        seen.page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 60)
        assert re.match(r"\d+\.\d+ s\. shoulder, angle: measured −?\d", section.locator("output").inner_text())
        seen.page.mouse.down()
        seen.page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 60)
        seen.page.mouse.up()
        assert panel.locator(".tick.middle").all_text_contents() not in (ticks, zoomed)
        panel.dblclick()
        assert panel.locator(".tick.middle").all_text_contents() == ticks


def test_effects_are_switched_on_and_off(pages: Path) -> None:
    """Of a run its effects by themselves; of a gap the simulation without each named effect."""
    with opened(pages / "simulate" / "report.html") as seen:
        before = seen.page.locator("path.line").count()
        seen.page.get_by_label("effect: coulomb").check()
        assert seen.page.locator("path.line").count() > before
    with opened(pages / "gap" / "report.html") as seen:
        names = seen.page.evaluate("[...document.querySelectorAll('.series input')].map(i => i.value)")
        assert {"measured", "with the named effects"} < set(names)
        assert any(name.startswith("without Coulomb friction in joint 2") for name in names)
        data = json.loads(seen.page.locator(".series script").text_content())
        force = next(panel for panel in data["panels"] if panel["title"] == "Fy")
        measured, full, without = (
            np.array(next(line["values"] for line in force["lines"] if line["name"].startswith(start)), dtype=float)
            for start in ("measured", "with the named", "without Coulomb friction in joint 2")
        )
        known = np.isfinite(measured)
        assert np.std((full - measured)[known]) < 0.5 * np.std((without - measured)[known])


def test_simulated_and_measured_forces_have_one_sign(pages: Path) -> None:
    """The files hold the force on the robot; the data set around a trial says so."""
    data = json.loads((pages / "simulate" / "figures" / "live.json").read_text(encoding="utf-8"))["series"]
    for panel in data["panels"]:
        if panel["unit"] == "N":
            measured, simulated = (np.array(line["values"], dtype=float) for line in panel["lines"])
            assert np.abs(measured - simulated).mean() < 0.1 * np.abs(simulated).mean()


def test_a_page_with_scripts_runs_none_but_its_own(pages: Path, tmp_path: Path) -> None:
    text = (pages / "simulate" / "report.html").read_text(encoding="utf-8")
    (tmp_path / "added.html").write_text(text.replace("</main>", "<script>document.title = 'ran'</script></main>"), encoding="utf-8")
    titles: list[str] = []
    with pytest.raises(AssertionError), opened(tmp_path / "added.html") as seen:
        titles.append(seen.page.title())
    assert titles == ["armrs report"]


def test_names_in_what_moves_are_text(pages: Path, tmp_path: Path) -> None:
    """A name that tries to be markup, in the file of what moves and in the JSON beside it."""
    result = json.loads((pages / "simulate" / "simulated.json").read_text(encoding="utf-8"))
    live = json.loads((pages / "simulate" / "figures" / "live.json").read_text(encoding="utf-8"))
    evil = "</script><img src=x onerror=\"document.title='ran'\">"
    for place in (live["animation"], live["series"], live["animation"]["chains"][0]):
        place["title" if "title" in place else "name"] = evil
    for panel in live["series"]["panels"]:
        panel["title"] += evil
        panel["lines"][0]["name"] = panel["lines"][0]["colour"] = evil
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "live.json").write_text(json.dumps(live), encoding="utf-8")
    (tmp_path / "r.json").write_text(json.dumps(result | {"figures": []}), encoding="utf-8")
    armrs.write_report([tmp_path / "r.json"], tmp_path / "page.html")
    with opened(tmp_path / "page.html") as seen:
        assert seen.page.title() == "armrs report"
        assert seen.page.locator("img").count() == 0
        assert evil in seen.page.locator(".series h2").inner_text()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda live: live["series"]["panels"][0]["lines"][0]["values"].pop(), "content: found not what a result holds"),
        (lambda live: live.pop("animation"), "live: found no animation and series"),
        (lambda live: live["animation"]["chains"][0].pop("points_m"), "content: found not what a result holds"),
    ],
)
def test_what_moves_is_refused_when_it_is_not_whole(pages: Path, tmp_path: Path, change: Any, message: str) -> None:
    result = json.loads((pages / "simulate" / "simulated.json").read_text(encoding="utf-8"))
    live = json.loads((pages / "simulate" / "figures" / "live.json").read_text(encoding="utf-8"))
    change(live)
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "live.json").write_text(json.dumps(live), encoding="utf-8")
    (tmp_path / "r.json").write_text(json.dumps(result | {"figures": []}), encoding="utf-8")
    with pytest.raises(armrs.BadInput, match=message):
        armrs.write_report([tmp_path / "r.json"], tmp_path / "page.html")
    (tmp_path / "r.json").write_text(json.dumps(result | {"figures": [], "live": "../live.json"}), encoding="utf-8")
    with pytest.raises(armrs.BadInput, match="outside the folder of the result"):
        armrs.write_report([tmp_path / "r.json"], tmp_path / "page.html")


def test_a_long_line_keeps_its_peaks() -> None:
    t = np.linspace(0.0, 100.0, 50_001)
    values = np.where(np.arange(len(t)) == 31_234, 7.0, np.sin(t))
    thinned = interactive_series.series("", "", t, [interactive_series.Panel("", "", (interactive_series.Line("a", "#000", values),))])
    line = thinned["panels"][0]["lines"][0]["values"]
    assert len(line) == len(thinned["t_s"]) <= interactive_series.MOST_SAMPLES
    assert (max(line), min(line)) == (7.0, pytest.approx(-1.0, abs=1e-4))
