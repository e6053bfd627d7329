"""A vehicle on a road: rates and forces against differences of the attitude and of the place."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.declarations import GRAVITY
from boresight.systems.worlds.road import profile, ride

RATE_HZ = 100.0
PARTS = ((2.0, 0.0, 0.0), (3.0, 2.0, 0.0), (4.0, 0.0, 30.0), (2.0, -1.0, -10.0))


def test_rates_and_forces_are_those_of_the_attitude() -> None:
    accel, turn = profile(PARTS, RATE_HZ)
    t = np.arange(len(accel)) / RATE_HZ
    lift = np.where(t > 10.0, 1.5, 0.0)
    d = ride(RATE_HZ, accel, turn, roll_deg=10.0 * np.sin(t), pitch_deg=0.0 * t + 5.0, lift=lift)
    r = Rotation.from_quat(np.roll(d.q, -1, axis=1))
    expected = Rotation.from_euler("ZYX", d.euler[:, ::-1])
    assert (r.inv() * expected).magnitude().max() < 1e-9
    assert np.degrees(d.euler[:, :2]) == pytest.approx(np.stack([10.0 * np.sin(t), 0 * t + 5], 1))
    turned = r[:-1] * Rotation.from_rotvec(d.rate[1:] / RATE_HZ)
    assert (turned.inv() * r[1:]).magnitude().max() < 1e-9 and not d.rate[0].any()
    assert r.apply(d.force) + [0.0, 0.0, GRAVITY] == pytest.approx(d.acceleration, abs=1e-9)
    # The acceleration is the change of a velocity along the road.
    speed, heading = np.cumsum(accel) / RATE_HZ, d.euler[:, 2]
    velocity = np.stack([speed * np.cos(heading), speed * np.sin(heading)], axis=1)
    numerical = np.gradient(velocity, axis=0) * RATE_HZ
    assert d.acceleration[:, :2] == pytest.approx(numerical, abs=0.06)
    assert (d.acceleration[:, 2] == -lift).all()
