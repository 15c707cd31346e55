"""Reports: one page that loads nothing, with everything escaped; what is no result is refused in one line."""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path

import pytest

import armrs
from armrs import BadInput, _armrs, cli
from browser import opened
from markup import PNG, Markup, unescaped

VOID = {"meta", "img", "br", "input", "wbr"}


class Page(HTMLParser):
    """Checks that tags close in order and collects what a browser would load."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.loads: list[str] = []
        self.text: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in VOID:
            self.open.append(tag)
        self.loads += [value or "" for name, value in attrs if name in ("src", "href", "srcset", "data", "action")]
        assert tag not in ("link", "iframe", "object", "base")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)


@pytest.fixture(scope="module")
def results(slow_arm: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("results")
    model, movement = slow_arm / "truth.toml", slow_arm / "movement.toml"
    assert cli.main(["identify", str(slow_arm), "--with", "coulomb", "-o", str(out / "identify")]) == 0
    assert cli.main(["passive", str(slow_arm), "-o", str(out / "passive")]) == 0
    assert cli.main(["simulate", str(model), "--movement", str(movement), "-o", str(out / "simulate")]) == 0
    return out


@pytest.mark.parametrize("verb", ["identify", "passive", "simulate"])
def test_a_page_loads_nothing_and_is_well_formed(results: Path, verb: str) -> None:
    text = (results / verb / "report.html").read_text(encoding="utf-8")
    page = Page(text)
    assert page.loads
    assert all(item.startswith(("data:image/png;base64,", "#part-")) for item in page.loads)
    assert "url(" not in text
    assert "@import" not in text
    assert not re.search(r"https?://", text)
    assert "prefers-color-scheme: dark" in text


def test_the_identification_in_words(results: Path) -> None:
    text = " ".join(Page((results / "identify/report.html").read_text(encoding="utf-8")).text)
    for part in (
        "Synthetic data: simulated, not measured", "(first table). Of the", "The movements determine ", " independent combinations of the segment", "Decided by data: determined by the measurement.", "Decided by prior: determined by the model as given",
        "What cannot be distinguished", "Calibration of the sensors", "What is left", "How to repeat", "armrs identify", "--with coulomb", f"{_armrs.build_profile} build",
        "3 fit trials: ", "1 test trial, not used in any fit: ", "kg m²",
    ):  # fmt: skip
        assert part in text, part


def test_identify_writes_model_json_and_figures(results: Path) -> None:
    folder = results / "identify"
    assert armrs.load_model(folder / "identified.toml").joints[1].coulomb > 0
    result = json.loads((folder / "identified.json").read_text(encoding="utf-8"))
    assert {"method", "status", "rank", "unknowns", "parameters", "combinations", "residual_rms", "model"} <= set(result)
    assert result["model"] == "identified.toml"
    assert {"name", "joint", "kind", "value", "std", "unit", "interval", "decided_by"} <= set(result["parameters"][0])
    assert {e["decided_by"] for e in result["parameters"]} <= {"data", "prior", "bound"}
    for entry in result["figures"]:
        picture = (folder / entry["file"]).read_bytes()
        assert picture.startswith(b"\x89PNG")
        assert len(picture) > 20_000


def test_a_joint_may_have_any_name(slow_arm: Path, tmp_path: Path) -> None:
    folder = tmp_path / "data"
    shutil.copytree(slow_arm, folder)
    for name in ("truth.toml", "model.toml"):
        text = (folder / name).read_text(encoding="utf-8")
        assert 'name = "elbow"' in text
        (folder / name).write_text(text.replace('name = "elbow"', r"name = 'elbow $\frac{1}$ <b> $x^2$'"), encoding="utf-8")
    movement = str(folder / "movement.toml")
    for verb, *source in (["simulate", str(folder / "truth.toml"), "--movement", movement], ["passive", str(folder)]):
        assert cli.main([verb, *source, "-o", str(tmp_path / verb)]) == 0
        assert Page((tmp_path / verb / "report.html").read_text(encoding="utf-8")).loads


def test_identify_without_a_folder_writes_nothing(
    slow_arm: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert cli.main(["identify", str(slow_arm), "--with", "coulomb"]) == 0
    out = capsys.readouterr().out
    assert "decided by" in out
    assert "kg m" in out
    assert list(tmp_path.iterdir()) == []


def test_one_page_of_several_results(results: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sources = [results / "identify/identified.json", results / "passive/passive.json", results / "simulate/simulated.json"]
    assert cli.main(["report", *map(str, sources), "-o", str(tmp_path)]) == 0
    assert capsys.readouterr().out == f"{tmp_path / 'report.html'}\n"
    page = Page((tmp_path / "report.html").read_text(encoding="utf-8"))
    assert next(t for t in page.text if t.startswith(("Identification:", "Passive", "Simulation:"))).startswith("Identification: slow arm")
    assert len(page.loads) >= 4


def test_text_from_files_is_escaped(results: Path, tmp_path: Path) -> None:
    result = json.loads((results / "passive/passive.json").read_text(encoding="utf-8"))
    result["data"]["name"] = "<script>alert(1)</script>"
    result["figures"] = [{"file": "<gone>.png", "title": '"><img src=x>', "text": "&"}]
    (tmp_path / "passive.json").write_text(json.dumps(result), encoding="utf-8")
    text = armrs.write_report([tmp_path / "passive.json"], tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<script" not in text
    assert "&lt;script&gt;" in text
    assert "no longer beside the result" in text
    Page(text)


@pytest.mark.parametrize(("verb", "name"), [("identify", "identified"), ("passive", "passive"), ("simulate", "simulated")])
def test_no_string_of_a_result_becomes_markup(results: Path, tmp_path: Path, verb: str, name: str) -> None:
    assert unescaped(results / verb / f"{name}.json", tmp_path) == []


def test_a_whole_number_that_no_float_holds_is_refused(results: Path, tmp_path: Path) -> None:
    result = json.loads((results / "identify/identified.json").read_text(encoding="utf-8"))
    result["figures"], result["parameters"][0]["std"] = [], 10**400
    (tmp_path / "identified.json").write_text(json.dumps(result), encoding="utf-8")
    with pytest.raises(BadInput, match="found not what a result holds"):
        armrs.write_report([tmp_path / "identified.json"], tmp_path / "report.html")
    assert not (tmp_path / "report.html").exists()


def test_what_decided_a_value_is_no_class_unless_it_is_one_of_ours(results: Path, tmp_path: Path) -> None:
    result = json.loads((results / "identify/identified.json").read_text(encoding="utf-8"))
    result["figures"] = []
    result["parameters"][0]["decided_by"] = 'x" onmouseover="alert(1)'
    (tmp_path / "identified.json").write_text(json.dumps(result), encoding="utf-8")
    text = armrs.write_report([tmp_path / "identified.json"], tmp_path / "report.html").read_text(encoding="utf-8")
    assert "<tr><td" in text
    Markup(text)


def test_a_page_may_load_and_run_nothing(results: Path) -> None:
    """In a browser: the policy lets the styles and pictures of the page in, and stops what is added to it."""
    path = results / "identify/report.html"
    with opened(path) as seen:
        assert seen.page.evaluate("getComputedStyle(document.querySelector('main')).maxWidth") != "none"
        assert seen.page.evaluate("document.querySelector('img').naturalWidth") > 300
    added = path.with_name("added.html")
    added.write_text(
        path.read_text(encoding="utf-8").replace("</main>", "<script>document.title = 'ran'</script></main>"), encoding="utf-8"
    )
    titles, errors = [], []
    with pytest.raises(AssertionError), opened(added) as seen:
        titles.append(seen.page.title())
        errors += seen.errors
    assert titles == ["armrs report"]
    assert any("Content Security Policy" in error for error in errors)


@pytest.mark.parametrize("place", ["../outside.png", "{folder}/outside.png", "link.png"])
def test_a_figure_outside_the_folder_of_the_result_is_refused(results: Path, tmp_path: Path, place: str) -> None:
    result = json.loads((results / "passive/passive.json").read_text(encoding="utf-8"))
    (tmp_path / "outside.png").write_bytes(PNG)
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "link.png").symlink_to(tmp_path / "outside.png")
    result["figures"] = [{"file": place.format(folder=tmp_path), "title": "", "text": ""}]
    (inside / "passive.json").write_text(json.dumps(result), encoding="utf-8")
    with pytest.raises(armrs.BadInput, match="outside the folder of the result"):
        armrs.write_report([inside / "passive.json"], tmp_path / "report.html")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("[arm]\ngravity = 9.81\n", "r.json: file: found no JSON but '[arm]', allowed the JSON of a result that a verb wrote (identified"),
        ("", "r.json: file: found an empty file, allowed the JSON of a result that a verb wrote"),
        ('{"verb": ', "r.json: file: found broken JSON (Expecting value: line 1 column 10 (char 9)), allowed the JSON of a result"),
        ("[]", "r.json: verb: found no key verb, allowed a result of armrs identify, simulate, passive, spasticity, cohort, demo"),
        ('{"verb": "gap2"}', "r.json: verb: found 'gap2', allowed a result of armrs"),
        (
            '{"verb": "identify", "data": {"name": "\\ud800"}}',
            "r.json: file: found half a character, '\\ud800', allowed whole characters",
        ),
        ('{"verb": ["identify"]}', "r.json: verb: found ['identify'], allowed a result of armrs"),
        ('{"verb": "identify"}', "r.json: content: found not what a result holds ('data'), allowed a whole result"),
        ('{"verb": "identify", "data": 3}', "r.json: content: found not what a result holds"),
        ('{"verb": "passive", "data": {"name": "x"}, "curves": [1]}', "r.json: content: found not what a result holds"),
    ],
)
def test_what_is_no_result_is_refused(
    content: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("r.json").write_text(content, encoding="utf-8")
    assert cli.main(["report", "r.json"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert message in err
    assert [p.name for p in tmp_path.iterdir()] == ["r.json"]


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no devices here")
def test_a_device_is_no_figure(results: Path, tmp_path: Path) -> None:
    """`/dev/zero` as a figure was read until memory ended."""
    result = json.loads((results / "passive/passive.json").read_text(encoding="utf-8"))
    os.mkfifo(tmp_path / "pipe.png")
    for file, message in (("/dev/zero", "outside the folder of the result"), ("pipe.png", None)):
        result["figures"] = [{"file": file, "title": "", "text": ""}]
        (tmp_path / "passive.json").write_text(json.dumps(result), encoding="utf-8")
        with pytest.raises(armrs.BadInput, match=message) if message else contextlib.nullcontext():
            armrs.write_report([tmp_path / "passive.json"], tmp_path / "report.html")
    assert "pipe.png" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_a_figure_that_is_no_picture_is_refused(results: Path, tmp_path: Path) -> None:
    result = json.loads((results / "passive/passive.json").read_text(encoding="utf-8"))
    (tmp_path / "secret.txt").write_text("secret", encoding="utf-8")
    result["figures"] = [{"file": "secret.txt", "title": "", "text": ""}]
    (tmp_path / "passive.json").write_text(json.dumps(result), encoding="utf-8")
    with pytest.raises(armrs.BadInput, match="no PNG image"):
        armrs.write_report([tmp_path / "passive.json"], tmp_path / "report.html")
    assert not (tmp_path / "report.html").exists()
