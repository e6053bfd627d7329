"""The attitude of one sample against scipy's, and where the formula is at its worst."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.attitude.mekf.alignment import turned_over, turns


def aligned(force: np.ndarray, field: np.ndarray) -> Rotation:
    """Body to ENU of one force and one field, as the filter composes it."""
    over = np.asarray(force[2] < 0.0)
    f, m = (np.array(turned_over(over, v, 128.0)) for v in (force, field))
    up, east = f / np.linalg.norm(f), np.cross(m, f)
    (w, x, y), (c, s) = turns(np.asarray(True), up, east / np.linalg.norm(east), 0.0, 0.0)
    flip = Rotation.from_quat([1.0, 0.0, 0.0, 0.0]) if over else Rotation.identity()
    return Rotation.from_quat([0.0, 0.0, s, c]) * Rotation.from_quat([x, y, 0.0, w]) * flip


def test_any_attitude_is_found_from_one_sample() -> None:
    rng = np.random.default_rng(2)
    square = Rotation.create_group("O")
    for truth in [*square, *Rotation.random(200, rng=rng)]:
        back = truth.inv()
        result = aligned(back.apply([0.0, 0.0, 9.8]), back.apply([0.0, 18.0, -40.0]))
        assert (result * back).magnitude() < 1e-9


@pytest.mark.parametrize("degrees", [0.0, 89.9, 90.1, 179.9, 180.0, -180.0, -90.0])
def test_no_turn_about_the_vertical_loses_its_size(degrees: float) -> None:
    a = np.radians(degrees)
    _, (w, z) = turns(np.asarray(False), (0.0, 0.0, 1.0), (1.0, 0.0, 0.0), np.cos(a), np.sin(a))
    assert np.hypot(w, z) >= 1.0 - 1e-9
    assert 2.0 * np.arctan2(z, w) == pytest.approx(a, abs=1e-9) or abs(degrees) == 180.0
    assert np.cos(2.0 * np.arctan2(z, w)) == pytest.approx(np.cos(a), abs=1e-9)


def test_a_vector_is_turned_over_and_kept_in_range() -> None:
    over = turned_over(np.asarray(True), (200.0, 2.0, -3.0), 128.0)
    assert over == (128.0, -2.0, 3.0)
    assert turned_over(np.asarray(False), (1.0, 2.0, -3.0), 128.0) == (1.0, 2.0, -3.0)
