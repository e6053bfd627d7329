"""Vectors turned by the matrix of a quaternion, and by matrices that are wrong by a bit."""

import math
from collections import Counter

import pytest

from boresight.model import ops
from boresight.model.algebra import quaternion
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.model.kalman.attitude import corrected
from boresight.sim.ranges.claims import claims_of
from boresight.sim.ranges.vectors import Vectors


class Turned(Estimator):
    """A vector of two parts, each component up to 3, turned, and of it two components, scaled."""

    name = "turned"
    inputs = tuple(
        Input(n + a, -m, m) for n, m in (("e", 0.1), ("v", 2.0), ("b", 1.0)) for a in "xyz"
    )
    states = tuple(State("q" + c, -1.0, 1.0, "", float(c == "w")) for c in "wxyz")
    outputs = (Output("first"), Output("second"))
    wrong = ""
    limit = 3.0 * math.sqrt(3.0)
    back = False

    def step(self, x, u, p):
        q = [x.qw, x.qx, x.qy, x.qz]
        v = [u.vx - u.bx, u.vy - u.by, u.vz - u.bz]
        c = quaternion.matrix(q)
        if self.wrong == "sign":
            c[0][1] = ops.bounded(2.0 * q[1] * q[2] + 2.0 * q[0] * q[3], -1.0, 1.0, "wrong")
        if self.wrong == "factor":
            c[1][1] = ops.bounded(1.0 - 2.0 * q[1] * q[1] - q[3] * q[3], -1.0, 1.0, "wrong")
        turned = quaternion.conjugate_turn(c, v) if self.back else quaternion.turn(c, v)
        if self.wrong == "other":
            turned[1] = turned[1] + u.vx
        if self.wrong == "twice":
            turned[1] = turned[0]
        e = [u.ex, u.ey, u.ez]
        if self.wrong == "long":
            after = [ops.saturated(a + b, 1.0) for a, b in zip(q, [0.0, *e], strict=True)]
        else:
            after = corrected(q, e)
        bounded = [
            ops.bounded(by * n, -self.limit, self.limit, "length")
            for by, n in zip((1.0, -0.5), turned, strict=False)
        ]
        states = {"q" + c: n for c, n in zip("wxyz", after, strict=True)}
        return states, {"first": bounded[0], "second": bounded[1]}


def squares(estimator):
    """Largest squared length of both components together, and of each alone."""
    program, nodes = estimator.compile_traced()
    vectors = Vectors(program, nodes)
    said = [c.node for c in claims_of(program, nodes) if c.reason == "length"]
    assert len(said) == 2
    return [vectors.square_of(each)[0] for each in (said, said[:1], said[1:])]


@pytest.mark.parametrize("back", [False, True])
def test_a_rotation_lengthens_no_vector(back):
    estimator = Turned()
    estimator.back = back
    assert squares(estimator) == pytest.approx([27.0, 27.0, 6.75])


@pytest.mark.parametrize("wrong", ["sign", "factor", "other", "twice", "long"])
def test_what_is_no_rotation(wrong):
    estimator = Turned()
    estimator.wrong = wrong
    assert squares(estimator)[0] > 27.1


class Felt(Estimator):
    """A vector of known strength at an angle, in axes that are turned, and parts of the matrix.

    ``wrong``: the other component is that of another angle, or the elements are of two rows and
    columns.
    """

    name = "felt"
    inputs = (
        Input("strength", 0.0, 1.5),
        *(Input(n, -1.0, 1.0, "ht") for n in ("dip", "other")),
        *(Input(n, -0.1, 0.1) for n in "xyz"),
    )
    states = Turned.states
    outputs = tuple(Output(n) for n in "abc")
    wrong = ""
    most = 1.5

    def step(self, x, u, p):
        q = [x.qw, x.qx, x.qy, x.qz]
        c = quaternion.matrix(q)
        sine, cosine = ops.sincos_ht(u.dip)
        if self.wrong == "angle":
            _, cosine = ops.sincos_ht(u.other)
        v = [u.strength * cosine, 0.0, -(u.strength * sine)]
        r = [ops.bounded(k, -self.most, self.most, "felt") for k in quaternion.conjugate_turn(c, v)]
        a, b = (c[0][0], c[1][1]) if self.wrong == "elements" else (c[2][1], c[2][2])
        square = ops.bounded(a * a + b * b, 0.0, 1.0, "square")
        after = zip("wxyz", corrected(q, [u.x, u.y, u.z]), strict=True)
        outputs = {"a": r[0] + square, "b": r[1], "c": r[2]}
        return {"q" + n: value for n, value in after}, outputs


@pytest.mark.parametrize(
    ("wrong", "most", "unproven"),
    [
        ("", 1.5, {}),
        ("", 1.49, {"felt": 3}),
        ("angle", 1.5, {"felt": 3}),
        ("elements", 1.5, {"square": 1}),
    ],
)
def test_a_vector_of_known_strength(wrong, most, unproven):
    """Sine and cosine of one angle are a vector of length one; of two angles they are not."""
    estimator = Felt()
    estimator.wrong, estimator.most = wrong, most
    program, nodes = estimator.compile_traced()
    vectors = Vectors(program, nodes)
    said = [c for c in claims_of(program, nodes) if c.reason in ("felt", "square")]
    assert len(said) == 4
    assert Counter(c.reason for c in said if vectors.proof_of(c) is None) == unproven
