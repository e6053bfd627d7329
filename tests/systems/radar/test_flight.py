"""Flights: an orbit and energy against closed forms, lines, the ground."""

import numpy as np
import pymap3d
import pytest

from boresight.model.errors import InputError
from boresight.systems.radar.flight import EARTH_RATE, GM, SITES, ballistic, flight, gravity

T = 0.1 * np.arange(1701)


def test_the_printed_target_is_where_the_geometry_check_says() -> None:
    height = pymap3d.ecef2geodetic(*flight("printed", T).T)[2]
    assert height[[0, 800, 1700]] == pytest.approx([259e3, 221e3, 112e3], rel=0.025)


def test_free_fall_keeps_what_it_must() -> None:
    """Energy in turning axes, v^2/2 - GM/r (1 + flattening) - |w x p|^2/2; no drift by the step."""
    p = ballistic((-2664e3, 5350e3, 2870e3), (1700.0, 104.0, 1100.0), T)
    v = np.gradient(p, T, axis=0, edge_order=2)
    r = np.linalg.norm(p, axis=1)
    flat = 1.08262668e-3 * (6378137.0 / r) ** 2 * (0.5 - 1.5 * (p[:, 2] / r) ** 2)
    spun = 0.5 * EARTH_RATE**2 * (p[:, 0] ** 2 + p[:, 1] ** 2)
    energy = 0.5 * (v**2).sum(axis=1) - GM / r * (1.0 + flat) - spun
    assert np.ptp(energy[1:-1]) < 1e-6 * abs(energy[0])
    fine = ballistic((-2664e3, 5350e3, 2870e3), (1700.0, 104.0, 1100.0), T[::10])
    assert fine[-1] == pytest.approx(p[-1], abs=1e-3)


def test_gravity_at_the_equator_and_the_pole() -> None:
    assert -gravity(np.array([6378137.0, 0.0, 0.0]))[0] == pytest.approx(9.8144, abs=1e-3)
    assert -gravity(np.array([0.0, 0.0, 6356752.3]))[2] == pytest.approx(9.8322, abs=1e-3)


def test_the_others_cross_and_pass_overhead() -> None:
    t = 0.1 * np.arange(1601)
    line = pymap3d.ecef2enu(*flight("crossing", t).T, SITES[0][1], SITES[0][0], SITES[0][2])
    other = pymap3d.ecef2enu(
        *pymap3d.geodetic2ecef(SITES[1][1], SITES[1][0], 5.0), SITES[0][1], SITES[0][0], 5.0
    )
    side = line[0] * other[1] - line[1] * other[0]
    assert side[0] * side[-1] < 0.0
    e, n, u = pymap3d.ecef2enu(*flight("overhead", t).T, SITES[0][1], SITES[0][0], SITES[0][2])
    assert np.degrees(np.arctan2(u, np.hypot(e, n))).max() > 86.0


def test_what_is_refused() -> None:
    with pytest.raises(InputError, match="^flight: wanted one of printed, crossing, overhead"):
        flight("diving", T)
    with pytest.raises(
        InputError, match="^flight printed: wanted a target above the ground, found"
    ):
        flight("printed", 0.5 * np.arange(600))
