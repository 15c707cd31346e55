"""`armrs` and `python -m armrs`: the command line, and an end without a traceback while it still loads."""

import os
import sys


def main() -> None:
    """Run the command line and end the process with its status."""
    # Matrices are small here: threads of the linear algebra would wait for one another, on busy cores ten times as long as one computes.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        from .cli import run

        run()
    except KeyboardInterrupt as end:
        print("armrs: interrupted", file=sys.stderr)
        sys.exit(getattr(end, "status", 130))


if __name__ == "__main__":
    main()
