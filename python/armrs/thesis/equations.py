"""The table of equations, functions and tests; it is kept in `equations.md` beside this file."""

from __future__ import annotations

from pathlib import Path

PAGE = Path(__file__).with_name("equations.md")


def rows() -> list[list[str]]:
    """Return head and rows of the table, cells as they stand in the page."""
    lines = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return [row for row in cells if not set("".join(row)) <= set("- ")]
