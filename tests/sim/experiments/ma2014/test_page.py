"""The page stands alone and shows everything."""

import re

from boresight.sim.experiments.experiment import grouped


def test_page_stands_alone_and_shows_everything(result):
    page = result.pages["ma2014.html"]
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
    assert "boresight experiment ma2014 --seed 5" in page
    groups = [[t.good for t in group] for group in grouped(result.targets)]
    assert page.count('class="missed"') == sum(not all(group) for group in groups)
    assert page.count(">FAIL<") == sum(not x for group in groups for x in group)
    for constant in ("2.12×10⁻⁶", "0.1414", "Tianjin", "HMR3300"):
        assert constant in page, constant
    for label in (
        "amplitude, deg",
        "frequency, Hz",
        "heading error, deg",
        "deg, paper",
        "time from the start of the motion, s",
    ):
        assert label in page, label
