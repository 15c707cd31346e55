"""The package itself: what it exports, what importing it costs, and that what the README and the examples show runs."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

import armrs

ROOT = Path(__file__).parents[1]


def python(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a Python process of its own."""
    return subprocess.run([sys.executable, *arguments], capture_output=True, text=True, check=False, cwd=ROOT, timeout=600)


def test_everything_exported_exists() -> None:
    for name in armrs.__all__:
        assert getattr(armrs, name) is not None
    assert set(armrs.__all__) <= set(dir(armrs))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = armrs.nothing


def test_no_module_is_named_like_a_public_function() -> None:
    modules = {path.stem for path in (ROOT / "python/armrs").iterdir()}
    assert modules.isdisjoint(armrs.__all__)


def test_importing_loads_nothing_heavy() -> None:
    heavy = ("numpy", "scipy", "pyarrow", "matplotlib", "typer", "rich", "armrs._armrs")
    done = python("-c", f"import armrs, sys; print([m for m in {heavy!r} if m in sys.modules])")
    assert done.stdout.strip() == "[]", done.stderr


def test_loading_a_model_needs_numpy_at_most() -> None:
    heavy = ("scipy", "pyarrow", "matplotlib", "typer", "rich")
    done = python(
        "-c", f"import armrs, sys; armrs.load_model, armrs.load_dataset, armrs.Arm; print([m for m in {heavy!r} if m in sys.modules])"
    )
    assert done.stdout.strip() == "[]", done.stderr


def test_the_python_of_the_readme_runs() -> None:
    blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / "README.md").read_text(encoding="utf-8"), flags=re.M | re.S)
    assert blocks
    for block in blocks:
        done = python("-W", "error", "-c", block)
        assert done.returncode == 0, done.stderr
        assert done.stdout


@pytest.mark.long
def test_every_example_runs() -> None:
    for path in sorted((ROOT / "examples").rglob("*.py")):
        done = python("-W", "error", str(path))
        assert done.returncode == 0, f"{path}\n{done.stderr}"


def test_every_command_of_the_readme_exists() -> None:
    from typer.main import get_command

    from armrs.cli import app

    named = set(re.findall(r"^\| `armrs ([a-z-]+)", (ROOT / "README.md").read_text(encoding="utf-8"), flags=re.M))
    assert named == set(get_command(app).commands)


def test_modules_of_use_by_themselves_are_attributes() -> None:
    done = subprocess.run(
        [sys.executable, "-c", "import armrs; print(armrs.demo.true_model().n_joints, armrs.cosim.Slave.__name__)"],
        capture_output=True, text=True, check=True, timeout=60,
    )  # fmt: skip
    assert done.stdout == "2 Slave\n"


def test_what_make_installs_reads_c3d() -> None:
    (files,) = re.findall(r"^files = \[(.*)\]$", (ROOT / "pyproject.toml").read_text(encoding="utf-8"), flags=re.M)
    assert '"ezc3d' in files
    lines = re.findall(r"maturin develop (.*)", (ROOT / "Makefile").read_text(encoding="utf-8"))
    assert lines and all("files" in line.partition("--extras ")[2].split()[0].rstrip(";").split(",") for line in lines)
