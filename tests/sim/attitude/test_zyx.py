"""Roll, pitch and heading against scipy's sequence ZYX."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.sim.attitude.zyx import angles_of, quaternions_of, wrapped

EULER = np.random.default_rng(1).uniform(-1.0, 1.0, (4, 50, 3)) * [3.1, 1.55, 3.1]


def test_quaternions() -> None:
    found = np.roll(quaternions_of(EULER), -1, axis=-1).reshape(-1, 4)
    wanted = Rotation.from_euler("ZYX", EULER[..., ::-1].reshape(-1, 3))
    assert (Rotation.from_quat(found).inv() * wanted).magnitude().max() < 1e-12


def test_angles_and_back() -> None:
    assert angles_of(quaternions_of(EULER)) == pytest.approx(EULER, abs=1e-9)
    up = angles_of(np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5) * (1.0 + 1e-9), 0.0]))
    assert up[1] == pytest.approx(np.pi / 2.0)  # rounding beyond one is no fault


def test_wrapped() -> None:
    assert wrapped([190.0, -190.0, 180.0, 0.25], 360.0).tolist() == [-170.0, 170.0, -180.0, 0.25]
    assert wrapped(np.array([1.3]), 2.0) == pytest.approx([-0.7])
