"""The record of a ``step`` computes what it computes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from boresight.firmware.floating.text import operation_counts
from boresight.model.estimators import ESTIMATORS
from boresight.model.lowering.trace import Trace
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record

APPLY: dict[str, Callable[..., Any]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "neg": lambda a: -a,
    "absolute": abs,
    "sqrt": math.sqrt,
    "rsqrt": lambda a: 1.0 / math.sqrt(max(a, 1e-300)),
    "sin": lambda a: math.sin(math.pi * a),
    "cos": lambda a: math.cos(math.pi * a),
    "asin": lambda a: math.asin(min(max(a, 0.0), 1.0)) / math.pi,
    "atan2": lambda y, x: (math.atan2(y, x) / math.pi + 1.0) % 2.0 - 1.0,
    "clip": lambda x, low, high: min(max(x, low), high),
    "saturated": lambda x, limit: min(max(x, -limit), limit),
    "larger": max,
    "smaller": min,
    "wrap": lambda x: (x + 1.0) % 2.0 - 1.0,
    "select": lambda c, a, b: a if c else b,
    "flip": lambda c, a: -a if c else a,
    "less": lambda a, b: a < b,
    "invert": lambda a: not a,
    "both": lambda a, b: a and b,
    "either": lambda a, b: a or b,
    "named": lambda x, name: x,
    "bounded": lambda x, low, high, reason: x,
    "const": lambda number: number,
}


def run(trace: Trace, leaves: dict[tuple[str, str], float]) -> dict[int, float]:
    """Every expression of one update."""
    known: dict[int, float] = {}
    for e in trace.needed:
        if e.kind == "leaf":
            known[e.number] = leaves[e.data[:2]]
        else:
            known[e.number] = APPLY[e.kind](*(known[a.number] for a in e.args), *e.data)
    return known


@pytest.mark.parametrize("name", sorted(ESTIMATORS))
def test_equals_the_reference(name: str) -> None:
    e = ESTIMATORS[name]()
    records = feed(e, read_record(bundled("ximu_walk"))).inputs[:400]
    reference = e.run_float(records[..., None])
    trace = e.trace()
    leaves = {("param", p.name): p.default for p in e.params}
    leaves |= {("state", s.name): s.initial for s in e.states}
    worst = 0.0
    for k, record in enumerate(records):
        leaves |= {("input", i.name): float(u) for i, u in zip(e.inputs, record, strict=True)}
        known = run(trace, leaves)
        for output, value in trace.outputs.items():
            difference = known[value.number] - reference.outputs[output][k, 0]
            if output in ("pitch", "roll", "heading"):
                difference = (difference + 1.0) % 2.0 - 1.0
            worst = max(worst, abs(difference))
        leaves |= {s.data[:2]: known[v.number] for s, _, v in trace.states}
    assert worst < 1e-9  # double precision, with products in another order


def test_functions_stay_functions() -> None:
    counts = operation_counts(ESTIMATORS["complementary"]().trace())
    assert (counts["sin"], counts["cos"], counts["atan2"]) == (3, 3, 1)
    assert not {"const", "leaf", "named", "bounded"} & counts.keys()
