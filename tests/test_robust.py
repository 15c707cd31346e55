"""Whatever comes in or happens meanwhile: a refusal in one line, nothing half-written, nothing lost."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import armrs
from armrs import cli
from armrs.fmu.confined_process import Confined, ProcessEnded
from armrs.io import files, tomlfile
from conftest import MODEL

BOMBS: dict[str, Callable[[], str]] = {
    "depth 100 000": lambda: "a = " + "[" * 100_000 + "]" * 100_000,
    "5000 digits": lambda: "a = " + "9" * 5000,
    "dotted keys": lambda: ".".join(["a"] * 200_000) + " = 1",
    "dotted tables": lambda: "[" + ".".join(["a"] * 200_000) + "]",
    "tables in tables": lambda: "a = " + "{b = " * 2000 + "1" + "}" * 2000,
}


@pytest.mark.parametrize("bomb", BOMBS)
def test_a_toml_bomb_is_refused_at_once(bomb: str, tmp_path: Path) -> None:
    path = tmp_path / "model.toml"
    path.write_text(BOMBS[bomb]())
    start = time.monotonic()
    with pytest.raises(armrs.BadInput):
        armrs.load_model(path)
    with pytest.raises(armrs.BadInput):
        tomlfile.read(path)
    assert time.monotonic() - start < 5.0


def test_long_arrays_of_numbers_are_no_bomb(tmp_path: Path) -> None:
    path = tmp_path / "movement.toml"
    path.write_text("points = [\n  " + ", ".join(["1.25"] * 500) + ",\n  [" + ", ".join(["0.5"] * 100) + "]\n]\n")
    assert len(tomlfile.read(path)["points"]) == 501


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no devices here")
def test_devices_and_pipes_are_no_files(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    for path in ("/dev/zero", str(tmp_path / "pipe.toml")):
        for read in (tomlfile.read, armrs.load_model):
            with pytest.raises(armrs.BadInput, match="a device or a pipe"):
                read(path)


def csv(content: bytes, tmp_path: Path) -> armrs.BadInput:
    from armrs.io.samples import read_samples

    path = tmp_path / "trial.csv"
    path.write_bytes(content)
    with pytest.raises(armrs.BadInput) as refused:
        read_samples(path)
    return refused.value


def test_csv_with_carriage_returns_alone_is_named(tmp_path: Path) -> None:
    assert "carriage returns" in str(csv(b"t_s,q1_rad\r0,1\r1,2\r", tmp_path))


def test_csv_with_200_000_columns_is_refused_at_once(tmp_path: Path) -> None:
    start = time.monotonic()
    assert "at most 4096 columns" in str(csv(b",".join(b"c%d" % k for k in range(100_000)) + b"\n", tmp_path))
    assert time.monotonic() - start < 2.0


@pytest.mark.parametrize("store_schema", [True, False])
def test_parquet_with_names_that_are_no_utf_8_is_refused(store_schema: bool, tmp_path: Path) -> None:
    import pyarrow
    from pyarrow import parquet

    from armrs.io.samples import read_samples

    path = tmp_path / "trial.parquet"
    columns = pyarrow.table({"t_s": [0.0, 0.1], "q1_rad": [1.0, 2.0]})
    parquet.write_table(columns, path, store_schema=store_schema)
    whole = path.read_bytes()
    assert b"q1_rad" in whole
    path.write_bytes(whole.replace(b"q1_rad", b"q1_r\xff\xfe"))
    with pytest.raises(armrs.BadInput) as refused:
        read_samples(path)
    assert "\n" not in str(refused.value) and "utf-8" in str(refused.value).lower()


def written(folder: Path, content: str) -> None:
    def write(part: Path) -> list[Path]:
        (part / "a.json").write_text(content)
        (part / "b.json").write_text(content)
        return [part / "a.json", part / "b.json"]

    files.write_whole(folder, write)


def test_a_process_killed_between_two_files_is_completed_by_the_next(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """After the commit the result is the new one: the next write, or reading a data set, brings the rest to its place."""
    written(tmp_path, "old")
    monkeypatch.setattr(files, "_HOST", "here")
    dead = _dead_process()
    pending = tmp_path / f".x.here-{dead}.abc.complete"
    pending.mkdir()
    (pending / "b.json").write_text("new")
    (tmp_path / "a.json").write_text("new")  # moved before the end
    unfinished = tmp_path / f".x.here-{dead}.abd.part"
    unfinished.mkdir()
    mine = tmp_path / f".x.here-{os.getpid()}.abe.part"
    mine.mkdir()
    monkeypatch.undo()
    monkeypatch.setattr(files, "_HOST", "here")
    files.recover(tmp_path)
    assert (tmp_path / "a.json").read_text() == (tmp_path / "b.json").read_text() == "new"
    assert not pending.exists() and not unfinished.exists()
    assert mine.exists()  # a process that lives is left alone


def _dead_process() -> int:
    done = subprocess.Popen([sys.executable, "-c", ""])
    done.wait()
    return done.pid


def test_symbolic_links_below_the_output_are_not_followed(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    out = tmp_path / "out"
    out.mkdir()
    (out / "trials").symlink_to(tmp_path / "elsewhere")

    def write(part: Path) -> list[Path]:
        (part / "trials").mkdir()
        (part / "trials" / "a.csv").write_text("1")
        return [part / "trials" / "a.csv"]

    with pytest.raises(armrs.BadInput, match="a symbolic link"):
        files.write_whole(out, write)
    assert not list((tmp_path / "elsewhere").iterdir())
    assert [p.name for p in out.iterdir()] == ["trials"]


@pytest.mark.skipif(sys.platform == "win32", reason="folders are not locked there")
def test_two_processes_do_not_write_to_one_folder(tmp_path: Path) -> None:
    inside, go_on = threading.Event(), threading.Event()

    def write(part: Path) -> list[Path]:
        inside.set()
        go_on.wait(10.0)
        (part / "a.json").write_text("first")
        return [part / "a.json"]

    tmp_path.mkdir(exist_ok=True)
    first = threading.Thread(target=files.write_whole, args=(tmp_path, write))
    first.start()
    inside.wait(10.0)
    with pytest.raises(armrs.BadInput, match="another process of armrs"):
        written(tmp_path, "second")
    go_on.set()
    first.join()
    assert (tmp_path / "a.json").read_text() == "first"


def command(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "armrs", *arguments]


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)])
def test_a_process_that_is_asked_to_end_leaves_nothing(number: signal.Signals, status: int, tmp_path: Path) -> None:
    def heed() -> None:
        """Let the signal end the process, whatever started the tests ignores."""
        signal.signal(number, signal.SIG_DFL)

    piped = subprocess.PIPE
    running = subprocess.Popen(command("demo", "-o", str(tmp_path / "demo")), stdout=piped, stderr=piped, text=True, preexec_fn=heed)
    time.sleep(3.0)
    running.send_signal(number)
    start = time.monotonic()
    _, error = running.communicate(timeout=30)
    assert running.returncode == status, error
    assert time.monotonic() - start < 10.0
    assert "Traceback" not in error
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_an_interrupt_that_passes_through_a_string_being_run_ends_with_the_same_status(tmp_path: Path) -> None:
    while_loading = "exec('import os, signal; os.kill(os.getpid(), signal.SIGINT)')"
    program = f"""
import signal, sys, typer.main
from armrs.__main__ import main
typer.main.get_command = lambda app: {while_loading}
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.argv = ["armrs", "effects"]
main()
"""
    (tmp_path / "interrupted.py").write_text(program)
    done = subprocess.run([sys.executable, "-m", "interrupted"], cwd=tmp_path, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (130, "armrs: interrupted\n")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("output", [">/dev/full", ">&-"])
def test_a_full_or_closed_output_is_no_traceback(output: str) -> None:
    done = subprocess.run(f"{' '.join(command('effects'))} {output}", shell=True, capture_output=True, text=True)
    assert "Traceback" not in done.stderr
    assert done.returncode == (1 if "full" in output else 0)


def test_an_ascii_terminal_shows_question_marks(tmp_path: Path) -> None:
    done = subprocess.run(command("effects", "viscous"), capture_output=True, env=os.environ | {"PYTHONIOENCODING": "ascii", "LC_ALL": "C"})
    assert done.returncode == 0 and b"?" in done.stdout and b"Traceback" not in done.stderr


def test_help_lists_the_statuses(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["--help"]) == 0
    shown = capsys.readouterr().out
    assert "130" in shown and "143" in shown


SWALLOWED = """
import os, signal, time
from armrs.cli import interrupts
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell starts what runs in its background without it
interrupts.obey()
try:
    os.kill(os.getpid(), signal.SIGINT)
except KeyboardInterrupt:
    pass  # as the code of a library that is being loaded
start = time.monotonic()
try:
    while time.monotonic() < start + 20.0:
        pass
except KeyboardInterrupt:
    begun = time.monotonic()
    while time.monotonic() < begun + 0.8:
        pass  # work that is being undone is not interrupted again
    interrupts.forget()
    time.sleep(0.5)
    print(f"{begun - start:.3f}")
"""


@pytest.mark.skipif(not hasattr(signal, "setitimer"), reason="no timers that signal")
def test_an_interrupt_that_a_library_swallows_is_raised_again() -> None:
    """Ctrl-C while SciPy was loaded had no effect: `armrs identify` went on to its end."""
    done = subprocess.run([sys.executable, "-c", SWALLOWED], capture_output=True, text=True, timeout=60, check=True)
    assert float(done.stdout) < 1.0 and done.stderr == ""


@pytest.mark.skipif(os.name != "posix", reason="needs fork")
def test_a_child_that_outlives_foreign_code_is_not_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It holds the pipe open: the call hung until it ended, whatever the limit."""
    (tmp_path / "orphaning.py").write_text("import os, time\nif os.fork() == 0:\n    time.sleep(120.0)\nos._exit(3)\n", encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    child = Confined("orphaning", tmp_path)
    begin = time.monotonic()
    with pytest.raises(ProcessEnded):
        child.receive(60.0)
    assert time.monotonic() - begin < 30.0
    child.close()


FORGED = """
import os
os.write(1, b'{"step": "end"}\\n')
os._exit(0)
"""


def test_what_foreign_code_prints_is_no_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A library that printed the line with which a probe ends was one with nothing wrong."""
    (tmp_path / "forging.py").write_text(FORGED, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    child = Confined("forging", tmp_path)
    with pytest.raises(ProcessEnded, match="writes into the pipe that is not its own"):
        child.receive(60.0)
    child.close()


SMALL_ROOM = """
import resource
import numpy as np, armrs
from pathlib import Path
taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (taken + (1 << 30), taken + (1 << 30)))
arm = armrs.Arm([0.3, 0.25], [2.0, 1.5], [0.14, 0.12], [0.02, 0.01])
many = np.broadcast_to(np.zeros(2), (10**11, 2))
row = np.zeros(2)
whole = np.broadcast_to(np.zeros(2, dtype=int), (10**11, 2))
calls = {
    "gravity": lambda: arm.gravity(many),
    "whole numbers": lambda: arm.gravity(whole),
    "jacobian": lambda: arm.jacobian(many),
    "inertia": lambda: arm.inertia(many),
    "forward_kinematics": lambda: arm.forward_kinematics(many),
    "coriolis": lambda: arm.coriolis(many, many),
    "static_torque": lambda: arm.static_torque(row, many),
    "inverse_dynamics": lambda: arm.inverse_dynamics(many, row, row),
    "forward_dynamics": lambda: arm.forward_dynamics(row, row, many),
    "regressor": lambda: arm.regressor(many, many, many),
    "Arm": lambda: armrs.Arm(many[:, 0], [2.0], [0.1], [0.02]),
    "Movement": lambda: armrs.Movement(many),
    "Trial": lambda: armrs.Trial("a.csv", "slow", 1, "fit", many[:, 0], many),
    "simulate": lambda: armrs.simulate("model.toml", None, start=row, start_speed=row, duration=1e5, rate=4000.0),
}
for name, call in calls.items():
    try:
        call()
        print(name, "returned")
    except MemoryError as error:
        print(name, error)
"""


@pytest.mark.skipif(not Path("/proc/meminfo").exists(), reason="memory that is left is told on Linux")
def test_more_memory_than_there_is_is_refused_with_the_number(tmp_path: Path) -> None:
    """A process that asked for the gravity of 10¹¹ rows was aborted."""
    (tmp_path / "model.toml").write_text(MODEL, encoding="utf-8")
    done = subprocess.run([sys.executable, "-c", SMALL_ROOM], capture_output=True, text=True, cwd=tmp_path, timeout=120)
    lines = done.stdout.splitlines()
    assert len(lines) == 14, done.stderr
    for line in lines:
        assert re.search(r"needs [0-9.]+ [GTP]B of memory, ([0-9.]+ [MG]B are available|more than the system gives)$", line), line
