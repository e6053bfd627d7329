"""Results of the functions of `boresight`: frozen dataclasses with documented fields.

`Answer.to_json` gives the fields as plain data, printed by ``--json``; ``str`` is the text of the
command line; a notebook shows tables.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from html import escape
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

import numpy as np

__all__ = ["SHARES", "Answer", "Figure", "Json", "JsonObject", "plain"]

#: Values of JSON.
Json: TypeAlias = "None | bool | int | float | str | list[Json] | dict[str, Json]"
JsonObject: TypeAlias = dict[str, Json]

#: Maximum length of a cell, characters.
_WIDEST = 160


#: Shares by which figures may get worse from one day to another, by kind.
SHARES = {"cycles": 0.0, "area": 0.01, "clock": 0.05, "error": 0.1, "count": 0.0}


@dataclass(frozen=True)
class Figure:
    """A figure of a result that can be compared with that of an earlier day.

    Attributes
    ----------
    title : str
    kind : str
        One of `SHARES`; "same": results that differ in it are not compared; empty: not judged.
    unit : str
        Default where the data have none.
    falls : bool
        Whether a smaller value is worse.
    """

    title: str
    kind: str
    unit: str = ""
    falls: bool = False


class Answer:
    """Base of the dataclasses that functions return.

    Attributes
    ----------
    judged : mapping of str to Figure
        Figures of `to_json` that can be compared with an earlier day, by place (`sim.baseline`).
    """

    judged: ClassVar[Mapping[str, Figure]] = {}

    def to_json(self) -> JsonObject:
        """Return the fields as plain data; arrays become lists, NaN and infinity None."""
        return {f.name: plain(getattr(self, f.name)) for f in fields(self)}  # type: ignore[arg-type]

    def _shown(self) -> JsonObject:
        """Data shown in a notebook."""
        return self.to_json()

    def _repr_html_(self) -> str:
        """Return the fields as tables: numbers and texts in one, each list of rows in another."""
        data = self._shown()
        scalars = {k: v for k, v in data.items() if not isinstance(v, list | dict)}
        parts = [_table([{"": k, type(self).__name__: v} for k, v in scalars.items()])]
        for name, value in data.items():
            rows = _rows(value)
            if rows:
                parts.append(f"<h4>{escape(name)}</h4>{_table(rows)}")
        return "\n".join(parts)


def plain(value: Any) -> Json:
    """Convert a value to plain data.

    Raises
    ------
    TypeError
        The value has no form in JSON.
    """
    if hasattr(value, "to_json"):
        data: JsonObject = value.to_json()
        return data
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name)) for f in fields(value)}
    if hasattr(value, "_asdict"):
        return plain(value._asdict())
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _numbers(np.asarray(value))
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    if isinstance(value, Path):
        return str(value)
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, Iterable):
        return [plain(v) for v in value]
    raise TypeError(f"JSON has nothing for {type(value).__name__}")


def _numbers(values: np.ndarray[Any, Any]) -> Json:
    """An array as lists, or a number."""
    objects = values.astype(object)
    if values.dtype.kind == "f":
        objects[~np.isfinite(values)] = None
    data: Json = objects.tolist()
    return data


def _rows(value: Json) -> Sequence[JsonObject]:
    """Rows of a table: of a list of objects, or of an object of objects or plain values."""
    if isinstance(value, list):
        return [row for row in value if isinstance(row, dict)]
    if not isinstance(value, dict):
        return []
    rows: list[JsonObject] = []
    for name, entry in value.items():
        if isinstance(entry, dict):
            rows.append({"": name, **entry})
        elif not isinstance(entry, list):
            rows.append({"": name, " ": entry})
    return rows


def _table(rows: Sequence[JsonObject]) -> str:
    """Table of rows, with a column for every name in any row; lists are left out."""
    rows = [_flat(row) for row in rows]
    heads = dict.fromkeys(k for row in rows for k, v in row.items() if v is not None)
    if not heads:
        return ""
    head = "".join(f"<th>{escape(head)}</th>" for head in heads)
    lines = ["".join(f"<td>{escape(_cell(row.get(head)))}</td>" for head in heads) for row in rows]
    body = "".join(f"<tr>{line}</tr>" for line in lines)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


def _flat(row: JsonObject) -> JsonObject:
    """Values of a row, and those of its objects as ``mean pos``."""
    out: JsonObject = {}
    for name, value in row.items():
        if isinstance(value, dict):
            nested = {f"{name} {k}": v for k, v in value.items()}
            out |= {k: v for k, v in nested.items() if not isinstance(v, list | dict)}
        elif not isinstance(value, list):
            out[name] = value
    return out


def _cell(value: Json) -> str:
    """Text of a value, shortened."""
    if isinstance(value, list | dict) or value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.6g}"
    text = f"{value:,}" if isinstance(value, int) and not isinstance(value, bool) else str(value)
    return text if len(text) <= _WIDEST else f"{text[: _WIDEST - 3]}..."
