#!/usr/bin/env python3
"""Record what armrs finds in the demo, the tutorial, measured rigs and generated sessions, and compare it byte for byte with another build.

    .venv/bin/python scripts/same_results.py out/before                      # in the checkout before a change
    .venv/bin/python scripts/same_results.py out/after --against ../before/out/before
    .venv/bin/python scripts/same_results.py out/after --base main           # both, unattended: the other build is made in out/after/base

Every result is JSON, standard output or an amended model below `results/` of the folder. What is there already is not computed again. Exits
with 1 where results differ, and names the first keys that do.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
FAMILIES = ("null", "single", "double", "little_known")
"""Families of generated sessions, in turn: as many of each."""
FIRST_SEED = 80_000
"""Seed of the first session: those below 100 000 are for development."""
RIGS = ("dfki_a0", "dfki_c1", "pendulum_single", "pendulum_double", "pendulum_triple")
"""Folders of measured rigs that are analysed where `--rigs` has them."""
MOVEMENT = '[movement]\nwaypoints_deg = [[-60, 50], [-30, 85], [-60, 50]]\nspeed_rad_s = 0.8\nacceleration_rad_s2 = 2.4\nshape = "smooth"\n'
MOST_SHOWN = 5
"""Keys that are named of one result that differs."""


def commands(folder: Path, sessions: int, rigs: Path | None) -> Iterator[tuple[str, list[str]]]:
    """Give the name of every result, and the arguments of armrs that make it, relative to the folder."""
    yield "demo", ["demo", "-o", "demo"]
    yield "passive", ["passive", "demo/data", "--json", "-"]
    yield "identify", ["identify", "demo/data", "--with", "coulomb", "-o", "identified"]
    yield "cascade", ["identify", "demo/data", "--method", "cascade", "--with", "coulomb", "--json", "-"]
    yield "simulate", ["simulate", "identified/identified.toml", "--movement", "swing.toml", "--json", "-"]
    yield "quick", ["gap", "demo/data", "--quick", "--json", "-"]
    for rig in RIGS if rigs else ():
        if (folder / "rigs" / rig).is_dir():
            yield f"{rig}-gap", ["gap", f"rigs/{rig}", "--threads", "1", "--json", "-"]
            yield f"{rig}-identify", ["identify", f"rigs/{rig}", "--json", "-"]
    for number in range(sessions):
        family = FAMILIES[number % len(FAMILIES)]
        seed = FIRST_SEED + number // len(FAMILIES)
        session = f"sessions/{family}/s{seed:06d}/data"
        yield f"{family}-{seed}-gap", ["gap", session, "--threads", "1", "--json", "-"]
        yield f"{family}-{seed}-identify", ["identify", session, "--json", "-"]


def other_build(folder: Path, revision: str) -> Path:
    """Check out and build a revision below the folder, unless that was done; return its Python."""
    base = folder.resolve() / "base"
    if not base.exists():
        folder.mkdir(parents=True, exist_ok=True)
        subprocess.run(["git", "worktree", "add", "--detach", base, revision], cwd=ROOT, check=True)
    subprocess.run(["make", "build"], cwd=base, check=True, stdout=subprocess.DEVNULL)
    return base / ".venv" / "bin" / "python"


def generate(folder: Path, sessions: int) -> None:
    """Make the sessions with the rapier world."""
    world = ROOT / "target" / "release" / "hidden-world"
    for k, family in enumerate(FAMILIES):
        count = len(range(k, sessions, len(FAMILIES)))
        if count:
            made = ["generate", "--family", family, "--seed", str(FIRST_SEED), "--count", str(count), "-o", f"sessions/{family}"]
            subprocess.run([world, *made], cwd=folder, check=True, stdout=subprocess.DEVNULL)


def record(folder: Path, sessions: int, rigs: Path | None, python: str | Path = sys.executable) -> Path:
    """Make every result that is missing with the build of a Python; return the folder that has them."""
    results = folder / "results"
    results.mkdir(parents=True, exist_ok=True)
    (folder / "swing.toml").write_text(MOVEMENT, encoding="utf-8")
    if rigs and not (folder / "rigs").exists():
        (folder / "rigs").symlink_to(rigs.resolve())
    if not (folder / "sessions").is_symlink():
        generate(folder, sessions)
    for name, arguments in commands(folder, sessions, rigs):
        target = results / f"{name}.json"
        if target.exists():
            continue
        done = subprocess.run([python, "-m", "armrs", *arguments], cwd=folder, capture_output=True, check=False)
        if "-o" in arguments:
            out = folder / arguments[arguments.index("-o") + 1]
            for path in sorted([*out.rglob("*.json"), *out.rglob("*.toml")]):
                if "data" not in path.relative_to(out).parts:
                    shutil.copy(path, results / f"{name}-{'-'.join(path.relative_to(out).parts)}")
        # The last of its files: one that is there was made whole.
        said = re.sub(rb".*, after \d+ s\n", b"", done.stderr)  # which work took long says the clock
        (results / f"{name}.err").write_bytes(b"%d\n" % done.returncode + said)
        target.write_bytes(done.stdout)
        print(f"{name}: status {done.returncode}", flush=True)
    return results


def differing(one: object, other: object, place: str = "") -> Iterator[str]:
    """Give the keys in which two JSON documents differ, with both values."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in {**one, **other}:
            yield from differing(one.get(key), other.get(key), f"{place}.{key}" if place else key)
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        for k, (a, b) in enumerate(zip(one, other, strict=True)):
            yield from differing(a, b, f"{place}[{k}]")
    elif one != other:
        yield f"{place}: {one!r} against {other!r}"


def compare(ours: Path, theirs: Path) -> int:
    """Print what differs; return the number of results that do."""
    names = sorted({p.name for p in ours.iterdir()} | {p.name for p in theirs.iterdir()})
    wrong = 0
    for name in names:
        pair = ours / name, theirs / name
        if not all(p.exists() for p in pair):
            print(f"{name}: only in one of them")
            wrong += 1
        elif pair[0].read_bytes() != pair[1].read_bytes():
            wrong += 1
            try:
                listed = list(differing(*(json.loads(p.read_text(encoding="utf-8")) for p in pair)))
            except json.JSONDecodeError:
                listed = ["text differs"]
            print(f"{name}: {'; '.join(listed[:MOST_SHOWN] or ['bytes only'])}{' …' if len(listed) > MOST_SHOWN else ''}")
    print(f"{len(names) - wrong} of {len(names)} files are the same, byte for byte")
    return wrong


def main() -> int:
    """Record, and compare where there is something to compare with."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="where results and sessions are written")
    parser.add_argument("--sessions", type=int, default=100, metavar="N", help="generated development sessions, default 100")
    parser.add_argument("--rigs", type=Path, help="folder with the measured rigs of the tests")
    other = parser.add_mutually_exclusive_group()
    other.add_argument("--against", type=Path, help="folder that another build wrote")
    other.add_argument("--base", metavar="REVISION", help="revision that is built here, and asked the same sessions")
    given = parser.parse_args()
    if given.sessions:
        subprocess.run(["cargo", "build", "--quiet", "--release", "-p", "hidden-world"], cwd=ROOT, check=True)
    results = record(given.folder, given.sessions, given.rigs)
    theirs = given.against
    if given.base:
        theirs = given.folder / "of-base"
        theirs.mkdir(exist_ok=True)
        if not (theirs / "sessions").exists():
            (theirs / "sessions").symlink_to(given.folder.resolve() / "sessions")
        record(theirs, given.sessions, given.rigs, other_build(given.folder, given.base))
    return 0 if theirs is None or not compare(results, theirs / "results") else 1


if __name__ == "__main__":
    sys.exit(main())
