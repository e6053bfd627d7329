"""Work dealt out: the same results here and in processes; the first error ends it."""

import math
import os
from operator import truediv

import pytest

from boresight.sim.processes import dealt

TASKS = [(k, math.factorial, (k,)) for k in (5, 3, 8)]


def test_here_in_order() -> None:
    assert list(dealt(1, TASKS)) == [(5, 120), (3, 6), (8, 40320)]


def test_in_processes() -> None:
    assert dict(dealt(2, TASKS)) == dict(dealt(1, TASKS))
    elsewhere = dict(dealt(2, [("a", os.getpid, ()), ("b", os.getpid, ())]))
    assert os.getpid() not in elsewhere.values()
    with pytest.raises(ZeroDivisionError):
        list(dealt(2, [("good", truediv, (1, 2)), ("bad", truediv, (1, 0))]))
