"""Linear filters: what their samples add up to is proven, and no less."""

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.algebra.low_pass import LowPass, filtered
from boresight.model.algebra.quaternion import matrix
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.sim.ranges.claims import claims_of
from boresight.sim.ranges.ranges import examine
from boresight.sim.ranges.vectors import Vectors

FILTER = LowPass(0.5, 0.05)
MOST = FILTER.largest


class Filtered(Estimator):
    """A low-pass that begins as a mean, and goes on; ``wrong`` changes one thing."""

    name = "filtered"
    inputs = (Input("a", -1.0, 1.0), Input("b", -1.0, 1.0))
    states = (
        State("z", -MOST[1], MOST[1]),
        State("v", -MOST[2], MOST[2]),
        State("count", 0.0, 64.0),
    )
    outputs = (Output("y"),)
    wrong = ""
    share = 1.0  #: of the bounds that are claimed.

    def step(self, x, u, p):
        w = self.wrong
        new, missing = u.b > 0.9, u.b < -0.9
        begun = 1.0 / (x.count + (2.0 if w == "share" else 1.0))
        weights = FILTER.weights(x.count < FILTER.mean_samples - 0.5, begun)
        sample = 1.1 * u.a if w == "sample" else u.a
        held = missing if w != "held" else u.b < -0.8
        (y,), (after,) = filtered(weights, FILTER, [(x.z, x.v)], [sample], self.share, hold=held)
        one = ops.where(missing, 0.0, 1.0)
        count = ops.saturated(x.count + one, 8.0 if w == "counter" else 64.0)
        back = 3.0 if w == "back" else 0.0
        gain = 1.1 if w == "gain" else 1.0
        return {"z": gain * after[0], "v": after[1], "count": ops.where(new, back, count)}, {"y": y}


def proven(estimator):
    """Claims about the filter, each with whether it is proven."""
    program, nodes = estimator.compile_traced()
    vectors = Vectors(program, nodes)
    wanted = ("low-pass", "range of the state z", "range of the state v")
    return [
        vectors.proof_of(c) is not None
        for c in claims_of(program, nodes)
        if c.reason.startswith(wanted)
    ]


def test_a_low_pass():
    assert all(proven(Filtered())) and len(proven(Filtered())) == 3
    result = examine(Filtered(), updates=20_000)
    assert {c.status for c in result.claims} == {"proven"}
    assert {s.status for s in result.states} == {"invariant"}
    assert max(c.share for c in result.claims if c.value == "low-pass") > 0.95


@pytest.mark.parametrize("wrong", ["share", "sample", "held", "counter", "back", "gain"])
def test_wrong_by_a_bit(wrong):
    """A mean whose first sample has half a share; samples beyond one; a counter that counts
    missing samples, stays below its limit or returns to 3; a state that grows.
    """
    estimator = Filtered()
    estimator.wrong = wrong
    assert not any(proven(estimator))


def test_no_less_than_samples_add_up_to():
    narrow = Filtered()
    narrow.share = 0.998
    assert not any(proven(narrow)[:3])  # those of the states are wider


class Rows(Estimator):
    """A row of a rotation, low-passed component by component: it is no longer than one is."""

    name = "rows"
    inputs = tuple(Input(n, -1.0, 1.0) for n in ("w", "x", "y", "z", "p", "q", "r"))
    states = (
        *(State(f"z{k}", -MOST[1], MOST[1]) for k in range(3)),
        *(State(f"v{k}", -MOST[2], MOST[2]) for k in range(3)),
        State("count", 0.0, 64.0),
    )
    outputs = (Output("y"),)
    other = FILTER

    def step(self, x, u, p):
        q = [u.w, u.x, u.y, u.z]
        inverse = ops.rsqrt(sum((c * c for c in q[1:]), q[0] * q[0]) + 0.01)
        row = matrix([c * inverse for c in q])[0]
        begun = ops.bounded(1.0 / (x.count + 1.0), 0.0, 1.0, "1/n")
        ys, after = [], []
        for k, f in enumerate((FILTER, FILTER, self.other)):
            weights = f.weights(x.count < FILTER.mean_samples - 0.5, begun)
            before = getattr(x, f"z{k}"), getattr(x, f"v{k}")
            (y,), (state,) = filtered(weights, FILTER, [before], [row[k]], 1.0)
            ys.append(y)
            after.append(state)
        weighed = ys[0] * u.p + ys[1] * u.q + ys[2] * u.r
        most = MOST[0] * 3.0**0.5
        return {
            **{f"z{k}": s[0] for k, s in enumerate(after)},
            **{f"v{k}": s[1] for k, s in enumerate(after)},
            "count": ops.saturated(x.count + 1.0, 64.0),
        }, {"y": ops.bounded(weighed, -most, most, "along another")}


class Unlike(Rows):
    other = LowPass(0.5, 0.049)


def test_a_vector_filtered_component_by_component():
    def squared(estimator):
        program, nodes = estimator.compile_traced()
        vectors = Vectors(program, nodes)
        ys = [
            n
            for n in vectors.nodes.values()
            if n.kind == "bounded" and (n.low, n.high) == (-MOST[0], MOST[0])
        ]
        assert len(ys) == 3
        return vectors.square_of(ys)[0]

    assert squared(Rows()) <= MOST[0] ** 2 < squared(Unlike())
    # Samples of the signs of the impulse response reach the sum of its magnitudes.
    b, a1, a2 = FILTER.coefficients
    z = v = 0.0
    response = []
    for n in range(400):
        x = float(n == 0)
        y = z + b * x
        z, v = v - (1.0 + a1) * y + 3.0 * b * x, v + 4.0 * b * (x - y)
        response.append(y)
    assert squared(Rows()) >= np.abs(response).sum() ** 2
