"""Calls of the core that an interrupt ends at once."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

import armrs
from armrs import interruptible
from gap_sessions import session


@contextmanager
def interrupts() -> Iterator[None]:
    """Let SIGINT interrupt, whatever started the tests ignores."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


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

    with interrupts():
        threading.Timer(0.1, signal.raise_signal, [signal.SIGINT]).start()
        with pytest.raises(KeyboardInterrupt):
            interruptible.call_with_progress(work, progress=None)
        assert not ended.is_set() and interruptible.is_working()
    assert ended.wait(10.0) and seen == ["interrupted"]


def test_a_search_is_left_while_the_core_works() -> None:
    """It heard no signal until its next report of progress, for half a minute on a large session."""
    told: list[str] = []

    def progress(what: str, share: float) -> None:
        told.append(what)
        if len(told) == 1:
            threading.Timer(0.05, signal.raise_signal, [signal.SIGINT]).start()

    with interrupts(), pytest.raises(KeyboardInterrupt):
        armrs.find_gap(session(armrs.Effect("coulomb", 2, parameters={"torque": 0.5})), threads=1, progress=progress)
    assert interruptible.is_working()
    before, end = len(told), time.monotonic() + 60.0
    while interruptible.is_working() and time.monotonic() < end:
        time.sleep(0.05)
    # The rest ended at its next report, which reached nobody.
    assert not interruptible.is_working() and len(told) == before
