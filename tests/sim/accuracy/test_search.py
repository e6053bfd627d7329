"""The search finds, repeats itself, stays in range; folds are a partition."""

from __future__ import annotations

import math

import pytest

from boresight.model.attitude.complementary import Complementary
from boresight.model.errors import InputError
from boresight.model.estimator import Param
from boresight.sim.accuracy.scoring import Scorer
from boresight.sim.accuracy.search import (
    deal_folds,
    deal_named,
    pattern_search,
    rounded,
    sensitivities,
    tunable,
)
from boresight.sim.attitude.worlds.synthetic import SensorError, synthetic_log
from boresight.sim.records.feed import feed

PARAMS = (Param("a", 1.0, 0.0, 50.0, "", ""), Param("b", 1.0, 0.25, 2.0, "", ""))


def bowl(values):
    """Least at a = 8, b = 4, which is out of b's range."""
    return 1.0 + math.log(values["a"] / 8.0) ** 2 + math.log(values["b"] / 4.0) ** 2


def test_search_finds_the_minimum_within_the_ranges():
    seen = []

    def watched(values):
        seen.append(dict(values))
        return bowl(values)

    result = pattern_search(watched, PARAMS, {"a": 0.5, "b": 0.5}, rounds=20)
    assert result.values["a"] == pytest.approx(8.0, rel=0.04)
    assert result.values["b"] == 2.0
    assert result.best == bowl(result.values) == result.history[-1]
    assert result.start == bowl({"a": 0.5, "b": 0.5}) == result.history[0]
    assert all(y <= x for x, y in zip(result.history, result.history[1:], strict=False))
    assert all(0 < v["a"] <= 50.0 and 0.25 <= v["b"] <= 2.0 for v in seen)
    assert all(v["a"] == rounded(v["a"]) for v in seen)
    points = [tuple(v.values()) for v in seen]
    assert len(points) == len(set(points)) == result.evaluations


def test_search_in_a_valley_across_the_axes():
    """A diagonal valley, seven times steeper across: pattern moves run along it."""

    def valley(values):
        x, y = math.log(values["a"]), math.log(values["b"])
        return 10.0 * (x - y) ** 2 + 0.1 * (x + y - 1.0) ** 2

    result = pattern_search(
        valley, [Param(n, 1.0, 0.0, 1e6, "", "") for n in "ab"], {"a": 0.01, "b": 0.01}, rounds=40
    )
    assert result.best < 0.1 and result.evaluations < 60


def test_search_obeys_rounds_and_rests():
    single = pattern_search(bowl, PARAMS, {"a": 0.5, "b": 0.5}, rounds=1)
    assert len(single.history) == 2 and single.evaluations <= 6
    flat = pattern_search(lambda v: 1.0, PARAMS, {"a": 1.0, "b": 1.0}, rounds=50)
    assert flat.values == {"a": 1.0, "b": 1.0} and len(flat.history) <= 5
    lines = []
    pattern_search(bowl, PARAMS, {"a": 0.5, "b": 0.5}, rounds=2, progress=lines.append)
    assert [line.split(":")[0] for line in lines] == ["round 1 of 2", "round 2 of 2"]


def test_search_leaves_points_that_are_no_number():
    result = pattern_search(
        lambda v: math.nan if v["a"] < 4.0 else bowl(v), PARAMS, {"a": 3.0, "b": 1.0}
    )
    assert result.values["a"] == pytest.approx(8.0, rel=0.04)
    assert result.start == math.inf


def test_folds_are_a_partition():
    for seed in (None, 0, 5):
        folds = deal_folds(10, 3, seed)
        assert sorted(k for fold in folds for k in fold) == list(range(10))
        assert sorted(map(len, folds)) == [3, 3, 4]
        assert folds == deal_folds(10, 3, seed)
    assert deal_folds(7, 3) == [(0, 3, 6), (1, 4), (2, 5)]
    assert deal_folds(10, 3, 0) != deal_folds(10, 3, 1)
    for folds in (0, 1, 4):
        with pytest.raises(InputError, match=r"^folds: wanted 2 to 3, .* found \d;"):
            deal_folds(3, folds)


def test_what_shares_a_name_is_held_back_together():
    names = ["a", "a", "b", "c", "b", "d"]
    assert deal_named(names, 2) == [(0, 1, 3), (2, 4, 5)]
    assert deal_named(names, None) == [(0, 1, 5), (2, 4), (3,)]
    assert deal_named(names, 1) == [] == deal_named(["a", "a"], None)
    with pytest.raises(InputError, match=r"^folds: wanted 2 to 4, "):
        deal_named(names, 5)


def test_sensitivities():
    half, _ = sensitivities(bowl, PARAMS, {"a": 8.0, "b": 2.0})
    assert (half.low, half.high) == (4.0, 16.0)
    assert half.at_low == pytest.approx(1.0 + 2 * math.log(2) ** 2) == half.at_high
    _, b = sensitivities(bowl, PARAMS, {"a": 8.0, "b": 0.4})
    assert (b.low, b.high) == (0.25, 0.8)  # kept in range
    assert b.parameter == "b"
    a, _ = sensitivities(bowl, PARAMS, {"a": 8.0, "b": 2.0}, 1.25)
    assert (a.low, a.high) == (6.4, 10.0)


def test_which_parameters():
    estimator = Complementary()
    start = estimator.param_values()
    names = [p.name for p in tunable(estimator, start)]
    assert "kp_pitch_per_s" in names and "declination_ht" not in names
    turned = start | {"declination_ht": 0.1, "mag_gate": 0.0}
    assert set(names) - {p.name for p in tunable(estimator, turned)} == {"mag_gate"}
    assert len(tunable(estimator, turned)) == len(names) - 1
    assert [p.name for p in tunable(estimator, start, ["mag_gate", "kp_roll_per_s"])] == [
        "mag_gate",
        "kp_roll_per_s",
    ]
    for names, message in (
        (["kp"], "kp"),
        (["mag_gate", "mag_gate"], "twice"),
        (["declination_ht"], "above zero"),
    ):
        with pytest.raises(InputError, match=message):
            tunable(estimator, start, names)


@pytest.fixture(scope="module")
def scorer():
    logs = [
        synthetic_log(
            seconds=20,
            rate_hz=50,
            seed=seed,
            acceleration=1.0,
            gyr_error=SensorError(0.01),
            acc_error=SensorError(0.1),
            mag_error=SensorError(2.0),
        )
        for seed in (1, 2, 3)
    ]
    return Scorer(Complementary(), [feed(Complementary(), log) for log in logs])


def test_tuning_mends_a_detuned_filter_and_repeats_itself(scorer):
    names = ["kp_pitch_per_s", "kp_roll_per_s", "kp_heading_per_s"]
    params = tunable(Complementary(), Complementary().param_values(), names)

    def objective(values):
        scores = scorer.scores(values)
        return sum(s["total"] for s in scores) / len(scores)

    results = [
        pattern_search(objective, params, dict.fromkeys(names, 20.0), rounds=6) for _ in range(2)
    ]
    assert results[0] == results[1]
    assert results[0].best < 0.65 * results[0].start
    assert results[0].best == objective(results[0].values) <= objective({})
