"""Locks on folders. They end with the process, however it ends, and leave no file."""

from __future__ import annotations

import errno
import fcntl
import os
import weakref
from pathlib import Path
from types import TracebackType

__all__ = ["FolderLock", "lock_folder"]

_BUSY = (errno.EAGAIN, errno.EACCES, errno.EWOULDBLOCK)


class FolderLock:
    """A lock on a folder until `release`, the end of the object, or that of the process.

    A child made by fork shares the lock.

    Parameters
    ----------
    descriptor : int
        Of the open folder; closed by `release`.
    """

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor
        self.release = weakref.finalize(self, os.close, descriptor)

    def __enter__(self) -> FolderLock:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        self.release()


def lock_folder(folder: Path, *, shared: bool = False, wait: bool = False) -> FolderLock | None:
    """Lock a folder, exclusively or shared.

    Returns
    -------
    FolderLock or None
        None if another process holds the lock and ``wait`` is False. On a file system without
        locks, requests with ``shared`` or ``wait`` return a lock without effect, others None.

    Raises
    ------
    OSError
        The folder is missing or cannot be opened.
    """
    lock = FolderLock(os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC))
    mode = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
    try:
        fcntl.flock(lock.descriptor, mode if wait else mode | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in _BUSY or not (wait or shared):
            lock.release()
            return None
    except BaseException:
        lock.release()
        raise
    return lock
