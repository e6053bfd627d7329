"""Plots of a small made-up run: what is drawn, and where the paper's values stand."""

from __future__ import annotations

import re

import numpy as np
import pytest

from boresight.sim.experiments import ma2014_paper as paper
from boresight.sim.experiments.ma2014_plots import (
    difference_plot,
    error_plot,
    motion_plot,
    spectra_plot,
    table_3_plot,
    timing_plot,
)

T = np.arange(0.0, 20.0, 0.5)
WAVE = np.stack([np.sin(T), np.cos(T), T / 20.0], axis=1)
FIGURES = {
    "time_s": T,
    "stages_deg": 15.0 * WAVE,
    "truth_deg": 14.0 * WAVE,
    "error_deg": {
        "complementary": 0.2 * WAVE,
        "complementary_as_printed": 0.3 * WAVE,
        "ekf_quaternion": 0.2 * WAVE,
    },
}
SD = {name: [0.1, 0.2, 0.3] for name in ("p05", "p25", "median", "p75", "p95")}


def paths(svg: str, colour: str) -> list[np.ndarray]:
    """Points of the lines of a colour."""
    found = re.findall(rf'<path d="([^"]*)"[^>]*style="[^"]*stroke: {colour}', svg, re.S)
    return [np.array(re.findall(r"[ML] ([\d.-]+) ([\d.-]+)", d), float) for d in found]


def test_motion() -> None:
    svg = motion_plot(FIGURES)
    assert svg.startswith('<svg class="plot"') and svg == motion_plot(FIGURES)
    for label in ("stage x", "stage z", *paper.AXES, "stage angle, deg", "Euler angle, deg"):
        assert label in svg
    # Every second sample of three curves above and three below.
    assert sum(len(p) == len(T[::2]) for c in ("#d55e00", "#009e73", "#0072b2")
               for p in paths(svg, c)) == 6  # fmt: skip


def test_spectra() -> None:
    method = {
        "amplitude_deg": [9.0, 0.2, 0.1],
        "energy_below_slow": {"shown": 0.42},
        "line_deg": {"shown": 0.321},
    }
    methods = dict.fromkeys(("gyro", "mag_acc", "complementary"), method)
    svg = spectra_plot(
        {"frequency_hz": [0.0, 0.1, 0.2], "line_hz": 1 / 6, "slow_hz": 0.02, "methods": methods}
    )
    assert svg.count("below 0.02 Hz: 42 % of its energy; line at 1/6 Hz: 0.321 deg") == 3
    for title in ("Figure 1: gyro alone", "Figure 2: mag/acc alone", "Figure 5: complementary"):
        assert title in svg


def test_errors_stand_between_the_papers_limits() -> None:
    svg = error_plot(FIGURES)
    for limit in paper.FIG_6_DEG:
        assert f"dashed: \N{PLUS-MINUS SIGN}{limit:g} deg, paper" in svg
    assert len(paths(svg, "#444444")) == 6
    for label in ("eq. (3) as printed", "complementary, consistent kinematics", "roll error, deg"):
        assert label in svg


def test_the_difference_is_that_of_the_two_errors() -> None:
    assert difference_plot(FIGURES, "ekf_quaternion_vector") is None
    svg = difference_plot(FIGURES)
    assert svg and svg.count("0.07 deg, paper") == 3
    line, limits = paths(svg, "#d55e00")[-1], paths(svg, "#444444")[:2]
    # The same twice: nought all the time, in the middle between the limits.
    assert len(line) >= 2 and np.ptp(line[:, 1]) == 0.0
    assert line[0, 1] == pytest.approx(np.mean([p[0, 1] for p in limits]), abs=1e-3)


@pytest.mark.parametrize("fixed", [True, False])
def test_table_3_shows_fixed_point_where_there_is_one(fixed: bool) -> None:
    other = {**SD, "median": [0.9, 0.9, 0.9]}
    row = {
        "fixed": {"sd": SD} if fixed else None,
        "float": {"sd": other if fixed else SD},
        "paper_row": "complementary",
    }
    one = table_3_plot({"cases": {"C": {"complementary": row}}})
    assert one == table_3_plot(
        {"cases": {"C": {"complementary": {**row, "fixed": None, "float": {"sd": SD}}}}}
    )
    assert "mag/acc alone" not in one and one.count("standard deviation of the error, deg") == 3


def test_times() -> None:
    rows = [
        {"estimator": "ekf_quaternion", "config": "fast", "us": 4.56},
        {"estimator": "complementary", "config": "small", "us": 123.4},
    ]
    svg = timing_plot(rows)
    for label in ("Kalman, quaternion, core fast", "complementary, core small", "4.56 ", "123 "):
        assert label in svg
    assert "1,140 " in svg and "316 " in svg
