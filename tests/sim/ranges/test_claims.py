"""Claims of ranges: proofs, the search, and what `check` says about them."""

import re
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.model.resolve import estimator_of
from boresight.sim.compare.check import Check
from boresight.sim.compare.twin import Traced
from boresight.sim.fit.fitting import fitted
from boresight.sim.levels.build import Build
from boresight.sim.ranges.claims import examine
from boresight.sim.records.record import Record


def claiming(function: Any, low: float, high: float, unless: str = "") -> Estimator:
    """An estimator that claims that ``function(x, u, p)`` is in a range."""

    class Claiming(Estimator):
        name = "claiming"
        inputs = (Input("a", -1, 1), Input("b", -1, 1))
        outputs = (Output("y", tolerance=1e-4),)

        def step(self, x: Any, u: Any, p: Any) -> Any:
            return {}, {"y": ops.bounded(function(x, u, p), low, high, "so it is", unless=unless)}

    return Claiming()


def examined(estimator: Estimator, **options: Any) -> Any:
    return examine(Traced(estimator, *estimator.compile_traced()), **options)


def checked(estimator: Estimator, **columns: Any) -> Any:
    (result,) = Check(Build(estimator), levels=("c",)).run(Record.of(columns))
    return result


def twice_the_angle(x: Any, u: Any, p: Any) -> Any:
    sine, cosine = ops.sincos_ht(u.a)
    return 2.0 * sine * cosine


def mean(x: Any, u: Any, p: Any) -> Any:
    share = ops.maximum(u.b, 0.0)
    return (1.0 - share) * u.a + share * 0.5


@pytest.mark.parametrize(
    ("function", "low", "high"),
    [
        pytest.param(lambda x, u, p: u.a * u.b, -1, 1, id="interval"),
        pytest.param(lambda x, u, p: u.a - 0.5 * u.a, -0.5, 0.5, id="same_value_twice"),
        pytest.param(twice_the_angle, -1, 1, id="sine"),
        pytest.param(mean, -1, 1, id="mean"),
        pytest.param(lambda x, u, p: ops.clip(3.0 * u.a, -0.3, 0.4), -0.3, 0.4, id="clip"),
        pytest.param(lambda x, u, p: ops.wrap_ht(3.0 * u.a), -1, 1, id="wrap"),
        pytest.param(lambda x, u, p: ops.clip(1.0 / (2.0 + u.a), 0.0, 1.0), 0.3, 1, id="quotient"),
    ],
)
def test_a_true_claim_is_proven_and_a_narrower_one_broken(
    function: Any, low: float, high: float
) -> None:
    *_, claim = examined(claiming(function, low, high))
    assert claim.proven and claim.witness is None
    middle = 0.5 * (low + high)
    narrow = claiming(function, *(middle + 0.95 * (end - middle) for end in (low, high)))
    *_, claim = examined(narrow)
    assert not claim.proven and claim.witness is not None


class Drifting(Estimator):
    """A slow mean of 0.7 a, four times; the claim about it is false."""

    inputs = (Input("a", -1, 1),)
    params = (Param("gain", 0.5, 0, 1),)
    states = (State("s", -2, 2),)
    outputs = (Output("y", tolerance=1e-3),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        y = ops.bounded(4.0 * x.s, -0.5, 0.5, "four times a mean")
        return {"s": x.s + 0.02 * p.gain * (0.7 * u.a - x.s)}, {"y": y}


def test_a_witness_is_a_run_from_a_reset_that_breaks_the_claim() -> None:
    claim, state = examined(Drifting(), updates=200)
    assert claim.witness is not None and state.proven
    s, gain = 0.0, claim.witness.params.get("gain", 0.5)
    *before, _ = claim.witness.inputs["a"]
    for a in before:
        s += 0.02 * gain * (0.7 * a - s)
    assert abs(4.0 * s) > 0.5


def decimal(estimator: type[Estimator]) -> Estimator:
    """The same with declarations in decimals."""
    own = estimator()
    own.inputs = (Input("a", -1.0, 1.0),)  # type: ignore[misc]
    own.states = (State("s", -2.0, 2.0),)  # type: ignore[misc]
    return own


class Slow(Estimator):
    """So slow that no search gets anywhere near the claim's end."""

    inputs = (Input("a", -1, 1),)
    states = (State("s", -2, 2),)
    outputs = (Output("y", tolerance=1e-3),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        y = ops.bounded(4.0 * x.s, -0.5, 0.5, "false: 2.8 after some time constants")
        return {"s": x.s + 1e-4 * (0.7 * u.a - x.s)}, {"y": y}


def test_whole_numbers_and_decimals_give_the_same_result() -> None:
    whole, other = (examined(e) for e in (Slow(), decimal(Slow)))
    assert [x.proven for x in whole] == [x.proven for x in other] == [False, True]
    assert [x.reach for x in whole] == [x.reach for x in other]
    assert examined(Slow(), updates=8)[0].reach != whole[0].reach  # though results are kept


def test_a_proof_does_not_rest_on_a_claim_that_is_not_proven() -> None:
    def twice(x: Any, u: Any, p: Any) -> Any:
        return 2.0 * ops.bounded(4.0 * u.a, -0.5, 0.5, "false")

    assert [x.proven for x in examined(claiming(twice, -1, 1))] == [False, False]


class Held(Estimator):
    """Holds the last value while frozen; it begins at 1.5, outside what is claimed of it."""

    inputs = (Input("a", -1.0, 1.0),)
    states = (State("s", -2.0, 2.0, initial=1.5),)
    outputs = (Output("y", tolerance=1e-6),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        s = ops.where(u.a > 0.99, x.s, 0.5 * u.a)
        s = ops.bounded(s, -1.0, 1.0, "half of the input")
        return {"s": s}, {"y": s}


class Integral(Estimator):
    """A state that rises with its input, one that its word holds."""

    inputs = (Input("a", -1.0, 1.0),)
    states = (State("s", -5.0, 5.0), State("held", -4.0, 4.0))
    outputs = (Output("y", tolerance=1e-6),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        s = x.s + u.a
        return {"s": s, "held": ops.clip(x.held + u.a, -4.0, 4.0)}, {"y": s}


def test_check_fails_where_the_log_breaks_a_claim_whose_word_has_room() -> None:
    quiet = claiming(lambda x, u, p: 0.99 * u.a, -0.6, 0.6)
    result = checked(quiet, a=[0.0, 0.9, 0.95, -0.9], b=np.zeros(4))
    (text,) = result.accuracy.beyond_range
    assert "0.9405 in step 2 is BEYOND the stated range [-0.6, 0.6], so it is" in text
    assert text.startswith("test_claims.py, line ") and not result.good
    assert result.accuracy.saturated_updates == 0 and result.claims[0].status == "broken"
    result = checked(Held(), a=[1.0, 0.0])
    assert not result.good and "1.5 in step 0 is BEYOND" in result.failures[0]


class Alarm(Estimator):
    """A claim with which the compiler decides a comparison, so that no word holds the value."""

    inputs = (Input("a", -1.0, 1.0), Input("b", -1.0, 1.0))
    outputs = (Output("alarm"),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        power = ops.bounded(u.a * u.b, -0.5, 0.5, "never that large")
        return {}, {"alarm": ops.where(power > 0.7, 1.0, 0.0)}


def test_check_fails_where_a_claim_that_decides_a_comparison_is_false() -> None:
    assert checked(Alarm(), a=[0.1, 0.5], b=[0.9, 0.9]).good
    result = checked(Alarm(), a=[0.1, 0.9], b=[0.9, 0.9])
    (text,) = result.failures
    assert "0.81 in float64 is BEYOND the stated range [-0.5, 0.5], never that large" in text


def test_check_fails_where_the_search_breaks_a_claim() -> None:
    quiet = claiming(lambda x, u, p: 0.99 * u.a, -0.6, 0.6)
    result = checked(quiet, a=[0.0, 0.1], b=np.zeros(2))
    assert result.accuracy.good and not result.good
    (text,) = result.failures
    assert "so it is (test_claims.py, line" in text and "BROKEN" in text and "after a reset" in text
    assert text in str(result) and result.to_json()["claims"][0]["witness"]["inputs"]["a"]


def test_a_profile_leaves_the_reason_and_is_what_to_do_again() -> None:
    quiet = claiming(lambda x, u, p: 0.5 * u.a * u.b, -4.0, 4.0)
    small = 0.01 * np.ones((20, 2)) * np.arange(20.0)[:, None] / 20.0
    quiet.profile = fitted(quiet, {"quiet": small}, stressed=False).profile
    assert checked(quiet, a=small[:, 0], b=small[:, 1]).claims[0].reason == "so it is"
    culprit = checked(quiet, a=np.ones(5), b=np.ones(5)).accuracy.culprit
    assert culprit.endswith(
        "; run boresight fit on this log, too (the range was observed in quiet)"
    )


def test_an_exception_changes_no_bit_and_withdraws_the_claim() -> None:
    said, silent = (
        claiming(lambda x, u, p: 0.99 * u.a, -0.6, 0.6, unless=u) for u in ("a is large", "")
    )
    assert said.compile().digest == silent.compile().digest
    result = checked(said, a=[0.0, 0.9], b=np.zeros(2))
    assert result.good and result.claims[0].status == "excepted"
    text = (
        r"1 exceeded in the search, as its exception allows: so it is \(test_claims\.py, line \d+\)"
    )
    assert re.search(rf"{text}, unless a is large", str(result))


def test_a_state_out_of_its_range_fails_on_the_log_and_is_told_of_the_search() -> None:
    result = checked(Integral(), a=[1.0, 0.5])
    assert result.good and [c.status for c in result.claims] == ["left", "proven"]
    assert "inputs within their ranges can take s out of its range (test_cl" in str(result)
    short = Integral()  # a word that ends where the range does: the value beyond it is told
    short.states = (State("s", -4.0, 3.999), Integral.states[1])
    claim = next(c for c in checked(short, a=[1.0, 0.5]).claims if c.state == "s")
    assert claim.status == "left" and claim.search is not None
    assert max(map(abs, claim.search)) == pytest.approx(5.0, abs=0.6)  # 4, and an input of 1
    result = checked(Integral(), a=np.ones(6))
    assert not result.good and result.claims[0].status == "broken"
    assert "state s is 6 in step 5, BEYOND its declared range [-5, 5]" in result.failures[0]


class Leaving(Estimator):
    """States that legal values take out of their ranges by more and more."""

    inputs = (Input("z", -1.0, 1.0),)
    params = (Param("r", 25.0, 1.0, 400.0),)
    states = tuple(State(name, -1.0, 1.0) for name in "abcd") + (State("p", 0.0, 128.0),)
    outputs = (Output("p", tolerance=1e-3),)

    def step(self, x: Any, u: Any, p: Any) -> Any:
        states = {name: size * u.z for name, size in zip("abcd", (1.1, 1.2, 1.3, 1.4), strict=True)}
        return states | {"p": 0.5 * x.p + 0.4 * p.r}, {"p": x.p}


def test_states_out_of_their_ranges_are_told_by_their_excess() -> None:
    (*_, first, second, third) = checked(Leaving(), z=np.zeros(3)).lines()
    assert first.startswith("  parameters within their ranges can take p out of its range")
    assert second.startswith("  inputs within their ranges can take d out of its range")
    assert third.endswith("limit c in the step; and 2 more: b, a")


@pytest.mark.parametrize(
    "name",
    [
        *("complementary", "mekf", "ekf_quaternion", "battery", "pmsm"),
        *(f"examples/{name}.py" for name in ("attitude", "biquad", "kalman", "madgwick", "pi")),
    ],
)
def test_no_claim_of_a_shipped_estimator_is_broken(name: str) -> None:
    broken = [
        x.claim.reason
        for x in examined(estimator_of(name))
        if x.witness and x.claim.bounded and not x.claim.unless
    ]
    assert broken == []
