"""Vectors less their parts along others: lengths that are proven, and what is false by a bit."""

from dataclasses import replace

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.algebra.quaternion import dot
from boresight.model.algebra.square_root import potter, whitened
from boresight.model.estimator import Estimator, Input, Output, State
from boresight.sim.ranges.claims import claims_of
from boresight.sim.ranges.ranges import examine
from boresight.sim.ranges.search import Search
from boresight.sim.ranges.vectors import Vectors

NAMES = ("s00", "s01", "s10", "s11")


class Root(Estimator):
    """A square root of a covariance, updated by one row; ``wrong`` changes one thing."""

    name = "root"
    inputs = (Input("a", -9.0, 9.0), Input("b", -9.0, 9.0), Input("live", 0.0, 1.0))
    states = tuple(State(n, -1.0, 1.0, initial=float(n[1] == n[2])) for n in NAMES)
    outputs = (Output("y"),)
    wrong = ""
    part, length = 1.0, 1.0  #: bounds that are claimed.

    def step(self, x, u, p):
        w = self.wrong
        s = [[getattr(x, f"s{i}{j}") for j in (0, 1)] for i in (0, 1)]
        f = [ops.saturated(s[0][j] * u.a + s[1][j] * u.b, 8.0) for j in (0, 1)]
        square = ops.saturated(dot(f, f), 64.0)
        used = (u.live > 0.5) & ~(square > (72.0 if w == "limit" else 32.0))
        weight = ops.bounded(ops.rsqrt(1.0 + square), 0.1, 1.0, "inverse of one and more")
        root = ops.rsqrt(0.9 if w == "factor" else 1.0 + weight)
        share = ops.bounded(ops.where(used, weight, 0.0) * root, 0.0, 1.0, "weight")
        psi = [ops.bounded(c * share, -self.length, self.length, "shorter than one") for c in f]
        along = psi[::-1] if w == "other" else psi
        after = {}
        for i, row in enumerate(s):
            part = ops.bounded(dot(row, along), -self.part, self.part, "part of a row")
            taken = -part if w == "sign" else part
            for j in (0, 1):
                rest = row[j] - taken * psi[j]
                after[f"s{i}{j}"] = ops.bounded(rest, -1.0, 1.0, "rows only shrink")
        return after, {"y": after["s00"]}


def proofs(estimator):
    """Of each claim, by reason; and of the states."""
    program, nodes = estimator.compile_traced()
    vectors = Vectors(program, nodes)
    return [(c.state or c.reason, vectors.proof_of(c)) for c in claims_of(program, nodes)]


def test_a_root_of_a_covariance():
    found = proofs(Root())
    wanted = {"shorter than one", "part of a row", *NAMES}
    assert {name for name, proof in found if name in wanted and proof} == wanted
    assert all(proof for name, proof in found if name in wanted)
    result = examine(Root(), updates=4000)
    parts = [c for c in result.claims if c.value == "part of a row"]
    assert len(parts) == 2 and {c.status for c in parts} == {"proven"}


@pytest.mark.parametrize(
    ("wrong", "unproven"),
    [
        ("limit", {"shorter than one"}),
        ("factor", {"shorter than one"}),
        ("other", {*NAMES}),
        ("sign", {*NAMES}),
    ],
)
def test_wrong_by_a_bit(wrong, unproven):
    estimator = Root()
    estimator.wrong = wrong
    found = proofs(estimator)
    assert not any(proof for name, proof in found if name in unproven)


def test_no_length_is_proven_shorter_than_it_can_be():
    for name, attribute, most in (
        ("shorter than one", "length", 0.9),  # sqrt(1 - w) of w = 1/sqrt(33): 0.909
        ("part of a row", "part", 0.9),
    ):
        estimator = Root()
        setattr(estimator, attribute, most)
        assert not any(proof for reason, proof in proofs(estimator) if reason == name)


class Several(Estimator):
    """Two rows made orthonormal, and the update of a root by both."""

    name = "several"
    inputs = tuple(Input(n, -1.0, 1.0) for n in ("a", "b", "c", "d", "y", "z", "live"))
    states = Root.states
    outputs = (Output("y"),)

    def step(self, x, u, p):
        rows, white = whitened([[u.a, u.b], [u.c, u.d]], [u.y, u.z], 2.0, 4.0)
        s = [[getattr(x, f"s{i}{j}") for j in (0, 1)] for i in (0, 1)]
        update = potter(s, rows, white, u.live > 0.5, u.live < -0.5)
        after = {f"s{i}{j}": update.root[i][j] for i in (0, 1) for j in (0, 1)}
        return after, {"y": update.white[0]}


def test_parts_along_several_and_of_gram_schmidt():
    result = examine(Several(), updates=4000)
    wanted = {
        *("component of a row", "rest of a row", "square of a row", "shorter than one"),
        *("of vectors shorter than one", "of a row shorter than one"),
    }
    assert {c.value for c in result.claims if c.status == "proven"} >= wanted
    assert not [str(c) for c in result.claims if c.value in wanted and c.status != "proven"]
    assert {s.status for s in result.states} == {"invariant"}


@pytest.mark.parametrize("estimator", [Root(), Several()], ids=["one", "several"])
def test_no_claim_is_proven_that_a_search_breaks(estimator):
    """Each claim with its range a little less than what random states reach within the ball."""
    program, nodes = estimator.compile_traced()
    claims = claims_of(program, nodes)
    columns = [NAMES.index(program.values[n].name) for n, _ in program.states]
    forms = [program.format(n) for n, _ in program.states]

    def rows(rng, states):
        s = rng.normal(size=(2, 2, states.shape[1]))
        s /= np.maximum(np.sqrt((s * s).sum(axis=1, keepdims=True)), 1e-9)
        s = s.reshape(4, -1) * rng.choice([1.0, 0.5], states.shape[1])
        return np.array([f.quantise(s[k]) for f, k in zip(forms, columns, strict=True)])

    search = Search(estimator, program, nodes, claims, drawn_states=rows)
    search.run(64)
    vectors = Vectors(program, nodes)
    tried = 0
    for claim, reach in zip(claims, search.reach(), strict=True):
        most = max(-reach.low, reach.high)
        if np.isfinite(most) and most > 1e-3 * claim.size:
            end = (1.0 - 2.0**-9) * most
            false = replace(claim, low=max(claim.low, -end), high=min(claim.high, end))
            assert vectors.proof_of(false) is None, str(claim)
            tried += 1
    assert tried > 8, tried
