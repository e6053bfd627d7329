"""Plain data, as JSON gives it, back into the dataclasses that it was made from."""

from __future__ import annotations

from dataclasses import MISSING, fields, is_dataclass
from enum import Enum
from functools import cache
from types import NoneType, UnionType
from typing import Annotated, Any, NamedTuple, Union, get_args, get_origin, get_type_hints


class Within(NamedTuple):
    """Limits of a number, both included: ``Annotated[int, Within(0, 31)]``."""

    low: float
    high: float


class Malformed(ValueError):
    """Data that a type does not describe.

    Attributes
    ----------
    place : str
        Where: ``", registers[1], width"``.
    value : object
        What stands there, None where nothing does.
    """

    def __init__(self, place: str, value: object) -> None:
        super().__init__(f"{place.removeprefix(', ') or 'the whole'} is {value!r}")
        self.place, self.value = place, value


def typed(hint: Any, data: Any, place: str = "") -> Any:
    """``data`` as the type ``hint``: dataclass, enumeration, tuple, union, number, text.

    Keys that a dataclass does not have are ignored; a field with a default may be missing.

    Raises
    ------
    Malformed
        The data are of another kind, or a number is outside its limits.
    """
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        value, limits = typed(arguments[0], data, place), arguments[1]
        if value is not None and not limits.low <= value <= limits.high:
            raise Malformed(place, data)
        return value
    if origin in (Union, UnionType):
        return _one_of(arguments, data, place)
    if origin is tuple:
        return _tuple(arguments, data, place)
    if is_dataclass(hint):
        return _record(hint, data, place)
    if isinstance(hint, type) and issubclass(hint, Enum):
        if data not in [member.value for member in hint]:
            raise Malformed(place, data)
        return hint(data)
    kinds = (int, float) if hint is float else hint
    if not isinstance(data, kinds) or (isinstance(data, bool) and hint is not bool):
        raise Malformed(place, data)
    return data


def _one_of(hints: tuple[Any, ...], data: Any, place: str) -> Any:
    if data is None and NoneType in hints:
        return None
    *others, last = (h for h in hints if h is not NoneType)
    for hint in others:
        try:
            return typed(hint, data, place)
        except Malformed:
            continue
    return typed(last, data, place)


def _tuple(hints: tuple[Any, ...], data: Any, place: str) -> tuple[Any, ...]:
    any_length = hints[-1] is Ellipsis
    if not isinstance(data, list) or not (any_length or len(data) == len(hints)):
        raise Malformed(place, data)
    kinds = [hints[0]] * len(data) if any_length else hints
    return tuple(typed(kinds[k], x, f"{place}[{k}]") for k, x in enumerate(data))


def _record(of: Any, data: Any, place: str) -> Any:
    if not isinstance(data, dict):
        raise Malformed(place, data)
    values = {}
    for field in fields(of):
        optional = field.default is not MISSING or field.default_factory is not MISSING
        if field.name in data or not optional:
            at = f"{place}, {field.name}"
            values[field.name] = typed(_hints(of)[field.name], data.get(field.name), at)
    return of(**values)


@cache
def _hints(of: type) -> dict[str, Any]:
    return get_type_hints(of, include_extras=True)
