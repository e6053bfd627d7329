"""Arithmetic for constants that are the same bits on every machine.

IEEE 754 fixes ``+ - * /`` and the square root to the last bit, nothing else. Sines, arc sines and
logarithms of C libraries, of numpy's vector code and sums of a BLAS differ in last bits between
processors and versions, so nothing that becomes part of a program may come from them
(``docs/decisions.md``). Constants are computed with `PRECISE`, whose arithmetic
is that of integers, and rounded once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from functools import cache
from typing import Any

from mpmath import MPContext

#: Bits of intermediate results: twice what the hardest case of a float64 function needs.
_BITS = 256

#: Arithmetic with `_BITS` bits, in a context of its own whose precision no other module changes.
PRECISE: Any = MPContext()
PRECISE.prec = _BITS

#: Natural logarithm of 2, and its reciprocal.
LN_2 = float(PRECISE.ln2)
LOG2_E = float(1 / PRECISE.ln2)


def sum_of(parts: Iterable[Any]) -> Any:
    """Sum of numbers or values of a step, from the left.

    Python's `sum` compensates sums of floats from 3.12 on.
    """
    total: Any = 0.0
    for part in parts:
        total = total + part
    return total


def binary_exponent(x: float) -> int:
    """The largest k with 2^k <= abs(x), of x other than 0."""
    return math.frexp(x)[1] - 1


def _interpolated(function: Callable[[Any], Any], reach: float, count: int) -> tuple[float, ...]:
    """Coefficients of 1, x, x^2, ... through the Chebyshev nodes of [-reach, reach]."""
    nodes = [reach * PRECISE.cospi(PRECISE.mpf(2 * k + 1) / (2 * count)) for k in range(count)]
    powers = PRECISE.matrix([[x**k for k in range(count)] for x in nodes])
    coefficients = PRECISE.lu_solve(powers, PRECISE.matrix([function(x) for x in nodes]))
    return tuple(float(c) for c in coefficients)


@cache
def exp2() -> tuple[float, ...]:
    """2^(x - 1/2) of x in [-1/2, 1/2): [1/2, 1)."""
    return _interpolated(lambda x: PRECISE.mpf(2) ** (x - 0.5), 0.5, 8)


@cache
def log() -> tuple[float, ...]:
    """log((x + 3) / 4) of x in [-1, 1): the logarithm of [1/2, 1)."""
    return _interpolated(lambda x: PRECISE.log((x + 3) / 4), 1.0, 12)
