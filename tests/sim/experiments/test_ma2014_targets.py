"""Targets: what passes, and how many entries of Table 3 lie in the paper's band."""

from __future__ import annotations

import pytest

from boresight.sim.experiments import ma2014_paper as paper
from boresight.sim.experiments.ma2014_targets import _target, entries_in_band


def made(ours, band):
    return _target("name", "source", ours, band)


@pytest.mark.parametrize(
    ("ours", "band", "passes"),
    [
        ((1.0, 2.0), [(1.0, 1.0), (None, 2.0)], [True, True]),
        ((0.9, 2.1), [(1.0, None), (None, 2.0)], [False, False]),
        ((None, 5.0), [(None, None), (None, None)], [False, True]),
        ((float("nan"), 5.0), [(0.0, 1.0), (5.0, 6.0)], [False, True]),
    ],
)
def test_both_ends_of_a_band_are_in_it(ours, band, passes):
    target = made(ours, band)
    assert target["passes"] == passes and target["good"] == all(passes)
    assert target["ours"] == list(ours) and target["band"] == [list(b) for b in band]


def test_entries_in_band():
    """Two methods of two runs: 1.0 times the paper's value lies inside, twice it outside."""
    rows = {}
    for key, runs in (("gyro", ((1, 1, 1), (1, 2, 1))), ("mag_acc", ((1, 1, 1), (2, 2, 2)))):
        printed = paper.TABLE_3[key]
        sd = [[share * x for share, x in zip(run, printed, strict=True)] for run in runs]
        rows[key] = {"paper_row": key, "sd_runs": sd}
    found = entries_in_band(rows)
    assert (found["entries"], found["mean"], found["most"], found["runs_with_all"]) == (
        6,
        4.0,
        6,
        1,
    )
