"""The dossier is that of the code: requirements with tests that exist, and bills of materials that list what is built."""

from __future__ import annotations

import json
import runpy
import shutil
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
pytestmark = pytest.mark.skipif(shutil.which("cargo") is None, reason="no cargo")


@pytest.fixture(scope="module")
def script() -> dict[str, Any]:
    return runpy.run_path(str(ROOT / "scripts" / "dossier.py"))


def test_the_dossier_is_current(script: dict[str, Any]) -> None:
    old = [path.name for path, content in script["generated"]().items() if path.read_text(encoding="utf-8") != content]
    assert old == [], "run scripts/dossier.py"


def test_every_requirement_has_a_number_of_its_own_and_a_test(script: dict[str, Any]) -> None:
    entries = script["requirements"]()
    assert [e["id"] for e in entries] == [f"R{k}" for k in range(1, len(entries) + 1)]
    assert all(e["tests"] for e in entries) and len(entries) > 10


def test_a_test_that_does_not_exist_is_refused(script: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "scripts").mkdir()
    (tmp_path / "scripts" / "requirements.toml").write_text(
        '[[requirement]]\nid = "R1"\ntext = "x"\ntests = ["tests/none.py::test_x"]\n', encoding="utf-8"
    )
    script["requirements"].__globals__["ROOT"] = tmp_path
    try:
        with pytest.raises(SystemExit, match=r"R1: found tests/none\.py::test_x, allowed a test that exists"):
            script["requirements"]()
    finally:
        script["requirements"].__globals__["ROOT"] = ROOT


def test_the_bill_of_the_device_lists_its_licences(script: dict[str, Any]) -> None:
    bill = json.loads((ROOT / "docs" / "sbom" / "device.cdx.json").read_text(encoding="utf-8"))
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.6")
    components = {c["name"]: c for c in bill["components"]}
    assert {"libm", "nalgebra", "simba"} <= components.keys()
    assert all(c["licenses"][0]["expression"] and c["version"] in c["purl"] for c in components.values())
