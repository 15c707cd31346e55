"""Writing files: whole or not at all, and never over something of another kind."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from .. import checks
from ..errors import BadInput, Text

PathLike = str | os.PathLike[str]


@contextmanager
def replacing(path: PathLike) -> Iterator[Path]:
    """Give a temporary path in the same folder; on success it takes the place of `path` at once, on failure nothing remains.

    The folder is made when it does not exist; `may_replace` comes first. The content is on the disk before the name changes, so that
    after a crash the file is either the old or the new one.
    """
    target = Path(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{target.name}.", suffix=".part", dir=target.parent)
    except (OSError, ValueError) as error:
        raise _unwritable(path, error) from None
    temporary = Path(name)
    try:
        os.fchmod(handle, _mode(target))
        os.close(handle)
        yield temporary
        with temporary.open("rb+") as written:
            os.fsync(written.fileno())
        temporary.replace(target)
    except OSError as error:
        raise _unwritable(path, error) from None
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def unnamed(near: PathLike | None) -> Iterator[IO[bytes]]:
    """Give a file for a while: on the disk where `near` is or will be, or that of temporary files.

    It has no name, so that nothing is left of it however the process ends.
    """
    if near is not None:
        target = Path(near).absolute()
        near = next(p for p in (target, *target.parents) if p.is_dir())
    with as_bad_input(near):
        file = tempfile.TemporaryFile(dir=near)  # noqa: SIM115 (closed below, whatever happens)
    try:
        yield file
    finally:
        # What could not be written was said before.
        with suppress(OSError):
            file.close()


@contextmanager
def as_bad_input(path: PathLike | None) -> Iterator[None]:
    """Turn a disk that is full or out of reach into a refusal that names `path`, or the folder of temporary files."""
    try:
        yield
    except OSError as error:
        raise _unwritable(path or tempfile.gettempdir(), error) from None


def write_whole(folder: PathLike, write: Callable[[Path], list[Path]]) -> list[Path]:
    """Let several files be written below a folder, all of them or none.

    Parameters
    ----------
    folder : path
        Need not exist yet.
    write : callable
        Writes below the folder it is given, and returns the files written. That folder is a temporary one; when all is written and
        nothing of another kind would be replaced, it becomes `folder`, or where that exists its files are moved there.

    Returns
    -------
    list of Path
        The files, where they are now.
    """
    target = output_folder(folder)
    # Inside or beside, so that moving a file only changes its name.
    near = target if target.exists() else target.resolve().parent
    try:
        near.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(prefix=f".{target.resolve().name}.", suffix=".part", dir=near))
    except FileExistsError:
        raise BadInput("file", Text("Not a directory"), "a place that can be written", file=folder) from None
    except (OSError, ValueError) as error:
        raise _unwritable(folder, error) from None
    try:
        written = [path.relative_to(temporary) for path in write(temporary)]
        for name in written:
            may_replace(target / name, name.suffix)
        _move(temporary, target)
    except OSError as error:
        raise _unwritable(folder, error) from None
    except BadInput as error:
        if error.file is None or not Path(error.file).is_relative_to(temporary):
            raise
        raise error.within(file=target / Path(error.file).relative_to(temporary)) from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return [target / name for name in written]


def _move(temporary: Path, target: Path) -> None:
    """Bring everything below one folder to another of the same file system."""
    if not target.exists():
        temporary.chmod(0o777 & ~_umask())
        temporary.rename(target)
        return
    for path in sorted(temporary.rglob("*")):
        place = target / path.relative_to(temporary)
        if path.is_dir():
            place.mkdir(exist_ok=True)
        else:
            path.replace(place)


def write_text(path: PathLike, content: str, *, kind: str) -> None:
    """Write UTF-8 text, whole or not at all.

    Parameters
    ----------
    path : path
        The file. A device or a pipe is written to directly.
    content : str
        The text.
    kind : str
        Suffix of the kind of file, such as ".json". A file that exists under another suffix is not replaced.
    """
    target = Path(path)
    may_replace(target, kind)
    raw = content.encode("utf-8")
    if target.exists() and not target.is_file() and not target.is_dir():
        try:
            target.write_bytes(raw)
        except OSError as error:
            raise _unwritable(path, error) from None
        return
    with replacing(target) as temporary:
        temporary.write_bytes(raw)


def write_json(path: PathLike, data: Any) -> None:
    """Write JSON, whole or not at all. NumPy values become plain ones; numbers that are not finite become null."""
    write_text(path, json_text(data), kind=".json")


def json_text(data: Any) -> str:
    """Return JSON text that ends with a line end."""
    return json.dumps(_plain(data), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def may_replace(path: PathLike, kind: str) -> None:
    """Refuse to replace a folder, and a file whose suffix says that it is of another kind than `kind`."""
    target = Path(path)
    if target.is_dir():
        raise BadInput("file", Text("a folder"), "the name of a file", file=path)
    if target.is_file() and target.stat().st_size > 0 and target.suffix.lower() != kind:
        raise BadInput(
            "file", Text(f"an existing file with suffix {target.suffix!r}"), f"a new file, or a {kind} file to replace", file=path
        )


def output_folder(path: PathLike, place: str = "folder") -> Path:
    """Return a folder to write below; it need not exist yet, but it must not be a file. `place` is what the caller calls it."""
    folder = checks.path(place, path)
    if folder.exists() and not folder.is_dir():
        raise BadInput(place, Text("a file"), "a folder", file=path)
    return folder


def must_be_writable(path: PathLike) -> None:
    """Refuse a place at which no file or folder can be made, before any work is done."""
    target = Path(path)
    try:
        there = next(p for p in (target, *target.absolute().parents) if p.exists())
    except (OSError, ValueError) as error:
        raise _unwritable(path, error) from None
    if there != target and not there.is_dir():
        raise BadInput("file", Text("Not a directory"), "a place that can be written", file=path)
    if not os.access(there, os.W_OK):
        raise BadInput("file", Text("Permission denied"), "a place that can be written", file=path)


def not_an_input(outputs: list[Path], inputs: list[Path]) -> None:
    """Refuse to write over what was read."""
    read = {path.resolve() for path in inputs}
    for output in outputs:
        if output.resolve() in read:
            raise BadInput("output", Text("an input of this command"), "another folder or name", file=output)


def _plain(data: Any) -> Any:
    if isinstance(data, dict):
        return {str(key): _plain(item) for key, item in data.items()}
    if hasattr(data, "tolist"):
        data = data.tolist()
    if isinstance(data, (list, tuple)):
        return [_plain(item) for item in data]
    if isinstance(data, float) and (data != data or data in (float("inf"), float("-inf"))):
        return None
    if isinstance(data, os.PathLike):
        return os.fspath(data)
    return data


def _mode(target: Path) -> int:
    try:
        return target.stat().st_mode & 0o777
    except OSError:
        return 0o666 & ~_umask()


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _unwritable(path: PathLike, error: Exception) -> BadInput:
    reason = getattr(error, "strerror", None) or "a name no file can have"
    return BadInput("file", Text(reason), "a place that can be written", file=path)
