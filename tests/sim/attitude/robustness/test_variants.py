"""Each change of a log does what it says, and takes the truth along."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.model.declarations import GRAVITY
from boresight.sim.attitude import robustness as v
from boresight.sim.attitude.worlds import synthetic_log, white
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.rotation import turns_between


def made(noise: float = 0.0) -> NineAxis:
    error = white(noise=noise)
    log = NineAxis.of(
        synthetic_log(
            seconds=30.0, rate_hz=100.0, seed=3, gyr_error=error, acc_error=error, mag_error=error
        )
    )
    return NineAxis(
        log.name, log.t, log.gyr, log.acc, log.mag, log.q, log.dt, (log.t > 8.0) & (log.t < 28.0)
    )


LOG = made()
LOUD = made(noise=0.5)


def consistent(log: NineAxis, tolerance_rad: float = 1e-6) -> bool:
    """Whether every step's gyro takes one true attitude to the next."""
    assert log.q is not None
    turn = turns_between(log.q[:-1], log.q[1:])
    return float(np.abs(turn - log.gyr[1:] * log.dt[1:, None]).max()) < tolerance_rad


def test_a_cut_starts_in_motion() -> None:
    cut = v.cut_in_motion(LOG)
    assert cut.t[0] == pytest.approx(10.0, abs=0.02) and consistent(cut)
    starts = {v.cut_in_motion(LOG, place=k).t[0] for k in range(10)}
    assert len(starts) == 10 and 8.0 < min(starts) < 11.0 and 16.0 < max(starts) < 21.5


@pytest.mark.parametrize("rate_hz", [40.0, 250.0])
def test_another_rate_keeps_integral_and_truth(rate_hz: float) -> None:
    other = v.resampled(LOG, rate_hz)
    assert other.q is not None and LOG.q is not None
    assert np.diff(other.t) == pytest.approx(1.0 / rate_hz)
    whole = [(x.gyr * x.dt[:, None]).sum(axis=0) for x in (LOG, other)]
    assert whole[0] == pytest.approx(whole[1], abs=0.05)
    if rate_hz < 100.0:  # the mean rate of several steps, without their coning
        assert consistent(other, 2e-3)
    at = np.searchsorted(LOG.t, other.t - 1e-9).clip(0, len(LOG) - 1)
    assert np.abs((other.q * LOG.q[at]).sum(axis=1)).min() > np.cos(0.5 * np.radians(3.0))


@pytest.mark.parametrize("sensor, least", [("gyr", 0.0), ("acc", GRAVITY)])
def test_a_full_scale_is_a_share_of_the_largest(sensor: str, least: float) -> None:
    values, result = (getattr(log, sensor) for log in (LOUD, v.clipped(LOUD, sensor, 0.6)))
    largest = np.abs(values).max()
    assert largest > least + 0.5
    assert np.abs(result).max() == pytest.approx(least + 0.6 * (largest - least))
    near = np.abs(values) < np.abs(result).max()
    assert np.array_equal(result[near], values[near]) and not near.all()


def test_fast_turns_are_faster_than_the_gyro_measures() -> None:
    fast = v.fast_turns(LOG, count=4)
    most = np.abs(LOG.gyr).max()
    assert np.abs(fast.gyr).max() == most
    assert fast.q is not None
    turn = turns_between(fast.q[:-1], fast.q[1:]) / fast.dt[1:, None]
    beyond = (np.abs(turn) > 1.001 * most).any(axis=1)
    assert 1.0 < np.abs(turn).max() / most < 2.5  # with the log's own rate
    begins = np.flatnonzero(np.diff(beyond.astype(int), prepend=0) == 1)
    parts = (fast.t[1:][begins] - 8.0) // 5.0
    assert set(parts) == {0.0, 1.0, 2.0, 3.0} and 0.08 < beyond.sum() / 100.0 < 1.6
    clipped = np.clip(turn, -most, most)
    assert fast.gyr[1:] == pytest.approx(clipped, abs=1e-6)


def test_gaps_leave_the_time_right() -> None:
    left = v.gaps(LOG, share=0.1)
    assert 0.85 < len(left) / len(LOG) < 0.95
    assert np.diff(left.t) == pytest.approx(left.dt[1:])
    assert np.isin(left.t, LOG.t).all() and left.dt.max() > 0.1


def test_hard_iron_and_a_blind_minute() -> None:
    off = v.hard_iron(LOG, 1).mag - LOG.mag
    size = 0.1 * np.median(np.linalg.norm(LOG.mag, axis=1))
    assert off == pytest.approx(np.tile(off[0], (len(LOG), 1)))
    assert np.linalg.norm(off[0]) == pytest.approx(size)
    dark = ~v.without_field(LOG, 5.0).mag_new
    assert dark.sum() == pytest.approx(500, abs=1) and dark[1500:1990].all()
    assert not v.without_field(LOG).mag_new.any()
