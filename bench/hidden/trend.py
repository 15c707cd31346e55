"""Add a line to the trend of judgements, and print the trend in Markdown: a line a night, a column for each criterion.

python bench/hidden/trend.py out/hidden/scores.jsonl out/hidden/trend.csv REVISION

`trend.csv` is made where it is absent. A criterion that did not exist in an earlier night is empty there.
"""

from __future__ import annotations

import csv
import json
import sys
from datetime import datetime, timezone
from pathlib import Path

from score import criteria, table

SHOWN = 30
"""Nights of the printed table."""


def main() -> None:
    """Read, add, write, print."""
    if len(sys.argv) != 4:
        sys.exit("trend: found other arguments, allowed SCORES.jsonl TREND.csv REVISION")
    scores, trend, revision = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
    night = tonight(scores, revision)
    former = list(csv.DictReader(trend.open(encoding="utf-8", newline=""))) if trend.is_file() else []
    rows = [*former, night]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    with trend.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns, restval="")
        writer.writeheader()
        writer.writerows(rows)
    print(table(columns, ([row.get(name, "") for name in columns] for row in rows[-SHOWN:])))


def tonight(scores: Path, revision: str) -> dict[str, str]:
    """Return the line of one judgement: what every criterion found."""
    lines = [json.loads(line) for line in scores.read_text(encoding="utf-8").splitlines()]
    head = {"date": f"{datetime.now(timezone.utc):%Y-%m-%d}", "revision": revision[:10], "sessions": str(len(lines))}
    return head | {what: found if holds is not False else f"**{found}**" for what, found, holds in criteria(lines)}


if __name__ == "__main__":
    main()
