"""Time `import armrs` beside `import numpy` and an empty start of Python, each as a process of its own."""

from __future__ import annotations

import statistics
import subprocess
import sys
import time

RUNS = 21


def milliseconds(code: str) -> float:
    """Return the median time of a Python process that runs `code`."""
    times = []
    for _ in range(RUNS):
        start = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], check=True)
        times.append(1e3 * (time.perf_counter() - start))
    return statistics.median(times)


if __name__ == "__main__":
    for code in ("pass", "import numpy", "import armrs", "import armrs; armrs.Arm", "import armrs; armrs.load_dataset"):
        print(f"{milliseconds(code):7.1f} ms  {code}")
