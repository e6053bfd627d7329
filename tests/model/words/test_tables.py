"""Tables, polynomials and rounded constants."""

import math
from decimal import Decimal, getcontext
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp
from numpy.polynomial import polynomial

from boresight.model import ops
from boresight.model.words.fixed import Arithmetic, fraction, table_index
from boresight.model.words.polynomials import exp2, log
from boresight.model.words.tables import (
    BLOCK_WORDS,
    SIN,
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


def quantisation(table: Table, arith: Any) -> Any:
    """Largest effect of rounding the coefficients, all of one sign at worst."""
    formats = coefficient_formats(table, arith)
    c0 = table.coefficients()[:, 0].max()
    return sum(0.5 * f.lsb for f in formats) + 0.5 * formats[0].lsb * (
        c0 > formats[0].max
    )  # a range that ends at a power of two


def cubic(c: Any, table: Table, x: Any) -> Any:
    """The piecewise cubic with coefficients ``c`` in float64."""
    position = x * table.segments_per_unit
    segment = np.minimum(np.floor(position).astype(int), table.last)
    p = position - segment
    return (c[segment - table.first] * np.stack([p**0, p, p**2, p**3], axis=1)).sum(axis=1)


@pytest.mark.parametrize("table", TABLES, ids=lambda t: t.name)
def test_the_cubic_is_within_its_bound(table: Table) -> None:
    x = domain(table)
    error = np.abs(cubic(table.coefficients(), table, x) - FUNCTIONS[table.name](x)).max()
    assert 0.8 * CUBIC[table.name] < error < CUBIC[table.name]


@pytest.mark.parametrize("word", range(18, 33))
@pytest.mark.parametrize("table", TABLES, ids=lambda t: t.name)
def test_quantised_coefficients_cost_little(table: Table, word: int) -> None:
    arith = Arithmetic(word=word)
    formats = coefficient_formats(table, arith)
    memory = np.array(table_memory(arith)).reshape(-1, BLOCK_WORDS // 4, 4)
    words = memory[table.block, table.first : table.last + 1]
    c = np.stack([f.real(words[:, k]) for k, f in enumerate(formats)], axis=1)
    assert quantisation(table, arith) < 1.1 * table.result_format(arith).lsb
    x = domain(table, 20_000)
    error = np.abs(cubic(c, table, x) - FUNCTIONS[table.name](x)).max()
    assert error < CUBIC[table.name] + quantisation(table, arith)


@pytest.mark.parametrize("word", [18, 24, 32])
@pytest.mark.parametrize("table", TABLES, ids=lambda t: t.name)
def test_segments_meet_at_their_borders(table: Table, word: int) -> None:
    c = table.coefficients()
    end, start = c[:-1].sum(axis=1), c[1:, 0]
    assert np.abs(end - start).max() < 2 * CUBIC[table.name]
    formats = coefficient_formats(table, Arithmetic(word=word))
    quantised = np.stack([f.real(f.quantise(c[:, k])) for k, f in enumerate(formats)], axis=1)
    jump = np.abs(quantised[:-1].sum(axis=1) - quantised[1:, 0]).max()
    assert jump < 2 * CUBIC[table.name] + 2 * quantisation(table, Arithmetic(word=word))


@pytest.mark.parametrize("word", range(18, 33))
def test_coefficients_fit_their_formats_unsaturated(word: int) -> None:
    arith = Arithmetic(word=word)
    for table in TABLES:
        for fmt, column in zip(
            coefficient_formats(table, arith), table.coefficients().T, strict=True
        ):
            assert fmt.min <= column.min() and column.max() <= fmt.max + 2 * fmt.lsb
            assert fmt.frac <= table.result_format(arith).frac + arith.guard


@pytest.mark.parametrize("word", [18, 24, 32])
def test_words_within_the_domain_reach_their_own_segment(word: int) -> None:
    arith = Arithmetic(word=word)
    for table in TABLES:
        # segments_per_unit 128: argument word 2^(W-1); 64: 2^(W-2)
        scale = table.segments_per_unit << arith.fraction_bits
        x = domain(table, 500)
        words = np.floor(x * scale).astype(np.int64)
        index = table_index(words, arith, False)
        assert index.min() == table.first and index.max() == table.last
        rebuilt = index + fraction(words, arith) / (1 << arith.fraction_bits)
        assert np.abs(rebuilt / table.segments_per_unit - x).max() < 1.0 / scale


def test_bounds_of_the_results_are_declared() -> None:
    for table in TABLES:
        y = [table.at(segment) for segment in range(table.first, table.last + 2)]
        assert table.low <= min(y) and max(y) <= table.high  # and monotonic in between
        fmt = table.result_format(Arithmetic(word=32))
        assert table.high <= fmt.max + fmt.lsb
    assert SIN.at(64) == 1.0


def exact(table: Table, segment: int) -> list[Fraction]:
    """Coefficients of 1, p, p^2, p^3 in rational arithmetic, from 60 decimals of the function."""
    getcontext().prec = 60
    nodes = [(1 - cos(pi() * (2 * k + 1) / 8)) / 2 for k in range(4)]
    y = [DECIMAL[table.name]((segment + p) / Decimal(table.segments_per_unit)) for p in nodes]
    # Newton's divided differences, then powers of p.
    slopes = [Fraction(v) for v in y]
    x = [Fraction(p) for p in nodes]
    for order in range(1, 4):
        for k in range(3, order - 1, -1):
            slopes[k] = (slopes[k] - slopes[k - 1]) / (x[k] - x[k - order])
    c = [Fraction(0)] * 4
    for k in range(3, -1, -1):
        c = [(c[j - 1] if j else 0) - x[k] * c[j] for j in range(4)]
        c[0] += slopes[k]
    return c


def pi() -> Decimal:
    """Machin's formula."""

    def arctan_inverse(n: int) -> Decimal:
        return sum(
            (Decimal((-1) ** k) / ((2 * k + 1) * n ** (2 * k + 1)) for k in range(50)), Decimal()
        )

    return 16 * arctan_inverse(5) - 4 * arctan_inverse(239)


def cos(x: Decimal) -> Decimal:
    """Taylor's series."""
    return sum(
        (Decimal((-1) ** k) * x ** (2 * k) / math.factorial(2 * k) for k in range(40)), Decimal()
    )


def arcsin(x: Decimal) -> Decimal:
    """Newton's method on the sine."""
    angle = Decimal(math.asin(x))
    for _ in range(4):
        angle += (x - cos(angle - pi() / 2)) / cos(angle)
    return angle


#: The same functions to 60 decimals.
DECIMAL: dict[str, Any] = {
    "sin": lambda x: cos(pi() * (x - Decimal("0.5"))),
    "rsqrt": lambda m: 1 / m.sqrt(),
    "asin": lambda v: arcsin(v) / pi(),
    "reciprocal": lambda m: 1 / m,
}


@pytest.mark.parametrize("table", TABLES, ids=lambda t: t.name)
def test_coefficients_are_correctly_rounded(table: Table) -> None:
    c = table.coefficients()
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
            word = math.floor(x * Fraction(2) ** formats[k].frac + Fraction(1, 2))
            assert memory[table.block, segment, k] == min(word, arith.max_int)


# -- correctly rounded functions: against 60 decimals, on hard and on exact cases -----------------

#: pi to 50 digits.
PI = Fraction(31415926535897932384626433832795028841971693993751, 10**49)


def sine(x: Fraction) -> Fraction:
    """sin of |x| < 4 by its series, to 60 decimals."""
    unit = 10**64
    z = int(x * unit)
    total = term = z
    for k in range(2, 80, 2):
        term = -term * z // unit * z // unit // (k * (k + 1))
        total += term
    return Fraction(total, unit)


def nearest(result: float, exact: Fraction) -> bool:
    """Whether no other float64 is nearer to ``exact``."""
    error = abs(Fraction(result) - exact)
    around = [math.nextafter(result, way) for way in (-math.inf, math.inf)]
    return all(error <= abs(Fraction(x) - exact) for x in around)


@given(st.integers(-(2**40), 2**40).map(lambda k: k / 2**40))
def test_sine_and_cosine(x: float) -> None:
    if 1e-9 < abs(x) < 1.0 - 1e-9:
        assert nearest(ops.sincos_ht(x)[0], sine(PI * Fraction(x)))
    if abs(abs(x) - 0.5) > 1e-9:
        assert nearest(ops.sincos_ht(x)[1], sine(PI * (Fraction(1, 2) - abs(Fraction(x)))))


@given(st.floats(0.0, 1.0))
def test_arc_sine_inverts_the_sine(x: float) -> None:
    """The halves of the way to the neighbours have sines on either side of x."""
    y = ops.asin_ht(x)
    below = (Fraction(y) + Fraction(math.nextafter(y, -1.0))) / 2
    above = (Fraction(y) + Fraction(math.nextafter(y, 1.0))) / 2
    if 1e-6 < x < 0.999:
        assert sine(PI * below) < Fraction(x) < sine(PI * above)


@given(st.floats(1e-300, 1e300))
def test_inverse_root(x: float) -> None:
    y = ops.rsqrt(x)
    low, high = ((Fraction(y) + Fraction(math.nextafter(y, to))) / 2 for to in (0.0, math.inf))
    assert low * low * Fraction(x) < 1 < high * high * Fraction(x)


@given(*[st.integers(-(2**40), 2**40).map(lambda k: k / 2**30)] * 2)
def test_angles_of_vectors(y: float, x: float) -> None:
    angle = ops.atan2_ht(y, x)
    assert angle == pytest.approx(math.atan2(y + 0.0, x + 0.0) / math.pi, rel=1e-15, abs=0.0)


@pytest.mark.parametrize(
    "name, inside",
    [
        ("log", st.one_of(st.floats(1e-300, 1e300), st.floats(0.999, 1.001))),
        ("exp", st.floats(-700.0, 700.0)),
        ("tanh", st.floats(-18.0, 18.0)),
    ],
)
@given(st.data())
def test_the_nearest_of_all_floats(name: str, inside: Any, data: Any) -> None:
    x = data.draw(inside)
    y = getattr(ops, name)(x)
    with mp.workprec(1200):
        exact = getattr(mp, name)(x)
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
