"""Results compared with earlier ones: which figures changed, and which are worse than accepted.

A result says which of its numbers are judged (`Result.judged`), by patterns of places in its JSON:
names with dots between, ``*`` for each entry of a list or an object. How a figure is judged depends
on its kind:

========= =========================================================================================
kind      judged
========= =========================================================================================
cycles    against the earlier figure: no more
area      against the earlier figure: up to 1 % more
clock     against the earlier figure: up to 5 % slower
truth     against the earlier figure: an error from the truth, up to 10 % more
count     against the earlier figure: no more
rounding  against the tolerance beside it: an error of fixed point from float64
textbook  against the tolerance beside it: a difference of float64 from the textbook's form
parameter against the earlier value, or limit of an error from the truth: no other one
identity  not at all: a digest of the program or a tolerance, whose change is said
same      results that differ in it are not compared
========= =========================================================================================

A tolerance that differs from the earlier one is said; a changed figure is judged by the smaller.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from boresight.model.errors import InputError, require
from boresight.sim.records.reading import kind_of, read_json
from boresight.sim.result import Result

Number: TypeAlias = float | str | None
#: Keys whose values name an entry of a list.
NAMES = ("design", "estimator", "log", "dataset", "trial", "level", "output", "signal")
#: Shares by which figures may be worse than the earlier ones, by kind.
SHARES = {"cycles": 0.0, "area": 0.01, "clock": 0.05, "truth": 0.1, "count": 0.0}
#: Kinds that are judged against the tolerance beside them.
LIMITED = ("rounding", "textbook")
#: Characters of a digest that are shown.
_SHOWN = 12


@dataclass(frozen=True)
class Figure:
    """A figure of a result that can be compared with an earlier one: one of the module's kinds.

    ``unit`` is for data without one; ``falls``: a smaller value is worse.
    """

    title: str
    kind: str
    unit: str = ""
    falls: bool = False


class _Found(NamedTuple):
    """A figure of a result: its value, its unit, and the tolerance beside it."""

    figure: Figure
    value: Number
    unit: str
    tolerance: float | None


def baseline(result: Result, file: str | Path) -> Result:
    """Compare a result with an earlier one.

    Parameters
    ----------
    result : Result
        Of `boresight.check`, `compile` or `accuracy`.
    file : path
        Output of the verb with ``--json``; or ``json.dumps(result.to_json())``.

    Returns
    -------
    Result
        ``changes``; good unless something is worse than accepted (see this module).

    Raises
    ------
    InputError
        A file that is not such a result, or a result of something else.
    """
    wanted, fix = "a result of check, compile or accuracy", "compare one of these"
    require(bool(result.judged), "baseline", wanted, "one of another verb", fix)
    wanted = "an earlier result, which --json prints"
    earlier = read_json(file, wanted)
    found = f"one of {', '.join(earlier)}"[:80] if isinstance(earlier, dict) else kind_of(earlier)
    good = bool(_figures(earlier, result.judged))
    require(good, str(file), f"{wanted} for the same verb", found, "write it with --json > FILE")
    return compared(result.to_json(), earlier, result.judged, file=file)


def compared(now: Any, before: Any, judged: Mapping[str, Figure], *, file: str | Path) -> Result:
    """Compare plain data of a result with an earlier one.

    Returns the number of ``equal`` figures and the ``changes``, the worse ones first; good unless a
    figure is worse than accepted, or missing. Raises InputError if they cannot be compared.
    """
    old, new = _figures(before, judged), _figures(now, judged)
    equal = 0
    changes, rows, notes = list[dict[str, Any]](), list[dict[str, Any]](), list[str]()
    for name in dict.fromkeys((*old, *new)):
        a, b = old.get(name), new.get(name)
        found = b or a
        assert found is not None
        was, value = (None if x is None else x.value for x in (a, b))
        if found.figure.kind in LIMITED and a and b and a.tolerance != b.tolerance:
            limits = f"{_text(a.tolerance)} to {_text(b.tolerance)} {b.unit}".rstrip()
            notes.append(f"{name}: its tolerance has changed: {limits}")
        if was == value:
            equal += 1
            continue
        if found.figure.kind == "identity":
            if was is not None:
                notes.append(f"{name} has changed: {_short(was)} to {_short(value)}")
        elif found.figure.kind != "same":
            bounds = [x.tolerance for x in (a, b) if x is not None and x.tolerance is not None]
            changes.append(_change(name, found, was, value, min(bounds, default=None)))
        elif a is not None and b is not None:
            raise InputError.at(
                str(file),
                wanted=f"an earlier result of the same {name}, {_text(value)}",
                found=_text(was),
                fix="compare with one of the same, or write it again with --json",
            )
    changes.sort(key=lambda c: (not c["worse"], c["kind"] != "parameter", -(c["share"] or 0.0)))
    for change in changes:
        row = {name: change[name] for name in ("figure", "before", "now")}
        if change["kind"] == "parameter":  # in every digit
            row |= {name: str(row[name]) for name in ("before", "now") if row[name] is not None}
        share = None
        if change["share"] is not None and change["kind"] != "parameter":
            # Of the figure itself: a clock that falls has a minus.
            share = f"{(change['now'] - change['before']) / abs(change['before']):+.1%}"
        worse = "WORSE" if change["worse"] else None
        rows.append(row | {"unit": change["unit"] or None, "change": share, "": worse})
    summary = f"against {file}: {equal} figures equal, {len(changes)} changed"
    failures = []
    if more := sum(c["worse"] for c in changes):
        first, others = changes[0], f", and {more - 1} more" if more > 1 else ""
        is_parameter = first["kind"] == "parameter"
        was, value = (
            str(x) if is_parameter and x is not None else _text(x)
            for x in (first["before"], first["now"])
        )
        text = f"{first['figure']} {was} -> {value} {first['unit']}".rstrip()
        failures = [f"{'not as in' if is_parameter else 'worse than'} {file}: {text}{others}"]
    data = {"file": str(file), "equal": equal, "changes": changes}
    return Result(data, {"changes": rows} if rows else {}, summary, notes, failures)


def _change(
    name: str, found: _Found, old: Number, new: Number, tolerance: float | None
) -> dict[str, Any]:
    """A figure that has changed; ``share`` is by how much of the earlier one it is worse."""
    kind, share = found.figure.kind, None
    worse = new is None or (kind == "parameter" and old is not None)
    if isinstance(old, float) and isinstance(new, float):
        worsening = (new - old) * (-1 if found.figure.falls else 1)
        share = worsening / abs(old) if old else None
        worse |= tolerance is not None and new > tolerance
        if kind in SHARES:
            worse = worsening > SHARES[kind] * abs(old)
    data = {"figure": name, "kind": kind, "unit": found.unit}
    return {**data, "before": old, "now": new, "share": share, "worse": worse}


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
            yield from _places(entry, path[1:], (*labels, name), data)
