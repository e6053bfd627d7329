"""The page of a protocol: figures and plots stand in it."""

from __future__ import annotations

from boresight.sim.accuracy.protocol.page import render_page
from boresight.sim.accuracy.protocol.summary import summary
from tests.sim.accuracy.protocol.test_summary import CASES, RUNS


def test_the_page_shows_every_table_and_plot() -> None:
    data = {"protocol": "short", "word": 32, "trial_names": ["a", "b"], **summary(CASES, RUNS)}
    page = render_page(data)
    assert page.count("<svg") == 3
    assert "mine against vqf, trial by trial" in page and "b, place 0" in page
    assert '<td class="r worse">2.00</td>' in page and "100 %" in page
    alone = summary(CASES, [{**r, "rows": r["rows"][:2]} for r in RUNS])
    assert render_page({**data, **alone}).count("<svg") == 2
