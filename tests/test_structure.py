"""How the package is built: no long functions, no circles of imports, folders that do not know what is above them."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parents[1] / "python" / "armrs"
LONGEST = 80
"""Lines of a function, its docstring with it."""


@cache
def modules() -> dict[str, tuple[ast.Module, str]]:
    """Return syntax and package of every module by its dotted name."""
    found = {}
    for path in PACKAGE.rglob("*.py"):
        parts = ("armrs", *path.relative_to(PACKAGE).with_suffix("").parts)
        is_package = parts[-1] == "__init__"
        name = ".".join(parts[:-1] if is_package else parts)
        found[name] = ast.parse(path.read_text(encoding="utf-8")), name if is_package else name.rpartition(".")[0]
    return found


def imports(name: str) -> set[str]:
    """Return the modules of this package that a module imports anywhere, in functions as well. The root, which loads lazily, is left out."""
    syntax, package = modules()[name]
    found = set()
    for node in ast.walk(syntax):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = package.split(".")[: len(package.split(".")) - node.level + 1]
            origin = ".".join([*base, *([node.module] if node.module else [])])
            found |= {inner if (inner := f"{origin}.{alias.name}") in modules() else origin for alias in node.names}
    return {other for other in found if other in modules() and other not in (name, "armrs")}


def circles() -> Iterator[set[str]]:
    """Yield every set of modules each of which leads to all others."""
    graph = {name: imports(name) for name in modules() if name != "armrs"}

    def reached(start: str) -> set[str]:
        seen: set[str] = set()
        todo = list(graph[start])
        while todo:
            name = todo.pop()
            if name not in seen:
                seen.add(name)
                todo += graph[name]
        return seen

    beyond = {name: reached(name) for name in graph}
    left = {name for name in graph if name in beyond[name]}
    while left:
        first = min(left)
        circle = {other for other in left if other in beyond[first] and first in beyond[other]}
        yield circle
        left -= circle


def test_no_function_is_long() -> None:
    long = [
        f"{name}: {node.name} has {node.end_lineno - node.lineno + 1} lines"
        for name, (syntax, _) in modules().items()
        for node in ast.walk(syntax)
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) and (node.end_lineno or 0) - node.lineno + 1 > LONGEST
    ]
    assert long == []


def test_no_circle_of_imports_has_three_modules() -> None:
    assert [sorted(circle) for circle in circles() if len(circle) > 2] == []


def test_folders_do_not_know_what_is_above_them() -> None:
    """The thesis is known to the command alone, the command to nothing, and what reads files knows no workflow and no report."""
    allowed = {
        "thesis": {"cli"},
        "cli": {"__main__"},
        "montecarlo": {"cli"},
    }
    below = {"io": {"io", "model", "checks", "errors", "catalogue", "rig", "custom_effects"}}
    for name in modules():
        if name == "armrs":
            continue  # it names everything for type checkers, and loads nothing
        room = name.split(".")[1]
        for other in imports(name):
            known = other.split(".")[1]
            if known in allowed and known != room:
                assert room in allowed[known], f"{name} imports {other}"
            if room in below:
                assert known in below[room], f"{name} imports {other}"
