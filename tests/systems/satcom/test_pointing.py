"""`satcom_pointing` against scipy's rotations, ECEF geometry, numerical rates, the known skew."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.errors import InputError
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.records.feed import feed
from boresight.sim.records.record import Column, Record
from boresight.systems.satcom.pointing import SatcomPointing

A, F = 6378137.0, 1.0 / 298.257223563
ORBIT = 42164.17e3
SATELLITE = 110.5
NAMES = [o.name for o in SatcomPointing.outputs]


def ecef(latitude: Any, longitude: Any, height: Any) -> Any:
    """Geodetic to earth-fixed axes [m], by the radii of the ellipse."""
    phi, lam = np.radians(latitude), np.radians(longitude)
    b = A * (1.0 - F)
    n = A**2 / np.sqrt((A * np.cos(phi)) ** 2 + (b * np.sin(phi)) ** 2)
    r = (n + height) * np.cos(phi)
    return np.stack(
        [r * np.cos(lam), r * np.sin(lam), (n * (b / A) ** 2 + height) * np.sin(phi)], -1
    )


def expected(attitude: Rotation, place: Any) -> Any:
    """Azimuth, elevation, polarisation [rad] of (n, 3) places in degrees and metres."""
    lam = np.radians(SATELLITE)
    d = ORBIT * np.array([np.cos(lam), np.sin(lam), 0.0]) - ecef(*place.T)
    # Earth-fixed to north-east-down: turn by longitude, then latitude.
    frame = Rotation.from_euler("ZY", np.stack([place[:, 1], -90.0 - place[:, 0]], 1), degrees=True)
    los = attitude.inv().apply(frame.inv().apply(d))
    los /= np.linalg.norm(los, axis=1, keepdims=True)
    pole = attitude.inv().apply(frame.inv().apply(np.tile([0.0, 0.0, 1.0], (len(place), 1))))
    azimuth, elevation = np.arctan2(los[:, 1], los[:, 0]), np.arcsin(-los[:, 2])
    antenna = Rotation.from_euler("ZY", np.stack([azimuth, elevation], 1))  # beam, right, down
    inside = antenna.inv().apply(pole)
    return np.stack([azimuth, elevation, np.arctan2(inside[:, 1], -inside[:, 2])], axis=1)


def records(attitude: Rotation, rate: Any, place: Any) -> Any:
    q = np.roll(attitude.as_quat(), 1, axis=1)
    return np.concatenate([q, rate, place / [180.0, 180.0, 1.0]], axis=1)


def draws(seed: int, n: int = 500) -> tuple[Rotation, Any, Any]:
    rng = np.random.default_rng(seed)
    attitude = Rotation.from_euler(
        "ZYX", rng.uniform([-180, -30, -30], [180, 30, 30], (n, 3)), True
    )
    place = rng.uniform([-60, SATELLITE - 60, -400], [60, SATELLITE + 60, 9000], (n, 3))
    return attitude, rng.uniform(-1.0, 1.0, (n, 3)), place


def run(u: Any, level: str = "float") -> Any:
    result = make_level(level, Build(SatcomPointing())).run(u)
    assert result.saturated is None or not result.saturated.any()
    return np.stack([result.outputs[name] for name in NAMES], axis=1)


def wrapped(angle: Any) -> Any:
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


def test_angles() -> None:
    attitude, rate, place = draws(1)
    out = run(records(attitude, rate, place))
    assert np.abs(wrapped(math.pi * out[:, :3] - expected(attitude, place))).max() < 1e-7


def test_rates_are_those_of_the_angles() -> None:
    attitude, rate, place = draws(2)
    step = 1e-4
    before, after = (
        expected(attitude * Rotation.from_rotvec(k * step * rate), place) for k in (-0.5, 0.5)
    )
    numerical = wrapped(after - before) / step
    far = np.abs(before[:, 1]) < 1.4
    result = run(records(attitude, rate, place))[:, 3:6]
    assert far.sum() > 400
    assert np.abs(result - numerical)[far].max() < 1e-4


def test_horizon_and_keyhole() -> None:
    place = np.array(
        [[0.0, SATELLITE - 81.0, 0.0], [0.0, SATELLITE - 82.0, 0.0], [0.0, SATELLITE, 0.0]]
    )
    out = run(records(Rotation.identity(3), np.ones((3, 3)), place))
    assert out[:, -1].tolist() == [0.0, 1.0, 2.0]
    assert np.abs(out[:, 3:6]).max() <= 16.0


@pytest.mark.parametrize(
    "name, value, message",
    [
        ("latitude", 0.51, r"latitude\[1\]: wanted -0.5 to 0.5 ht, .* found 0.51"),
        ("longitude", -1.2, r"longitude\[1\]: wanted -1 to 1 ht, .* found -1.2"),
        ("height", 30e3, r"height\[1\]: wanted -500 to 20000 m, .* found 30000"),
    ],
)
def test_no_place_on_earth(name: str, value: float, message: str) -> None:
    columns = {i.name: Column(np.zeros(3)) for i in SatcomPointing.inputs}
    columns[name] = Column(np.array([0.0, value, 0.0]))
    with pytest.raises(InputError, match=message) as caught:
        feed(SatcomPointing(), Record("log", columns))
    assert "\n" not in str(caught.value)
