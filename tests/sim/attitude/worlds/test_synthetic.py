"""Synthetic logs: the truth is exact, the sensors say it, the errors are as asked."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.declarations import GRAVITY
from boresight.sim.attitude.worlds import synthetic_log, white
from boresight.sim.records.nine_axis import NineAxis

FIELD = (-3.0, 28.0, -46.0)


def make(**changes: Any) -> NineAxis:
    return NineAxis.of(synthetic_log(**{"seconds": 20.0, "rate_hz": 50.0, "seed": 7, **changes}))


def attitude(log: NineAxis) -> Rotation:
    assert log.q is not None
    return Rotation.from_quat(log.q, scalar_first=True)


def test_shape_and_times() -> None:
    log = make(name="some")
    assert log.name == "some"
    assert len(log) == 1000
    np.testing.assert_array_equal(log.t, np.arange(1000) / 50.0)
    assert log.mag_new.all()
    assert log.mov is None
    assert "dt" not in synthetic_log(seconds=1.0, rate_hz=50.0, seed=7).columns


@pytest.mark.parametrize("changes", [{}, {"rate_hz": 10.0}])
def test_integrated_gyro_is_the_truth(changes: dict[str, Any]) -> None:
    log = make(**changes)
    truth = attitude(log)
    estimate = truth[0]
    steps = Rotation.from_rotvec(log.gyr * log.dt[:, None])
    for k in range(1, len(log)):
        estimate = estimate * steps[k]
    # rounding of each step, added up
    assert (truth[-1].inv() * estimate).magnitude() < 1e-13 * len(log)


def test_sensors_see_gravity_and_field_in_body_axes() -> None:
    log = make(field_ut=FIELD)
    to_body = attitude(log).inv()
    np.testing.assert_allclose(log.acc, to_body.apply([0, 0, GRAVITY]), atol=1e-13)
    np.testing.assert_allclose(log.mag, to_body.apply(FIELD), atol=1e-12)


def test_linear_acceleration_is_added_in_navigation_axes_within_its_bound() -> None:
    log = make(acceleration=2.0, seconds=60.0)
    pull = attitude(log).apply(log.acc) - [0, 0, GRAVITY]
    assert np.all(np.abs(pull) <= 2.0 + 1e-12)
    assert np.all(np.abs(pull).max(axis=0) > 1.0)
    np.testing.assert_array_equal(log.gyr, make(seconds=60.0).gyr)


def test_magnetometer_is_decimated_from_the_first_row() -> None:
    log, full = make(mag_every=7), make()
    np.testing.assert_array_equal(np.flatnonzero(log.mag_new), np.arange(0, 1000, 7))
    np.testing.assert_array_equal(log.mag[::7], full.mag[::7])
    assert np.isnan(log.mag[1:7]).all()


def test_same_arguments_same_log_and_other_seed_other_log() -> None:
    errors = {"gyr_error": white(noise=0.1), "acceleration": 1.0}
    first, again, other = make(**errors), make(**errors), make(**errors, seed=8)
    np.testing.assert_array_equal(first.gyr, again.gyr)
    np.testing.assert_array_equal(first.acc, again.acc)
    assert not np.allclose(first.q, other.q)  # type: ignore[arg-type]


@pytest.mark.parametrize("sensor", ["gyr", "acc", "mag"])
def test_errors_touch_their_sensor_only_and_have_the_asked_size(sensor: str) -> None:
    clean = make()
    bad = make(**{f"{sensor}_error": white(noise=0.2, bias=(1.0, -2.0, 3.0))})
    np.testing.assert_array_equal(bad.q, clean.q)
    for name in ("gyr", "acc", "mag"):
        difference = getattr(bad, name) - getattr(clean, name)
        if name != sensor:
            assert not difference.any()
            continue
        # 1000 samples: the mean is known to 0.2/sqrt(1000), the deviation to 0.2/sqrt(2000)
        np.testing.assert_allclose(difference.mean(axis=0), [1, -2, 3], atol=5 * 0.0064)
        np.testing.assert_allclose(difference.std(axis=0), 0.2, atol=5 * 0.0045)
        correlation = np.corrcoef(difference.T) - np.eye(3)
        assert np.abs(correlation).max() < 0.16
