"""Rows that are one of several kinds: what they leave unknown is the most of any kind."""

import math

import pytest

from boresight.model import ops
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.model.kalman import Kalman, Measurement
from boresight.model.kalman import State as Estimated
from boresight.model.lowering.graph import Node
from boresight.sim.ranges.cases import ends_in_cases
from boresight.sim.ranges.claims import claims_of
from boresight.sim.ranges.gram import Gram
from boresight.sim.ranges.intervals import interval_of
from boresight.sim.ranges.ranges import examine
from boresight.sim.ranges.steps import live_nodes


@pytest.mark.parametrize(
    ("ends", "inverse"),
    [
        ((0.5, 2.0), (0.5, 2.0)),
        ((0.0, 2.0), (0.5, math.inf)),
        ((-1.0, 2.0), (-math.inf, math.inf)),
        ((-1.0, 0.0), (-math.inf, math.inf)),
        ((-2.0, -0.5), (-2.0, -0.5)),
    ],
)
def test_the_inverse_of_what_may_be_0(ends, inverse):
    assert interval_of(Node(1, "reciprocal", (Node(0, "input"),)), [ends]) == inverse


class Fading(Estimator):
    """The larger of a sample and of what is left of the last one, in a time that is not negative.

    ``sign`` -1: the time may be.
    """

    name = "fading"
    inputs = (Input("dt", -0.5, 0.5), Input("new", 0.0, 2.0))
    params = (Param("rate", 1.0, 0.0, 4.0),)
    states = (State("most", 0.0, 2.0),)
    outputs = (Output("y"),)
    sign = 1.0

    def step(self, x, u, p):
        dt = ops.where(u.dt < 0.0, self.sign * 0.5, u.dt)
        forget = ops.saturated(p.rate * dt, 1.0)
        most = ops.maximum(u.new, x.most - x.most * forget)
        return {"most": ops.bounded(most, 0.0, 2.0, "a part of it")}, {"y": most}


@pytest.mark.parametrize(("sign", "status"), [(1.0, "invariant"), (-1.0, "refuted")])
def test_a_part_of_what_was(sign, status):
    estimator = Fading()
    estimator.sign = sign
    result = examine(estimator, updates=2000)
    (most,) = result.states
    assert most.status == status
    lines = str(result).splitlines()
    assert lines[1] == "  no claims" and lines[2].startswith("  1 range of a state: 1 ")


class Kinds(Kalman):
    """Three states, each measured by itself where an input says so: 4, 2 or 1 times as large."""

    name = "kinds"
    inputs = (Input("kind", 0.0, 4.0), Input("z", -8.0, 8.0), Input("by", -1.0, 1.0))
    params = (Param("r", 0.1, 0.05, 1.0),)
    states = tuple(Estimated(a, -1.0, 1.0, sd=0.5, sd_max=1.0) for a in "abc")
    sd_max = 4.0
    together = False

    def measure(self, x, u, p):
        at = [u.kind < n + 0.5 for n in range(4)]
        here = [at[n] & ~at[n - 1] for n in (1, 2, 3)]
        if self.together:
            here[1] = at[2]
        h = 0.0
        for condition, factor, value in zip(here, (4.0, 2.0, 1.0), (x.a, x.b, x.c), strict=True):
            h = h + ops.where(condition, factor * u.by, 0.0) * value
        return [Measurement(u.z, h, p.r, sd_max=self.sd_max)]


def unproven(estimator):
    program, nodes = estimator.compile_traced()
    gram = Gram(estimator, program, nodes)
    assert gram.proven
    return [c.reason for c in claims_of(program, nodes) if not c.state and not gram.proof_of(c)]


def test_one_kind_at_a_time():
    assert unproven(Kinds()) == []


@pytest.mark.parametrize("change", [{"sd_max": 3.9}, {"together": True}])
def test_more_than_is_said(change):
    """The first kind leaves 4; the first and the second at once, 6."""
    estimator = Kinds()
    for name, value in change.items():
        setattr(estimator, name, value)
    assert "h P h + r" in unproven(estimator)


def test_intervals_of_each_case():
    program, nodes = Kinds().compile_traced()
    live = live_nodes(program, nodes)
    cases = ends_in_cases(program, nodes)
    (kind,) = [n for n, node in live.items() if node.name == "kind"]
    assert cases[kind][0] == pytest.approx([0.0, 0.5, 1.5, 2.5, 3.5])
    assert cases[kind][1] == pytest.approx([0.5, 1.5, 2.5, 3.5, 4.0])
    conditions = [
        n for n, (low, high) in cases.items() if live[n].kind == "sum" and (high < 0).any()
    ]
    decided = [[*(cases[n][0] >= 0.0)] for n in conditions]
    assert [False, True, True, True, True] in decided and [False] * 4 + [True] in decided
    assert all(((low >= 0.0) | (high < 0.0)).all() for low, high in map(cases.get, conditions))


class Driven(Kinds):
    """A product of two states is measured, of which an input drives one beyond its range."""

    sd_max = 1.0
    slope_max = {"a": 0.5, "b": 0.5}

    def f(self, x, u, p):
        return {"a": x.a + 0.25 * u.by}

    def measure(self, x, u, p):
        here = [u.kind < 0.5, ~(u.kind < 0.5) & (u.kind < 1.5), u.kind > 1.5]
        rows = (x.a * x.b, x.c, 0.5 * x.c)
        h = sum(ops.where(c, 1.0, 0.0) * row for c, row in zip(here, rows, strict=True))
        return [Measurement(u.z, h, p.r, sd_max=self.sd_max, slope_max=self.slope_max)]


def statuses(**members):
    result = examine(type("Driven", (Driven,), members)(), updates=4000)
    assert result.good
    (driven,) = [c for c in result.claims if c.value.startswith("range of the state")]
    assert driven.status == "excepted"
    return {c.status for c in result.claims if c.value.split(",")[0] in OF_P}


OF_P = {"standard deviations", "h P h + r", "root of a variance"}


def test_a_limited_derivative_needs_no_range():
    """What is measured leaves 0.5 + 0.5, whatever the states; with limits of 1 it may leave 2."""
    assert statuses() == {"proven"}
    assert statuses(slope_max={"a": 1.0, "b": 1.0}) - {"proven"}
    assert "conditional" in statuses(slope_max={}, sd_max=2.0)
