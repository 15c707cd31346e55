"""Write docs/cli.md from the command line itself.

Run with the project's own Python after a build: `.venv/bin/python scripts/cli_page.py`. A test compares the page with the commands.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from typer.main import get_command

from armrs import cli

PAGE = Path(__file__).parent.parent / "docs" / "cli.md"
HEAD = """# Command line

Generated from the commands by `scripts/cli_page.py`; `armrs VERB --help` prints the same. Exit status: 0 done, 1 done with a finding
that needs attention, 2 bad input (one line on standard error, nothing written). A command writes only below `-o` and to the files given
with `--json` and `--history`.
"""


def page() -> str:
    """Return the whole page."""
    return HEAD + "".join(sections(get_command(cli.app), "armrs"))


def sections(command: Any, name: str) -> Iterator[str]:
    """Yield the section of a command, or those of a group's commands."""
    if hasattr(command, "commands"):
        for below, one in command.commands.items():
            yield from sections(one, f"{name} {below}")
        return
    rows = [row(parameter) for parameter in command.params if parameter.name != "help"]
    arguments = " ".join(shown(p) for p in command.params if kind(p) == "argument")
    options = " [OPTIONS]" if any(kind(p) == "option" for p in command.params) else ""
    table = "\n".join(["| argument or option | default | meaning |", "| --- | --- | --- |", *rows])
    yield f"\n## {name}\n\n    {name}{options} {arguments}".rstrip() + f"\n\n{prose(command.help or '')}\n\n{table}\n"


def kind(parameter: Any) -> str:
    """Return "argument" or "option"."""
    return str(parameter.param_type_name)


def shown(argument: Any) -> str:
    """Return an argument as it stands in the usage line."""
    name = argument.metavar or str(argument.name).upper()
    return name + ("..." if argument.nargs == -1 and not name.endswith(("...", "…")) else "")


def row(parameter: Any) -> str:
    """Return the line of one argument or option."""
    if kind(parameter) == "argument":
        text, default = f"`{shown(parameter)}`", "required" if parameter.required else ""
    else:
        text = ", ".join(f"`{option}`" for option in (*parameter.opts, *parameter.secondary_opts))
        if not parameter.is_flag and parameter.metavar:
            text += f" {parameter.metavar}"
        default = "required" if parameter.required else told(parameter.default)
    return f"| {text} | {default} | {prose(parameter.help or '', one_line=True)} |"


def told(default: Any) -> str:
    """Return a default as a reader needs it; none where leaving the option out means nothing."""
    if default is None or default is False or default == () or callable(default) or str(default).startswith("Sentinel"):
        return ""
    return f"{getattr(default, 'value', default)}"


def prose(text: str, *, one_line: bool = False) -> str:
    """Return help as Markdown: paragraphs and examples, and in a table one line."""
    if one_line:
        return escaped(" ".join(text.split())).replace("|", "\\|")
    parts = [part for part in re.split(r"\n\s*\n", text) if part.strip()]
    return "\n\n".join(example(part) if part.lstrip().startswith("\b") else escaped(" ".join(part.split())) for part in parts)


def example(part: str) -> str:
    """Return lines that stand as they are."""
    return textwrap.indent(textwrap.dedent(part.strip().removeprefix("\b").strip("\n")), "    ")


def escaped(text: str) -> str:
    """Return text of which Markdown makes neither tags nor links."""
    return text.replace("<", "&lt;").replace("[[", "\\[\\[")


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
