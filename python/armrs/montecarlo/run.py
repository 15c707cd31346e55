"""Running a sweep: which cases exist already, which processes compute the others, and the result."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .. import checks
from ..io import files
from ..io.samples import parquet_table
from ..tabular import Tabular, Tidy
from ..workflows.record import check_required
from . import result_files, workers
from .store import Store
from .summary import summarise
from .sweep_file import Sweep, load_sweep

MOST_JOBS = 1024


@dataclass(frozen=True, eq=False)
class Swept(Tabular):
    """A sweep that is done.

    Attributes
    ----------
    sweep : Sweep
    cases, estimates : Path
        Parquet: a row a case; a row for each quantity of each case.
    data : dict
        The summary, as in `sweep.json`.
    files : tuple of Path
    run : dict
        What this call computed, and what it took. It is not part of `data`, which a second call makes again as it was.
    """

    sweep: Sweep
    cases: Path
    estimates: Path
    data: dict[str, Any]
    files: tuple[Path, ...]
    run: dict[str, Any]

    def __repr__(self) -> str:
        return f"Swept({self.sweep.name!r}: {self.sweep.cases} cases, {self.failed} failed, {len(self.data['quantities'])} quantities)"

    def tidy(self) -> Tidy:
        """Return the estimates, one quantity of one case a row, as in `estimates.parquet`."""
        table = parquet_table(self.estimates)
        return Tidy({name: table.column(name).to_pylist() for name in table.column_names}, {})

    def to_dict(self) -> dict[str, Any]:
        """Return the summary, as in `sweep.json`."""
        return self.data

    @property
    def failed(self) -> int:
        """Number of cases without a result."""
        return int(self.data["failed"])


def sweep(
    source: Sweep | str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    jobs: int = 1,
    cluster: str | None = None,
    step: Callable[[int], None] = lambda cases: None,
    command: str | None = None,
) -> Swept:
    """Simulate, and optionally identify, many cases: subjects, sensors and movements drawn at random, or resamples of a data set.

    Every case has a seed of its own, made of the seed of the sweep and its number: results do not depend on `jobs`, on the cluster or on
    interruptions. A second call goes on where the first one stopped.

    Parameters
    ----------
    source : Sweep or path
        `SWEEP.toml`.
    folder : path
        Gets `cases.parquet`, `estimates.parquet`, `sweep.json`, figures and `report.html`.
    jobs : int
        Processes on this machine. A script with more than one needs `if __name__ == "__main__":`.
    cluster : str, optional
        Address of a Dask scheduler that does the work instead.
    step : callable
        Called with the number of cases that are done since the last call, those of an earlier run first.
    command : str, optional
        Remarks for the report.

    Returns
    -------
    Swept

    Raises
    ------
    BadInput
        For a sweep that cannot be used, or a folder with another one; nothing is written.
    ArmrsError
        When workers were lost; what is done stays, and the same call goes on.
    """
    jobs = checks.whole("jobs", jobs, least=1, most=MOST_JOBS)
    spec = checks.loaded("sweep", source, Sweep, load_sweep)
    out = files.output_folder(folder)
    files.must_be_writable(out)
    store = Store(spec, out)
    missing = store.missing()
    began = time.perf_counter()
    if missing:
        if spec.dataset is None:
            check_required(spec.experiment(spec.seed_of(1), []))
        if cluster is not None:
            done = workers.cluster(spec, missing, cluster)
        elif jobs > 1 and len(missing) > 1:
            done = workers.processes(spec, missing, min(jobs, len(missing)))
        else:
            done = workers.here(spec, missing)
        count = sum(last - first + 1 for first, last in missing)
        step(spec.cases - count)
        begun = False
        for part, rows in done:
            # Not before there is something to keep: workers may be refused yet.
            if not begun:
                store.begin()
                begun = True
            store.add(part, rows)
            step(part[1] - part[0] + 1)
    else:
        count = 0
        step(spec.cases)
    store.finish()
    summary = summarise(store)
    data = result_files.sweep_data(spec, summary, command)
    run = {"computed": count, "seconds": time.perf_counter() - began, "largest_process_MB": _largest_process()}
    written = result_files.write_sweep(store, data, summary)
    return Swept(spec, store.final("cases"), store.final("estimates"), data, tuple(written), run)


def _largest_process() -> float | None:
    """Return the largest memory that this process or one that it started had [MB], where the system states it."""
    try:
        import resource
    except ImportError:
        return None
    import sys

    unit = 1.0 if sys.platform == "darwin" else 1024.0
    return max(resource.getrusage(who).ru_maxrss for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)) * unit / 1e6
