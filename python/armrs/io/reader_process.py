"""Readers in processes of their own, because a damaged file can crash or block the library of a format."""

from __future__ import annotations

import contextlib
import math
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import BadInput, Text
from . import files

LONGEST = 60.0
"""Processor time that reading a file may take [s], or time on the clock where the system limits none; 100 MB take about 2 s."""
_WAIT = 10.0
"""How many times as long it may take on the clock: on a busy machine a reader that works waits for its turn."""
_MEMORY_PER_BYTE = 60
"""Memory the reader may take for each byte of the file; whole files took up to 20."""
_MEMORY = 2 << 30
"""Memory it may take whatever the file is [bytes]: address space, of which the libraries reserve most."""


@contextlib.contextmanager
def content(module: str, path: Path, allowed: str) -> Iterator[Any]:
    """Give the arrays that a module of armrs reads from a file when it is run with the file and an NPZ file to write.

    Raises
    ------
    BadInput
        For a file that is refused, or that the reader does not survive. Without the file's name in it.
    """
    with tempfile.TemporaryDirectory(prefix=files.scratch_prefix("read")) as folder:
        out = Path(folder) / "content.npz"
        command = [sys.executable, "-m", module, str(path.resolve()), str(out)]
        limits = _limits(path)
        wait = LONGEST * (_WAIT if limits else 1.0)
        done = None
        with contextlib.suppress(subprocess.TimeoutExpired):
            done = subprocess.run(command, capture_output=True, text=True, timeout=wait, check=False, preexec_fn=limits)
        if done is None or (limits and done.returncode == -signal.SIGXCPU):
            raise BadInput("file", Text(f"a content that keeps the reader busy for more than {LONGEST:g} s"), allowed)
        if done.returncode != 0 or not out.is_file():
            said = done.stderr.strip().splitlines()
            found = said[-1] if done.returncode == 1 and said else "a content that the reader does not survive"
            raise BadInput("file", Text(found), allowed)
        with np.load(out, allow_pickle=False) as arrays:
            yield arrays


def serve(read: Callable[[Path], dict[str, Any]]) -> None:
    """Be the process in which a file is read; whatever the library raises is one line for the parent."""
    try:
        np.savez(sys.argv[2], **read(Path(sys.argv[1])))
    except Exception as error:
        sys.exit(" ".join(str(error).split()) or type(error).__name__)


def _limits(path: Path) -> Callable[[], None] | None:
    """Return what limits the processor time and the memory of the reader, where the system can."""
    if sys.platform == "win32":
        return None
    import resource

    most, seconds = _MEMORY + _MEMORY_PER_BYTE * path.stat().st_size, math.ceil(LONGEST)

    def lower(kind: int, soft: int, hard: int) -> None:
        # A batch system may have set a lower limit, which only the administrator can raise.
        given = resource.getrlimit(kind)[1]
        if given != resource.RLIM_INFINITY:
            soft, hard = min(soft, given), min(hard, given)
        resource.setrlimit(kind, (soft, hard))

    def limit() -> None:
        lower(resource.RLIMIT_CPU, seconds, seconds + 1)
        # Elsewhere the libraries may reserve any amount.
        if sys.platform == "linux":
            lower(resource.RLIMIT_AS, most, most)

    return limit
