"""Correctly rounded functions: against 60 decimals, on hard and on exact cases."""

import math
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp

from boresight.model.words import rounded

#: pi to 50 digits.
PI = Fraction(31415926535897932384626433832795028841971693993751, 10**49)


def sine(x: Fraction) -> Fraction:
    """sin of |x| < 4 by its series, to 60 decimals."""
    one = 10**64
    z = int(x * one)
    total = term = z
    for k in range(2, 80, 2):
        term = -term * z // one * z // one // (k * (k + 1))
        total += term
    return Fraction(total, one)


def nearest(result: float, exact: Fraction) -> bool:
    """Whether no other float64 is nearer to ``exact``."""
    error = abs(Fraction(result) - exact)
    around = [math.nextafter(result, way) for way in (-math.inf, math.inf)]
    return all(error <= abs(Fraction(x) - exact) for x in around)


@given(st.integers(-(2**40), 2**40).map(lambda k: k / 2**40))
def test_sine_and_cosine(x: float) -> None:
    if 1e-9 < abs(x) < 1.0 - 1e-9:
        assert nearest(rounded.sin_ht(x), sine(PI * Fraction(x)))
    if abs(abs(x) - 0.5) > 1e-9:
        assert nearest(rounded.cos_ht(x), sine(PI * (Fraction(1, 2) - abs(Fraction(x)))))


@given(st.floats(-1.0, 1.0))
def test_arc_sine_inverts_the_sine(x: float) -> None:
    """The halves of the way to the neighbours have sines on either side of x."""
    y = rounded.asin_ht(x)
    below = (Fraction(y) + Fraction(math.nextafter(y, -1.0))) / 2
    above = (Fraction(y) + Fraction(math.nextafter(y, 1.0))) / 2
    if 1e-6 < abs(x) < 0.999:
        assert sine(PI * below) < Fraction(x) < sine(PI * above)


@given(st.floats(1e-300, 1e300))
def test_inverse_root(x: float) -> None:
    y = rounded.rsqrt(x)
    low, high = ((Fraction(y) + Fraction(math.nextafter(y, to))) / 2 for to in (0.0, math.inf))
    assert low * low * Fraction(x) < 1 < high * high * Fraction(x)


@given(*[st.integers(-(2**40), 2**40).map(lambda k: k / 2**30)] * 2)
def test_angles_of_vectors(y: float, x: float) -> None:
    angle = rounded.atan2_ht(y, x)
    assert angle == pytest.approx(math.atan2(y + 0.0, x + 0.0) / math.pi, rel=1e-15, abs=0.0)


@given(st.one_of(st.floats(1e-300, 1e300), st.floats(0.999, 1.001)))
def test_logarithm(x: float) -> None:
    y = rounded.log(x)
    assert y == pytest.approx(math.log(x), rel=4e-16, abs=0.0)
    with mp.workprec(1000):
        exact = mp.log(x)
        for way in (-math.inf, math.inf):
            assert abs(exact - y) <= abs(exact - math.nextafter(y, way))


def test_exact_values() -> None:
    assert [rounded.sin_ht(k / 2) for k in range(-2, 3)] == [0.0, -1.0, 0.0, 1.0, 0.0]
    assert [rounded.cos_ht(k / 2) for k in range(-2, 3)] == [-1.0, 0.0, 1.0, 0.0, -1.0]
    assert [rounded.asin_ht(x) for x in (-1.0, 0.0, 1.0)] == [-0.5, 0.0, 0.5]
    quarters = [rounded.atan2_ht(y, x) for y, x in ((0, 1), (1, 1), (1, 0), (0, -1), (-1, -1))]
    assert quarters == [0.0, 0.25, 0.5, 1.0, -0.75]
    assert rounded.atan2_ht(0.0, 0.0) == 0.0
    assert rounded.rsqrt(0.25) == 2.0 and rounded.log(1.0) == 0.0


def test_the_precision_is_nobody_elses() -> None:
    before = rounded.sin_ht(0.1)
    with mp.workdps(3):
        assert rounded.sin_ht(0.1) == before
    assert rounded.PRECISE.prec == 256


@given(st.floats(allow_nan=False, allow_infinity=False).filter(bool))
def test_binary_exponent(x: float) -> None:
    k = rounded.binary_exponent(x)
    assert Fraction(2) ** k <= abs(Fraction(x)) < Fraction(2) ** (k + 1)
