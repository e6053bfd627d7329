"""Exponential, logarithm and hyperbolic tangent: fixed point against float64."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.lowering.expand import EXP_LIMIT
from boresight.model.lowering.trace import Tracer
from tests.support.nodes import node_of

Range = tuple[float, float]


def test_they_undo_each_other(trace: Any) -> None:
    t = trace(lambda x: (ops.log(ops.exp(x)), ops.exp(ops.log(x + 4.0))), [(-2.0, 3.0)])
    x = np.linspace(-2.0, 3.0, 999)
    fixed, _, saturated = t.run(x)
    assert not saturated.any()
    assert np.abs(fixed[0] - x).max() < 2e-7  # e^-2 has so much fewer bits than e^3
    assert np.abs(fixed[1] - x - 4.0).max() < 3e-8


def test_a_largest_result_that_just_fits_its_word_does_not_saturate(trace: Any) -> None:
    most = 1.0 - 2.0**-31
    for function, end in ((ops.exp, math.log(most)), (ops.log, math.exp(most)),
                          (ops.tanh, math.atanh(most))):  # fmt: skip
        for low in (end - 0.1, end - 0.3, end - 0.5):
            x = np.concatenate([np.linspace(low, end, 500), np.full(9, end)])
            assert not trace(function, [(low, end)]).run(x)[2].any()


def test_ranges_follow_from_the_argument() -> None:
    x = Tracer("unit").leaf("input", "x", -1.0, 2.0)
    half = ops.saturated(x + 1.5, 1.0)
    for made, low, high in (
        (ops.exp(x), math.exp(-1.0), math.exp(2.0)),
        (ops.log(x + 2.0), 0.0, math.log(4.0)),
        (ops.tanh(x), -math.tanh(2.0), math.tanh(2.0)),
        (ops.log(half), math.log(0.5), 0.0),
        (ops.sqrt(half), math.sqrt(0.5), 1.0),
        (ops.rsqrt(half), 1.0, 1.0 / math.sqrt(0.5)),
    ):
        node = node_of(made)
        assert low - 1e-7 < node.low <= low and high <= node.high < high + 2e-7


@pytest.mark.parametrize(
    "function, span, wanted",
    [
        (lambda x: ops.rsqrt(0.0 * x - 1.0), (0.0, 1.0), "a root of 0 or more"),
        (lambda x: ops.sqrt(0.0 * x - 1.0), (0.0, 1.0), "a root of 0 or more"),
        (lambda x: ops.rsqrt(0.0 * x), (0.0, 1.0), "a finite range"),
        (ops.exp, (0.0, EXP_LIMIT + 1.0), "an exponent of at most 44, found x0 in"),
        (
            ops.log,
            (0.0, 1.0),
            r"the argument of a logarithm above 0, over at most 2\^31, found x0 in",
        ),
        (ops.log, (-1.0, 1.0), "the argument of a logarithm above 0"),
        (ops.log, (1e-10, 1.0), "the argument of a logarithm above 0"),
        (lambda x: ops.log(x - x - 1.0), (0.0, 1.0), "the argument of a logarithm above 0"),
        (lambda x: ops.log(x - x), (0.0, 1.0), "the argument of a logarithm above 0"),
    ],
)
def test_what_has_no_word(trace: Any, function: Any, span: Range, wanted: str) -> None:
    with pytest.raises(InputError, match=rf"^test_expand\.py, line \d+: wanted {wanted}"):
        trace(lambda x: function(x), [span])


def test_constants_are_correctly_rounded() -> None:
    """As plain numbers are, however they get into the program."""
    g = Tracer("unit")
    for function in (ops.rsqrt, ops.sqrt, ops.asin_ht):
        assert node_of(function(g.const(0.3))).value == function(0.3)
    assert [node_of(n).value for n in ops.sincos_ht(g.const(0.1))] == [*ops.sincos_ht(0.1)]
    assert [node_of(ops.asin_ht(g.const(x))).value for x in (-1.0, 7.0)] == [0.0, 0.5]
    made = [ops.exp(g.const(0.3)), ops.log(g.const(0.3)), ops.tanh(g.const(0.3))]
    plain = [ops.exp(0.3), ops.log(0.3), ops.tanh(0.3)]
    assert [node_of(n).value for n in made] == plain
    assert np.allclose(plain, [math.exp(0.3), math.log(0.3), math.tanh(0.3)], rtol=3e-16)
    assert all(type(x) is float for x in plain)
