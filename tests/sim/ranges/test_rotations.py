"""Vectors turned by the matrix of a quaternion, and by matrices that are wrong by a bit."""

import math

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
