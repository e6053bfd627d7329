"""The result of a verb: data, tables, notes and a verdict; as text, JSON and HTML.

Every function of `boresight` returns a `Result`. ``result["name"]`` is a value of it, `Result.good`
the verdict, `Result.to_json` what ``--json`` prints, ``str`` what the command line prints, and a
notebook shows. ``pandas.DataFrame(result.tables["name"])`` is one of them.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from html import escape
from io import StringIO
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

#: Values of JSON.
Json: TypeAlias = "None | bool | int | float | str | list[Json] | dict[str, Json]"
JsonObject: TypeAlias = dict[str, Json]
#: Values by the name of their column.
Row: TypeAlias = Mapping[str, Any]

#: Width of a text that is not printed in a terminal, characters.
_WIDTH = 160


@dataclass(frozen=True, eq=False)
class Result(Mapping[str, Any]):
    """What a verb gives.

    Attributes
    ----------
    data : mapping of str
        Everything by name: numbers, texts, arrays, rows.
    tables : mapping of str to sequence of rows
        What people are shown, by title.
    summary : str
        Lines above the tables.
    notes : sequence of str
        Warnings, one line each.
    failures : sequence of str
        What is wrong, one line each; none where the result is good.
    judged : mapping of str to Figure
        Figures of ``data`` that can be compared with an earlier result (`sim.baseline`).
    """

    data: Mapping[str, Any]
    tables: Mapping[str, Sequence[Row]] = field(default_factory=dict)
    summary: str = ""
    notes: Sequence[str] = ()
    failures: Sequence[str] = ()
    judged: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @property
    def good(self) -> bool:
        """Nothing failed."""
        return not self.failures

    def __getitem__(self, name: str) -> Any:
        return self.data[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.data)

    def __len__(self) -> int:
        return len(self.data)

    def to_json(self) -> JsonObject:
        """Plain data: ``good``, the data, ``notes`` and ``failures``."""
        data = plain(self.data)
        assert isinstance(data, dict)
        told: JsonObject = {"notes": list(self.notes), "failures": list(self.failures)}
        return {"good": self.good, **data, **told}

    def __str__(self) -> str:
        parts = [self.summary] if self.summary else []
        parts += [table_text(rows, title) for title, rows in self.tables.items() if rows]
        parts += [f"warning: {note}" for note in self.notes]
        parts += [f"FAILED: {'; '.join(self.failures)}"] * (not self.good)
        return "\n".join(parts)

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


def plain(value: Any) -> Json:
    """Convert a value to plain data; NaN and infinity become None. Raises TypeError."""
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


def table_text(rows: Sequence[Row], title: str = "") -> str:
    """A table in plain text: numbers to the right, a column for every name in any row."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=SIMPLE_HEAD, pad_edge=False, show_edge=False, title_justify="left")
    names = dict.fromkeys(name for row in rows for name in row)
    heads = [name for name in names if any(row.get(name) is not None for row in rows)]
    for head in heads:
        numbers = any(_is_number(row.get(head)) for row in rows)
        table.add_column(Text(head), justify="right" if numbers else "left", overflow="fold")
    for row in rows:
        table.add_row(*(Text(_cell(row.get(head))) for head in heads))
    text = StringIO()
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else _WIDTH
    Console(file=text, width=width, color_system=None, highlight=False).print(table)
    lines = [line.rstrip() for line in text.getvalue().splitlines()]
    return "\n".join([title] * bool(title) + lines)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)


def _cell(value: Any) -> str:
    """Text of a value."""
    if value is None:
        return ""
    if isinstance(value, float | np.floating):
        return f"{value:.4g}" if np.isfinite(value) else "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:,}" if isinstance(value, int | np.integer) else str(value)
