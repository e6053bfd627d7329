"""Lengths of vectors that a step makes of others: proven, and nothing that is false by a bit."""

from dataclasses import replace

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.algebra.quaternion import cross, dot, increment, matrix, multiply, product
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.sim.ranges.claims import claims_of
from boresight.sim.ranges.ranges import Prover, examine
from boresight.sim.ranges.search import Search
from boresight.sim.ranges.vectors import Vectors

SLACK = 1e-3  #: of the bounds that are claimed.


class Beam(Estimator):
    """A direction from two angles, each turned a little, and its part along another vector.

    ``wrong`` changes one thing.
    """

    name = "beam"
    inputs = (
        *(Input(n, -9.0, 9.0) for n in ("e", "n", "u")),
        *(Input(n, -1.0, 1.0) for n in ("a", "b", "p", "q", "r")),
    )
    outputs = (Output("along"), Output("level"), Output("part"))
    wrong = ""
    most = 1.0 + SLACK

    def step(self, x, u, p):
        w = self.wrong
        level_sq = u.e * u.e + u.n * u.n + 0.01
        if w == "negative":
            level_sq = ops.bounded(9.0 * u.e, 0.0, 81.0, "false", unless="it is below 0")
        square = level_sq + u.u * u.u
        by_level, by_range = ops.rsqrt(level_sq), ops.rsqrt(square)
        sin_n, cos_n = (ops.saturated(c * by_level, 1.0) for c in (u.e, u.n))
        root = by_range if w == "root" else by_level
        level = ops.saturated(level_sq * root, 128.0 if w == "root" else 16.0)
        cos_e, sin_e = (ops.saturated(c * by_range, 1.0) for c in (level, u.u))
        angle = ops.saturated(u.a, 0.125)
        bent = 0.5 * (angle * angle)
        bent = 0.25 * (angle * angle) if w == "bent" else bent
        other = -angle if w == "sign" else angle
        turned = [sin_e - sin_e * bent - cos_e * angle, cos_e - cos_e * bent + sin_e * other]
        if w == "offset":
            turned[0] = turned[0] + 0.25 * u.b
        if w == "longer":
            turned[1] = turned[1] + 0.25 * turned[1]
        sin_t, cos_t = (ops.bounded(c, -self.most, self.most, "of a turned vector") for c in turned)
        flat = [ops.bounded(c * cos_t, -self.most, self.most, "flat") for c in (sin_n, cos_n)]
        if w == "twice":
            flat[1] = ops.bounded(cos_n * sin_t, -self.most, self.most, "flat")
        other = [c * ops.rsqrt(u.p * u.p + u.q * u.q + u.r * u.r + 0.01) for c in (u.p, u.q, u.r)]
        along = dot([*flat, sin_t], [ops.saturated(c, 1.0) for c in other])
        along = ops.bounded(along, -self.most, self.most, "along another")
        fixed = [
            ops.bounded(dot(row, [*flat, sin_t]), -2.0, 2.0, "in fixed axes")
            for row in ([0.6, 0.8, 0.0], [-0.48, 0.36, 0.8])
        ]
        other = [c * ops.rsqrt(u.p * u.p + u.q * u.q + 0.01) for c in (u.p, u.q)]
        part = dot(fixed, [ops.saturated(c, 1.0) for c in other])
        part = ops.bounded(part, -self.most, self.most, "part along another")
        return {}, {"along": along, "level": level, "part": part}


def proofs(estimator):
    """Of each claim, by reason, whether it is proven."""
    program, nodes = estimator.compile_traced()
    vectors = Vectors(program, nodes)
    return [(c.reason, vectors.proof_of(c) is not None) for c in claims_of(program, nodes)]


def unproven(estimator):
    return {reason for reason, proof in proofs(estimator) if not proof}


def test_a_direction_of_two_angles():
    assert {*proofs(Beam())} >= {("of a turned vector", True), ("flat", True)}
    assert unproven(Beam()) == set()
    result = examine(Beam(), updates=4000)
    assert {c.status for c in result.claims} == {"proven"}


@pytest.mark.parametrize(
    ("wrong", "broken"),
    [
        ("root", {"of a turned vector", "along another"}),  # x / sqrt(y) is no root
        ("negative", {"of a turned vector", "along another"}),  # it has no root
        ("longer", {"of a turned vector", "along another"}),  # one row is
        ("offset", {"of a turned vector", "along another"}),
        ("bent", {"of a turned vector", "along another"}),  # 1 + c^2/2 is longer
        ("sign", {"along another"}),  # rows are not orthogonal
        ("twice", {"along another"}),  # factors differ
    ],
)
def test_wrong_by_a_bit(wrong, broken):
    estimator = Beam()
    estimator.wrong = wrong
    assert unproven(estimator) >= broken


def test_no_length_is_proven_shorter_than_it_can_be():
    estimator = Beam()
    estimator.most = 1.0 - SLACK
    assert unproven(estimator) == {"of a turned vector", "along another", "part along another"}


class Weighed(Estimator):
    """The squares of a unit vector, all times a number below 0: from -1 up to 0."""

    name = "weighed"
    inputs = (Input("a", -9.0, 9.0), Input("b", -9.0, 9.0), Input("w", -1.0, -0.5))
    outputs = (Output("y"), Output("z"))
    most = 0.0

    def step(self, x, u, p):
        root = ops.rsqrt(u.a * u.a + u.b * u.b + 0.01)
        parts = [ops.saturated(c * root, 1.0) for c in (u.a, u.b)]
        total = u.w * dot(parts, parts)
        alone = ops.bounded(0.5 - 2.0 * (parts[0] * parts[0]), -1.75, 1.75, "alone")
        return {}, {"y": ops.bounded(total, -1.0, self.most, "weighed"), "z": alone}


def test_a_component_alone():
    """1/2 less twice a square of a component comes to -3/2."""
    program, nodes = Weighed().compile_traced()
    vectors = Vectors(program, nodes)
    (node,) = [n for n in vectors.nodes.values() if n.kind == "bounded" and n.low == -1.75]
    square, found = vectors.square_of([node])
    assert 2.25 <= square <= 2.2501 and node.number not in found.used


def test_a_factor_of_squares_may_be_negative():
    """No square is below 0, but the vector may be short."""
    narrow = Weighed()
    narrow.most = -0.25
    assert unproven(narrow) == {"weighed"}


class Lever(Estimator):
    """A unit quaternion times that of a turn, and its vector part across another vector."""

    name = "lever"
    inputs = (
        *(Input(f"r{a}", -1.0, 1.0) for a in "xyz"),
        *(Input(f"v{a}", -1.0, 1.0) for a in "xyz"),
    )
    states = tuple(State(f"q{a}", -1.0, 1.0, initial=float(a == "w")) for a in "wxyz")
    outputs = (Output("x"), Output("y"), Output("z"))
    most = 2.0**0.5 * 1.05  # of |v_yz| = sqrt(2), and a norm of at most 1.0919^(1/2)
    longer = 1.0
    free = False  #: whether a false claim holds what is turned.

    def step(self, x, u, p):
        q = [x.qw, x.qx, x.qy, x.qz]
        by = increment([u.rx, u.ry, u.rz])
        turned = [ops.saturated(c, 1.0) for c in product(q, [self.longer * by[0], *by[1:]])]
        if self.free:
            turned = [ops.bounded(c, -0.5, 0.5, "false", unless="it is long") for c in turned]
        across = [
            ops.bounded(c, -self.most, self.most, "across")
            for c in cross(turned[1:], [u.vx, u.vy, u.vz])
        ]
        norm = ops.rsqrt(ops.bounded(dot(turned, turned) + 0.01, 0.0, 1.5, "norm"))
        after = {f"q{a}": ops.saturated(c * norm, 1.0) for a, c in zip("wxyz", turned, strict=True)}
        return after, dict(zip("xyz", across, strict=True))


def test_a_product_of_quaternions():
    assert "across" not in unproven(Lever())
    for name, value in (("most", 2.0**0.5 * 0.99), ("longer", 1.25)):
        estimator = Lever()
        setattr(estimator, name, value)
        assert "across" in unproven(estimator), name


class Twice(Estimator):
    """A unit quaternion times another one and a correction; its rotation matrix, scaled."""

    name = "twice"
    inputs = (
        *(Input(f"r{a}", -1.0, 1.0) for a in "wxyz"),
        *(Input(f"k{a}", -0.5, 0.5) for a in "xyz"),
    )
    states = Lever.states
    outputs = (Output("y"),)
    most = 1.75  #: squared length of a correction.

    def step(self, x, u, p):
        r = (u.rw, u.rx, u.ry, u.rz)
        root = ops.rsqrt(0.01 + dot(r, r))
        q = product([x.qw, x.qx, x.qy, x.qz], [ops.saturated(c * root, 1.0) for c in r])
        q = [ops.saturated(c, 1.0) for c in q]
        q = [ops.saturated(c, 2.0) for c in product(q, [1.0, u.kx, u.ky, u.kz])]
        w, i, j, k = q
        y = ops.bounded(w * w + i * i - j * j - k * k, -self.most, self.most, "scaled")
        norm = ops.rsqrt(ops.bounded(dot(q, q), 0.0, 2.0, "norm"))
        after = {f"q{a}": ops.saturated(c * norm, 1.0) for a, c in zip("wxyz", q, strict=True)}
        return after, {"y": y}


@pytest.mark.parametrize(("most", "left"), [(1.75, set()), (1.7, {"scaled"})])
def test_a_product_of_a_product(most, left):
    estimator = Twice()
    estimator.most = most
    assert unproven(estimator) == left


def test_a_false_claim_of_a_component_makes_no_vector_longer():
    estimator = Lever()
    estimator.free = True
    result = examine(estimator, updates=4000)
    status = {c.value: c.status for c in result.claims}
    assert status["false, unless it is long"] == "excepted" and status["across"] == "proven"


class Reach(Estimator):
    """A distance whose square a false claim holds too short, and what is limited of it."""

    name = "reach"
    inputs = tuple(Input(n, -1.0, 1.0) for n in ("a", "b", "c"))
    outputs = (Output("y"),)
    most = 4.25  #: of the sum.

    def step(self, x, u, p):
        square = ops.bounded(
            u.a * u.a + u.b * u.b + u.c * u.c, 0.0, 2.4, "square", unless="it is far"
        )
        return {}, {"y": ops.bounded(square + u.a, -1.0, self.most, "sum")}


def test_what_holds_without_a_claim():
    """The sum of up to 3 and 1: within 4.25, whatever is said of the first; not within 3.75."""
    square, far = examine(Reach(), updates=4000).claims
    assert (square.status, far.status, far.conditions) == ("excepted", "proven", ())
    narrow = Reach()
    narrow.most = 3.75
    square, far = examine(narrow, updates=4000).claims
    assert far.status == "refuted" and far.how.startswith("would hold")


class Short(Reach):
    """The word of the square ends below 1, or holds all there is."""

    name = "short"
    outputs = (Output("y"), Output("z"))
    said, factor = 0.9, 1.0

    def step(self, x, u, p):
        square = u.a * u.a + u.b * u.b + u.c * u.c
        square = ops.bounded(square, 0.0, self.said, "square", unless="it is far")
        product = square * (self.factor * u.b)
        total = ops.bounded(product + u.a, -self.most, self.most, "sum")
        return {}, {"y": total, "z": product}


def test_what_a_word_that_is_too_short_holds():
    """0.9 and 1 are within 1.95; what the word holds, 1 and 1, within 2.1."""
    for most, proven in ((2.1, True), (1.95, False)):
        estimator = Short()
        estimator.most = most
        _, total = examine(estimator, updates=4000).claims
        assert (total.status == "proven") == proven, most


def test_a_product_that_is_part_of_a_sum_leaves_its_format():
    """3 times 1.6 is beyond 4, where the product's word ends; the sum does not read that word."""
    estimator = Short()
    estimator.said, estimator.factor, estimator.most = 2.4, 1.6, 5.2
    _, total = examine(estimator, updates=4000).claims
    assert total.conditions and total.conditions[0].startswith("square (")


def test_a_proof_without_claims_says_which_words_it_takes():
    estimator = Lever()
    program, nodes = estimator.compile_traced()
    claim = next(c for c in claims_of(program, nodes) if c.reason == "across")
    proof = Prover(estimator, program, nodes).without([], {}).proof_of(claim)
    assert proof.aliases == Vectors(program, nodes).proof_of(claim).aliases != ()


class Root(Estimator):
    """An inverse root of what a claim holds above 0, for some inputs."""

    name = "root"
    inputs = (Input("a", -1.0, 1.0),)
    outputs = (Output("y"),)

    def step(self, x, u, p):
        square = ops.bounded(u.a, 0.25, 1.0, "square", unless="there is none")
        return {}, {"y": ops.bounded(ops.saturated(ops.rsqrt(square), 4.0), 0.0, 3.0, "root")}


def test_there_is_no_root_of_a_negative_number():
    _, root = examine(Root(), updates=4000).claims
    assert root.status != "proven"


@pytest.mark.parametrize("estimator", [Beam(), Lever(), Short()], ids=lambda e: e.name)
def test_no_claim_is_proven_that_a_search_breaks(estimator):
    """Each claim with its range a little less than what random states reach within the ball: no
    proof, with the other claims or without any.
    """
    program, nodes = estimator.compile_traced()
    claims = claims_of(program, nodes)
    forms = [program.format(n) for n, _ in program.states]

    def rows(rng, states):
        s = rng.normal(size=states.shape)
        s /= np.maximum(np.sqrt((s * s).sum(axis=0)), 1e-9)
        return np.array([f.quantise(c) for f, c in zip(forms, s, strict=True)])

    search = Search(
        estimator, program, nodes, claims, drawn_states=rows if program.states else None
    )
    search.run(64)
    without = Prover(estimator, program, nodes).without(claims, {})
    methods = (Vectors(program, nodes).proof_of, *without.methods)
    tried = 0
    for claim, reach in zip(claims, search.reach(), strict=True):
        most = max(-reach.low, reach.high)
        if np.isfinite(most) and most > 1e-3 * claim.size:
            end = (1.0 - 2.0**-9) * most
            false = replace(claim, low=max(claim.low, -end), high=min(claim.high, end))
            assert not any(method(false) for method in methods), str(claim)
            tried += 1
    assert tried > 1, tried


class Stepped(Estimator):
    """A quaternion turned by three terms of the sine and cosine of a step, and one of norm one."""

    name = "stepped"
    inputs = tuple(Input(f"h{a}", -0.03, 0.03, "rad") for a in "xyz")
    states = (State("w", -1.0, 1.0, initial=1.0), *(State(a, -1.0, 1.0) for a in "xyz"))
    outputs = tuple(Output(a) for a in "wxyz")
    fourth = 1.0 / 24.0

    def step(self, x, u, p):
        half = [u.hx, u.hy, u.hz]
        y = ops.bounded(sum(h * h for h in half), 0.0, 0.01, "squares")
        s = ops.bounded(1.0 - (1.0 / 6.0) * y + (1.0 / 120.0) * (y * y), 0.0, 1.0, "sine")
        dq = [1.0 - 0.5 * y + self.fourth * (y * y), *(s * h for h in half)]
        q = multiply([x.w, x.x, x.y, x.z], dq)
        q = [ops.bounded(c, -1.0, 1.0, "turned") for c in q]
        scale = ops.rsqrt(ops.bounded(sum(c * c for c in q), 0.25, 2.0, "norm"))
        following = (ops.saturated(c * scale, 1.0) for c in q)
        return dict(zip("wxyz", following, strict=True)), dict(zip("wxyz", q, strict=True))


def test_a_turn_by_series_is_no_longer_than_one():
    """1 + y^3/360, y <= 0.0027; with another term 1 + y^2/2 or so, which is too long."""
    for fourth, proven in ((1.0 / 24.0, True), (0.3, False)):
        estimator = Stepped()
        estimator.fourth = fourth
        program, nodes = estimator.compile_traced()
        vectors = Vectors(program, nodes)
        turned = [c for c in claims_of(program, nodes) if c.reason == "turned"]
        assert [vectors.proof_of(c) is not None for c in turned] == [proven] * 4


class Elevated(Estimator):
    """A unit quaternion that a heading replaces at times, and an elevation that it gives.

    ``wrong`` changes one thing.
    """

    name = "elevated"
    inputs = (
        *(Input(n, -1.0, 1.0) for n in ("a", "b", "c", "heading", "start")),
        *(Input(n, -1.0, 1.0) for n in ("p", "q", "r")),
    )
    states = (
        State("qw", -1.0, 1.0, initial=1.0),
        *(State(f"q{axis}", -1.0, 1.0) for axis in "xyz"),
    )
    outputs = (Output("along"), Output("root"), Output("unit"))
    wrong = ""

    def step(self, x, u, p):
        w = self.wrong
        turn = increment([u.a, u.b, u.c], short=True)
        q = [ops.saturated(c, 1.0) for c in multiply((x.qw, x.qx, x.qy, x.qz), turn)]
        c = matrix(q)
        square = dot(
            (c[2][1], c[2 if w != "row" else 1][2]), (c[2][1], c[2 if w != "row" else 1][2])
        )
        root = ops.rsqrt(square)
        level = ops.bounded(square * root, 0.0, 1.0 - SLACK * (w == "root"), "root")
        unit = [ops.bounded(c[2][k] * root, -1.0, 1.0, "unit") for k in (1, 2)]
        east = ops.rsqrt(u.a * u.a + u.b * u.b)
        row = [*(c[2][0] * ops.saturated(k * east, 1.0) for k in (u.a, u.b)), level]
        along = ops.bounded(dot(row, (u.p, u.q, u.r)), -(3.0**0.5), 3.0**0.5, "along")
        raw = multiply(q, (1.0, u.p, u.q, u.r))
        shrink = ops.rsqrt(ops.bounded(dot(raw, raw), 0.0, 4.0, "norm"))
        new = [ops.saturated(v * shrink, 1.0) for v in raw]
        sine, cosine = ops.sincos_ht(u.heading)
        if w == "angle":
            _, cosine = ops.sincos_ht(0.5 * u.heading)
        start = [cosine, 0.0, 0.0 if w != "start" else 2.0**-4, sine]
        after = [ops.where(u.start < 0.0, s, v) for s, v in zip(start, new, strict=True)]
        states = {f"q{axis}": v for axis, v in zip("wxyz", after, strict=True)}
        return states, {"along": along, "root": level, "unit": unit[0] + unit[1]}


def unproven_of(wrong):
    estimator = Elevated()
    estimator.wrong = wrong
    program, nodes = estimator.compile_traced()
    prover = Prover(estimator, program, nodes)
    claims = [c for c in claims_of(program, nodes) if not c.state]
    return {c.reason for c in claims if prover.proof_of(c) is None}


def test_the_root_of_an_elevation():
    assert unproven_of("") == set()


@pytest.mark.parametrize(
    ("wrong", "broken"),
    [
        ("row", {"root", "unit", "along"}),
        ("root", {"root"}),
        ("angle", {"norm", "root", "along"}),
        ("start", {"norm", "root", "along"}),
    ],
)
def test_an_elevation_wrong_by_a_bit(wrong, broken):
    """Elements of two rows, a lower bound, and quaternions longer than one at the start."""
    assert broken <= {r.split(",")[0] for r in unproven_of(wrong)}
