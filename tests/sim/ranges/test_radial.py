"""Polynomials of the squared length of a vector."""

import pytest

from boresight.sim.ranges.radial import radial


def test_polynomials_of_a_squared_length():
    a, b = (1, 1), (2, 2)
    found = radial({(): 1.0, a: -2.0, b: -2.0, a + a: 1.0, a + b: 2.0, b + b: 1.0})
    assert found is not None and found.numbers == [1, 2]  # (1 - r)^2
    assert found.ends(3.0) == pytest.approx((0.0, 4.0), abs=1e-12)
    assert radial({a: 1.0, b: 1.0 + 1e-9}) is None and radial({a: 1.0}) is None
