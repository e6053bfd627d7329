"""Four carriers: truth, gyro and force belong together; each moves as it is said to."""

from __future__ import annotations

import numpy as np
import pytest

from boresight.model.declarations import GRAVITY
from boresight.model.errors import InputError
from boresight.sim.attitude.robustness import logs as carriers
from boresight.sim.attitude.robustness.logs import CARRIERS, carrier
from boresight.sim.rotations.rotation import rotate, turns_between


@pytest.fixture(autouse=True)
def exact(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sensors without error."""
    still = carriers._Quality((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    monkeypatch.setattr(carriers, "_Quality", lambda: still)


@pytest.mark.parametrize("name", CARRIERS)
def test_the_sensors_see_what_the_carrier_does(name: str) -> None:
    log = carrier(name, 4, seconds=20.0)
    assert log.name == f"{name}-4" and log.q is not None
    turn = turns_between(log.q[:-1], log.q[1:])
    assert turn == pytest.approx(log.gyr[1:] * log.dt[1:, None], abs=1e-9)
    acceleration = rotate(log.q, log.acc) - [0.0, 0.0, GRAVITY]
    assert np.abs(acceleration.mean(axis=0)).max() < 1.5 and acceleration.std() > 0.1
    field = rotate(log.q, log.mag)
    assert field.mean(axis=0) == pytest.approx(carriers.FIELD_UT, abs=3.0)
    assert not np.array_equal(carrier(name, 5, seconds=20.0).acc, log.acc)


def test_a_car_that_turns_leans_on_its_tyres() -> None:
    """Across the car the specific force is speed times turn, and it rolls outward."""
    log = carrier("car", 1, seconds=100.0)
    turning = np.abs(log.gyr[:, 2]) > np.radians(5.0)
    across = log.acc[turning, 1] / log.gyr[turning, 2]
    assert turning.mean() > 0.05 and 3.0 < np.median(across) < 16.0


def test_a_drone_feels_thrust_along_its_axis() -> None:
    log = carrier("drone", 1, seconds=20.0)
    level, up = log.acc[:, :2], log.acc[:, 2]
    assert np.abs(level.mean()) < 0.5 and up.mean() == pytest.approx(GRAVITY, rel=0.05)
    tilt = np.degrees(np.arccos(1.0 - 2.0 * (log.attitude[:, 1:3] ** 2).sum(axis=1)))
    assert np.median(tilt) > 5.0


def test_a_pedestrian_steps_twice_a_second() -> None:
    log = carrier("pedestrian", 1, seconds=60.0)
    up = rotate(log.attitude, log.acc)[:, 2]
    power = np.abs(np.fft.rfft(up - up.mean()))
    assert 1.4 < np.fft.rfftfreq(len(up), 0.01)[np.argmax(power)] < 2.2


def test_another_carrier_is_refused() -> None:
    with pytest.raises(InputError, match="wanted one of"):
        carrier("train", 1)
