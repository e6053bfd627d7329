"""What an index measures: its row, by differences of angles; its time, its noise, both readings."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.algebra.scalar_update import Update
from boresight.model.algebra.strapdown import Angles, angles
from boresight.systems.array import index
from boresight.systems.array.error_filter import PHI, SCALE
from boresight.systems.array.interface import UNITS
from tests.support.rotating_array import ARCSEC

SHARE = np.array([UNITS["tilt"], UNITS["tilt"], UNITS["heading"]])
C = Rotation.from_euler("ZXY", [100.0, 66.0, 7.0], degrees=True)


def seen_of(c: Rotation) -> Angles:
    return angles(np.asarray(c.as_quat()[[3, 0, 1, 2]]))


def heading(c: Rotation) -> float:
    m = c.as_matrix()
    return float(np.arctan2(-m[0, 1], m[1, 1]))


def test_the_row_is_the_derivative() -> None:
    """heading of C less heading of (1 + phi x) C, times the cosine of the pitch."""
    row = index.heading_row(seen_of(C))
    found = np.array([row[k] for k in PHI]) * UNITS["heading"] / SHARE
    assert np.linalg.norm(found) == pytest.approx(1.0)
    for k in range(3):
        phi = np.zeros(3)
        phi[k] = 1e-6
        moved = heading(C) - heading(Rotation.from_rotvec(phi) * C)
        assert found[k] == pytest.approx(np.cos(np.radians(66.0)) * moved / 1e-6, abs=1e-5)


@pytest.mark.parametrize("at", [0.0, 0.25, 1.0])
def test_the_heading_is_that_of_the_index(at: float) -> None:
    turn = np.array([1e-3, -5e-4, 6e-3])
    then = C * Rotation.from_rotvec(-(1.0 - at) * turn)
    sample: Any = SimpleNamespace(turn=turn)
    azimuth = heading(then) / np.pi - 0.3
    off = index.offset(SimpleNamespace(index_time=at, azimuth=azimuth), sample, seen_of(C))
    # within the square of the turn
    assert off == pytest.approx(0.3, abs=1e-4 * (1.0 - at) + 1e-12)


def test_a_fix_is_in_arc_seconds_at_any_pitch() -> None:
    p = SimpleNamespace(index_sd=2.0 * ARCSEC)
    found = index.fix(p, seen_of(C), 100.0 / 648000.0)
    cosine = np.cos(np.radians(66.0))
    assert found.innovation == pytest.approx(100.0 / 256.0 * cosine)
    assert found.variance == pytest.approx((2.0 / 256.0 * cosine) ** 2)


def test_the_change_over_a_turn_is_the_scale_factor() -> None:
    p = SimpleNamespace(index_sd=2.0 * ARCSEC)
    k = 2e-5  # of 360 deg: the heading is ahead by so much after one turn, behind after one back
    for turned, off in ((2.0, 2.0 * k), (-2.0, -2.0 * k)):
        x = SimpleNamespace(last_off=0.7)
        found = index.change(x, p, 0.7 + off, turned)
        assert found.row == {SCALE: 1.0}
        assert found.innovation == pytest.approx(k / UNITS["scale"])
    sd = np.sqrt(2.0) * 2.0 * ARCSEC / (2.0 * np.pi) / UNITS["scale"]
    assert found.variance == pytest.approx(sd**2)
    for turned in (3.5, -3.5):
        found = index.change(x, p, -0.7, turned)
        assert found.row == {SCALE: 0.0} and found.innovation == 0.0
    assert index.change(x, SimpleNamespace(index_sd=1e-3), 0.7, 2.0).variance == 1.0


def test_a_correction_moves_the_last_offset_too() -> None:
    rng = np.random.default_rng(1)
    gain = list(0.2 * rng.normal(size=13))
    phi = SHARE * 0.5 * np.array([gain[k] for k in PHI])
    found = index.corrected(0.2, seen_of(C), Update(gain, 0.5, False))
    wanted = 0.2 + (heading(Rotation.from_rotvec(phi) * C) - heading(C)) / np.pi
    assert found == pytest.approx(wanted, abs=1e-9) and abs(found - 0.2) > 1e-7
