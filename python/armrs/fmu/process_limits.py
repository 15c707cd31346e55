"""Limits of a process that runs foreign code: memory, file size, writable folders, lifetime.

On Linux memory and file sizes are limited, writing is confined to one folder (Landlock, where the kernel has it), and the whole process
group ends with its parent. On macOS memory and file sizes are limited as far as the system obeys. On Windows nothing of this is limited;
time and output are limited everywhere, by the parent.
"""

from __future__ import annotations

import ctypes
import os
import platform
import sys
import threading
from pathlib import Path

MOST_MEMORY = 4 << 30
"""Most bytes of address space beyond what Python itself uses at the start."""
MOST_FILE = 1 << 30
"""Most bytes of one file that is written."""

_LINUX = platform.system() == "Linux"
# System calls and rights of Landlock (Linux 5.13 and later), from the kernel's user interface headers.
_CREATE_RULESET, _ADD_RULE, _RESTRICT_SELF = 444, 445, 446
_RULE_PATH_BENEATH = 1
_NO_NEW_PRIVILEGES = 38
_WRITE_RIGHTS = (1 << 1) | sum(1 << k for k in range(4, 13))
"""Write files, remove and make everything; since version 2 also 1 << 13 (refer), since version 3 1 << 14 (truncate)."""


def restrict(folder: Path) -> list[str]:
    """Restrict this process for good; return what could not be restricted, one line each."""
    missing = []
    if os.name != "posix":
        return ["memory and writing are not limited on this system"]
    import resource

    used = _address_space()
    for kind, most in ((resource.RLIMIT_AS, used + MOST_MEMORY), (resource.RLIMIT_FSIZE, MOST_FILE), (resource.RLIMIT_CORE, 0)):
        try:
            hard = resource.getrlimit(kind)[1]
            most = most if hard == resource.RLIM_INFINITY else min(most, hard)
            resource.setrlimit(kind, (most, most))
        except (OSError, ValueError) as error:  # noqa: PERF203 (each of three limits by itself)
            missing.append(f"a limit cannot be set: {error}")
    if not _LINUX:
        missing.append("writing is not limited on this system")
    elif reason := _confine_writing(folder):
        missing.append(f"writing is not limited: {reason}")
    return missing


def end_with(pipe: int) -> None:
    """Let the process group end as soon as the other end of a pipe is closed, whatever foreign code does meanwhile."""
    if _LINUX:
        import fcntl
        import signal

        # The kernel itself signals the whole group when the writing end is closed; nothing is ever written.
        fcntl.fcntl(pipe, fcntl.F_SETSIG, signal.SIGKILL)
        fcntl.fcntl(pipe, fcntl.F_SETOWN, -os.getpgrp())
        fcntl.fcntl(pipe, fcntl.F_SETFL, fcntl.fcntl(pipe, fcntl.F_GETFL) | os.O_ASYNC)
        return

    def wait() -> None:
        os.read(pipe, 1)
        os._exit(1)

    threading.Thread(target=wait, daemon=True).start()


def _address_space() -> int:
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    except (OSError, ValueError, IndexError):
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")


def _confine_writing(folder: Path) -> str | None:
    """Allow writing below one folder and to devices alone; return why it cannot be done."""
    system = ctypes.CDLL(None, use_errno=True)
    version = system.syscall(_CREATE_RULESET, None, ctypes.c_size_t(0), ctypes.c_uint32(1))
    if version < 1:
        return "this kernel has no Landlock"
    rights = _WRITE_RIGHTS | ((1 << 13) if version >= 2 else 0) | ((1 << 14) if version >= 3 else 0)
    handled = ctypes.c_uint64(rights)
    rules = system.syscall(_CREATE_RULESET, ctypes.byref(handled), ctypes.c_size_t(8), ctypes.c_uint32(0))
    if rules < 0:
        return os.strerror(ctypes.get_errno())
    try:
        for place in (folder, Path("/dev")):
            opened = os.open(place, os.O_PATH | os.O_CLOEXEC)
            # struct landlock_path_beneath_attr is packed: 64 bits of rights, 32 of a file descriptor.
            below = (ctypes.c_char * 12).from_buffer_copy(rights.to_bytes(8, sys.byteorder) + opened.to_bytes(4, sys.byteorder))
            failed = system.syscall(_ADD_RULE, rules, _RULE_PATH_BENEATH, ctypes.byref(below), ctypes.c_uint32(0))
            os.close(opened)
            if failed:
                return os.strerror(ctypes.get_errno())
        if system.prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0) or system.syscall(_RESTRICT_SELF, rules, ctypes.c_uint32(0)):
            return os.strerror(ctypes.get_errno())
    finally:
        os.close(rules)
    return None
