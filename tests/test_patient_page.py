"""The page that follows a patient: its commands, in order, and what it quotes of their output."""

from __future__ import annotations

import html
import re
import shlex
from pathlib import Path

import pytest

from armrs import cli
from test_docs import DOCS, blocks


@pytest.mark.long
def test_the_page_runs_and_prints_what_it_shows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    printed, verbs = "", []
    for language, name, content in blocks(DOCS / "patient.md"):
        if language == "toml":
            Path(name).write_text(content, encoding="utf-8")
        elif language == "text":
            said = html.unescape(re.sub("<[^>]+>", "", Path(name).read_text(encoding="utf-8"))) if name else printed
            assert [line for line in content.splitlines() if line not in said] == []
        for line in content.splitlines() if language == "sh" else ():
            program, *arguments = shlex.split(line)
            if program == "cat":
                *sources, mark, target = arguments
                assert mark == ">"
                Path(target).write_text("".join(Path(source).read_text(encoding="utf-8") for source in sources), encoding="utf-8")
                continue
            assert program == "armrs"
            verbs.append(arguments[0])
            assert cli.main(arguments) == 0, capsys.readouterr().err
            printed += capsys.readouterr().out
    assert verbs[:7] == ["init", "plan", "record", "check", "spasticity", "passive", "report"]
    assert Path("page-1/summary.html").is_file()
