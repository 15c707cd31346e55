"""Instructions of kernels and steps are those that bench/speed/counts.json states; the session is counted by `make counts` alone."""

from __future__ import annotations

import json
import runpy
import shutil
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[1]
SCRIPT: dict[str, Any] = runpy.run_path(str(ROOT / "scripts" / "counts.py"))
STATED: dict[str, Any] = json.loads(SCRIPT["STATED"].read_text(encoding="utf-8"))


def reason() -> str | None:
    """Return why nothing can be counted here."""
    program: Path = SCRIPT["PROGRAM"]
    if shutil.which("valgrind") is None:
        return "no program valgrind"
    sources = [path for crate in ("arm-core", "arm-sim", "arm-numerics") for path in (ROOT / "crates" / crate / "src").rglob("*.rs")]
    if not program.exists() or program.stat().st_mtime < max(path.stat().st_mtime for path in sources):
        return "`make counts` has not built its program from these sources"
    if SCRIPT["compiler"]() != STATED["rustc"]:
        return f"counts are stated for rustc {STATED['rustc']}"
    return None


@pytest.mark.skipif(reason() is not None, reason=str(reason()))
def test_kernels_and_steps_need_the_instructions_that_are_stated() -> None:
    stated = STATED["instructions"]
    found = {what: SCRIPT["count"](what) for what in stated if what != SCRIPT["SESSION"]}
    assert len(found) == 7
    assert SCRIPT["judge"](stated, found) == []
    # What notices nothing shows nothing: a step that is counted twice, and one that is 4 % slower.
    for slower in (2.0, 1.04):
        worse = found | {"step_euler": slower * stated["step_euler"]}
        assert [line.partition(":")[0] for line in SCRIPT["judge"](stated, worse)] == ["step_euler"]


@pytest.mark.parametrize(
    ("what", "within", "beyond"), [("step_euler", 1.02, 1.04), ("step_euler", 0.98, 0.96), ("gap_session", 1.09, 1.11)]
)
def test_what_is_out_of_the_band_is_told(what: str, within: float, beyond: float) -> None:
    stated = STATED["instructions"]
    assert SCRIPT["judge"](stated, {what: within * stated[what]}) == []
    (line,) = SCRIPT["judge"](stated, {what: beyond * stated[what]})
    assert line.startswith(f"{what}: found ") and "allowed ±" in line
