"""Polynomials for functions on one binade, through the Chebyshev nodes of an interval.

Coefficients are computed with `model.words.rounded.PRECISE` and rounded once to float64.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

from boresight.model.words.rounded import PRECISE


def interpolated(function: Callable[[Any], Any], reach: float, count: int) -> tuple[float, ...]:
    """Coefficients of 1, x, x^2, ... of the polynomial through Chebyshev nodes.

    Parameters
    ----------
    function : callable
        Of numbers of `PRECISE`.
    reach : float
        The polynomial is for arguments in [-reach, reach].
    count : int
        Number of coefficients.
    """
    nodes = [reach * PRECISE.cospi(PRECISE.mpf(2 * k + 1) / (2 * count)) for k in range(count)]
    powers = PRECISE.matrix([[x**k for k in range(count)] for x in nodes])
    coefficients = PRECISE.lu_solve(powers, PRECISE.matrix([function(x) for x in nodes]))
    return tuple(float(c) for c in coefficients)


@cache
def exp2() -> tuple[float, ...]:
    """2^(x - 1/2) of x in [-1/2, 1/2): [1/2, 1)."""
    return interpolated(lambda x: PRECISE.mpf(2) ** (x - 0.5), 0.5, 8)


@cache
def log() -> tuple[float, ...]:
    """log((x + 3) / 4) of x in [-1, 1): the logarithm of [1/2, 1)."""
    return interpolated(lambda x: PRECISE.log((x + 3) / 4), 1.0, 12)
