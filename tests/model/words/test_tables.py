"""Tables, polynomials and rounded constants."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp
from numpy.polynomial import polynomial

from boresight.model import ops
from boresight.model.words.fixed import Arithmetic
from boresight.model.words.rounded import exp2, log
from boresight.model.words.tables import (
    BLOCK_WORDS,
    TABLES,
    Table,
    coefficient_formats,
    table_memory,
)

# -- function tables against numpy's float64 functions --------------------------------------------

#: Largest error of the cubic alone (coefficients in float64), in the function's unit.
CUBIC = {"sin": 1.3e-10, "rsqrt": 4.0e-9, "asin": 7.7e-10, "reciprocal": 9.4e-10}

#: The same functions by numpy.
FUNCTIONS: dict[str, Any] = {
    "sin": lambda x: np.sin(np.pi * x),
    "rsqrt": lambda m: 1.0 / np.sqrt(m),
    "asin": lambda v: np.arcsin(v) / np.pi,
    "reciprocal": lambda m: 1.0 / m,
}


def domain(table: Table, count: int = 60_000) -> Any:
    """Arguments over all segments in use, dense, with the borders."""
    x = np.linspace(table.first, table.last + 1, count, endpoint=False) / table.segments_per_unit
    borders = np.arange(table.first, table.last + 1) / table.segments_per_unit
    return np.sort(np.concatenate([x, borders, np.nextafter(borders[1:], 0.0)]))


def cubic(c: Any, table: Table, x: Any) -> Any:
    """The piecewise cubic with coefficients ``c`` in float64."""
    position = x * table.segments_per_unit
    segment = np.minimum(np.floor(position).astype(int), table.last)
    p = position - segment
    return (c[segment - table.first] * np.stack([p**0, p, p**2, p**3], axis=1)).sum(axis=1)


@pytest.mark.parametrize("table", TABLES, ids=lambda t: t.name)
def test_the_cubic_is_within_its_bound(table: Table) -> None:
    x = domain(table)
    error = np.abs(cubic(table.coefficients, table, x) - FUNCTIONS[table.name](x)).max()
    assert 0.8 * CUBIC[table.name] < error < CUBIC[table.name]


#: The same functions to any precision.
PRECISE: dict[str, Any] = {
    "sin": mp.sinpi,
    "rsqrt": lambda m: 1 / mp.sqrt(m),
    "asin": lambda v: mp.asin(v) / mp.pi,
    "reciprocal": lambda m: 1 / m,
}


def exact(table: Table, segment: int) -> Any:
    """Coefficients of 1, p, p^2, p^3 to 60 digits: the cubic through four Chebyshev nodes."""
    with mp.workdps(60):
        nodes = [(1 - mp.cospi(mp.mpf(2 * k + 1) / 8)) / 2 for k in range(4)]
        y = [PRECISE[table.name]((segment + p) / table.segments_per_unit) for p in nodes]
        return mp.lu_solve(mp.matrix([[p**k for k in range(4)] for p in nodes]), mp.matrix(y))


@pytest.mark.parametrize("table", TABLES, ids=lambda t: t.name)
def test_coefficients_are_correctly_rounded(table: Table) -> None:
    c = table.coefficients
    assert c.shape == (table.last - table.first + 1, 4) and not c.flags.writeable
    for segment in range(table.first, table.last + 1):
        wanted = [float(x) for x in exact(table, segment)]
        assert c[segment - table.first].tolist() == wanted, segment


@pytest.mark.parametrize("table", TABLES, ids=lambda t: t.name)
def test_words_of_the_table_are_the_nearest(table: Table) -> None:
    arith = Arithmetic(word=32)
    memory = np.array(table_memory(arith)).reshape(3, BLOCK_WORDS // 4, 4)
    formats = coefficient_formats(table, arith)
    for segment in range(table.first, table.last + 1):
        for k, x in enumerate(exact(table, segment)):
            word = math.floor(mp.ldexp(x, formats[k].frac) + 0.5)
            assert memory[table.block, segment, k] == min(word, arith.max_int)


# -- functions of plain numbers are correctly rounded ----------------------------------------------


@given(*[st.integers(-(2**40), 2**40).map(lambda k: k / 2**30)] * 2)
def test_angles_of_vectors(y: float, x: float) -> None:
    angle = ops.atan2_ht(y, x)
    assert angle == pytest.approx(math.atan2(y + 0.0, x + 0.0) / math.pi, rel=1e-15, abs=0.0)


@pytest.mark.parametrize(
    ("function", "precise", "inside"),
    [
        (lambda x: ops.sincos_ht(x)[0], mp.sinpi, st.floats(-4.0, 4.0)),
        (lambda x: ops.sincos_ht(x)[1], mp.cospi, st.floats(-4.0, 4.0)),
        (ops.asin_ht, PRECISE["asin"], st.floats(0.0, 1.0)),
        (ops.rsqrt, PRECISE["rsqrt"], st.floats(1e-300, 1e300)),
        (ops.log, mp.log, st.one_of(st.floats(1e-300, 1e300), st.floats(0.999, 1.001))),
        (ops.exp, mp.exp, st.floats(-700.0, 700.0)),
        (ops.tanh, mp.tanh, st.floats(-18.0, 18.0)),
    ],
)
@given(st.data())
def test_no_float_is_nearer(function: Any, precise: Any, inside: Any, data: Any) -> None:
    x = data.draw(inside)
    y = function(x)
    with mp.workprec(1200):
        exact = precise(mp.mpf(x))
        for way in (-math.inf, math.inf):
            assert abs(exact - y) <= abs(exact - math.nextafter(y, way))


def test_exact_values() -> None:
    circle = [ops.sincos_ht(k / 2) for k in range(-2, 3)]
    assert circle == [(0.0, -1.0), (-1.0, 0.0), (0.0, 1.0), (1.0, 0.0), (0.0, -1.0)]
    assert [ops.asin_ht(x) for x in (-1.0, 0.0, 1.0, 7.0)] == [0.0, 0.0, 0.5, 0.5]
    quarters = [ops.atan2_ht(y, x) for y, x in ((0, 1), (1, 1), (1, 0), (0, -1), (-1, -1))]
    assert quarters == [0.0, 0.25, 0.5, -1.0, -0.75]
    assert ops.atan2_ht(0.0, 0.0) == 0.0 and ops.atan2_ht(-0.0, -1.0) == -1.0
    assert ops.rsqrt(0.25) == 2.0 and ops.rsqrt(0.0) == ops.rsqrt(1e-300) and ops.log(1.0) == 0.0


# -- polynomials on one binade, against the functions ---------------------------------------------


def test_the_shipped_ones_are_finer_than_a_word() -> None:
    x = np.linspace(-1.0, 1.0, 4001)
    assert np.abs(polynomial.polyval(0.5 * x, exp2()) - 2.0 ** (0.5 * x - 0.5)).max() < 7e-11
    assert np.abs(polynomial.polyval(x, log()) - np.log((x + 3.0) / 4.0)).max() < 2.5e-10
    assert len(exp2()) % 2 == len(log()) % 2 == 0  # they are computed in pairs
