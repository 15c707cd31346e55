"""requirements.lock holds what pyproject.toml asks for."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from packaging.requirements import Requirement

tomllib = pytest.importorskip("tomllib")
ROOT = Path(__file__).parents[1]


def test_the_lock_is_within_what_is_asked_for_and_has_hashes() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    entries = re.sub(r"\\\n", " ", (ROOT / "requirements.lock").read_text(encoding="utf-8")).splitlines()
    locked = [(Requirement(entry.partition("--hash")[0].strip()), entry.count("--hash=sha256:")) for entry in entries if entry.strip()]
    assert all(hashes for _, hashes in locked)
    for asked in map(Requirement, [*project["dependencies"], *project["optional-dependencies"]["files"]]):
        found = [entry.specifier for entry, _ in locked if entry.name == asked.name]
        assert found, f"make lock: {asked} is not in it"
        for specifier in found:
            (version,) = (str(one).removeprefix("==") for one in specifier)
            assert version in asked.specifier, f"make lock: {version} of {asked}"
