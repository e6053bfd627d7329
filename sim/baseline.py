"""Results compared with those of an earlier day: changed figures, and those worse than accepted.

A result says which of its numbers have a worse direction (`Result.judged`), by patterns of places
in its JSON: names with dots between, ``*`` for each entry of a list or an object.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from boresight.model.errors import InputError
from boresight.sim.records.reading import kind_of, read_json
from boresight.sim.result import plain

__all__ = [
    "NAMES",
    "SHARES",
    "Baseline",
    "Change",
    "Figure",
    "compared",
    "figures_of",
    "read_baseline",
]

Number: TypeAlias = float | str | None
#: Keys whose values name an entry of a list.
NAMES = ("design", "estimator", "log", "dataset", "trial", "level", "output", "signal")


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


@dataclass(frozen=True)
class Change:
    """A figure that has changed.

    Attributes
    ----------
    figure, unit : str
    before, now : float, str or None
        None: it is missing.
    share : float or None
        Share of ``before`` by which it got worse; negative: better. None for other than numbers.
    worse : bool
        Whether it got worse by more than accepted.
    """

    figure: str
    unit: str
    before: Number
    now: Number
    share: float | None
    worse: bool


@dataclass(frozen=True)
class Baseline:
    """A result compared with an earlier one.

    Attributes
    ----------
    file : str
        File of the earlier one.
    allowed : mapping of str to float
        Accepted shares, by kind of figure.
    equal : int
        Number of unchanged figures.
    changes : tuple of Change
        The changed figures, those that got worse first.
    """

    file: str
    allowed: Mapping[str, float]
    equal: int
    changes: tuple[Change, ...]

    @property
    def worse(self) -> tuple[Change, ...]:
        """Figures that got worse by more than accepted."""
        return tuple(c for c in self.changes if c.worse)

    @property
    def good(self) -> bool:
        """Whether no figure got worse by more than accepted."""
        return not self.worse

    def __str__(self) -> str:
        rows = [
            (c.figure, _text(c.before), _text(c.now), c.unit, _share(c.share), "WORSE" * c.worse)
            for c in self.changes
        ]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = [f"against {self.file}: {self.equal} figures equal, {len(rows)} changed"]
        for name, before, now, *rest in rows:
            cells = [name.ljust(widths[0]), before.rjust(widths[1]), "->", now.rjust(widths[2])]
            cells += [text.ljust(width) for text, width in zip(rest, widths[3:], strict=True)]
            lines.append(f"  {' '.join(cells)}".rstrip())
        if not self.good:
            worst = self.worse[0]
            change = f"{_text(worst.before)} -> {_text(worst.now)} {worst.unit}".rstrip()
            others = len(self.worse) - 1
            lines.append(
                f"FAILED: worse than {self.file}: {worst.figure} {change}"
                + (f", and {others} more" if others else "")
            )
        return "\n".join(lines)


def _text(value: Number) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if abs(value) < 1e4 else f"{value:,.0f}"
    return "none" if value is None else str(value)


def _share(share: float | None) -> str:
    return "" if share is None else f"{share:+.1%}"


def read_baseline(path: str | Path, judged: Mapping[str, Figure]) -> Any:
    """An earlier result.

    Raises
    ------
    InputError
        It cannot be read, or is no result of this kind.
    """
    wanted = "an earlier result, which --json prints"
    data = read_json(path, wanted)
    if not figures_of(data, judged):
        raise InputError.at(
            str(path),
            wanted=f"{wanted} for the same verb",
            found=kind_of(data) if not isinstance(data, dict) else f"one of {', '.join(data)}"[:80],
            fix="write it with --json > FILE",
        )
    return data


def compared(
    result: Any,
    before: Any,
    judged: Mapping[str, Figure],
    *,
    file: str | Path,
    allow: Mapping[str, float] | None = None,
) -> Baseline:
    """Compare a result, as plain data or not, with an earlier one.

    Parameters
    ----------
    before
        `read_baseline`.
    allow : mapping of str to float, optional
        Accepted shares by kind of figure, on top of `SHARES`.

    Raises
    ------
    InputError
        An unknown kind, or results that cannot be compared.
    """
    allowed = SHARES | dict(allow or {})
    for kind, share in allowed.items():
        if kind not in SHARES or not share >= 0.0:
            raise InputError.at(
                f"allow {kind}",
                wanted=f"a share from 0 up of one of {', '.join(SHARES)}",
                found=f"{share:g} of {kind}",
                fix="write for example area=0.05",
            )
    old, new = figures_of(before, judged), figures_of(plain(result), judged)
    changes = []
    for name in dict.fromkeys((*old, *new)):
        old_value, unit, figure = old.get(name, (None, "", None))
        new_value, unit, figure = new.get(name, (None, unit, figure))
        assert figure is not None
        if figure.kind == "same" and name in old and name in new and old_value != new_value:
            raise InputError.at(
                str(file),
                wanted=f"an earlier result of the same {name}, {new_value}",
                found=f"{old_value}",
                fix="compare with one of the same, or write it anew with --json",
            )
        if old_value != new_value and figure.kind != "same":
            changes.append(_change(name, unit, figure, old_value, new_value, allowed))
    changes.sort(key=lambda c: (not c.worse, not c.share, -(c.share or 0.0)))
    return Baseline(str(file), allowed, len({*old, *new}) - len(changes), tuple(changes))


def _change(
    name: str, unit: str, figure: Figure, old: Number, new: Number, allowed: Mapping[str, float]
) -> Change:
    share = None
    if isinstance(old, str) or isinstance(new, str) or not figure.kind:
        worse = False
    elif old is None or new is None:
        worse = new is None  # the figure is missing now
    else:
        worsening = (new - old) * (-1 if figure.falls else 1)
        share = worsening / abs(old) if old else None
        worse = worsening > allowed[figure.kind] * abs(old)
    return Change(name, unit, old, new, share, worse)


def figures_of(data: Any, judged: Mapping[str, Figure]) -> dict[str, tuple[Number, str, Figure]]:
    """Value and unit of every figure of a result, by name; None values are left out."""
    out: dict[str, tuple[Number, str, Figure]] = {}
    for pattern, figure in judged.items():
        for labels, value, unit in _places(data, pattern.split("."), (), figure.unit):
            name = ": ".join(filter(None, (", ".join(labels), figure.title)))
            entry = (float(value) if isinstance(value, int | float) else value, unit, figure)
            k = 1
            while (key := name if k == 1 else f"{name} ({k})") in out and out[key] != entry:
                k += 1
            out[key] = entry
    return out


def _places(
    data: Any, path: Sequence[str], labels: tuple[str, ...], unit: str
) -> Iterator[tuple[tuple[str, ...], Any, str]]:
    """Numbers and texts at a pattern: names of the entries on the path, value, unit."""
    if not path:
        if isinstance(data, int | float | str):
            yield labels, data, unit
        return
    if isinstance(data, dict) and isinstance(data.get("unit"), str):
        unit = data["unit"]
    if path[0] != "*":
        if isinstance(data, dict) and path[0] in data:
            yield from _places(data[path[0]], path[1:], labels, unit)
    elif isinstance(data, list):
        for entry in data:
            names = [entry[n] for n in NAMES if isinstance(entry, dict) and entry.get(n)]
            yield from _places(entry, path[1:], (*labels, *map(str, names)), unit)
    elif isinstance(data, dict):
        for name, entry in data.items():
            yield from _places(entry, path[1:], (*labels, name), unit)
