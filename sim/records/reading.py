"""Reading of files that users name, with one-line errors for any content."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, BinaryIO

from boresight.model.errors import InputError
from boresight.model.tools.typed import parse_json


def reason(error: OSError) -> str:
    """Reason of an OSError, for ``found`` of an `InputError`."""
    if error.errno == errno.EISDIR:
        return "a folder"
    return (error.strerror or type(error).__name__).lower()


def read_bytes(path: str | os.PathLike[str], wanted: str) -> bytes:
    """Content of a file or pipe; ``wanted`` is the expected one, for the message.

    InputError for one that cannot be read, and for a device, which may be endless.
    """
    with opened(path, wanted) as file:
        return file.read()


@contextmanager
def opened(path: str | os.PathLike[str], wanted: str) -> Iterator[BinaryIO]:
    """Open a file, or a pipe; see `read_bytes`."""
    try:
        with open(path, "rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            if not stat.S_ISCHR(mode) and not stat.S_ISBLK(mode):
                yield file
                return
        fault = "a device"
    except OSError as error:
        fault = reason(error)
    where, fix = str(path) or "''", "check the path"
    raise InputError.at(where, wanted=wanted, found=fault, fix=fix) from None


def read_json(path: str | os.PathLike[str], wanted: str) -> Any:
    """Content of a JSON file, as `parse_json` reads it; ``wanted`` is the expected one."""
    content = read_bytes(path, f"{wanted} that can be read")
    try:
        return parse_json(content)
    except ValueError as error:
        found, fix = f"no JSON ({str(error)[:80]})", "correct the file"
        raise InputError.at(str(path), wanted=wanted, found=found, fix=fix) from None


def kind_of(value: Any) -> str:
    """Kind of a value of JSON, for ``found`` of an `InputError`."""
    kinds = {type(None): "nothing", list: "a list", dict: "an object"}
    text = str(value).lower() if isinstance(value, bool) else repr(value)
    return kinds.get(type(value), text)
