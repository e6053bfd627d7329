"""Variances that stop at limits of their own: true ones, and wrong by a bit."""

import pytest

from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.sim.ranges.claims import claims_of
from boresight.sim.ranges.gram import Gram
from boresight.sim.ranges.ranges import examine
from boresight.sim.ranges.variances import Variances
from boresight.sim.ranges.vectors import Vectors


class Limited(Estimator):
    """The first state moves by the second one; each is measured in its turn.

    Variances grow below 0.4 and 0.3 only, and the second state may begin anew. ``wrong`` changes
    one thing.
    """

    name = "limited"
    inputs = (Input("a", -0.25, 0.25), Input("again", -1.0, 1.0))
    params = (Param("q", 0.001, 0.0, 0.001), Param("r", 0.02, 0.01, 0.25))
    states = (
        State("p00", 0.0, 0.999, initial=0.2),
        State("p01", -0.999, 0.999),
        State("p11", 0.0, 0.999, initial=0.1),
        State("turn", 0.0, 3.0),
    )
    outputs = (Output("y"),)
    wrong = ""
    #: (sqrt(0.4) + 0.25 sqrt(0.301))^2 = 0.59278, and with that the largest noise.
    moved, total = 0.593, 0.8429

    def step(self, x, u, p):
        w = self.wrong
        a = u.a if w == "move" else ops.where(x.p00 < 0.4, u.a, 0.0)
        a = 2.0 * a if w == "far" else a
        part = ops.bounded(x.p01 + a * x.p11, -0.999, 0.999, "part")
        moved = ops.bounded(x.p00 + a * x.p01 + a * part, 0.0, self.moved, "moved")
        again = u.again < 0.0
        before = [moved, part, x.p11]
        reset = [moved, *(ops.where(again, 0.0, v) for v in before[1:])]
        if w == "correlation":
            reset[1] = part
        b = before if w == "late" else reset
        first = ops.where(x.turn < 0.5, 1.0, 0.0)
        second = ops.where(x.turn < 1.5, 1.0, 0.0)
        h = (first, second if w == "both" else second - first)
        column = [h[0] * b[0] + h[1] * b[1], h[0] * b[1] + h[1] * b[2]]
        s = ops.bounded(h[0] * column[0] + h[1] * column[1] + p.r, 0.0, self.total, "S")
        weight = ops.rsqrt(s)
        gain = [ops.bounded(c * weight, -0.77, 0.77, "gain") for c in column]
        grown = p.q if w == "growth" else ops.where(x.p11 < 0.3, p.q, 0.0)
        more = ops.where(again, 0.2, grown)
        after = {
            "p00": ops.bounded(reset[0] - gain[0] * gain[0], 0.0, 0.999, "p00"),
            "p01": ops.bounded(reset[1] - gain[0] * gain[1], -0.999, 0.999, "p01"),
            "p11": ops.bounded(reset[2] - gain[1] * gain[1] + more, 0.0, 0.999, "p11"),
            "turn": ops.where(again, 0.0, ops.minimum(x.turn + 1.0, 3.0)),
        }
        return after, {"y": moved}


def unproven(**change):
    """The reasons of claims of a changed `Limited` that have no proof."""
    estimator = Limited()
    for name, value in change.items():
        setattr(estimator, name, value)
    program, nodes = estimator.compile_traced()
    vectors = Vectors(program, nodes)
    gram = Gram(estimator, program, nodes, vectors)
    proof_of = Variances(gram, vectors).proof_of
    return [c.reason for c in claims_of(program, nodes) if c.bounded and not proof_of(c)]


def test_limits():
    assert unproven() == []
    result = examine(Limited(), updates=3000)
    assert result.proven == 1.0
    assert "limits of variances" in {c.how for c in result.claims}


@pytest.mark.parametrize(
    "change, reason",
    [
        ({"moved": 0.592}, "moved"),
        ({"total": 0.842}, "S"),
        ({"wrong": "far"}, "moved"),
        ({"wrong": "move"}, "moved"),
        ({"wrong": "both"}, "S"),
        ({"wrong": "growth"}, "range of the state p11"),
        ({"wrong": "correlation"}, "range of the state p11"),
        ({"wrong": "late"}, "range of the state p11"),
    ],
)
def test_not_quite(change, reason):
    """A range just too narrow; no limit or none in time; both at once; no covariance."""
    assert reason in unproven(**change)
