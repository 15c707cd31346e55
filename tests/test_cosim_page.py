"""The page of variables says what the core says."""

import runpy
from pathlib import Path

SCRIPT = Path(__file__).parent.parent / "scripts" / "cosim_page.py"


def test_page_is_that_of_the_core() -> None:
    script = runpy.run_path(str(SCRIPT))
    written = script["PAGE"].read_text(encoding="utf-8")
    assert written == script["page"](), "docs/cosim_variables.md is old: run scripts/cosim_page.py"
