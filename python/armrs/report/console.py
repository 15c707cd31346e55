"""Console output: results to standard output, everything else to standard error."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager

FIRST_LINE = 5.0
"""Time after which work that is not shown on a terminal first reports its stage [s]."""


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
    """Show progress of long work on standard error: a bar on a terminal, elsewhere a line now and then.

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
    done = 0

    def advance(steps: int) -> None:
        nonlocal done
        done += steps
        show(what, done)

    with _shown(what, total) as show:
        yield advance


@contextmanager
def stages(what: str) -> Iterator[Callable[[str, float], None]]:
    """Show the stage and the share of work, on standard error, as `progress` does.

    Yields
    ------
    callable
        Call it with the name of the stage and the share that is done, 0 to 1.
    """
    with _shown(what, 1.0) as show:
        yield show


@contextmanager
def _shown(what: str, total: float | None) -> Iterator[Callable[[str, float], None]]:
    """Give what is called with the name of a stage and what of the total is done."""
    if not sys.stderr.isatty():
        with _lines(what, total) as show:
            yield show
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    bar = Progress(
        SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn(), console=Console(stderr=True), transient=True
    )
    with bar:
        task = bar.add_task(what, total=total)
        yield lambda stage, done: bar.update(task, description=stage, completed=done)


@contextmanager
def _lines(what: str, total: float | None) -> Iterator[Callable[[str, float], None]]:
    """Print what is being done and its share after `FIRST_LINE` and then ever more rarely, so that a log of long work stays short."""
    state, begun, ended, wait = (what, 0.0), time.monotonic(), threading.Event(), FIRST_LINE

    def show(stage: str, done: float) -> None:
        nonlocal state
        state = (stage, done)

    def tell() -> None:
        nonlocal wait
        while not ended.wait(wait):
            stage, done = state
            share = f", {100.0 * done / total:.0f} %" if total else ""
            print(f"armrs: {stage}{share}, after {time.monotonic() - begun:.0f} s", file=sys.stderr, flush=True)
            wait *= 2.0

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield show
    finally:
        ended.set()
        teller.join()


def _cell(item: object) -> str:
    if item is None:
        return "-"
    return f"{item:.4g}" if isinstance(item, float) else str(item)
