"""Integer C on the simulated soft core equals the model bit for bit; float C its reference."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.model.estimators import FILTERS, estimator
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record
from boresight.sim.soc.comparison import PAPER_CYCLES, compare_one
from boresight.sim.soc.measure import measure_float, measure_integer

#: Updates: every program runs the same instructions in each but for its data.
UPDATES = 8


@pytest.mark.parametrize(
    "name",
    [
        # The smallest and the largest in code; all of them in `make firmware`, too.
        pytest.param(n, marks=[] if n in ("complementary", "mekf") else [pytest.mark.soak])
        for n in FILTERS
    ],
)
def test_comparison(name: str) -> None:
    row = compare_one(name, read_record(bundled("ximu_walk")), updates=UPDATES, restarts=1)
    integer, single = row["integer"], row["float"]
    assert integer["updates"] == single["updates"] == UPDATES
    assert integer["mismatches"] == 0
    assert single["status_mismatches"] == 0
    assert single["apart_deg"] < 1e-4
    # No interrupt reaches into an update: integers take the same path but for what data asks for.
    assert integer["cycles"]["max"] < 1.05 * integer["cycles"]["min"]
    assert row["hardware"]["cycles"] * 10 < integer["cycles"]["min"] < single["cycles"]["min"]
    for way in (integer, single):
        assert 0 < way["overhead_cycles"] < 1500
        assert 100 < way["stack_bytes"] < 1024
        assert way["code_bytes"] > 10_000
    if name in PAPER_CYCLES:
        assert 0.5 < row["ratios"]["float_to_paper"] < 2.0


def test_ways_of_compiling_change_nothing_but_the_cycles() -> None:
    program = estimator("complementary").compile()
    inputs = feed(estimator("complementary"), read_record(bundled("ximu_walk"))).inputs[:5]
    small, fast = (measure_integer(program, inputs, optimise=o) for o in ("-Os", "-O2"))
    assert (small.outputs == fast.outputs).all()
    assert small.code < fast.code


def test_what_no_sensor_says() -> None:
    """Float C goes on, with what its reference gives: what is no number stays none."""
    e = estimator("complementary")
    inputs = feed(e, read_record(bundled("ximu_walk"))).inputs[:8].copy()
    inputs[2, 1:] = np.inf
    inputs[3] = 0.0
    run = measure_float(e, inputs)
    outputs = run.outputs.view(np.float32)
    assert len(outputs) == 8
    assert np.isfinite(outputs[:2]).all()
    assert np.isnan(outputs[2, 3])


def test_a_wrong_bit_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """The comparison finds one bit in one update, in either way."""
    from boresight.sim.soc import comparison

    def flipped(way: str, place: tuple[int, int], bit: int) -> None:
        measured = getattr(comparison, way)

        def wrong(*arguments, **options):
            run = measured(*arguments, **options)
            run.outputs[place] ^= np.uint32(1 << bit)
            return run

        monkeypatch.setattr(comparison, way, wrong)

    flipped("measure_integer", (3, 6), 0)
    flipped("measure_float", (2, 3), 24)
    row = compare_one("complementary", read_record(bundled("ximu_walk")), updates=5, restarts=1)
    assert row["integer"]["mismatches"] == 1
    assert row["float"]["apart_deg"] > row["float"]["bound_deg"]
