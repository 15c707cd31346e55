"""What a tree of sources looks like from outside: the lines of its files and functions, and which module uses which.

Rust is read without a compiler: comments and literals are blanked, so that braces and names stand for themselves.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise
from pathlib import Path

LITERAL = re.compile(
    r"""//[^\n]*
      | /\*.*?\*/
      | b?r(?P<fence>\#*)".*?"(?P=fence)
      | [bc]?"(?:\\.|[^"\\])*"
      | b?'(?:\\(?:u\{[^}]*\}|x..|.)|[^'\\])'
    """,
    flags=re.X | re.S,
)
FUNCTION = re.compile(r"\bfn\s+(\w+)")
PUBLIC_FUNCTION = re.compile(r"\bpub(?:\([^)]*\))?\s+(?:const\s+)?fn\s+(\w+)")
METHOD = re.compile(r"(?:\.|\bSelf::)(\w+)(?:::<[^>]*>)?\(")
INHERENT = re.compile(r"^impl\b(?:(?!\bfor\b)[^{;])*(?=\{)", flags=re.M)
"""An `impl` of a type's own methods; a block of a trait has `for` before its brace."""
TEST_MODULE = re.compile(r"#\[cfg\(test\)\]\s*(?:pub(?:\([^)]*\))?\s+)?mod\s+\w+\s*(?=\{)")
LOADERS = {"importlib", "pkgutil", "runpy"}
USE = re.compile(r"\b(pub(?:\([^)]*\))?\s+)?use\s+([^;]+);")
DEFINED = re.compile(r"(?<![*&])\b(?:fn|struct|enum|trait|type|const|static|union)\s+(\w+)")


def sources(root: Path, folders: Iterable[str], suffix: str) -> list[Path]:
    """Return the files of a language below some folders of a tree; what was built is left out."""
    found = (path for folder in folders for path in (root / folder).rglob(f"*{suffix}"))
    return sorted(path for path in found if "target" not in path.parts)


def long_files(root: Path, files: Iterable[Path], most: int) -> dict[str, int]:
    """Return the lines of the files that have more than `most`."""
    lines = {path.relative_to(root).as_posix(): path.read_text(encoding="utf-8").count("\n") for path in files}
    return {name: count for name, count in lines.items() if count > most}


def long_functions(root: Path, files: Iterable[Path], most: int) -> dict[str, int]:
    """Return the lines of the functions that have more than `most`, from `fn` or `def` to the end; tests of Rust apart."""
    found: dict[str, int] = {}
    for path in files:
        functions = rust_functions(path) if path.suffix == ".rs" else python_functions(path)
        found |= {f"{path.relative_to(root).as_posix()}: {name}": lines for name, lines in functions if lines > most}
    return found


def circles(graph: Mapping[str, set[str]]) -> list[list[str]]:
    """Return every set of modules each of which leads to all others."""

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
    found = []
    while left:
        first = min(left)
        circle = {other for other in left if other in beyond[first] and first in beyond[other]}
        found.append(sorted(circle))
        left -= circle
    return found


# ---- Python
def parsed(path: Path) -> ast.Module:
    """Return the syntax of a Python file."""
    return _syntax(path.read_text(encoding="utf-8"))


@cache
def _syntax(source: str) -> ast.Module:
    """Return the syntax of a source, of which several rules ask."""
    return ast.parse(source)


@dataclass(frozen=True)
class PythonModule:
    """A module by its syntax and the package that its relative imports start from."""

    syntax: ast.Module
    package: str


def python_functions(path: Path) -> Iterator[tuple[str, int]]:
    """Yield name and lines of the functions of a Python file, docstrings with them."""
    todo: list[ast.AST] = [ast.parse(path.read_text(encoding="utf-8"))]
    while todo:
        node = todo.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node.name, (node.end_lineno or node.lineno) - node.lineno + 1
        # No function stands in an expression.
        todo += (child for child in ast.iter_child_nodes(node) if isinstance(child, ast.stmt | ast.excepthandler | ast.match_case))


def python_modules(package: Path) -> dict[str, PythonModule]:
    """Return every module of a package by its dotted name."""
    found = {}
    for path in sorted(package.rglob("*.py")):
        parts = (package.name, *path.relative_to(package).with_suffix("").parts)
        is_package = parts[-1] == "__init__"
        name = ".".join(parts[:-1] if is_package else parts)
        found[name] = PythonModule(parsed(path), name if is_package else name.rpartition(".")[0])
    return found


def python_imports(package: Path) -> dict[str, set[str]]:
    """Return the modules that each module of a package imports, those in functions and those for type checkers as well.

    The root, which loads lazily, is left out.
    """
    graph = _imports(package)
    return {name: used - {package.name} for name, used in graph.items() if name != package.name}


def folder_imports(package: Path) -> dict[str, set[str]]:
    """Return the folders that each folder of a package uses, directly or through modules beside the folders, which are in no circle."""
    graph = python_imports(package)
    folders = {path.name for path in package.iterdir() if path.is_dir()}

    def behind(name: str) -> set[str]:
        folder = name.split(".")[1]
        return {folder} if folder in folders else {found for other in graph[name] for found in behind(other)}

    used: dict[str, set[str]] = {}
    for name, others in graph.items():
        if (folder := name.split(".")[1]) in folders:
            used[folder] = used.get(folder, set()) | {found for other in others for found in behind(other)} - {folder}
    return used


def late_imports(package: Path) -> dict[str, set[str]]:
    """Return the modules that functions of each module of a package import; the modules without any are left out."""
    return {name: used for name, used in _imports(package, late_alone=True).items() if used}


def _imports(package: Path, late_alone: bool = False) -> dict[str, set[str]]:
    modules = python_modules(package)

    def inside(node: ast.AST, late: bool = False) -> Iterator[ast.ImportFrom]:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.ImportFrom) and child.level and (late or not late_alone):
                yield child
            yield from inside(child, late or isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda))

    graph = {}
    for name, module in modules.items():
        used = set()
        for node in inside(module.syntax):
            base = module.package.split(".")
            origin = ".".join([*base[: len(base) - node.level + 1], *([node.module] if node.module else [])])
            used |= {whole if (whole := f"{origin}.{alias.name}") in modules else origin for alias in node.names}
        graph[name] = {other for other in used if other in modules and other != name}
    return graph


def loads_by_name(path: Path) -> bool:
    """Whether a file loads modules by a name that may be anything."""
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = {alias.name for alias in node.names}
            by_name = names & LOADERS if isinstance(node, ast.Import) else node.module in LOADERS and not names <= {"util", "resources"}
        else:
            by_name = isinstance(node, ast.Call) and ast.unparse(node.func) == "__import__"
        if by_name:
            return True
    return False


# ---- Rust
def blanked(source: str) -> str:
    """Return Rust source with blanks for comments, strings and characters, line by line as it was."""
    return LITERAL.sub(lambda found: re.sub(r"[^\n]", " ", found[0]), source)


def block_end(code: str, start: int) -> int:
    """Return where the first block after `start` ends, or the semicolon that stands instead of one."""
    depth = 0
    for place in re.finditer(r"[\[({;})\]]", code[start:]):
        sign = place[0]
        if sign == ";" and depth == 0:
            return start + place.end()
        depth += (sign in "[({") - (sign in "])}")
        if sign == "}" and depth == 0:
            return start + place.end()
    return len(code)


@cache
def bare(source: str) -> str:
    """Return Rust source with blanks for comments, literals and its modules of tests."""
    code = blanked(source)
    while found := TEST_MODULE.search(code):
        end = block_end(code, found.end())
        code = code[: found.start()] + re.sub(r"[^\n]", " ", code[found.start() : end]) + code[end:]
    return code


def rust_functions(path: Path) -> Iterator[tuple[str, int]]:
    """Yield name and lines of the functions of a Rust file, tests apart."""
    code = bare(path.read_text(encoding="utf-8"))
    for found in FUNCTION.finditer(code):
        yield found[1], code.count("\n", found.start(), block_end(code, found.end())) + 1


def calls(code: str, function: str) -> list[str]:
    """Return what a function of bare source calls, in the order in which it stands there."""
    found = next(found for found in FUNCTION.finditer(code) if found[1] == function)
    return re.findall(r"\b([a-z_]\w*)\(", code[found.end() : block_end(code, found.end())])


def folders_of_functions(source: Path) -> dict[str, str]:
    """Return the folder of a crate in which each function is defined; names that are defined more than once are left out."""
    places: dict[str, list[str]] = {}
    for path in sorted(source.rglob("*.rs")):
        for found in FUNCTION.finditer(bare(path.read_text(encoding="utf-8"))):
            places.setdefault(found[1], []).append(path.relative_to(source).parts[0])
    return {name: folders[0] for name, folders in places.items() if len(folders) == 1}


def returns(rooms: Iterable[str]) -> dict[str, int]:
    """Return how often a path comes back to each room that it has left."""
    entered: dict[str, int] = {}
    for before, room in pairwise(["", *rooms]):
        if room != before:
            entered[room] = entered.get(room, -1) + 1
    return entered


def leaves(tree: str) -> Iterator[tuple[list[str], str]]:
    """Yield path and name of everything that a `use` tree names; `a::{b, c as d}` names `a::b` as b and `a::c` as d."""
    head, brace, rest = tree.partition("{")
    if not brace:
        path, _, alias = re.sub(r"\s+", " ", tree).strip().partition(" as ")
        parts = [part.strip() for part in path.split("::") if part.strip()]
        if parts:
            yield parts, alias.strip() or parts[-1]
        return
    before = [part.strip() for part in head.split("::") if part.strip()]
    inner, depth = rest.rpartition("}")[0], 0
    cuts = [-1]
    for place, sign in enumerate(inner):
        depth += (sign == "{") - (sign == "}")
        if sign == "," and depth == 0:
            cuts.append(place)
    for left, right in pairwise([*cuts, len(inner)]):
        for parts, name in leaves(inner[left + 1 : right]):
            yield ([*before, *parts], name) if parts != ["self"] else (before, before[-1] if name == "self" else name)


def variants(path: Path, enum: str) -> set[str]:
    """Return the variants of an enum that a Rust file names outside its tests."""
    code = bare(path.read_text(encoding="utf-8"))
    return set(re.findall(rf"\b{enum}::([A-Z]\w*)", code))


def texts(path: Path) -> set[str]:
    """Return the strings in a Rust file, before its tests."""
    source = path.read_text(encoding="utf-8")
    code = source[: len(TEST_MODULE.split(blanked(source))[0])]
    return {found[0][1:-1] for found in LITERAL.finditer(code) if found[0].startswith('"')}


@dataclass
class RustFile:
    """What a module that is a file of its own says of others."""

    handed_on: dict[str, list[str]] = field(default_factory=dict)
    """The path behind a name of a public `use`."""
    all_of: list[list[str]] = field(default_factory=list)
    """Modules all of whose names are handed on."""
    defined: set[str] = field(default_factory=set)
    paths: list[list[str]] = field(default_factory=list)
    """What its code names, from the crate on."""


def rust_module(path: Path, source: Path) -> tuple[str, ...]:
    """Return the names that lead from the crate to the module in a file."""
    parts = path.relative_to(source).with_suffix("").parts
    return parts[:-1] if parts[-1] in ("mod", "lib", "main") else parts


def absolute(parts: list[str], module: tuple[str, ...], children: set[str]) -> list[str]:
    """Return a path of a module from the crate on, or nothing where it leaves the crate."""
    if parts[0] == "crate":
        return parts[1:]
    if parts[0] in children:
        return [*module, *parts]
    if parts[0] not in ("self", "super"):
        return []
    here, rest = list(module), list(parts)
    while rest and rest[0] in ("self", "super"):
        if rest.pop(0) == "super":
            here = here[:-1]
    return [*here, *rest]


def rust_file(code: str, module: tuple[str, ...], children: set[str]) -> RustFile:
    """Return what blanked source says of other modules."""
    body = re.sub(r"\bmod\s+\w+\s*;", "", USE.sub("", code))
    file = RustFile(defined=set(DEFINED.findall(body)))
    for public, tree in USE.findall(code):
        for parts, name in leaves(tree):
            path = absolute(parts, module, children)
            if public and name == "*":
                file.all_of.append(path[:-1])
            elif public and path:
                file.handed_on[name] = path
            if not public or re.search(rf"\b{re.escape(name)}\b", body):
                file.paths.append(path)
    below = "|".join([*children, "crate", "self", "super"])
    for found in re.findall(rf"(?<![\w:.$])(?:{below})(?:\s*::\s*\w+)+", body):
        file.paths.append(absolute(re.split(r"\s*::\s*", found), module, children))
    return file


def rust_imports(source: Path) -> dict[str, set[str]]:
    """Return which files of a crate each uses: where what it names is defined, not where it is handed on."""
    codes = {rust_module(path, source): bare(path.read_text(encoding="utf-8")) for path in sorted(source.rglob("*.rs"))}
    files = {
        module: rust_file(code, module, {other[-1] for other in codes if other and other[:-1] == module}) for module, code in codes.items()
    }

    def defined_in(path: list[str]) -> tuple[str, ...]:
        module = max((tuple(path[:n]) for n in range(len(path) + 1) if tuple(path[:n]) in files), key=len)
        rest = path[len(module) :]
        if rest and rest[0] in files[module].handed_on:
            return defined_in([*files[module].handed_on[rest[0]], *rest[1:]])
        behind = [tuple(other) for other in files[module].all_of if rest and rest[0] in files[tuple(other)].defined]
        return behind[0] if behind else module

    def name(module: tuple[str, ...]) -> str:
        return "::".join(("crate", *module))

    return {
        name(module): {name(other) for path in file.paths if path and (other := defined_in(path)) != module}
        for module, file in files.items()
    }


def rust_folder_imports(source: Path) -> dict[str, set[str]]:
    """Return the folders and the files beside them that each folder of a crate, and each file beside it, uses; the root is left out."""
    return _between_folders(rust_imports(source))


def rust_folder_calls(source: Path, common: frozenset[str] = frozenset()) -> dict[str, set[str]]:
    """Return the folders of a crate whose methods each folder calls, by names that one public method has and no other function of the crate.

    * `common` - names that types of other crates have as well
    """
    codes = {
        "::".join(("crate", *rust_module(path, source))): bare(path.read_text(encoding="utf-8")) for path in sorted(source.rglob("*.rs"))
    }
    places: dict[str, set[str]] = {}
    public: set[str] = set()
    for module, code in codes.items():
        for name in FUNCTION.findall(code):
            places.setdefault(name, set()).add(module)
        for block in INHERENT.finditer(code):
            public |= set(PUBLIC_FUNCTION.findall(code[block.start() : block_end(code, block.start())]))
    home = {name: next(iter(places[name])) for name in public - common if len(places[name]) == 1}
    called = {module: {home[name] for name in METHOD.findall(code) if name in home} for module, code in codes.items()}
    return _between_folders(called)


def _between_folders(graph: Mapping[str, set[str]]) -> dict[str, set[str]]:
    folders: dict[str, set[str]] = {}
    for module, used in graph.items():
        if module != "crate":
            own = module.split("::")[1]
            folders[own] = folders.get(own, set()) | {other.split("::")[1] for other in used if other != "crate"} - {own}
    return folders
