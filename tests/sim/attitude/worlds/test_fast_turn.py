"""A quick turn put on a log: its size, and gyro, force and field that agree with the truth."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.sim.attitude.worlds import RAMP_S, fast_turn, synthetic_log
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.rotation import rotate, turns_between

LOG = NineAxis.of(synthetic_log(seconds=10.0, rate_hz=200.0, seed=2))


def test_the_truth_turns_with_the_sensors() -> None:
    other = fast_turn(LOG, begin_s=4.0, rate_rad_s=[0.0, 20.0, 5.0], seconds=0.05)
    assert other.q is not None and LOG.q is not None
    steps = turns_between(other.q[:-1], other.q[1:])
    assert steps == pytest.approx(other.gyr[1:] * other.dt[1:, None], abs=1e-9)
    for name in ("acc", "mag"):
        in_n = rotate(LOG.q, getattr(LOG, name))
        assert rotate(other.q, getattr(other, name)) == pytest.approx(in_n, abs=1e-9)


def test_it_turns_for_so_long_at_that_rate_and_stays() -> None:
    rate = np.array([0.0, 20.0, 5.0])
    other = fast_turn(LOG, begin_s=4.0, rate_rad_s=rate, seconds=0.05)
    assert other.q is not None and LOG.q is not None
    turned = turns_between(LOG.q, other.q)
    assert np.abs(turned[LOG.t < 4.0]).max() < 1e-9
    after = LOG.t > 4.0 + 2.0 * RAMP_S + 0.05
    assert turned[after] == pytest.approx(np.tile(rate * (0.05 + RAMP_S), (after.sum(), 1)))
    fast = np.linalg.norm(other.gyr, axis=1) > 0.9 * np.linalg.norm(rate)
    assert 0.05 < fast.sum() / 200.0 < 0.05 + 0.4 * RAMP_S
