"""Results of a verb: written completely or not at all, without touching other files.

`output_folder` serves verbs that fill a folder, `OutputFile` a single file. Both check the path
before the work. The folder's manifest lists what they wrote (`boresight.disk.manifest`); only
files listed there and unchanged since are overwritten or removed.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import BinaryIO

from boresight.disk.locks import lock_folder
from boresight.disk.manifest import Manifest, path_in
from boresight.disk.paths import (
    StrPath,
    absolute,
    created_folders,
    descriptor_of,
    is_stream,
    refusal,
    refuse_inputs,
    require_folder,
    require_no_circle,
    require_open,
    require_open_stream,
    require_ours,
    same_file,
    shown,
)
from boresight.disk.signals import deferred_signals
from boresight.disk.staging import Staging, recover
from boresight.model.errors import InputError

__all__ = ["OutputFile", "foreign_entries", "require_distinct", "free_name", "output_folder"]


@contextmanager
def output_folder(
    path: StrPath,
    by: str,
    *,
    of: str = "",
    files: Iterable[str] = (),
    inputs: Iterable[StrPath] = (),
    option: str = "-o",
) -> Iterator[Path]:
    """Give an empty folder to write into; if the block succeeds, its files move to ``path``.

    Files that the same verb wrote there before and does not write now are removed.

    Parameters
    ----------
    path : path
        Folder for the results; made if need be.
    by, of : str
        Verb and its subject, for the manifest.
    files : iterable of str
        Relative paths that will be written, as far as known; checked before the work. The files
        written are checked again at the end.
    inputs : iterable of paths
        Files that are read: none of them may be overwritten.
    option : str
        Command-line option by which users choose the path, for messages.

    Raises
    ------
    InputError
        The path cannot be written, or holds a file that Boresight did not write. Raised before
        the work, unless the folder changed meanwhile.
    """
    read = list(inputs)
    with _refusing(path, option):
        folder = Path(os.path.realpath(absolute(path, option)))
    with ExitStack() as stack:
        with _refusing(path, option), deferred_signals():
            stack.enter_context(created_folders(folder))
            with _locked(folder):
                recover(folder)
                _look(folder, by, files, read, option)
                staging = Staging(folder)
            stack.enter_context(_removed(staging))
        try:
            yield staging.new
        except OSError as error:
            if error.errno in _FULL or str(error.filename).startswith(str(staging.path)):
                raise refusal(path, error, option) from error
            raise
        with _refusing(path, option):
            _look(folder, by, staging.files(), read, option)
            _write_through(folder, staging, option)
            with deferred_signals(), _locked(folder):
                _look(folder, by, staging.files(), read, option)
                staging.commit(by, of, clears=True)


def foreign_entries(path: StrPath) -> int:
    """Number of files and folders in a folder that no verb has written to yet; 0 if absent."""
    folder = Path(path)
    if not folder.is_dir() or path_in(folder).exists():
        return 0
    return sum(1 for _ in folder.iterdir())


class OutputFile:
    """A single file, checked now and written later, once or repeatedly.

    A path that is not a plain file is written through: the target of a symbolic link, a device, a
    FIFO, or the open file behind ``/dev/stdout``.

    Parameters
    ----------
    path, by, of, inputs, option
        See `output_folder`.

    Attributes
    ----------
    written : bool
        Whether `write` has succeeded.

    Raises
    ------
    InputError
        The path cannot be written, is an input, or holds a file that Boresight did not write.
    """

    def __init__(
        self,
        path: StrPath,
        by: str,
        *,
        of: str = "",
        inputs: Iterable[StrPath] = (),
        option: str = "-o",
    ) -> None:
        self._path, self._by, self._of, self._option = path, by, of, option
        self._inputs = list(inputs)
        self.written = False
        self._descriptor = descriptor_of(path)
        with _refusing(path, option):
            if self._descriptor is not None:
                require_open(self._descriptor)
                return
            self._target = absolute(path, option)
            self._stream = self._look()
            if self._stream:
                require_open_stream(self._target)
            else:
                folder = Path(os.path.realpath(self._target)).parent
                with deferred_signals(), created_folders(folder, keep=False), _locked(folder):
                    recover(folder)
                    Manifest.load(folder)  # raises if it is not a manifest
                    Staging(folder).remove()

    def _look(self) -> bool:
        """Refuse a path that must not be written; True if it is a device or a FIFO."""
        path, option = self._target, self._option
        if os.fspath(self._path).endswith(os.sep):
            raise InputError.at(
                shown(self._path),
                wanted="the name of a file",
                found="a path that ends like a folder's",
                fix=f"choose another with {option}",
            )
        refuse_inputs(path, self._inputs, option)
        require_no_circle(path)
        if is_stream(path, option):
            return True
        require_ours(path, option)
        return False

    def write(self, content: str | bytes) -> None:
        """Write the whole file.

        Raises
        ------
        InputError
            The path cannot be written any more, or now holds a file of other origin.
        BrokenPipeError
            The reader of the FIFO or pipe has closed it.
        """
        with _refusing(self._path, self._option), self.opened() as file:
            file.write(content.encode("utf-8") if isinstance(content, str) else content)

    @contextmanager
    def opened(self) -> Iterator[BinaryIO]:
        """Write the whole file in the block: it is there when the block succeeds.

        Raises as `write`.
        """
        try:
            with ExitStack() as stack:
                yield stack.enter_context(self._opened())
        except OSError as error:
            if error.errno in _FULL:
                raise refusal(self._path, error, self._option) from error
            raise
        self.written = True

    @contextmanager
    def _opened(self) -> Iterator[BinaryIO]:
        path, option = self._path, self._option
        if self._descriptor is not None or self._stream:
            with _refusing(path, option):
                for stream in (sys.stdout, sys.stderr):
                    stream.flush()
                file = (
                    self._target.open("wb")
                    if self._descriptor is None
                    else os.fdopen(os.dup(self._descriptor), "wb")
                )
            with file:
                yield file
            return
        target = Path(os.path.realpath(self._target))
        folder = target.parent
        with ExitStack() as stack:
            with _refusing(path, option), deferred_signals():
                stack.enter_context(created_folders(folder))
                with _locked(folder):
                    recover(folder)
                    self._look()
                    staging = Staging(folder)
                stack.enter_context(_removed(staging))
            with (staging.new / target.name).open("wb") as file:
                yield file
            with _refusing(path, option), deferred_signals(), _locked(folder):
                self._look()
                staging.commit(self._by, self._of, clears=False)
                staging.remove()  # under the lock: no other process looks at it


def require_distinct(**outputs: StrPath | None) -> None:
    """Refuse two outputs that are one file; the keywords are their options.

    Raises
    ------
    InputError
        Two paths lead to the same file.
    """
    outputs_given = [(f"--{name}", path) for name, path in outputs.items() if path is not None]
    for k, (option, path) in enumerate(outputs_given):
        for other, before in outputs_given[:k]:
            alike = os.path.realpath(path) == os.path.realpath(before)
            if (alike or same_file(path, before)) and os.path.realpath(path) != os.devnull:
                raise InputError.at(
                    shown(path),
                    wanted="a file of its own for each output",
                    found=f"the same file as {other}",
                    fix=f"choose another with {option}",
                )


def free_name(name: str, by: str, *, option: str) -> Path | None:
    """Return a name, numbered if another file has it; None if no file can be written."""
    path = Path(name)
    for number in range(1, 100):
        candidate = path if number == 1 else path.with_stem(f"{path.stem}-{number}")
        try:
            OutputFile(candidate, by, option=option)
        except InputError:
            continue
        return candidate
    return None


#: Errors of a full disk.
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@contextmanager
def _refusing(path: StrPath, option: str) -> Iterator[None]:
    """Turn errors of the operating system in the block into an InputError for this path."""
    try:
        yield
    except (InputError, BrokenPipeError):
        raise
    except (OSError, ValueError) as error:
        raise refusal(path, error, option) from error


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Lock the folder exclusively for the block."""
    lock = lock_folder(folder, wait=True)
    try:
        yield
    finally:
        if lock is not None:
            lock.release()


@contextmanager
def _removed(staging: Staging) -> Iterator[None]:
    """Remove a staging folder at the end of the block."""
    try:
        yield
    finally:
        with deferred_signals():
            staging.remove()


def _write_through(folder: Path, staging: Staging, option: str) -> None:
    """Write to devices and FIFOs before the moves, which must not wait for a FIFO's reader."""
    for name in staging.files():
        if is_stream(folder / name, option):
            with (folder / name).open("wb") as file:
                file.write((staging.new / name).read_bytes())
            (staging.new / name).unlink()


def _look(
    folder: Path, by: str, files: Iterable[str], inputs: Sequence[StrPath], option: str
) -> None:
    """Refuse a folder in which files to be written or removed are not those of an earlier run."""
    old = Manifest.load(folder).by(by)
    for name in sorted({*files, *old}):
        target = folder / name
        for parent in reversed(Path(name).parents):
            require_folder(folder / parent)
        require_no_circle(target)
        refuse_inputs(target, inputs, option)
        if not is_stream(target, option):
            require_ours(target, option)
