"""Float expressions as C text: constants to the last bit, brackets where they matter."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from boresight.firmware.float_program import FloatProgram
from boresight.firmware.float_text import Expressions, float_helpers
from boresight.firmware.float_trace import Tape, Value
from boresight.firmware.precision import SINGLE
from boresight.model import ops
from boresight.model.estimator import Estimator


class Nothing(Estimator):
    """Declares nothing."""

    name, summary, urgent = "nothing", "", 1
    inputs, params, states, outputs = (), (), (), ()


def text_of(make) -> str:
    """The expression that the value ``make(x, y, z)`` becomes."""
    tape = Tape()
    x, y, z = (tape.leaf("input", name) for name in "xyz")
    value = make(x, y, z)
    expressions = Expressions(FloatProgram(Nothing(), tape, {}, {"out": value}))
    expressions.statements()
    return expressions.text(value).replace("in->", "").replace("_i", "")


@given(st.floats(width=32, allow_nan=False, allow_infinity=False, allow_subnormal=False))
def test_literal_is_the_number(number: float) -> None:
    text = SINGLE.literal(number)
    assert text.endswith("f")
    assert "." in text or "e" in text
    assert np.float32(text[:-1]) == np.float32(number)


def test_literals() -> None:
    assert SINGLE.literal(1.0) == "1.0f"
    assert SINGLE.literal(-0.5) == "-0.5f"
    assert SINGLE.literal(1e-300) == "1.1754944e-38f"
    assert SINGLE.literal(0.0) == "0.0f"
    with pytest.raises(ValueError, match="^number must be finite in a float, not 1e"):
        SINGLE.literal(1e39)


@pytest.mark.parametrize(
    ("make", "wanted"),
    [
        (lambda x, y, z: x + y - z, "x + y - z"),
        (lambda x, y, z: x - (y + z), "x - (y + z)"),
        (lambda x, y, z: x - (y - z), "x - (y - z)"),
        (lambda x, y, z: x + (y + z), "x + (y + z)"),
        (lambda x, y, z: x * y + z, "x * y + z"),
        (lambda x, y, z: x * (y + z), "x * (y + z)"),
        (lambda x, y, z: x / (y * z), "x / (y * z)"),
        (lambda x, y, z: x / y * z, "x / y * z"),
        (lambda x, y, z: -(x + y), "-(x + y)"),
        (lambda x, y, z: ops.where(x < y, y, z), "x < y ? y : z"),
        (lambda x, y, z: ops.where(x < y, y, z) * x, "(x < y ? y : z) * x"),
        (
            lambda x, y, z: ops.where(~(x < y), y, ops.where(y < z, x, z)),
            "!(x < y) ? y : (y < z ? x : z)",
        ),
        (
            lambda x, y, z: ops.where((x < y) | (y < z) & (z < x), x, z),
            "x < y || (y < z && z < x) ? x : z",
        ),
        (
            lambda x, y, z: ops.where(((x < y) | (y < z)) & (z < x), x, z),
            "(x < y || y < z) && z < x ? x : z",
        ),
        (lambda x, y, z: ops.clip(x, -1.0, 2.0), "clamp(x, -1.0f, 2.0f)"),
        (lambda x, y, z: ops.absolute(x - y), "fabsf(x - y)"),
        (lambda x, y, z: ops.sqrt(x), "sqrtf(x)"),
        (lambda x, y, z: ops.rsqrt(x), "1.0f / sqrtf(larger(x, 1.1754944e-38f))"),
        (lambda x, y, z: ops.wrap_ht(x), "wrap_half_turns(x)"),
        (lambda x, y, z: ops.atan2_ht(y, x), "wrap_half_turns(0.31830987f * arc_tangent(y, x))"),
        (lambda x, y, z: ops.asin_ht(x), "0.31830987f * asinf(clamp(x, 0.0f, 1.0f))"),
    ],
)
def test_brackets(make, wanted: str) -> None:
    assert text_of(make) == wanted


def test_used_twice_gets_a_variable() -> None:
    tape = Tape()
    x = tape.leaf("input", "x")
    double = x + x
    program = FloatProgram(Nothing(), tape, {"s": double * double}, {"o": double})
    expressions = Expressions(program)
    assert expressions.statements() == ["const float x_i = in->x;", "const float o = x_i + x_i;"]
    assert expressions.text(program.states["s"]) == "o * o"


def test_truth_values_are_bool() -> None:
    tape = Tape()
    x, y = tape.leaf("input", "x"), tape.leaf("input", "y")
    known = x < y
    program = FloatProgram(
        Nothing(), tape, {}, {"a": ops.where(known, x, 1.0), "b": ops.where(known, y, 2.0)}
    )
    lines = Expressions(program).statements()
    assert f"const bool c{known.index} = x_i < y_i;" in lines


def test_helpers_that_are_called() -> None:
    assert float_helpers("clamp(1)").count("static inline") == 1
    assert "floorf" in float_helpers("x = wrap_half_turns(x)")
    assert float_helpers("unclamp(1)") == ""


def test_unknown_operation() -> None:
    tape = Tape()
    odd = tape.new("mod", tape.leaf("input", "x"), tape.const(3.0))
    with pytest.raises(ValueError, match="^C has no counterpart of 'mod'$"):
        Expressions(FloatProgram(Nothing(), tape, {}, {"o": odd})).statements()


def test_values_know_their_place() -> None:
    tape = Tape()
    x = tape.leaf("input", "x")
    assert isinstance(x, Value)
    assert [v.index for v in tape.values] == list(range(len(tape.values)))
