"""Checking an FMU: the description against the standard, and the library against the description."""

from __future__ import annotations

import os
import re
import shutil
import tempfile
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import BadInput
from . import description_rules, library_probe, schema
from .archive import DESCRIPTION, archive, read_xml, unpack
from .archive_rules import in_archive, in_terminals
from .confined_process import Confined, ProcessEnded
from .description import Description, parse
from .shared_library import platform_folder

_SECONDS = 120.0
"""Longest time that one thing that is tried may take."""
_MOST_FINDINGS = 1000


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong, or worth knowing.

    Attributes
    ----------
    level : {"error", "note"}
    place : str
        File, element or function.
    text : str
        What was found and what is allowed.
    """

    level: str
    place: str
    text: str

    def __str__(self) -> str:
        return f"{self.level}: {self.place}: {self.text}"


def check_fmu(path: str | os.PathLike[str], *, library: bool = True, seconds: float = _SECONDS) -> list[Finding]:
    """Check an FMU, FMI 2.0 or 3.0.

    The archive, and the XML files in it against the standards' schemas and rules. Then the library is loaded in a process of its own,
    with limits of memory, output and time: the functions of the standard must be there, start values must be those of the description,
    and everything that the description promises for co-simulation is tried. This runs the native code of the FMU with the rights of the
    user, but for what the limits forbid (`armrs.fmu.process_limits`).

    Parameters
    ----------
    path : path
    library : bool
        Whether the library is tried; without it no foreign code runs.
    seconds : float
        Longest time that one thing that is tried may take [s].

    Returns
    -------
    list of Finding
        Errors first.

    Raises
    ------
    BadInput
        For a file that is no archive at all.
    """
    description = None
    with archive(path) as files:
        found = [Finding("error", place, text) for place, text in in_archive(files)]
        try:
            content = read_xml(files, DESCRIPTION, path)
            found += _schemas(files, content, path)
            description = parse(content)
        except BadInput as error:
            found.append(_refused(error))
        if description is not None:
            found += [Finding("error", place, text) for place, text in description_rules.broken(description)]
            found += [Finding("note", place, text) for place, text in description_rules.worth_knowing(description)]
            found += _binary(files, description)
            found += [Finding("error", place, text) for place, text in in_terminals(files, description)]
    if library and description is not None and not any(f.place.startswith("binaries") for f in found):
        for part in library_probe.parts(description):
            found += _probe_findings(Path(path), seconds, part)
    return sorted(dict.fromkeys(found), key=lambda f: f.level != "error")


def _refused(error: BadInput) -> Finding:
    return Finding("error", error.place, f"found {error.found}, allowed {error.allowed}")


def _schemas(files: zipfile.ZipFile, content: bytes, path: str | os.PathLike[str]) -> Iterator[Finding]:
    """Validate what has a schema."""
    if not schema.available():
        text = "not validated against the schemas of the standard, which FMPy ships: pip install 'armrs[fmi]'"
        yield Finding("note", DESCRIPTION, text)
        return
    head = content[: content.find(b">", content.find(b"<fmiModelDescription")) + 1]
    version = re.search(rb"""fmiVersion\s*=\s*["']\s*(\d+)""", head)
    if version and version[1] not in (b"2", b"3"):
        # It is refused for its version; the schema of another one does not apply.
        return
    fmi = int(version[1]) if version else 3
    for name in sorted({name for _, name in schema.SCHEMAS} & set(files.namelist())):
        try:
            data = content if name == DESCRIPTION else read_xml(files, name, path)
        except BadInput as error:
            yield _refused(error)
            continue
        for violation in schema.violations(fmi, name, data):
            yield Finding("error", name, violation)


def _binary(files: zipfile.ZipFile, description: Description) -> Iterator[Finding]:
    names = [name.replace("\\", "/") for name in files.namelist()]
    binaries = [name for name in names if name.startswith("binaries/") and not name.endswith("/")]
    if not binaries and not any(name.startswith("sources/") for name in names):
        yield Finding("error", "binaries", "no library for any platform, and no sources")
        return
    place, suffix = platform_folder(description.fmi)
    here = [name for name in binaries if name.startswith(f"binaries/{place}/")]
    for identifier in sorted({attributes.get("modelIdentifier", "") for attributes in description.interfaces.values()}):
        if f"binaries/{place}/{identifier}{suffix}" not in binaries:
            there = ", ".join(here[:5]) or "nothing"
            level = "error" if here else "note"
            yield Finding(level, f"binaries/{place}", f"found {there}, expected {identifier}{suffix}, the name that modelIdentifier gives")


def _probe_findings(path: Path, seconds: float, part: int | None) -> list[Finding]:
    """Try the library, or a part of what it promises, in a process of its own, so that its crash is a finding and not ours."""
    folder = Path(tempfile.mkdtemp(prefix="armrs-fmu-"))
    process = None
    found: list[Finding] = []
    step = "starting"
    try:
        unpack(path, folder / "fmu")
        process = Confined("armrs.fmu.worker", folder)
        process.send({"task": "try", "path": str(path), "part": part})
        unlimited = process.receive(seconds).get("unlimited", [])
        found += [Finding("note", "sandbox", str(text)) for text in unlimited]
        while step != "end":
            record = process.receive(seconds)
            step = str(record.get("step", step))
            if "level" in record and len(found) < _MOST_FINDINGS:
                found.append(_finding(record))
    except ProcessEnded as error:
        printed = f"; it printed: {error.printed[:200]}" if error.printed else ""
        found.append(Finding("error", "library", f"{error.how} while {step}{printed}"))
    except BadInput as error:
        found.append(_refused(error))
    finally:
        if process is not None:
            process.close()
        shutil.rmtree(folder, ignore_errors=True)
    return found


def _finding(record: dict[str, Any]) -> Finding:
    return Finding(*(str(record.get(key, "")) for key in ("level", "place", "text")))
