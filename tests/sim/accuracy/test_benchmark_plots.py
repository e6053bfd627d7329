"""`sim.accuracy.benchmark_plots`: valid SVG, the same each time; marks where the figures are."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import pytest

from boresight.sim.accuracy.benchmark_plots import difference_plot, mean_plot, style_of, trial_plot


def row(name, kind, totals, error=None):
    near = {} if error is None else {"attitude": error}
    trials = [
        {"trial": f"t_{k}", "error": {"total": v}, "vs_float": near} for k, v in enumerate(totals)
    ]
    mean = None if None in totals else sum(totals) / len(totals)
    return {
        "estimator": name,
        "kind": kind,
        "vs_float": list(near),
        "trials": trials,
        "mean": {"total": mean, "heading": mean, "inclination": mean and mean / 2},
    }


ROWS = [
    row("ours_a", "ours", [2.0, 4.0], 1e-4),
    row("ours_b", "ours", [1.0, 1.5], 0.0),
    row("peer_a", "peer", [10.0, 20.0]),
    row("peer_b", "peer", [None, 3.0]),
]
TRIALS = ["t_0", "t_1"]


def texts(svg):
    root = ET.fromstring(svg)
    assert root.attrib["class"] == "plot" and "http" not in svg
    return [t.text for t in root.iter("text")]


def test_means_best_first_and_those_without_left_out():
    shown = texts(mean_plot(ROWS, salt="a"))
    names = [t for t in shown if t in {r["estimator"] for r in ROWS}]
    assert names == ["ours_b", "ours_a", "peer_a"]
    assert {"1.25", "3.00", "15.00", "heading", "inclination"} <= set(shown)
    assert mean_plot(ROWS, salt="a") == mean_plot(ROWS, salt="a")


def test_trials_and_estimators_are_named():
    shown = texts(trial_plot(ROWS, TRIALS, salt="b"))
    assert {
        "t 0",
        "t 1",
        "ours_a",
        "ours_b",
        "peer_a",
        "peer_b",
        "total RMSE, deg (logarithmic)",
    } <= set(shown)


def marks(svg, colour):
    """(x, y) of the marks in a colour, legend left out."""
    matches = re.findall(
        r'<use href="#\w+" x="([\d.]+)" y="([\d.]+)"[^>]*style="[^"]*' + colour, svg
    )
    return [(float(x), float(y)) for x, y in matches]


def test_marks_stand_at_their_figures():
    svg = trial_plot(ROWS[:2], TRIALS, salt="c")
    a, b = marks(svg, "#0072b2")[:2], marks(svg, "#d55e00")[:2]
    assert a[0][0] < a[1][0] and b[0][0] < b[1][0]
    assert b[0][0] < b[1][0] < a[0][0]  # 1, 1.5, 2, 4 degrees from left to right
    assert a[1][0] - a[0][0] == pytest.approx(a[0][0] - b[0][0], rel=1e-3)  # factors of two
    assert a[0][1] == b[0][1] < a[1][1] == b[1][1]


def test_differences_of_ours_alone():
    shown = texts(difference_plot(ROWS, TRIALS, salt="d"))
    assert {"ours_a", "ours_b"} <= set(shown) and "peer_a" not in shown
    assert any("fixed point and float64, deg" in (t or "") for t in shown)


def test_styles_are_apart():
    many = [row(f"o{k}", "ours", [1.0]) for k in range(7)] + [
        row(f"p{k}", "peer", [1.0]) for k in range(9)
    ]
    styles = style_of(many)
    assert len({(s["colour"], s["marker"], s["face"]) for s in styles.values()}) == 16
    assert len({s["colour"] for n, s in styles.items() if n[0] == "o"}) == 7
