"""The shared libraries that an exported FMU contains: that of this machine, from the wheel, and those of a folder."""

from __future__ import annotations

import os
import platform
import sys
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from .. import _armrs, checks
from ..errors import ArmrsError, BadInput, Text
from .shared_library import platform_folder

LICENCE = "license.txt"
"""Licences of a library, beside it."""
_MARK = b"armrs library for FMUs "
_MOST_BYTES = 1 << 28


@dataclass(frozen=True)
class Platform:
    """A kind of machine.

    Attributes
    ----------
    folder_of_2 : str, optional
        Folder of FMI 2.0 below `binaries`; None where the standard has none.
    file : str
        What cargo calls the library.
    suffix : str
    magic, machine : bytes
        How the file begins, and what it has for its kind of processor.
    """

    folder_of_2: str | None
    file: str
    suffix: str
    magic: bytes
    machine: bytes


_ELF, _MACH = b"\x7fELF\x02\x01", b"\xcf\xfa\xed\xfe"
PLATFORMS = {
    "x86_64-linux": Platform("linux64", "libarm_fmu.so", ".so", _ELF, b"\x3e\x00"),
    "aarch64-linux": Platform(None, "libarm_fmu.so", ".so", _ELF, b"\xb7\x00"),
    "x86_64-windows": Platform("win64", "arm_fmu.dll", ".dll", b"MZ", b"\x64\x86"),
    "x86_64-darwin": Platform("darwin64", "libarm_fmu.dylib", ".dylib", _MACH, b"\x07\x00\x00\x01"),
    "aarch64-darwin": Platform(None, "libarm_fmu.dylib", ".dylib", _MACH, b"\x0c\x00\x00\x01"),
}
"""By the folder of FMI 3.0 below `binaries`."""
_OTHERS_OF_2 = {"i686-linux": "linux32", "i386-linux": "linux32", "i386-windows": "win32", "i686-windows": "win32"}
"""Folders of FMI 2.0 for machines that the package itself may have been built on."""


def library() -> Path:
    """Return the library for this machine, with its licence beside it; both come with the wheel."""
    suffix = platform_folder(3)[1]
    stem = "arm_fmu" if sys.platform == "win32" else "libarm_fmu"
    found = Path(str(resources.files("armrs.fmu").joinpath("lib", f"{stem}{suffix}")))
    if not (found.is_file() and found.with_name(LICENCE).is_file()):
        machine = f"{platform.machine()} {sys.platform}"
        raise ArmrsError(
            f"the library for FMUs, or its licence, is missing ({found}; this is {machine}): build it with make, or install the wheel"
        )
    return found


def collected(fmi: int, folder: str | os.PathLike[str] | None) -> tuple[dict[tuple[str, str], bytes], bytes, list[str]]:
    """Return the libraries of an FMU.

    Parameters
    ----------
    fmi : {2, 3}
    folder : path, optional
        Libraries of several machines, each in a folder with the name that FMI 3.0 has for it, such as `x86_64-windows/arm_fmu.dll`.
        Where this machine is not among them, its own is taken from the package.

    Returns
    -------
    binaries : dict of (str, str) to bytes
        By the folder below `binaries` and the suffix of the file.
    licence : bytes
    left_out : list of str
        Machines that the standard has no folder for.

    Raises
    ------
    BadInput
        For a folder without libraries, or a file that is none of this version for the machine that its folder names; for that of the
        package too, which a wheel that was made on another machine may have got wrong.
    """
    given = {} if folder is None else _read(checks.path("library", folder))
    licence = None if folder is None else Path(folder) / LICENCE
    here = platform_folder(3)[0]
    if here not in given:
        given[here] = _checked(library(), here)
    if licence is None or not licence.is_file():
        licence = library().with_name(LICENCE)
    found, left_out = {}, []
    for name, content in given.items():
        known = _platform(name)
        place = name if fmi == 3 else known.folder_of_2
        if place is None:
            left_out.append(name)
        else:
            found[place, known.suffix] = content
    if not found:
        raise BadInput("fmi", fmi, f"3: FMI 2.0 has no folder for libraries of {', '.join(left_out)}")
    return dict(sorted(found.items())), licence.read_bytes(), left_out


def _platform(name: str) -> Platform:
    """Return a kind of machine; of one for which only the package was built, its files are not recognised."""
    return PLATFORMS.get(name, Platform(_OTHERS_OF_2.get(name), "", platform_folder(3)[1], b"", b""))


def _read(folder: Path) -> dict[str, bytes]:
    """Read and check every library of a folder."""
    if not folder.is_dir():
        raise BadInput("library", Text("no folder"), "a folder with libraries", file=folder)
    found = {}
    for entry in sorted(folder.iterdir()):
        if not entry.is_dir():
            continue
        if entry.name not in PLATFORMS:
            raise BadInput("library", entry.name, f"folders {', '.join(PLATFORMS)}", file=folder)
        path = entry / PLATFORMS[entry.name].file
        if not path.is_file():
            raise BadInput("library", Text("nothing"), f"{entry.name}/{path.name}", file=folder)
        found[entry.name] = _checked(path, entry.name)
    if not found:
        raise BadInput("library", Text("no libraries"), "x86_64-linux/libarm_fmu.so or others beside", file=folder)
    return found


def _checked(path: Path, name: str) -> bytes:
    platform = _platform(name)
    if path.stat().st_size > _MOST_BYTES:
        raise BadInput("library", Text(f"{path.stat().st_size} bytes"), f"at most {_MOST_BYTES}", file=path)
    content = path.read_bytes()
    # A program of Windows begins with one of DOS, with the offset of the other.
    at = int.from_bytes(content[60:64], "little") + 4 if platform.magic == b"MZ" else 4 if platform.magic == _MACH else 18
    if not content.startswith(platform.magic) or content[at : at + len(platform.machine)] != platform.machine:
        raise BadInput("library", Text("a file for another machine"), f"a library for {name}", file=path)
    if _MARK + _armrs.__version__.encode() + b"\0" not in content:
        start = content.find(_MARK)
        version = content[start + len(_MARK) : start + 60].split(b"\0")[0].decode(errors="replace") if start >= 0 else "no library of armrs"
        raise BadInput("library", Text(version), f"that of armrs {_armrs.__version__}", file=path)
    return content
