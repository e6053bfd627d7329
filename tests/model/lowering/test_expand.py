"""Exponential, logarithm and hyperbolic tangent: fixed point against float64."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from boresight.model import ops
from boresight.model.errors import InputError
from boresight.model.lowering.graph import EXP_LIMIT
from boresight.model.lowering.trace import Tracer
from tests.support.nodes import node_of

Range = tuple[float, float]


def _points(low: float, high: float, word: int) -> Any:
    rng = np.random.default_rng(word)
    x = np.concatenate([rng.uniform(low, high, 1500), np.linspace(low, high, 129)])
    return np.concatenate([x, rng.uniform(max(low, -25.0), min(high, 25.0), 500)])


@pytest.mark.parametrize("word", [18, 25, 32])
@pytest.mark.parametrize(
    "span",
    [
        (-1.0, 1.0),
        (-20.0, 0.0),
        (-800.0, -0.1),
        (0.0, 3.0),
        (5.0, 5.5),
        (-40.0, 44.0),
        (-0.01, 0.01),
    ],
)
def test_exp(trace: Any, span: Range, word: int) -> None:
    """Relative to the largest result; in words of 32 bits what the operations page states."""
    t = trace(ops.exp, [span], word)
    fixed, floats, saturated = t.run(_points(*span, word))
    largest, size = math.exp(span[1]), max(map(abs, (max(span[0], -25.0), span[1])))
    assert not saturated.any()
    bound = 1.3e-9 + 2e-10 * size
    if word < 32:
        bound = (12.0 + 1.5 * size) * 2.0**-word + 3e-10
    assert np.abs(fixed[0] - floats[0]).max() < bound * largest
    assert fixed[0].min() >= 0.0


@pytest.mark.parametrize("word", [18, 25, 32])
@pytest.mark.parametrize(
    "span", [(0.5, 2.0), (1.0, 1.9), (3.0, 4.0), (0.25, 0.5), (1e-3, 1.0), (0.02, 50.0)]
)
def test_log(trace: Any, span: Range, word: int) -> None:
    """Besides a last bit of the result, those of the argument that the word holds are all seen."""
    t = trace(ops.log, [span], word)
    low, high = span
    x = np.exp(np.random.default_rng(word).uniform(math.log(low), math.log(high), 2000))
    fixed, floats, saturated = t.run(
        np.concatenate([x, span, [0.5 * (low + high)]]).clip(low, high)
    )
    assert not saturated.any()
    assert np.abs(fixed[0] - floats[0]).max() < 2.0 * t.formats()[0].lsb + 3.0 * 2.0**-word + 5e-10


def test_a_logarithm_over_31_binades(trace: Any) -> None:
    t = trace(ops.log, [(1.0, 2.0**31)])
    x = 2.0 ** np.random.default_rng(5).uniform(1.0, 31.0, 2000)
    fixed, floats, saturated = t.run(np.concatenate([x, [2.0**k for k in range(1, 32)]]))
    assert not saturated.any() and np.abs(fixed[0] - floats[0]).max() < 1.1e-8


@pytest.mark.parametrize("word", [18, 25, 32])
@pytest.mark.parametrize(
    "span", [(-1.0, 1.0), (-30.0, 30.0), (-12.0, 12.0), (-4.0, 2.0), (0.0, 2.0), (-3.0, -1.0)]
)
def test_tanh(trace: Any, span: Range, word: int) -> None:
    t = trace(ops.tanh, [span], word)
    fixed, floats, saturated = t.run(_points(*span, word))
    assert not saturated.any()
    assert np.abs(fixed[0] - floats[0]).max() < 14.0 * 2.0**-word + 1e-9
    assert np.all(np.sign(fixed[0]) * floats[0] >= 0.0)


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
