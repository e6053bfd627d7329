"""The page of a board: its figures in the units that it names, and what failed in red."""

from __future__ import annotations

import re
from dataclasses import asdict

import pytest

from boresight.sim.board.page import render_page
from boresight.sim.board.setup import REAL
from boresight.sim.board.timeline import Span, Timeline

TIMELINE = Timeline(
    filter="one",
    frames=(Span("temp", 0.0, 16.0),),
    core=(Span("calibrate", 17.0, 18.0), Span("filter", 18.0, 21.0)),
    line=Span("frame", 21.0, 500.0),
    period_us=976.5,
    paper_us=None,
)
RUN = {
    **{"filter": "a<b", "updates": 1234, "lost_samples": 0, "mismatches": 0, "fields": 7},
    **{"transfer_cycles": (28_000, 29_150), "program_cycles": 344, "beside_program_us": 3.456},
    **{"in_registers_us": 298.764, "frame_end_us": 712.6},
}
DATA = {
    **{"config": "small", "clock_mhz": 100.0, "source": "heading", "log": "walk", "build": "00ff"},
    **{"good": True, "runs": [RUN], "setup": asdict(REAL)},
}


def test_figures_in_their_units() -> None:
    page = render_page(DATA, [TIMELINE])
    cells = re.findall(r"<td[^>]*>([^<]*)", page)
    assert cells == ["a&lt;b", "1,234", "0", "0", "7", "291.50", "344", "3.46", "298.76", "713"]
    assert "configuration small, 100 MHz" in page and "Build 00ff." in page
    assert page.count('<svg class="plot"') == 1 and "http" not in page and "<script" not in page
    assert "no sample was lost" in page and 'class="bad"' not in page


@pytest.mark.parametrize("wrong", ["lost_samples", "mismatches"])
def test_what_failed_is_red(wrong: str) -> None:
    data = {**DATA, "good": False, "runs": [{**RUN, wrong: 3}]}
    page = render_page(data, [TIMELINE])
    assert '<td class="r"><span class="bad">3</span>' in page
    assert '<p><span class="bad">FAILED: see the table.</span></p>' in page
    assert page.count('class="bad"') == 2


def test_a_figure_that_is_missing_is_no_empty_cell() -> None:
    with pytest.raises(KeyError, match="build"):
        render_page({k: v for k, v in DATA.items() if k != "build"}, [TIMELINE])
