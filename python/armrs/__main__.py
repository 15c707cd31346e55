"""`armrs` and `python -m armrs`: the command line, and an end without a traceback while it still loads."""

import os
import sys


def main() -> None:
    """Run the command line and end the process with its status."""
    # The matrices here are small: with one thread per core, NumPy's threads mostly wait for one another where other programs run too.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        from .cli import run

        run()
    except KeyboardInterrupt as end:
        print("armrs: interrupted", file=sys.stderr)
        sys.exit(getattr(end, "status", 130))


if __name__ == "__main__":
    main()
