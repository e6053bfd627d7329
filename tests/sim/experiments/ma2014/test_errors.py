"""Targets of errors: each axis by its own band; entries of Table 3 run by run."""

import math
from copy import deepcopy

from boresight.sim.experiments.ma2014.errors import entries_in_band, figure_6, table_3


def test_a_target_fails_by_its_band_and_by_nothing_else(data, find):
    name = "complementary filter: sd, noise alone, fixed"
    for value, verdicts in (
        ((0.070, 0.079, 0.112), (True, True, True)),
        ((0.078, 0.079, 0.112), (False, True, True)),
        ((0.070, 0.070, 0.112), (True, False, True)),
        ((0.070, 0.079, 0.13), (True, True, False)),
        ((0.070, math.nan, 0.112), (True, False, True)),
    ):
        changed = deepcopy(data)
        changed["table_3"]["cases"]["noise"]["complementary"]["fixed"]["sd"]["pooled"] = value
        found = find(table_3(changed["table_3"]["cases"]), name)
        assert tuple(t.good for t in found) == verdicts
        assert [t.part for t in found] == ["pitch", "roll", "heading"]


def test_entries_in_band_are_counted_run_by_run():
    def row(key, sd_runs):
        return {"paper_row": key, "sd_runs": sd_runs}

    cases = {
        "gyro": row("gyro", [[0.624, 0.676, 0.566], [0.624, 0.676, 0.9]]),
        "complementary": row("complementary", [[0.104, 0.128, 0.242], [0.01, 0.128, 0.242]]),
    }
    assert entries_in_band(cases) == {
        "entries": 6,
        "mean": 5.0,
        "most": 6,
        "runs_with_all": 1,
        "low": 0.76,
        "high": 1.18,
    }


def test_figure_6_has_a_limit_for_each_axis(data, find):
    cases = deepcopy(data["table_3"]["cases"])
    cases["C"]["complementary"]["fixed"]["max"]["median"] = (0.5, 0.51, 0.8)
    found = find(figure_6(cases), "complementary filter against truth, largest, case C")
    assert [(t.high, t.good) for t in found] == [(0.5, True), (0.5, False), (0.8, True)]
    (printed,) = find(figure_6(cases), "eq. (3) as printed violates")
    assert (printed.part, printed.low, printed.high) == ("heading", 0.8, None)
