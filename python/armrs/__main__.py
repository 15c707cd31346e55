"""`armrs` and `python -m armrs`: the command line; an interrupt while it loads ends with one line instead of a traceback."""

import contextlib
import gc
import os
import sys


def main() -> None:
    """Run the command line and end the process with its status."""
    # The matrices here are small: with one thread per core, NumPy's threads mostly wait for one another where other programs run too.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Imports and figures make many objects that live until the end: to look for garbage among them again and again takes a
    # twentieth of a short verb.
    gc.set_threshold(50_000)
    try:
        from .cli import run

        status, at_once = run()
    except KeyboardInterrupt as end:
        print("armrs: interrupted", file=sys.stderr)
        status, at_once = getattr(end, "status", 130), True
    if at_once:
        # Once an interrupt has passed through a string that is run, as libraries do while they load, Python ends by its own SIGINT
        # despite `sys.exit` (CPython, `pymain_run_module`).
        for stream in (sys.stdout, sys.stderr):
            with contextlib.suppress(OSError):
                stream.flush()
        os._exit(status)
    sys.exit(status)


if __name__ == "__main__":
    main()
