"""What the paper prints fits what it says of it."""

import numpy as np
import pytest

from boresight.systems.array.printed import BUDGET, HOURLY, SIGMA, statistics


def test_one_sigma_is_the_deviation_of_the_hours() -> None:
    """To the last printed digit, of n - 1: which says what "1 sigma" is."""
    for key, sigma in SIGMA.items():
        assert HOURLY[key].shape == (8, 3)
        assert statistics(HOURLY[key])["sigma"] == pytest.approx(sigma, abs=0.006)
    assert statistics(HOURLY["a"])["max"].max() == 60.82
    assert statistics(HOURLY["b"])["rms"] == pytest.approx([10.5, 12.6, 18.4], abs=0.05)
    assert HOURLY["b"][:7, 2].std(ddof=1) == pytest.approx(0.43, abs=0.01)


def test_totals_are_roots_of_sums_of_squares() -> None:
    *parts, total = BUDGET.values()
    assert np.sqrt((np.array(parts) ** 2).sum(axis=0)) == pytest.approx(total, abs=0.2)


def test_one_hour_has_no_deviation() -> None:
    one = statistics(np.array([[1.0, -2.0, 3.0]]))
    assert one["sigma"].tolist() == [0.0, 0.0, 0.0] and one["max"].tolist() == [1.0, 2.0, 3.0]
