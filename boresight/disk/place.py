"""Where a result is to go, looked at before the work that makes it."""

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
    "made_folders",
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
    """What to tell when the system refuses a place."""
    text = getattr(error, "strerror", None) or str(error) or type(error).__name__
    return InputError.at(
        shown(path),
        wanted="a place that can be written",
        found=text if text[1:2].isupper() else text[0].lower() + text[1:],
        fix=f"choose another with {option}, or change its permissions",
    )


def shown(path: StrPath) -> str:
    """A path for people: relative where it is below the working folder."""
    text = os.fspath(path)
    here = os.path.join(os.getcwd(), "")
    return text[len(here) :] if text.startswith(here) and text != here else text


def absolute(path: StrPath, option: str) -> Path:
    """The path, absolute, with the links in its folder followed but not the last one.

    Raises
    ------
    InputError
        It is empty.
    """
    text = os.fspath(path)
    if not text.strip():
        raise InputError.at(
            option, wanted="a name", found="an empty one", fix=f"write one behind {option}"
        )
    whole = os.path.abspath(text)
    return Path(os.path.realpath(os.path.dirname(whole)), os.path.basename(whole))


def descriptor_of(path: StrPath) -> int | None:
    """Number of the open file that the path stands for (``/dev/stdout``); None: it is no such."""
    text = os.path.normpath(os.fspath(path))
    numbered = _NUMBERED.fullmatch(text)
    return int(numbered[1]) if numbered else _DESCRIPTORS.get(text)


def is_stream(path: Path, option: str) -> bool:
    """Whether a path leads to something that is written through: a character device or a FIFO.

    Raises
    ------
    InputError
        It leads to what holds no result: a folder, a block device, a socket.
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
    """Refuse to overwrite or remove a file that Boresight did not write, or not so.

    Raises
    ------
    InputError
        The file is somebody's.
    """
    found = state(path)
    if found is State.FOREIGN and path.is_symlink():
        found = state(Path(os.path.realpath(path)))
    if found not in (State.ABSENT, State.OURS):
        raise InputError.at(
            shown(path),
            wanted="a free name, or a file as boresight wrote it",
            found=f"a file {found.value}",
            fix=f"move it away, or choose another place with {option}",
        )
    if found is State.OURS and not path.stat().st_mode & 0o222:
        raise InputError.at(
            shown(path),
            wanted="a file that can be written",
            found="a write-protected one",
            fix=f"allow writing, or choose another place with {option}",
        )


def require_folder(path: Path) -> None:
    """OSError unless files can be made in a folder, or the folder itself can."""
    if not path.exists():
        return
    if not path.is_dir():
        raise OSError(errno.ENOTDIR, f"a file {path.name!r} where a folder must be")
    if not os.access(path, os.W_OK | os.X_OK):
        raise OSError(errno.EACCES, os.strerror(errno.EACCES), str(path))


def require_no_circle(path: Path) -> None:
    """OSError if a symbolic link leads back to itself, or to a place whose folder is missing."""
    target = os.path.realpath(path)
    if os.path.islink(target):
        raise OSError(errno.ELOOP, os.strerror(errno.ELOOP), str(path))
    if path.is_symlink() and not os.path.isdir(os.path.dirname(target)):
        raise OSError(errno.ENOENT, "a link to a folder that is missing", str(path))


def require_open(descriptor: int) -> None:
    """OSError unless a descriptor is open for writing."""
    if fcntl.fcntl(descriptor, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY:
        raise OSError(errno.EBADF, "not open for writing")


def require_open_stream(path: Path) -> None:
    """OSError unless a device or a FIFO can be written; a full device (``/dev/full``) says so."""
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
        one, other = os.stat(a), os.stat(b)
    except (OSError, ValueError):
        return False
    if not os.path.samestat(one, other):
        return False
    return not stat.S_ISCHR(one.st_mode) or not _shared_device(a)


def _shared_device(path: StrPath) -> bool:
    if os.path.samefile(path, os.devnull):
        return True
    descriptor = descriptor_of(path)
    return descriptor is not None and os.isatty(descriptor)


def refuse_inputs(path: StrPath, inputs: Iterable[StrPath], option: str) -> None:
    """Refuse an output that is one of the inputs, by whatever names.

    Raises
    ------
    InputError
        It is.
    """
    for given in inputs:
        if same_file(path, given):
            raise InputError.at(
                shown(path),
                wanted="an output that is no input",
                found=f"the same file as the input {os.fspath(given)}",
                fix=f"choose another with {option}",
            )


@contextmanager
def made_folders(folder: Path, *, keep: bool = True) -> Iterator[None]:
    """Make a folder and those above it for the block.

    If the block fails, or without ``keep``, those made here go again, as far as they are empty.

    Raises
    ------
    OSError
        They cannot be made.
    """
    missing = []
    at = folder
    while not at.exists() and not at.is_symlink():
        missing.append(at)
        at = at.parent
    made: list[Path] = []
    failed = True
    try:
        for each in reversed(missing):
            with suppress(FileExistsError):  # somebody else's then
                each.mkdir()
                made.append(each)
        if not folder.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, "a file, no folder")
        yield
        failed = False
    finally:
        for each in reversed(made) if failed or not keep else ():
            with suppress(OSError):
                each.rmdir()
