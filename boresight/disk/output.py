"""Results of a verb: all of them or none, and nobody else's file touched.

`output_folder` for verbs that fill a folder, `OutputFile` for a single file. Both look at the place
before the work. What they wrote stands in the folder's manifest (`boresight.disk.manifest`); only
such files, unchanged, are ever overwritten or removed.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path

from boresight.disk.claims import claim
from boresight.disk.deferred import deferred
from boresight.disk.manifest import Manifest
from boresight.disk.place import (
    StrPath,
    absolute,
    descriptor_of,
    is_stream,
    made_folders,
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
from boresight.disk.staging import Staging, recover
from boresight.model.errors import InputError

__all__ = ["OutputFile", "apart", "free_name", "output_folder"]


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
    """A folder to write into; when the block ends well, its files move to ``path``.

    Files that the same verb wrote there before and not now are removed.

    Parameters
    ----------
    path : path
        Folder for the results; made if need be.
    by, of : str
        Verb, and what about: the manifest keeps them.
    files : iterable of str
        Relative paths that will be written, as far as they are known: looked at before the work.
        At the end those that were written are looked at again.
    inputs : iterable of paths
        Files that are read: none of them may be overwritten.
    option : str
        How users name another place.

    Raises
    ------
    InputError
        The place cannot be written, or a file in the way is somebody's: raised before the work,
        unless it came to be so meanwhile.
    """
    read = list(inputs)
    with _refusing(path, option):
        folder = Path(os.path.realpath(absolute(path, option)))
    with ExitStack() as stack:
        with _refusing(path, option), deferred():
            stack.enter_context(made_folders(folder))
            with _claimed(folder):
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
            with deferred(), _claimed(folder):
                _look(folder, by, staging.files(), read, option)
                staging.commit(by, of, clears=True)


class OutputFile:
    """A single file to write, looked at now and written later, once or more often.

    What is no plain file is written through: the file that a symbolic link leads to, a device, a
    FIFO, or the open file that ``/dev/stdout`` stands for.

    Parameters
    ----------
    path, by, of, inputs, option
        See `output_folder`.

    Attributes
    ----------
    written : bool
        Whether `write` has been done.

    Raises
    ------
    InputError
        The place cannot be written, is an input, or holds a file that is somebody's.
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
            self._place = absolute(path, option)
            self._stream = self._look()
            if self._stream:
                require_open_stream(self._place)
            else:
                folder = Path(os.path.realpath(self._place)).parent
                with deferred(), made_folders(folder, keep=False), _claimed(folder):
                    recover(folder)
                    Manifest.load(folder)  # refused if it is something else
                    Staging(folder).remove()

    def _look(self) -> bool:
        """Refuse what must not be written; whether it is written through."""
        path, option = self._place, self._option
        if os.fspath(self._path).endswith(os.sep):
            raise InputError.at(
                shown(self._path),
                wanted="the name of a file",
                found="a folder's",
                fix=f"choose another with {option}",
            )
        refuse_inputs(path, self._inputs, option)
        require_no_circle(path)
        if is_stream(path, option):
            return True
        require_ours(path, option)
        return False

    def write(self, content: str | bytes) -> None:
        """Write the file, whole.

        Raises
        ------
        InputError
            It cannot be written any more, or somebody's file stands there now.
        BrokenPipeError
            Who read from it has gone.
        """
        data = content.encode("utf-8") if isinstance(content, str) else content
        with _refusing(self._path, self._option):
            if self._descriptor is not None:
                for stream in (sys.stdout, sys.stderr):
                    stream.flush()
                with os.fdopen(os.dup(self._descriptor), "wb") as file:
                    file.write(data)
            elif self._stream:
                with self._place.open("wb") as file:
                    file.write(data)
            else:
                self._replace(data)
        self.written = True

    def _replace(self, data: bytes) -> None:
        target = Path(os.path.realpath(self._place))
        folder = target.parent
        with deferred(), made_folders(folder), _claimed(folder):
            recover(folder)
            self._look()
            staging = Staging(folder)
            with _removed(staging):
                (staging.new / target.name).write_bytes(data)
                staging.commit(self._by, self._of, clears=False)


def apart(**outputs: StrPath | None) -> None:
    """Refuse two outputs that are one file; their options are their names.

    Raises
    ------
    InputError
        Two are the same.
    """
    given = [(f"--{name}", path) for name, path in outputs.items() if path is not None]
    for k, (option, path) in enumerate(given):
        for other, before in given[:k]:
            alike = os.path.realpath(path) == os.path.realpath(before)
            if (alike or same_file(path, before)) and os.path.realpath(path) != os.devnull:
                raise InputError.at(
                    shown(path),
                    wanted="two outputs that are two files",
                    found=f"the same file behind {other}",
                    fix=f"choose another with {option}",
                )


def free_name(name: str, by: str, *, option: str) -> Path | None:
    """A default name, with a number where somebody's file has it; None: nothing can be written."""
    path = Path(name)
    for number in range(1, 100):
        found = path if number == 1 else path.with_stem(f"{path.stem}-{number}")
        try:
            OutputFile(found, by, option=option)
        except InputError:
            continue
        return found
    return None


#: What a disk without room says.
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@contextmanager
def _refusing(path: StrPath, option: str) -> Iterator[None]:
    """What the system says inside is a refusal of this path."""
    try:
        yield
    except (InputError, BrokenPipeError):
        raise
    except (OSError, ValueError) as error:
        raise refusal(path, error, option) from error


@contextmanager
def _claimed(folder: Path) -> Iterator[None]:
    """The folder for us alone: to look and to move."""
    held = claim(folder, wait=True)
    try:
        yield
    finally:
        if held is not None:
            held.release()


@contextmanager
def _removed(staging: Staging) -> Iterator[None]:
    """Remove a staging folder at the end of the block."""
    try:
        yield
    finally:
        with deferred():
            staging.remove()


def _write_through(folder: Path, staging: Staging, option: str) -> None:
    """Write what goes to a device or a FIFO; nobody waits for a FIFO's reader in the moves."""
    for name in staging.files():
        if is_stream(folder / name, option):
            with (folder / name).open("wb") as file:
                file.write((staging.new / name).read_bytes())
            (staging.new / name).unlink()


def _look(
    folder: Path, by: str, files: Iterable[str], inputs: Sequence[StrPath], option: str
) -> None:
    """Refuse a folder in which files to be written, or cleared, are somebody's."""
    old = Manifest.load(folder).by(by)
    for name in sorted({*files, *old}):
        target = folder / name
        for parent in reversed(Path(name).parents):
            require_folder(folder / parent)
        require_no_circle(target)
        refuse_inputs(target, inputs, option)
        if not is_stream(target, option):
            require_ours(target, option)
