"""Propagation against matrices in SI units; what grows, and what stops growing."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from boresight.model.algebra.scalar_update import Update
from boresight.systems.array import error_filter as errors
from boresight.systems.array.estimator import ArrayAttitude
from boresight.systems.array.interface import KINDS, UNITS
from tests.support.rotating_array import EARTH, LATITUDE

SCALES = np.array([UNITS[k] for k in KINDS])
LAT = np.radians(LATITUDE)


def scalar_first(r: Rotation) -> Any:
    return r.as_quat()[[3, 0, 1, 2]]


def dynamics(c: Any, up_rate: float) -> Any:
    """F of the 13 states."""
    f, w = np.zeros((13, 13)), EARTH * np.array([0.0, np.cos(LAT), np.sin(LAT)])

    def skew(a: Any) -> Any:
        return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])

    f[0:3, 4:7], f[0:3, 10:13] = skew([0.0, 0.0, errors.G]), c
    f[4:7, 4:7], f[4:7, 7:10] = -skew(w), -c
    f[6, 3] = -up_rate
    return f


@pytest.mark.parametrize("seconds", [1.0, 0.37])
def test_propagation(seconds: float) -> None:
    rng = np.random.default_rng(3)
    root = 0.1 * rng.normal(size=(13, 13))
    p = root @ root.T
    start, rate = Rotation.from_euler("ZXY", [1.0, 1.1, 0.1]), np.radians(36.0)
    end = Rotation.from_rotvec([0.0, 0.0, rate * seconds]) * start
    earth = tuple(EARTH * seconds * np.array([np.cos(LAT), np.sin(LAT)]))
    found = errors.propagated(p, scalar_first(start), scalar_first(end), seconds, earth)
    # the mean of C over the arc
    t = (np.arange(200) + 0.5) / 200.0 * seconds
    turns = Rotation.from_rotvec(np.outer(rate * t, [0.0, 0.0, 1.0]))
    c = (turns * start).as_matrix().mean(axis=0)
    phi = np.eye(13) + seconds * dynamics(c, rate)
    phi = np.diag(1.0 / SCALES) @ phi @ np.diag(SCALES)
    wanted = phi @ p @ phi.T
    # over 36 deg C half way is 1 % short across the axis, 2.4 % along it, and the angle its sine
    assert np.array(found) == pytest.approx(wanted, abs=3e-3 * seconds**2 + 1e-4)
    assert np.abs(wanted - p).max() > 0.02
    still = errors.propagated(p, scalar_first(start), scalar_first(start), 1.0, (0.0, 0.0))
    c = start.as_matrix()
    exact = np.diag(1.0 / SCALES) @ expm(dynamics(c, 0.0)) @ np.diag(SCALES)
    assert np.array(still) == pytest.approx(exact @ p @ exact.T, abs=1e-3)


def test_earth_and_scale_factor_come_in_with_their_signs() -> None:
    """One element after the other, in a P that has only that one."""
    q = np.array([1.0, 0.0, 0.0, 0.0])
    z = np.array([np.cos(0.1), 0.0, 0.0, np.sin(0.1)])
    p = 0.25 * np.eye(13)
    found = np.array(errors.propagated(p, q, z, 1.0, (6e-5, 4e-5)))
    tilt, heading = UNITS["tilt"], UNITS["heading"]
    assert found[6, 3] == pytest.approx(-0.25 * 2.0 * np.sin(0.1) * UNITS["scale"] / heading)
    assert found[4, 5] == pytest.approx(0.25 * (4e-5 - 4e-5), abs=1e-9)
    assert found[4, 6] == pytest.approx(0.25 * 6e-5 * (tilt / heading - heading / tilt), rel=1e-3)
    back = np.array(errors.propagated(p, z, q, 1.0, (0.0, 0.0)))
    assert back[6, 3] == -found[6, 3]
    nothing = errors.propagated(p, q, z, 0.0, (0.0, 0.0))
    assert np.array(nothing) == pytest.approx(p, abs=0.0)


def test_noise_and_what_stops_it() -> None:
    p = SimpleNamespace(**ArrayAttitude().param_values({"gyro_walk": 1e-9, "force_walk": 1e-4}))
    variances = {f"p{k}{k}": 0.1 for k in "3789abc"}
    found = errors.grown(SimpleNamespace(**variances), p, 1.0, True, False)
    floor = errors.FLOOR_NOISE
    assert found["tilt"] == pytest.approx((1.5e-7 / UNITS["tilt"]) ** 2 + floor)
    assert found["heading"] == pytest.approx((1.5e-7 / UNITS["heading"]) ** 2 + floor)
    assert found["velocity"] == pytest.approx((5e-5 / UNITS["velocity"]) ** 2 + floor)
    assert found["gyro"] == pytest.approx((1e-9 / UNITS["gyro"]) ** 2 + floor)
    assert found["scale"] == floor
    full = errors.grown(SimpleNamespace(**variances | {"paa": 0.4}), p, 1.0, True, False)
    assert full["gyro"] == full["scale"] == full["force"] == 0.0 < full["tilt"]
    erected = errors.grown(SimpleNamespace(**variances), p, 1.0, True, True)
    assert erected["force"] == pytest.approx((150.0 * 9.80665e-6 / UNITS["force"]) ** 2)
    idle = errors.grown(SimpleNamespace(**variances), p, 0.0, False, True)
    assert not any(idle.values())


def test_first_spread_and_moves_are_in_units() -> None:
    p = SimpleNamespace(**ArrayAttitude().param_values({"p0_gyro": 0.5 * UNITS["gyro"]}))
    assert errors.first_variances(p)["gyro"] == 0.25
    found = errors.moves(Update([0.5] * 13, 2.0, False))
    assert found == pytest.approx(list(SCALES))
