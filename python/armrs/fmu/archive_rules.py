"""Rules of the standards for the archive of an FMU and its terminals."""

from __future__ import annotations

import re
import stat
import zipfile
from collections import Counter
from collections.abc import Iterator
from xml.etree import ElementTree

from .archive import MOST_BYTES
from .description import Description

TERMINALS = "terminalsAndIcons/terminalsAndIcons.xml"
_ENCRYPTED = 1
Broken = tuple[str, str]
"""Place and text of what is wrong."""


def in_archive(files: zipfile.ZipFile) -> Iterator[Broken]:
    """Give what is wrong with the archive itself: names, compression, sizes."""
    names = [info.filename for info in files.infolist()]
    for info in files.infolist():
        # zipfile turns the separators of the system it runs on into slashes; `orig_filename` is what the archive holds.
        name = info.orig_filename
        if "\\" in name:
            yield name, "a backslash in a name of the archive, allowed is / between folders"
        if name.startswith(("/", "./")) or ".." in name.split("/") or re.match("[A-Za-z]:", name):
            yield name, "a name that begins with /, ./ or a drive, or contains .., allowed are plain relative names"
        if any(ord(c) < 32 for c in name):
            yield name, "a control character in a name of the archive"
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            method = {zipfile.ZIP_BZIP2: "bzip2", zipfile.ZIP_LZMA: "lzma"}.get(info.compress_type, f"method {info.compress_type}")
            yield name, f"compressed with {method}, allowed are deflate and none"
        if info.flag_bits & _ENCRYPTED:
            yield name, "encrypted"
        if info.create_system == 3 and stat.S_ISLNK(info.external_attr >> 16):
            yield name, "a symbolic link"
    for name, count in Counter(names).items():
        # Importers differ in which of two files they take; where both are the same that does not matter.
        if count > 1 and len({(i.CRC, i.file_size) for i in files.infolist() if i.filename == name}) > 1:
            yield name, "occurs more than once in the archive, with different contents"
    lower = Counter(name.lower() for name in set(names))
    for name in sorted(n for n in set(names) if lower[n.lower()] > 1):
        yield name, "differs from another name only in case, which some file systems do not distinguish"
    if (total := sum(info.file_size for info in files.infolist())) > MOST_BYTES:
        yield "archive", f"{total} bytes unpacked, at most {MOST_BYTES} are read here"


def in_terminals(files: zipfile.ZipFile, description: Description) -> Iterator[Broken]:
    """Give what is wrong with the terminals and icons."""
    if TERMINALS not in files.namelist():
        return
    for text in _terminals(files, description):
        yield TERMINALS, text


def _terminals(files: zipfile.ZipFile, description: Description) -> Iterator[str]:
    try:
        root = ElementTree.fromstring(files.read(TERMINALS))
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
    yield from _members(root, {v.name for v in description.variables})
    icon = root.find("GraphicalRepresentation/Icon")
    if icon is not None and "terminalsAndIcons/icon.png" not in files.namelist():
        yield "an Icon, but no terminalsAndIcons/icon.png"


def _members(root: ElementTree.Element, known: set[str]) -> Iterator[str]:
    wanted = {"Terminal": ("name",), "TerminalMemberVariable": ("variableName", "variableKind")}
    seen: set[str | None] = set()
    for element in root.iter():
        for key in wanted.get(element.tag, ()):
            if not element.get(key):
                yield f"a {element.tag} without {key}"
        for key in ("variableName", "inStreamVariableName", "outStreamVariableName"):
            name = element.get(key)
            if name is not None and name not in known:
                yield f"{key} {name!r} is not a variable of this FMU"
        if element.tag == "Terminal":
            if element.get("name") in seen:
                yield f"two terminals have the name {element.get('name')!r}"
            seen.add(element.get("name"))
            members = Counter(m.get("memberName") for m in element.iterfind("TerminalMemberVariable") if m.get("memberName"))
            if element.get("matchingRule") in ("plug", "bus"):
                yield from (f"two members of {element.get('name')} have the name {name!r}" for name, n in members.items() if n > 1)
                if any(not m.get("memberName") for m in element.iterfind("TerminalMemberVariable")):
                    yield f"a member of {element.get('name')} without memberName, which the matching rule requires"
