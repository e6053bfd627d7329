"""Increments in closed form against fine steps of scipy's rotations, gravity against its table."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.model.errors import InputError
from boresight.sim.attitude.rotation import euler_to_matrix
from boresight.sim.worlds.inertial.turning import (
    EARTH_RATE,
    Turn,
    Turning,
    Vibration,
    drawn,
    earth_rate,
    normal_gravity,
)
from boresight.systems.radar.flight import gravity as gravitation

pymap3d = pytest.importorskip("pymap3d")
DT, EARTH, G = 0.01, 1000.0 * earth_rate(32.0), 9.79
START = euler_to_matrix(np.radians([1.0, 2.0, 90.0]))
TURNS = (Turn(7), Turn(20, (0.1, 0.7, -0.2)), Turn(30, (0.0, 0.0, 2.0)))
SHAKEN = Vibration(
    np.array([2e-3, 1e-3]),
    np.array([3.0, 7.0]),
    np.array([0.3, 2.0]),
    np.array([0.6, 0.0, 0.8]),
    np.array([0.1, -0.4, 1.1]),
)


def turning(vibration=None, **more) -> Turning:
    return Turning(START, TURNS, DT, earth=EARTH, gravity=G, vibration=vibration, **more)


def attitudes(t: np.ndarray, vibration) -> Rotation:
    """Body to navigation, by composing rotations."""
    now, at = Rotation.from_matrix(START), 0.0
    found = np.empty((len(t), 4))
    for turn in TURNS:
        inside = t >= at - 1e-12
        vectors = np.outer(t[inside] - at, turn.rate)
        found[inside] = (Rotation.from_rotvec(vectors) * now).as_quat()
        now = Rotation.from_rotvec(np.array(turn.rate) * turn.samples * DT) * now
        at += turn.samples * DT
    whole = Rotation.from_quat(found)
    if vibration is None:
        return whole
    angle = vibration.amplitude * np.sin(
        2.0 * np.pi * vibration.hertz * t[:, None] + vibration.phase
    )
    return whole * Rotation.from_rotvec(angle.sum(axis=1)[:, None] * vibration.axis)


@pytest.mark.parametrize("vibration", [None, SHAKEN])
def test_increments_and_attitudes(vibration) -> None:
    """The sums of 200 small turns and pushes of each sample."""
    fine, of = 200, turning(vibration)
    n = of.samples
    t = np.arange(n * fine + 1) * (DT / fine)
    c = attitudes(t, vibration)
    inertial = Rotation.from_rotvec(np.outer(t, EARTH)) * c
    turned = (inertial[:-1].inv() * inertial[1:]).as_rotvec()
    v = np.zeros((len(t), 3))
    if vibration is not None:
        w = 2.0 * np.pi * vibration.hertz
        rate = (vibration.amplitude * w * np.cos(w * t[:, None] + vibration.phase)).sum(axis=1)
        v = c.apply(rate[:, None] * np.cross(vibration.axis, vibration.lever))
    middle = attitudes(0.5 * (t[:-1] + t[1:]), vibration)
    half = 0.5 * (v[:-1] + v[1:])
    pushed = np.diff(v, axis=0) + (2.0 * np.cross(EARTH, half) + [0.0, 0.0, G]) * (DT / fine)
    # At a jump of the rate the velocity jumps with the axis it turns about; no push is that.
    wanted = np.concatenate([turned, middle.inv().apply(pushed)], axis=1)
    wanted = wanted.reshape(n, fine, 6).sum(axis=1)
    found = np.concatenate([of.increments(0, 11), of.increments(11, n)])
    np.testing.assert_allclose(found[:, :3], wanted[:, :3], rtol=0.0, atol=2e-10)
    np.testing.assert_allclose(found[:, 3:], wanted[:, 3:], rtol=0.0, atol=2e-8)
    ends = slice(fine, None, fine)
    np.testing.assert_allclose(of.matrix(0, n), c[ends].as_matrix(), rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(of.velocity(0, n), v[ends], rtol=0.0, atol=1e-13)
    np.testing.assert_array_equal(of.matrix(3, 53, 10), of.matrix(3, 53)[9::10])
    np.testing.assert_array_equal(of.velocity(3, 53, 10), of.velocity(3, 53)[9::10])


def test_nothing_drifts_in_eight_hours() -> None:
    """At 36 deg/s, 80 turns per 800 s: the end is where it began."""
    of = Turning(
        START, (Turn(2_880_000, (0.0, 0.0, math.pi / 5)),), DT, earth=0.0 * EARTH, gravity=G
    )
    np.testing.assert_allclose(of.matrix(2_879_000, 2_880_000)[-1], START, rtol=0.0, atol=1e-10)
    late, early = of.increments(2_879_000, 2_880_000), of.increments(0, 1000)
    np.testing.assert_allclose(late, early, rtol=0.0, atol=1e-11)


def test_earth_rate_is_once_in_a_sidereal_day() -> None:
    """Along the pole as an independent package has it."""
    pole = np.array(pymap3d.uvw2enu(0.0, 0.0, 1.0, 31.9521, 118.6591))
    np.testing.assert_allclose(earth_rate(31.9521), EARTH_RATE * pole, rtol=1e-12)
    assert 2.0 * math.pi / EARTH_RATE == pytest.approx(86164.1, abs=0.05)


@pytest.mark.parametrize("latitude", [0.0, 31.9521, 60.0, 90.0])
@pytest.mark.parametrize("height", [0.0, 45.0, 3000.0])
def test_normal_gravity(latitude: float, height: float) -> None:
    """Of a field with J2 and J4, less the centrifugal force, along the vertical."""
    place = np.array(pymap3d.geodetic2ecef(latitude, 118.6591, height))
    whole = gravitation(place) + EARTH_RATE**2 * place * [1.0, 1.0, 0.0]
    up = np.array(pymap3d.enu2uvw(0.0, 0.0, 1.0, latitude, 118.6591))
    s = (place[2] / np.linalg.norm(place)) ** 2
    fourth = 5.0 * 2.3709e-6 * 9.81 * (35.0 * s * s - 30.0 * s + 3.0) / 8.0
    assert normal_gravity(latitude, height) == pytest.approx(fourth - float(up @ whole), abs=3e-6)


def test_normal_gravity_as_published() -> None:
    """The formula and constants of NIMA TR8350.2; its free-air gradient at 45 deg."""
    for sine in (0.0, 0.3, 0.7, 1.0):
        wanted = 9.7803253359 * (1.0 + 0.00193185265241 * sine**2)
        wanted /= math.sqrt(1.0 - 0.00669437999014 * sine**2)
        found = normal_gravity(math.degrees(math.asin(sine)), 0.0)
        assert found == pytest.approx(wanted, rel=1e-10)
    fallen = normal_gravity(45.0, 0.0) - normal_gravity(45.0, 1.0)
    assert fallen == pytest.approx(3.0855e-6, abs=2e-10)


def test_what_is_refused() -> None:
    with pytest.raises(InputError, match="turning, turns: wanted one at least"):
        Turning(START, (), DT, earth=EARTH, gravity=G)
    with pytest.raises(InputError, match="turning, dt: wanted more than 0 s, found 0"):
        Turning(START, TURNS, 0.0, earth=EARTH, gravity=G)


def test_a_vibration_is_as_large_as_asked_for() -> None:
    """Within its band; another draw is another one; none is none."""
    rng = np.random.default_rng(2)
    one, other = (drawn(0.02, 3.0, 12.0, (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), rng) for _ in "ab")
    assert one is not None and other is not None
    t = np.arange(100_000) * DT
    assert one.at(t).std() == pytest.approx(0.02, rel=0.02)
    assert one.hertz.min() >= 3.0 and one.hertz.max() <= 12.0 and np.ptp(one.hertz) > 2.0
    assert (one.hertz != other.hertz).all() and (one.phase != other.phase).all()
    assert one.side.tolist() == [0.0, -1.0, 0.0]
    assert drawn(0.0, 3.0, 12.0, (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), rng) is None
