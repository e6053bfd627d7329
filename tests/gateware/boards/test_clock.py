"""Factors of the PLL."""

import pytest

from boresight.gateware.boards.clock import VCO_HZ, Pll, pll_for
from boresight.model.errors import InputError


def test_own_oscillator_needs_none() -> None:
    assert pll_for(oscillator_hz=50_000_000, clock_hz=50_000_000) is None


@pytest.mark.parametrize("oscillator", [50_000_000, 100_000_000])
@pytest.mark.parametrize("clock", [25_000_000, 75_000_000, 120_000_000, 150_000_000])
def test_factors(oscillator: int, clock: int) -> None:
    pll = pll_for(oscillator_hz=oscillator, clock_hz=clock)
    assert pll is not None
    assert oscillator * pll.multiply == clock * pll.divide
    assert VCO_HZ[0] <= oscillator * pll.multiply <= VCO_HZ[1]
    assert 1 <= pll.multiply <= 64 and 1 <= pll.divide <= 128


def test_fastest_inner_oscillator() -> None:
    assert pll_for(oscillator_hz=50_000_000, clock_hz=100_000_000) == Pll(50_000_000, 18, 9)


@pytest.mark.parametrize("clock", [0, -1, 123_456_789, 400_000_000, 2_000_000, 1e8, None])
def test_impossible_clocks(clock) -> None:
    with pytest.raises(
        InputError,
        match=r"^clock_hz: wanted a whole number up to 375000000 Hz "
        r"that is 50000000 Hz \* m / d .*, found .*; choose 50000000 or, for "
        r"example, 100000000$",
    ):
        pll_for(oscillator_hz=50_000_000, clock_hz=clock)
