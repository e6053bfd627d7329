"""The page: every case, every verdict, plots, nothing from outside."""

import pytest

from boresight.sim.experiments.experiment import Target
from boresight.systems.mls.cases import CASES
from boresight.systems.mls.linear_array import Array
from boresight.systems.mls.page import render
from boresight.systems.mls.runs import pooled


@pytest.fixture
def page(runs, patterns) -> str:
    flights = {name: runs(case, 0.0123) for name, case in CASES.items()}
    targets = [
        Target(name="claim one", source="fig 3", value=0.5, high=1.0, beside={"prototype": 0.3}),
        Target(name="claim <two>", source="fig 4", value=0.5, low=2.0),
        Target(name="three", source="fig 5", value=0.5, low=2.0, binding=False, note="because"),
    ]
    found = {name: pooled(one) for name, one in flights.items()}
    meanings = {name: case.meaning for name, case in CASES.items()}
    trials = {n: patterns(Array(n), 3.0, 1, 1) for n in (64, 16)}
    return render(meanings, found, flights, trials, targets)


def test_everything_is_on_the_page(page: str) -> None:
    for case in CASES.values():
        steered = 2 if case.steered else 1
        assert page.count(f"<td>{case.meaning.replace(chr(39), '&#39;')}<") == steered, case
    assert page.count('class="ok"') == 1 and page.count('class="bad"') == 2
    assert "FAIL" in page and "(reported)" in page and "because" in page
    assert "claim &lt;two&gt;" in page and "&ge; 2" in page and "&le; 1" in page
    assert page.count("<svg") == 5 == page.count("<figcaption>")
    assert page.count(">0.95<") == 40 and "64, z 05 0 at 30" in page and "16, x 01 m60" in page
    assert "beam 0 deg" in page and "uncompensated m60 deg" in page and "lag ms" in page


def test_nothing_from_outside(page: str) -> None:
    assert "http" not in page and "<script" not in page
