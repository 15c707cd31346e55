"""Print the section of CHANGELOG.md that belongs to a version, for the notes of its release: `scripts/release_notes.py v0.1.0`.

A version that is not that of Cargo.toml and CITATION.cff, or that has no section, is refused.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
STATED = {"Cargo.toml": r'^version = "([^"]+)"', "CITATION.cff": r"^version: (\S+)"}
"""Files that state the version, with where it stands."""


def main() -> None:
    """Print the notes."""
    if len(sys.argv) != 2:
        sys.exit("release_notes: found no version, allowed one: release_notes.py v0.1.0")
    version = sys.argv[1].removeprefix("v")
    for file, found in stated().items():
        if found != version:
            sys.exit(f"release_notes: {file}: found version {found}, allowed {version}")
    print(notes((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), version))


def stated() -> dict[str, str]:
    """Return the version that each file states."""
    texts = {file: (ROOT / file).read_text(encoding="utf-8") for file in STATED}
    return {file: re.search(STATED[file], text, flags=re.M)[1] for file, text in texts.items()}  # type: ignore[index]


def notes(changelog: str, version: str) -> str:
    """Return the text below the heading of a version."""
    for section in re.split(r"^## ", changelog, flags=re.M)[1:]:
        heading, _, text = section.partition("\n")
        if heading.startswith(f"[{version}] - ") and text.strip():
            return text.strip()
    sys.exit(f"release_notes: CHANGELOG.md: found no section [{version}] with a date and text")


if __name__ == "__main__":
    main()
