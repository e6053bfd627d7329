"""The devices' numbers, in SI, as the sources have them."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.model.declarations import GRAVITY
from boresight.sim.attitude.ma2014.world import (
    ACC_VARIANCE,
    ACCELEROMETER,
    GYRO,
    GYRO_BIAS,
    GYRO_VARIANCE,
    MAGNETOMETER,
)


def test_gyro_has_24000_counts_each_way():
    g = GYRO
    assert g.full_scale / g.lsb == pytest.approx(24000.0)
    assert np.degrees(g.full_scale) == pytest.approx(300.0)
    assert g.variance == GYRO_VARIANCE and g.bias == GYRO_BIAS


def test_accelerometer_has_20000_counts_each_way():
    a = ACCELEROMETER
    assert a.full_scale / a.lsb == pytest.approx(20000.0)
    assert a.full_scale == pytest.approx(5.0 * GRAVITY)
    assert a.variance == ACC_VARIANCE


def test_magnetometer_is_in_microtesla():
    m = MAGNETOMETER
    assert m.full_scale == 200.0
    np.testing.assert_allclose(m.variance, (2.1e-2, 20.6e-2, 5.8e-2))
    assert m.lsb == pytest.approx(100.0 / 4500.0)
