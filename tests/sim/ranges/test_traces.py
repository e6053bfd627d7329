"""Turned covariances of which only the trace is limited: true ones, and wrong by a bit."""

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.algebra import quaternion_filter
from boresight.model.algebra.covariance import NO_COVARIANCE
from boresight.model.algebra.quaternion import increment, matrix, multiply, right_matrix
from boresight.model.algebra.quaternion_filter import P0_MOST
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.model.resolve import estimator_of
from boresight.sim.ranges import inner_products, measurements
from boresight.sim.ranges.claims import claims_of
from boresight.sim.ranges.coefficients import Coefficient
from boresight.sim.ranges.gram import Gram
from boresight.sim.ranges.norms import Norms
from boresight.sim.ranges.traces import Traces
from boresight.sim.ranges.vectors import Vectors


class Turned(Estimator):
    """Turned in a plane, with noise below a trace of 1/2, and measured along the first axis.

    ``wrong`` changes one thing.
    """

    name = "turned"
    inputs = (Input("a", -1.0, 1.0), Input("b", -1.0, 1.0))
    params = (Param("q", 0.01, 0.0, 0.04), Param("r", 0.02, 0.01, 0.25))
    states = (
        State("p00", 0.0, 1.0, initial=0.3),
        State("p01", -1.0, 1.0),
        State("p11", 0.0, 1.0, initial=0.25),
    )
    outputs = (Output("y"),)
    wrong = ""
    part = 0.59  #: bound of a part of the turned covariance.

    def step(self, x, u, p):
        w = self.wrong
        root = ops.rsqrt(u.a * u.a + u.b * u.b + 0.01)
        c, s = (ops.bounded(v * root, -1.0, 1.0, "unit") for v in (u.a, u.b))
        other = c if w != "matrix" else 1.25 * c
        m = [[c, -s], [s, other]]
        full = x.p00 + x.p11 >= 0.5
        q = p.q if w == "growth" else ops.where(full, 0.0, p.q)
        q = 8.0 * q if w == "noise" else q
        before = [[x.p00, x.p01], [x.p01, x.p11]]
        part = [
            [
                ops.bounded(row[0] * m[0][j] + row[1] * m[1][j], -self.part, self.part, "part")
                for j in (0, 1)
            ]
            for row in before
        ]
        a = {
            (i, j): ops.bounded(
                m[0][i] * part[0][j] + m[1][i] * part[1][j] + (q if i == j else 0.0),
                0.0 if i == j else -1.0,
                1.0,
                "turned",
            )
            for i, j in ((0, 0), (0, 1), (1, 1))
        }
        root = ops.rsqrt(ops.bounded(a[0, 0] + p.r, 0.0, 1.25, "P + r"))
        gain = [ops.bounded(v * root, -1.0, 1.0, "gain") for v in (a[0, 0], a[0, 1])]
        after = {f"p{i}{j}": a[i, j] - gain[i] * gain[j] for i, j in a}
        return after, {"y": gain[0]}


def traces_of(estimator):
    program, nodes = estimator.compile_traced()
    vectors = Vectors(program, nodes)
    gram = Gram(estimator, program, nodes, vectors)
    assert gram.proven
    return Traces(gram, Norms(vectors)), claims_of(program, nodes), gram


def test_the_trace_of_a_turned_covariance():
    """It begins as 0.55, and reaches 0.58 by noise."""
    traces, claims, gram = traces_of(Turned())
    assert traces.limits == {(0, 1): pytest.approx(0.58)}
    unproven = {c.reason for c in claims if traces.proof_of(c) is None}
    assert unproven == {"unit"}
    assert all(gram.proof_of(c) is None for c in claims if c.reason in ("part", "turned"))


@pytest.mark.parametrize("wrong", ["matrix", "growth", "noise"])
def test_wrong_by_a_bit(wrong):
    """A matrix that is no rotation; growth without a limit; and noise beyond it."""
    estimator = Turned()
    estimator.wrong = wrong
    traces, claims, _ = traces_of(estimator)
    assert traces.limits == {} and not any(map(traces.proof_of, claims))


def test_a_part_is_no_smaller_than_it_can_be():
    """P of rank one and the largest trace, turned not at all."""
    estimator = Turned()
    estimator.part = 0.57
    traces, claims, _ = traces_of(estimator)
    parts = [c for c in claims if c.reason == "part"]
    assert len(parts) == 4 and not any(map(traces.proof_of, parts))


class Apart(Turned):
    """The same, and a variance that is not turned; with a trace of all three.

    A gain is taken twice along one direction, which is not within the length.
    """

    name = "apart"
    states = (
        *Turned.states,
        State("p02", -1.0, 1.0),
        State("p12", -1.0, 1.0),
        State("p22", 0.0, 1.0),
    )
    inputs = (*Turned.inputs, Input("c", 0.0, 1.0))

    def step(self, x, u, p):
        root = ops.rsqrt(u.a * u.a + u.b * u.b + 0.01)
        c, s = (ops.bounded(v * root, -1.0, 1.0, "unit") for v in (u.a, u.b))
        m = [[c, -s], [s, c]]
        total = x.p00 + x.p11 + (0.0 if self.wrong == "condition" else x.p22)
        full = total >= 0.5
        before = [[x.p00, x.p01], [x.p01, x.p11]]
        part = [[row[0] * m[0][j] + row[1] * m[1][j] for j in (0, 1)] for row in before]
        a = {
            (i, j): m[0][i] * part[0][j] + m[1][i] * part[1][j] for i, j in ((0, 0), (0, 1), (1, 1))
        }
        a[0, 2], a[1, 2] = (m[0][i] * x.p02 + m[1][i] * x.p12 for i in (0, 1))
        a[2, 2] = x.p22
        for i in range(3):
            a[i, i] = a[i, i] + ops.where(full, 0.0, p.q)
        a = {
            ij: ops.bounded(v, 0.0 if ij[0] == ij[1] else -1.0, 1.0, "turned")
            for ij, v in a.items()
        }
        row = [[a[min(i, j), max(i, j)] for j in range(3)] for i in range(3)]
        root = ops.rsqrt(ops.bounded(a[0, 0] + p.r, 0.0, 1.25, "P + r"))
        first = [ops.bounded(v * root, -1.0, 1.0, "gain") for v in row[0]]
        left = [v - first[1] * f for v, f in zip(row[1], first, strict=True)]
        left = left if self.wrong != "twice" else row[0]
        root = ops.rsqrt(
            ops.bounded(left[1 if self.wrong != "twice" else 0] + p.r, 0.0, 1.25, "P + r")
        )
        second = [ops.bounded(v * root, -1.0, 1.0, "gain") for v in left]
        taken = [
            ops.bounded(f * f + g * g, 0.0, 0.63, "taken")
            for f, g in zip(first, second, strict=True)
        ]
        after = {f"p{i}{j}": a[i, j] - first[i] * first[j] - second[i] * second[j] for i, j in a}
        if self.wrong == "twice":
            after = {f"p{i}{j}": a[i, j] - first[i] * first[j] for i, j in a}
        return after, {"y": taken[0] + taken[1]}


def test_noise_is_left_out_where_another_vector_has_none_of_it(monkeypatch):
    traces, _, gram = traces_of(Turned())
    noisy = next(v for v in gram.space.vectors if v.noise)
    plain = noisy.parts[0][1]
    other = next(v for v in gram.space.vectors if v.variance is not None)
    assert traces._without_noise(noisy, other) is plain
    assert traces._without_noise(noisy, noisy) is noisy
    along = gram.space.add(noisy.at / noisy.length[:, None], measured=noisy)
    # What a measurement along it leaves has a part of its noise.
    left = gram.space.remainder(noisy, along)
    assert traces._without_noise(left, other) is left
    alone = gram.space.add(other.at / other.length[:, None], measured=other)
    left = gram.space.remainder(noisy, alone)
    monkeypatch.setattr(inner_products, "_VECTORS", 0)
    assert traces._without_noise(left, other) is left  # no room for another vector
    monkeypatch.undo()
    assert traces._without_noise(left, other) is gram.space.remainder(plain, alone)


def test_a_gain_is_compared_with_what_it_stands_for():
    """Along what is measured it is the inner product, along the vector without noise it is not."""
    _, _, gram = traces_of(Turned())
    root, (alike, unit) = next(iter(gram.pairs.units.items()))
    gain = next(
        n for n in gram.nodes.values() if n.kind == "mul" and root in [a.number for a in n.args]
    )
    column = next(a for a in gain.args if a.number != root)
    plain = alike[1]
    false = gram.space.add(plain.at / plain.length[:, None], measured=plain)
    for along, found in ((false, False), (unit, True)):
        pair = measurements.gain(gram.pairs, gain, column, alike, along)
        assert (pair is not None) == found


def test_the_trace_of_blocks():
    """One is turned and the other not: what limits all of them together is kept."""
    traces, claims, _ = traces_of(Apart())
    assert traces.limits == {(0, 1, 2): pytest.approx(0.62)}
    assert {c.reason for c in claims if traces.proof_of(c) is None} == {"unit"}


def test_a_condition_without_one_variance():
    estimator = Apart()
    estimator.wrong = "condition"
    traces, _, _ = traces_of(estimator)
    assert traces.limits == {}


def test_parts_along_one_direction_are_not_within_the_length():
    """Of (x . u)^2 + (x . u)^2 nothing is said."""
    estimator = Apart()
    estimator.wrong = "twice"
    traces, claims, _ = traces_of(estimator)
    assert traces.limits
    assert not any(traces.proof_of(c) for c in claims if c.reason == "taken")


class Corrected(Estimator):
    """A quaternion that is turned by another one and set to length one; ``limit`` of its square."""

    name = "corrected"
    inputs = tuple(Input(name, -1.0, 1.0) for name in "abc")
    states = (State("qw", -1.0, 1.0, initial=1.0), *(State(f"q{n}", -1.0, 1.0) for n in "xyz"))
    outputs = (Output("y"),)
    limit = 4.0
    power = 2

    def step(self, x, u, p):
        k = [1.0, *(ops.saturated(v, 1.0) for v in (u.a, u.b, u.c))]
        raw = multiply(k, (x.qw, x.qx, x.qy, x.qz))
        square = ops.saturated(sum((v * v for v in raw), 0.0), self.limit)
        shrink = ops.bounded(ops.rsqrt(square), 0.0, 1.0, "norm of one and more")
        root = shrink * shrink if self.power == 2 else shrink
        root = ops.bounded(root, 0.0, 1.0, "root")
        c = [ops.bounded(v * root, -1.0, 1.0, "c") for v in k]
        after = {f"q{n}": ops.saturated(v * shrink, 1.0) for n, v in zip("wxyz", raw, strict=True)}
        other = (x.qw, u.a, u.b, u.c)
        inverse = ops.rsqrt(sum((v * v for v in other), 0.01))
        rows = matrix([ops.bounded(v * inverse, -1.0, 1.0, "unit") for v in other])
        return after, {"y": sum((v for row in (c, *rows) for v in row), 0.0)}


def norms_of(estimator):
    program, nodes = estimator.compile_traced()
    norms = Norms(Vectors(program, nodes))
    by = {}
    for node in norms.nodes.values():
        if node.kind == "bounded":
            by.setdefault(node.source.removeprefix("declared: "), []).append(node)
    return norms, by


def entries(rows):
    return [[Coefficient(nodes=(node,)) for node in row] for row in rows]


@pytest.mark.parametrize(
    ("limit", "power", "square"), [(4.0, 2, 1.0), (4.0, 1, 1.0), (1.0, 1, 4.0), (1.0, 2, 4.0)]
)
def test_what_a_correction_is_at_most(limit, power, square):
    """|k|^2 of up to 4: |k r|^2 is one or less, if the square of the length is not limited."""
    estimator = Corrected()
    estimator.limit, estimator.power = limit, power
    norms, by = norms_of(estimator)
    c = by["c"]
    row, _ = norms.square_of(entries([c]))
    assert row == pytest.approx(square)
    signed = right_matrix([Signed(n) for n in c])
    whole, _ = norms.square_of([[v.coefficient for v in row] for row in signed])
    assert whole == pytest.approx(square)
    (one, other), _ = entries([c[:2], c[:2]])  # their matrix is longer than they are
    assert norms.square_of([[one, other], [one, other]])[1] is None


def test_a_correction_of_a_short_quaternion():
    """It makes a covariance larger."""
    estimator = Corrected()
    estimator.states = (State("qw", -1.0, 1.0, initial=0.5), *estimator.states[1:])
    norms, by = norms_of(estimator)
    assert norms.square_of(entries([by["c"]]))[0] == pytest.approx(4.0)


class Signed:
    """A node with a sign."""

    def __init__(self, node, sign=1.0):
        self.node, self.coefficient = node, Coefficient(sign, (node,))

    def __neg__(self):
        return Signed(self.node, -self.coefficient.number)


def test_the_norm_of_a_rotation_matrix():
    """Of a quaternion of length one it is one; transposed, or a part, too; not if it is changed."""
    norms, by = norms_of(Corrected())
    numbers = by["rotation matrix"]
    rows = [numbers[k : k + 3] for k in (0, 3, 6)]
    for matrix_of in (rows, [*zip(*rows, strict=True)]):
        square, ball = norms.square_of(entries(matrix_of))
        assert ball is not None and square == pytest.approx(1.0)
    for some in (rows[:2], rows[1:], [rows[2], rows[0]], [*zip(*rows, strict=True)][::2]):
        square, ball = norms.square_of(entries(some))
        assert ball is not None and square == pytest.approx(1.0)
    assert norms.square_of(entries([rows[0], rows[0]]))[1] is None
    rows[0] = [rows[0][0], rows[0][2], rows[0][1]]
    assert norms.square_of(entries(rows))[1] is None
    assert norms.square_of(entries(rows[:2]))[1] is None


def test_the_limits_of_a_rotation_matrix_hold():
    """Its norm for quaternions that are not of length one, by the same formula."""
    rng = np.random.default_rng(1)
    for q in rng.normal(size=(200, 4)):
        w, *v = q
        c = np.array([[float(e) for e in row] for row in matrix(list(q), unit=False)])
        x = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
        c = np.eye(3) + 2.0 * w * x + 2.0 * x @ x
        whole, part = float(q @ q), float(np.dot(v, v))
        most = max(1.0, 1.0 + 4.0 * (whole - 1.0) * part)
        assert np.linalg.norm(c, 2) ** 2 == pytest.approx(most)


@pytest.mark.parametrize(
    ("name", "limits"),
    [
        ("satcom", {(0, 1, 2): 0.75, (3, 4, 5): 0.75}),
        ("ekf_quaternion", {(0, 1, 2, 3): 4.0 * P0_MOST}),
        ("ekf_bias", {(0, 1, 2, 3): 4.0 * P0_MOST, (4, 5, 6): 0.75}),
    ],
)
def test_all_that_is_claimed_of_shipped_covariances(name, limits):
    """Traces are what P0 may be at most, and every claim about P follows."""
    traces, claims, gram = traces_of(estimator_of(name))
    assert traces.limits == pytest.approx(limits)
    of_p = [c for c in claims if c.unless == NO_COVARIANCE]
    assert len(of_p) > 60
    assert all(traces.proof_of(c) or gram.proof_of(c) for c in of_p)


def test_a_turn_that_may_be_longer_than_one(monkeypatch):
    """By the series of the sine P grows in every large turn."""
    monkeypatch.setattr(quaternion_filter, "increment", lambda half, short: increment(half))
    traces, *_ = traces_of(estimator_of("ekf_quaternion"))
    assert traces.limits == {}


def test_the_trace_of_a_series_that_is_no_longer_than_one():
    """The landing system's attitude is turned by such a one, and by what a correction leaves."""
    traces, claims, gram = traces_of(estimator_of("mls_attitude"))
    assert traces.limits == {(0, 1, 2): pytest.approx(0.75)}
    sums = [c for c in claims if c.reason == "P + R"]
    assert len(sums) == 6
    assert all(gram.proof_of(c) or traces.proof_of(c) for c in sums)
