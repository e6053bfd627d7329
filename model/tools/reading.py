"""Reading of files that users name: bytes, JSON, and its conversion to dataclasses.

Errors of any content are one line.
"""

from __future__ import annotations

import errno
import json
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import MISSING, fields, is_dataclass
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, BinaryIO, NamedTuple, Union, get_args, get_origin, get_type_hints

from boresight.model.errors import InputError


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


def parse_json(content: bytes) -> Any:
    """Content of a JSON file as plain data; ValueError, with the reason, for another text.

    Stricter than Python's: NaN, infinity, very long numbers and repeated names are errors.
    """
    if not content.strip(b" \t\r\n\0"):
        raise ValueError("the file is empty" if not content.strip() else "zeros")
    try:
        text = content.decode("utf-8-sig")
        return json.loads(
            text, parse_int=_integer, parse_constant=_constant, object_pairs_hook=_unique
        )
    except RecursionError:
        raise ValueError("lists or objects nested too deeply") from None


def _integer(digits: str) -> int:
    if len(digits) > 100:
        raise ValueError(f"a number of {len(digits)} digits")
    return int(digits)


def _constant(name: str) -> float:
    raise ValueError(f"{name}, which JSON does not have")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for name, value in pairs:
        if name in values:
            raise ValueError(f"{name[:40]!r} twice")
        values[name] = value
    return values


class Within(NamedTuple):
    """Limits of a number, both included: ``Annotated[int, Within(0, 31)]``."""

    low: float
    high: float


class Malformed(ValueError):
    """Data that do not match a type: where, as ``", registers[1], width"``, and the value there."""

    def __init__(self, location: str, value: object) -> None:
        super().__init__(f"{location.removeprefix(', ') or 'the whole'} is {value!r}")
        self.location, self.value = location, value


def typed(hint: Any, data: Any, location: str = "") -> Any:
    """Convert ``data`` to the type ``hint``: dataclass, enumeration, tuple, union, number, text.

    Unknown keys of a dataclass are ignored; fields with a default may be missing. Raises Malformed
    for data of another type, or a number outside its limits.
    """
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        value, limits = typed(arguments[0], data, location), arguments[1]
        if value is None or limits.low <= value <= limits.high:
            return value
    elif origin in (Union, UnionType):
        if data is None and NoneType in arguments:
            return None
        *others, last = (h for h in arguments if h is not NoneType)
        for other in others:
            with suppress(Malformed):
                return typed(other, data, location)
        return typed(last, data, location)
    elif origin is tuple and isinstance(data, list):
        kinds = arguments[:1] * len(data) if arguments[-1] is Ellipsis else arguments
        if len(kinds) == len(data):
            return tuple(typed(kinds[k], x, f"{location}[{k}]") for k, x in enumerate(data))
    elif is_dataclass(hint) and isinstance(data, dict):
        return _record(hint, data, location)
    elif isinstance(hint, type) and issubclass(hint, Enum):
        if data in [member.value for member in hint]:
            return hint(data)
    elif isinstance(hint, type) and not is_dataclass(hint):
        kinds = (int, float) if hint is float else (hint,)
        if isinstance(data, kinds) and (hint is bool or not isinstance(data, bool)):
            return data
    raise Malformed(location, data)


def _record(record_type: Any, data: Any, location: str) -> Any:
    values = {}
    for field in fields(record_type):
        optional = field.default is not MISSING or field.default_factory is not MISSING
        if field.name in data or not optional:
            at = f"{location}, {field.name}"
            values[field.name] = typed(_hints(record_type)[field.name], data.get(field.name), at)
    return record_type(**values)


@cache
def _hints(record_type: type) -> dict[str, Any]:
    return get_type_hints(record_type, include_extras=True)
