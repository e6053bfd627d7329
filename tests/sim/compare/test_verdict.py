"""Verdicts on accuracy: tolerances, saturation, ranges, rounding."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.declarations import Input, Output, State
from boresight.model.estimator import Estimator
from boresight.sim.compare.difference import Difference
from boresight.sim.compare.verdict import Accuracy
from boresight.sim.fit.fitting import fitted
from tests.support.faulty import (
    HERE,
    Bounded,
    Loose,
    NegativeRoot,
    Slow,
    Snug,
    Stateless,
    Sums,
    Unnamed,
    judge,
)


def test_saturation_is_no_success_though_it_be_near() -> None:
    made = judge(Sums(), [4.0, 0.0, 4.0, 4.0])
    assert not made.good and made.saturated_updates == 2
    assert made.saturated == {"state y": 2}
    first = made.culprit.partition(":")[0]
    assert re.fullmatch(rf"step 0, value state y {HERE}", first)
    assert made.lines()[1:] == ["2 updates SATURATED: state y (2)", f"first wrong: {made.culprit}"]
    plain = made.to_json()
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    assert plain["good"] is False and plain["saturated"] == {"state y": 2}
    assert plain["outputs"][0]["output"] == "y" and plain["culprit"] == made.culprit
    near = Accuracy((Difference("y", "", 1, 0.0, 0.0, 0, 1.0),), 1, {"y": 1}, (), {}, "")
    assert not near.good


def test_a_value_without_a_name_is_called_by_the_nearest_that_has_one() -> None:
    """Of two on one line the count is that of the one that saturates more often."""
    made = judge(Unnamed(), [4.0, 0.0, 2.0])
    ((name, count),) = made.saturated.items()
    assert count == 2 and re.fullmatch(
        r"a bounded value in sum_of_squares, faulty\.py, line \d+", name
    )


def test_saturated_values_have_lines() -> None:
    (name,) = judge(Bounded(), [0.0, 4.0, 4.0]).saturated
    assert re.fullmatch(r"total, faulty\.py, line \d+", name)
    made = judge(Loose(), [0.0, 4.0, 4.0])
    assert all(d.good for d in made.differences) and not made.good
    assert re.match(r"step 1, value total \(faulty\.py, line \d+\): ", made.culprit)


def test_what_an_output_beyond_its_tolerance_comes_from() -> None:
    """Though nothing saturates."""
    made = judge(NegativeRoot(), [1.0, 0.5, -2.0])
    assert not made.saturated_updates
    assert "-2 in step 2 is BEYOND the stated range" in made.beyond_range[0]
    assert re.match(rf"step 2, a bounded value in y_out {HERE}: -2 does not fit", made.culprit)


class Accepted(NegativeRoot):
    """Beside an output whose claim is wrong before, but which is as exact as it is to be."""

    outputs = (*NegativeRoot.outputs, Output("spare", tolerance=0.1))

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Both."""
        spare = ops.named("spare", ops.bounded(0.75 * u.u, -1.0, 1.0, "hoped"))
        states, outputs = super().step(x, u, p)
        return states, {**outputs, "spare": spare}


def test_what_an_accepted_output_is_made_of_is_not_to_blame() -> None:
    made = judge(Accepted(), [1.5, 0.5, -2.0])
    assert [d.good for d in made.differences] == [False, True] and not made.saturated_updates
    assert re.match(rf"step 2, a bounded value in y_out {HERE}: -2 does not fit", made.culprit)


class Growing(Estimator):
    """A state that grows without end, in float64 too."""

    inputs = (Input("u", -1.0, 1.0),)
    states = (State("y", -1.0, 1.0),)
    outputs = (Output("y", tolerance=1e-3),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """A thousand times."""
        return {"y": 1000.0 * x.y + u.u}, {"y": x.y}


def test_an_estimator_that_diverges_is_told_so() -> None:
    made = judge(Growing(), [1.0] * 120)
    y, step = 0.0, 0
    while abs(y) <= 2.0**21:  # a million times what its word holds
        y, step = 1000.0 * y + 1.0, step + 1
    assert made.faults()[0] == (
        f"float64 diverges: y is {y:.3g} in step {step}; correct the equations, the parameters or "
        "the log"
    )
    assert not made.good and "widen" not in " ".join(made.faults())


class Two(Slow):
    """The same behind a state that changes more, and one that does not."""

    states = (State("fast", -4.0, 4.0), State("still", -1.0, 1.0), *Slow.states)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Both."""
        states, outputs = super().step(x, u, p)
        return {"fast": x.fast + 0.5 * (u.u - x.fast), "still": 0.5, **states}, outputs


def test_a_comparison_that_decides_otherwise_than_in_float64_is_to_blame() -> None:
    class Near(Estimator):
        inputs = (Input("u", -1.0, 1.0),)
        states = (State("y", -8.0, 8.0),)
        outputs = (Output("y", tolerance=1e-3),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            y = x.y + ops.where(u.u * u.u < 0.25, 0.1 * u.u, 0.0)
            return {"y": y}, {"y": x.y}

    said = r"step 2, a comparison \(test_verdict.py, line \d+\) decides otherwise than in "
    said += "float64, as in 1 of 5 updates"
    assert re.match(said, judge(Near(), [0.1, 0.2, 0.5 - 1e-7, 0.3, 0.1], 18).culprit)


SAID = "no single operation is wrong: rounding adds up; "


class Wide(Stateless):
    """A state whose range is far wider than its values."""

    states = (State("y", -64.0, 64.0),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """A mean."""
        y = x.y + 0.25 * (u.u - x.y)
        return {"y": y}, {"y": y}


def test_rounding_that_adds_up_names_what_wastes_bits() -> None:
    made = judge(Wide(), [1.0] * 20, 18)
    assert not made.good and made.saturated_updates == 0
    assert re.fullmatch(
        rf"{SAID}state y \(test_verdict.py, line \d+\) wastes 5 bits: narrow its range to "
        r"\[-3.996, 3.996\], if it holds for all logs and parameters; or choose formats by "
        "boresight fit; or use a wider word",
        made.culprit,
    ), made.culprit
    assert made.to_json()["wasted"][0]["bits"] == 5


def test_rounding_in_a_state_that_wastes_nothing() -> None:
    cure = "use a wider word, or carry the remainder in a second state"
    for slow in (Slow(), Two(), Snug()):
        culprit = judge(slow, [1.0] * 200, 18).culprit
        assert culprit.startswith(f"{SAID}state y ") and cure in culprit
    assert judge(Stateless(), [2.0], 18).culprit == f"{SAID}use a wider word"


class Claimed(Estimator):
    """A claim that is far too wide."""

    inputs = (Input("u", -1.0, 1.0),)
    outputs = (Output("y", tolerance=1e-9),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """A small square."""
        return {}, {"y": ops.bounded(1e-3 * u.u * u.u, -64.0, 64.0, "by hand")}


def test_a_claim_that_is_too_wide_with_a_profile() -> None:
    """A profile leaves its margins; only its author may say less."""
    claimed, inputs = Claimed(), [0.1 * k - 1.0 for k in range(21)]
    assert "choose formats by boresight fit" in judge(claimed, inputs, 18).culprit
    full = fitted(claimed, {"log": np.array(inputs)[:, None]}, stressed=False).profile
    for claimed.profile in (full, replace(full, ranges={})):
        assert "boresight fit" not in judge(claimed, inputs, 18).culprit
    assert str(claimed.profile).endswith("no formats, since none observed in log is more exact")


class ByHand(Wide):
    """A variance by hand, as wide as `wide`, and its formats from runs."""

    def __init__(self, wide: float) -> None:
        self.states = (State("p00", -wide, wide),)
        inputs = {"log": np.ones((20, 1))}
        self.profile = fitted(self, inputs, stressed=False).profile

    def step(self, x: Any, u: Any, p: Any) -> Any:
        """Two products, as of matrices."""
        y = x.p00 + 0.25 * (u.u - x.p00)
        return {"p00": y}, {"y": y}


def test_advice_about_a_covariance_by_hand_ends() -> None:
    """What is narrow enough is not named again, whatever else wastes bits."""
    model = "write the model with boresight.kalman, or one scalar update for each measurement"
    wide, narrow = (judge(ByHand(limit), [1.0] * 20, 18).culprit for limit in (64.0, 3.996))
    assert "state p00 " in wide and "narrow its range" in wide and wide.endswith(f"; or {model}")
    assert narrow == f"{SAID}its covariance is written by hand: use a wider word, or {model}"


def test_a_state_beyond_its_range_is_no_success_though_its_word_holds_it() -> None:
    """[-1, 1] in a word that holds [-2, 2)."""
    made = judge(Sums(), [1.0, 1.0, 1.0, 0.0])
    assert made.saturated_updates == 0 and all(d.good for d in made.differences)
    assert not made.good
    assert made.beyond_range == (
        "state y is 1.25 in step 2, BEYOND its declared range [-1, 1]: widen it",
    )
    assert made.lines()[-2:] == [*made.beyond_range, f"first wrong: {made.culprit}"]
    assert made.to_json()["beyond_range"] == list(made.beyond_range)
    assert re.match(rf"step 2, value state y {HERE}: 1\.25 does not fit", made.culprit)
    assert judge(Sums(), [1.0, 1.0, 0.0]).good
    # Rounding may leave a range by some thousandth of it.
    assert judge(Sums(), [1.0, 1.003]).good and judge(Sums(), [1.0, 1.015]).good
    assert not judge(Sums(), [1.0, 1.0, 0.017]).good
    # What saturates is named once.
    assert judge(Sums(), [4.0, 4.0]).beyond_range == ()


@pytest.mark.parametrize(("low", "floor", "fault"), [(0.0, None, True), (-1.0, None, False),
                                                     (0.0, 1e-3, False)])  # fmt: skip
def test_a_variance_below_0_is_no_range_to_widen(
    low: float, floor: float | None, fault: bool
) -> None:
    class Shrinking(Estimator):
        inputs = (Input("u", -1.0, 1.0),)
        states = (State("p00", low, 1.0, initial=0.5),)
        outputs = (Output("y", tolerance=1e-3),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            p00 = x.p00 - 0.2 * (x.p00 + 0.1)
            return {"p00": p00 if floor is None else ops.maximum(p00, floor)}, {"y": x.p00}

    made = judge(Shrinking(), [0.0] * 20)
    assert made.good != fault and not made.culprit
    if fault:
        (text,) = made.beyond_range
        assert re.match(r"the variance p00 is -0.0195 in step 8, below 0, in float64, too", text)
        assert "the model makes the covariance indefinite; write the model" in text
        assert "boresight.kalman" in text and "Joseph's form, or limit it by ops.maximum" in text


def test_a_variance_that_float64_keeps_above_0_wants_a_wider_word() -> None:
    class Hand(Estimator):
        inputs = (Input("u", 0.0, 1.0),)
        states = (State("p00", 0.0, 1.0, initial=0.5),)
        outputs = (Output("y", tolerance=0.1),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            gain = x.p00 / (x.p00 + 1e-6)
            return {"p00": x.p00 - gain * x.p00 + u.u}, {"y": x.p00}

    (text,) = judge(Hand(), [0.1, 0.0, 0.03], 20).beyond_range
    assert "below 0, in float64 never below 1e-06: rounding makes" in text
    assert "; choose formats by boresight fit, or use a wider word, or write the model" in text
    assert judge(Hand(), [0.1, 0.0, 0.03], 24).good


def test_coefficients_that_have_names_of_variances_may_be_negative() -> None:
    class Surface(Estimator):
        inputs = (Input("u", -1.0, 1.0),)
        states = tuple(State(name, -4.0, 4.0) for name in ("p00", "p10", "p11"))
        outputs = (Output("y", tolerance=1e-3),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {"p00": 0.9 * x.p00 - 0.2, "p10": x.p10, "p11": x.p11}, {"y": x.p00}

    assert judge(Surface(), [0.0] * 20).good


@pytest.mark.parametrize(("word", "share"), [(18, "0"), (20, "0"), (32, "2.1")])
def test_a_divisor_near_its_floor_is_told_also_where_it_is_rounded_to_0(
    word: int, share: str
) -> None:
    class Divided(Estimator):
        inputs = (Input("u", -200.0, 200.0),)
        outputs = (Output("y", tolerance=1e3),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            size = ops.maximum(u.u, 0.0) + 1e-4
            return {}, {"y": ops.saturated(1.0 / size, 1024.0)}

    told = judge(Divided(), [100.0, 0.0, 50.0], word).near_floor
    assert f"is only {share} times the smallest" in told
