"""Checks of the paths of results, made before the work that computes them."""

from __future__ import annotations

import errno
import fcntl
import os
import re
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from boresight.disk.manifest import State, state
from boresight.model.errors import InputError

__all__ = [
    "StrPath",
    "absolute",
    "descriptor_of",
    "is_stream",
    "created_folders",
    "refusal",
    "refuse_inputs",
    "require_folder",
    "require_no_circle",
    "require_open",
    "require_open_stream",
    "require_ours",
    "same_file",
    "shown",
]

StrPath = str | os.PathLike[str]
_DESCRIPTORS = {"/dev/stdout": 1, "/dev/stderr": 2}
_NUMBERED = re.compile(r"/(?:dev|proc/self)/fd/(\d+)")
_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFBLK: "a block device",
    stat.S_IFSOCK: "a socket",
    stat.S_IFREG: "a file",
    stat.S_IFCHR: "a device",
    stat.S_IFIFO: "a FIFO",
}


def refusal(path: StrPath, error: OSError | ValueError, option: str) -> InputError:
    """Message for a path that the operating system refuses."""
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    denied = getattr(error, "errno", None) in (errno.EACCES, errno.EPERM)
    return InputError.at(
        shown(path),
        wanted="a path that can be written",
        found=text if text[1:2].isupper() else text[0].lower() + text[1:],
        fix=f"choose another with {option}" + ", or change its permissions" * denied,
    )


def shown(path: StrPath) -> str:
    """A path for messages: relative if it is below the working folder."""
    text = os.fspath(path)
    here = os.path.join(os.getcwd(), "")
    return text[len(here) :] if text.startswith(here) and text != here else text


def absolute(path: StrPath, option: str) -> Path:
    """Return the absolute path, with links resolved in its folder but not in its last part.

    Raises
    ------
    InputError
        The path is empty, or a dash.
    """
    text = os.fspath(path)
    if not text.strip():
        raise InputError.at(
            option, wanted="a name", found="an empty one", fix=f"write a name after {option}"
        )
    if text == "-":
        raise InputError.at(
            option,
            wanted="the name of a file or folder",
            found="-",
            fix="write /dev/stdout for standard output, ./- for a file of that name",
        )
    whole = os.path.abspath(text)
    return Path(os.path.realpath(os.path.dirname(whole)), os.path.basename(whole))


def descriptor_of(path: StrPath) -> int | None:
    """Descriptor that a path such as ``/dev/stdout`` stands for; None for other paths."""
    text = os.path.normpath(os.fspath(path))
    numbered = _NUMBERED.fullmatch(text)
    return int(numbered[1]) if numbered else _DESCRIPTORS.get(text)


def is_stream(path: Path, option: str) -> bool:
    """Whether a path leads to a character device or a FIFO, which are written through.

    Raises
    ------
    InputError
        It leads to a folder, a block device or a socket.
    """
    try:
        kind = stat.S_IFMT(path.stat().st_mode)
    except FileNotFoundError:
        return False
    if kind == stat.S_IFREG:
        return False
    if kind in (stat.S_IFCHR, stat.S_IFIFO):
        return True
    raise InputError.at(
        shown(path),
        wanted="the name of a file",
        found=_KINDS.get(kind, "something else"),
        fix=f"choose another with {option}",
    )


def require_ours(path: Path, option: str) -> None:
    """Refuse to overwrite or remove a file that Boresight did not write or that was changed.

    Raises
    ------
    InputError
        Boresight did not write the file, or it was changed since, or it is write-protected.
    """
    whose = state(path)
    if whose is State.FOREIGN and path.is_symlink():
        whose = state(Path(os.path.realpath(path)))
    if whose not in (State.ABSENT, State.OURS):
        raise InputError.at(
            shown(path),
            wanted="a free name, or an unchanged file written by boresight",
            found=f"a file {whose.value}",
            fix=f"move it away, or choose another path with {option}",
        )
    if whose is State.OURS and not path.stat().st_mode & 0o222:
        raise InputError.at(
            shown(path),
            wanted="a file that can be written",
            found="a write-protected one",
            fix=f"allow writing, or choose another path with {option}",
        )


def require_folder(path: Path) -> None:
    """Raise OSError unless files can be made in the folder, or the folder is still missing."""
    if not path.exists():
        return
    if not path.is_dir():
        raise OSError(errno.ENOTDIR, f"a file {path.name!r} where a folder must be")
    if not os.access(path, os.W_OK | os.X_OK):
        raise OSError(errno.EACCES, os.strerror(errno.EACCES), str(path))


def require_no_circle(path: Path) -> None:
    """Raise OSError if a symbolic link leads to itself or into a missing folder."""
    target = os.path.realpath(path)
    if os.path.islink(target):
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
    if path.is_symlink() and not os.path.isdir(os.path.dirname(target)):
        raise OSError(errno.ENOENT, "a link to a folder that is missing", str(path))


def require_open(descriptor: int) -> None:
    """Raise OSError unless a descriptor is open for writing."""
    if fcntl.fcntl(descriptor, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY:
        raise OSError(errno.EBADF, "not open for writing")


def require_open_stream(path: Path) -> None:
    """Raise OSError unless a device or a FIFO can be written; also for ``/dev/full``."""
    if not os.access(path, os.W_OK):
        raise OSError(errno.EACCES, os.strerror(errno.EACCES), str(path))
    if path.is_char_device():
        descriptor = os.open(path, os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)
        try:
            os.write(descriptor, b"")
        finally:
            os.close(descriptor)


def same_file(a: StrPath, b: StrPath) -> bool:
    """Whether two paths lead to one existing file (other than a terminal or ``/dev/null``)."""
    try:
        first, second = os.stat(a), os.stat(b)
    except (OSError, ValueError):
        return False
    if not os.path.samestat(first, second):
        return False
    return not stat.S_ISCHR(first.st_mode) or not _shared_device(a)


def _shared_device(path: StrPath) -> bool:
    if os.path.samefile(path, os.devnull):
        return True
    descriptor = descriptor_of(path)
    return descriptor is not None and os.isatty(descriptor)


def refuse_inputs(path: StrPath, inputs: Iterable[StrPath], option: str) -> None:
    """Refuse an output that is one of the inputs, also under another name.

    Raises
    ------
    InputError
        The output is one of the inputs.
    """
    for source in inputs:
        if same_file(path, source):
            raise InputError.at(
                shown(path),
                wanted="an output that is not an input",
                found=f"the same file as the input {os.fspath(source)}",
                fix=f"choose another with {option}",
            )


@contextmanager
def created_folders(folder: Path, *, keep: bool = True) -> Iterator[None]:
    """Make a folder and its parents for the block.

    If the block fails, or if ``keep`` is False, those made here are removed if empty.

    Raises
    ------
    OSError
        A folder cannot be made.
    """
    missing = []
    at = folder
    while not at.exists() and not at.is_symlink():
        missing.append(at)
        at = at.parent
    created: list[Path] = []
    failed = True
    try:
        for each in reversed(missing):
            with suppress(FileExistsError):  # made by another process meanwhile
                each.mkdir()
                created.append(each)
        if not folder.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, "a file, not a folder")
        yield
        failed = False
    finally:
        for each in reversed(created) if failed or not keep else ():
            with suppress(OSError):
                each.rmdir()
