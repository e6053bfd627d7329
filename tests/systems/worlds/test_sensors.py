"""Inertial sensors on turntables."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from boresight.sim.rotations.rotation import euler_to_matrix
from boresight.systems.radar.world import gravity as gravitation
from boresight.systems.worlds.sensors import Noise, Triad, signed
from boresight.systems.worlds.turning import EARTH_RATE, Turn, Turning, earth_rate, normal_gravity
from boresight.systems.worlds.turntable import Mark, Pulses, pulses

# -- errors of triads that report increments ------------------------------------------------------

DT, EXACT = 0.01, Noise()


def triad(noise: Noise = EXACT, seed: int = 1) -> Triad:
    bias, matrix = signed(None, 3e-3, 1e-2, 2e-2)
    return Triad(bias, matrix, noise, (seed, 2), DT)


def test_white_noise_walks_as_declared() -> None:
    """Variance of the integral: density^2 times time; axes by themselves."""
    result = triad(Noise(white=0.5)).read(np.zeros((40_000, 3))) - 3e-5
    np.testing.assert_allclose(result.var(axis=0), 0.5**2 * DT, rtol=0.04)
    assert np.abs(np.corrcoef(result.T) - np.eye(3)).max() < 0.02


# --------------------------------------------------------------------------------------------------
# increments in closed form against fine steps of scipy's rotations, gravity against its table

pymap3d = pytest.importorskip("pymap3d")
TURNING_DT, EARTH, G = 0.01, 1000.0 * earth_rate(32.0), 9.79
START = euler_to_matrix(np.radians([1.0, 2.0, 90.0]))
TURNS = (Turn(7), Turn(20, (0.1, 0.7, -0.2)), Turn(30, (0.0, 0.0, 2.0)))


def test_increments_and_attitudes() -> None:
    """The sums of 200 small turns and pushes of each sample; attitudes by composing rotations."""
    fine, of = 200, Turning(START, TURNS, TURNING_DT, earth=EARTH, gravity=G)
    n, step = of.samples, TURNING_DT / 200
    parts, before = [], Rotation.from_matrix(START)
    for turn in TURNS:
        half_steps = np.arange(2 * fine * turn.samples)
        parts.append(Rotation.from_rotvec(np.outer(half_steps * 0.5 * step, turn.rate)) * before)
        before = Rotation.from_rotvec(np.array(turn.rate) * turn.samples * TURNING_DT) * before
    c = Rotation.concatenate([*parts, before])
    inertial = Rotation.from_rotvec(np.outer(np.arange(n * fine + 1) * step, EARTH)) * c[::2]
    turned = (inertial[:-1].inv() * inertial[1:]).as_rotvec()
    pushed = c[1::2].inv().apply([0.0, 0.0, G * step])
    wanted = np.concatenate([turned, pushed], axis=1).reshape(n, fine, 6).sum(axis=1)
    values = np.concatenate([of.increments(0, 11), of.increments(11, n)])
    np.testing.assert_allclose(values[:, :3], wanted[:, :3], rtol=0.0, atol=2e-10)
    np.testing.assert_allclose(values[:, 3:], wanted[:, 3:], rtol=0.0, atol=2e-8)
    ends = c[2 * fine :: 2 * fine].as_matrix()
    np.testing.assert_allclose(of.matrix(0, n), ends, rtol=0.0, atol=1e-13)
    np.testing.assert_array_equal(of.matrix(3, 53, 10), of.matrix(3, 53)[9::10])


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


# -- pulses of the mark: when they come, what they tell, and faults by their share ----------------

TURNTABLE_DT, TURN = 0.01, 2.0 * math.pi
ARCSEC = math.radians(1.0) / 3600.0


def turntable_drawn(
    mark: Mark, deg_s: float = 37.3, heading: float = 1.0, hours: float = 2.0
) -> Pulses:
    samples = round(hours * 3600.0 / TURNTABLE_DT)
    return pulses(
        mark, heading, math.radians(deg_s), samples, TURNTABLE_DT, np.random.default_rng(5)
    )


def off(result: Pulses, deg_s: float = 37.3, heading: float = 1.0) -> np.ndarray:
    """Where the table is at each pulse less what the pulse tells [arcsec]."""
    passed = heading + math.radians(deg_s) * TURNTABLE_DT * (result.sample + result.share)
    return ((passed - result.azimuth + math.pi) % TURN - math.pi) / ARCSEC


def test_a_pulse_comes_where_the_mark_is() -> None:
    """Once a turn, as far off as a step of 18 bits, and timed."""
    result = turntable_drawn(Mark(at_deg=200.0))
    turns = 37.3 * 7200.0 / 360.0
    assert abs(len(result.sample) - turns) <= 1.0
    assert off(result).std() == pytest.approx(4.94 / math.sqrt(12.0), rel=0.06)
    assert abs(off(result).mean()) < 0.2
    assert (result.azimuth == math.radians(200.0)).all()
    assert (result.share >= 0.0).all() and (result.share <= 1.0).all()
    assert np.ptp(result.share) > 0.9 and (np.diff(result.sample) > 0).all()


def test_faults_by_their_shares() -> None:
    whole = turntable_drawn(Mark(at_deg=200.0), hours=8.0)
    n = len(whole.sample)
    fewer = turntable_drawn(Mark(at_deg=200.0, missed=0.3), hours=8.0)
    assert len(fewer.sample) / n == pytest.approx(0.7, abs=0.03)
    assert set(fewer.sample) < set(whole.sample)
    twice = turntable_drawn(Mark(at_deg=200.0, doubled=0.2), hours=8.0)
    assert len(twice.sample) / n == pytest.approx(1.2, abs=0.03)
    late = np.diff(twice.sample)
    assert set(whole.sample) < set(twice.sample) and set(late[late < 100]) == {1, 2, 3, 4, 5}
    both = turntable_drawn(Mark(at_deg=200.0, missed=0.3, doubled=0.2), hours=8.0)
    assert len(both.sample) / n == pytest.approx(0.7 * 1.2, abs=0.04)
    astray = turntable_drawn(Mark(at_deg=200.0, wrong=0.25), hours=8.0)
    assert len(astray.sample) / n == pytest.approx(1.25, abs=0.03)
    wrong = np.abs(off(astray)) > 60.0
    assert wrong.sum() / n == pytest.approx(0.25, abs=0.03)
    assert np.histogram(off(astray)[wrong], bins=4, range=(-648e3, 648e3))[0].min() > 0.15 * (
        wrong.sum()
    )
