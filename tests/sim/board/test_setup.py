"""Speeds: the scaled ones are the real ones, sixteen times as fast, as far as a line can go."""

from __future__ import annotations

import pytest

from boresight.sim.board.setup import FASTER, FAULTY, REAL, SCALED, Setup


def test_a_period_in_cycles() -> None:
    assert Setup().period_cycles == 100e6 / 1024 == REAL.period_cycles
    assert SCALED.period_cycles * FASTER == REAL.period_cycles


def test_scaled_speeds() -> None:
    real = Setup()
    for name in ("hmr_baud", "rate_hz", "lines_hz"):
        assert getattr(SCALED, name) == FASTER * getattr(real, name)
    # Of the others, what is faster by less: there is no more time in a period for what it holds.
    assert SCALED.sclk_hz == 10 * real.sclk_hz and SCALED.stall_s == real.stall_s / 16
    assert SCALED.host_baud * 8 == SCALED.clock_hz == real.clock_hz


def test_all_waits_where_faults_are_looked_for() -> None:
    assert pytest.approx(Setup().startup_s / FASTER) == FAULTY.startup_s
    assert pytest.approx(Setup().reset_s / FASTER) == FAULTY.reset_s
    assert FAULTY.startup_s > 10 * SCALED.startup_s and FAULTY.rate_hz == SCALED.rate_hz


def test_of_the_real_speeds_only_the_waits_after_power_up_are_shorter() -> None:
    given = Setup()
    assert {name for name in vars(given) if getattr(given, name) != getattr(REAL, name)} == {
        "startup_s",
        "compass_start_cycles",
    }
