"""Standard output and standard error, whatever they are connected to."""

from __future__ import annotations

import contextlib
import os
import sys
from typing import TextIO

from boresight.model.errors import InputError

__all__ = ["ClosedPipe", "abandon", "say", "tell"]


class ClosedPipe(Exception):
    """Who read standard output has gone: the end of the work, and no fault."""


def say(text: str) -> None:
    """Print a line on standard output, now.

    Raises
    ------
    ClosedPipe
        Nobody reads it any more.
    InputError
        It is closed or full.
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
            wanted="a place that can be written",
            found=(error.strerror or type(error).__name__).lower(),
            fix="connect it to a terminal, a file or a pipe",
        ) from None


def tell(text: str) -> None:
    """Print a line on standard error, if anybody is there; what is told is never worth a stop."""
    if sys.stderr is not None:
        try:
            _print(text, sys.stderr)
        except OSError:
            abandon(sys.stderr)


def abandon(stream: TextIO) -> None:
    """Let a stream lead nowhere: what its buffer holds is not tried again at exit."""
    with contextlib.suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def _print(text: str, stream: TextIO) -> None:
    try:
        stream.write(f"{text}\n")  # at once: Ctrl-C comes before or behind a line
        stream.flush()
    except UnicodeEncodeError:  # names of files may be any bytes; ASCII holds all escapes
        print(text.encode("ascii", "backslashreplace").decode(), file=stream, flush=True)
