"""Examples of docstrings run and print what they say."""

from __future__ import annotations

import doctest
import importlib
from pathlib import Path

import pytest

import armrs
from armrs import _armrs
from conftest import Session

PACKAGE = Path(armrs.__file__).parent
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
