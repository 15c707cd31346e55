"""The Python readers under atheris: `python bench/fuzz/readers.py FORMAT [libFuzzer options] [corpus]`; pip install atheris.

A reader may refuse (`ArmrsError`), and nothing else: another exception, a crash, more than the stated time or memory is a finding.
"""

from __future__ import annotations

import contextlib
import shutil
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["armrs"]):
    from armrs.errors import ArmrsError
    from armrs.fmu.info import about
    from armrs.io import tomlfile
    from armrs.io.multibody import import_model
    from armrs.io.raw import read_raw
    from armrs.io.samples import read_samples
    from armrs.report.pages import read_result

sys.path.insert(0, str(Path(__file__).parent))
from seeds import plant

READERS: dict[str, tuple[Callable[[Path], object], str, tuple[str, ...]]] = {
    "toml": (tomlfile.read, ".toml", ("model.toml", "movement.toml", "session/dataset.toml", "system.toml", "experiment.toml")),
    "samples": (read_samples, ".csv", ("session/trials/slow_1.csv",)),
    "text": (read_raw, ".txt", ("raw/slow_1.csv",)),
    "motion": (read_raw, ".sto", ("raw/slow_1.sto",)),
    "urdf": (import_model, ".urdf", ("other/model.urdf",)),
    "mjcf": (import_model, ".xml", ("other/model.xml",)),
    "result": (read_result, ".json", ("result.json", "passive.json")),
    "fmu": (about, ".fmu", ("arm.fmu",)),
}
"""By the name of the format: what reads its files, their suffix, and the accepted files to start from."""
LONGEST = 1 << 16
"""Of an input [bytes]: no accepted file is longer."""


def main() -> None:
    """Fuzz one reader until libFuzzer is stopped."""
    if len(sys.argv) < 2 or sys.argv[1] not in READERS:
        raise SystemExit(f"found {sys.argv[1:2]}, allowed {', '.join(READERS)}")
    read, suffix, accepted = READERS[sys.argv.pop(1)]
    folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
    path = folder / f"model{suffix}"
    start = folder / "accepted"
    plant(folder / "seeds")
    start.mkdir()
    for name in accepted:
        assert (folder / "seeds" / name).stat().st_size <= LONGEST, name
        shutil.copy(folder / "seeds" / name, start / Path(name).name)

    def once(data: bytes) -> None:
        path.write_bytes(data)
        with contextlib.suppress(ArmrsError):
            read(path)

    # libFuzzer writes what it finds new to the first folder that it is given, and only reads the others.
    atheris.Setup(["readers", "-timeout=60", "-rss_limit_mb=4096", f"-max_len={LONGEST}", *sys.argv[1:], str(start)], once)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
