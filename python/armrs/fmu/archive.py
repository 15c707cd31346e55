"""An FMU as an archive: opened, read and unpacked within limits of size and nesting."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from xml.etree import ElementTree

from .. import checks
from ..errors import BadInput, RefusalKind, Text

DESCRIPTION = "modelDescription.xml"
MOST_XML = 64 << 20
"""Most bytes of one XML file."""
MOST_ELEMENTS = 1_000_000
"""Most elements of one XML file: each takes about 1 kB once it is read."""
MOST_BYTES = 1 << 30
"""Most bytes that are unpacked."""
MOST_FILES = 100_000
_PIECE = 1 << 20
_LONGEST_MESSAGE = 200
"""Letters of the parser's message, which may repeat what it read."""


@contextmanager
def archive(path: str | os.PathLike[str]) -> Iterator[zipfile.ZipFile]:
    """Open an FMU as an archive.

    Raises
    ------
    BadInput
        For what is no regular file or no zip archive.
    """
    try:
        source = checks.path("path", path)
        if source.exists() and not source.is_file():
            raise BadInput("file", Text("not a regular file"), "an FMU, which is a zip archive", file=path)
        files = zipfile.ZipFile(source)
    except zipfile.BadZipFile as error:
        raise BadInput("archive", Text(str(error)), "an FMU, which is a zip archive", file=path) from None
    except BadInput:
        raise
    except (OSError, ValueError, NotImplementedError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or str(error) or "not a valid file name"
        kind: RefusalKind = "missing_file" if isinstance(error, FileNotFoundError) else "value"
        raise BadInput("file", Text(reason), "a file that can be read", file=path, kind=kind) from None
    with files:
        if len(files.infolist()) > MOST_FILES:
            raise BadInput("archive", Text(f"{len(files.infolist())} files"), f"at most {MOST_FILES}", file=path)
        yield files


def read_xml(files: zipfile.ZipFile, name: str, path: str | os.PathLike[str]) -> bytes:
    """Return the bytes of an XML file inside an FMU.

    Raises
    ------
    BadInput
        For a file that is missing, damaged, too large, or has a document type.
    """
    try:
        info = files.getinfo(name)
    except KeyError:
        raise BadInput("archive", Text(f"no {name}"), f"an FMU with {name} at its top", file=path) from None
    if info.file_size > MOST_XML:
        raise BadInput(name, Text(f"{info.file_size} bytes"), f"at most {MOST_XML} bytes", file=path)
    content = b"".join(_pieces(files, info, path))
    refuse_xml(name, content, path)
    return content


def refuse_xml(name: str, content: bytes, path: str | os.PathLike[str]) -> None:
    """Refuse an XML file that is not read: too large, in another encoding, or with a document type."""
    if len(content) > MOST_XML:
        raise BadInput(name, Text(f"{len(content)} bytes"), f"at most {MOST_XML} bytes", file=path)
    if content.count(b"<") > MOST_ELEMENTS:
        raise BadInput(name, Text(f"{content.count(b'<')} elements"), f"at most {MOST_ELEMENTS}", file=path)
    # In UTF-16 the words below would not be seen.
    if content[:2] in (b"\xff\xfe", b"\xfe\xff") or b"\0" in content[:4]:
        raise BadInput(name, Text("UTF-16 or UTF-32"), "UTF-8", file=path)
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise BadInput(name, Text("a document type"), "XML without one", file=path)


def xml_root(name: str, content: bytes) -> ElementTree.Element:
    """Return the root element of an XML file; what is none is refused, without the name of the archive."""
    try:
        return ElementTree.fromstring(content)
    except (ElementTree.ParseError, LookupError, ValueError) as error:  # the last two for an encoding that is none
        raise BadInput(name, Text(str(error)[:_LONGEST_MESSAGE]), "XML") from None


def unpack(path: str | os.PathLike[str], folder: Path) -> None:
    """Unpack an FMU below a folder; names that would leave it, and archives of absurd size, are refused."""
    with archive(path) as files:
        total = sum(info.file_size for info in files.infolist())
        if total > MOST_BYTES:
            raise BadInput("archive", Text(f"{total} bytes unpacked"), f"at most {MOST_BYTES} bytes", file=path)
        for info in files.infolist():
            name = info.filename.replace("\\", "/")
            try:
                _unpack_one(files, info, folder, path)
            except (OSError, ValueError) as error:
                if isinstance(error, BadInput):
                    raise
                reason = getattr(error, "strerror", None) or str(error)
                raise BadInput("archive", Text(f"the name {name!r}: {reason}"), "valid file names", file=path) from None


def _unpack_one(files: zipfile.ZipFile, info: zipfile.ZipInfo, folder: Path, path: str | os.PathLike[str]) -> None:
    name = info.filename.replace("\\", "/")
    target = (folder / name).resolve()
    if not target.is_relative_to(folder.resolve()):
        raise BadInput("archive", Text(f"the name {info.filename!r}"), "names inside the archive", file=path)
    if name.endswith("/"):
        target.mkdir(parents=True, exist_ok=True)
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    with target.open("wb") as out:
        for piece in _pieces(files, info, path):
            out.write(piece)


def _pieces(files: zipfile.ZipFile, info: zipfile.ZipInfo, path: str | os.PathLike[str]) -> Iterator[bytes]:
    """Give the content of a file, never more than its entry announces."""
    try:
        with files.open(info) as content:
            while piece := content.read(_PIECE):
                yield piece
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, OSError, EOFError, ValueError) as error:
        raise BadInput(info.filename, Text(str(error)), "a file that can be unpacked", file=path) from None
    except Exception as error:  # zlib and lzma have errors of their own
        raise BadInput(info.filename, Text(f"damaged: {error}"), "a file that can be unpacked", file=path) from None
