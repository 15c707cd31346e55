"""Write docs/effects.md from the catalogue of the compiled core.

Run with the project's own Python after a build: `.venv/bin/python scripts/effects_page.py`. A test compares the page with the catalogue.
"""

from __future__ import annotations

from pathlib import Path

from armrs.catalogue import Kind, catalogue

PAGE = Path(__file__).parent.parent / "docs" / "effects.md"
ADDRESS = {"joint": "`joint`", "channel": "`channel`", None: "the whole rig"}


def page() -> str:
    """Return the whole page."""
    kinds = [kind for kind in catalogue().values() if not kind.own]
    places = list(dict.fromkeys(kind.where for kind in kinds))
    blocks = [
        "# The catalogue of effects",
        "Generated from the core by `scripts/effects_page.py`; `armrs effects` prints the same. "
        "`R` is a torque with which a joint resists.",
        f"The catalogue has {len(kinds)} effects. `armrs gap` searches for {sum(kind.searched for kind in kinds)} of them; the sections of "
        "the others say so.",
        "In a model an effect is a table `[[effect]]` with `kind`, where it acts, and its parameters; what is left out takes its default.",
        "Dry friction has a `smoothing`. Above 0 the sign of the speed is `tanh(q̇/smoothing)`: a joint at rest creeps, and an explicit "
        "step must resolve the steep slope at rest. With `smoothing = 0` friction is set-valued: `sgn(q̇)` in motion, and at rest whatever "
        "holds the joint, up to the same torque. Simulation solves that law at any step: joints stick, slip, and switch at located times. "
        "`simulate`, `record` and `sweep` solve it too in place of the default smoothing where that is too steep for the usual step: "
        "[accuracy](conventions.md#accuracy-of-a-simulated-run).",
    ]
    for place in places:
        blocks.append(f"## {place[0].upper()}{place[1:]}")
        blocks += [entry(kind) for kind in kinds if kind.where == place]
    return "\n\n".join(blocks) + "\n"


def entry(kind: Kind) -> str:
    """Return the section of one kind."""
    rows = [f"| `{p.name}` | {p.unit} | {'0 or ' if p.or_zero else ''}{p.min:g} to {p.max:g} | {p.default:g} |" for p in kind.parameters]
    table = "\n".join(["| parameter | unit | allowed | default |", "| --- | --- | --- | --- |", *rows])
    unasked = "" if kind.searched else " `armrs gap` does not search for it: put it into the model, or name it to `identify --with`."
    head = f"### `{kind.kind}`\n{kind.summary}; at: {ADDRESS[kind.address]}.{unasked}"
    return f"{head}\n\n    {kind.formula}\n\nSource: {kind.reference}.\n\n{table}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
