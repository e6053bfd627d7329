"""What `boresight explore` measured: a row for each combination, and the choice."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, overload

from boresight.sim.answer import Answer, JsonObject, plain
from boresight.sim.explore.demands import Choice
from boresight.sim.explore.figures import ESTIMATED, Explored, Quantity
from boresight.sim.records.columnar import parquet_of

__all__ = ["ExploreResult"]

#: Columns that say which combination a row is.
_WHICH = ("estimator", "word", "config", "target")
#: Figures in the text for people, after the error.
_SHOWN = ("cycles", "interval", "lut", "dsp", "ram", "clock", "toggles")


@dataclass(frozen=True)
class ExploreResult(Answer, Sequence[Explored]):
    """What `explore` gives: a sequence of rows, one for each combination.

    Attributes
    ----------
    rows : tuple of Explored
    choice : Choice or None
        Which one to take, or what comes nearest; None without demands.
    page, table : str
        Files: the page, and the table with everything measured so far.
    known : tuple of Quantity
        The figures that rows have, with titles and units.
    least : Quantity or None
        What the choice has least of (or most, where more is better).
    """

    rows: tuple[Explored, ...]
    choice: Choice | None
    page: str
    table: str
    known: tuple[Quantity, ...] = field(default=(), repr=False)
    least: Quantity | None = None

    @property
    def good(self) -> bool:
        """Some combination can be built, and with demands one meets them all."""
        if self.choice is not None:
            return self.choice.row is not None
        return any(not row.refused for row in self.rows)

    def __len__(self) -> int:
        return len(self.rows)

    @overload
    def __getitem__(self, index: int) -> Explored: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Explored, ...]: ...
    def __getitem__(self, index: int | slice) -> Explored | tuple[Explored, ...]:
        return self.rows[index]

    @property
    def columns(self) -> dict[str, list[Any]]:
        """The table by columns, for `pandas.DataFrame` and files; None where nothing is known."""
        out = {name: [getattr(row, name) for row in self.rows] for name in _WHICH}
        for q in self.known:
            if q.name not in out:
                out[q.name] = [row.figures.get(q.name) for row in self.rows]
        return out | {name: [getattr(r, name) for r in self.rows] for name in ("good", "refused")}

    def csv(self) -> str:
        """The table as CSV; units in the header as logs have them."""
        units = {q.name: f"[{q.unit}]" if q.unit else "" for q in self.known}
        file = io.StringIO()
        writer = csv.writer(file, lineterminator="\n")
        columns = self.columns
        writer.writerow(name + units.get(name, "") for name in columns)
        writer.writerows(zip(*columns.values(), strict=True))
        return file.getvalue()

    def parquet(self) -> bytes:
        """The table as Parquet; raises ToolMissing without pyarrow."""
        return parquet_of(self.columns)

    def to_json(self) -> JsonObject:
        """Plain data: rows with their figures, the choice, the files."""
        rows: list[JsonObject] = []
        for row in self.rows:
            data = plain(row)
            assert isinstance(data, dict)
            rows.append({**data, "figures": plain(row.figures)})
        choice: JsonObject | None = None
        if self.choice is not None:
            choice = {
                "row": None if self.choice.row is None else self.choice.row.name,
                "nearest": None if self.choice.nearest is None else self.choice.nearest.name,
                "missed": [str(d) for d in self.choice.missed],
                "relaxed": [
                    {"demand": str(r.demand), "limit": r.limit, "row": r.row.name}
                    for r in self.choice.relaxed
                ],
            }
        return {
            "good": self.good,
            "rows": plain(rows),
            "choice": choice,
            "page": self.page,
            "table": self.table,
        }

    def _shown(self) -> JsonObject:
        columns = self.columns
        rows = [
            dict(zip(columns, map(plain, values), strict=True))
            for values in zip(*columns.values(), strict=True)
        ]
        return {"page": self.page, "combinations": plain(rows)}

    def _choice_lines(self) -> list[str]:
        if self.choice is None or self.least is None:
            return []
        return self.choice.lines(self.least)

    def __str__(self) -> str:
        lines = [*self._table(), *self._choice_lines()]
        lines += [ESTIMATED] * any(row.clock_is == "estimate" for row in self.rows)
        lines.append(f"{self.page}, {self.table}")
        if not self.good:
            wanted = "meets the demands" if self.choice else "can be built and measured"
            lines.append(f"FAILED: no combination {wanted}")
        return "\n".join(lines)

    def _table(self) -> Iterator[str]:
        """Rows for people: the attitude's error or the largest over its tolerance, and costs."""
        names = {q.name: q for q in self.known}
        error = "attitude" if "attitude" in names else "tolerance"
        shown = [name for name in (error, *_SHOWN) if name in names]
        width = max([11, *(len(row.name) for row in self.rows)])
        yield f"{'combination':{width}s}" + "".join(f"{name:>12s}" for name in shown)
        for row in self.rows:
            cells = [row.figures.get(name) for name in shown]
            text = "".join(f"{'' if v is None else f'{v:.4g}':>12s}" for v in cells)
            yield f"{row.name:{width}s}{text}{'  ' * bool(row.refused)}{row.refused}".rstrip()
