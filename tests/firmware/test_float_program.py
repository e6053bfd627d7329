"""The recorded float program computes what ``step`` computes."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from boresight.firmware.float_program import FloatProgram, trace_float
from boresight.model.estimators import ESTIMATORS
from boresight.sim.records.bundled import bundled
from boresight.sim.records.feed import feed
from boresight.sim.records.files import read_record

APPLY: dict[str, Callable] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "neg": lambda a: -a,
    "abs": abs,
    "sqrt": math.sqrt,
    "sin": math.sin,
    "cos": math.cos,
    "asin": math.asin,
    "atan2": lambda y, x: math.atan2(y, x),
    "clip": lambda x, low, high: min(max(x, low), high),
    "max": max,
    "wrap_ht": lambda x: (x + 1.0) % 2.0 - 1.0,
    "select": lambda c, a, b: a if c else b,
    "less": lambda a, b: a < b,
    "not": lambda a: not a,
    "and": lambda a, b: a and b,
    "or": lambda a, b: a or b,
}


def run(program: FloatProgram, leaves: dict[tuple[str, str], float]) -> dict[int, float]:
    """Every value of one update."""
    known: dict[int, float] = {}
    for value in program.values:
        if value.kind == "const":
            known[value.index] = value.number
        elif not value.args:
            known[value.index] = leaves[value.kind, value.name]
        else:
            known[value.index] = APPLY[value.kind](*(known[a.index] for a in value.args))
    return known


@pytest.mark.parametrize("name", sorted(ESTIMATORS))
def test_equals_the_reference(name: str) -> None:
    e = ESTIMATORS[name]()
    records = feed(e, read_record(bundled("ximu_walk"))).inputs[:400]
    reference = e.run_float(records[..., None])
    program = trace_float(e)
    leaves = {("param", p.name): p.default for p in e.params}
    leaves |= {("state", s.name): s.initial for s in e.states}
    worst = 0.0
    for k, record in enumerate(records):
        leaves |= {("input", i.name): float(u) for i, u in zip(e.inputs, record, strict=True)}
        known = run(program, leaves)
        for output, value in program.outputs.items():
            difference = known[value.index] - reference.outputs[output][k, 0]
            if output in ("pitch", "roll", "heading"):
                difference = (difference + 1.0) % 2.0 - 1.0
            worst = max(worst, abs(difference))
        leaves |= {("state", s): known[v.index] for s, v in program.states.items()}
    assert worst < 1e-9  # double precision, with products in another order


def test_no_trace_of_fixed_point() -> None:
    counts = trace_float(ESTIMATORS["complementary"]()).counts()
    assert (counts["sin"], counts["cos"], counts["atan2"]) == (3, 3, 1)
    assert "mod" not in counts
