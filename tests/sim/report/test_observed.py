"""What a log did to every value, against the interpreter."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.gateware.core import Core
from boresight.model.words.interpreter import Interpreter
from boresight.sim.compare.results import CheckResult
from boresight.sim.report.observed import Observed


def test_extremes_are_those_of_the_interpreter(core: Core, check: CheckResult) -> None:
    found, machine = Observed.of(core.program, check), Interpreter(core.program)
    assert found.log == "synthetic_60s" and len(found.words) == 300
    rows = []
    for row in found.words:
        machine.update(row[:, None])
        rows.append([int(w[0]) for w in machine.values_before_commit()])
    words = np.array(rows)
    assert np.array_equal(found.ranges.low, words.min(axis=0))
    assert np.array_equal(found.ranges.high_at, words.argmax(axis=0))
    assert found.errors and all(0.0 <= e < 64.0 for e in found.errors.values())


@pytest.mark.parametrize(
    ("low", "high", "bits"), [(0, 0, 31), (0, 1, 30), (-1, 0, 31), (-2, 1, 30), (-5, 2**30 - 1, 1)]
)
def test_headroom(low: int, high: int, bits: float, core: Core, check: CheckResult) -> None:
    found = Observed.of(core.program, check)
    found.ranges.low[3], found.ranges.high[3] = low, high
    assert found.headroom_bits(3, 32) == bits
