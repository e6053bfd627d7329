"""Functions of numbers, correctly rounded: the same bits on every machine.

IEEE 754 fixes ``+ - * /`` and the square root to the last bit, nothing else. Sines, arc sines and
logarithms of C libraries, of numpy's vector code and sums of a BLAS differ in last bits between
processors and versions, so nothing that becomes part of a program may come from them
(``docs/decisions.md``). These functions compute with `PRECISE`, whose
arithmetic is that of integers, and rounded once.
"""

from __future__ import annotations

import math
from typing import Any

from mpmath import MPContext

__all__ = [
    "LN_2",
    "LOG2_E",
    "PRECISE",
    "asin_ht",
    "atan2_ht",
    "binary_exponent",
    "cos_ht",
    "exp",
    "log",
    "rsqrt",
    "sin_ht",
    "tanh",
]

#: Bits of intermediate results: twice what the hardest case of a float64 function needs.
_BITS = 256

#: Arithmetic with `_BITS` bits, in a context of its own whose precision no other module changes.
PRECISE: Any = MPContext()
PRECISE.prec = _BITS

#: Natural logarithm of 2, and its reciprocal.
LN_2 = float(PRECISE.ln2)
LOG2_E = float(1 / PRECISE.ln2)


def sin_ht(x: float) -> float:
    """sin(pi x)."""
    return float(PRECISE.sinpi(x))


def cos_ht(x: float) -> float:
    """cos(pi x)."""
    return float(PRECISE.cospi(x))


def asin_ht(x: float) -> float:
    """asin(x) / pi of x in [-1, 1]."""
    return float(PRECISE.asin(x) / PRECISE.pi)


def atan2_ht(y: float, x: float) -> float:
    """Angle of the vector (x, y) over pi, (-1, 1]; of the zero vector 0."""
    return float(PRECISE.atan2(y, x) / PRECISE.pi) if x or y else 0.0


def rsqrt(x: float) -> float:
    """1 / sqrt(x) of x > 0."""
    return float(1 / PRECISE.sqrt(x))


def log(x: float) -> float:
    """Natural logarithm of x > 0."""
    return float(PRECISE.log(x))


def exp(x: float) -> float:
    """e^x."""
    return float(PRECISE.exp(x))


def tanh(x: float) -> float:
    """Hyperbolic tangent."""
    return float(PRECISE.tanh(x))


def binary_exponent(x: float) -> int:
    """The largest k with 2^k <= abs(x), of x other than 0."""
    return math.frexp(x)[1] - 1
