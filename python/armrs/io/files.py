"""Writing files: whole or not at all, and never over something of another kind."""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from ..errors import WRITABLE, BadInput, Sentence, Text

PathLike = str | os.PathLike[str]

_HOST = re.sub(r"\W", "_", os.uname().nodename if hasattr(os, "uname") else os.environ.get("COMPUTERNAME", ""))[:32] or "host"
_UNFINISHED = re.compile(r"\..*\.(?P<host>\w+)-(?P<process>\d+)\..*\.part")
"""Names of unfinished files of a process: they hold process and machine."""
_GENERATOR = re.compile(rb'<meta name="generator" content="armrs ([a-z -]+)">')
_NUMBERED = re.compile(r"(.+-)\d+(\.\w+)")
"""Names of files that a result has several of, such as `movement-1.toml`."""
_HEAD = 2000
"""Bytes of a page that contain its maker."""
_COMPLETE = ".complete"
"""Suffix of a folder whose files are all written and on their way to their places."""
ANOTHER = "choose another -o"
_SCRATCH = re.compile(r"armrs-.*?(?P<host>\w+)-(?P<process>\d+)-.*")


def path(place: str, value: object, *kinds: type) -> Path:
    """Return the path of a file or folder; `kinds` are what else is allowed, for the message."""
    if not isinstance(value, (str, os.PathLike)) or not isinstance(os.fspath(value), str):
        raise BadInput(place, value, " or ".join([*with_articles(kinds), "a path"]))
    return Path(value)


def with_articles(kinds: Iterable[type]) -> list[str]:
    """Return names of classes as a message lists them: `a Model`, `an Arm`, `None`."""
    names = ["None" if kind is type(None) else kind.__name__ for kind in kinds]
    return [name if name == "None" else f"{'an' if name[0] in 'AEIOU' else 'a'} {name}" for name in names]


_path = path
"""For functions with an argument of that name."""


def first_of(names: Sequence[str]) -> str:
    """Return the first of some files, and how many more there are."""
    return f"{names[0]} and {len(names) - 1} more" if len(names) > 1 else names[0]


@contextmanager
def replacing(path: PathLike) -> Iterator[Path]:
    """Give a temporary path in the same folder; on success it takes the place of `path` at once, on failure nothing remains.

    The folder is made when it does not exist; `may_replace` comes first. The content is on the disk before the name changes, so that
    after a crash the file is either the old or the new one.
    """
    target = Path(path)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        recover(target.parent)
        handle, name = tempfile.mkstemp(prefix=_unfinished(target.name), suffix=".part", dir=target.parent)
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
        # A write error was reported before.
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
    with _alone_in(target):
        return _write_whole(target, folder, write)


def _write_whole(target: Path, folder: PathLike, write: Callable[[Path], list[Path]]) -> list[Path]:
    # Inside or beside, so that moving a file only changes its name.
    near = target if target.exists() else target.resolve().parent
    try:
        near.mkdir(parents=True, exist_ok=True)
        recover(near)
        temporary = Path(tempfile.mkdtemp(prefix=_unfinished(target.resolve().name), suffix=".part", dir=near))
    except FileExistsError:
        raise BadInput("file", Text("Not a directory"), WRITABLE, file=folder) from None
    except (OSError, ValueError) as error:
        raise _unwritable(folder, error) from None
    try:
        written = [path.relative_to(temporary) for path in write(temporary)]
        for name in written:
            _refuse_links(target, name)
            may_replace(target / name, name.suffix)
        outdated = [file for page in written if page.suffix == ".html" for file in _outdated(temporary, target, page, written)]
        _flush(temporary)
        if target.exists():
            # From here on the new files are the result: a process that ends now is completed by the next one.
            temporary = temporary.rename(temporary.with_suffix(_COMPLETE))
            _move(temporary, target)
            for file in outdated:
                file.unlink(missing_ok=True)
        else:
            temporary.chmod(0o777 & ~_umask())
            temporary.rename(target)
    except OSError as error:
        raise _unwritable(folder, error) from None
    except BadInput as error:
        if error.file is None or not Path(error.file).is_relative_to(temporary):
            raise
        raise error.within(file=target / Path(error.file).relative_to(temporary)) from None
    finally:
        if temporary.suffix != _COMPLETE:
            shutil.rmtree(temporary, ignore_errors=True)
    return [target / name for name in written]


@contextmanager
def _alone_in(target: Path) -> Iterator[None]:
    """Keep other processes of armrs from writing several files to a folder meanwhile."""
    if sys.platform == "win32" or not target.is_dir():  # a folder that is new takes its place at once
        yield
        return
    import fcntl

    handle = os.open(target, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            found, allowed = Text("another process of armrs that writes to it"), "a folder that nobody writes to"
            raise BadInput("folder", found, allowed, file=target) from None
        yield
    finally:
        os.close(handle)


def recover(folder: Path) -> None:
    """Finish what processes left in a folder that ended in the midst of writing: complete results move to their places, others go."""
    for path in folder.glob(".*"):
        if path.is_symlink() or _at_work(path.with_suffix(".part").name, _UNFINISHED):
            continue
        if path.suffix == _COMPLETE:
            _move(path, folder)
        elif path.suffix == ".part" and path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        elif path.suffix == ".part":
            path.unlink(missing_ok=True)


def scratch_prefix(what: str) -> str:
    """Return the beginning of the name of a temporary folder; it holds the owner, so that `sweep_scratch` can remove it later."""
    return f"armrs-{what}-{_HOST}-{os.getpid()}-"


def sweep_scratch() -> None:
    """Remove temporary folders of processes that ended without doing so."""
    with suppress(OSError):
        for path in Path(tempfile.gettempdir()).glob("armrs-*"):
            if _SCRATCH.fullmatch(path.name) and not _at_work(path.name, _SCRATCH) and path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)


def _unfinished(name: str) -> str:
    return f".{name}.{_HOST}-{os.getpid()}."


def _at_work(name: str, pattern: re.Pattern[str]) -> bool:
    """Whether the process in a name is still there; one on another machine may be."""
    match = pattern.fullmatch(name)
    if match is None or match["host"] != _HOST:
        return True
    try:
        os.kill(int(match["process"]), 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def refuse_page_of_another(path: Path, maker: str | None) -> None:
    """Refuse to replace a page that another verb made, whose figures and numbers would stay behind without it, or that none made."""
    there = _maker(path) if path.is_file() else None
    if there == maker or not path.is_file() or path.stat().st_size == 0:
        return
    found = "a page that armrs did not make" if there is None else f"a report of armrs {there}"
    raise BadInput("file", Sentence(f"this folder holds {found}"), ANOTHER, file=path)


def _outdated(temporary: Path, target: Path, page: Path, written: list[Path]) -> list[Path]:
    """Return the pictures and numbered files of the former result of a verb that the new one beside `page` does not replace.

    Without a page of the verb, files by these names are not its own, and are refused.
    """
    maker, there = _maker(temporary / page), target / page.parent
    refuse_page_of_another(target / page, maker)
    if not (target / page).is_file():
        for path in (target / name for name in written if name.is_relative_to(page.parent)):
            if path.exists():
                raise BadInput("file", Sentence(f"armrs {maker} did not write this file"), ANOTHER, file=path)
        return []
    numbered = {_NUMBERED.sub(r"\1*\2", n.name) for n in written if n.parent == page.parent and _NUMBERED.fullmatch(n.name)}
    former = [*there.glob("figures/*.png"), *there.glob("figures/*.json"), *(path for form in numbered for path in there.glob(form))]
    return [path for path in former if path.relative_to(target) not in written]


def _maker(path: Path) -> str | None:
    """Return the verb that made a page, as stated in it."""
    with path.open("rb") as page:
        match = _GENERATOR.search(page.read(_HEAD))
    return match[1].decode("ascii") if match else None


def _refuse_links(target: Path, name: Path) -> None:
    """Refuse a place below a folder that lies behind a symbolic link: it may be anywhere."""
    for part in (*reversed(name.parents), name):
        if part != Path() and (target / part).is_symlink():
            raise BadInput("file", Text("a symbolic link"), "a file or folder of its own below the output folder", file=target / part)


def _flush(folder: Path) -> None:
    """Bring the content of all files of a folder to the disk."""
    for path in folder.rglob("*"):
        if path.is_file():
            with path.open("rb+") as written:
                os.fsync(written.fileno())


def _move(temporary: Path, target: Path) -> None:
    """Bring everything below one folder to another of the same file system, and remove it."""
    for path in sorted(temporary.rglob("*")):
        place = target / path.relative_to(temporary)
        if path.is_dir():
            place.mkdir(exist_ok=True)
        else:
            path.replace(place)
    shutil.rmtree(temporary, ignore_errors=True)


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
    """Refuse to replace a folder, and a file whose suffix is of another kind than `kind`."""
    target = Path(path)
    if target.is_dir():
        raise BadInput("file", Text("a folder"), "the name of a file", file=path)
    if target.is_file() and target.stat().st_size > 0 and target.suffix.lower() != kind:
        raise BadInput(
            "file", Text(f"an existing file with suffix {target.suffix!r}"), f"a new file, or a {kind} file to replace", file=path
        )


def may_replace_archive(path: PathLike, kind: str, member: str, mark: str = "") -> None:
    """Refuse to replace an archive without a `member` that holds the `mark` of what armrs writes."""
    target = Path(path)
    if not target.is_file() or target.stat().st_size == 0:
        return
    with suppress(OSError, zipfile.BadZipFile, KeyError, RuntimeError, NotImplementedError), zipfile.ZipFile(target) as archive:
        if mark.encode() in archive.read(member):
            return
    raise BadInput("file", Text(f"a {kind} file that armrs did not write"), "another name, or --force", file=path)


def output_folder(path: PathLike, place: str = "folder") -> Path:
    """Return a folder to write below; it need not exist yet, but it must not be a file. `place` is what the caller calls it."""
    folder = _path(place, path)
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
        raise BadInput("file", Text("Not a directory"), WRITABLE, file=path)
    if not os.access(there, os.W_OK):
        raise BadInput("file", Text("Permission denied"), WRITABLE, file=path)


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
    return BadInput("file", Text(reason), WRITABLE, file=path)
