"""The page of an exploration: combinations as points to filter, compare and choose."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict
from importlib.resources import files
from typing import Any

from boresight.sim.explore.demands import Demand
from boresight.sim.explore.figures import ESTIMATED, Explored, Quantity
from boresight.sim.pages import page

__all__ = ["page_data", "render_page"]


def page_data(
    title: str,
    rows: Sequence[Explored],
    quantities: Sequence[Quantity],
    demands: Sequence[Demand],
    least: Quantity | None,
    lines: Sequence[str],
    *,
    remaining: int,
) -> dict[str, Any]:
    """Contents of the page, as plain data.

    Parameters
    ----------
    quantities : sequence of Quantity
        Figures that some row has.
    demands, least : optional
        Initial settings of the page.
    lines : sequence of str
        Text of the choice.
    remaining : int
        Pieces of work: the page reloads while there are any.
    """
    return {
        "title": title,
        "left": remaining,
        "lines": [*lines, *[ESTIMATED] * any(row.clock_is == "estimate" for row in rows)],
        "quantities": [asdict(q) for q in quantities],
        "demands": [{"name": d.quantity.name, "sign": d.sign, "limit": d.limit} for d in demands],
        "least": least.name if least is not None else None,
        "rows": [
            {
                "name": row.name,
                "series": ", ".join([*map("=".join, row.arguments.items()), row.config]),
                "word": row.word,
                "target": row.target,
                "refused": row.refused,
                "commands": row.commands,
                "latencies": dict(row.latencies),
                "figures": {n: v if math.isfinite(v) else None for n, v in row.figures.items()},
            }
            for row in rows
        ],
    }


def render_page(data: dict[str, Any]) -> str:
    """The page's text, which needs no other file."""
    script = files("boresight.sim.explore").joinpath("page.js").read_text(encoding="utf-8")
    text = json.dumps(data, allow_nan=False).replace("<", "\\u003c")
    return page("boresight.sim.explore", "page.html", title=data["title"], data=text, script=script)
