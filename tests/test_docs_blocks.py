"""Every code block of the documentation is run, or read by what it is written for; a page with a block that nothing runs fails."""

from __future__ import annotations

import json
import re
import runpy
import shlex
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import armrs
from armrs import cli, demo
from armrs.io import tomlfile
from armrs.io.dataset import write_dataset
from armrs.io.samples import write_samples
from test_docs import DOCS, ROOT, blocks

SHELL = ("sh", "text")
RUN_ELSEWHERE = {
    "tutorial.md": "test_demo.py, in order",
    "patient.md": "test_patient_page.py, in order, with what it quotes",
    "files.md": "test_docs.py reads every file that is shown",
    "firmware.md": "scripts/walkthrough.py, by make crosscheck; test_export_c.py its first commands; its Python below",
    "index.md": "make demo, which builds",
}
"""Pages by what runs their blocks; those of all others run here."""
RUN_HERE = {
    "README.md",
    "own-data.md",
    "notebooks.md",
    "gap.md",
    "cosim.md",
    "other-tools.md",
    "theory-model.md",
    "developer.md",
    "closed-loop.md",
}


def test_no_page_has_a_block_that_nothing_runs() -> None:
    shown = {page.name for page in (ROOT / "README.md", *DOCS.glob("*.md")) if blocks(page)}
    assert shown == RUN_HERE | set(RUN_ELSEWHERE)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def commands(page: Path) -> Iterator[list[str]]:
    """Yield the words of every command of armrs in a page's blocks."""
    for language, _, content in blocks(page):
        if language in SHELL:
            for line in content.splitlines():
                words = shlex.split(line, comments=True)
                if words[:1] == ["armrs"]:
                    yield words[1:]


@pytest.mark.long
def test_own_data_in_five_commands(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """From a German spreadsheet that was saved as text; and the clinician's page after them, with the norms that the page shows."""
    session = demo.measure_two_speeds(demo.true_model())
    (folder / "recordings").mkdir()
    for number, trial in enumerate(session.trials):
        names = "Zeit [ms];Ellbogen [°];Schulter [°];Kraft z [N];Kraft y [N];Bemerkung"
        values = np.column_stack([1e3 * trial.t, np.degrees(trial.q[:, ::-1]), -trial.force_on_arm[:, ::-1]])
        lines = [";".join(f"{x:.6f}".replace(".", ",") for x in row) + (";Start" if k == 0 else ";") for k, row in enumerate(values)]
        file = folder / "recordings" / f"{trial.configuration}_{number}.csv"
        file.write_bytes("\r\n".join([names, *lines, ""]).encode("cp1252"))
    for language, name, content in blocks(DOCS / "own-data.md"):
        if language == "toml":
            (folder / name).write_text(content, encoding="utf-8")
    verbs = []
    for words in commands(DOCS / "own-data.md"):
        status = cli.main(words)
        assert status in (0, 1), capsys.readouterr().err
        verbs.append(words[0])
    assert verbs == ["init", "import", "check", "identify", "gap", "passive", "report"]
    cli.main(["report", "identified/identified.json", "--summary", "--norms", "norms.toml", "-o", "with-norms"])
    for file in ("session/recording.png", "gap/report.html", "clinic/summary.html", "with-norms/summary.html"):
        assert (folder / file).is_file(), file


@pytest.mark.parametrize(("page", "ends", "drawn"), [("notebooks.md", " N m\n", ["swing.png"]), ("theory-model.md", "", [])])
def test_python_prints_what_its_comments_say(
    page: str, ends: str, drawn: list[str], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    ran = 0
    for language, _, content in blocks(DOCS / page):
        if language == "python":
            exec(compile(content, page, "exec"), {})
            printed = capsys.readouterr().out
            for told in re.findall(r"^print\(.*\)  # (.*)$", content, flags=re.M):
                assert told in printed
            ran += 1
    assert ran
    assert printed.endswith(ends)
    assert all((folder / name).stat().st_size > 10_000 for name in drawn)


def test_python_of_the_firmware_page(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """On two seconds of a log of the demo's arm."""
    truth = demo.true_model()
    demo.given_model(truth).write("identified.toml")
    moved = armrs.simulate(truth, armrs.Movement(np.radians([[-60, 60], [-30, 20], [-60, 60]]), speed=1.0, acceleration=4.0), rate=1000.0)
    columns = [moved.t, *moved.q.T, *moved.force_on_arm.T]
    write_samples(Path("log.csv"), ["t_s", "q1_rad", "q2_rad", "Fy_N", "Fz_N"], columns)
    shown = [(name, content) for language, name, content in blocks(DOCS / "firmware.md") if language == "python"]
    assert len(shown) == 2
    for _, content in shown:
        exec(compile(content, "firmware.md", "exec"), {})
        printed = capsys.readouterr().out
        for said in re.findall(r"^print\(.*\)  # (.*)$", content, flags=re.M):
            assert said in printed
    assert "beyond the limit" in printed and Path("replay.html").is_file()


@pytest.mark.long
def test_a_carried_arm_as_its_page_says(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shown = blocks(DOCS / "closed-loop.md")
    for language, name, content in shown:
        if language == "toml":
            (folder / name).write_text(content, encoding="utf-8")
    for words in commands(DOCS / "closed-loop.md"):
        assert cli.main(words) == 0, capsys.readouterr().err
    assert "less by at least" in capsys.readouterr().out
    (python,) = (content for language, _, content in shown if language == "python")
    exec(compile(python, "closed-loop.md", "exec"), {})
    assert (folder / "supported" / "figures" / "stiffness-reach.png").is_file()


@pytest.mark.long
def test_python_of_the_gap_page(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_dataset(demo.measure_two_speeds(demo.true_model()), "session")
    shutil.copytree("session", "session of another day")
    for language, _, content in blocks(DOCS / "gap.md"):
        assert language == "python"
        names: dict[str, object] = {}
        exec(compile(content, "gap.md", "exec"), names)
        assert isinstance(names["found"], armrs.GapFound)
    assert "5e-06" in capsys.readouterr().out


def test_commands_of_the_fmu_pages(folder: Path) -> None:
    """What FMPy does with the file is in tests/test_fmu.py."""
    shutil.copytree(ROOT / "examples", "examples")
    shutil.copy(ROOT / "examples" / "cosim" / "arm.toml", "arm.toml")
    ran = [*commands(ROOT / "README.md"), *commands(DOCS / "cosim.md"), *commands(DOCS / "other-tools.md")]
    exported = [words for words in ran if words[:2] == ["fmu", "export"]]
    assert len(exported) == 3
    for words in (*exported, ["fmu", "check", "arm.fmu"]):
        assert cli.main(words) == 0


def test_systems_of_the_cosim_page_are_read(folder: Path) -> None:
    """The whole one but for the FMU, which is nobody's; and each partner by itself."""
    from armrs.cosim import system

    whole, partners = (content for language, _, content in blocks(DOCS / "cosim.md") if language == "toml")
    Path("WHOLE.toml").write_text(whole, encoding="utf-8")
    shown = tomlfile.read(Path("WHOLE.toml"))
    assert [slave["name"] for slave in shown["slave"]] == ["arm", "robot", "wall"]
    shutil.copy(ROOT / "examples" / "cosim" / "arm.toml", "arm.toml")
    before, _, after = whole.partition('[[slave]]\nname = "robot"')
    Path("SYSTEM.toml").write_text(before + after[after.index("[[slave]]") :], encoding="utf-8")
    assert system.load_system("SYSTEM.toml")
    Path("path.csv").write_text("t_s,r[1]_m\n0,0\n1,0.1\n", encoding="utf-8")
    for line in filter(None, partners.splitlines()):
        Path("PARTNER.toml").write_text(
            before.split("[[slave]]")[0] + f'[[slave]]\nname = "arm"\nmodel = "arm.toml"\n[[slave]]\nname = "partner"\n{line}\n',
            encoding="utf-8",
        )
        assert system.load_system("PARTNER.toml"), line


def test_the_effect_of_the_developer_guide_fits_the_catalogue() -> None:
    """It names what the law of another kind names, from the same modules; `make guide` compiles it and runs its tests."""
    (_, shown), (of, shaped) = ((name, content) for language, name, content in blocks(DOCS / "developer.md") if language == "rust")
    like = (ROOT / "crates/arm-core/src/effect/quadratic_drag.rs").read_text(encoding="utf-8")
    assert [line for line in shown.splitlines() if line.startswith("use ")] == [
        line for line in like.splitlines() if line.startswith("use ")
    ]
    assert shaped in (ROOT / of.removeprefix("of ")).read_text(encoding="utf-8")
    name, law, entry, line = runpy.run_path(str(ROOT / "scripts" / "developer_guide.py"))["shown"]()
    assert (name, law, entry) == ("crates/arm-core/src/effect/swirl.rs", shown, "swirl::Swirl,")
    assert line.startswith('("swirl", ')
    for _, name, content in blocks(DOCS / "developer.md"):
        for path in re.findall(r"scripts/\w+\.(?:py|sh)", f"{name} {content}"):
            assert (ROOT / path).is_file(), path


@pytest.mark.long
def test_the_session_of_the_developer_guide_names_its_effect(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """With the law of the catalogue that is most like that of the guide, which is compiled by `make guide` alone."""
    demo.true_model().write("truth.toml")
    (shown,) = (content for _, name, content in blocks(DOCS / "developer.md") if name == "swirl.toml")
    text = shown.replace('"swirl"', '"quadratic_drag"').replace("swirl =", "drag =").replace("demo/truth.toml", "truth.toml")
    Path("swirl.toml").write_text(text, encoding="utf-8")
    ran = [words for words in commands(DOCS / "developer.md") if words[0] in ("record", "gap")]
    assert [words[0] for words in ran] == ["record", "gap"]
    for words in ran:
        assert cli.main(words) == 0, capsys.readouterr().err
    named = json.loads(Path("gap/gap.json").read_text(encoding="utf-8"))["effects"]
    assert [(effect["kind"], effect["joint"]) for effect in named] == [("quadratic_drag", 2)]


def test_the_page_of_the_command_line_is_that_of_the_commands() -> None:
    script = runpy.run_path(str(ROOT / "scripts" / "cli_page.py"))
    assert script["PAGE"].read_text(encoding="utf-8") == script["page"](), "docs/cli.md is old: run scripts/cli_page.py"


def test_every_public_name_is_in_the_api() -> None:
    shown = set(re.findall(r"^::: armrs\.(\w+)$", (DOCS / "api.md").read_text(encoding="utf-8"), flags=re.M))
    assert shown == set(armrs.__all__) - {"__version__", "build_profile"}
