"""Polynomials on one binade, against the functions."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial import polynomial

from boresight.model.words.polynomials import EXP2, LOG, interpolated
from boresight.model.words.rounded import PRECISE


def test_the_shipped_ones_are_finer_than_a_word() -> None:
    x = np.linspace(-1.0, 1.0, 4001)
    assert np.abs(polynomial.polyval(0.5 * x, EXP2) - 2.0 ** (0.5 * x - 0.5)).max() < 7e-11
    assert np.abs(polynomial.polyval(x, LOG) - np.log((x + 3.0) / 4.0)).max() < 2.5e-10
    assert len(EXP2) % 2 == len(LOG) % 2 == 0  # they are computed in pairs


@pytest.mark.parametrize("reach", [0.5, 3.0])
def test_a_polynomial_is_found_again(reach: float) -> None:
    found = interpolated(lambda x: 2 * x**3 - x + PRECISE.mpf("0.25"), reach, 6)
    assert np.allclose(found, (0.25, -1.0, 0.0, 2.0, 0.0, 0.0), rtol=0.0, atol=1e-60)


def test_as_good_as_the_best_within_a_few_per_cent() -> None:
    """The best polynomial of degree 4 for e^x on [-1, 1] is 5.47e-4 off (Cheney 1966)."""
    x = np.linspace(-1.0, 1.0, 2001)
    error = polynomial.polyval(x, interpolated(PRECISE.exp, 1.0, 5)) - np.exp(x)
    assert 5.47e-4 < np.abs(error).max() < 1.2 * 5.47e-4
