"""Write docs/cosim_variables.md from the table of variables of the compiled core.

Run with the project's own Python after a build: `.venv/bin/python scripts/cosim_page.py`. A test compares the page with the table.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from armrs.cosim import Slave, Variable
from armrs.demo import true_model

PAGE = Path(__file__).parent.parent / "docs" / "cosim_variables.md"
HEAD = ("variable", "what it is", "unit", "causality", "variability", "initial")


def page() -> str:
    """Return the whole page."""
    both = {port: Slave(true_model(), port=port).variables for port in ("force", "motion")}
    force, motion = both["force"], both["motion"]
    blocks = [
        "# Variables of the arm as a slave",
        "Generated from the core by `scripts/cosim_page.py`, for an arm of two joints with dry friction in both. "
        "FMI 2.0, FMI 3.0 and `armrs.cosim.Slave` use the same names and value references. Value references depend on arm and port; "
        "the model description of the FMU lists them. [Co-simulation](cosim.md) explains the use of the variables. "
        '"Goes on with" a derivative means: extrapolated with it until the variable is set again.',
        "## Both ports",
        table(v for name, v in force.items() if name in motion),
        "## Force port only",
        table(v for name, v in force.items() if name not in motion),
        "## Motion port only",
        table(v for name, v in motion.items() if name not in force),
    ]
    return "\n\n".join(blocks) + "\n"


def table(variables: Iterable[Variable]) -> str:
    """Return rows of variables."""
    rows = [row(v) for v in variables]
    return "\n".join([f"| {' | '.join(HEAD)} |", "| --- " * len(HEAD) + "|", *rows])


def row(v: Variable) -> str:
    """Return one row."""
    return f"| `{v.name}` | {v.description} | {v.unit} | {v.causality} | {v.variability} | {v.initial or ''} |"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
