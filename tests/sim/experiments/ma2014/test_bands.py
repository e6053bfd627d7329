"""Bands, and the axes that a target is made for."""

import pytest

from boresight.sim.experiments.ma2014.bands import around, below, each


def test_bands():
    assert below((0.5, None)) == [(None, 0.5), (None, None)]
    assert around((1.0,), 0.75, 1.25) == [(0.75, 1.25)]
    assert around((2.0,)) == [(pytest.approx(1.8), pytest.approx(2.2))]


def test_each_axis_has_its_own_entry():
    spread = {"p05": (1, 2, 3), "p95": (4, 5, 6), "median": (0, 0, 0)}
    found = list(each("a", "s", (7, 8, 9), below((7, 7, 9)), spread=spread, paper=(1, 1, 2)))
    assert [(t.part, t.value, t.high, t.good) for t in found] == [
        ("pitch", 7, 7, True),
        ("roll", 8, 7, False),
        ("heading", 9, 9, True),
    ]
    assert [t.spread for t in found] == [(1, 4), (2, 5), (3, 6)]
    assert [t.beside for t in found] == [{"paper": 1}, {"paper": 1}, {"paper": 2}]


def test_one_axis_takes_the_last_entry_of_three():
    (found,) = each(
        "a", "s", (7, 8, 9), [(None, 8.5)], axes=("heading",), paper=None, prototype=(1, 2, 3)
    )
    assert (found.part, found.value, found.good) == ("heading", 9, False)
    assert found.beside == {"prototype": 3} and found.spread is None
