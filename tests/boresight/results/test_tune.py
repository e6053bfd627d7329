"""The figures of `boresight tune` as text and as data."""

from __future__ import annotations

import json
from dataclasses import replace

from boresight.results.tune import (
    CrossValidation,
    TunedParameter,
    TuneErrors,
    TuneFold,
    TuneResult,
    TuneSearch,
    TuneTrial,
)
from boresight.sim.accuracy.search import Sensitivity

GIVEN, TUNED = {"pos": 0.5, "vel": 3.0}, {"pos": 0.25, "vel": None}
FOLD = TuneFold(("a",), ("b",), 0.75, 0.875, TUNED, {"k": 2.0})
RESULT = TuneResult(
    estimator="lag",
    parameters={"k": 2.0},
    word=24,
    source="how",
    units={"pos": "m", "vel": "m/s"},
    weights={"pos": 1.0, "vel": 0.0},
    error=TuneErrors(GIVEN, TUNED),
    trials=(TuneTrial("a", GIVEN, TUNED), TuneTrial("b", GIVEN, TUNED)),
    tuned_parameters=(TunedParameter("k", "1/s", 0.0, 4.0, 1.0, 1.5, 2.0),),
    search=TuneSearch("by hand", 2, 12, 1.0, 34, 1.0, (1.0, 0.75, 0.5)),
    without_truth=("c",),
    vary=2.0,
    sensitivity=(Sensitivity("k", 2.0, 1.0, 4.0, 0.625, float("inf")),),
    cross_validation=CrossValidation((FOLD,), None, 0.875, {"pos": 0.375, "vel": 1.0}, "folds"),
)


def test_text() -> None:
    head, names, pos, vel, fold, title, k, left_out = str(RESULT).splitlines()
    assert head == "lag, W = 24, 2 trials, 34 evaluations: root mean square error"
    assert names.split() == ["given", "tuned", "cross-validated"]
    assert pos.split() == ["pos", "m", "0.5", "0.25", "0.375"]
    assert vel.split() == ["vel", "m/s", "3", "-", "1"]
    assert fold == "  fold 1: trained on 1     0.75, tested on 1    0.875   (pos m)"
    assert title.split()[:3] == ["parameter", "given", "tuned"]
    assert k.split() == ["k", "1", "2", "0.625", "inf", "1/s"]
    assert left_out == "  left out, no truth: c"
    alone = str(
        replace(RESULT, cross_validation=None, without_truth=(), weights={"pos": 1, "vel": 2})
    )
    assert "share of the given, weights pos 1, vel 2 with x 0.5, x 2" in alone
    moved = Sensitivity("k", 2.0, 1.6, 2.5, 1.0, 1.1, {"pos": 0.3, "vel": 3.0}, {"pos": 0.25})
    several = replace(
        RESULT,
        weights={"pos": 1.0, "vel": 1.0},
        error=TuneErrors(GIVEN, {"pos": 0.25, "vel": 4.0}),
        vary=1.25,
        sensitivity=(moved,),
    )
    *_, title, k, _ = str(several).splitlines()
    assert title.endswith("with x 0.8, x 1.25") and k.endswith("vel -25.0 %, +0.0 %")
    near = Sensitivity("k", 4.0, 2.0, 4.0, 1.0, 1.0)
    end = replace(RESULT.tuned_parameters[0], tuned=4.0)
    *_, k, _ = str(replace(RESULT, tuned_parameters=(end,), sensitivity=(near,))).splitlines()
    assert k.endswith(
        "1/s         tuned stands at its limit, 4; x 2 is beyond the range, 4 was tried"
    )
    assert str(replace(RESULT, trials=RESULT.trials[:1])).startswith("lag, W = 24, 1 trial, ")
    many = {f"case {k}": 0.5 for k in range(5)}
    alike = str(replace(RESULT, weights=many, error=TuneErrors(many, many), vary=1.25))
    assert "  share of the given, 5 figures alike with x 0.8, x 1.25" in alike
    assert "cross" not in alone and "fold" not in alone and "left out" not in alone


def test_plain_data() -> None:
    data = json.loads(json.dumps(RESULT.to_json(), allow_nan=False))
    assert data["error"] == {"given": GIVEN, "tuned": TUNED}
    assert data["sensitivity"][0]["at_high"] is None
    assert data["cross_validation"]["folds"][0]["test"] == ["a"]
    assert list(data)[:3] == ["estimator", "parameters", "word"] and data["parameters"] == {"k": 2}
