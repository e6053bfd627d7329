"""The page of a simulated board: one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from boresight.sim.board.timeline import Timeline, timeline_plot
from boresight.sim.pages import page

__all__ = ["render_page"]


def render_page(data: Mapping[str, Any], timelines: Sequence[Timeline]) -> str:
    """HTML text of the result of `boresight simulate`."""
    return page(
        "boresight.sim.board", "board.html", d=data, plot=timeline_plot(timelines, salt="board")
    )
