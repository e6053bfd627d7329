"""The paper's figures hang together as the paper prints them."""

from __future__ import annotations

import numpy as np

from boresight.sim.attitude.ma2014 import (
    AXES,
    CYCLES,
    FIG_6_DEG,
    FIG_7_DEG,
    KI,
    KP,
    OPEN,
    TABLE_1,
    TABLE_3,
    TIME_US,
)


def test_stages_swing_one_axis_each_and_end_where_they_stop() -> None:
    """A quarter period more than whole ones leaves the amplitude: out, then back to level."""
    before = np.zeros(3)
    for row in TABLE_1:
        moved = np.array(row["end_deg"]) - before
        axis = "xyz".index(row["stage"])
        assert np.flatnonzero(moved).tolist() == [axis]
        assert abs(moved[axis]) == row["amplitude_deg"] and row["periods"] % 1 == 0.25
        before = np.array(row["end_deg"])
    assert not before.any()
    assert sum(row["period_s"] * row["periods"] for row in TABLE_1) == 374.0


def test_every_row_has_a_figure_for_each_axis() -> None:
    assert all(len(row) == len(AXES) == 3 for row in (*TABLE_3.values(), KP, KI, FIG_6_DEG))
    # Both filters beat both of their inputs, and differ by less than they err.
    for name in ("kalman", "complementary"):
        assert (np.array(TABLE_3[name]) < TABLE_3["gyro"]).all()
        assert (np.array(TABLE_3[name]) < TABLE_3["mag_acc"]).all()
    assert min(FIG_6_DEG) > FIG_7_DEG == 0.07


def test_times_are_cycles_at_100_mhz() -> None:
    assert CYCLES == {"complementary": 31_600, "kalman": 114_000}
    assert {name: cycles / 100.0 for name, cycles in CYCLES.items()} == TIME_US


def test_what_is_open_has_an_answer() -> None:
    assert all(question and answer for question, answer in OPEN)
    assert len({question for question, _ in OPEN}) == len(OPEN) == 11
