"""Two radars and their flights."""

import math

import numpy as np
import pymap3d
import pytest

from boresight.model.errors import InputError
from boresight.systems.radar.flight import EARTH_RATE, GM, SITES, ballistic, flight, gravity
from boresight.systems.radar.world import BIAS, NOISE, TwoRadars, seen_from

# -- two radars: what they report, miss and are late by; draws; what is refused -------------------

DEG = math.pi / 180.0


def reported(world: TwoRadars) -> np.ndarray:
    """Everything the world says of positions, (n, 6)."""
    world.start()
    rows = []
    while (r := world.record(None)) is not None:
        rows.append([r[f"{a}{i}"] for i in "12" for a in "xyz"])
    return np.array(rows)


def test_biases_and_noise_are_those_asked_for() -> None:
    world = TwoRadars(seconds=100.0, seed=5)
    data = reported(world)
    assert data.shape == (1001, 6)
    for i in range(2):
        off = seen_from(world.sites[i], data[:, 3 * i : 3 * i + 3]) - world.seen[i]
        off[:, 2] = (off[:, 2] + math.pi) % (2.0 * math.pi) - math.pi
        unit = np.array([1.0, DEG, DEG])
        own = slice(3 * i, 3 * i + 3)
        assert off.std(axis=0) / unit == pytest.approx(NOISE[own], rel=0.08)
        error = np.array(NOISE[own]) / math.sqrt(len(off))
        assert (np.abs(off.mean(axis=0) / unit - BIAS[own]) < 4.0 * error).all()


def test_draws_are_different_and_come_again() -> None:
    world = TwoRadars(seconds=1.0, drawn=(50.0, 0.5))
    report = reported(world)
    assert (report == reported(world)).all()
    first = world.bias
    world.draw(2)
    assert (world.bias != first).all() and (reported(world) != report).any()
    world.draw(1)
    assert (reported(world) == report).all()
    spread = []
    for seed in range(300):
        world.draw(seed)
        spread.append(world.bias)
    wanted = [50.0, 0.5 * DEG, 0.5 * DEG] * 2
    assert np.std(spread, axis=0) == pytest.approx(wanted, rel=0.15)


def test_missed_samples_and_a_late_radar() -> None:
    world = TwoRadars(seconds=100.0, missed=0.2)
    missing = np.isnan(reported(world)[:, ::3])
    assert missing.mean(axis=0) == pytest.approx([0.2, 0.2], abs=0.04)
    assert (missing[:, 0] != missing[:, 1]).any()
    late = TwoRadars(seconds=10.0, noise=0.0, bias=(0.0,) * 6, late_s=0.3)
    data, place = reported(late), late.place
    assert data[:-3, 3:] == pytest.approx(place[3:], abs=0.05)
    assert data[:, :3] == pytest.approx(place, abs=1e-6)
    between = TwoRadars(seconds=10.0, noise=0.0, bias=(0.0,) * 6, late_s=0.05)
    middle = 0.5 * (between.place[:-1] + between.place[1:])
    assert reported(between)[:-1, 3:] == pytest.approx(middle, abs=0.05)


def test_bound_needs_noise_and_may_have_a_prior() -> None:
    free, known = TwoRadars(seconds=20.0), TwoRadars(seconds=20.0, drawn=(50.0, 0.5))
    a, b = free.bound()["range_1_bias"][-1], known.bound()["range_1_bias"][-1]
    assert b < 50.0 < a


# -- flights: an orbit and energy against closed forms, lines, the ground -------------------------

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


def test_flight_what_is_refused() -> None:
    with pytest.raises(InputError, match="^flight: wanted one of printed, crossing, overhead"):
        flight("diving", T)
    with pytest.raises(
        InputError, match="^flight printed: wanted a target above the ground, found"
    ):
        flight("printed", 0.5 * np.arange(600))
