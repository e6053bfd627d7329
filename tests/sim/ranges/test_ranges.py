"""Claims of ranges: proofs that hold, false claims refuted by inputs that break them."""

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.model.estimators.mekf.filter import Mekf
from boresight.sim.ranges.boxes import proof_of
from boresight.sim.ranges.claims import claims_of
from boresight.sim.ranges.ranges import examine


def claiming(function, low, high, **attributes):
    """An estimator that says that ``function(x, u, p)`` is in a range."""

    class Claiming(Estimator):
        name = "claiming"
        inputs = (Input("a", -1.0, 1.0), Input("b", -1.0, 1.0))
        outputs = (Output("y"),)

        def step(self, x, u, p):
            return {}, {"y": ops.bounded(function(x, u, p), low, high, "so it is")}

    for name, value in attributes.items():
        setattr(Claiming, name, value)
    return Claiming()


def twice_the_angle(x, u, p):
    sine, cosine = ops.sincos_ht(u.a)
    return 2.0 * sine * cosine


def component(x, u, p):
    return u.a * ops.rsqrt(u.a * u.a + u.b * u.b + 0.01)


def smaller_component(x, u, p):
    aa, bb = u.a * u.a, u.b * u.b
    smaller = ops.absolute(ops.where(aa < bb, u.a, u.b))
    return smaller * ops.rsqrt(aa + bb)


def mean(x, u, p):
    share = ops.maximum(u.b, 0.0)
    return (1.0 - share) * u.a + share * 0.5


@pytest.mark.parametrize(
    ("function", "low", "high"),
    [
        pytest.param(lambda x, u, p: u.a * u.b, -1.0, 1.0, id="interval"),
        pytest.param(lambda x, u, p: u.a - 0.5 * u.a, -0.5, 0.5, id="same_value_twice"),
        pytest.param(twice_the_angle, -1.0, 1.0, id="sine"),
        pytest.param(component, -1.0, 1.0, id="unit_vector"),
        pytest.param(smaller_component, 0.0, 0.7072, id="smaller_component"),
        pytest.param(mean, -1.0, 1.0, id="mean"),
        pytest.param(lambda x, u, p: ops.clip(3.0 * u.a, -0.3, 0.4), -0.3, 0.4, id="clip"),
    ],
)
def test_a_true_claim_is_proven_and_a_narrower_one_refuted(function, low, high):
    (claim,) = examine(claiming(function, low, high), updates=4000).claims[-1:]
    assert claim.status == "proven" and claim.how and claim.witness is None
    middle = 0.5 * (low + high)
    narrow = claiming(function, *(middle + 0.97 * (end - middle) for end in (low, high)))
    result = examine(narrow, updates=20_000)
    assert not result.good and result.claims[-1].status == "refuted"
    program, nodes = narrow.compile_traced()
    assert proof_of(claims_of(program, nodes)[-1]) is None


class Integral(Estimator):
    """A state that only its saturation holds, one that a selection holds, a mean, a mean of it."""

    name = "integral"
    inputs = (Input("rate", -1.0, 1.0),)
    params = (Param("gain", 0.25, 0.0, 0.5),)
    states = (
        State("free", -8.0, 8.0),
        State("held", -8.0, 8.0),
        State("mean", -4.0, 4.0),
        State("slow", -1.5, 1.5),
    )
    outputs = (Output("y"),)

    def step(self, x, u, p):
        free = x.free + u.rate
        held = ops.clip(x.held + u.rate, -8.0, 8.0)
        far = ops.bounded(free + p.gain, -7.0, 8.5, "not for long")
        mean = x.mean + p.gain * (u.rate - x.mean)
        return {"free": free, "held": held, "mean": mean, "slow": 0.9 * x.slow + 0.1 * x.mean}, {
            "y": far
        }


def test_states_and_a_witness_from_a_reset_on():
    result = examine(Integral(), updates=60_000)
    assert [s.status for s in result.states] == ["left", "invariant", "invariant", "observed"]
    assert -1.1 < result.states[3].least < -0.3 and 0.3 < result.states[3].most < 1.1
    (claim,) = [c for c in result.claims if c.value == "not for long"]
    assert claim.status == "refuted" and result.refuted == 1 and claim.least < -7.0
    rates = claim.witness.inputs["rate"]
    free = np.clip(np.cumsum(rates[:-1]), -8.0, 8.0)[-1] + rates[-1]
    gain = claim.witness.params.get("gain", 0.25)
    assert free + gain < -7.0 and claim.witness.updates >= 8
    assert "free_next" in " ".join(result.saturated)


class Covariances(Estimator):
    """Two variances and their covariance, turned: true by Cauchy-Schwarz alone."""

    name = "covariances"
    inputs = (Input("angle", -1.0, 1.0, "ht"),)
    states = (
        State("p00", 0.0, 1.0, initial=0.1),
        State("p01", -1.0, 1.0),
        State("p11", 0.0, 1.0, initial=0.2),
    )
    outputs = (Output("y"),)
    least = 0.0

    def step(self, x, u, p):
        sine, cosine = ops.sincos_ht(u.angle)
        along = cosine * cosine * x.p00 + 2.0 * sine * cosine * x.p01 + sine * sine * x.p11
        along = ops.bounded(along, self.least, 2.0, "a variance")
        return {"p00": x.p00, "p01": x.p01, "p11": x.p11}, {"y": along}


class Wrong(Covariances):
    """The next matrix is no covariance."""

    def step(self, x, u, p):
        states, out = super().step(x, u, p)
        return {**states, "p01": 0.5 - x.p01}, out


class TooNarrow(Covariances):
    """What some covariance breaks."""

    least = 0.05


def test_what_rounding_breaks_is_said_so():
    """Of a short vector few bits are left: its direction's component exceeds one."""
    result = examine(claiming(lambda x, u, p: u.a * ops.rsqrt(u.a * u.a + u.b * u.b), -1.0, 1.0))
    assert not result.good and result.claims[-1].how.startswith("holds but for rounding")


def test_a_covariance():
    claim = examine(Covariances(), updates=4000).claims[-1]
    assert claim.status == "theorem" and claim.how.startswith("Cauchy-Schwarz")
    assert examine(Wrong(), updates=4000).claims[-1].status != "theorem"
    assert examine(TooNarrow(), updates=4000).claims[-1].status != "theorem"


def test_mekf():
    """Nine of ten claims are shown, and what is refuted has inputs."""
    result = examine(Mekf(), updates=20_000)
    assert result.shown >= 0.9
    assert all(c.witness is not None for c in result.claims if c.status == "refuted")
    assert sum(c.status == "invariant" for c in result.states) >= 23
