"""Calls of the core that an interrupt ends at once."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import armrs
from armrs import interruptible
from armrs.io.dataset import write_dataset
from gap_sessions import session


def test_a_result_and_an_error_come_back() -> None:
    assert interruptible.call(max, 2, 3) == 3
    with pytest.raises(ZeroDivisionError):
        interruptible.call(divmod, 1, 0)
    assert not interruptible.is_working()


def test_progress_is_called_in_the_thread_that_waits() -> None:
    told: list[tuple[str, float, threading.Thread]] = []

    def work(name: str, tell: interruptible._Progress) -> str:
        tell(name, 0.5)
        return name

    def progress(what: str, share: float) -> None:
        told.append((what, share, threading.current_thread()))

    assert interruptible.call_with_progress(work, "some", progress=progress) == "some"
    assert told == [("some", 0.5, threading.main_thread())]


def test_what_is_interrupted_is_not_waited_for_and_ends_when_it_tells_of_itself() -> None:
    ended, seen = threading.Event(), []

    def work(tell: interruptible._Progress) -> None:
        time.sleep(0.5)
        try:
            tell("half", 0.5)
        except KeyboardInterrupt:
            seen.append("interrupted")
        ended.set()

    threading.Timer(0.1, signal.raise_signal, [signal.SIGINT]).start()
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        begin = time.monotonic()
        with pytest.raises(KeyboardInterrupt):
            interruptible.call_with_progress(work, progress=None)
        assert time.monotonic() - begin < 0.45 and not ended.is_set() and interruptible.is_working()
    finally:
        signal.signal(signal.SIGINT, before)
    assert ended.wait(10.0) and seen == ["interrupted"]


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_a_search_ends_while_the_core_works(tmp_path: Path) -> None:
    """Between two calls of its display it could work for half a minute, and heard no signal."""
    write_dataset(session(armrs.Effect("coulomb", 2, parameters={"torque": 0.5})), tmp_path / "data")
    command = [sys.executable, "-m", "armrs", "gap", str(tmp_path / "data"), "--json", str(tmp_path / "gap.json")]
    environment = os.environ | {"PYTHONFAULTHANDLER": "1"}
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env=environment) as running:
        time.sleep(3.0)
        # The process has begun to calibrate: its main thread waits, another one works.
        threads = len(list(Path(f"/proc/{running.pid}/task").iterdir())) if Path("/proc").exists() else 2
        running.send_signal(signal.SIGTERM)
        _, error = running.communicate(timeout=30)
    assert running.returncode == 143 and error.strip().splitlines()[-1] == "armrs: terminated", error
    assert threads > 1 and not (tmp_path / "gap.json").exists()
