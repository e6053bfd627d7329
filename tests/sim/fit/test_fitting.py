"""A profile from records and hostile inputs, and what it is worth."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from boresight.kalman import Kalman, Measurement
from boresight.kalman import State as Kept
from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.sim.compare.difference import Difference
from boresight.sim.compare.verdict import judge
from boresight.sim.fit import fitting
from boresight.sim.fit.fitting import Effect, between, effect, fitted, select_ranges
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import CompiledFloat, Emitted


class Motor(Estimator):
    """Two states and their covariance, as in a textbook: nothing is said of gains."""

    inputs = (Input("z", -100.0, 100.0),)
    params = (Param("q", 1e-3, 1e-6, 1.0), Param("r", 0.01, 1e-3, 1.0))
    states = (
        State("a", -200.0, 200.0),
        State("b", -100.0, 100.0),
        State("p00", 0.0, 16.0, initial=1.0),
        State("p01", -16.0, 16.0),
        State("p11", 0.0, 16.0, initial=1.0),
    )
    outputs = (Output("a", tolerance=1e-3), Output("b", tolerance=1e-3))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """One update."""
        p00 = x.p00 + 0.02 * x.p01 + 1e-4 * x.p11
        p01 = x.p01 + 0.01 * x.p11
        p11 = x.p11 + p.q
        weight = 1.0 / ops.maximum(p00 + p.r, 1e-3)
        k0, k1 = p00 * weight, p01 * weight
        ahead = x.a + 0.01 * x.b
        a, b = ahead + k0 * (u.z - ahead), x.b + k1 * (u.z - ahead)
        after = {"a": a, "b": b}
        after |= {"p00": p00 - k0 * p00, "p01": p01 - k0 * p01, "p11": p11 - k1 * p01}
        return after, {"a": a, "b": b}


@pytest.fixture(scope="module")
def records() -> dict[str, Any]:
    t = 0.01 * np.arange(3000)
    noise = np.random.default_rng(3).normal(0.0, 0.1, len(t))
    return {"swing": (10.0 * np.sin(t) + noise)[:, None]}


class Power(Estimator):
    """A product of what is never large together."""

    inputs = (Input("volt", -500.0, 500.0), Input("ampere", -500.0, 500.0))
    states = (State("mean", -100.0, 100.0),)
    outputs = (Output("mean"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """One update."""
        power = u.volt * u.ampere
        mean = x.mean + 0.1 * power * power - 0.2 * x.mean
        return {"mean": mean}, {"mean": mean}


def test_what_is_never_large_together_is_more_exact(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("boresight.sim.fit.fitting.hostile", lambda *values: {})
    estimator, t = Power(), np.arange(500.0)
    records = {"log": np.stack([400.0 * np.sin(t) ** 8, 0.05 * np.cos(t)], axis=1)}
    result = fitted(estimator, records)
    assert result.profile.logs == ("log",) and result.hostile_updates == 0
    before, after = (effect(estimator, p, records, word=24) for p in (None, result.profile))
    assert isinstance(before, Effect) and isinstance(after, Effect)
    assert after.saturated_updates == 0
    assert after.differences[0].largest < 0.5 * before.differences[0].largest
    assert estimator.profile is None


def test_a_profile_of_a_tenth_holds_on_all(records: dict[str, Any]) -> None:
    result = fitted(Motor(), {"part": 0.1 * records["swing"][:300]})
    assert result.hostile_updates == 12_000
    after = effect(Motor(), result.profile, records)
    assert isinstance(after, Effect) and after.saturated_updates == 0


def test_under_hostile_inputs_variances_stay_positive(records: dict[str, Any]) -> None:
    after = effect(Motor(), fitted(Motor(), records).profile, records)
    assert isinstance(after, Effect) and after.negative_updates == 0


def test_without_hostile_inputs_they_would_not(records: dict[str, Any]) -> None:
    """That the test before this one can fail."""
    estimator = copy.copy(Motor())
    result = fitted(estimator, records, stressed=False)
    assert result.hostile_updates == 0
    with_hostile = fitted(estimator, records).profile.ranges
    assert any(abs(r[1]) < abs(with_hostile.get(n, r)[1]) for n, r in result.profile.ranges.items())


def test_what_does_not_compile_says_why() -> None:
    class Endless(Estimator):
        """A product without a range."""

        inputs = (Input("u", 0.0, 8.0),)
        outputs = (Output("y"),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            """One update."""
            return {}, {"y": u.u * ops.rsqrt(u.u) * ops.rsqrt(u.u)}

    records = {"log": np.linspace(1.0, 2.0, 50)[:, None]}
    why = effect(Endless(), None, records)
    assert isinstance(why, str) and "wanted" in why
    after = effect(Endless(), fitted(Endless(), records).profile, records)
    assert isinstance(after, Effect) and after.differences[0].largest < 1e-6


def test_the_advice_of_check_is_followed_with_success() -> None:
    """Where rounding adds up in a coarse word, `boresight fit` is what it says, and helps."""

    class Judged(Power):
        """The same, judged."""

        outputs = (Output("mean", tolerance=1e-5),)

    estimator, t = Judged(), np.arange(500.0)
    inputs = np.stack([400.0 * np.sin(t) ** 8, 0.05 * np.cos(t)], axis=1)
    build = Build(estimator)
    run, reference = (level(build).run_anew(inputs) for level in (Emitted, CompiledFloat))
    made = judge(build, 0, inputs, run, reference, {})
    assert not made.good and "choose formats by boresight fit" in made.culprit
    result = fitted(estimator, {"log": inputs}, stressed=False)
    after = effect(estimator, result.profile, {"log": inputs})
    assert isinstance(after, Effect)
    assert after.differences[0].largest < 0.5 * made.differences[0].largest


class Rotor(Kalman):
    """A filter whose gains are large in its first updates alone."""

    inputs = (Input("i_a", -20.0, 20.0), Input("i_b", -20.0, 20.0))
    states = (
        Kept("ia", -20.0, 20.0, sd=1.0, sd_max=2.0),
        Kept("ib", -20.0, 20.0, sd=1.0, sd_max=2.0),
        Kept("omega", -2000.0, 2000.0, sd=100.0, sd_max=128.0),
        Kept("theta", -1.0, 1.0, sd=0.3, sd_max=0.5),
    )
    outputs = (Output("theta", tolerance=1e-4),)

    def f(self, x: Any, u: Any, p: Any) -> Any:
        """Currents of a motor without a load."""
        s, c = ops.sincos_ht(x.theta)
        return {
            "ia": x.ia + 0.03 * (0.05 * x.omega * s - 0.5 * x.ia),
            "ib": x.ib - 0.03 * (0.05 * x.omega * c + 0.5 * x.ib),
            "theta": x.theta + 1.6e-5 * x.omega,
        }

    def noise(self, x: Any, u: Any, p: Any) -> Any:
        """A second's, in a period."""
        return {"ia": 0.02, "ib": 0.02, "omega": 25.0, "theta": 1e-7}

    def measure(self, x: Any, u: Any, p: Any) -> Any:
        """Both currents."""
        return [Measurement(u.i_a, x.ia, 0.01), Measurement(u.i_b, x.ib, 0.01)]


def test_a_proven_covariance_keeps_its_intervals(monkeypatch: pytest.MonkeyPatch) -> None:
    inputs = np.random.default_rng(1).normal(0.0, 0.3, (500, 2))
    rotor = Rotor()
    fit = fitted(rotor, {"rest": inputs})
    kept = between(fit.trace, rotor.covariance_elements)
    assert len(kept) > 50 and fit.profile.ranges and not kept & fit.profile.ranges.keys()
    made = effect(rotor, fit.profile, {"rest": inputs})
    assert isinstance(made, Effect) and made.negative_updates == 0
    monkeypatch.setattr("boresight.sim.fit.fitting.between", lambda *_: set())
    free = effect(rotor, fitted(rotor, {"rest": inputs}).profile, {"rest": inputs})
    assert isinstance(free, Effect) and free.negative_updates > 0


def test_ranges_that_saturate_on_the_records_are_left_out(records: dict[str, Any]) -> None:
    """A profile is no worse than none: here its innovations have a hundredth of their range."""
    fit = fitted(Motor(), records)
    assert select_ranges(fit, records).profile.ranges
    ranges = {n: (0.01 * low, 0.01 * high) for n, (low, high) in fit.profile.ranges.items()}
    choice = select_ranges(replace(fit, profile=replace(fit.profile, ranges=ranges)), records)
    assert choice.full.saturated_updates and choice.profile.ranges == {}
    assert choice.after is choice.before


@pytest.mark.parametrize(
    ("sizes", "tolerances", "kept"),
    [
        ((1.05, 0.9), (None, None), True),  # nothing is worse
        ((1.2, 0.1), (None, None), False),  # its author accepts no more
        ((1.2, 0.1), (2.3, None), False),  # more than half of its tolerance
        ((1.2, 0.1), (2.5, None), True),
        ((1.2, 0.9), (2.5, None), False),  # not together smaller
        ((1.2, 0.1), (2.5, 0.95), True),
        ((1.2, 0.8), (1.3, 0.95), True),  # as it makes all outputs pass
        ((1.2, 0.8), (1.1, 0.95), False),
        ((0.0, 1.3), (None, None), False),
        ((0.1, 1.2), (2.0, None), True),  # not judged, beside one that is
        ((0.1, 1.3), (2.0, None), False),
    ],
)
def test_what_is_kept_of_a_profile(
    records: dict[str, Any],
    monkeypatch: pytest.MonkeyPatch,
    sizes: Any,
    tolerances: Any,
    kept: bool,
) -> None:
    """By the factors of two errors."""
    fit = fitted(Motor(), records)

    def measured(estimator: Any, profile: Any, *_: Any, **__: Any) -> Effect:
        each = zip("ab", (1.0, 1.0) if profile is None else sizes, tolerances, strict=True)
        return Effect(tuple(Difference(n, "", 9, x, x, 0, t) for n, x, t in each), 0, 0)

    monkeypatch.setattr(fitting, "effect", measured)
    assert select_ranges(fit, records).profile.ranges == (fit.profile.ranges if kept else {})
