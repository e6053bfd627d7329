"""Ranges of a profile choose binary points, and nothing else."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.lowering.lower import lower
from boresight.model.lowering.profile import Profile, Range
from boresight.model.lowering.trace import Trace, Tracer
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Program, Value


def compiled(
    step: Callable[[Any, Any], tuple[Any, Any]],
    fit: Callable[[str], Range | None] = lambda kind: None,
    limits: Range | None = None,
    low: float = -4.0,
) -> Program:
    """A step of one input x in [low, 4] and one state s in [-1, 1], with ranges by kind."""
    tracer = Tracer("test")
    x = tracer.leaf("input", "x", low, 4.0)
    s = tracer.leaf("state", "s", -1.0, 1.0)
    after, out = (tracer.lift(e) for e in step(x, s))
    ranges = {e.number: r for e in tracer.expressions if e.args and (r := fit(e.kind)) is not None}
    held = {
        e.number: limits
        for e in tracer.expressions
        if limits is not None and e.kind in ("div", "rsqrt", "sqrt")
    }
    profile = Profile("test", "", ("log",), ranges, held)
    trace = Trace(tracer, [x], {"out": out}, (), [(s, 0.0, after)])
    return lower(trace, Arithmetic(word=32), profile)[0]


def value(program: Program, name: str) -> Value:
    return next(v for v in program.values if v.name == name)


def test_a_product_gets_the_finest_format_of_the_range() -> None:
    program = compiled(lambda x, s: (s, x * x), lambda kind: (0.0, 0.01))
    assert value(program, "out").frac == 31 + 6  # 0.01 < 2^-6
    assert value(program, "out").range_source == "observed in log"
    assert value(compiled(lambda x, s: (s, x * x)), "out").frac == 31 - 5


@pytest.mark.parametrize("seen", [(-99.0, 99.0), (-2.0, -1.0), (0.25, 0.25)])
def test_a_range_beyond_the_interval_or_a_point_changes_nothing(seen: Range) -> None:
    out = value(compiled(lambda x, s: (s, x * x), lambda kind: seen), "out")
    assert (out.frac, out.range_source) == (26, "interval")


def test_it_decides_no_selection() -> None:
    """The log never saw x * x above 1; the other side stays."""
    program = compiled(
        lambda x, s: (s, ops.where(x * x > 1.0, 2.0 * x, s)),
        lambda kind: (0.0, 0.5) if kind == "mul" else None,
    )
    assert any(t.when.name != "ALWAYS" for op in program.ops for t in op.terms)


def test_what_replaces_a_state_has_its_format() -> None:
    """Its word holds all that was declared, whatever was seen; an output that is one, too."""

    def step(x: Any, s: Any) -> tuple[Any, Any]:
        after = 0.5 * s + 0.05 * x
        return after, after

    program = compiled(step, lambda kind: (-1e-3, 1e-3))
    (state, after) = program.states[0]
    assert program.values[after].frac == program.values[state].frac == 30
    assert program.values[program.outputs[0]].high == pytest.approx(0.7)


def test_what_is_selected_for_a_state_is_rounded_once() -> None:
    """A second rounding, of one or two bits, would go up on every tie: the state would creep."""

    def step(x: Any, s: Any) -> tuple[Any, Any]:
        follow = s + 0.01 * (0.25 * x - s)
        return ops.where(x < 3.0, ops.where(x < -3.0, s, follow), -s), s * x

    kinds = ("select", "add", "sub", "mul")
    program = compiled(step, lambda kind: (-0.25, 0.25) if kind in kinds else None)
    selected = [v.frac for v in program.values if v.name.startswith("select_")]
    assert selected and max(selected) <= 30
    assert max(v.frac for v in program.values if v.range_source.startswith("observed")) > 30


def test_what_is_added_to_replace_a_state_is_rounded_once() -> None:
    """A prediction that is read besides, and is the next state where nothing is measured."""

    def step(x: Any, s: Any) -> tuple[Any, Any]:
        ahead = ops.bounded(s + 0.01 * s * x, -1.0, 1.0, "slow")
        correction = ops.where(x > 3.0, 0.1 * (x - ahead), 0.0)
        return ops.bounded(ahead + correction, -1.0, 1.0, "state"), ahead * x

    def fracs(largest: float) -> set[int]:
        program = compiled(
            step, lambda kind: (-largest, largest) if kind == "bounded" else None, low=0.0
        )
        return {v.frac for v in program.values if v.range_source.startswith("observed")}

    assert fracs(0.5) == fracs(2.0**-6) == {30}  # 31 and 36 bits lie on a tie in 1 of 2 and 64
    assert fracs(2.0**-7) == {37}


def test_what_is_rounded_once_keeps_the_format_of_its_interval() -> None:
    """A quarter of the state at most, on either side of zero; a factor keeps its own format."""

    def step(x: Any, s: Any) -> tuple[Any, Any]:
        above = ops.named("above", 0.25 * ops.absolute(s))
        below = ops.named("below", -0.25 * ops.absolute(s))
        factor = ops.named("factor", 0.25 * x)
        wide = ops.named("wide", factor * s + x)
        return ops.where(x < 0.0, above, ops.where(x < 1.0, below, wide)), factor + x

    seen = {"mul": (-0.02, 0.02), "add": (-1.0, 0.5)}
    program = compiled(step, seen.get)
    assert [value(program, name).frac for name in ("above", "below", "factor")] == [32, 33, 36]
    assert value(program, "wide").high == 0.5  # as coarse as the state: nothing is widened


def test_a_divisor_is_held_off_zero() -> None:
    program = compiled(lambda x, s: (s, 1.0 / x), limits=(0.25, 4.0))
    assert value(program, "out").high == 4.0
    negative = compiled(lambda x, s: (s, 1.0 / x), limits=(-4.0, -0.25))
    assert value(negative, "out").low == -4.0
    far = compiled(lambda x, s: (s, 1.0 / (1e6 * x)), limits=(0.25, 16.0))  # 2^24 in one word
    assert value(far, "out").high == 4.0
    words = far.format(far.inputs[0]).quantise([[4e-7, 2e-6, 4.0]])
    out, saturated = Interpreter(far, 3).update(words)
    assert saturated.tolist() == [False, False, True]
    exact = 1e-6 / far.format(far.inputs[0]).real(words[0, 1])
    assert far.format(far.outputs[0]).real(out[0, 1]) == pytest.approx(exact, rel=1e-5)
    with pytest.raises(InputError, match="a divisor whose range excludes 0"):
        compiled(lambda x, s: (s, 1.0 / x))


def test_a_root_without_interval_is_held_where_its_argument_was() -> None:
    def step(x: Any, s: Any) -> tuple[Any, Any]:
        endless = x * ops.rsqrt(x * x)
        return s, ops.sqrt(endless)

    program = compiled(step, lambda kind: (0.0, 2.0) if kind == "mul" else None, limits=(0.5, 1.0))
    assert value(program, "out").high < 4.0


def test_a_factor_that_is_too_fine_gets_a_coarser_copy() -> None:
    """A root of anything times a factor with many fraction bits: no shift reaches the result."""
    program = compiled(
        lambda x, s: (s, (x * 2.0**-20 + s * 2.0**-20) * ops.rsqrt(x * x)),
        lambda kind: (-8.0, 8.0) if kind == "mul" else None,
        low=0.0,
    )
    assert any(v.name.endswith("_coarse") for v in program.values)


def test_the_angle_of_a_short_vector_keeps_the_bits_of_fitted_components() -> None:
    """A coarser magnitude would be 0, and the vector then as long as it is."""
    program = compiled(
        lambda x, s: (s, ops.atan2_ht(0.6 * x + 100.0 * s, 0.8 * x + 100.0 * s)),
        lambda kind: (-0.5, 0.5) if kind == "add" else None,
    )
    words = [-20, -7, 3, 5, 9, 100]
    out, _ = Interpreter(program, len(words)).update([words])
    turns = [math.atan2(0.6 * k, 0.8 * k) / math.pi for k in words]
    assert program.format(program.outputs[0]).real(out[0]) == pytest.approx(turns, abs=0.02)
