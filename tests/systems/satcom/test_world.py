"""The closed loop of satcom: dish, drives, receiver."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j0

from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import close_loop
from boresight.systems.satcom.dish import Link
from boresight.systems.satcom.drive import specification_drive
from boresight.systems.satcom.estimator import Satcom
from boresight.systems.satcom.receiver import Receiver
from boresight.systems.satcom.world import OnTheMove, SensorErrors, Vehicles

# -- the closed loop: what the core points at decides what is measured next -----------------------

QUIET = SensorErrors((0.0, 0.0, 0.0), 0.0, 0.0, (0.0, 0.0, 0.0), 0.0)
DRIVE = specification_drive()
RATE_HZ = 50.0


def answers(fleet: Vehicles, k: int, heading_off: float = 0.0, roll_off: float = 0.0):
    """Outputs of an estimator that knows the attitude but for an error [rad]."""
    half = heading_off / 2.0
    w, x, y, z = fleet.truth[k]
    c, s = math.cos(half), math.sin(half)  # turned about down
    q = np.array([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w])
    c, s = math.cos(roll_off / 2.0), math.sin(roll_off / 2.0)  # about the front
    w, x, y, z = q
    q = np.array([c * w - s * x, c * x + s * w, c * y + s * z, c * z - s * y])
    ahead = fleet.drive.ride.rate[min(k + 1, len(fleet.drive.ride.rate) - 1)]
    out = {f"q{a}": np.array([v]) for a, v in zip("wxyz", q, strict=True)}
    out |= {f"rate_{a}": np.array([v]) for a, v in zip("xyz", ahead, strict=True)}
    heading = (fleet.heading[k] + heading_off) / math.pi
    return out | {"heading": np.array([heading]), "heading_pi": np.array([heading + 0.004])}


def told(fleet: Vehicles, steps: int, **off: float):
    """Tracking errors [rad] that such an estimator is told."""
    results, outputs = [], None
    for k in range(steps):
        record = fleet.record(outputs)
        assert record is not None
        results.append(record["e_psi"][0])
        outputs = answers(fleet, k, **off)
    return np.array(results)


@pytest.mark.parametrize("off", [0.006, -0.01])
def test_tracking_error_is_estimate_less_truth(off: float) -> None:
    fleet = Vehicles(DRIVE, (3,), errors=QUIET)
    error = told(fleet, 1200, heading_off=off)
    assert np.isnan(np.delete(error, np.arange(9, 1200, 10))).all()  # 5 Hz
    assert np.nanmean(error[20:]) == pytest.approx(off, rel=0.1)
    assert 0.001 < np.nanstd(error[20:]) < 0.006  # 0.2 deg, of the link's noise
    assert np.nanmax(fleet.losses_db[100]) < 1.0


def test_a_perfect_estimator_stays_on_the_satellite() -> None:
    fleet = Vehicles(DRIVE, (3,), errors=QUIET)
    told(fleet, 1500)
    assert max(v[0] for v in fleet.losses_db[2:]) < 1e-4


def test_beam_on_the_heading_of_the_loop() -> None:
    fleet = Vehicles(DRIVE, (3,), beam="heading_pi", errors=QUIET)
    assert np.nanmean(told(fleet, 2000)[20:]) == pytest.approx(0.004 * math.pi, rel=0.1)


def test_far_off_there_is_no_signal() -> None:
    assert np.isnan(told(Vehicles(DRIVE, (3,), errors=QUIET), 300, heading_off=0.1)[20:]).all()
    assert np.isnan(told(Vehicles(DRIVE, (3,), errors=QUIET), 300, roll_off=math.pi)[20:]).all()
    off = Vehicles(DRIVE, (3,), tracking_hz=0.0, errors=QUIET)
    assert np.isnan(told(off, 300)).all()


def test_sensors() -> None:
    errors = SensorErrors((0.3, -0.4, 0.5), 0.05, 0.01, (0.1, 0.0, -0.1), 0.05)
    fleet = Vehicles(DRIVE, (1, 2), errors=errors)
    rows = [fleet.record(None) for _ in range(2000)]
    gyro = np.degrees([[r[f"g{a}"] for a in "xyz"] for r in rows])
    acc = np.array([[r[f"a{a}"] for a in "xyz"] for r in rows])
    gyro = (
        gyro
        - np.degrees(DRIVE.ride.rate[:2000, :, None])
        - np.degrees(fleet.bias[:2000]).swapaxes(1, 2)
    )
    acc = acc - DRIVE.ride.force[:2000, :, None] - np.array([0.1, 0.0, -0.1])[:, None]
    assert gyro.std() == pytest.approx(0.05, rel=0.05) and acc.std() == pytest.approx(
        0.05, rel=0.05
    )
    assert abs(gyro.mean()) < 0.003 and abs(acc.mean()) < 0.003
    walk = np.degrees(fleet.bias[1999] - fleet.bias[0])
    assert 1e-3 < np.abs(walk).max() < 0.5 and (walk[0] != walk[1]).all()


def test_one_of_many_is_the_world() -> None:
    """What a run is does not depend on the others."""
    fleet, world = Vehicles(DRIVE, (4, 7)), OnTheMove(seed=7)
    world.start()
    outputs, single = None, None
    for k in range(30):
        a, b = fleet.record(outputs), world.record(single)
        assert a is not None and b is not None
        for name, value in a.items():
            assert value[-1] == pytest.approx(b[name], abs=1e-14, nan_ok=True), name
        outputs = {n: np.repeat(v, 2) for n, v in answers(fleet, k).items()}
        single = answers(fleet, k)
    assert b["roll_true"] == pytest.approx(DRIVE.ride.euler[29, 0] / math.pi, abs=1e-15)


def test_a_start_aslant_finds_the_satellite() -> None:
    """A tilt far from level is corrected in steps: no heading, no acceleration is made of it."""
    world = OnTheMove("rough", seed=2)
    loop = close_loop(world, make_level("c", Build(Satcom())), steps=150)
    heading = 180.0 * (loop.outputs["heading"] - loop.truth["heading"])[1:]
    assert np.abs(heading).max() < 2.5 and np.abs(heading[-50:]).max() < 1.5
    assert max(v[0] for v in world.losses_db[25:]) < 3.0


def test_ends_and_begins_anew() -> None:
    world = OnTheMove()
    world.start()
    first = world.record(None)
    world._k = len(DRIVE.ride.q)
    assert world.record(None) is None
    world.start()
    again = world.record(None)
    assert [*again] == [*first]
    for name, value in first.items():
        np.testing.assert_array_equal(again[name], value)
    assert first["dt"] == -1.0 / RATE_HZ


def test_tracking_at_20_hz_of_50() -> None:
    error = told(Vehicles(DRIVE, (3,), tracking_hz=20.0, errors=QUIET), 1000)
    assert np.isfinite(error[50:]).mean() == pytest.approx(0.4, abs=0.01)


# -- the beam against a numerical aperture, the link against its textbook figure ------------------


def test_pattern_is_that_of_the_tapered_aperture() -> None:
    link = Link()
    angles = np.radians([0.05, 0.5, 1.0, 1.3, 2.0, 3.5, 6.0])
    area = quad(lambda r: r * math.sqrt(1 - r * r), 0, 1)[0]
    for angle in angles:
        u = link.aperture * math.sin(angle)
        field = quad(lambda r, u=u: r * math.sqrt(1 - r * r) * j0(u * r), 0, 1)[0] / area
        assert link.pattern(np.array(math.sin(angle))) == pytest.approx(field**2, abs=1e-8)
    assert link.pattern(np.array(0.0)) == pytest.approx(1.0, abs=1e-6)
    far = np.sin(np.linspace(math.radians(3.2), math.radians(5.0), 400))
    assert 10 * np.log10(link.pattern(far).max()) == pytest.approx(-21.3, abs=0.3)


def test_link_budget() -> None:
    """6 dBW - 205.8 dB + 35.8 dBi - 22.3 dBK + 228.6 dBW/K/Hz."""
    assert 10 * math.log10(Link().cn0) == pytest.approx(42.3, abs=0.2)
    twice = Link(diameter_m=1.2)
    assert twice.cn0 / Link().cn0 == pytest.approx(4.0)


# -- the drives: what is specified, at any rate ---------------------------------------------------


def heading(d):
    return np.stack([np.cos(d.euler[:, 2]), np.sin(d.euler[:, 2])], axis=1)


# -- the receiver: errors with their sign, lock, intervals ----------------------------------------


def scan(right: float, up: float, *, loss: float = 1.0, ahead: float = 1.0, runs: int = 400):
    """Errors (2, runs) [deg] and mean powers of one interval."""
    receiver = Receiver(Link(), 10)
    noise = np.random.default_rng(1).normal(size=(10, 4, 2, runs))
    at = [np.full(runs, v) for v in (right, up, ahead)]
    for k in range(9):
        assert receiver.sample(*at, loss, noise[k]) is None
    result = receiver.sample(*at, loss, noise[9])
    assert result is not None
    return np.degrees(result[0]), result[1]


def test_error_is_measured_with_its_sign() -> None:
    error, _ = scan(math.radians(0.2), math.radians(-0.1))
    assert np.nanmean(error, axis=1) == pytest.approx([0.2, -0.1], abs=0.02)
    assert 0.05 < error.std(axis=1).max() < 0.25


def test_lock_follows_from_the_signal() -> None:
    for right, loss, ahead in ((0.0, 1e-6, 1.0), (math.radians(3.6), 1.0, 1.0), (0.0, 1.0, -1.0)):
        error, _ = scan(right, 0.0, loss=loss, ahead=ahead)
        assert np.isnan(error).all()
    error, power = scan(math.radians(0.5), 0.0)
    assert not np.isnan(error).any() and (power > 0.0).all()
