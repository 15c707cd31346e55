"""Kill armrs at random times, then call it again: `python bench/fuzz/kills.py --kills 1000`.

Required after every kill: the same command works at once, its files are those of an undisturbed run, nothing that was not there
before is left beside them, and a session that was reported as added to a history is in it.

A verb runs in a process that is forked from one in which everything is loaded, and one kill in 10 is of a verb that draws its figures,
while the others write an empty image in their place: most of the time of a verb is then that in which it reads and writes.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import multiprocessing
import os
import shutil
import signal
import sqlite3
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(1, str(Path(__file__).parents[1]))

import numpy as np
from harness import drawing, printing
from seeds import plant

import patients
from armrs import cli

FORK = multiprocessing.get_context("fork")
PATIENCE = 120.0
"""For the call after a kill [s], or twenty times what the verb usually takes here."""
DRAWN = 10
"""One kill in so many is of a verb that draws its figures."""


@dataclass(frozen=True)
class Verb:
    """A command that writes, `OUT` below a folder of its own.

    Attributes
    ----------
    arguments : tuple of str
    varies : tuple of str
        Endings of files that differ from run to run: they hold times or identifiers.
    """

    arguments: tuple[str, ...]
    varies: tuple[str, ...] = ()


VERBS = (
    Verb(("simulate", "model.toml", "--movement", "movement.toml", "-o", "OUT")),
    Verb(("identify", "session", "--motion", "measured", "-o", "OUT")),
    Verb(("identify", "session", "--motion", "measured", "--history", "OUT/history.sqlite", "--date", "2026-01-03"), (".sqlite",)),
    Verb(("passive", "session", "-o", "OUT")),
    Verb(("convert", "session", "--to", "parquet", "-o", "OUT")),
    Verb(("import", "raw/slow_1.csv", "--model", "model.toml", "--force", "-o", "OUT")),
    Verb(("record", "experiment.toml", "-o", "OUT")),
    Verb(("report", "result.json", "-o", "OUT")),
    Verb(("plan", "model.toml", "--angles-deg=-80:-20,40:110", "-o", "OUT")),
    Verb(("init", "OUT", "--force", "--body-mass-kg", "78", "--height-m", "1.8", "--sex", "male")),
    Verb(("gap", "session", "-o", "OUT")),
    Verb(("spasticity", "stretches", "-o", "OUT")),
    Verb(("cohort", "cohort.csv", "-o", "OUT")),
    Verb(("sweep", "sweep.toml", "--jobs", "1", "-o", "OUT")),
    Verb(("fmu", "export", "model.toml", "-o", "OUT/arm.fmu")),
    Verb(("fmu", "run", "system.toml", "--no-estimate", "-o", "OUT")),
    Verb(("export-c", "model.toml", "-o", "OUT")),
)
"""Every verb that writes but `demo` and `reproduce`, which run the others and take minutes."""

SWEEP = """\
cases = 3
seed = 5
experiment = "experiment.toml"

[[vary]]
key = "subject.body_mass"
normal = [75.0, 10.0]
within = [50, 100]
"""


def plant_more(folder: Path) -> None:
    """Write what only these verbs read below a folder: a sweep, a table of subjects, the stretches of a patient."""
    (folder / "sweep.toml").write_text(SWEEP)
    draw = np.random.default_rng(1)
    rows = [f"s{k},{'ab'[k % 2]},half width,{value:.6f}\n" for k, value in enumerate(draw.normal(1.0, 0.2, 24))]
    (folder / "cohort.csv").write_text("subject,group,quantity,value\n" + "".join(rows))
    patients.written(patients.session(patients.Patient(), 1), folder / "stretches")


def run(verb: Verb, place: Path, draws: bool) -> int:
    """Run a verb in this process."""
    os.chdir(place)
    os.environ["TMPDIR"] = tempfile.tempdir = str(place.parent / "tmp")
    with printing(place.parent / "printed"), drawing(draws):
        return cli.main(verb.arguments)


def act(verb: Verb, place: Path, draws: bool) -> None:
    """Run a verb in a process group of its own, and end with its status."""
    os.setsid()
    os._exit(run(verb, place, draws))


def start(verb: Verb, place: Path, draws: bool) -> multiprocessing.process.BaseProcess:
    """Start a verb."""
    process = FORK.Process(target=act, args=(verb, place, draws))
    process.start()
    return process


def kill(process: multiprocessing.process.BaseProcess) -> None:
    """Kill a verb and what it has started, and wait for its end."""
    assert process.pid is not None
    # It may be over, or have no group yet.
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.kill()
    process.join()


def content(place: Path, varies: tuple[str, ...]) -> dict[str, str]:
    """Digests of all files below a folder; of those that vary only that they are there."""
    return {
        str(p.relative_to(place)): "" if p.suffix in varies else hashlib.sha256(p.read_bytes()).hexdigest()
        for p in sorted(place.rglob("*"))
        if p.is_file() and not p.name.endswith((".lock", "-wal", "-shm", "-journal"))
    }


def sessions(path: Path) -> int:
    """How many sessions a history holds; it must be sound."""
    with sqlite3.connect(path) as history:
        (sound,) = history.execute("PRAGMA integrity_check").fetchone()
        assert sound == "ok", sound
        tables = [name for (name,) in history.execute("SELECT name FROM sqlite_master WHERE type = 'table' AND name NOT LIKE 'sqlite%'")]
        return max((history.execute(f'SELECT count(*) FROM "{name}"').fetchone()[0] for name in tables), default=0)


@dataclass(frozen=True)
class Usual:
    """What a verb does undisturbed."""

    status: int
    files: dict[str, str]
    seconds: float


def fresh(verb: Verb, folder: Path, place: Path) -> None:
    """Put the inputs of a verb into an empty folder."""
    shutil.rmtree(place, ignore_errors=True)
    shutil.copytree(folder, place)
    (place.parent / "tmp").mkdir(exist_ok=True)
    if any("OUT/" in argument for argument in verb.arguments):
        (place / "OUT").mkdir()


def usual(verb: Verb, folder: Path, place: Path, draws: bool) -> Usual:
    """Run a verb undisturbed."""
    fresh(verb, folder, place)
    begun = time.monotonic()
    process = start(verb, place, draws)
    process.join(10.0 * PATIENCE)
    if process.exitcode not in (0, 1):
        kill(process)
        raise SystemExit(f"armrs {' '.join(verb.arguments)}: status {process.exitcode}: {said(place)[-300:]}")
    return Usual(process.exitcode, content(place, verb.varies), time.monotonic() - begun)


def said(place: Path) -> str:
    """Return what the last process printed."""
    printed = place.parent / "printed"
    return printed.read_text(encoding="utf-8", errors="replace").strip() if printed.exists() else ""


def killed(verb: Verb, expected: Usual, folder: Path, place: Path, share: float, draws: bool) -> tuple[bool, list[str]]:
    """Kill a verb after a share of the time it takes, call it again; return whether it was still at work, and what is wrong."""
    fresh(verb, folder, place)
    process = start(verb, place, draws)
    time.sleep(share * expected.seconds)
    kill(process)
    working, wrong = process.exitcode == -signal.SIGKILL, []
    history = place / "OUT" / "history.sqlite"
    reported = "history" in said(place).lower() and process.exitcode == expected.status
    if "--history" in verb.arguments and reported and sessions(history) < 1:
        wrong.append("reported as saved, and not in the history")
    again = start(verb, place, draws)
    again.join(max(PATIENCE, 20.0 * expected.seconds))
    if again.exitcode is None:
        kill(again)
        return working, [*wrong, "the next call does not end"]
    if again.exitcode != expected.status:
        wrong.append(f"the next call: status {again.exitcode}: {said(place)[-200:]}")
    found = content(place, verb.varies)
    if found != expected.files:
        different = sorted(name for name in {*found, *expected.files} if found.get(name) != expected.files.get(name))
        wrong.append(f"other files than undisturbed: {different[:5]}")
    if history.exists() and sessions(history) < 1:
        wrong.append("an empty history")
    left = [p.name for p in (place.parent / "tmp").iterdir()]
    if left:
        wrong.append(f"left in the temporary folder: {left[:3]}")
        shutil.rmtree(place.parent / "tmp")
    return working, wrong


def main() -> int:
    """Kill, and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=0, help="how many; as many as the time allows when absent")
    parser.add_argument("--minutes", type=float, default=1.0, help="of the clock, when --kills is absent")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="verbs whose command holds this text")
    asked = parser.parse_args()
    random, bad, count, early = Random(asked.seed), 0, 0, 0
    os.environ["SOURCE_DATE_EPOCH"] = "0"
    with tempfile.TemporaryDirectory(prefix="kills-") as name:
        folder, place = Path(name) / "seeds", Path(name) / "home" / "work"
        plant(folder)
        plant_more(folder)
        verbs = [verb for verb in VERBS if asked.only in " ".join(verb.arguments)]
        random.shuffle(verbs)
        # What they load is then in this process, of which all others are copies.
        for verb in verbs:
            fresh(verb, folder, place)
            run(verb, place, True)
        os.chdir("/")
        expected: dict[tuple[Verb, bool], Usual] = {}
        end = time.monotonic() + 60.0 * asked.minutes
        while count < asked.kills or (not asked.kills and time.monotonic() < end):
            turn, number = divmod(count, len(verbs))
            verb, draws = verbs[number], turn % DRAWN == 0
            if (verb, draws) not in expected:
                expected[verb, draws] = usual(verb, folder, place, draws)
                if usual(verb, folder, place, draws).files != expected[verb, draws].files:
                    print(f"armrs {' '.join(verb.arguments)}: two undisturbed runs differ", flush=True)
            share = random.uniform(0.0, 1.1)
            working, wrong = killed(verb, expected[verb, draws], folder, place, share, draws)
            count, early = count + 1, early + working
            if count % 50 == 0:
                print(f"{count} kills, {early} before the end, {bad} wrong", flush=True)
            if wrong:
                bad += 1
                print(f"armrs {' '.join(verb.arguments)}, killed after {share:.2f} of its time: {'; '.join(wrong)}", flush=True)
    print(f"{count} kills over {len(verbs)} commands, {early} before the end: {bad} wrong")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
