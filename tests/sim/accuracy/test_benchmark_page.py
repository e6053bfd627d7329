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
            "error": {"total": v, "heading": v / 2, "inclination": v / 4},
            "vs_float": {d["output"]: d["apart"] for d in more.get("vs_float", ())},
            "saturated_updates": 0,
            "offset_deg": (0.0, 0.0, 20 * v),
        }
        for trial, v in totals.items()
    ]
    mean = {"total": totals["a"], "heading": 0.5 * totals["a"], "inclination": 0.25 * totals["a"]}
    return {
        "estimator": name,
        "level": level,
        "kind": "peer" if level == "package" else "ours",
        "summary": f"<{name}>",
        "attitude": True,
        "units": dict.fromkeys(mean, "deg"),
        "mean": mean,
        "mean_by_folder": {"logs": mean},
        "vs_float": [],
        "saturated_updates": None,
        "trials": trials,
    } | more


def near(output, unit, error, tolerance):
    good = error <= tolerance
    return {"output": output, "unit": unit, "apart": error, "tolerance": tolerance, "good": good}


DATA = {
    "source": "by the method",
    "word": 32,
    "align": "heading",
    "declination_deg": 2.75,
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
            vs_float=[near("attitude", "deg", 0.000123, 0.01), near("status", "words", 17, 0.0)],
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
    for text in (
        "2.25",
        "2.35",
        "1.15",
        "1.23×10⁻⁴",
        ">17<",
        "gone",
        "k = 2.0",
        "By the method",
        ">155.00<",
        "2.75",
    ):
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
        r["mean_by_folder"] = {"one": r["mean"], "two": r["mean"]}
    assert "mean by folder" in render_page(data)
    assert "mean by folder" not in render_page(DATA)


#: Of an output with a truth, and of one without.
NEAR = [near("pos", "m", 2e-3, 1e-3), near("bias", "m/s^2", 3e-5, 1e-3)]


def test_other_outputs_have_a_table_of_their_own():
    data = copy.deepcopy(DATA)
    general = {"attitude": False, "units": {"pos": "m"}, "mean": {"pos": 0.1234567}}
    other = row("cart", "fixed", {"a": 1.0}, vs_float=NEAR, **general)
    floating = row("cart", "float", {"a": 1.0}, **general | {"mean": {"pos": 0.5678}})
    data["estimators"] += [other, floating]
    page = render_page(data)
    for text in (
        "<h2>cart</h2>",
        "pos m",
        "0.1235",
        "0.5678",
        "0.002",
        " beyond",
        "bias m/s\u00b2",
    ):
        assert text in page, text
    assert page.count("<svg") == 5
    data["estimators"], data["logs"] = [other], data["logs"][:1]
    alone = render_page(data)
    assert "0.1235" in alone and "<svg" not in alone and "Mean over" not in alone
    assert ">1 log, with truth. By the method" in alone


def test_without_truth_and_float():
    data = copy.deepcopy(DATA)
    data["logs"] = data["logs"][1:2]
    data["estimators"] = [copy.deepcopy(DATA["estimators"][2])]
    data["estimators"][0] |= {"mean": None, "mean_by_folder": {}}
    page = render_page(data)
    assert "No log with truth" in page and page.count("<svg") == 1
