"""Means, ratios and the worst of runs that are made up."""

from __future__ import annotations

from typing import Any

import pytest

from boresight.sim.attitude.robustness.plan import Case
from boresight.sim.attitude.robustness.summary import summary, text

CASES = [
    Case("as recorded", "as recorded", lambda log: log),
    Case("place 0", "anywhere", lambda log: log),
    Case("place 1", "anywhere", lambda log: log),
    Case("blind", "blind", lambda log: log, "inclination"),
]


def run(trial: str, case: str, ours: float, rival: float | None, error: float = 1e-4) -> Any:
    def figures(x: float) -> dict[str, Any]:
        parts = {"total": x, "heading": 0.8 * x, "inclination": 0.5 * x}
        return {**parts, "settled_2": None, "settled_5": 10.0 * x}

    fixed = {"apart_deg": error, "changed": 1, "saturated": 0, "good": error < 1e-2}
    rows = [
        {"estimator": "mine", "level": "fixed", **figures(ours), **fixed},
        {"estimator": "mine", "level": "float", **figures(ours)},
        {"estimator": "vqf_online", "level": "package"}
        | (figures(rival) if rival else {"refused": "no"}),
    ]
    return {"trial": trial, "case": case, "rows": rows}


RUNS = [
    run("a", "as recorded", 1.0, 2.0),
    run("b", "as recorded", 4.0, 3.0, error=2e-4),
    *(run(t, f"place {k}", x, 2.0) for t, k, x in (("a", 0, 1.0), ("a", 1, 2.0), ("b", 0, 9.0))),
    run("a", "blind", 2.0, None),
]


def test_a_run_that_failed_has_no_figure() -> None:
    data = summary(CASES, RUNS)
    assert data["refused"] == [{"filter": "vqf_online", "runs": 1, "of": 6, "reason": "no"}]
    assert text(data).splitlines()[-1] == "vqf_online: 1 of 6 runs FAILED: no"
    assert summary(CASES, RUNS[:-1])["refused"] == []


def test_means_ratios_and_the_worst() -> None:
    data = summary(CASES, RUNS)
    assert (
        data["filters"] == ["mine", "mine float64", "vqf_online"] and data["rival"] == "vqf_online"
    )
    recorded, anywhere, blind = data["groups"]
    mine = recorded["rows"]["mine"]
    assert (mine["total"], mine["ratio"]) == (2.5, 1.0)
    assert mine["worst"] == {"ratio": pytest.approx(4.0 / 3.0), "trial": "b", "case": "as recorded"}
    assert mine["settled_5"] == 40.0 and mine["settled_2"] is None and mine["never_2"] == 1.0
    assert anywhere["runs"] == 3 and anywhere["rows"]["mine"]["ratio"] == 2.0
    assert anywhere["rows"]["mine"]["worst"]["case"] == "place 0"
    assert "ratio" not in recorded["rows"]["mine float64"]
    assert (
        blind["rows"]["vqf_online"]["inclination"] is None and "ratio" not in blind["rows"]["mine"]
    )
    rows = {(t["trial"], t["group"]): t["rows"]["mine"] for t in data["trials"]}
    assert rows["a", "anywhere"] == 1.5 and rows["a", "blind"] == 1.0
    (fixed,) = data["fixed"]
    assert (fixed["apart_deg"], fixed["where"]) == (2e-4, "b, as recorded")
    assert (fixed["changed"], fixed["good"]) == (6, True)


def test_beyond_the_tolerance_is_told() -> None:
    data = summary(CASES, [*RUNS, run("b", "blind", 1.0, 1.0, error=0.5)])
    assert not data["fixed"][0]["good"] and "BEYOND" in text(data)


def test_the_text_has_every_group_and_the_worst() -> None:
    result = text(summary(CASES, RUNS))
    assert "blind *" in result and "mine against vqf_online" in result and "b, place 0" in result
    assert "     2.50     2.50     2.50" in result
    worse = {"estimator": "mine", "of": 9, "runs": [{"trial": "a"}, {"trial": "a"}]}
    page = text({**summary(CASES, RUNS), "worse": [worse]})
    assert "mine: 2 of 9 runs more than 15 % worse, of 1 trials" in page
    alone = [{**r, "rows": r["rows"][:2]} for r in RUNS]
    assert "against" not in text(summary(CASES, alone))
