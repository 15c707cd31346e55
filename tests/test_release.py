"""What a release takes: one version everywhere, its notes, and a recipe that asks for what the package asks for."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

import armrs

tomllib = pytest.importorskip("tomllib")
ROOT = Path(__file__).parents[1]
SCRIPT = runpy.run_path(str(ROOT / "scripts" / "release_notes.py"))
OTHER_NAMES = {"matplotlib-base": "matplotlib"}
PLACES = {
    "conda/recipe.yaml": r"^  version: (\S+)$",
    "crates/arm-capi/CMakeLists.txt": r"^project\(armrs VERSION (\S+)",
    "crates/arm-capi/include/armrs.h": r'^#define ARMRS_VERSION "([^"]+)"',
    "docs/sbom/package.cdx.json": r'"ref": "pkg:generic/armrs@([^"]+)"',
    "docs/sbom/device.cdx.json": r'"ref": "pkg:generic/armrs-c@([^"]+)"',
}


def test_one_version_stands_everywhere() -> None:
    crates = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["dependencies"]
    ours = {crate["version"] for name, crate in crates.items() if name.startswith("arm-")}
    found = {name: re.findall(pattern, (ROOT / name).read_text(encoding="utf-8"), flags=re.M) for name, pattern in PLACES.items()}
    assert found == {name: [armrs.__version__] for name in PLACES}
    assert {armrs.__version__} == {*SCRIPT["stated"]().values()} | ours


def test_the_version_has_notes_in_the_changelog() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    notes = SCRIPT["notes"](changelog, armrs.__version__)
    assert notes.startswith(("The", "###")) and "\n## " not in notes


def test_a_version_without_notes_is_refused() -> None:
    with pytest.raises(SystemExit, match=r"CHANGELOG\.md: found no section \[9\.9\.9\]"):
        SCRIPT["notes"]("## [9.9.9] - 2030-01-01\n\n## [0.1.0] - 2026-11-25\n\ntext\n", "9.9.9")


def test_the_conda_recipe_asks_for_what_the_package_asks_for() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = {re.sub(r";.*", "", line).strip() for line in project["dependencies"]}
    recipe = (ROOT / "conda/recipe.yaml").read_text(encoding="utf-8")
    run = recipe.partition("  run:\n")[2].partition("\n\n")[0]
    found = re.findall(r"(?:- |then: )([\w-]+) (>=\S+)", run)
    assert {OTHER_NAMES.get(name, name) + least for name, least in found} == wanted | {f"python{project['requires-python']}"}


def test_every_published_crate_carries_its_licences() -> None:
    published = [
        path.parent for path in (ROOT / "crates").glob("*/Cargo.toml") if "publish.workspace = true" in path.read_text(encoding="utf-8")
    ]
    assert len(published) == 10
    for crate in published:
        for name in ("LICENSE-MIT", "LICENSE-APACHE"):
            assert (crate / name).read_bytes() == (ROOT / name).read_bytes(), crate.name
