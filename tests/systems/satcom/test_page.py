"""The page: every case, every verdict, plots, nothing from outside."""

import pytest

from boresight.sim.experiments.experiment import Target
from boresight.systems.satcom.cases import CASES, WHAT_IF
from boresight.systems.satcom.page import render


@pytest.fixture(scope="module")
def page(runs) -> str:
    found = {name: runs.get(name, runs["adaptive"]) for name in (*CASES, *WHAT_IF)}
    return render(found, [Target(name="one", source="ours", value=1.0)], 7, 12)


def test_everything_is_on_the_page(page: str) -> None:
    for case in (CASES | WHAT_IF).values():
        assert case.meaning.replace(">", "&gt;") in page
    assert "12 runs, seeds 7 to 18" in page
    assert page.count("<svg") == 6 == page.count("<figcaption>")  # innovations twice, four flights
    assert "autocorrelation" in page and "loss, dB" in page


def test_nothing_from_outside(page: str) -> None:
    assert "<script" not in page and 'src="' not in page and 'href="http' not in page
