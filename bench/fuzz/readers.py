"""The Python readers under atheris: `python bench/fuzz/readers.py FORMAT [libFuzzer options] [corpus]`; pip install atheris.

A reader may refuse (`ArmrsError`), and nothing else: another exception, a crash, more than the stated time or memory is a finding.
"""

from __future__ import annotations

import contextlib
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

READERS: dict[str, tuple[str, Callable[[Path], object]]] = {
    "toml": (".toml", tomlfile.read),
    "samples": (".csv", read_samples),
    "text": (".txt", read_raw),
    "motion": (".sto", read_raw),
    "urdf": (".urdf", import_model),
    "mjcf": (".xml", import_model),
    "result": (".json", read_result),
    "fmu": (".fmu", about),
}
"""By the name of the format: the suffix of its files, and what reads them."""


def main() -> None:
    """Fuzz one reader until libFuzzer is told to end."""
    if len(sys.argv) < 2 or sys.argv[1] not in READERS:
        raise SystemExit(f"found {sys.argv[1:2]}, allowed {', '.join(READERS)}")
    suffix, read = READERS[sys.argv.pop(1)]
    path = Path(tempfile.mkdtemp(prefix="fuzz-")) / f"model{suffix}"

    def once(data: bytes) -> None:
        path.write_bytes(data)
        with contextlib.suppress(ArmrsError):
            read(path)

    atheris.Setup(["readers", "-timeout=60", "-rss_limit_mb=4096", "-max_len=8192", *sys.argv[1:]], once)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
