"""The tables of docs/performance.md are those of one run, and that run was of the arm that armrs has."""

from __future__ import annotations

import copy
import importlib
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
PEERS = ROOT / "bench" / "peers"


@pytest.fixture
def report(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(PEERS))
    found = importlib.import_module("report")
    if not found.KEPT.exists():
        pytest.skip("no run is kept: bench/peers/report.py out/bench/result.json, after make bench")
    return found


def test_the_tables_are_those_of_the_kept_run(report: Any) -> None:
    written = report.PAGE.read_text(encoding="utf-8")
    assert written.count("### W") >= 7
    assert written == report.page(json.loads(report.KEPT.read_text(encoding="utf-8")), written), "run bench/peers/report.py"


def test_a_run_that_is_not_whole_does_not_reach_the_page(report: Any) -> None:
    whole, written = json.loads(report.KEPT.read_text(encoding="utf-8")), report.PAGE.read_text(encoding="utf-8")
    for change, reason in (
        (lambda run: run["missing"].update({"MuJoCo, C": "no compiler cc"}), "MuJoCo, C: no compiler cc"),
        (lambda run: run["checks"][0].update(agrees=False), "does not agree"),
        (lambda run: run["goals"][0].update(found=None), "not measured"),
    ):
        broken = copy.deepcopy(whole)
        change(broken)
        with pytest.raises(SystemExit, match=reason):
            report.page(broken, written)


def test_other_tools_are_given_the_arm_of_armrs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Moments of inertia had changed in one place only."""
    monkeypatch.syspath_prepend(str(PEERS))
    problem = importlib.import_module("problem")
    source = (ROOT / "crates" / "arm-core" / "src" / "arm" / "sample_arms.rs").read_text(encoding="utf-8")
    body = re.search(r"fn human_arm\(\).*?\n}", source, flags=re.S)
    assert body is not None
    rows = np.array([[float(value) for value in row.split(",")] for row in re.findall(r"segment\(([\d., ]+)\)", body[0])])
    np.testing.assert_array_equal(rows, np.transpose([problem.LENGTH, problem.COM, problem.MASS, problem.INERTIA]))
