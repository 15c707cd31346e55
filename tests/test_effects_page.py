"""The page of the catalogue says what the core says."""

import runpy
from pathlib import Path

SCRIPT = Path(__file__).parent.parent / "scripts" / "effects_page.py"


def test_page_is_that_of_the_core() -> None:
    script = runpy.run_path(str(SCRIPT))
    written = script["PAGE"].read_text(encoding="utf-8")
    assert written == script["page"](), "docs/effects.md is old: run scripts/effects_page.py"
    assert written.count("### `") == sum(not kind.own for kind in script["catalogue"]().values())
