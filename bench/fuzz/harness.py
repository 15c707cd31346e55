"""Run armrs on changed files and check what it does: `python bench/fuzz/harness.py --cases 20000`.

Required of every case: a status of 0, 1, 2, 130 or 143 and no traceback; at most 10 s of processor time and the stated memory; nothing left
behind after a refusal, neither the output folder nor temporary files. The seed gives the same cases again; each that fails is kept below
`--keep` with the command and what it printed.

Ctrl-C ends it and reports the cases that were run.

A case takes milliseconds: it runs in a process that is forked from one in which everything is loaded, 1000 to a process; the folders are in
memory where the system has such; and of the cases only one in 20 draws its figures, while the others write an empty image in their place.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import gc
import os
import re
import resource
import select
import shutil
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import IO
from unittest import mock

sys.path.insert(0, str(Path(__file__).parent))
# Small matrices: more threads would wait for one another, and none of them outlives a fork.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import typer.main
from matplotlib.figure import Figure
from mutations import mutate
from seeds import Seed, plant

from armrs import cli

STATUSES = (0, 1, 2, 130, 143)
SECONDS = 10.0
"""Of processor time."""
WAIT = 120.0
"""On the clock, without any work, after which a process is taken to wait for something that never comes."""
TOO_LONG = 60.0
"""Limit of processor time of a case."""
MEMORY = 4 << 30
"""Address space beyond that of a process that has read nothing [bytes]."""
AT_ONCE = 1000
"""Cases in one process."""
DRAWN = 20
"""One in so many cases draws its figures: that takes ten times as long as all else."""
IMAGE = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108000000003a7e9b550000000a49444154789c6360000000020001e5270dd40000000049454e44ae426082"
)
"""A PNG of one pixel."""


@dataclass
class Most:
    """What the costliest case took.

    Attributes
    ----------
    seconds : float
        Of processor time.
    memory : float
        Resident memory of the process that ran it [MiB].
    long : int
        Cases with long runs that made progress.
    """

    seconds: float = 0.0
    memory: float = 0.0
    long: int = 0


@dataclass(frozen=True)
class Case:
    """One changed file and one command that reads it."""

    number: int
    seed: Seed
    command: tuple[str, ...]
    content: bytes
    draws: bool


@contextlib.contextmanager
def drawing(wanted: bool) -> Iterator[None]:
    """Write figures as they are, or an empty image in the place of each."""

    def empty(_: Figure, target: Path | IO[bytes], **__: object) -> None:
        if isinstance(target, (str, Path)):
            Path(target).write_bytes(IMAGE)
        else:
            target.write(IMAGE)

    with contextlib.nullcontext() if wanted else mock.patch.object(Figure, "savefig", empty):
        yield


def tree(place: Path) -> dict[str, tuple[int, int]]:
    """Files and folders below a folder, with the sizes and times of change of the files."""
    found: dict[str, tuple[int, int]] = {}
    for at, folders, files in os.walk(place):
        found |= {os.path.join(at, name): (0, 0) for name in folders}  # noqa: PTH118 (in every case)
        for name in files:
            path = os.path.join(at, name)  # noqa: PTH118
            known = os.lstat(path)
            found[path] = (known.st_size, known.st_mtime_ns)
    return found


class Place:
    """The working folder of the cases, made anew only where a case has changed it."""

    def __init__(self, folder: Path, home: Path) -> None:
        self.folder, self.home, self.work, self.scratch = folder, home, home / "work", home / "tmp"
        self.changed: str | None = None
        self.before: dict[str, tuple[int, int]] | None = None

    def put(self, case: Case) -> None:
        """Put the changed file of a case in its place, and all others as they were."""
        os.chdir("/")
        if self.before is None:
            shutil.rmtree(self.home, ignore_errors=True)
            self.scratch.mkdir(parents=True)
            shutil.copytree(self.folder, self.work)
        elif self.changed:
            shutil.copy2(self.folder / self.changed, self.work / self.changed)
        (self.work / case.seed.file).write_bytes(case.content)
        self.changed, self.before = case.seed.file, tree(self.work)
        os.chdir(self.work)

    def left(self) -> list[str]:
        """Return what is new or another one since the changed file was put here; then all is to be made anew."""
        assert self.before is not None
        after = tree(self.work)
        if after == self.before:
            return []
        found = sorted(p for p in {*after, *self.before} if after.get(p) != self.before.get(p))
        self.before = None
        return [os.path.relpath(p, self.work) for p in found]


def case_of(number: int, start: int, seeds: tuple[Seed, ...], folder: Path) -> Case:
    """Return the case of a number: formats take turns, those whose commands cost most with some of their turns."""
    random = Random(f"{start} {number}")
    turn, place = divmod(number, len(seeds))
    seed = seeds[place]
    cheap = [other for other in seeds if other.every == 1]
    if cheap and turn % seed.every:
        seed = random.choice(cheap)
    content = mutate(random, Path(seed.file).suffix, (folder / seed.file).read_bytes())
    return Case(number, seed, random.choice(seed.commands), content, turn % DRAWN == 0)


@contextlib.contextmanager
def printing(path: Path) -> Iterator[None]:
    """Let everything that is printed go to a file."""
    with (
        path.open("w", encoding="utf-8", errors="replace") as printed,
        contextlib.redirect_stdout(printed),
        contextlib.redirect_stderr(printed),
    ):
        yield


def run(case: Case, place: Place) -> tuple[float, list[str]]:
    """Run a case in this process; return the seconds of processor time that it took, and what is wrong with it."""
    place.put(case)
    os.environ["TMPDIR"] = tempfile.tempdir = str(place.scratch)
    begun = time.process_time()
    wrong = []
    with printing(place.home / "printed"), drawing(case.draws):
        try:
            status: object = cli.main(case.command)
        except BaseException:
            status = "a traceback"
            traceback.print_exc()
    said = (place.home / "printed").read_text(encoding="utf-8", errors="replace")
    took = time.process_time() - begun
    left = place.left()
    if status not in STATUSES:
        wrong.append(f"status {status}")
    elif "Traceback (most recent" in said:
        wrong.append("a traceback is printed")
    if status == 2 and left:
        wrong.append(f"left behind {left[:5]}")
    if status == 2 and not said.strip():
        wrong.append("refused without a word")
    if any(place.scratch.iterdir()):
        wrong.append(f"left in the temporary folder {[p.name for p in place.scratch.iterdir()][:5]}")
    if took > SECONDS and not advances(said):
        wrong.append(f"{took:.1f} s of processor time")
    return took, wrong


def advances(said: str) -> bool:
    """Return whether a command reported progress: a changed file may define a run of 1000 s, which takes long."""
    shares = [int(share) for share in re.findall(r", (\d+) %, after", said)]
    return len(shares) > 1 and shares == sorted(shares) and shares[0] < shares[-1]


def child(pipe: int, numbers: range, start: int, seeds: tuple[Seed, ...], folder: Path, home: Path) -> None:
    """Run some cases and report each on the pipe."""
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize() if Path("/proc/self/statm").exists() else 0
    if used:
        resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    place = Place(folder, home)
    for number in numbers:
        case = case_of(number, start, seeds, folder)
        os.write(pipe, f"{number} begins\n".encode())
        took, found = run(case, place)
        wrong = "; ".join(found).replace("\n", " ")
        os.write(pipe, f"{number} {took:.3f} {wrong[:3000]}\n".encode())
        if wrong:
            break  # what it printed is still to be kept
    os._exit(0)


def batch(numbers: range, start: int, seeds: tuple[Seed, ...], folder: Path, home: Path, most: Most) -> tuple[int, str | None]:
    """Run cases in a process of their own; return how many ended, and what is wrong with the last one; `most` is renewed."""
    reading, writing = os.pipe()
    pid = os.fork()
    if pid == 0:
        os.close(reading)
        try:
            child(writing, numbers, start, seeds, folder, home)
        finally:
            os._exit(70)
    os.close(writing)
    done, text, why = 0, b"", None
    worked = begun = 0.0
    with os.fdopen(reading, "rb", buffering=0) as source:
        while True:
            ready, _, _ = select.select([source], [], [], WAIT)
            if not ready:
                before, worked = worked, processor_time(pid)
                if worked - before < 0.1:
                    why = f"waits for more than {WAIT:g} s"
                elif worked - begun > TOO_LONG:
                    why = f"does not end within {TOO_LONG:g} s of processor time"
                if why:
                    break
                continue
            piece = source.read(1 << 16)
            if not piece:
                break
            begun, text = processor_time(pid), text + piece
            *lines, text = text.split(b"\n")
            for line in lines:
                _, what, rest = (*line.decode().split(" ", 2), "")[:3]
                if what != "begins":
                    done += 1
                    most.seconds = max(most.seconds, float(what))
                    if rest:
                        why = rest
                        break
            if why:
                break
    if why:
        os.kill(pid, 9)
    _, status, used = os.wait4(pid, 0)
    most.memory = max(most.memory, used.ru_maxrss / 1024.0)
    if why and why.startswith("does not end") and advances((home / "printed").read_text(encoding="utf-8", errors="replace")):
        most.long += 1
        return done + 1, None
    if why is None and done < len(numbers):
        why = f"the process ended with {os.waitstatus_to_exitcode(status)}"
        return done + 1, why
    if why and why.startswith(("waits", "does not end")):
        return done + 1, why
    return done, why


def processor_time(pid: int) -> float:
    """Return what a process has used [s]: on a busy machine it may work for a long time without output. Zero where it is unknown."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def keep(case: Case, why: str, home: Path, place: Path) -> None:
    """Keep what is needed to examine a case."""
    place = place / str(case.number)
    place.mkdir(parents=True, exist_ok=True)
    (place / Path(case.seed.file).name).write_bytes(case.content)
    printed = home / "printed"
    said = printed.read_text(encoding="utf-8", errors="replace")[-4000:] if printed.exists() else ""
    (place / "why.txt").write_text(f"armrs {' '.join(case.command)}\nchanged: {case.seed.file}\n{why}\n{said}\n")


def main() -> int:
    """Run the cases and print what came of them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=0, help="how many; as many as the time allows when absent")
    parser.add_argument("--minutes", type=float, default=1.0, help="of the clock, when --cases is absent")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--only", default="", help="formats whose file holds this text")
    parser.add_argument("--keep", type=Path, default=Path("out/fuzz/mutations"))
    asked = parser.parse_args()
    place = asked.keep.resolve()
    memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(prefix="fuzz-", dir=memory if os.access(memory, os.W_OK) else None) as name:
        folder, home = Path(name) / "seeds", Path(name) / "home"
        seeds = tuple(s for s in plant(folder) if asked.only in s.file)
        accepted_at_first(seeds, Place(folder, home))
        begun, wrong, most = time.monotonic(), Counter[str](), Most()
        next_case, end = asked.first, asked.first + asked.cases if asked.cases else sys.maxsize
        with contextlib.suppress(KeyboardInterrupt):
            while next_case < end and (asked.cases or time.monotonic() - begun < 60.0 * asked.minutes):
                numbers = range(next_case, min(end, next_case + AT_ONCE))
                print(f"\r{next_case - asked.first} changed files", end="", file=sys.stderr, flush=True)
                done, why = batch(numbers, asked.seed, seeds, folder, home, most)
                next_case += done
                if why:
                    case = case_of(next_case - 1, asked.seed, seeds, folder)
                    keep(case, why, home, place)
                    wrong[f"{case.seed.file}: {why[:100]}"] += 1
                    print(f"{next_case - 1}: armrs {' '.join(case.command)}, {case.seed.file}: {why[:300]}", flush=True)
        print(file=sys.stderr)
        count = next_case - asked.first
        print(f"{count} changed files of {len(seeds)} formats in {time.monotonic() - begun:.0f} s: {sum(wrong.values())} wrong")
        if most.long:
            print(f"{most.long} that ask for long runs were ended after {TOO_LONG:g} s of processor time while they told that they got on")
        print(f"the costliest took {most.seconds:.1f} s of processor time and {most.memory:.0f} MiB")
        for line, number in wrong.most_common():
            print(f"  {number} x {line}")
    return 1 if wrong else 0


def accepted_at_first(seeds: tuple[Seed, ...], place: Place) -> None:
    """Return which commands are refused on files that were not changed, whose mutations would show little.

    What they load, compile and read once is then in this process, of which those of the cases are copies.
    """
    # The options of a verb are read once.
    cli._with_options_of = functools.cache(cli._with_options_of)
    typer.main.get_command = functools.cache(typer.main.get_command)
    for seed in seeds:
        for command in seed.commands:
            place.put(Case(0, seed, command, (place.folder / seed.file).read_bytes(), True))
            with printing(place.home / "printed"):
                status = cli.main(command)
            if status not in (0, 1):
                said = (place.home / "printed").read_text().strip().splitlines()[-1:]
                print(f"armrs {' '.join(command)} is refused as it is: {' '.join(said)}", flush=True)
            place.left()
    os.chdir("/")
    gc.collect()
    gc.freeze()


if __name__ == "__main__":
    sys.exit(main())
