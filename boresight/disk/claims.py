"""Locks on folders themselves: they end with the process, however it ends, and leave no file."""

from __future__ import annotations

import errno
import fcntl
import os
import weakref
from pathlib import Path
from types import TracebackType

__all__ = ["Claim", "claim"]

_BUSY = (errno.EAGAIN, errno.EACCES, errno.EWOULDBLOCK)


class Claim:
    """A lock on a folder, held until `release`, the end of the object or that of the process.

    A process of ours that forks shares it with its child.

    Parameters
    ----------
    descriptor : int
        Of the open folder; belongs to the claim.
    """

    def __init__(self, descriptor: int) -> None:
        self.descriptor = descriptor
        self.release = weakref.finalize(self, os.close, descriptor)

    def share(self) -> None:
        """Let others share it from now on."""
        fcntl.flock(self.descriptor, fcntl.LOCK_SH)

    def __enter__(self) -> Claim:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        self.release()


def claim(folder: Path, *, shared: bool = False, wait: bool = False) -> Claim | None:
    """Lock a folder, for this process alone or shared; None if it is not to be had.

    That is so, without ``wait``, when somebody holds it. On a file system that knows no locks
    nobody can tell: it gives shared claims and those waited for, which hold nobody off, and no
    others.

    Raises
    ------
    OSError
        There is no such folder, or it cannot be opened.
    """
    found = Claim(os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC))
    how = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
    try:
        fcntl.flock(found.descriptor, how if wait else how | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in _BUSY or not (wait or shared):
            found.release()
            return None
    except BaseException:
        found.release()
        raise
    return found
