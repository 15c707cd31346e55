"""Compare two runs of the firmware example, in single and in double precision, and print the largest differences.

Usage: compare_precision.py SINGLE DOUBLE LIMIT
"""

import struct
import sys
from pathlib import Path


def numbers(file: str) -> dict[str, list[list[float]]]:
    """Return the raw bits of a run as numbers, by the name of their line."""
    lines: dict[str, list[list[float]]] = {}
    for line in Path(file).read_text().splitlines():
        name, *words = line.split()
        if name in ("needed", "carry", "estimate"):
            formats = {8: ">f", 16: ">d"}
            lines.setdefault(name, []).append([struct.unpack(formats[len(w)], bytes.fromhex(w))[0] for w in words])
    return lines


def main() -> int:
    """Compare; 1 where a torque differs by more than the limit."""
    single, double = numbers(sys.argv[1]), numbers(sys.argv[2])
    limit = float(sys.argv[3])
    worst = 0.0
    for name in ("needed", "carry"):
        for joint in range(len(double[name][0])):
            largest = max(abs(row[joint]) for row in double[name])
            off = max(abs(a[joint] - b[joint]) for a, b in zip(single[name], double[name], strict=True))
            print(f"{name} torque of joint {joint + 1}: {off / largest:.1e} of its largest value")
            worst = max(worst, off / largest)
    deviations = [abs(a[0] - b[0]) / b[1] for a, b in zip(single["estimate"], double["estimate"], strict=True)]
    print(f"estimates: {max(deviations):.1e} standard deviations")
    return int(worst > limit)


if __name__ == "__main__":
    sys.exit(main())
