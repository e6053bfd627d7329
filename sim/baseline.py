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
identity  not at all: a digest that changes with the program, which is then said
same      results that differ in it are not compared
========= =========================================================================================
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from boresight.model.errors import InputError
from boresight.sim.records.reading import kind_of, read_json
from boresight.sim.result import Result

Number: TypeAlias = float | str | None
#: Keys whose values name an entry of a list.
NAMES = ("design", "estimator", "log", "dataset", "trial", "level", "output", "signal")
#: Shares by which figures may be worse than the earlier ones, by kind.
SHARES = {"cycles": 0.0, "area": 0.01, "clock": 0.05, "truth": 0.1, "count": 0.0}
#: Characters of a digest that are shown.
_SHOWN = 12


@dataclass(frozen=True)
class Figure:
    """A figure of a result that can be compared with an earlier one.

    Attributes
    ----------
    title : str
    kind : str
        One of the kinds of this module.
    unit : str
        Default where the data have none.
    falls : bool
        Whether a smaller value is worse.
    """

    title: str
    kind: str
    unit: str = ""
    falls: bool = False


@dataclass(frozen=True)
class _Found:
    """A figure of a result: its value, its unit, and the tolerance beside it."""

    figure: Figure
    value: Number
    unit: str
    tolerance: float | None


def read_baseline(path: str | Path, judged: Mapping[str, Figure]) -> Any:
    """An earlier result.

    Raises
    ------
    InputError
        It cannot be read, or is not a result of this kind.
    """
    wanted = "an earlier result, which --json prints"
    data = read_json(path, wanted)
    if not _figures(data, judged):
        raise InputError.at(
            str(path),
            wanted=f"{wanted} for the same verb",
            found=kind_of(data) if not isinstance(data, dict) else f"one of {', '.join(data)}"[:80],
            fix="write it with --json > FILE",
        )
    return data


def compared(now: Any, before: Any, judged: Mapping[str, Figure], *, file: str | Path) -> Result:
    """Compare plain data of a result with an earlier one (`read_baseline`).

    Returns
    -------
    Result
        ``equal``, the number of equal figures, and ``changes``, the worse ones first. Good unless a
        figure is worse than accepted, or missing.

    Raises
    ------
    InputError
        Results that cannot be compared.
    """
    old, new = _figures(before, judged), _figures(now, judged)
    changes, notes = list[dict[str, Any]](), list[str]()
    for name in dict.fromkeys((*old, *new)):
        a, b = old.get(name), new.get(name)
        known = b or a
        assert known is not None
        before_value, now_value = (None if x is None else x.value for x in (a, b))
        if before_value == now_value:
            continue
        if known.figure.kind == "same":
            if a is not None and b is not None:
                raise InputError.at(
                    str(file),
                    wanted=f"an earlier result of the same {name}, {now_value}",
                    found=str(before_value),
                    fix="compare with one of the same, or write it anew with --json",
                )
        elif known.figure.kind == "identity":
            was, is_now = (str(x)[:_SHOWN] for x in (before_value, now_value))
            notes.append(f"{name} has changed: {was} to {is_now}")
        else:
            changes.append(_change(name, a, b))
    changes.sort(key=lambda c: (not c["worse"], -(c["share"] or 0.0)))
    rows = [
        {
            "figure": change["figure"],
            "before": change["before"],
            "now": change["now"],
            "unit": change["unit"] or None,
            "change": None if change["share"] is None else f"{change['share']:+.1%}",
            "": "WORSE" if change["worse"] else None,
        }
        for change in changes
    ]
    equal = len({*old, *new}) - len(changes) - len(notes)
    summary = f"against {file}: {equal} figures equal, {len(changes)} changed"
    worse = [c for c in changes if c["worse"]]
    failures = []
    if worse:
        first, more = worse[0], len(worse) - 1
        change = f"{_text(first['before'])} -> {_text(first['now'])} {first['unit']}".rstrip()
        others = f", and {more} more" if more else ""
        failures = [f"worse than {file}: {first['figure']} {change}{others}"]
    data = {"file": str(file), "equal": equal, "changes": changes}
    return Result(data, {"changes": rows} if rows else {}, summary, notes, failures)


def _change(name: str, a: _Found | None, b: _Found | None) -> dict[str, Any]:
    """A figure that has changed; ``share`` is by how much of the earlier one it is worse."""
    found = b or a
    assert found is not None
    old, new = (None if x is None else x.value for x in (a, b))
    share, worse = None, b is None
    if isinstance(old, float) and isinstance(new, float):
        worsening = (new - old) * (-1 if found.figure.falls else 1)
        share = worsening / abs(old) if old else None
        if found.figure.kind in SHARES:
            worse = worsening > SHARES[found.figure.kind] * abs(old)
        else:
            worse = found.tolerance is not None and new > found.tolerance
    return {
        "figure": name,
        "kind": found.figure.kind,
        "unit": found.unit,
        "before": old,
        "now": new,
        "share": share,
        "worse": worse,
    }


def _text(value: Number) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 1e4 else f"{value:,.0f}"
    return "none" if value is None else str(value)


def _figures(data: Any, judged: Mapping[str, Figure]) -> dict[str, _Found]:
    """Every judged figure of a result, by name; None values are left out."""
    out: dict[str, _Found] = {}
    for pattern, figure in judged.items():
        for labels, value, beside in _places(data, pattern.split("."), (), {}):
            name = ": ".join(filter(None, (", ".join(labels), figure.title)))
            number = float(value) if isinstance(value, int | float) else value
            unit = beside["unit"] if isinstance(beside.get("unit"), str) else figure.unit
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
