"""Look-ups expanded by hand: right to the table's last bits, and never twice."""

import numpy as np
import pytest

from boresight.model.lowering.forms import Form, Product
from boresight.model.lowering.functions import Functions
from boresight.model.lowering.groups import Groups, Target
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.interpreter import Interpreter
from boresight.model.words.program import Kind, Overflow, Program, Scale, Value
from boresight.model.words.tables import ASIN, RSQRT, SIN, table_memory

WORD = 32


class Expanded:
    """Groups with one input ``x`` of a binary point, and what functions make of it."""

    def __init__(self, frac: int, low: float) -> None:
        self.groups = Groups("test", Arithmetic(WORD))
        self.x = self.groups.value(Value("x", Kind.INPUT, frac, low, 2.0 ** (31 - frac), "test"))
        self.functions = Functions(self.groups)

    def run(self, form: Form, low: float, high: float, words):
        g = self.groups
        out = g.group(form, Target("y", low, high, "test", overflow=Overflow.CLIP))
        program = Program(
            "test", g.arith, tuple(g.values), tuple(g.ops), (self.x,), (out,), ("y",), (),
            table_memory(g.arith),
        )  # fmt: skip
        (y,), saturated = Interpreter(program, len(words)).update(words[None])
        assert not saturated.any()
        return np.ldexp(y.astype(float), -g.frac(out))


@pytest.mark.parametrize(
    ("table", "frac", "quarter", "function", "high"),
    [
        (SIN, 31, False, lambda x: np.sin(np.pi * x), 0.999),
        (SIN, 31, True, lambda x: np.cos(np.pi * x), 0.49),
        (ASIN, 30, False, lambda x: np.arcsin(x) / np.pi, 0.7),
    ],
)
def test_cubics(table, frac: int, quarter: bool, function, high: float) -> None:
    e = Expanded(frac, 0.0)
    words = np.ldexp(np.linspace(0.0, high, 4001), frac).astype(np.int64)
    form = Form(e.functions.cubic(table, e.x, quarter))
    result = e.run(form, 0.0, 1.0, words)
    np.testing.assert_allclose(result, function(np.ldexp(words.astype(float), -frac)), atol=4e-9)


@pytest.mark.parametrize(
    ("kind", "scale", "frac", "low", "function"),
    [
        ("rsqrt", Scale.HALF, 21, 0.0, lambda x: 1 / np.sqrt(x)),
        ("rsqrt", Scale.HALF, 41, 0.0, lambda x: 1 / np.sqrt(x)),
        ("reciprocal", Scale.FULL, 20, 0.0, lambda x: 1 / x),
        ("reciprocal", Scale.FULL, 41, -1.0, lambda x: 1 / np.abs(x)),
    ],
)
def test_mantissas_and_exponents(kind: str, scale: Scale, frac: int, low: float, function) -> None:
    """Over a range of 2^6 of the argument, either sign where it may have one."""
    e = Expanded(frac, low)
    m, exponent = e.functions.mantissa(kind, e.x)
    words = np.geomspace(2.0**22, 2.0**28, 2001).astype(np.int64)
    words[::2] *= -1 if low < 0.0 else 1
    wanted = function(np.ldexp(words.astype(float), -frac))
    form = Form([Product(m, scale=scale, exponent=exponent)], norm=e.x)
    result = e.run(form, 0.0, 1.01 * wanted.max(), words)
    np.testing.assert_allclose(result / wanted, 1.0, atol=1e-7)


def test_ranges_of_the_two_sums() -> None:
    """Each is linear in a segment: its extremes are at the ends."""
    e = Expanded(31, 0.0)
    w, t = e.functions.cubic(RSQRT, e.x, False)
    c = RSQRT.coefficients()
    for part, first in ((w, 0), (t, 2)):
        ends, value = [c[:, first], c[:, first] + c[:, first + 1]], e.groups.values[part.a]
        assert (value.low, value.high) == (np.min(ends), np.max(ends))


@pytest.mark.parametrize(
    ("kind", "low", "signed"),
    [("rsqrt", -1.0, False), ("reciprocal", 0.0, False), ("reciprocal", -1.0, True)],
)
def test_a_sign_is_taken_off_where_there_may_be_one(kind: str, low: float, signed: bool) -> None:
    e = Expanded(30, low)
    e.functions.mantissa(kind, e.x)
    assert any(op.flag is not None for op in e.groups.ops) is signed


def test_the_same_function_of_the_same_word_is_expanded_once() -> None:
    e = Expanded(31, -1.0)
    first = e.functions.cubic(SIN, e.x, False)
    count = len(e.groups.ops)
    assert count == 3 and e.functions.cubic(SIN, e.x, False) == first
    assert len(e.groups.ops) == count
    # Another function, or a quarter of a turn on, shares the square and makes its own two sums.
    other = e.functions.cubic(SIN, e.x, True)
    assert len(e.groups.ops) == count + 2 and other[1].b == first[1].b and other != first
    root = e.functions.mantissa("reciprocal", e.x)
    count = len(e.groups.ops)
    assert e.functions.mantissa("reciprocal", e.x) == root and len(e.groups.ops) == count
