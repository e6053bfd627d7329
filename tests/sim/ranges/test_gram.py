"""Covariances of which several measurements share one pass: true ones, and wrong by a bit."""

import math
from dataclasses import replace

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.model.kalman import Kalman, Measurement
from boresight.model.kalman import State as Estimated
from boresight.model.resolve import estimator_of
from boresight.sim.accuracy.covariance import covariance_of
from boresight.sim.ranges.boxes import proof_of, reached_cells
from boresight.sim.ranges.claims import claims_of
from boresight.sim.ranges.covariances import RandomCovariances
from boresight.sim.ranges.gram import Gram
from boresight.sim.ranges.norms import Norms
from boresight.sim.ranges.ranges import examine
from boresight.sim.ranges.search import Search
from boresight.sim.ranges.traces import Traces
from boresight.sim.ranges.vectors import Vectors


class Joint(Estimator):
    """Predicted, then measured along a row and along the first axis, at once; the latter if valid.

    ``wrong`` changes one thing. No claim says more than that P is a covariance.
    """

    name = "joint"
    inputs = (Input("dt", 0.0, 0.1), Input("h", -1.0, 1.0), Input("valid", 0.0, 1.0))
    params = (Param("q", 0.01, 0.0, 0.04), Param("r", 0.02, 0.01, 1.0))
    states = (
        State("p00", 0.0, 1.0, initial=0.1),
        State("p01", -1.0, 1.0),
        State("p11", 0.0, 1.0, initial=0.2),
    )
    outputs = (Output("y"),)
    wrong = ""
    gain = 1.0  #: bound of a gain's share.

    def step(self, x, u, p):
        w = self.wrong
        full = (x.p00 > 0.75) | (x.p11 > 0.75)
        step = ops.where(full, 0.0, u.dt)
        q = ops.where(full, 0.0, p.q)
        sheared = x.p01 + step * x.p11
        across = ops.saturated(sheared, 0.5 if w == "limit" else 2.0)
        a00 = x.p00 + step * x.p01 + step * across + q
        if w == "prediction":
            a00 = x.p00 + step * x.p01 - step * across + q
        a01 = across + (0.5 * q if w == "noise" else 0.0)
        a11 = x.p11 + q
        a = [
            [ops.bounded(c, low, 2.0, "P") for c, low in row]
            for row in ([(a00, 0.0), (a01, -2.0)], [(a01, -2.0), (a11, 0.0)])
        ]

        column = [ops.bounded(a[k][0] + u.h * a[k][1], -4.0, 4.0, "P h") for k in (0, 1)]
        s = ops.bounded(column[0] + u.h * column[1] + p.r, 0.01, 9.0, "h P h + r")
        first = [ops.bounded(c * ops.rsqrt(s), -1.5, 1.5, "gain") for c in column]
        reduced = [a[k][0] - first[0] * first[k] for k in (0, 1)]
        if w == "second":
            reduced = [a[k][0] for k in (0, 1)]
        noise = -0.005 if w == "variance" else p.r
        if w in ("falling", "held"):
            noise = 0.05 - u.dt
            noise = ops.maximum(noise, 0.005) if w == "held" else noise
        s = ops.bounded(reduced[0] + noise, 0.004, 9.0, "P + r")
        second = [ops.bounded(c * ops.rsqrt(s), -1.5, 1.5, "gain") for c in reduced]
        valid = u.valid > 0.5

        def left(i, j):
            taken = first[i] * first[j]
            if not (w == "side" and i != j):
                taken = taken + ops.where(valid, second[i] * second[j], 0.0)
            value = a[i][j] - (-taken if w == "gain" else taken)
            return ops.bounded(value, 0.0 if i == j else -2.0, 2.0, "covariance")

        share = ops.bounded(first[1], -self.gain, self.gain, "share")
        return {"p00": left(0, 0), "p01": left(0, 1), "p11": left(1, 1)}, {"y": share}


def gram_of(estimator):
    program, nodes = estimator.compile_traced()
    return Gram(estimator, program, nodes), claims_of(program, nodes)


def test_two_measurements_in_one_pass():
    gram, claims = gram_of(Joint())
    assert gram.proven
    unproven = {c.state or c.reason for c in claims if gram.proof_of(c) is None}
    assert unproven == set()


def test_a_noise_that_is_held_above_0():
    """The condition excludes the side of a negative one; see "falling" for the same without it."""
    estimator = Joint()
    estimator.wrong = "held"
    gram, claims = gram_of(estimator)
    assert gram.proven and all(map(gram.proof_of, claims))


@pytest.mark.parametrize(
    "wrong", ["limit", "prediction", "noise", "second", "variance", "side", "gain", "falling"]
)
def test_wrong_by_a_bit(wrong):
    estimator = Joint()
    estimator.wrong = wrong
    gram, claims = gram_of(estimator)
    assert not gram.proven and not any(map(gram.proof_of, claims))


def test_a_length_is_no_shorter_than_it_can_be():
    """A gain comes to sqrt(P_ii), of a variance of 1 that grows no more."""
    for gain, proven in ((1.0, True), (0.99, False)):
        estimator = Joint()
        estimator.gain = gain
        gram, claims = gram_of(estimator)
        (claim,) = [c for c in claims if c.reason == "share"]
        assert (gram.proof_of(claim) is not None) == proven


class Pushed(Joint):
    """One input moves both states; the first is measured, with the variance r + (b a_01)^2."""

    inputs = (Input("b", 0.0, 0.5), Input("c", -0.5, 0.5))
    sign = 1.0

    def step(self, x, u, p):
        full = (x.p00 > 0.75) | (x.p11 > 0.75)
        q = ops.where(full, 0.0, p.q)
        share = {"more": 1.01, "less": -1.01}.get(self.wrong, self.sign)
        one, other = u.b, u.b if self.wrong == "other" else u.c
        a00, a01 = x.p00 + u.b * u.b * q, x.p01 + share * (one * other * q)
        a11 = x.p11 + u.c * u.c * q
        bent = u.b * a01
        bent = bent * (u.b * a00 if self.wrong == "product" else bent)
        noise = p.r - bent if self.wrong == "square" else p.r + bent
        weight = ops.rsqrt(ops.bounded(a00 + noise, 0.002, 4.0, "P + r"))
        gain = [ops.bounded(a * weight, -1.5, 1.5, "gain") for a in (a00, a01)]
        after = {"p00": a00 - gain[0] * gain[0], "p01": a01 - gain[0] * gain[1]}
        after["p11"] = a11 - gain[1] * gain[1]
        return {n: ops.bounded(a, -1.0, 1.0, "covariance") for n, a in after.items()}, {"y": q}


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_one_noise_of_two_states(sign):
    estimator = Pushed()
    estimator.sign = sign
    gram, claims = gram_of(estimator)
    said = [c for c in claims if c.reason in ("P + r", "gain")]
    assert gram.proven and len(said) == 3 and all(map(gram.proof_of, said))


@pytest.mark.parametrize("wrong", ["more", "less", "other", "product", "square"])
def test_noise_that_is_no_covariance(wrong):
    """Of a correlation of 1.01, or of another input; or a variance that may become negative."""
    estimator = Pushed()
    estimator.wrong = wrong
    gram, claims = gram_of(estimator)
    assert not gram.proven and not any(map(gram.proof_of, claims))


class Weighted(Joint):
    """P - k c c^T, k = w / (1 + w h P h), c = P h: a measurement of variance 1 / w, or none."""

    inputs = (Input("h", -1.0, 1.0), Input("w", 0.0, 1.0))
    params = ()

    def step(self, x, u, p):
        wrong = self.wrong
        column = [a + u.h * b for a, b in ((x.p00, x.p01), (x.p01, x.p11))]
        along = column[0] + u.h * column[1]
        weight = u.w - 0.25 if wrong == "sign" else u.w
        total = 1.0 + (0.5 if wrong == "half" else 1.0) * (weight * along)
        share = weight / ops.bounded(total, 0.5, 8.0, "S")
        share = 1.5 * share if wrong == "more" else share
        gain = [share * c for c in column]
        a00, a01, a11 = (
            a - gain[i] * column[j] for a, i, j in ((x.p00, 0, 0), (x.p01, 0, 1), (x.p11, 1, 1))
        )
        return {"p00": a00, "p01": a01, "p11": a11}, {"y": gain[0]}


def test_a_measurement_by_its_weight():
    for wrong in ("", "sign", "half", "more"):
        estimator = Weighted()
        estimator.wrong = wrong
        gram, claims = gram_of(estimator)
        assert gram.proven == (wrong == ""), wrong
        assert [c.state or c.reason for c in claims if gram.proof_of(c)] == (
            ["S", "p00", "p01", "p11"] if gram.proven else []
        )


class Coupled(Estimator):
    """An angle t and a bias b of short memory: P_tt is predicted by P_tt - 2 a P_tb, a^2 P_bb more.

    The states are symmetric. A gap in the samples ends the angle's covariance, a long one that of
    the bias, too; nothing grows beyond a trace. ``wrong`` changes one thing.
    """

    name = "coupled"
    inputs = (Input("dt", -0.5, 0.5), Input("a", 0.0, 0.05), Input("w", 0.0, 1.0))
    params = (Param("k", 0.1, 0.0, 0.5), Param("r", 0.01, 0.001, 0.02))
    states = (
        State("ptt", -1.0, 1.0, initial=0.1),
        State("ptb", -1.0, 1.0),
        State("pbb", -1.0, 1.0, initial=0.2),
    )
    outputs = (Output("y"), Output("s"))
    wrong = ""
    most = 1.0

    def step(self, x, u, p):
        w = self.wrong
        gap = u.dt < (-0.3 if w == "gap" else -0.2)
        long_gap = u.dt < -0.25
        a = ops.where(x.ptt + x.pbb > 0.8, 0.0, u.a)
        keep = 1.0 - p.k
        kept = keep * keep
        walk = 0.75 * p.k
        pbb = ops.where(long_gap, 0.1, x.pbb * (keep if w == "square" else kept) + walk)
        pbb = ops.bounded(pbb, -1.0, self.most, "variance")
        ptb = ops.where(gap, 0.0, x.ptb * keep - a * pbb)
        ptb = ops.bounded(ptb, -1.0, 1.0, "covariance")
        twice = 2.1 if w == "twice" else 2.0
        ptt = ops.where(gap, 0.2, x.ptt - twice * a * ptb)
        ptt = ops.bounded(ptt, -1.0, 1.0, "variance")
        total = ops.bounded(u.w * x.ptt + p.r, 0.001, 1.1, "at least r")
        return {"ptt": ptt, "ptb": ptb, "pbb": pbb}, {"y": 1.0 / total, "s": total}


@pytest.mark.parametrize(("most", "unproven"), [(1.0, []), (0.99, [0.99])])
def test_a_prediction_that_leaves_out_the_smallest_term(most, unproven):
    """P_bb of 1 keeps (1 - k)^2 of it and gets 0.75 k: it is no less than 1 without any k."""
    estimator = Coupled()
    estimator.most = most
    gram, claims = gram_of(estimator)
    assert gram.proven
    assert [c.high for c in claims if not gram.proof_of(c)] == unproven


@pytest.mark.parametrize("wrong", ["gap", "square", "twice"])
def test_a_coupling_that_is_no_covariance(wrong):
    """Restarts at levels that do not exclude each other, another decay, more than what is left."""
    estimator = Coupled()
    estimator.wrong = wrong
    gram, claims = gram_of(estimator)
    assert not gram.proven and not any(map(gram.proof_of, claims))


class Derived(Kalman):
    """Position and velocity, each measured by the author's model."""

    name = "derived"
    inputs = (Input("z", -8.0, 8.0, "m"), Input("v", -4.0, 4.0, "m/s"))
    params = (Param("q", 0.01, 0.0, 0.02), Param("r", 0.1, 0.05, 1.0))
    states = (
        Estimated("pos", -8.0, 8.0, "m", sd=1.0, sd_max=2.0),
        Estimated("vel", -4.0, 4.0, "m/s", sd=0.5, sd_max=1.0),
    )
    gate = None

    def f(self, x, u, p):
        return {"pos": x.pos + 0.1 * x.vel}

    def noise(self, x, u, p):
        return {"vel": p.q}

    def measure(self, x, u, p):
        return [
            Measurement(u.z, x.pos, p.r, valid=u.z > -7.0, gate=self.gate),
            Measurement(u.v, x.vel + 0.25 * x.pos, p.r),
        ]


@pytest.mark.parametrize("gate", [None, 3.0])
def test_what_a_builder_claims(gate):
    estimator = Derived()
    estimator.gate = gate
    gram, claims = gram_of(estimator)
    of_states = ("range of the state", "range of the state pos")
    of_p = [c for c in claims if c.reason not in of_states and c.state != "vel"]
    assert gram.proven and all(map(gram.proof_of, of_p)) and len(of_p) > 8
    result = examine(estimator, updates=4000)
    assert result.good


class Quick(Kalman):
    """A position that one prediction takes beyond its largest standard deviation."""

    name = "quick"
    inputs = (Input("z", -8.0, 8.0), Input("new", 0.0, 1.0))
    params = (Param("r", 0.1, 0.05, 1.0),)
    states = (
        Estimated("pos", -8.0, 8.0, sd=1.0, sd_max=2.4),
        Estimated("vel", -8.0, 8.0, sd=8.0, sd_max=8.0),
    )
    dt = 0.08

    def f(self, x, u, p):
        return {"pos": x.pos + self.dt * x.vel}

    def measure(self, x, u, p):
        return [Measurement(u.z, x.pos, p.r, valid=u.new > 0.5)]


@pytest.mark.parametrize(("dt", "largest"), [(0.08, 7.39), (0.1, 5.76)])
def test_a_variance_beyond_its_largest(dt, largest):
    """(sqrt(0.75) 2.4 + 8 dt)^2: 7.39 m^2 fits a word that holds up to 8 m^2, 8.28 m^2 does not."""
    estimator = Quick()
    estimator.dt = dt
    program, nodes = estimator.compile_traced()
    gram = Gram(estimator, program, nodes)
    (variance,) = [n for n in nodes.values() if n.kind == "state" and n.name == "p_pos_pos"]
    assert gram.lengths.largest[variance.number] == pytest.approx(largest, rel=1e-3)
    claims = claims_of(program, nodes)
    proofs = {c.state: gram.proof_of(c) for c in claims if c.state.startswith("p_")}
    assert proofs["p_pos_pos"] is None and proofs["p_vel_vel"] is not None
    most = (math.sqrt(4.32) + 8.0 * dt) ** 2
    (grown,) = [c for c in claims if c.high == pytest.approx(most, rel=1e-3)]
    assert (variance in gram.proof_of(grown).base) == (dt == 0.1)
    result = examine(estimator, updates=4000)
    statuses = [c.status for c in result.claims if not c.value.startswith("range of the state")]
    assert (statuses == 5 * ["proven"]) == (dt == 0.08) and "refuted" not in statuses


def test_what_is_proven_of_a_shipped_filter():
    """All but that the predicted currents stay in their ranges."""
    result = examine(estimator_of("pmsm"), updates=4000)
    unproven = [c.value.split(",")[0] for c in result.claims if c.status != "proven"]
    assert unproven == 2 * ["range of the state"] and len(result.claims) == 27


def farthest(estimator, program, nodes, claims):
    """What searches reach, and whether they break a claim; all states are in their ranges.

    One is from resets on, others are from random covariances.
    """
    ends = [
        [program.format(n).quantise(end) for end in (program.values[n].low, program.values[n].high)]
        for n, _ in program.states
    ]
    low, high = (np.array(each)[:, None] for each in zip(*ends, strict=True))

    def within(draw):
        return lambda rng, states: draw(rng, np.clip(states, low, high))

    draws = [lambda rng, states: states]
    try:
        covariance = covariance_of(estimator)
        draws += [
            RandomCovariances(covariance, program, limit_sum=each).states for each in (False, True)
        ]
    except InputError:
        pass
    searches = []
    for draw in draws:
        searches.append(Search(estimator, program, nodes, claims, drawn_states=within(draw)))
        searches[-1].run(32)
    reached = np.max([np.maximum(-s.low, s.high) for s in searches], axis=0)
    return reached, np.any([s.violations for s in searches], axis=0)


@pytest.mark.parametrize("name", ["pmsm", "battery", "mekf"])
def test_no_method_proves_a_claim_that_a_search_breaks(name):
    """Each claim with its range a little less than what is reached."""
    estimator = estimator_of(name)
    program, nodes = estimator.compile_traced()
    claims = claims_of(program, nodes)
    reached, broken = farthest(estimator, program, nodes, claims)
    cells = reached_cells(program, nodes)
    vectors = Vectors(program, nodes)
    gram = Gram(estimator, program, nodes, vectors)
    methods = [
        lambda claim: proof_of(claim, cells),
        vectors.proof_of,
        gram.proof_of,
        Traces(gram, Norms(vectors)).proof_of,
    ]
    tried = 0
    for claim, most, left in zip(claims, reached, broken, strict=True):
        if left or not np.isfinite(most) or most <= 1e-3 * claim.size:
            continue
        end = (1.0 - 2.0**-10) * most
        false = replace(claim, low=max(claim.low, -end), high=min(claim.high, end))
        tried += 1
        assert not any(method(false) for method in methods), str(claim)
    assert tried > 10, tried


class Leaning(Estimator):
    """A covariance, sheared by a state that leaves its range, but not its word, up to one."""

    name = "leaning"
    inputs = (Input("a", -1.0, 1.0),)
    states = (
        State("lean", -0.6, 0.6),
        State("p00", 0.0, 2.0, initial=2.0),
        State("p01", -2.0, 2.0, initial=2.0),
        State("p11", 0.0, 2.0, initial=2.0),
    )
    outputs = (Output("y"),)
    most = 8.2

    def step(self, x, u, p):
        lean = ops.bounded(x.lean + u.a, -0.6, 0.6, "lean", unless="it is pushed")
        along = x.p01 + x.lean * x.p11
        sheared = ops.bounded(x.p00 + x.lean * x.p01 + x.lean * along, 0.0, self.most, "sheared")
        return {"lean": lean, "p00": x.p00, "p01": x.p01, "p11": x.p11}, {"y": sheared}


def test_a_state_beyond_its_range_is_as_wide_as_its_word():
    """(1 + lean)^2 times 2: up to 8 where the word of the lean ends, 5.12 where its range does."""
    for most, proven in ((8.2, True), (5.3, False)):
        estimator = Leaning()
        estimator.most = most
        result = examine(estimator, updates=4000)
        sheared = next(c for c in result.claims if c.value == "sheared")
        assert result.states[0].status == "excepted"
        if proven:
            assert sheared.status in ("proven", "tight") and not sheared.conditions
        else:
            assert sheared.status == "refuted" and sheared.conditions[0].startswith(
                "range of the state lean"
            )


class Fused(Leaning):
    """Besides, a product that is part of a sum and leaves the word that it has as an output."""

    name = "fused"
    outputs = (Output("y"), Output("product"), Output("z"))

    def step(self, x, u, p):
        states, out = super().step(x, u, p)
        pushed = ops.bounded(4.0 * u.a, -2.4, 2.4, "pushed", unless="it is")
        product = pushed * (1.6 * u.a)
        total = ops.bounded(product + u.a, -5.2, 5.2, "sum")
        return states, {**out, "product": product, "z": total}


def test_a_product_without_a_word_may_be_any_number_beside_a_covariance():
    sheared, pushed, total = examine(Fused(), updates=4000).claims
    assert sheared.status in ("proven", "tight") and not sheared.conditions
    assert pushed.status == "excepted"
    assert [c.partition(" (")[0] for c in total.conditions] == ["pushed"]
