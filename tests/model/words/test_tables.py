"""Function tables against numpy's float64 functions."""

import math
from decimal import Decimal, getcontext
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from boresight.model.words.fixed import Arithmetic, fraction, table_index
from boresight.model.words.tables import (
    ASIN,
    BLOCK_WORDS,
    RECIPROCAL,
    RSQRT,
    SIN,
    TABLES,
    Table,
    coefficient_formats,
    table_memory,
)

#: Largest error of the cubic alone (coefficients in float64), in the function's unit.
CUBIC = {"sin": 1.3e-10, "rsqrt": 4.0e-9, "asin": 6.6e-10, "reciprocal": 9.4e-10}

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
def test_unused_segments_hold_the_nearest_edge(word: int) -> None:
    arith = Arithmetic(word=word)
    memory = np.array(table_memory(arith)).reshape(3, BLOCK_WORDS // 4, 4)
    assert len(table_memory(arith)) == 3 * BLOCK_WORDS
    for block, unused, table, edge in (
        (1, slice(0, RSQRT.first), RSQRT, 2.0),
        (2, slice(ASIN.last + 1, RECIPROCAL.first), ASIN, 0.25),
    ):
        c0 = coefficient_formats(table, arith)[0]
        assert np.all(memory[block, unused, 1:] == 0)
        assert np.abs(c0.real(memory[block, unused, 0]) - edge).max() <= c0.lsb
    used = np.zeros((3, 128), dtype=bool)
    for table in TABLES:
        assert not used[table.block, table.first : table.last + 1].any()
        used[table.block, table.first : table.last + 1] = True
    assert np.all(memory[used].any(axis=-1))


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
