"""The page of a simulated board: one HTML file that needs nothing else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

from boresight.sim.board.timeline import Timeline, timeline_plot

__all__ = ["render_page"]


def render_page(data: Mapping[str, Any], timelines: Sequence[Timeline]) -> str:
    """HTML text of the dict that `boresight simulate` gives."""
    import jinja2

    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    template = environment.from_string(
        files("boresight.sim.board").joinpath("board.html").read_text(encoding="utf-8")
    )
    return template.render(d=data, plot=timeline_plot(timelines, salt="board"))
