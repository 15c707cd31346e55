"""Share of the gap that the true effects close, compared with the named ones.

    python bench/hidden/true_effects.py out/hidden/scored [FOLDER...]

Run it after score.py, on the same folders. Each prepared arm with right names and a gap that counts is searched again, with its true
effects at their true values in the model. The gap that remains bounds what right names can close. In rapier and MuJoCo, the laws differ
slightly from those of the catalogue.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from score import CLOSED, as_in_file, closure, force_on


def with_truth(session: Path, folder: Path) -> None:
    """Copy the data of a session, and add its true effects to the model."""
    truth = as_in_file(json.loads((session / "truth.json").read_text(encoding="utf-8")), force_on(session))
    shutil.copytree(session / "data", folder)
    lines = []
    for effect in truth["effects"]:
        lines += ["", "[[effect]]", f"kind = {json.dumps(effect['kind'])}"]
        lines += [f"{key} = {json.dumps(effect[key])}" for key in ("joint", "channel") if effect.get(key) is not None]
        lines += [f"{name} = {parameter['value']!r}" for name, parameter in effect["parameters"].items()]
    with (folder / "model.toml").open("a", encoding="utf-8") as model:
        model.write("\n".join(lines) + "\n")


def closed_by_truth(session: Path) -> float | None:
    """Return the share of the gap that the true effects close; None if armrs gives no result."""
    with tempfile.TemporaryDirectory() as place:
        data, result = Path(place, "data"), Path(place, "gap.json")
        with_truth(session, data)
        subprocess.run([sys.executable, "-m", "armrs", "gap", data, "--json", result], capture_output=True, check=False)
        if not result.is_file():
            return None
        left = json.loads(result.read_text(encoding="utf-8"))["gap"]
    gap: dict[str, Any] = json.loads((session / "gap.json").read_text(encoding="utf-8"))["gap"]
    return closure({name: {**channel, "after": left[name]["calibrated"]} for name, channel in gap.items() if name in left})


def main() -> None:
    """Print one line for each session that counts, and the number of sessions with at least 90 % of the gap closed."""
    counted: list[tuple[float, float | None]] = []
    for folder in map(Path, sys.argv[1:]):
        for line in map(json.loads, (folder / "scores.jsonl").read_text(encoding="utf-8").splitlines()):
            if line["error"] or line["family"] == "little_known" or not line["hidden"] or line.get("closure") is None:
                continue
            if line["names"]["decided"] != line["names"]["decided_right"]:
                continue
            truth = closed_by_truth(folder / line["session"])
            counted.append((line["closure"], truth))
            names = " + ".join(line["hidden"])
            print(
                f"{folder.name} {line['session']} {names}: named {line['closure']:.3f}, true {truth if truth is None else round(truth, 3)}"
            )
    named = sum(closed >= CLOSED for closed, _ in counted)
    true = sum(closed is not None and closed >= CLOSED for _, closed in counted)
    print(f"closed by {CLOSED:.0%}: named {named} of {len(counted)}, true {true} of {len(counted)}")


if __name__ == "__main__":
    main()
