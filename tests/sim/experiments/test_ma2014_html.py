"""The page of the experiment stands alone and shows all of it."""

from __future__ import annotations

import re

import pytest

from boresight.sim.experiments.ma2014_html import render


@pytest.fixture(scope="module")
def page(data):
    return render(data)


def test_page_stands_alone_and_shows_everything(data, page):
    assert page.count('<svg class="plot"') >= 5
    assert "<script" not in page and not re.search(r'(src|href)="http', page)
    for heading in (
        "Table 1",
        "Table 2",
        "Table 3",
        "Table 4",
        "Figures 1, 2 and 5",
        "Figure 6",
        "Figure 7",
        "Figure 8",
        "Targets",
        "Sensor model",
    ):
        assert heading in page, heading
    assert page.count("<figcaption>") >= 5
    assert data["command"] in page
    assert page.count('class="missed"') == sum(not t["good"] for t in data["targets"])
    assert page.count(">FAIL<") == sum(not p for t in data["targets"] for p in t["passes"])
    for label in (
        "amplitude, deg",
        "frequency, Hz",
        "heading error, deg",
        "deg, paper",
        "time from the start of the motion, s",
    ):
        assert label in page, label
