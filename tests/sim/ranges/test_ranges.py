"""Claims of ranges: proofs, what they assume, false claims refuted by inputs that break them."""

from dataclasses import replace

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.algebra.quaternion import dot, matrix, product
from boresight.model.attitude.mekf.filter import Mekf
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.model.resolve import estimator_of
from boresight.sim.ranges import ranges
from boresight.sim.ranges.boxes import proof_of, reached_cells
from boresight.sim.ranges.claims import Assumptions, claims_of
from boresight.sim.ranges.coefficients import Coefficient, conditions_in, sources_of
from boresight.sim.ranges.gram import Gram
from boresight.sim.ranges.ranges import examine
from boresight.sim.ranges.vectors import Vectors


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
    """A state that only its saturation holds, one that a selection holds, a mean, a mean of it.

    The last one is in its range since the mean, from 0 on, comes nowhere near the ends of its own.
    """

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


def test_a_claim_with_an_exception_changes_no_bit_and_is_shown_where_it_is_broken():
    def twice(unless):
        return claiming(
            lambda x, u, p: ops.bounded(4.0 * u.a, -1.5, 1.5, "half", unless=unless) - u.a,
            -2.5,
            2.5,
        )

    said, silent = twice("a is large"), twice("")
    assert said.compile().digest == silent.compile().digest
    result = examine(said, updates=4000)
    half, outer = result.claims
    assert half.status == "excepted" and max(map(abs, half.witness.inputs["a"][-1:])) > 0.375
    assert result.good and not examine(silent, updates=4000).good
    assert outer.status == "conditional" and outer.conditions[0].startswith("half (")
    assert "excepted" in str(result) and "half, unless a is large" in str(result)
    assert result.counts["claims"]["excepted"] == 1 and result.proven == 0.0


def test_an_exception_that_nothing_needs_is_no_exception():
    sure = claiming(lambda x, u, p: ops.bounded(u.a, -1.5, 1.5, "a", unless="never"), -2.0, 2.0)
    assert {c.status for c in examine(sure, updates=4000).claims} == {"proven"}


# Those that take few seconds; mekf below, with more updates.
@pytest.mark.parametrize(
    "name", ["complementary", "ekf_quaternion", "battery", "pmsm", "satcom_pointing"]
)
def test_no_claim_of_a_shipped_estimator_is_refuted(name):
    result = examine(estimator_of(name), updates=4000)
    assert [str(c) for c in (*result.claims, *result.states) if c.status == "refuted"] == []


def test_states_and_a_witness_from_a_reset_on():
    result = examine(Integral(), updates=60_000)
    assert [s.status for s in result.states] == ["left", "invariant", "invariant", "invariant"]
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
    assert claim.status == "checked" and claim.how.startswith("random covariances")
    assert examine(Wrong(), updates=4000).claims[-1].status not in ("checked", "proven")
    assert examine(TooNarrow(), updates=4000).claims[-1].status not in ("checked", "proven")


class Shorter(Covariances):
    """The next matrix holds the one variance, a little smaller; or half of it."""

    share = 0.9

    def step(self, x, u, p):
        states, out = super().step(x, u, p)
        return {"p00": self.share * out["y"], "p01": 0.0 * x.p01, "p11": 0.0 * x.p11}, out


class Half(Shorter):
    share = 0.5


def test_a_check_is_no_proof():
    result = examine(Shorter(), updates=4000)
    assert result.states[0].status == "checked" and result.claims[-1].status == "checked"
    assert "1 claim: 1 checked on covariances" in str(result)
    assert result.proven == 0.0 and result.to_json()["counts"]["claims"]["checked"] == 1
    state = examine(Half(), updates=4000).states[0]  # half of [0, 2], if that is right
    assert state.status == "conditional" and state.conditions[0].startswith("a variance (")


class Resting(Estimator):
    """Claims that follow from others: a false one, a proven one, a state that leaves its range."""

    name = "resting"
    inputs = (Input("a", -1.0, 1.0),)
    states = (State("far", -3.0, 3.0), State("held", -4.0, 4.0))
    outputs = tuple(Output(name) for name in ("first", "second", "third", "boxed", "sure", "far"))

    def step(self, x, u, p):
        false = ops.bounded(4.0 * u.a, -1.5, 1.5, "false")
        first = ops.bounded(false - u.a, -2.5, 2.5, "first")
        held = ops.clip(x.held + u.a, -4.0, 4.0)
        return {"far": x.far + u.a, "held": held}, {
            "first": first,
            "second": ops.bounded(first + x.held, -6.5, 6.5, "second"),
            "third": ops.bounded(
                3.0 * ops.bounded(2.0 * u.a, -2.0, 2.0, "true"), -6.0, 6.0, "sure"
            ),
            "boxed": ops.bounded(false * (2.0 - false), -5.25, 1.0, "boxed"),
            "sure": ops.bounded(x.held + u.a, -5.0, 5.0, "held"),
            "far": ops.bounded(x.far + u.a, -4.0, 4.0, "from a state"),
        }


def test_what_a_proof_assumes_is_said():
    result = examine(Resting(), updates=20_000)
    claims = {c.value: c for c in result.claims}
    false = f"false ({claims['false'].line})"
    assert claims["false"].status == "refuted"
    # The second follows from the first, and thus from what the first follows from.
    for name in ("first", "second"):
        assert claims[name].status == "conditional" and claims[name].conditions == (false,)
        assert f"interval, if {false}" in str(claims[name])
    assert claims["boxed"].status == "refuted" and claims["boxed"].conditions == (false,)
    assert claims["boxed"].how.startswith("would hold (")
    assert [claims[name].status for name in ("true", "sure", "held")] == ["proven"] * 3
    assert claims["true"].conditions == claims["sure"].conditions == claims["held"].conditions == ()
    (condition,) = claims["from a state"].conditions
    assert condition.startswith("range of the state far (")
    assert result.proven == 3 / 8 and result.counts["claims"]["proven"] == 3


class Turned(Estimator):
    """A false claim about a next state, of the range of the state."""

    name = "turned"
    inputs = (Input("a", -1.0, 1.0, "ht"),)
    states = (State("angle", -0.5, 0.5, "ht"),)
    outputs = (Output("y"),)

    def step(self, x, u, p):
        angle = ops.bounded(0.5 * x.angle + u.a, -0.5, 0.5, "false")
        return {"angle": angle}, {"y": x.angle}


class Divided(Estimator):
    """A vector over its length, whose square a claim holds too small, for some vectors."""

    name = "divided"
    inputs = tuple(Input(n, -1.0, 1.0) for n in "abc")
    outputs = tuple(Output(n) for n in "xy")
    most = 2.0

    def step(self, x, u, p):
        square = ops.bounded(
            u.a * u.a + u.b * u.b + u.c * u.c + 0.01, 0.0, self.most, "square", unless="it is long"
        )
        parts = [ops.bounded(c * ops.rsqrt(square), -1.0, 1.0, "component") for c in (u.a, u.b)]
        return {}, dict(zip("xy", parts, strict=True))


class Saturating(Divided):
    """The word of [0, 0.9] ends below 3, that of [0, 2] does not."""

    most = 0.9


def test_a_word_that_holds_all_there_is_needs_no_claim():
    square, component, _ = examine(Divided(), updates=4000).claims
    assert (square.status, component.status, component.conditions) == ("excepted", "proven", ())
    square, component, _ = examine(Saturating(), updates=4000).claims
    assert square.status == "excepted" and component.status in ("conditional", "tight")
    assert component.conditions[0].startswith("square (")


def test_a_false_claim_about_a_next_state_is_refuted():
    result = examine(Turned(), updates=4000)
    assert not result.good and result.states[0].status == "refuted" and not result.claims
    assert abs(result.states[0].witness.inputs["a"][-1]) > 0.25


def test_mekf():
    """Exact figures: claims proven or tight; of the states 21 elements of P invariant, and 5."""
    result = examine(Mekf(), updates=20_000)
    claims = {"proven": 40, "conditional": 0, "checked": 0, "tight": 3, "open": 0}
    states = {"invariant": 26, "conditional": 0, "checked": 0, "observed": 3, "left": 1}
    none = {"excepted": 0, "refuted": 0}
    assert result.good
    assert result.counts == {"claims": claims | none, "states": states | none}


class Turning(Estimator):
    """A unit quaternion, which an update turns, and a vector turned by it."""

    name = "turning"
    inputs = (
        *(Input(f"r{a}", -1.0, 1.0) for a in "xyz"),
        *(Input(f"v{a}", -3.0, 3.0) for a in "xyz"),
    )
    states = tuple(State(f"q{a}", -1.0, 1.0, initial=float(a == "w")) for a in "wxyz")
    outputs = (Output("level"), Output("length"))
    unit = True
    most = 5.2  # of a vector of three components up to 3

    def step(self, x, u, p):
        q = [x.qw, x.qx, x.qy, x.qz]
        turned = [ops.saturated(c, 2.0) for c in product(q, [1.0, u.rx, u.ry, u.rz])]
        length = ops.bounded(dot(turned, turned), 0.0, 4.0, "the product of two")
        norm = ops.rsqrt(length) if self.unit else 0.8
        q = [ops.saturated(c * norm, 1.0) for c in turned]
        row = matrix(q)[0]
        level = ops.bounded(dot(row, [u.vx, u.vy, u.vz]), -self.most, self.most, "turned")
        return dict(zip(("qw", "qx", "qy", "qz"), q, strict=True)), {
            "level": level,
            "length": length,
        }


class Stretched(Turning):
    """Not of unit length: nothing of it is true."""

    unit = False


class Shortened(Turning):
    most = 5.0


def test_a_vector_of_unit_length():
    def status(estimator):
        program, nodes = estimator.compile_traced()
        vectors = Vectors(program, nodes)
        return {c.reason: vectors.proof_of(c) for c in claims_of(program, nodes) if not c.state}

    whole = status(Turning())
    assert all(whole.values()) and {"rotation matrix", "the product of two", "turned"} == {*whole}
    assert not any(status(Stretched()).values())
    short = status(Shortened())
    assert short["turned"] is None and short["rotation matrix"]


class Filter(Covariances):
    """Predicted by a velocity, measured by a row, held below a trace: textbook, or wrong by a bit.

    ``wrong`` changes one thing: the sign of the gain's share, the noise, the prediction, or what
    the inverse is of.
    """

    name = "filter"
    inputs = (Input("dt", 0.0, 0.1), Input("h", -1.0, 1.0))
    wrong = ""

    def step(self, x, u, p):
        w = self.wrong
        column = (x.p00 + u.h * x.p01, x.p01 + u.h * x.p11)
        total = column[0] + (0.1 if w == "inverse" else u.h) * column[1] + 0.01
        share = 1.0 / ops.bounded(total, 0.01, 4.01, "h P h + r")
        gain = [ops.bounded(c * share, -5.0, 5.0, "sqrt(P_ii / 4 r)") for c in column]
        sign = -1.0 if w == "gain" else 1.0
        q00 = x.p00 - sign * gain[0] * column[0]
        q01 = x.p01 - gain[0] * column[1]
        q11 = x.p11 - gain[1] * column[1]
        step = ops.where(x.p00 + x.p11 > 0.8, 0.0, u.dt)
        twice = 1.0 if w == "prediction" else 2.0
        after = {
            "p00": q00 + twice * step * q01 + step * step * q11,
            "p01": q01 + step * q11 + (0.5 * step if w == "noise" else 0.0),
            "p11": q11 + 0.01 * step,
        }
        high = {"p00": 1.0, "p01": 1.0, "p11": 1.0}
        states = {
            n: ops.bounded(v, -1.0 if n == "p01" else 0.0, high[n], "covariance")
            for n, v in after.items()
        }
        return states, {"y": gain[0]}


def test_a_matrix_that_stays_a_covariance():
    def proofs(wrong):
        estimator = Filter()
        estimator.wrong = wrong
        program, nodes = estimator.compile_traced()
        gram = Gram(estimator, program, nodes)
        claims = claims_of(program, nodes)
        return gram.proven, {c.state or c.reason: gram.proof_of(c) for c in claims}

    proven, found = proofs("")
    assert proven and all(found.values())
    for wrong in ("inverse", "gain", "noise", "prediction"):
        proven, found = proofs(wrong)
        assert not proven and not any(found.values()), wrong


class Counting(Estimator):
    """Whose turn it is, and on top the time since: never between 0.35 and 1."""

    name = "counting"
    inputs = (Input("dt", 0.0, 0.1, "s"),)
    states = (State("turn", 0.0, 2.0),)
    outputs = (Output("since"),)
    due = 0.2

    def step(self, x, u, p):
        second = ops.where(x.turn < 1.0, 0.0, 1.0)
        since = ops.bounded(x.turn - second + u.dt, 0.0, 0.35, "one and the longest step")
        turn = ops.where(since >= self.due, 1.0 - second, x.turn + u.dt)
        return {"turn": turn}, {"since": since}


class Late(Counting):
    due = 0.3


def test_a_state_that_reaches_parts_of_its_range():
    for estimator, proven in ((Counting(), True), (Late(), False)):
        program, nodes = estimator.compile_traced()
        (claim,) = [c for c in claims_of(program, nodes) if not c.state]
        assert proof_of(claim) is None
        assert (proof_of(claim, reached_cells(program, nodes)) is not None) == proven


def test_a_step_without_claims_has_conditions_of_its_own():
    """Its nodes have the numbers of those that rest on claims."""
    estimator = claiming(lambda x, u, p: ops.bounded(2.0 * u.a, -1.5, 1.5, "half") - u.a, -2.5, 2.5)
    program, nodes = estimator.compile_traced()
    claims = claims_of(program, nodes)
    outer = claims[-1].node
    free = [replace(a, kind="input", args=()) if a.kind == "bounded" else a for a in outer.args]
    without = replace(outer, args=tuple(free))
    needs = ranges._needs_of({})
    assumptions = Assumptions(claims, [False, False], [False, False], needs)
    for node, wanted in ((outer, [0]), (without, []), (outer, [0])):
        assert assumptions.of([None, [node]], [(), ()], {}) == [[], wanted]


def test_what_the_ends_of_a_side_follow_from():
    """On one side a limited selection is as small as a claim makes it, though it rests on none."""
    chosen = claiming(
        lambda x, u, p: ops.saturated(
            ops.where(u.a < 0.0, 64.0 * u.b, ops.bounded(u.b, -0.5, 0.5, "small")), 4.0
        ),
        -4.0,
        4.0,
    )
    program, nodes = chosen.compile_traced()
    small, outer = claims_of(program, nodes)
    (condition,) = conditions_in(outer.node)
    ends = Coefficient(nodes=(outer.node,)).ends({condition: 2})
    assert ends == (-0.5, 0.5)
    assert small.node in [n.args[0] for n in sources_of(outer.node) if n.kind == "bounded"]


def test_ends_rest_on_a_claim_or_on_what_it_is_of():
    """On the second only where that is well inside the claim."""
    for claimed, own in ((2.0001, True), (3.0, False)):
        total = claiming(lambda x, u, p: u.a + ops.bounded(u.b, -1.0, 1.0, "b"), -claimed, claimed)
        _, nodes = total.compile_traced()
        (outer,) = (n for n in nodes.values() if n.kind == "bounded" and n.high == claimed)
        assert [*sources_of(outer)] == ([outer] if own else [outer.args[0]])
