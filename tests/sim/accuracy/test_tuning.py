"""Tuning: what falls, what is held back, and what several outputs weigh."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.sim.accuracy.scoring import Scorer
from boresight.sim.accuracy.search import deal_folds
from boresight.sim.accuracy.tuning import Objective, Tuning, detuned, means, weights_of
from boresight.sim.records.feed import feed
from boresight.sim.records.record import Record


class Lag(Estimator):
    """A smoothed value and its noise."""

    inputs = (Input("x", -10.0, 10.0, "m"),)
    params = (Param("k", 0.5, 0.01, 1.0), Param("g", 1.0, 0.125, 8.0))
    states = (State("y", -10.0, 10.0, "m"),)
    outputs = (Output("y", "m"), Output("z", "s"))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        y = x.y + p.k * (u.x - x.y)
        return {"y": y}, {"y": y, "z": p.g * u.x}


def trial(seed: int, gain: float = 2.0) -> Any:
    rng = np.random.default_rng(seed)
    truth = np.cumsum(rng.normal(0.0, 0.05, 400))
    columns = {"x": np.clip(truth + rng.normal(0.0, 0.5, 400), -9.9, 9.9), "y_true": truth}
    columns["z_true"] = gain * columns["x"]
    return feed(Lag(), Record.of(columns, name=f"log{seed}"))


@pytest.fixture(scope="module")
def scorer() -> Scorer:
    return Scorer(Lag(), [trial(seed) for seed in (1, 2, 3)], jobs=1)


def tuning(scorer: Scorer, weights: dict[str, float], rounds: int = 8) -> Tuning:
    params = Lag().param_values()
    objective = Objective.of(weights, means(scorer.scores(params)))
    return Tuning(scorer, Lag.params, params, objective, rounds, lambda text: None)


def test_weights() -> None:
    units = {"total": "deg", "heading": "deg", "bias": "rad/s"}
    assert weights_of(units) == {"total": 1.0, "heading": 0.0, "bias": 0.0}
    assert weights_of({"y": "m", "z": "s"}, {"z": 3.0}) == {"y": 1.0, "z": 3.0}
    for chosen, message in (
        ({"q": 1.0}, "^weight q: wanted one of y, z, found 'q'; weigh an output that the logs"),
        ({"y": -1.0}, "^weight y: wanted 0 or more, found -1; "),
        ({"y": float("nan")}, "^weight y: wanted 0 or more, found nan; "),
        ({"y": 0.0, "z": 0.0}, "^weights: wanted one above 0, found zeros; "),
    ):
        with pytest.raises(InputError, match=message):
            weights_of({"y": "m", "z": "s"}, chosen)


def test_one_figure_counts_in_its_unit_and_several_as_shares() -> None:
    scores = [{"y": 2.0, "z": 5.0}, {"y": 4.0}]
    assert means(scores) == {"y": 3.0, "z": 5.0}
    assert Objective.of({"y": 2.0, "z": 0.0}, {"y": 6.0, "z": 1.0}).value(scores) == 3.0
    both = Objective.of({"y": 3.0, "z": 1.0}, {"y": 6.0, "z": 20.0})
    assert both.value(scores) == (3.0 * 3.0 / 6.0 + 5.0 / 20.0) / 4.0
    assert both.value(scores[1:]) == 4.0 / 6.0  # the other is not known there
    assert np.isnan(both.value([{"other": 1.0}]))
    for bad in (0.0, np.nan, np.inf):
        odd = Objective.of({"y": 1.0, "z": 1.0}, {"y": bad, "z": 20.0})
        assert odd.scales == {"y": 1.0, "z": 20.0}


def test_outputs_in_several_units_fall_together(scorer: Scorer) -> None:
    whole = tuning(scorer, {"y": 1.0, "z": 1.0})
    result = whole.search(range(3), "all")
    assert result.start == pytest.approx(1.0)
    assert result.best < 0.4
    before, after = (means(whole.scores(v, range(3))) for v in (whole.start, result.values))
    assert after["y"] < 0.8 * before["y"] and after["z"] < 0.05 * before["z"]
    alone = tuning(scorer, {"z": 1.0}).search(range(3), "all")
    assert alone.values["g"] == pytest.approx(2.0, rel=0.04) and alone.values["k"] == 0.5


def test_folds_are_tuned_without_their_tests(scorer: Scorer) -> None:
    whole = tuning(scorer, {"y": 1.0}, rounds=4)
    held = whole.folds(deal_folds(3, 3))
    for k, fold in enumerate(held):
        train = tuple(i for i in range(3) if i != k)
        assert (fold.test, fold.train) == ((k,), train)
        others = Scorer(Lag(), [scorer.feeds[i] for i in train], jobs=1)
        assert tuning(others, {"y": 1.0}, rounds=4).search(range(2), "x") == fold.tuned
        assert list(fold.scores) == scorer.scores({**whole.start, **fold.tuned.values}, [k])


def test_no_trial_runs_twice_with_the_same_values(scorer: Scorer) -> None:
    asked: list[Any] = []
    plain = Scorer.scores

    class Watched(Scorer):
        def scores(self, params: Any = None, which: Any = None) -> Any:
            asked.extend((tuple(sorted((params or {}).items())), k) for k in which or ())
            return plain(self, params, which)

    watched = Watched(Lag(), scorer.feeds, jobs=1)
    whole = Tuning(watched, Lag.params, Lag().param_values(), Objective({"y": 1.0}, {"y": 1.0}), 3,
                   lambda text: None)  # fmt: skip
    result = whole.search(range(3), "all")
    whole.folds(deal_folds(3, 3))
    around = whole.around(result.values)
    assert len(asked) == len(set(asked)) > 30
    assert [s.parameter for s in around] == ["k", "g"]
    assert around[0].low == pytest.approx(result.values["k"] / 2, rel=1e-3)
    again = scorer.scores({**result.values, "k": around[0].low})
    assert around[0].at_low == pytest.approx(means(again)["y"])
    assert around[0].errors_at_low == means(again)
    assert around[1].errors_at_high["z"] != pytest.approx(around[1].errors_at_low["z"])


def test_detuned() -> None:
    start = {"k": 0.5, "g": 1.0}
    assert detuned(start, Lag.params, 100.0) == {"k": 0.01, "g": 8.0}  # at their limits
    assert detuned(start, Lag.params, 2.0) == {"k": 0.25, "g": 2.0}
    assert start == {"k": 0.5, "g": 1.0}
