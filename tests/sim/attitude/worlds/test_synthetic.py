"""Synthetic logs: the truth is exact, the sensors say it, the errors are as asked."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.declarations import GRAVITY
from boresight.model.errors import InputError
from boresight.sim.attitude.worlds.synthetic import SensorError, synthetic_log
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.rotation import quaternion_to_euler

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


@pytest.mark.parametrize("changes", [{}, {"through_vertical": True}, {"rate_hz": 10.0}])
def test_integrated_gyro_is_the_truth(changes: dict[str, Any]) -> None:
    log = make(**changes)
    truth = attitude(log)
    estimate = truth[0]
    steps = Rotation.from_rotvec(log.gyr * log.dt[:, None])
    for k in range(1, len(log)):
        estimate = estimate * steps[k]
    # rounding of each step, added up
    assert (truth[-1].inv() * estimate).magnitude() < 1e-13 * len(log)


def test_first_gyro_sample_continues_the_motion_backwards() -> None:
    rate = make(rate_hz=1000.0).gyr
    jump = np.linalg.norm(np.diff(rate, axis=0), axis=1)
    assert jump[0] < 2 * jump[1]
    assert np.linalg.norm(rate[0]) > 0.05


def test_sensors_see_gravity_and_field_in_body_axes() -> None:
    log = make(field_ut=FIELD, gravity=9.5)
    to_body = attitude(log).inv()
    np.testing.assert_allclose(log.acc, to_body.apply([0, 0, 9.5]), atol=1e-13)
    np.testing.assert_allclose(log.mag, to_body.apply(FIELD), atol=1e-12)


def test_defaults_of_gravity_and_field() -> None:
    log = make()
    np.testing.assert_allclose(np.linalg.norm(log.acc, axis=1), GRAVITY, rtol=1e-14)
    np.testing.assert_allclose(
        attitude(log).apply(log.mag), np.tile([0, 27.9, -46.2], (1000, 1)), atol=1e-12
    )


def test_linear_acceleration_is_added_in_navigation_axes_within_its_bound() -> None:
    log = make(acceleration=2.0, seconds=60.0)
    pull = attitude(log).apply(log.acc) - [0, 0, GRAVITY]
    assert np.all(np.abs(pull) <= 2.0 + 1e-12)
    assert np.all(np.abs(pull).max(axis=0) > 1.0)
    np.testing.assert_array_equal(log.gyr, make(seconds=60.0).gyr)


@pytest.mark.parametrize("limit", [5.0, 60.0, 89.0])
@pytest.mark.parametrize("seed", range(5))
def test_pitch_uses_its_bound_and_keeps_it(limit: float, seed: int) -> None:
    q = make(max_pitch_deg=limit, seed=seed, seconds=120.0).q
    pitch = np.degrees(quaternion_to_euler(q)[:, 0])  # type: ignore[arg-type]
    assert 0.7 * limit < np.abs(pitch).max() <= limit + 1e-9


@pytest.mark.parametrize("seed", range(5))
def test_through_the_vertical_the_body_tips_over(seed: int) -> None:
    log = make(through_vertical=True, seed=seed, seconds=10.0, rate_hz=100.0)
    pitch = np.degrees(quaternion_to_euler(log.q)[:, 0])  # type: ignore[arg-type]
    assert np.abs(pitch).max() > 89.3
    # no jump where the Euler angles have one
    assert np.linalg.norm(log.gyr, axis=1).max() < 8.0
    assert np.linalg.norm(np.diff(log.gyr, axis=0), axis=1).max() < 0.5


def test_magnetometer_is_decimated_from_the_first_row() -> None:
    log, full = make(mag_every=7), make()
    np.testing.assert_array_equal(np.flatnonzero(log.mag_new), np.arange(0, 1000, 7))
    np.testing.assert_array_equal(log.mag[::7], full.mag[::7])
    assert np.isnan(log.mag[1:7]).all()


def test_same_arguments_same_log_and_other_seed_other_log() -> None:
    errors = {"gyr_error": SensorError(noise=0.1), "acceleration": 1.0}
    first, again, other = make(**errors), make(**errors), make(**errors, seed=8)
    np.testing.assert_array_equal(first.gyr, again.gyr)
    np.testing.assert_array_equal(first.acc, again.acc)
    assert not np.allclose(first.q, other.q)  # type: ignore[arg-type]


@pytest.mark.parametrize("sensor", ["gyr", "acc", "mag"])
def test_errors_touch_their_sensor_only_and_have_the_asked_size(sensor: str) -> None:
    clean = make()
    bad = make(**{f"{sensor}_error": SensorError(noise=0.2, bias=(1.0, -2.0, 3.0))})
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


def test_sensors_have_noise_streams_of_their_own() -> None:
    error, clean = SensorError(noise=1.0), make()
    bad = make(gyr_error=error, acc_error=error, mag_error=error)
    noise = [getattr(bad, name) - getattr(clean, name) for name in ("gyr", "acc", "mag")]
    correlation = np.corrcoef([part[:, 0] for part in noise]) - np.eye(3)
    assert np.abs(correlation).max() < 0.16


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seconds": 0.0}, r"seconds must be a number above 0, not 0\.0"),
        ({"seconds": np.inf}, r"seconds must be a number above 0, not inf"),
        ({"seconds": np.nan}, r"seconds must be a number above 0, not nan"),
        ({"seconds": 0.02}, r"seconds \* rate_hz must be 2 to 10000000 samples, not 1"),
        ({"seconds": 1e6}, r"seconds \* rate_hz must be 2 to 10000000 samples, not 50000000"),
        ({"rate_hz": 9.9}, r"rate_hz must be a number of 10 or more, not 9\.9"),
        ({"max_pitch_deg": 0}, r"max_pitch_deg must be in \(0, 89\], not 0"),
        ({"max_pitch_deg": 90}, r"max_pitch_deg must be in \(0, 89\], not 90"),
        ({"acceleration": -1}, r"acceleration must be a number of 0 or more, not -1"),
        ({"gravity": 0}, r"gravity must be a number above 0, not 0"),
        ({"mag_every": 0}, r"mag_every must be an integer of 1 or more, not 0"),
        ({"mag_every": 2.0}, r"mag_every must be an integer of 1 or more, not 2\.0"),
        ({"seed": -1}, r"seed must be an integer of 0 or more, not -1"),
        ({"seed": 1.5}, r"seed must be an integer of 0 or more, not 1\.5"),
        ({"field_ut": (1, 2)}, r"field_ut must be three finite numbers, not all 0, not \(1, 2\)"),
        ({"field_ut": (0, 0, 0)}, r"field_ut must be three .* 0, not \(0, 0, 0\)"),
        (
            {"through_vertical": True, "seconds": 9.9},
            r"seconds must be 10 or more to pass the vertical, not 9\.9",
        ),
    ],
)
def test_arguments_out_of_range_are_named(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=f"^{message}$"):
        make(**changes)


def test_smallest_legal_values() -> None:
    log = make(seconds=0.2, rate_hz=10.0, max_pitch_deg=0.5, gravity=0.25, seed=0)
    assert len(log) == 2
    np.testing.assert_allclose(np.linalg.norm(log.acc, axis=1), 0.25, rtol=1e-14)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"noise": -0.1}, r"noise must be a number of 0 or more, not -0\.1"),
        ({"noise": np.nan}, r"noise must be a number of 0 or more, not nan"),
        ({"bias": (1.0, 2.0)}, r"bias must be three finite numbers, not \(1\.0, 2\.0\)"),
        ({"bias": (1.0, 2.0, np.inf)}, r"bias must be three .*, not \(1\.0, 2\.0, inf\)"),
    ],
)
def test_sensor_error_names_faults(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=f"^{message}$"):
        SensorError(**arguments)
