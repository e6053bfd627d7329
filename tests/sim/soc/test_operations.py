"""Costs of operations on the soft core, and what they explain of an update."""

from __future__ import annotations

import pytest

from boresight.firmware.floating.text import operation_counts
from boresight.model.estimators import estimator
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record
from boresight.sim.soc.measure import measure_float
from tests.support.soc.operations import counted_cycles, operation_cycles


def test_costs_explain_an_update() -> None:
    costs = operation_cycles()
    assert 20 < costs["less"] < costs["mul"] < costs["div"] < costs["sin"] < 10_000
    assert costs["add"] == pytest.approx(costs["sub"], rel=0.5)
    e = estimator("ekf_quaternion")
    run = measure_float(e, feed(e, read_record(bundled("ximu_walk"))).inputs[:6])
    counted = counted_cycles(operation_counts(e.trace()), costs)
    assert 0.4 < counted / run.cycles.max() < 1.0


def test_counting() -> None:
    costs = {"add": 10.0, "less": 3.0, "sin": 100.0}
    assert (
        counted_cycles(
            {
                "add": 2,
                "sin": 1,
                "clip": 1,
                "wrap": 1,
                "larger": 1,
                "less": 1,
                "select": 9,
                "neg": 4,
                "both": 2,
            },
            {**costs, "mul": 5.0},
        )
        == 20 + (100 + 5) + 6 + 6 + 3 + 3
    )
