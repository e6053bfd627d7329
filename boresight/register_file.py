"""The register map of a bitstream as `boresight compile` wrote it, read back and checked."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from boresight.model.errors import InputError
from boresight.sim.records.reading import kind_of, read_json

__all__ = ["read_registers"]

_WANTED = "a registers.json of `boresight compile`"


def _whole(low: int, high: int) -> Callable[[Any], bool]:
    return lambda x: isinstance(x, int) and not isinstance(x, bool) and low <= x <= high


def _text(x: Any) -> bool:
    return isinstance(x, str)


def _field(x: Any) -> bool:
    return (
        isinstance(x, dict)
        and _text(x.get("name"))
        and _whole(0, 31)(x.get("bit"))
        and _whole(1, 32)(x.get("width"))
    )


def _list_of(each: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda x: isinstance(x, list) and all(map(each, x))


#: What must be in a register, and what may be, None included: what `RegisterTable` reads.
_MUST = {"name": _text, "address": _whole(0, 4095)}
_MAY: dict[str, Callable[[Any], bool]] = {
    "access": _text,
    "unit": _text,
    "frac": _whole(-128, 128),
    "width": _whole(1, 32),
    "minimum": _whole(-(2**31), 2**32 - 1),
    "maximum": _whole(-(2**31), 2**32 - 1),
    "reset": _whole(-(2**31), 2**32 - 1),
    "signed": lambda x: isinstance(x, bool),
    "names": _list_of(_text),
    "fields": _list_of(_field),
}


def read_registers(path: str | Path) -> dict[str, Any]:
    """Data of a ``registers.json``.

    Raises
    ------
    InputError
        It cannot be read, or is something else; the message says where.
    """
    data = read_json(path, _WANTED)

    def refuse(where: str, value: Any) -> InputError:
        return InputError.at(
            f"{path}{where}",
            wanted=_WANTED,
            found=f"{kind_of(value)} there" if where else kind_of(value),
            fix="give the file of this board's bitstream",
        )

    if not isinstance(data, dict):
        raise refuse("", data)
    if not isinstance(data.get("registers"), list):
        raise refuse(", registers", data.get("registers"))
    for k, register in enumerate(data["registers"]):
        if not isinstance(register, dict):
            raise refuse(f", registers[{k}]", register)
        for key, good in (_MUST | _MAY).items():
            value = register.get(key)
            if not good(value) and (key in _MUST or value is not None):
                raise refuse(f", registers[{k}], {key}", value)
        if register["name"] == "clock_hz" and register.get("reset", 1) < 1:
            raise refuse(f", registers[{k}], reset", register["reset"])
    if not _list_of(_program)(data.get("programs", [])):
        raise refuse(", programs", data["programs"])
    return data


def _program(x: Any) -> bool:
    def port(y: Any) -> bool:
        return isinstance(y, dict) and _text(y.get("name")) and _whole(-128, 128)(y.get("frac"))

    return isinstance(x, dict) and _list_of(port)(x.get("outputs"))
