"""Maps from the topics of a recording to the columns of a record.

A map is a TOML file of tables ``[[source]]``: ``columns``; ``topic``, the name, or ``type``, that
of its messages; ``fields``, names, or the path to a vector; ``unit``; ``frame`` (FRD, FRD to NED;
"geodetic" of latitude, longitude and altitude, which become east, north and up of the first fix;
"none"). Of several sources of the same columns the first that the recording has counts. ``extends``
names a ready map (`READY`), whose sources of other columns count too. Further keys: `Source`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, field, fields
from functools import cache
from pathlib import Path
from typing import Any

from boresight.model.errors import InputError
from boresight.sim.records.reading import kind_of, read_bytes

#: Maps that are ready, by name.
READY = ("px4", "ros")
#: Nanoseconds of the units that times may have.
TIME_UNITS = {"s": 1e9, "ms": 1_000_000, "us": 1_000, "ns": 1}
_FILLS = ("none", "hold", "linear")


@dataclass(frozen=True)
class Source:
    """Source of columns.

    Attributes
    ----------
    columns : tuple of str
    fields : tuple of str
        One for each column, or the path to a vector of them.
    topic, type : str
        Name of the topic, or else type of its messages.
    unit, frame : str
    scale : tuple of float
        Factors of the fields.
    time, delay : str
        Field with the time of a sample, or with what is added to the recorded time, in
        ``time_unit``.
    fill : str
        Values of rows between samples: none, hold, or linear (true values).
    covariance : str
        Field that is -1 in messages without a sample, as ROS has it.
    optional, comparison : bool
        May be missing; is another device's estimate.
    """

    columns: tuple[str, ...]
    fields: tuple[str, ...]
    topic: str = ""
    type: str = ""
    unit: str = ""
    frame: str = ""
    scale: tuple[float, ...] = field(default=(), repr=False)
    time: str = ""
    delay: str = ""
    time_unit: str = ""
    fill: str = "none"
    covariance: str = ""
    optional: bool = False
    comparison: bool = False

    @property
    def label(self) -> str:
        """Name or type of the topic."""
        return self.topic or self.type


@cache
def ready_map(name: str) -> tuple[Source, ...]:
    """The sources of one of `READY`."""
    return _sources(Path(__file__).with_name(f"{name}.toml"))


def read_map(path: str | Path) -> tuple[Source, ...]:
    """The sources of a file; an InputError names the source by its number, from 1."""
    return _sources(Path(path))


def _sources(path: Path) -> tuple[Source, ...]:
    content = read_bytes(path, "a map that can be read")
    try:
        data = tomllib.loads(content.decode())
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise InputError.at(
            str(path), wanted="a map in TOML", found=str(error)[:120], fix="correct the file"
        ) from None
    extends, tables = data.pop("extends", None), data.pop("source", None)
    if data or not isinstance(tables, list) or not tables or extends not in (None, *READY):
        raise InputError.at(
            str(path),
            wanted=f"tables [[source]], and perhaps extends = {' or '.join(map(repr, READY))}",
            found=", ".join([*map(str, data), *(["extends"] if extends else [])]) or "no source",
            fix="see the page on flight logs and bags",
        )
    sources = tuple(_source(f"{path}, source {k + 1}", table) for k, table in enumerate(tables))
    names = {source.columns for source in sources}
    inherited = () if extends is None else ready_map(extends)
    return sources + tuple(source for source in inherited if source.columns not in names)


def _source(where: str, table: Any) -> Source:
    if not isinstance(table, dict):
        raise _map_error(where, "a table", kind_of(table))
    kinds = {f.name: (f.type, f.default is MISSING) for f in fields(Source)}
    for name in table.keys() - kinds.keys():
        raise _map_error(where, f"keys {', '.join(kinds)}", name)
    values = {n: _value(f"{where}, {n}", str(kinds[n][0]), value) for n, value in table.items()}
    for name in [n for n, (_, required) in kinds.items() if required and not values.get(n)]:
        raise _map_error(where, f"a key {name}", "none")
    source = Source(**values)
    count = len(source.columns)
    if bool(source.topic) == bool(source.type):
        raise _map_error(where, "topic or type", "both" if source.topic else "neither")
    if len(source.fields) not in (1, count) or len(source.scale) not in (0, 1, count):
        raise _map_error(where, f"{count} fields, one for each column", str(len(source.fields)))
    if not source.frame and count > 1:
        raise _map_error(where, "a frame, for example FRD or FRD to NED (none: no vector)", "none")
    if source.frame not in ("", "none") and count != (4 if " to " in source.frame else 3):
        raise _map_error(where, f"columns for the frame {source.frame}", ", ".join(source.columns))
    if "unit" not in table and " to " not in source.frame and source.frame != "geodetic":
        raise _map_error(where, "a unit, since the file tells none ('': a plain number)", "none")
    if source.fill not in _FILLS:
        raise _map_error(where, f"fill {', '.join(_FILLS)}", repr(source.fill))
    if (source.time or source.delay) and source.time_unit not in TIME_UNITS:
        raise _map_error(where, f"time_unit {', '.join(TIME_UNITS)}", repr(source.time_unit))
    return source


def _value(where: str, kind: str, value: Any) -> Any:
    """A value of TOML as one of a source; a text or a number stands for a list of one."""
    if kind in ("str", "bool"):
        if isinstance(value, str if kind == "str" else bool):
            return value
        raise _map_error(where, "a text" if kind == "str" else "true or false", kind_of(value))
    types: tuple[type, ...] = (str,) if "str" in kind else (int, float)
    items: Sequence[Any] = value if isinstance(value, list) else [value]
    if not items or not all(isinstance(x, types) and not isinstance(x, bool) for x in items):
        raise _map_error(where, "texts" if "str" in kind else "numbers", kind_of(value))
    return tuple(items)


def _map_error(where: str, wanted: str, found: str) -> InputError:
    return InputError.at(where, wanted=wanted, found=found, fix="correct the map")
