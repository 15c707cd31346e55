"""Instructions of kernels, steps and a session against what is stated in bench/speed/counts.json: a slow-down is seen without a clock.

    counts.py [--write]

`make counts` builds the program first. What a release build needs depends on the compiler, which is stated with the figures: another
one may ask for figures of its own (`--write`).
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
PROGRAM = ROOT / "target" / "release" / "examples" / "counts"
STATED = ROOT / "bench" / "speed" / "counts.json"
SESSION = "gap_session"
"""The search for missing effects in one session: a minute."""
BAND, BAND_OF_A_SESSION = 0.03, 0.10
"""Allowed difference, relative. A session takes other turns after the last bit of a sum has changed."""
AMOUNT = 2000
"""Calls or steps that are counted."""


def collected(what: str, amount: int) -> int:
    """Return the instructions of a whole run of the program."""
    line = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", str(PROGRAM), what, str(amount)]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    found = re.search(r"Collected : (\d+)", done.stderr)
    if done.returncode or found is None:
        raise SystemExit(f"counts.py: {what}: valgrind ended with status {done.returncode}: {done.stderr[-300:]}")
    return int(found[1])


def count(what: str) -> float:
    """Return the instructions of one call, step or session: the difference of two runs, so that what comes before falls out."""
    first, more = (0, 1) if what == SESSION else (AMOUNT, AMOUNT)
    return (collected(what, first + more) - collected(what, first)) / more


def judge(stated: dict[str, float], found: dict[str, float]) -> list[str]:
    """Return a line for each that is out of the band: what is slower, and what is faster and has to be stated anew."""
    lines = []
    for what, value in found.items():
        band = BAND_OF_A_SESSION if what == SESSION else BAND
        if abs(value / stated[what] - 1.0) > band:
            lines.append(f"{what}: found {value:.1f} instructions, stated {stated[what]:.1f}, allowed ±{100 * band:g} %")
    return lines


def compiler() -> str:
    """Return the version of the compiler."""
    return subprocess.run(["rustc", "--version"], capture_output=True, text=True, check=True).stdout.split()[1]


def main() -> int:
    """Count everything; status 1 where something is out of the band."""
    stated = json.loads(STATED.read_text(encoding="utf-8"))
    found = {what: count(what) for what in stated["instructions"]}
    for what, value in found.items():
        print(f"{what:20} {value:14.1f}")
    if "--write" in sys.argv[1:]:
        rounded = {what: round(value, 1) for what, value in found.items()}
        STATED.write_text(json.dumps({"rustc": compiler(), "instructions": rounded}, indent=1) + "\n", encoding="utf-8")
        return 0
    wrong = judge(stated["instructions"], found)
    if wrong:
        print(*wrong, f"stated for rustc {stated['rustc']}, found {compiler()}", sep="\n", file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
