"""How the project is built: no long functions or files, no circles of imports, folders that do not know what is above them."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import structure
from armrs.catalogue import catalogue

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "python" / "armrs"
CRATES = sorted(path.parent for path in ROOT.glob("*/*/src/lib.rs"))
RUST = structure.sources(ROOT, ("crates", "bench", "examples"), ".rs")
PYTHON = structure.sources(ROOT, ("python", "tests", "scripts", "examples", "bench"), ".py")

LONGEST_FUNCTION = 80
"""Lines of a function, its docstring with it."""
LONGEST_FILE = 600


def is_test(path: Path) -> bool:
    """Whether a Rust file holds tests alone, which list cases."""
    return "tests" in path.parts


def test_no_function_is_long() -> None:
    files = [*PYTHON, *(path for path in RUST if not is_test(path))]
    assert structure.long_functions(ROOT, files, LONGEST_FUNCTION) == {}


def test_no_file_is_long() -> None:
    assert structure.long_files(ROOT, [*RUST, *PYTHON], LONGEST_FILE) == {}


def test_no_circle_in_a_crate() -> None:
    assert len(CRATES) >= 10
    found = [[source.parent.name, *circle] for source in CRATES for circle in structure.circles(structure.rust_imports(source))]
    assert found == []


def test_no_circle_between_the_folders_of_a_crate() -> None:
    """Nor with the files beside them."""
    graphs = {source.parent.name: structure.rust_folder_imports(source) for source in CRATES}
    assert {"selection", "sensitivity", "prepared_session"} <= graphs["arm-gap"].keys()
    assert {name: circles for name, graph in graphs.items() if (circles := structure.circles(graph))} == {}


OFTEN_NAMED = frozenset({"segments", "span"})
"""Methods of `arm-gap` whose names types of other crates have as well."""


def test_the_modules_of_the_gap_workflow_are_in_the_order_that_its_documentation_states() -> None:
    """By what they import and by whose methods they call: types of the first modules have methods in later ones."""
    source = ROOT / "crates" / "arm-gap" / "src"
    stated = (source / "lib.rs").read_text(encoding="utf-8").partition("## Order")[2].partition("\n\n")[0]
    order = re.findall(r"`(\w+)`", stated)
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    assert " ← ".join(order) in page
    imports = structure.rust_folder_imports(source)
    assert sorted(order) == sorted(imports)
    calls = structure.rust_folder_calls(source, OFTEN_NAMED)
    assert len(calls["search"]) > 5
    later = {name: set(order[order.index(name) :]) - {name} for name in order}
    assert {name: found for name in order if (found := (imports[name] | calls.get(name, set())) & later[name])} == {}


def test_a_crate_whose_library_is_not_tested_has_no_tests_in_it() -> None:
    """`test = false` saves a second compilation of a library, and would leave its unit tests unasked."""
    asked = [source.parent for source in CRATES if "\ntest = false" in (source.parent / "Cargo.toml").read_text(encoding="utf-8")]
    assert {"arm-core", "arm-capi", "arm-cosim"} <= {crate.name for crate in asked}
    unit_tests = [path for crate in asked for path in crate.glob("src/**/*.rs") if "cfg(test)" in path.read_text(encoding="utf-8")]
    assert unit_tests == []


def test_no_circle_of_imports_in_the_package() -> None:
    """With those in functions and those for type checkers."""
    assert structure.circles(structure.python_imports(PACKAGE)) == []


def test_no_circle_between_the_folders_of_the_package() -> None:
    """Nor through modules directly below it."""
    folders = structure.folder_imports(PACKAGE)
    assert {"io", "workflows", "report", "cli", "fmu", "cosim"} <= folders.keys()
    assert structure.circles(folders) == []


LATE = {
    "armrs.__main__": {"armrs.cli"},
    "armrs.catalogue": {"armrs"},
    "armrs.fmu.worker": {"armrs.fmu.library_probe", "armrs.fmu.imported_slave"},
    "armrs.report.sentences": {"armrs.workflows.plan"},
    "armrs.workflows.result_data": {"armrs.workflows.importing.recipe"},
}
"""Modules beside the commands that import in functions: a command that is interrupted while it loads ends with one line, effects are listed
where nothing is compiled, a worker loads what its task needs before limits hold, an old result is shown without what computed it, and results of data sets that were
not imported need nothing of the import."""


def test_imports_stand_in_functions_where_starting_asks_for_it_alone() -> None:
    """What the commands load is stated by `test_startup`."""
    late = {name: used for name, used in structure.late_imports(PACKAGE).items() if not name.startswith("armrs.cli")}
    assert late == LATE


def test_modules_are_loaded_by_name_in_two_places() -> None:
    """By the package itself, and by `armrs.view_registry`, the door from results to what draws them: such imports are in no graph."""
    by_name = {p.relative_to(PACKAGE).as_posix() for p in PACKAGE.rglob("*.py") if structure.loads_by_name(p)}
    assert by_name == {"__init__.py", "view_registry.py"}


def test_folders_do_not_know_what_is_above_them() -> None:
    """The thesis is known to the command alone, the command to nothing; what reads files and what is shared know no workflow and no report."""
    allowed = {
        "thesis": {"cli"},
        "cli": {"__main__"},
        "montecarlo": {"cli"},
    }
    shared = {"anthropometry", "catalogue", "checks", "custom_effects", "errors", "model", "result_warnings", "tabular"}
    below = {"io": {"io", "view_registry", *shared}, "analysis": {"analysis", "io", *shared}}
    for name, used in structure.python_imports(PACKAGE).items():
        room = name.split(".")[1]
        for other in used:
            known = other.split(".")[1]
            if known in allowed and known != room:
                assert room in allowed[known], f"{name} imports {other}"
            if room in below:
                assert known in below[room], f"{name} imports {other}"


def test_the_path_of_find_gap_does_not_go_back_and_forth() -> None:
    """From the call in Python to the verdict, by what the functions that lead it call themselves."""
    gap = PACKAGE / "workflows" / "gap"
    asked = [name for part in ("data_checks", "search") for name in re.findall(r"_armrs\.([a-z]\w+)", (gap / f"{part}.py").read_text())]
    assert asked == ["reach", "play", "find_gap"]
    core = ROOT / "crates" / "arm-gap" / "src"
    folders = structure.folders_of_functions(core)
    search = [structure.bare((core / "search" / f"{name}.rs").read_text()) for name in ("rounds", "conclusion")]
    led = [*structure.calls(search[0], "search"), *structure.calls(search[1], "concluded")]
    rooms = ["data", *(folders[name] for name in led if name in folders), "results"]
    assert rooms.count("search") > 5
    assert max(structure.returns(rooms).values()) + len(asked) <= 5


def test_a_parameter_has_three_forms_on_its_way_to_a_report() -> None:
    """Those that the architecture lists, and they exist."""
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    forms = re.findall(r"^\d\. (.+)", page.partition("## The forms of a parameter")[2].partition("\n## ")[0], flags=re.M)
    assert len(forms) == 3
    named = [re.findall(r"`([\w:]+)`(?: of `([\w-]+)`)?", form) for form in forms]
    for path, crate in [named[0][0], named[1][0], *named[2][:2]]:
        folder = ROOT / "crates" / (crate or path.partition("::")[0].replace("_", "-")) / "src"
        defined = {name for source in folder.rglob("*.rs") for name in structure.DEFINED.findall(structure.bare(source.read_text()))}
        assert path.rpartition("::")[2] in defined, path


def test_how_a_search_decides_is_not_in_the_core_for_devices() -> None:
    """What is known of a kind beforehand is; `arm-gap` makes questions and prices of it."""
    core = structure.sources(ROOT, ["crates/arm-core/src"], ".rs")
    policy = re.compile(r"\w*(?:search|candidate|evidence|likelihood|price|score|penalt|verdict|rival|hypothes)\w*", flags=re.I)
    found = {path.name: words for path in core if (words := policy.findall(structure.bare(path.read_text(encoding="utf-8"))))}
    assert len(core) > 50 and found == {}


ALSO_QUANTITIES = {"inertia", "elastic", "force_gain", "angle_offset"}
"""Names of kinds that are also those of other quantities, and as strings say nothing."""

NAMED = {
    "crates/arm-cosim/src/spec.rs": "a sample",
    "crates/arm-gap/src/measurement_model/start.rs": "the torque that holds a joint is a constant moment",
    "crates/arm-model/src/joint.rs": "the keys of a joint are short for effects",
    "crates/arm-py/src/model/parts.rs": "the keys of a joint",
    "crates/arm-sim/src/experiment/sample_experiments.rs": "samples",
}
"""Files that name a kind of effect, and why."""


def test_a_kind_of_effect_is_named_in_its_own_file() -> None:
    """Other code asks a kind for its properties, so that a new one needs no more than its file and a line of the catalogue."""
    own = ROOT / "crates" / "arm-core" / "src" / "effect"
    names = {path.stem for path in own.glob("*.rs")} - {"custom_effect", "custom_effect_absent"}
    kinds = {name.title().replace("_", "") for name in names}
    assert {"Coulomb", "StretchReflex"} <= kinds
    crates = [path for path in RUST if not is_test(path) and own not in path.parents and "examples" not in path.parts]

    def is_named(path: Path) -> bool:
        in_words = structure.texts(path) & {kind.kind for kind in catalogue().values()} - ALSO_QUANTITIES
        return bool(in_words or structure.variants(path, "Kind") & kinds)

    named = {path.relative_to(ROOT).as_posix() for path in crates if is_named(path)}
    assert {name for name in named if name.startswith("crates/")} - {"crates/crosscheck/src/digests.rs"} == set(NAMED)


NAMED_IN_PYTHON = {
    "io/multibody/joints.py": "a rotor is what other formats call armature",
    "io/multibody/mjcf.py": "a fixed tendon is a spring over two joints",
    "io/multibody/osim.py": "the friction that a joint has no key for in OpenSim",
    "io/multibody/urdf.py": "friction of a joint is Coulomb's",
    "report/clinic_lines.py": "the numbers that a clinician reads, in plain words",
    "report/clinic_page.py": "the numbers that a clinician reads, in plain words",
    "report/clinic_quantities.py": "the numbers that a clinician reads, in plain words",
    "demo/run.py": "the brakes that the demo hides",
    "demo/session.py": "the brakes that the demo hides",
    "workflows/plan_stretches.py": "stretches are planned for reflexes",
    "workflows/record.py": "a torque that differs between repeats is a constant moment",
    "workflows/spasticity.py": "what is asked is the reflex",
    "workflows/stiction.py": "the key of a joint for dry friction",
}
"""Modules of the package, but for the thesis, that name a kind of effect, and why."""


def test_python_names_no_kind_of_effect_without_a_reason() -> None:
    """As a string, an attribute or a keyword."""
    kinds = {k.kind for k in catalogue().values()} - ALSO_QUANTITIES
    parts: dict[type[ast.AST], str] = {ast.Constant: "value", ast.Attribute: "attr", ast.keyword: "arg"}
    found = set()
    for path in PACKAGE.rglob("*.py"):
        nodes = [node for node in ast.walk(structure.parsed(path)) if type(node) in parts]
        names = (getattr(node, parts[type(node)]) for node in nodes)
        if path.parent.name != "thesis" and kinds & {name for name in names if isinstance(name, str)}:
            found.add(path.relative_to(PACKAGE).as_posix())
    assert found == set(NAMED_IN_PYTHON)


# ---- that each rule finds what it is for
def tree(root: Path, files: dict[str, str]) -> Path:
    """Write a small tree of sources."""
    for name, content in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(content, encoding="utf-8")
    return root


def test_a_long_function_is_found(tmp_path: Path) -> None:
    rust = """\
fn short() -> [u8; 2] { [0; 2] } // fn in_a_comment() {
trait T { fn declared(&self) -> [u8; 2]; }
fn long<'a>(
    text: &'a str,
) {
    let braces = ["}", r#""}"#, "\\"}"];
    let sign = '}';
    /* } */
}
#[cfg(test)]
mod tests {
    fn long_test() {
        1;
        2;
        3;
    }
}
"""
    python = 'def short(): ...\nclass C:\n    async def long(self):\n        """One.\n\n        Two.\n        """\n'
    root = tree(tmp_path, {"a.rs": rust, "a.py": python})
    files = [root / "a.rs", root / "a.py"]
    assert structure.long_functions(root, files, 4) == {"a.rs: long": 7, "a.py: long": 5}
    assert structure.long_functions(root, files, 7) == {}


def test_a_long_file_is_found(tmp_path: Path) -> None:
    root = tree(tmp_path, {"in/a.rs": "//\n" * 4, "in/b.rs": "//\n" * 3, "in/target/c.rs": "//\n" * 9, "out/d.rs": "//\n" * 9})
    assert structure.long_files(root, structure.sources(root, ["in"], ".rs"), 3) == {"in/a.rs": 4}


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("use crate::b::B;", "use super::a::A;"),
        ("use crate::{c, b::{self}};", "fn f() -> crate::a::A {}"),
        ("use super::B;", "use crate::a;"),
        ("pub use crate::b::B; struct A(B);", "use crate::a::A;"),
        ("use crate::D;", "pub struct D(crate::a::A);"),
    ],
)
def test_a_circle_in_a_crate_is_found(tmp_path: Path, one: str, other: str) -> None:
    """Also where a name is taken from the module that hands it on."""
    root = tree(
        tmp_path, {"lib.rs": "mod a; mod b; mod c; pub use b::B; pub use b::*;", "a.rs": one, "b.rs": other, "c.rs": "use crate::a;"}
    )
    assert structure.circles(structure.rust_imports(root)) == [["crate::a", "crate::b", *(["crate::c"] if "{c" in one else [])]]


def test_a_circle_of_a_module_and_its_part_is_found(tmp_path: Path) -> None:
    root = tree(tmp_path, {"lib.rs": "mod a;", "a/mod.rs": "mod part; fn f() { part::g(); }", "a/part.rs": "use super::f;"})
    assert structure.circles(structure.rust_imports(root)) == [["crate::a", "crate::a::part"]]


def test_a_circle_between_the_folders_of_a_crate_is_found(tmp_path: Path) -> None:
    """Also where no files are in a circle, and through a method that a type has in another folder."""
    files = {"lib.rs": "mod a; mod b; mod c;", "a/mod.rs": "mod x; mod y;", "b/mod.rs": "mod x; mod y;", "a/y.rs": "use crate::b::x::F;"}
    root = tree(tmp_path, {**files, "a/x.rs": "pub struct X;", "b/x.rs": "pub struct F;", "b/y.rs": "use crate::a::x::X;", "c.rs": ""})
    assert structure.circles(structure.rust_imports(root)) == []
    assert structure.circles(structure.rust_folder_imports(root)) == [["a", "b"]]
    method = "use crate::a::x::X;\nimpl<const N: usize> X { pub(crate) fn drawn(&self) {} fn own(&self) {} }"
    tree(tmp_path, {"b/y.rs": method, "c.rs": "fn f(x: X) { x.drawn(); x.own(); }\nimpl Drop for X { pub fn g() {} }", "a/y.rs": "x.g();"})
    assert structure.rust_folder_calls(root) == {"a": set(), "b": set(), "c": {"b"}}
    assert structure.rust_folder_calls(root, frozenset({"drawn"}))["c"] == set()


def test_what_only_looks_like_a_circle_is_none(tmp_path: Path) -> None:
    """Names that are handed on, other crates, comments, text and tests."""
    b = 'use other::a::A; // use crate::a::A;\nconst S: &str = "crate::a::A";\n#[cfg(test)]\nmod tests { use crate::a::A; }'
    root = tree(tmp_path, {"lib.rs": "mod a; mod b; pub use a::A; pub use b::B;", "a.rs": "use crate::B;", "b.rs": b})
    assert structure.rust_imports(root) == {"crate": set(), "crate::a": {"crate::b"}, "crate::b": set()}


def test_a_circle_of_python_modules_is_found(tmp_path: Path) -> None:
    files = {"p/__init__.py": "from . import a", "p/a.py": "from . import b", "p/b.py": "from .c.d import x", "p/c/__init__.py": ""}
    package = tree(tmp_path, {**files, "p/c/d.py": "from ..a import y"}) / "p"
    assert structure.circles(structure.python_imports(package)) == [["p.a", "p.b", "p.c.d"]]
    assert structure.late_imports(package) == {}
    tree(tmp_path, {"p/c/d.py": "if TYPE_CHECKING:\n    from ..a import y\ndef f():\n    from ..a import y\n    import sys\n"})
    assert structure.circles(structure.python_imports(package)) == [["p.a", "p.b", "p.c.d"]]
    assert structure.late_imports(package) == {"p.c.d": {"p.a"}}


def test_a_circle_between_folders_is_found(tmp_path: Path) -> None:
    """Also where no module is in a circle, and through a module beside the folders."""
    files = {f"p/{name}.py": "" for name in ("__init__", "a/__init__", "a/x", "b/__init__", "b/x", "c")}
    package = tree(tmp_path, {**files, "p/a/y.py": "from ..b.x import f", "p/b/y.py": "from ..a import x"}) / "p"
    assert structure.circles(structure.python_imports(package)) == []
    assert structure.circles(structure.folder_imports(package)) == [["a", "b"]]
    tree(tmp_path, {"p/b/y.py": "from .. import c", "p/c.py": "def f():\n    from .a import x\n"})
    assert structure.circles(structure.folder_imports(package)) == [["a", "b"]]
    tree(tmp_path, {"p/c.py": ""})
    assert structure.circles(structure.folder_imports(package)) == []


def test_variants_are_found_outside_tests_alone(tmp_path: Path) -> None:
    source = "fn f() { Kind::Coulomb; } // Kind::Viscous\n#[cfg(test)]\nmod tests { use Kind::Elastic; }"
    assert structure.variants(tree(tmp_path, {"a.rs": source}) / "a.rs", "Kind") == {"Coulomb"}


def test_returns_are_counted_by_room() -> None:
    assert structure.returns("aabacb") == {"a": 1, "b": 1, "c": 0}
    assert structure.calls("fn f() { g(); h(1) } fn g() { f(); }", "f") == ["g", "h"]


def test_strings_are_found_outside_comments_and_tests(tmp_path: Path) -> None:
    source = '// "viscous"\nconst S: &str = "coulomb";\n#[cfg(test)]\nmod tests { const T: &str = "elastic"; }'
    assert structure.texts(tree(tmp_path, {"a.rs": source}) / "a.rs") == {"coulomb"}


def test_what_is_loaded_by_name_is_found(tmp_path: Path) -> None:
    sources = {"a": "import importlib.util", "b": "import importlib", "c": "from pkgutil import resolve_name", "d": "__import__('p')"}
    root = tree(tmp_path, {f"{name}.py": source for name, source in sources.items()})
    assert [p.stem for p in sorted(root.glob("*.py")) if structure.loads_by_name(p)] == ["b", "c", "d"]
