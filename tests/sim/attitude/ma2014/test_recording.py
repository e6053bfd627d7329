"""Logs of a motion: truth consistent with the sensors, seeds, ranges."""

from __future__ import annotations

import math

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.attitude.ma2014.devices import accelerometer, gyro, magnetometer
from boresight.sim.attitude.ma2014.motion import StackedMotion, Swing
from boresight.sim.attitude.ma2014.paper import TABLE_2
from boresight.sim.attitude.ma2014.recording import Sensors, record
from boresight.sim.attitude.worlds.triad import Triad
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_normalise,
    rotate,
    rotation_vector_to_quaternion,
)

MOTION = StackedMotion((Swing(0, 0.3, 4.0, 1.25), Swing(2, 0.5, 2.0, 2.0)))
FIELD = (1.0, 28.0, -46.0)
IDEAL = Triad(50.0, 0.0, 1e9)


def make(sensors=None, **keywords):
    sensors = sensors or Sensors(IDEAL, IDEAL, IDEAL)
    options = {"rate_hz": 50.0, "seed": 3, "field_ut": FIELD} | keywords
    return NineAxis.of(record(MOTION, sensors, **options))


def test_integrated_rates_end_at_the_true_attitude():
    log = make(lead=4)
    assert log.t[0] == pytest.approx(-4 / 50.0) and log.t[4] == 0.0
    assert log.t[-1] == pytest.approx(MOTION.seconds)
    assert set(log.dt.tolist()) == {1 / 50.0}
    q = log.q[0]
    for rate, truth in zip(log.gyr[1:], log.q[1:], strict=True):
        q = quaternion_normalise(quaternion_multiply(q, rotation_vector_to_quaternion(rate / 50)))
        assert abs(float(np.dot(q, truth))) > 1 - 1e-12


def test_force_and_field_turn_back_to_the_navigation_frame():
    log = make(gravity=9.8)
    np.testing.assert_allclose(
        rotate(log.q, log.acc), np.tile((0, 0, 9.8), (len(log), 1)), atol=1e-12
    )
    np.testing.assert_allclose(rotate(log.q, log.mag), np.tile(FIELD, (len(log), 1)), atol=1e-12)
    up = rotate(quaternion_conjugate(log.q), (0.0, 0.0, 9.8))
    lever = make(gravity=9.8, lever=(0.2, 0.0, 0.0)).acc - up
    assert np.abs(lever).max() > 0.05


def test_bias_is_there_until_it_is_removed():
    noisy = gyro().with_errors()
    with_bias = make(Sensors(noisy, accelerometer(), magnetometer()))
    without = make(Sensors(noisy, accelerometer(), magnetometer(), TABLE_2.gyro_bias))
    np.testing.assert_allclose((with_bias.gyr - without.gyr).mean(axis=0), TABLE_2.gyro_bias)
    assert np.abs(without.gyr - make().gyr).mean() < 0.005


def test_seeds():
    sensors = Sensors(gyro(), accelerometer(), magnetometer())
    a, b, c = make(sensors), make(sensors), make(sensors, seed=4)
    for key in ("gyr", "acc", "mag"):
        np.testing.assert_array_equal(getattr(a, key), getattr(b, key))
        assert (getattr(a, key) != getattr(c, key)).mean() > 0.5
    noise = a.acc - make().acc, a.mag - make().mag
    assert abs(np.corrcoef(noise[0][:, 0], noise[1][:, 0])[0, 1]) < 0.25  # streams of their own


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rate_hz": 0.0}, "rate_hz must be a number above 0, not 0.0"),
        ({"rate_hz": math.inf}, "rate_hz must be a number above 0, not inf"),
        ({"seed": -1}, "seed must be an integer of 0 or more, not -1"),
    ],
)
def test_bad_arguments(change, message):
    with pytest.raises(InputError, match=f"^{message}$"):
        make(**change)
