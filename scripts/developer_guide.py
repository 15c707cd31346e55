"""Do what docs/developer.md says of a new effect, to the letter, in a copy of the source: its law, its line in the catalogue, its tests.

`make guide` runs it. The tests of the core must pass with the effect, and without its line in the list of names one must fail.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
GUIDE = ROOT / "docs" / "developer.md"
TESTS = Path("crates/arm-core/tests/suite")


def shown() -> tuple[str, str, str, str]:
    """Return what the guide shows: the file of the law, the law, its entry in the catalogue and the line of its test."""
    text = GUIDE.read_text(encoding="utf-8")
    name, law = re.search(r"^```rust (\S+)\n(.*?)^```", text, flags=re.M | re.S).groups()  # type: ignore[union-attr]
    entry = re.search(r"add `(\w+::\w+,)` to `catalogue!`", text)[1]  # type: ignore[index]
    line = re.search(r"of `effects.rs`: `(.*?),` says", text)[1]  # type: ignore[index]
    return name, law, entry, line


def main() -> None:
    """Copy, follow the guide, test."""
    name, law, entry, line = shown()
    kind = Path(name).stem
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "armrs"
        shutil.copytree(ROOT, copy, ignore=shutil.ignore_patterns("target", "out", ".venv", ".git", "*.so"))
        (copy / name).write_text(law, encoding="utf-8")
        insert(copy / "crates/arm-core/src/effect/mod.rs", "    quadratic_drag::QuadraticDrag,\n", f"    {entry}\n")
        insert(copy / TESTS / "effects.rs", '        ("quadratic_drag", &[0.5], moving(-2.0), -2.0),\n', f"        {line},\n")
        insert(copy / TESTS / "effects.rs", '        "quadratic_drag",\n', f'        "{kind}",\n')
        if passes(copy):
            sys.exit(f"developer_guide: the tests pass although {kind} is not among the names of catalogue.rs")
        insert(copy / TESTS / "catalogue.rs", "load_friction quadratic_drag", f" {kind}")
        if not passes(copy, say=True):
            sys.exit("developer_guide: the tests fail with the effect of the guide")
    print(f"developer_guide: {kind} was added as docs/developer.md says, and the tests of the core pass")


def insert(path: Path, after: str, text: str) -> None:
    """Put text behind the first place where `after` stands."""
    before, found, rest = path.read_text(encoding="utf-8").partition(after)
    if not found:
        sys.exit(f"developer_guide: {path.name}: {after.strip()} is not there any more")
    path.write_text(before + found + text + rest, encoding="utf-8")


def passes(copy: Path, *, say: bool = False) -> bool:
    """Whether the tests of the core pass."""
    environment = {**os.environ, "CARGO_TARGET_DIR": os.environ.get("CARGO_TARGET_DIR", str(ROOT / "target"))}
    command = ["cargo", "test", "--quiet", "-p", "arm-core", "--test", "suite"]
    done = subprocess.run(command, cwd=copy, env=environment, capture_output=not say, check=False)
    return done.returncode == 0


if __name__ == "__main__":
    main()
