"""Reading files that people name: whatever they are, one line says what is wrong."""

from __future__ import annotations

import errno
import json
import os
import stat
from typing import Any

from boresight.model.errors import InputError

__all__ = ["kind_of", "read_bytes", "read_json", "reason"]

#: Most digits of a number in JSON.
_DIGITS = 100
#: Largest file of JSON, bytes.
_JSON_MOST = 64 << 20


def reason(error: OSError) -> str:
    """Why a file could not be used, for ``found`` of an `InputError`."""
    if error.errno == errno.EISDIR:
        return "a folder"
    return (error.strerror or type(error).__name__).lower()


def read_bytes(path: str | os.PathLike[str], wanted: str) -> bytes:
    """Content of a file, or of a pipe.

    Parameters
    ----------
    wanted : str
        What it should be, for the message: "a log file that can be read".

    Raises
    ------
    InputError
        It cannot be read, or is a device, which may have no end.
    """
    try:
        with open(path, "rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            if not stat.S_ISCHR(mode) and not stat.S_ISBLK(mode):
                return file.read()
        found = "a device"
    except OSError as error:
        found = reason(error)
    raise InputError.at(
        str(path) or "''", wanted=wanted, found=found, fix="check the path"
    ) from None


def read_json(path: str | os.PathLike[str], wanted: str) -> Any:
    """Content of a JSON file, as plain data.

    Stricter than Python: no NaN and no infinity, no name twice in one object.

    Raises
    ------
    InputError
        It cannot be read or is not JSON; the message says where.
    """
    content = read_bytes(path, f"{wanted} that can be read")
    try:
        if len(content) > _JSON_MOST:
            raise ValueError(f"{len(content):,} bytes")
        return json.loads(
            content.decode("utf-8-sig"),
            parse_int=_integer,
            parse_constant=_constant,
            object_pairs_hook=_object,
        )
    except UnicodeDecodeError:
        found = "bytes that are no UTF-8 text" if content.strip(b"\0") else "zeros"
    except json.JSONDecodeError as error:
        found = (
            f"no JSON in line {error.lineno}, column {error.colno}"
            if content.strip()
            else "an empty file"
        )
    except RecursionError:
        found = "lists or objects nested too deeply"
    except ValueError as error:
        found = str(error)
    raise InputError.at(str(path), wanted=wanted, found=found, fix="correct the file") from None


def _integer(digits: str) -> int:
    if len(digits) > _DIGITS:
        raise ValueError(f"a number of {len(digits)} digits")
    return int(digits)


def _constant(name: str) -> float:
    raise ValueError(f"{name}, which JSON does not have")


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name, value in pairs:
        if name in found:
            raise ValueError(f"{name[:40]!r} twice")
        found[name] = value
    return found


def kind_of(value: Any) -> str:
    """What a value of JSON is, for ``found`` of an `InputError`."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return str(value)
    if isinstance(value, str):
        return repr(value)
    return "a list" if isinstance(value, list) else "an object"
