"""Kill armrs at random times, then call it again: `python bench/fuzz/kills.py --kills 1000`.

Asked after every kill: the same command works at once, its files are those of a run that nobody disturbed, nothing that was not there
before is left beside them, and a session that was reported as added to a history is in it.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(1, str(Path(__file__).parents[1]))

import numpy as np
from seeds import plant

import patients

PATIENCE = 120.0
"""For the call after a kill [s], or twenty times what the verb usually takes here."""


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
    Verb(("import", "raw/slow_1.csv", "--model", "model.toml", "-o", "OUT")),
    Verb(("record", "experiment.toml", "-o", "OUT")),
    Verb(("report", "result.json", "-o", "OUT")),
    Verb(("plan", "model.toml", "--angles-deg=-80:-20,40:110", "-o", "OUT")),
    Verb(("init", "OUT", "--body-mass-kg", "78", "--height-m", "1.8", "--sex", "male")),
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


def start(verb: Verb, place: Path, temporary: Path) -> subprocess.Popen[str]:
    """Start a verb in a process group of its own."""
    command = [sys.executable, "-m", "armrs", *verb.arguments]
    environment = os.environ | {"TMPDIR": str(temporary), "SOURCE_DATE_EPOCH": "0"}
    output = subprocess.PIPE
    return subprocess.Popen(command, cwd=place, env=environment, stdout=output, stderr=output, text=True, start_new_session=True)


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


def usual(verb: Verb, folder: Path, place: Path) -> Usual:
    """Run a verb undisturbed."""
    fresh(verb, folder, place)
    begun = time.monotonic()
    process = start(verb, place, place.parent / "tmp")
    _, said = process.communicate(timeout=10.0 * PATIENCE)
    if process.returncode not in (0, 1):
        raise SystemExit(f"armrs {' '.join(verb.arguments)}: status {process.returncode}: {said.strip()[-300:]}")
    return Usual(process.returncode, content(place, verb.varies), time.monotonic() - begun)


def killed(verb: Verb, expected: Usual, folder: Path, place: Path, share: float) -> list[str]:
    """Kill a verb after a share of the time it takes, call it again; return what is wrong."""
    fresh(verb, folder, place)
    process = start(verb, place, place.parent / "tmp")
    time.sleep(share * expected.seconds)
    os.killpg(process.pid, signal.SIGKILL)
    said, _ = process.communicate()
    wrong = []
    history = place / "OUT" / "history.sqlite"
    if "--history" in verb.arguments and "history" in said.lower() and process.returncode == expected.status and sessions(history) < 1:
        wrong.append("reported as saved, and not in the history")
    again = start(verb, place, place.parent / "tmp")
    try:
        _, errors = again.communicate(timeout=max(PATIENCE, 20.0 * expected.seconds))
    except subprocess.TimeoutExpired:
        os.killpg(again.pid, signal.SIGKILL)
        return [*wrong, "the next call does not end"]
    if again.returncode != expected.status:
        wrong.append(f"the next call: status {again.returncode}: {errors.strip()[-200:]}")
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
    return wrong


def main() -> int:
    """Kill, and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=0, help="how many; as many as the time allows when absent")
    parser.add_argument("--minutes", type=float, default=1.0, help="of the clock, when --kills is absent")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="verbs whose command holds this text")
    asked = parser.parse_args()
    random, bad, count = Random(asked.seed), 0, 0
    with tempfile.TemporaryDirectory(prefix="kills-") as name:
        folder, place = Path(name) / "seeds", Path(name) / "home" / "work"
        plant(folder)
        plant_more(folder)
        verbs = [verb for verb in VERBS if asked.only in " ".join(verb.arguments)]
        random.shuffle(verbs)
        expected: dict[Verb, Usual] = {}
        end = time.monotonic() + 60.0 * asked.minutes
        while count < asked.kills or (not asked.kills and time.monotonic() < end):
            verb = verbs[count % len(verbs)]
            if verb not in expected:
                expected[verb] = usual(verb, folder, place)
                if usual(verb, folder, place).files != expected[verb].files:
                    print(f"armrs {' '.join(verb.arguments)}: two undisturbed runs differ", flush=True)
            share = random.uniform(0.0, 1.1)
            wrong = killed(verb, expected[verb], folder, place, share)
            count += 1
            if count % 50 == 0:
                print(f"{count} kills, {bad} wrong", flush=True)
            if wrong:
                bad += 1
                print(f"armrs {' '.join(verb.arguments)}, killed after {share:.2f} of its time: {'; '.join(wrong)}", flush=True)
    print(f"{count} kills over {len(expected)} verbs: {bad} wrong")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
