"""What starting costs: which modules `armrs <verb> --help` and a verb load. Imports inside functions are there for this alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

HEAVY = ("numpy", "scipy", "pyarrow", "matplotlib", "jinja2", "rich", "armrs._armrs", "lxml", "sqlite3", "distributed")
"""What costs more than a hundredth of a second to load."""
HELP = {"armrs", "armrs.errors", "armrs.interruptible", "armrs.io", "armrs.io.files", "armrs.report", "armrs.report.console"}
"""The modules of this package that any help text needs, beside those of `armrs.cli`."""

MODEL = """
[arm]
[[arm.segment]]
name = "arm"
length = 0.6
mass = 2.0
com = 0.3
inertia = 0.06
[[arm.joint]]
name = "shoulder"
viscosity = 0.5
"""

PROGRAM = """
import contextlib, io, json, sys
from armrs.cli import main
with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
    status = [main(line) for line in json.loads(sys.argv[1])]
print(json.dumps([status, sorted(sys.modules)]))
"""


def loaded(*lines: list[str], folder: Path | None = None) -> tuple[list[int], set[str]]:
    """Return the statuses of command lines that one new process runs, and the modules that it holds then."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, json.dumps(lines)],
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
        cwd=folder,
        env=os.environ,
    )
    status, modules = json.loads(done.stdout)
    return status, set(modules)


def verbs() -> list[list[str]]:
    """Return the words of every command, those of groups with their group."""
    from typer.main import get_command

    from armrs.cli import app

    found = []
    for name, command in get_command(app).commands.items():  # type: ignore[attr-defined]
        found += [[name, inner] for inner in command.commands] if hasattr(command, "commands") else [[name]]
    return found


def test_help_loads_the_command_line_alone() -> None:
    lines = [["--help"], *([*words, "--help"] for words in verbs())]
    assert len(lines) > 15
    status, modules = loaded(*lines)
    assert set(status) == {0}
    assert {name for name in modules if name.partition(".")[0] == "armrs" and not name.startswith("armrs.cli")} == HELP
    assert modules.isdisjoint(HEAVY)


def test_only_the_options_of_the_verb_that_runs_are_read(capsys: pytest.CaptureFixture[str]) -> None:
    """They are a third of what a start costs; the list of verbs and what is said of a name that is none stay those of all."""
    from typer.main import get_command

    from armrs import cli

    def options(of: str | None) -> dict[str, int]:
        group = get_command(cli._with_options_of(of))
        return {name: len(getattr(command, "commands", command.params)) for name, command in group.commands.items()}  # type: ignore[attr-defined]

    whole = get_command(cli.app)
    names = list(whole.commands)  # type: ignore[attr-defined]
    assert options(None) == dict.fromkeys(names, 0)
    for verb in ("identify", "fmu"):
        assert {name for name, count in options(verb).items() if count} == {verb}
    assert cli.main(["--help"]) == 0
    with whole.make_context("armrs", [], resilient_parsing=True) as context:
        assert capsys.readouterr().out.split() == whole.get_help(context).split()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "model.toml").write_text(MODEL, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(
    ("line", "packages", "without"),
    [
        (["effects"], {"numpy", "armrs._armrs"}, ("armrs.workflows", "armrs.report.html")),
        (["gap", "nothing"], {"numpy", "armrs._armrs"}, ("armrs.report.html", "armrs.thesis", "armrs.montecarlo", "armrs.cosim")),
        (["identify", "nothing"], {"numpy", "armrs._armrs", "sqlite3"}, ("armrs.report.html", "armrs.workflows.gap", "armrs.thesis")),
        (["passive", "nothing"], {"numpy", "armrs._armrs"}, ("armrs.report.html", "armrs.workflows.gap", "armrs.workflows.history")),
        (
            ["simulate", "model.toml", "--trial", "nothing.csv"],
            {"numpy", "armrs._armrs", "pyarrow"},
            ("armrs.report.html", "armrs.report.plotting", "armrs.workflows.gap", "armrs.workflows.record"),
        ),
        (["report", "nothing.json"], {"numpy", "jinja2"}, ("armrs.workflows", "armrs.thesis", "armrs.montecarlo", "armrs.cosim")),
    ],
)
def test_a_verb_loads_only_what_it_uses(folder: Path, line: list[str], packages: set[str], without: tuple[str, ...]) -> None:
    _, modules = loaded(line, folder=folder)
    assert modules & set(HEAVY) <= packages
    assert [name for name in modules for prefix in without if name == prefix or name.startswith(f"{prefix}.")] == []


@pytest.mark.parametrize(("given", "taken"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "2"}, "2")])
def test_numpy_computes_in_one_thread_unless_asked_otherwise(given: dict[str, str], taken: str) -> None:
    """Threads that waited for one another took ten times the processor time of `armrs check` on a busy machine."""
    program = "import os, sys; from armrs.__main__ import main; sys.argv = ['armrs', '--help']\ntry: main()\nfinally: print(os.environ['OPENBLAS_NUM_THREADS'])"
    environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"} | given
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60, env=environment)
    assert done.stdout.splitlines()[-1] == taken
