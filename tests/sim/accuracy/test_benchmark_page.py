"""`sim.accuracy.benchmark_page`: every figure of the data is on the page; nothing from outside."""

from __future__ import annotations

import copy
import re

import pytest

from boresight.sim.accuracy.benchmark_page import render_page


def row(name, level, totals, **more):
    trials = [
        {
            "trial": trial,
            "total": v,
            "heading": v / 2,
            "inclination": v / 4,
            "vs_float_max_deg": more.get("vs_float_max_deg"),
            "status_changed": 0,
            "saturated_updates": 0,
        }
        for trial, v in totals.items()
    ]
    mean = {"total": totals["a"], "heading": 0.5 * totals["a"], "inclination": 0.25 * totals["a"]}
    return {
        "estimator": name,
        "level": level,
        "kind": "peer" if level == "package" else "ours",
        "summary": f"<{name}>",
        "mean_deg": mean,
        "mean_by_folder_deg": {"logs": mean},
        "vs_float_max_deg": None,
        "status_changed": None,
        "saturated_updates": None,
        "trials": trials,
    } | more


DATA = {
    "source": "by the method",
    "word": 32,
    "left_out": ["gone"],
    "parameters": {"ours": {"k": 2.0}},
    "logs": [
        {"trial": "a", "reference": "truth"},
        {"trial": "c", "reference": "comparison"},
        {"trial": "n", "reference": "peer"},
    ],
    "estimators": [
        row(
            "ours",
            "fixed",
            {"a": 2.25, "c": 3.25, "n": 4.25},
            vs_float_max_deg=0.000123,
            status_changed=17,
            saturated_updates=0,
        ),
        row("ours", "float", {"a": 2.35, "c": 3.25, "n": 4.25}),
        row("peer", "package", {"a": 1.15, "c": 7.75, "n": 0.0}),
    ],
}


@pytest.fixture(scope="module")
def page():
    return render_page(DATA)


def test_figures(page):
    for text in ("2.25", "2.35", "1.15", "1.23×10⁻⁴", ">17<", "gone", "k = 2.0", "by the method"):
        assert text in page, text
    assert "&lt;ours&gt;" in page and "<ours>" not in page
    assert page.index(">peer</td>") < page.index(">ours</td>")  # the best first
    assert "http" not in page and "<script" not in page
    assert page.count("<svg") == 5


def test_best_of_a_trial_is_marked(page):
    marked = re.findall(r'class="r best" title="(\w+): total ([\d.]+)', page)
    assert marked == [("peer", "1.15"), ("ours", "3.25"), ("ours", "4.25")]


def test_folders_when_there_are_several():
    data = copy.deepcopy(DATA)
    for r in data["estimators"]:
        r["mean_by_folder_deg"] = {"one": r["mean_deg"], "two": r["mean_deg"]}
    assert "mean by folder" in render_page(data)
    assert "mean by folder" not in render_page(DATA)


def test_without_truth_and_float():
    data = copy.deepcopy(DATA)
    data["logs"] = data["logs"][1:2]
    data["estimators"] = [copy.deepcopy(DATA["estimators"][2])]
    data["estimators"][0] |= {"mean_deg": None, "mean_by_folder_deg": {}}
    page = render_page(data)
    assert "No log with truth" in page and page.count("<svg") == 1
