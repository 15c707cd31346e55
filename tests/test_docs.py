"""The tutorial is run as it stands."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from armrs import cli

DOCS = Path(__file__).parents[1] / "docs"
BLOCK = re.compile(r"^```(sh|toml)(?: (\S+))?\n(.*?)^```", flags=re.M | re.S)


def test_the_tutorial_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    text = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    verbs = []
    for language, name, content in BLOCK.findall(text):
        if language == "toml":
            Path(name).write_text(content, encoding="utf-8")
            continue
        for line in content.splitlines():
            program, *arguments = shlex.split(line)
            assert program == "armrs"
            assert cli.main(arguments) == 0, capsys.readouterr().err
            verbs.append(arguments[0])
    assert set(verbs) == {"demo", "passive", "identify", "simulate", "report"}
    for file in re.findall(r"`([a-z]+/[a-z./]+)`", text):
        if not file.startswith("examples/"):
            assert Path(file).exists(), file


def test_every_effect_and_command_that_documents_name_exists() -> None:
    from typer.main import get_command

    known = set(get_command(cli.app).commands)
    for page in DOCS.glob("*.md"):
        named = set(re.findall(r"`armrs ([a-z]+)", page.read_text(encoding="utf-8")))
        assert named <= known, page
