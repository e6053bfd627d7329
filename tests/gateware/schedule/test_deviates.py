"""Normal deviates: those of the standard library, but for their last bits."""

import random
import statistics

import pytest

from boresight.gateware.schedule.deviates import Deviates


def test_the_same_as_the_librarys() -> None:
    ours, theirs = random.Random(7), random.Random(7)
    deviates = Deviates(ours)
    for k in range(2000):
        if k % 3 == 0:  # uniform numbers in between belong to the same sequence
            assert ours.random() == theirs.random()
        size = (2.0, 5.0, 12.0)[k % 3]
        assert deviates.draw(size) == pytest.approx(theirs.gauss(0.0, size), rel=1e-12, abs=1e-13)


def test_they_are_normal() -> None:
    deviates = Deviates(random.Random(1))
    drawn = [deviates.draw(3.0) for _ in range(20_000)]
    assert abs(statistics.fmean(drawn)) < 0.1
    assert abs(statistics.stdev(drawn) - 3.0) < 0.06
    assert abs(sum(x < 3.0 for x in drawn) / 20_000 - 0.8413) < 0.01
