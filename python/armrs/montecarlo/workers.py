"""Computing the parts of a sweep: in this process, in processes beside it, or on a Dask cluster. All give the same rows."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from .. import _armrs
from ..errors import ArmrsError, BadInput, Text
from .case import Row, compute
from .sweep_file import Sweep

Part = tuple[int, int]
Done = Iterator[tuple[Part, tuple[list[Row], list[Row]]]]
_AHEAD = 2
"""Parts that wait for each worker: enough to keep it busy, few enough to keep memory bounded."""
_PATIENCE = 20
"""Time limit for a response of a cluster [s]."""


def here(sweep: Sweep, parts: Sequence[Part]) -> Done:
    """Compute the parts one after the other."""
    for part in parts:
        yield part, compute(sweep, *part)


def processes(sweep: Sweep, parts: Sequence[Part], jobs: int) -> Done:
    """Compute the parts in processes on this machine, in any order.

    Raises
    ------
    ArmrsError
        When a process was killed; what was written stays.
    """
    # Started afresh, since a copy of a process with threads may hang.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_begin, initargs=(sweep,))
    try:
        left = iter(parts)
        waiting: dict[Future[Any], Part] = {}
        while True:
            for part in left:
                waiting[pool.submit(_compute, *part)] = part
                if len(waiting) >= _AHEAD * jobs:
                    break
            if not waiting:
                return
            for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                yield waiting.pop(future), future.result()
    except BrokenProcessPool:
        raise ArmrsError("a process of the sweep was ended from outside; the same command goes on where it stopped") from None
    finally:
        pool.shutdown(cancel_futures=True)


_mine: Sweep | None = None
"""The sweep of a process that was started for it."""


def _begin(sweep: Sweep) -> None:
    global _mine
    # An interrupt from the keyboard reaches every process; the first one ends the others.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _mine = sweep


def _end_with_parent() -> None:
    """End this process when the one that started it is gone; its queue would wait for ever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _compute(first: int, last: int) -> tuple[list[Row], list[Row]]:
    assert _mine is not None
    return compute(_mine, first, last)


def cluster(sweep: Sweep, parts: Sequence[Part], address: str) -> Done:
    """Compute the parts on a Dask cluster, in any order; what a lost worker had begun, another one does.

    Raises
    ------
    BadInput
        Where no scheduler with workers of this version of armrs responds.
    ArmrsError
        When the cluster gives up.
    """
    try:
        import distributed
    except ImportError:
        raise BadInput("--cluster", address, "an installation with Dask: pip install 'armrs[cluster]'") from None
    with contextlib.ExitStack() as stack:
        try:
            client = stack.enter_context(distributed.Client(address, timeout=_PATIENCE, set_as_default=False))
            client.wait_for_workers(1, timeout=_PATIENCE)
        except (OSError, ValueError, TypeError):  # a timeout is an OSError
            raise BadInput("--cluster", address, "the address of a Dask scheduler with workers, as in tcp://host:8786") from None
        threads = sum(client.nthreads().values())
        _check_versions(client, address)
        left = iter(parts)
        waiting: dict[str, Part] = {}
        # Without a loop it would take that of another client of this process, where there is one.
        done = distributed.as_completed(loop=client.loop)

        def more() -> None:
            for part in left:
                future = client.submit(compute, sweep, *part, pure=False)
                waiting[future.key] = part
                done.add(future)
                if len(waiting) >= _AHEAD * threads:
                    return

        more()
        for future in done:
            try:
                rows = future.result()
            except (distributed.KilledWorker, distributed.client.FutureCancelledError, OSError) as error:
                raise ArmrsError(f"the cluster gave up: {error}; the same command goes on where it stopped") from None
            yield waiting.pop(future.key), rows
            future.release()
            more()


def _check_versions(client: Any, address: str) -> None:
    """Refuse workers that have another armrs, or none: their bits could differ."""
    try:
        found = set(client.run(_version).values())
    except Exception as error:
        raise BadInput("--cluster", address, "workers on which armrs is installed", hint=str(error)) from None
    if found != {_armrs.__version__}:
        raise BadInput("--cluster", Text(f"workers with armrs {', '.join(sorted(found))}"), f"workers with armrs {_armrs.__version__}")


def _version() -> str:
    return _armrs.__version__
