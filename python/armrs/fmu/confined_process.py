"""A separate process for foreign code. Messages are lines of JSON that begin with a secret word, over a separate pipe."""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Any

from ..errors import ArmrsError

MOST_OUTPUT = 16 << 20
"""Most bytes that the process may print before it is ended."""
_KEPT_OUTPUT = 4096
_MOST_LINE = 256 << 20
_ENDED_WITHIN = 2.0
"""Time that a process has to end by itself when it is no longer needed [s]."""


class ProcessEnded(ArmrsError):
    """The process is gone: it crashed, ended itself, took too long, or printed too much.

    Attributes
    ----------
    how : str
        What happened, for people: "ends the process with status 3", "is killed by signal 11 (SIGSEGV)", …
    """

    def __init__(self, how: str, printed: str = "") -> None:
        self.how = how
        self.printed = printed
        super().__init__(how)


class Confined:
    """A child process in a process group of its own.

    Parameters
    ----------
    module : str
        Module that is run as a program; it opens its end with `Channel`.
    folder : Path
        Its working folder, and the only one where it may write.
    """

    def __init__(self, module: str, folder: Path) -> None:
        self._word = secrets.token_hex(16)
        self._deadline: float | None = None
        self._ended: str | None = None
        self.printed = b""
        # The child finds this package where we have it from.
        paths = [str(Path(__file__).parents[2]), *filter(None, [os.environ.get("PYTHONPATH")])]
        life: list[int] = list(os.pipe()) if os.name == "posix" else []
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths), "TMPDIR": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-m", module, str(life[0] if life else -1)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                cwd=folder,
                env=environment,
                start_new_session=os.name == "posix",
                pass_fds=life[:1],
            )
        except BaseException:
            for end in life:
                os.close(end)
            raise
        if life:
            os.close(life[0])
        self._life = life[1] if life else None
        self._lock = threading.Lock()
        for target in (self._drain, self._watch):
            threading.Thread(target=target, daemon=True).start()
        self._write({"word": self._word, "folder": str(folder)}, first=True)

    def send(self, message: dict[str, Any]) -> None:
        """Send one message."""
        self._write(message)

    def receive(self, seconds: float) -> dict[str, Any]:
        """Return the next message.

        Raises
        ------
        ProcessEnded
            When the process ends, or sends nothing for the given time.
        """
        self._deadline = time.monotonic() + seconds
        try:
            assert self._process.stdout is not None
            line = self._process.stdout.readline(_MOST_LINE)
        finally:
            self._deadline = None
        head = self._word.encode() + b" "
        if not line.startswith(head) or not line.endswith(b"\n"):
            if line:
                self._kill("writes into the pipe that is not its own")
            raise self._gone(seconds)
        message = json.loads(line[len(head) :])
        assert isinstance(message, dict)
        return message

    def close(self) -> None:
        """End the process and everything that it has started."""
        with contextlib.suppress(OSError):
            if self._process.stdin is not None:
                self._process.stdin.close()
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_ENDED_WITHIN if self._ended is None else 0.0)
        self._kill("")
        self._process.wait()
        for pipe in (self._process.stdout, self._process.stderr):
            if pipe is not None:
                with contextlib.suppress(OSError, ValueError):
                    pipe.close()
        if self._life is not None:
            os.close(self._life)
            self._life = None

    def _write(self, message: dict[str, Any], *, first: bool = False) -> None:
        assert self._process.stdin is not None
        line = json.dumps(message) if first else f"{self._word} {json.dumps(message)}"
        try:
            self._process.stdin.write(line.encode() + b"\n")
            self._process.stdin.flush()
        except OSError:
            raise self._gone(0.0) from None

    def _gone(self, seconds: float) -> ProcessEnded:
        """Return how the process ended; the rest of its group is ended too."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            self._process.wait(_ENDED_WITHIN)
        how = self._ended
        if how is None:
            code = self._process.poll()
            if code is None:
                how = "closes its pipe"
            elif code < 0:
                how = f"is killed by signal {-code} ({_signal(-code)})"
            else:
                how = f"ends the process with status {code}"
        elif how == "time":
            how = f"does not return within {seconds:g} s"
        self._kill(how)
        printed = self.printed.decode(errors="replace").strip()
        return ProcessEnded(how, printed.splitlines()[-1] if printed else "")

    def _kill(self, why: str) -> None:
        with self._lock:
            if self._ended is None and why:
                self._ended = why
            with contextlib.suppress(OSError):
                if os.name == "posix":
                    os.killpg(self._process.pid, signal.SIGKILL)
                else:
                    self._process.kill()

    def _drain(self) -> None:
        """Read what the process prints, keep the end of it, and end a process that prints without end."""
        pipe, total = self._process.stderr, 0
        assert pipe is not None
        with contextlib.suppress(OSError, ValueError):
            while piece := os.read(pipe.fileno(), 1 << 16):
                total += len(piece)
                self.printed = (self.printed + piece)[-_KEPT_OUTPUT:]
                if total > MOST_OUTPUT:
                    self._kill(f"prints more than {MOST_OUTPUT >> 20} MB")

    def _watch(self) -> None:
        while self._process.poll() is None:
            deadline = self._deadline
            if deadline is not None and time.monotonic() > deadline:
                self._kill("time")
                return
            time.sleep(0.05)
        # What it has started holds the pipe open, and would be waited for.
        self._kill("")


class Channel:
    """The child's end: standard input and output become the pipe, and what is printed from now on goes to standard error."""

    def __init__(self) -> None:
        self._in = os.fdopen(os.dup(0), "rb")
        self._out = os.fdopen(os.dup(1), "wb")
        null = os.open(os.devnull, os.O_RDONLY)
        os.dup2(null, 0)
        os.dup2(2, 1)
        first = json.loads(self._in.readline())
        self._word: str = first["word"]
        self.folder = Path(first["folder"])

    def send(self, message: dict[str, Any]) -> None:
        """Send one message."""
        self._out.write(f"{self._word} {json.dumps(message)}\n".encode())
        self._out.flush()

    def receive(self) -> dict[str, Any] | None:
        """Return the next message; None when the parent has closed the pipe."""
        line = self._in.readline().decode()
        word, _, rest = line.partition(" ")
        if word != self._word:
            return None
        message = json.loads(rest)
        assert isinstance(message, dict)
        return message


def _signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return "unknown"
