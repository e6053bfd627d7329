"""The page of an exploration: error over cost of each combination, and the table."""

from __future__ import annotations

from dataclasses import replace

from boresight.sim.explore.table import ESTIMATED
from boresight.sim.pages import Section, Verdict, page_of, section_of
from boresight.sim.plotting import PALETTE, figure_and_axes, legend, settings, svg
from boresight.sim.result import Result, Row

__all__ = ["render_page"]

#: Costs, the first known of which is across.
_COSTS = ("lut", "cycles")


def render_page(title: str, result: Result) -> str:
    """The page's text, which needs no other file."""
    rows = result["rows"]
    (name, shown), *_ = result.tables.items()
    error = list(shown[0])[1]
    intro: list[str | Verdict] = [
        *result.summary.splitlines(),
        *(Verdict(text, good=False) for text in result.failures),
    ]
    cost = next((c for c in _COSTS if any(row.get(c) for row in rows)), None)
    figures = [] if cost is None or not error else [("", _plot(rows, error, cost))]
    commands: list[tuple[str, str]] = [
        (row["combination"], command) for row in rows if row["good"] for command in row["commands"]
    ]
    return page_of(
        f"Exploration of {title}",
        [text for text in intro if text != ESTIMATED],
        [
            replace(section_of(name, shown), figures=figures),
            Section(title="Commands", columns=("combination", "command"), rows=commands),
        ],
        note=ESTIMATED if ESTIMATED in result.summary else "",
    )


def _plot(rows: list[Row], error: str, cost: str) -> str:
    """SVG of the error over the cost, a curve for each machine; hollow where check fails."""
    series: dict[str, list[Row]] = {}
    for row in rows:
        if row.get(cost) is not None and (row.get(error) or 0.0) > 0.0:
            head = row["combination"].replace(f"{row['word']} bits, ", "")
            series.setdefault(head, []).append(row)
    with settings():
        figure, axes = figure_and_axes(3.6)
        for (head, of), colour in zip(series.items(), PALETTE * len(series), strict=False):
            x, y = [row[cost] for row in of], [row[error] for row in of]
            axes.plot(x, y, color=colour, linewidth=0.6, label=head)
            for row in of:
                face = colour if row["good"] else "white"
                axes.plot(row[cost], row[error], "o", color=colour, markerfacecolor=face)
                axes.annotate(
                    str(row["word"]),
                    (row[cost], row[error]),
                    xytext=(5, 4),
                    textcoords="offset points",
                )
        axes.set_yscale("log")
        axes.set_xlabel(cost)
        axes.set_ylabel(f"largest error: {error}")
        if series:
            legend(axes, 4)
        return svg(figure, "explore")
