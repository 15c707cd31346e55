"""Checking an FMU: what the file promises against the standard, and what the library does against what the file promises."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

from ..cosim.imported import platform_folder
from ..errors import BadInput
from . import rules
from .description import DESCRIPTION, Description, archive, parse

_SECONDS = 120
"""Longest time that the library may take to be tried."""
_TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"


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


def check_fmu(path: str | os.PathLike[str]) -> list[Finding]:
    """Check an FMU for co-simulation, FMI 2.0 or 3.0.

    The archive, the description and the terminals are read; then the library is loaded in a process of its own, which is allowed to
    crash: every function of the standard must be there, every start value must be the one of the description to the last bit, one step
    is made, and, where the FMU can, gone back and made again.

    Parameters
    ----------
    path : path

    Returns
    -------
    list of Finding
        Errors first.

    Raises
    ------
    BadInput
        For a file that is no archive at all.
    """
    with archive(path) as files:
        found = list(_archive(files))
        try:
            description = parse(files.read(DESCRIPTION))
        except KeyError:
            return [*found, Finding("error", DESCRIPTION, "missing")]
        except BadInput as error:
            return [*found, Finding("error", error.place, f"found {error.found}, allowed {error.allowed}")]
        except Exception as error:
            return [*found, Finding("error", DESCRIPTION, f"cannot be unpacked: {error}")]
        found += [Finding("error", place, text) for place, text in rules.broken(description)]
        found += _binary(files, description)
        if _TERMINALS in files.namelist():
            found += [Finding("error", _TERMINALS, text) for text in _terminals(files, description)]
    if not any(f.place.startswith("binaries") for f in found):
        found += _tried(Path(path))
    return sorted(dict.fromkeys(found), key=lambda f: f.level != "error")


def _archive(files: zipfile.ZipFile) -> Iterator[Finding]:
    names = [info.filename for info in files.infolist()]
    for info in files.infolist():
        # zipfile turns the separators of the system it runs on into slashes; `orig_filename` is what the archive holds.
        name = info.orig_filename
        if "\\" in name:
            yield Finding("error", name, "a backslash in a name of the archive, allowed is / between folders")
        if name.startswith(("/", "./")) or ".." in name.split("/"):
            yield Finding("error", name, "a name that begins with / or ./ or holds .., allowed are plain relative names")
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            method = {zipfile.ZIP_BZIP2: "bzip2", zipfile.ZIP_LZMA: "lzma"}.get(info.compress_type, f"method {info.compress_type}")
            yield Finding("error", name, f"compressed with {method}, allowed are deflate and none")
        if info.flag_bits & 1:
            yield Finding("error", name, "encrypted")
    for name in {name for name in names if names.count(name) > 1}:
        yield Finding("error", name, "stands more than once in the archive")


def _binary(files: zipfile.ZipFile, description: Description) -> Iterator[Finding]:
    identifier = description.identifier
    names = [name.replace("\\", "/") for name in files.namelist()]
    binaries = [name for name in names if name.startswith("binaries/") and not name.endswith("/")]
    if not binaries and not any(name.startswith("sources/") for name in names):
        yield Finding("error", "binaries", "no library for any machine, and no sources")
        return
    place, suffix = platform_folder(description.fmi)
    here = [name for name in binaries if name.startswith(f"binaries/{place}/")]
    wanted = f"binaries/{place}/{identifier}{suffix}"
    if wanted not in binaries:
        there = ", ".join(here) or "nothing"
        level = "error" if here else "note"
        yield Finding(level, f"binaries/{place}", f"{there}, wanted is {identifier}{suffix}, named as modelIdentifier says")


def _terminals(files: zipfile.ZipFile, description: Description) -> Iterator[str]:
    try:
        root = ElementTree.fromstring(files.read(_TERMINALS))
    except Exception as error:
        yield f"cannot be read: {error}"
        return
    if root.tag != "fmiTerminalsAndIcons":
        yield f"the element {root.tag}, allowed is fmiTerminalsAndIcons"
        return
    version = root.get("fmiVersion", "")
    if not re.fullmatch(r"3\.\d.*", version):
        yield f"fmiVersion is {version!r}, allowed is that of FMI 3"
    for child in root:
        if child.tag not in ("GraphicalRepresentation", "Terminals", "Annotations"):
            yield f"an element {child.tag}, allowed are GraphicalRepresentation, Terminals and Annotations"
    known = {v.name for v in description.variables}
    wanted = {"Terminal": ("name", "matchingRule"), "TerminalMemberVariable": ("variableName", "variableKind")}
    seen: set[str | None] = set()
    for element in root.iter():
        for key in wanted.get(element.tag, ()):
            if not element.get(key):
                yield f"a {element.tag} without {key}"
        for key in ("variableName", "inStreamVariableName", "outStreamVariableName"):
            name = element.get(key)
            if name is not None and name not in known:
                yield f"{key} {name!r} is no variable of this FMU"
        if element.tag == "Terminal":
            if element.get("name") in seen:
                yield f"two terminals have the name {element.get('name')!r}"
            seen.add(element.get("name"))
    icon = root.find("GraphicalRepresentation/Icon")
    if icon is not None and "terminalsAndIcons/icon.png" not in files.namelist():
        yield "an Icon, but no terminalsAndIcons/icon.png"


def _tried(path: Path) -> list[Finding]:
    """Try the library in a process of its own, so that its crash is a finding and not ours."""
    command = [sys.executable, "-m", "armrs.fmu.probe", os.fspath(path)]
    # The child finds this package where we have it from.
    paths = [str(Path(__file__).parents[2]), *filter(None, [os.environ.get("PYTHONPATH")])]
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_SECONDS,
            check=False,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
        )
    except subprocess.TimeoutExpired:
        return [Finding("error", "library", f"does not return within {_SECONDS} s")]
    found, step, complete = [], "loading", False
    for line in done.stdout.splitlines():
        # The FMU may print to standard output too; our lines say so.
        if not line.startswith("probe:"):
            continue
        record = json.loads(line.removeprefix("probe:"))
        if "step" in record:
            step = record["step"]
            complete = step == "end"
        else:
            found.append(Finding(**record))
    if not complete:
        signal = f"signal {-done.returncode}" if done.returncode < 0 else f"status {done.returncode}"
        found.append(Finding("error", "library", f"crashes when {step} ({signal})"))
    return found
