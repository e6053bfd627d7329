"""The recorded float program computes what ``step`` computes."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from firmware.float_trace import FloatProgram, Tape, trace_float
from model import ops
from model.estimators import ESTIMATORS
from sim.bundled import bundled
from sim.feed import inputs_of
from sim.log import read_log

APPLY: dict[str, Callable] = {
    "add": lambda a, b: a + b, "sub": lambda a, b: a - b, "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b, "neg": lambda a: -a, "abs": abs, "sqrt": math.sqrt,
    "sin": math.sin, "cos": math.cos, "asin": math.asin, "atan2": lambda y, x: math.atan2(y, x),
    "clip": lambda x, low, high: min(max(x, low), high), "max": max,
    "wrap_ht": lambda x: (x + 1.0) % 2.0 - 1.0, "select": lambda c, a, b: a if c else b,
    "less": lambda a, b: a < b, "not": lambda a: not a, "and": lambda a, b: a and b,
    "or": lambda a, b: a or b}


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
    records = inputs_of(e, read_log(bundled("ximu_walk")))[:400]
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


@pytest.fixture
def tape() -> Tape:
    return Tape()


def test_each_expression_once(tape: Tape) -> None:
    x, y = tape.leaf("input", "x"), tape.leaf("input", "y")
    assert x * y is x * y
    assert ops.sincos_ht(x)[0] is ops.sincos_ht(x)[0]


def test_what_disappears(tape: Tape) -> None:
    x, y = tape.leaf("input", "x"), tape.leaf("input", "y")
    assert x + 0.0 is x
    assert 1.0 * x is x
    assert (-x).args == (x,)
    assert 0.0 - (-x) is x
    assert x - (-y) is x + y
    assert (-1.0 * x).kind == "neg"
    assert ~~(x < y) is (x < y)
    assert -(x - y) is y - x
    assert (tape.const(2.0) * 3.0).number == 6.0
    assert (x / 4.0).args[0].number == 0.25
    assert x * 0.5 * 4.0 is 2.0 * x


def test_nothing_more_disappears(tape: Tape) -> None:
    x = tape.leaf("input", "x")
    assert (x * 0.0).kind == "mul"  # infinity times zero is no zero
    assert (x - x).kind == "sub"


def test_wrap_is_recognised(tape: Tape) -> None:
    x, y = tape.leaf("input", "x"), tape.leaf("input", "y")
    assert ops.wrap_ht(x).kind == "wrap_ht"
    assert ops.wrap_ht(x).args == (x,)
    assert ops.wrap_ht(x - y).args == (x - y,)
    angle = ops.atan2_ht(y, x)
    assert (angle.kind, angle.args[0].args[1].kind) == ("wrap_ht", "atan2")
    assert angle.args[0].args[1].args == (y, x)


def test_comparisons(tape: Tape) -> None:
    x, y = tape.leaf("input", "x"), tape.leaf("input", "y")
    assert (x > y) is (y < x)
    assert (x >= y) is ~(x < y)
    assert (x <= y) is ~(y < x)
    assert ((x < y) | (y < x)).kind == "or"
    assert (x > 1.0).args[1] is x
    chosen = ops.where((x < y) & ~(y < 1.0), x, 2.0)
    assert [a.kind for a in chosen.args] == ["and", "input", "const"]


def test_misuse_is_refused(tape: Tape) -> None:
    x = tape.leaf("input", "x")
    with pytest.raises(TypeError, match=r"^a traced value has no truth value: use model\.ops"):
        bool(x < 1.0)
    with pytest.raises(TypeError, match="^numpy's tanh cannot be traced$"):
        np.tanh(x)
    with pytest.raises(TypeError, match="^conditions combine with conditions, not with 1$"):
        (x < 1.0) & 1
    with pytest.raises(TypeError, match="^only numbers and traced values can be computed with"):
        x + "1"
    with pytest.raises(TypeError, match="^add: only plain calls can be traced$"):
        np.add.reduce(x)
    with pytest.raises(TypeError, match="keyword arguments cannot be traced$"):
        np.clip(x, 0.0, 1.0, out=None)
