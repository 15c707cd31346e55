"""The command line `armrs VERB`: the list of verbs, options, exit status.

A verb parses, calls one public function and writes. `main` is the only place that turns errors into lines and exit statuses:
0 done, 1 ran and found something that needs the user, 2 bad input (one line, nothing written).

To add a verb, write a function in the module of its kind and name it in `_VERBS`; its docstring is the help. Return 1 for a finding,
nothing otherwise.
"""

from __future__ import annotations

import copy
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from .. import interruptible
from ..errors import ArmrsError, BadInput, BadInputs, one_line
from ..io import files
from . import fmu, interrupts
from .analysis import gap, identify, passive
from .built_in import demo, reproduce
from .clinic import cohort, spasticity
from .data import convert, effects, report
from .experiments import plan, record, simulate, sweep
from .firmware import export_c
from .own_data import check, import_, init

_VERBS: dict[Callable[..., Any], str] = {
    effects: "Print the catalogue of effects.",
    convert: "Convert between file formats; markers to angles.",
    demo: "Run the whole workflow on built-in data.",
    init: "Write a first data set and model of a person.",
    import_: "Convert recordings into a data set.",
    check: "List every problem of a data set.",
    identify: "Identify segments and joints, with intervals.",
    gap: "Find the effects that a model lacks.",
    simulate: "Simulate a robot that moves the arm.",
    passive: "Compute passive joint moments.",
    spasticity: "Identify stretch reflexes by speed of stretch.",
    cohort: "Summarise many subjects, with norm bands.",
    plan: "Design movements and predict the uncertainty.",
    record: "Run an experiment in the virtual laboratory.",
    sweep: "Simulate and identify many cases.",
    export_c: "Write the arm as C source for firmware.",
    reproduce: "Compute the tables and figures of the thesis.",
    report: "Write one page from any results.",
}
"""With their lines in the list of commands, in its order."""

app = typer.Typer(name="armrs", add_completion=False, rich_markup_mode=None, context_settings={"help_option_names": ["-h", "--help"]})


# Typer brings its own copy of click in newer versions and uses the package in older ones; this is the class that both raise.
_USAGE: type[Exception] = next(c for c in typer.BadParameter.__mro__ if c.__name__ == "ClickException")


def _version(wanted: bool) -> None:
    if wanted:
        import armrs

        print(f"armrs {armrs.__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and end.")] = False,
) -> None:
    """Identify a passive planar arm whose hand a robot guides.

    Simulate the experiment, identify the arm, and find the effects that the model lacks. SI units and radians unless a name says otherwise.

    Exit status: 0 done, 1 done with a finding that needs attention, 2 bad input, 130 interrupted (143 and 129 after SIGTERM and SIGHUP).
    """


for _verb, _line in _VERBS.items():
    app.command(_verb.__name__.rstrip("_").replace("_", "-"), short_help=_line)(_verb)
app.add_typer(fmu.app, name="fmu", short_help="Export the arm as an FMU; inspect and check FMUs.")


def _listed_only() -> None:
    """Stand for a verb that is listed and not run."""


def _with_options_of(verb: str | None) -> typer.Typer:
    """Return the command line with the options of one verb: to read those of all takes a third of the start."""
    light = copy.copy(app)
    light.registered_commands = [copy.copy(info) for info in app.registered_commands]
    for info in light.registered_commands:
        if info.name != verb:
            info.callback = _listed_only
    light.registered_groups = [copy.copy(info) for info in app.registered_groups]
    for group in light.registered_groups:
        if group.name != verb:
            group.typer_instance = typer.Typer()
    return light


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if given in [[], *([group.name] for group in app.registered_groups)]:
        given = [*given, "--help"]
    try:
        command = typer.main.get_command(_with_options_of(next((word for word in given if not word.startswith("-")), None)))
        # Not `command.main`, which turns some errors into exits of its own.
        with command.make_context("armrs", given, obj=tuple(given)) as context:
            result = command.invoke(context)
        sys.stdout.flush()
    except typer.Exit as end:
        return end.exit_code
    except BadInput as error:
        listed = error.problems if isinstance(error, BadInputs) and given[0] in _LISTING else (error,)
        return [_refuse(str(_of_option(one))) for one in listed][-1]
    except ArmrsError as error:
        print(f"armrs: {one_line(error)}", file=sys.stderr)
        return 1
    except _USAGE as error:
        inside = getattr(error, "ctx", None)
        return _refuse(f"{_usage_text(error)} (see {inside.command_path if inside else 'armrs'} --help)")
    except interrupts.Terminated as end:
        print("armrs: terminated", file=sys.stderr)
        return end.status
    except (KeyboardInterrupt, typer.Abort):
        print("armrs: interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The reader of our output has seen enough.
        _turn_away_output()
        return 0
    except MemoryError as error:
        print(f"armrs: not enough memory{': ' if str(error) else ''}{one_line(error)}", file=sys.stderr)
        return 1
    except OSError as error:
        _turn_away_output()
        print(f"armrs: {error.filename or 'output'}: {error.strerror or error}", file=sys.stderr)
        return 1
    return result if isinstance(result, int) else 0


def _turn_away_output() -> None:
    """Send what is left of standard output nowhere, or its last flush would complain."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _prepare_outputs() -> None:
    """Let every text be printed: to an output that was closed, and on terminals that do not know all characters."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115 (for as long as the process lives)
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")


def run() -> tuple[int, bool]:
    """Run the command `armrs`; return its exit status, and whether the process has to end at once, without Python's own end."""
    interrupts.obey()
    _prepare_outputs()
    files.sweep_scratch()
    status = main()
    ended = interrupts.forget()
    # An interpreter that is taken down under a thread of the core may not end in order.
    return status, ended or interruptible.is_working()


_OPTIONS = {
    "with_effects": "--with", "cutoff": "--cutoff-hz", "rate": "--rate-hz", "duration": "--duration-s",
    "robot_speed": "--robot-speed-rad-s", "robot_acceleration": "--robot-acceleration-rad-s2",
    "speed": "--speed-rad-s", "acceleration": "--acceleration-rad-s2", "force": "--force-n",
    **{name: f"--{name}" for name in ("bins", "coupling", "dt", "engine", "evaluations", "integrator", "jobs", "level", "method")},
    **{name: f"--{name}" for name in ("motion", "repeats", "seed")},
    "dt, rate": "--dt, --rate-hz",
}  # fmt: skip
"""What the command line calls an argument of a function."""
_LISTING = ("check", "import")
"""Commands that print a line for every problem; the others print one line."""
_NEVER_IN_FILES = {name: f"--{name}" for name in ("coordinates", "date", "forward", "history", "points", "up")}
"""The same of arguments that are no key of any file, so that a refusal of theirs may say which file they were asked of."""


def _of_option(error: BadInput) -> BadInput:
    """Return a refusal with the name that the argument has on the command line."""
    options = _NEVER_IN_FILES if error.file is not None else _OPTIONS | _NEVER_IN_FILES
    if error.place not in options:
        return error
    return BadInput(options[error.place], error.found, error.allowed, file=error.file, hint=error.hint)


def _refuse(line: str) -> int:
    print(f"armrs: {one_line(line)}", file=sys.stderr)
    return 2


def _usage_text(error: Exception) -> str:
    text: str = getattr(error, "format_message", error.__str__)()
    return text.rstrip(".").replace("Value error, ", "")
