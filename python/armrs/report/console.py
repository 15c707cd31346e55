"""What the command line prints: results to standard output, everything else to standard error."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager


def warn(lines: Iterable[str]) -> None:
    """Print warnings, one line each, to standard error."""
    for line in lines:
        print(f"warning: {line}", file=sys.stderr)


def table(head: Sequence[str], rows: Iterable[Sequence[object]], *, left: int = 1) -> None:
    """Print a table of plain text that also reads well in a file or a pipe.

    Parameters
    ----------
    head : sequence of str
        Names of the columns, with units.
    rows : iterable of sequences
        Cells; a float is printed with four significant digits, None as a dash.
    left : int
        Number of leading columns that are aligned to the left.
    """
    cells = [[str(name) for name in head], *([_cell(item) for item in row] for row in rows)]
    widths = [max(len(row[k]) for row in cells) for k in range(len(head))]
    for row in cells:
        aligned = [c.ljust(w) if k < left else c.rjust(w) for k, (c, w) in enumerate(zip(row, widths, strict=True))]
        print("  ".join(aligned).rstrip())


@contextmanager
def progress(what: str, total: int | None = None) -> Iterator[Callable[[int], None]]:
    """Show progress of long work on standard error, when that is a terminal.

    Parameters
    ----------
    what : str
        What is being done.
    total : int, optional
        Number of steps; without it only the time is shown.

    Yields
    ------
    callable
        Call it with the number of steps that were done since the last call.
    """
    if not sys.stderr.isatty():
        yield lambda steps: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    shown = Progress(
        SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), console=Console(stderr=True), transient=True
    )
    with shown:
        task = shown.add_task(what, total=total)
        yield lambda steps: shown.advance(task, steps)


@contextmanager
def stages(what: str) -> Iterator[Callable[[str, float], None]]:
    """Show work that tells its stage and its share, on standard error, when that is a terminal.

    Yields
    ------
    callable
        Call it with the name of the stage and the share that is done, 0 to 1.
    """
    if not sys.stderr.isatty():
        yield lambda stage, share: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    shown = Progress(
        SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), console=Console(stderr=True), transient=True
    )
    with shown:
        task = shown.add_task(what, total=1.0)
        yield lambda stage, share: shown.update(task, description=stage, completed=share)


def _cell(item: object) -> str:
    if item is None:
        return "-"
    return f"{item:.4g}" if isinstance(item, float) else str(item)
