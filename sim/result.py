"""The result of a verb: data, tables, notes and a verdict; and its comparison with an earlier one.

Every function of `boresight` returns a `Result`. ``result["name"]`` is a value of it, `Result.good`
the verdict, `Result.to_json` what ``--json`` prints, ``str`` what the command line prints, and a
notebook shows. ``pandas.DataFrame(result.tables["name"])`` is one of them.
"""

from __future__ import annotations

import math
import shutil
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from html import escape
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from boresight.model.declarations import PERIODS
from boresight.model.errors import InputError, require
from boresight.model.tools.reading import kind_of, read_json

#: Values of JSON.
Json: TypeAlias = "None | bool | int | float | str | list[Json] | dict[str, Json]"
JsonObject: TypeAlias = dict[str, Json]
#: Values by the name of their column.
Row: TypeAlias = Mapping[str, Any]

#: A figure, or its absence.
Number: TypeAlias = float | str | None
#: Keys whose values name an entry of a list.
NAMES = ("design", "estimator", "log", "dataset", "trial", "level", "output", "signal")
#: Shares by which figures may be worse than the earlier ones, by kind.
SHARES = {"cycles": 0.0, "area": 0.01, "clock": 0.05, "truth": 0.1, "count": 0.0}
#: Kinds that are judged against the tolerance beside them.
LIMITED = ("rounding", "textbook")
#: Kinds of which only the earlier value is accepted; ``value``: within the tolerance beside it.
FIXED = ("parameter", "value")
#: What a baseline is, for messages.
EARLIER = "an earlier result, which --json prints"
#: Characters of a digest that are shown.
_SHOWN = 12
#: Width of a text that is not printed in a terminal, characters.
_WIDTH = 160


@dataclass(frozen=True)
class Figure:
    """A figure of a result that can be compared with an earlier one (docs/learn/ci.md).

    Its kind says against what it is judged: the earlier figure, of which it may be worse by a share
    (`SHARES`); the tolerance beside it (`LIMITED`); or no other value is accepted (`FIXED`), and of
    several values of one output the first that differs is told. The change of an ``identity`` is
    said and not judged; results that differ in a figure of kind ``same`` are not compared. ``unit``
    is for data without one; ``falls``: a smaller value is worse.
    """

    title: str
    kind: str
    unit: str = ""
    falls: bool = False


@dataclass(frozen=True, eq=False)
class Result(Mapping[str, Any]):
    """What a verb gives.

    ``data`` is everything by name: numbers, texts, arrays, rows. People are shown ``tables``, rows
    by title, and ``summary``, lines above them. ``notes`` are warnings, ``failures`` what is wrong,
    one line each; no failures where the result is good. ``judged`` are figures that can be compared
    with an earlier result, by patterns of their places in the JSON: names with dots between, ``*``
    for each entry of a list or an object.
    """

    data: Mapping[str, Any]
    tables: Mapping[str, Sequence[Row]] = field(default_factory=dict)
    summary: str = ""
    notes: Sequence[str] = ()
    failures: Sequence[str] = ()
    judged: Mapping[str, Figure] = field(default_factory=dict, repr=False)

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
    if value is None:
        return ""
    if isinstance(value, float | np.floating):
        return f"{value:.4g}" if np.isfinite(value) else "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:,}" if isinstance(value, int | np.integer) else str(value)


class _Found(NamedTuple):
    """A figure of a result: its value, its unit, and the tolerance beside it."""

    figure: Figure
    value: Number
    unit: str
    tolerance: float | None


def baseline(result: Result, file: str | Path) -> Result:
    """Compare a result of `boresight.check`, `compile` or `accuracy` with an earlier one.

    ``file`` is the output of the verb with ``--json``, or ``json.dumps(result.to_json())``. Returns
    ``changes``; good unless something is worse than accepted (`Figure`). Raises InputError
    for a file that is not such a result, or a result of something else.
    """
    wanted, fix = "a result of check, compile or accuracy", "compare one of these"
    require(bool(result.judged), "baseline", wanted, "one of another verb", fix)
    earlier = read_json(file, EARLIER)
    names = ", ".join(earlier) if isinstance(earlier, dict) else ""
    found = f"one of {names}"[:80] if names else kind_of(earlier)
    good = bool(_figures(earlier, result.judged))
    require(good, str(file), f"{EARLIER} for the same verb", found, "write it with --json > FILE")
    return compared(result.to_json(), earlier, result.judged, file=file)


def compared(now: Any, before: Any, judged: Mapping[str, Figure], *, file: str | Path) -> Result:
    """Compare plain data of a result with an earlier one.

    Returns the number of ``equal`` figures and the ``changes``, the worse ones first; good unless a
    figure is worse than accepted, or missing. Raises InputError if they cannot be compared.
    """
    old, new = _figures(before, judged), _figures(now, judged)
    was_of, is_of = _subjects(before), _subjects(now)
    good = not was_of or not is_of or bool({*was_of} & {*is_of})
    fix = "compare results of the same estimator and log"
    require(good, str(file), f"results of {', '.join(is_of)}", ", ".join(was_of), fix)
    equal = 0
    changes, rows, notes = list[dict[str, Any]](), list[dict[str, Any]](), list[str]()
    told = set[str]()
    if "value" in {x.figure.kind for x in new.values()} - {x.figure.kind for x in old.values()}:
        notes.append(f"{file} has no values of float64, so that none is compared: write it anew")
    for name in dict.fromkeys((*old, *new)):
        a, b = old.get(name), new.get(name)
        found = b or a
        assert found is not None
        was, value = (None if x is None else x.value for x in (a, b))
        if found.figure.kind in LIMITED and a and b and a.tolerance != b.tolerance:
            limits = f"{_text(a.tolerance)} to {_text(b.tolerance)} {b.unit}".rstrip()
            notes.append(f"{name}: its tolerance has changed: {limits}")
        bounds = [x.tolerance for x in (a, b) if x is not None and x.tolerance is not None]
        if found.figure.kind == "value":
            if isinstance(was, float) and isinstance(value, float) and bounds:
                moved = math.remainder(value - was, PERIODS.get(found.unit, math.inf))
                was = value if abs(moved) <= min(bounds) else was
            output = name.rpartition(", ")[0]
            if None in (was, value) or (was != value and output in told):
                continue
            told.update([output] * (was != value))
        if was == value:
            equal += 1
            continue
        if found.figure.kind == "identity":
            if was is not None:
                notes.append(f"{name} has changed: {_short(was)} to {_short(value)}")
        elif found.figure.kind != "same":
            changes.append(_change(name, found, was, value, min(bounds, default=None)))
        elif a is not None and b is not None:
            wanted = f"an earlier result of the same {name}, {_text(value)}"
            fix = "compare with one of the same, or write it again with --json"
            raise InputError.at(str(file), wanted=wanted, found=_text(was), fix=fix)
    changes.sort(key=lambda c: (not c["worse"], c["kind"] != "parameter", -(c["share"] or 0.0)))
    for change in changes:
        share = None
        if change["share"] is not None and change["kind"] not in FIXED:
            # Of the figure itself: a clock that falls has a minus.
            share = f"{(change['now'] - change['before']) / abs(change['before']):+.1%}"
        row = {"figure": change["figure"]} | {end: _shown(change, end) for end in ("before", "now")}
        worse = "CHANGED" if change["kind"] in FIXED else "WORSE"
        worse = worse if change["worse"] else ""
        rows.append(row | {"unit": change["unit"] or None, "change": share, "": worse or None})
    summary = f"against {file}: {equal} figures equal, {len(changes)} changed"
    failures = []
    if more := sum(c["worse"] for c in changes):
        first, others = changes[0], f", and {more - 1} more" if more > 1 else ""
        was, value = (_text(_shown(first, end)) for end in ("before", "now"))
        text = f"{first['figure']} {was} -> {value} {first['unit']}".rstrip()
        kind = "not as in" if first["kind"] in FIXED else "worse than"
        failures = [f"{kind} {file}: {text}{others}"]
    data = {"file": str(file), "equal": equal, "changes": changes}
    return Result(data, {"changes": rows} if rows else {}, summary, notes, failures)


def _subjects(data: Any) -> list[str]:
    """The estimator and the log of each result of `check`."""
    results = data.get("results", ()) if isinstance(data, dict) else ()
    return [f"{x.get('estimator')} on {x.get('log')}" for x in results if isinstance(x, dict)]


def _change(
    name: str, found: _Found, old: Number, new: Number, tolerance: float | None
) -> dict[str, Any]:
    """A figure that has changed; ``share`` is by how much of the earlier one it is worse."""
    kind, share = found.figure.kind, None
    worse = new is None or (kind in FIXED and old is not None)
    if isinstance(old, float) and isinstance(new, float):
        worsening = (new - old) * (-1 if found.figure.falls else 1)
        share = worsening / abs(old) if old else None
        worse |= tolerance is not None and new > tolerance
        if kind in SHARES:
            worse = worsening > SHARES[kind] * abs(old)
    data = {"figure": name, "kind": kind, "unit": found.unit}
    return {**data, "before": old, "now": new, "share": share, "worse": worse}


def _shown(change: Mapping[str, Any], end: str) -> Number:
    """The value before or now, of a parameter in every digit, of an output in nine."""
    value: Number = change[end]
    if change["kind"] == "value" and isinstance(value, float):
        return f"{value:.9g}"
    return str(value) if change["kind"] == "parameter" and value is not None else value


def _text(value: Number) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 1e4 else f"{value:,.0f}"
    return "none" if value is None else str(value)


def _short(value: Number) -> str:
    return value[:_SHOWN] if isinstance(value, str) else _text(value)


def _figures(data: Any, judged: Mapping[str, Figure]) -> dict[str, _Found]:
    """Every judged figure of a result, by name; None values are left out."""
    out: dict[str, _Found] = {}
    for pattern, figure in judged.items():
        for labels, value, beside in _places(data, pattern.split("."), (), {}):
            name = ": ".join(filter(None, (", ".join(dict.fromkeys(labels)), figure.title)))
            number = float(value) if isinstance(value, int | float) else value
            unit = "" if figure.kind == "count" else beside.get("unit") or figure.unit
            entry = _Found(figure, number, unit, beside.get("tolerance"))
            k = 1
            while (key := name if k == 1 else f"{name} ({k})") in out and out[key] != entry:
                k += 1
            out[key] = entry
    return out


def _places(
    data: Any, path: Sequence[str], labels: tuple[str, ...], beside: Mapping[str, Any]
) -> Iterator[tuple[tuple[str, ...], Any, Mapping[str, Any]]]:
    """Numbers and texts at a pattern: names of entries on the path, value, what stands beside."""
    if not path:
        if isinstance(data, int | float | str):
            yield labels, data, beside
        return
    if isinstance(data, dict) and path[0] != "*":
        if path[0] in data:
            yield from _places(data[path[0]], path[1:], labels, data)
    elif isinstance(data, list) and path[0] == "*":
        for entry in data:
            names = [entry[n] for n in NAMES if isinstance(entry, dict) and entry.get(n)]
            yield from _places(entry, path[1:], (*labels, *map(str, names)), beside)
    elif isinstance(data, dict):
        for name, entry in data.items():
            yield from _places(entry, path[1:], (*labels, name), {**beside, **data})
