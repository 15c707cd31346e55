"""Signals that end a command. Each becomes an exception, also where a library swallows it, such as while a module loads."""

from __future__ import annotations

import signal
import sys
from typing import Any

_AGAIN = 0.3
"""Time after which an interrupt that was swallowed is raised again [s]."""


class Terminated(KeyboardInterrupt):
    """The process was asked to end; work is undone as after Ctrl-C.

    Attributes
    ----------
    status : int
        128 and the number of the signal, as shells count it.
    """

    def __init__(self, number: int) -> None:
        super().__init__()
        self.status = 128 + number


_received: list[int] = []
"""The signal that ends this process."""


def obey() -> None:
    """Let Ctrl-C, SIGTERM and SIGHUP end the command."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        # nohup ignores hang-ups on purpose, and a shell interrupts of what it runs in the background.
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _end)
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, _end_again)


def _end(number: int, _: Any) -> None:
    _received[:] = [number]
    _wait()
    raise _exception()


def _end_again(_: int, frame: Any) -> None:
    """Raise the exception again, unless it is on its way: then work is being undone."""
    if _received:
        _wait()
        if not isinstance(sys.exc_info()[1], KeyboardInterrupt):
            raise _exception()


def _wait() -> None:
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, _AGAIN)


def _exception() -> KeyboardInterrupt:
    return KeyboardInterrupt() if _received[0] == signal.SIGINT else Terminated(_received[0])


def forget() -> bool:
    """Ask no more: the command has ended. Return whether a signal had asked for it."""
    asked = bool(_received)
    _received.clear()
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    return asked
