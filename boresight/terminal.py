"""Standard output and standard error as terminal, file or pipe."""

from __future__ import annotations

import contextlib
import os
import sys
from typing import TextIO

from boresight.model.errors import InputError

__all__ = ["ClosedPipe", "abandon", "say", "tell"]


class ClosedPipe(Exception):
    """The reader of standard output has closed it; the work ends without an error."""


def say(text: str) -> None:
    """Print a line on standard output and flush.

    Raises
    ------
    ClosedPipe
        The reader has closed it.
    InputError
        Standard output is closed or full.
    """
    try:
        if sys.stdout is None:
            raise OSError(0, "closed")
        _print(text, sys.stdout)
    except BrokenPipeError:
        raise ClosedPipe from None
    except OSError as error:
        if sys.stdout is not None:
            abandon(sys.stdout)
        raise InputError.at(
            "standard output",
            wanted="a path that can be written",
            found=(error.strerror or type(error).__name__).lower(),
            fix="connect it to a terminal, a file or a pipe",
        ) from None


def tell(text: str) -> None:
    """Print a line on standard error; a closed or full one is ignored."""
    if sys.stderr is not None:
        try:
            _print(text, sys.stderr)
        except OSError:
            abandon(sys.stderr)


def abandon(stream: TextIO) -> None:
    """Redirect a stream to the null device, so that its buffer is not flushed again at exit."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        null_device = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null_device, stream.fileno())
        os.close(null_device)


def _print(text: str, stream: TextIO) -> None:
    try:
        stream.write(f"{text}\n")  # in one call: Ctrl-C cannot split a line
        stream.flush()
    except UnicodeEncodeError:  # file names may be any bytes, shown as escapes
        print(text.encode("ascii", "backslashreplace").decode(), file=stream, flush=True)
