"""Quaternions of turns and of corrections that are no longer than one, and some that are."""

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.algebra.quaternion import dot, matrix
from boresight.model.estimator import Estimator, Input, Output
from boresight.sim.ranges.claims import claims_of
from boresight.sim.ranges.radial import radial, radial_balls
from boresight.sim.ranges.steps import live_nodes
from boresight.sim.ranges.vectors import Vectors


class Turn(Estimator):
    """The rotation matrix of a turn by two terms and three of the series of its quaternion."""

    name = "turn"
    inputs = tuple(Input(name, -1.0, 1.0) for name in "abc")
    outputs = (Output("y"),)
    last = 1.0 / 144.0  #: of the sine; 1/120 is that of its series.
    scale = 1.0  #: of one component.

    def step(self, x, u, p):
        half = (u.a, u.b, u.c)
        y = ops.bounded(dot(half, half), 0.0, 3.0, "squares")
        w = ops.bounded(1.0 - 0.5 * y + (1.0 / 24.0) * (y * y), -1.0, 1.0, "cosine")
        s = ops.bounded(1.0 - (1.0 / 6.0) * y + self.last * (y * y), 0.0, 1.0, "sine")
        v = [ops.bounded(s * h, -1.0, 1.0, "axis") for h in half]
        v[0] = ops.bounded(self.scale * v[0], -1.0, 1.0, "axis") if self.scale != 1.0 else v[0]
        return {}, {"y": sum((c for row in matrix([w, *v]) for c in row), 0.0)}


class Correction(Estimator):
    """(1, v)/|(1, v)|^2 by a series of y = |v|^2, up to a limit of y."""

    name = "correction"
    outputs = (Output("square"),)

    def __init__(self, most=0.5, limit=0.5):
        self.inputs = tuple(Input(name, -most, most) for name in "abc")
        self.limit = limit

    def step(self, x, u, p):
        v = (u.a, u.b, u.c)
        y = ops.saturated(dot(v, v), self.limit)
        inverse = ops.bounded(1.0 - y + y * y, 0.0, 1.0, "inverse")
        c = [inverse, *(ops.bounded(h * inverse, -1.0, 1.0, "part") for h in v)]
        return {}, {"square": ops.bounded(dot(c, c), 0.0, 1.0, "no longer than one")}


def vectors_of(estimator):
    program, nodes = estimator.compile_traced()
    return Vectors(program, nodes), claims_of(program, nodes), live_nodes(program, nodes)


def test_a_rotation_matrix_of_a_short_quaternion():
    vectors, claims, _ = vectors_of(Turn())
    rows = [c for c in claims if c.reason.startswith("rotation matrix")]
    assert len(rows) == 9 and all(map(vectors.proof_of, rows))


@pytest.mark.parametrize(("name", "value"), [("last", 1.0 / 120.0), ("scale", 1.0 + 2.0**-9)])
def test_wrong_by_a_bit(name, value):
    estimator = Turn()
    setattr(estimator, name, value)
    vectors, claims, _ = vectors_of(estimator)
    rows = [c for c in claims if c.reason.startswith("rotation matrix")]
    assert any(vectors.proof_of(c) is None for c in rows)


@pytest.mark.parametrize("last", [1.0 / 144.0, 1.0 / 120.0])
def test_its_length_is_the_largest(last):
    estimator = Turn()
    estimator.last = last
    _, _, nodes = vectors_of(estimator)
    (ball,) = radial_balls(nodes)
    y = np.linspace(0.0, 3.0, 20001)
    square = (1.0 - y / 2 + y * y / 24) ** 2 + y * (1.0 - y / 6 + last * y * y) ** 2
    assert len(ball.numbers) == 4 and ball.square == pytest.approx(square.max(), abs=1e-9)


@pytest.mark.parametrize(
    ("most", "limit", "short"), [(0.5, 0.5, True), (0.51, 0.5, False), (0.5, 1.0, False)]
)
def test_a_length_with_a_limit(most, limit, short):
    """Up to the limit y is |v|^2; beyond it the inverse stays, and the length grows with |v|."""
    vectors, claims, nodes = vectors_of(Correction(most, limit))
    (claim,) = [c for c in claims if c.reason.startswith("no longer")]
    assert (vectors.proof_of(claim) is not None) == short
    v_sq = np.linspace(0.0, 3.0 * most**2, 20001)
    y = np.minimum(v_sq, limit)
    square = ((1.0 - y + y * y) ** 2 * (1.0 + v_sq)).max()
    assert (square <= 1.0) == short
    if short:
        ball = min(radial_balls(nodes), key=lambda ball: ball.square)
        assert len(ball.numbers) == 4 and ball.square == pytest.approx(square, abs=1e-9)


def test_polynomials_of_a_squared_length():
    a, b = (1, 1), (2, 2)
    found = radial({(): 1.0, a: -2.0, b: -2.0, a + a: 1.0, a + b: 2.0, b + b: 1.0})
    assert found is not None and found.numbers == [1, 2]  # (1 - r)^2
    assert found.ends(3.0) == pytest.approx((0.0, 4.0), abs=1e-12)
    assert radial({a: 1.0, b: 1.0 + 1e-9}) is None and radial({a: 1.0}) is None
