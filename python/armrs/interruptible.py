"""Long calls of the core that Ctrl-C interrupts immediately.

Python runs the handler of a signal in the main thread, between two of its own instructions: a call into the core would hold it back
until it returns. The core therefore works in a thread of its own, for which the main thread waits.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import Any, TypeVar

_Result = TypeVar("_Result")
_Progress = Callable[[str, float], None]
_NAME = "armrs core"
_PAUSE = 0.1
"""Time after which a wait begins anew [s]: on Windows no signal ends one."""


def call(function: Callable[..., _Result], *given: Any) -> _Result:
    """Call a function of the core and return its result, or raise what it raises; an interrupt ends the wait for it.

    What is then left of the work ends with the process.
    """
    return _waited(lambda _: function(*given))


def call_with_progress(function: Callable[..., _Result], *given: Any, progress: _Progress | None) -> _Result:
    """Call a function of the core that takes `progress` last, which is called in this thread.

    After an interrupt the rest of the work ends at its next call of `progress`.
    """
    return _waited(lambda tell: function(*given, tell), progress or (lambda what, share: None))


def is_working() -> bool:
    """Return whether work goes on that nothing waits for any more."""
    return any(thread.name == _NAME for thread in threading.enumerate())


def _waited(function: Callable[[_Progress], _Result], progress: _Progress = lambda what, share: None) -> _Result:
    if threading.current_thread() is not threading.main_thread():  # no handler runs here
        return function(progress)
    events: queue.SimpleQueue[tuple[str, Any]] = queue.SimpleQueue()
    answers: queue.SimpleQueue[BaseException | None] = queue.SimpleQueue()

    def tell(what: str, share: float) -> None:
        events.put(("told", (what, share)))
        if (error := answers.get()) is not None:
            raise error

    def work() -> None:
        try:
            events.put(("done", function(tell)))
        except BaseException as error:
            events.put(("failed", error))

    thread = threading.Thread(target=work, name=_NAME, daemon=True)
    thread.start()
    try:
        # A loop of its own: an interrupt in a jump of one passes the handlers around it by.
        done, value = _attended(events, answers, progress)
    except BaseException:
        answers.put(KeyboardInterrupt())  # to the thread that goes on and reports progress
        raise
    thread.join()
    if not done:
        raise value
    return value


def _attended(
    events: queue.SimpleQueue[tuple[str, Any]], answers: queue.SimpleQueue[BaseException | None], progress: _Progress
) -> tuple[bool, Any]:
    """Call the display until the work has ended; return whether it came to a result, and that or its error."""
    while True:
        try:
            event, value = events.get(timeout=_PAUSE)
        except queue.Empty:
            continue
        if event != "told":
            return event == "done", value
        answers.put(_raised_by(progress, *value))


def _raised_by(progress: _Progress, what: str, share: float) -> Exception | None:
    """Call a display: the core decides what its errors mean."""
    try:
        progress(what, share)
    except Exception as error:
        return error
    return None
