"""The page: every case, the paper's numbers, plots, nothing from outside."""

import pytest

from boresight.sim.experiments.experiment import Target
from boresight.systems.array.cases import CASES
from boresight.systems.array.page import render


@pytest.fixture(scope="module")
def page(runs, words) -> str:
    flown = {name: runs(0.1 * (1 + k)) for k, name in enumerate(CASES)}
    return render(flown, words, [Target(name="claim", source="text", value=0.5, high=0.2)])


def test_everything_is_on_the_page(page: str) -> None:
    for case in CASES.values():
        assert page.count(f"<td>{case.meaning}<") == 1, case
    assert page.count('class="bad"') == 1 and page.count("<svg") == 3
    minus = "\N{MINUS SIGN}"
    assert f"{minus}2.83, {minus}22.84, {minus}2.31" in page  # hour 1, but not hour 3
    assert f"{minus}1.51, {minus}31.10" not in page
    assert "7.90, 28.99, 29.83" in page and "18.61 is 0.43" in page and "60.82" in page
    assert ">59.9<" in page and "finding north" in page
    assert page.count("no index") >= 4  # both rates: a row and a legend


def test_what_is_not_compared_has_no_difference(page: str) -> None:
    shown = "0.13, 0.194"
    assert page.count(shown) == sum(case.compared for case in CASES.values())


def test_nothing_from_outside(page: str) -> None:
    assert "http" not in page and "<script" not in page
