"""Examples of docstrings and of crates run and print what they say."""

from __future__ import annotations

import doctest
import importlib
from pathlib import Path

import pytest

import armrs
from armrs import _armrs
from conftest import Session

PACKAGE = Path(armrs.__file__).parent
CRATES = Path(__file__).parents[1] / "crates"
WITH_EXAMPLES = [
    ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts)
    for path in sorted(PACKAGE.rglob("*.py"))
    if ">>>" in path.read_text(encoding="utf-8")
]


def failed(tests: list[doctest.DocTest]) -> str:
    """Run examples, and return what those that fail printed."""
    runner, said = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS), []
    for test in tests:
        runner.run(test, out=said.append)
    return "".join(said)


@pytest.mark.parametrize("name", WITH_EXAMPLES)
def test_the_examples_of_a_module_run(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a folder with a data set, `session`."""
    Session(tmp_path / "session")
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module(name.removesuffix(".__init__"))
    tests = doctest.DocTestFinder(exclude_empty=True).find(module, extraglobs={"armrs": armrs})
    tests = [test for test in tests if test.examples]
    assert tests
    assert failed(tests) == ""


def test_the_examples_of_the_core_run() -> None:
    tests = [
        doctest.DocTestParser().get_doctest(item.__doc__, {"armrs": armrs}, name, None, None)
        for name, item in vars(_armrs).items()
        if ">>>" in (getattr(item, "__doc__", None) or "")
    ]
    assert len(tests) >= 10
    assert failed(tests) == ""


def test_every_crate_has_a_readme_whose_example_runs() -> None:
    """As a test of its documentation; that of the bindings is Python, and the program for digests shows commands."""
    crates = {path.parent.name: path.parent for path in CRATES.glob("*/Cargo.toml")}
    readmes = {name: (crate / "README.md").read_text(encoding="utf-8") for name, crate in crates.items()}
    assert len(readmes) >= 12 and all("```" in text for text in readmes.values())
    sources = {path.parts[-3]: path.read_text(encoding="utf-8") for path in CRATES.glob("*/src/lib.rs")}
    run = {name for name, source in sources.items() if 'include_str!("../README.md")' in source}
    assert {*crates} - run == {"arm-py", "crosscheck"}
    shown = "".join(line for line in readmes["arm-py"].splitlines(keepends=True) if not line.startswith("```"))
    test = doctest.DocTestParser().get_doctest(shown, {}, "README.md", None, None)
    assert test.examples and failed([test]) == ""
