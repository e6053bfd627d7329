"""The page of a protocol: figures and plots stand in it."""

from __future__ import annotations

from typing import Any

from boresight.sim.attitude.robustness.page import render_page
from boresight.sim.attitude.robustness.plan import Case
from boresight.sim.attitude.robustness.summary import summary

CASES = [Case("as recorded", "as recorded", lambda log: log)]


def run(trial: str, ours: float, rival: float) -> Any:
    def figures(x: float) -> dict[str, Any]:
        parts = {"total": x, "heading": 0.8 * x, "inclination": 0.5 * x}
        return {**parts, "settled_2": None, "settled_5": 10.0 * x}

    fixed = {"apart_deg": 1e-4, "changed": 1, "saturated": 0, "good": True}
    rows = [
        {"estimator": "mine", "level": "fixed", **figures(ours), **fixed},
        {"estimator": "vqf_online", "level": "package", **figures(rival)},
    ]
    return {"trial": trial, "case": "as recorded", "rows": rows}


RUNS = [run("a", 1.0, 2.0), run("b", 9.0, 3.0)]


def test_the_page_shows_every_table_and_plot() -> None:
    data = {"protocol": "short", "word": 32, "trial_names": ["a", "b"], **summary(CASES, RUNS)}
    page = render_page(data)
    assert page.count("<svg") == 3
    assert "mine against vqf_online, trial by trial" in page and ">b</td>" in page
    assert '<td class="r worse">2.00</td>' in page and "100 %" in page
    alone = summary(CASES, [{**r, "rows": r["rows"][:1]} for r in RUNS])
    assert render_page({**data, **alone}).count("<svg") == 2


def test_the_page_shows_the_curves_of_what_is_worse() -> None:
    curves = {
        "t": [0.0, 1.0, 2.0],
        "ours": [3.0, None, 2.0],
        "rival": [1.0, 1.0, 1.0],
        **dict.fromkeys(("field_heading", "field_dip", "field_norm"), [0.0, 5.0, None]),
        "moves": [0.0, 1.0, 1.0],
    }
    run = {"trial": "b", "case": "as recorded", "ratio": 3.0, "ours": 9.0, "rival": 3.0}
    worse = {"estimator": "mine", "of": 2, "runs": [{**run, "figure": "total"}]}
    worse["shown"] = [{**worse["runs"][0], "curves": curves}]
    data = {"protocol": "short", "word": 32, "trial_names": ["a", "b"], **summary(CASES, RUNS)}
    page = render_page({**data, "worse": [worse]})
    assert page.count("<svg") == 4 and "1 of 2 runs." in page
    assert "b, as recorded: 9.00° against 3.00°, 3.00 times. " in page
    assert "field off" in page and "<summary>All 1 runs</summary>" in page
    none = render_page({**data, "worse": [{**worse, "runs": [], "shown": []}]})
    assert "more than 15 % worse" not in none and none.count("<svg") == 3
