"""The closed loop of satcom: dish, drives, receiver."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j0

from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import close_loop
from boresight.systems.satcom.estimator import Satcom
from boresight.systems.satcom.world import (
    APERTURE,
    OnTheMove,
    SensorErrors,
    pattern,
    specification_drive,
)

# -- the closed loop: what the core points at decides what is measured next -----------------------

QUIET = SensorErrors((0.0, 0.0, 0.0), 0.0, 0.0, (0.0, 0.0, 0.0), 0.0)
DRIVE = specification_drive()


def answers(fleet: OnTheMove, k: int, heading_off: float = 0.0, roll_off: float = 0.0):
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


def told(fleet: OnTheMove, steps: int, **off: float):
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
    fleet = OnTheMove(seeds=(3,), errors=QUIET)
    error = told(fleet, 1200, heading_off=off)
    assert np.isnan(np.delete(error, np.arange(9, 1200, 10))).all()  # 5 Hz
    assert np.nanmean(error[20:]) == pytest.approx(off, rel=0.1)
    assert 0.001 < np.nanstd(error[20:]) < 0.006  # 0.2 deg, of the link's noise
    assert np.nanmax(fleet.losses_db[100]) < 1.0


def test_a_perfect_estimator_stays_on_the_satellite() -> None:
    fleet = OnTheMove(seeds=(3,), errors=QUIET)
    told(fleet, 1500)
    assert max(v[0] for v in fleet.losses_db[2:]) < 1e-4


def test_sensors() -> None:
    errors = SensorErrors((0.3, -0.4, 0.5), 0.05, 0.01, (0.1, 0.0, -0.1), 0.05)
    fleet = OnTheMove(seeds=(1, 2), errors=errors)
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


def test_a_start_aslant_finds_the_satellite() -> None:
    """A tilt far from level is corrected in steps: no heading, no acceleration is made of it."""
    world = OnTheMove("rough", seeds=(2,))
    loop = close_loop(world, make_level("c", Build(Satcom())), steps=150)
    heading = 180.0 * (loop.outputs["heading"] - loop.truth["heading"])[1:]
    assert np.abs(heading).max() < 2.5 and np.abs(heading[-50:]).max() < 1.5
    assert max(v[0] for v in world.losses_db[25:]) < 3.0


# -- the beam against a numerical aperture --------------------------------------------------------


def test_pattern_is_that_of_the_tapered_aperture() -> None:
    angles = np.radians([0.05, 0.5, 1.0, 1.3, 2.0, 3.5, 6.0])
    area = quad(lambda r: r * math.sqrt(1 - r * r), 0, 1)[0]
    for angle in angles:
        u = APERTURE * math.sin(angle)
        field = quad(lambda r, u=u: r * math.sqrt(1 - r * r) * j0(u * r), 0, 1)[0] / area
        assert pattern(np.array(math.sin(angle))) == pytest.approx(field**2, abs=1e-8)
    assert pattern(np.array(0.0)) == pytest.approx(1.0, abs=1e-6)
    far = np.sin(np.linspace(math.radians(3.2), math.radians(5.0), 400))
    assert 10 * np.log10(pattern(far).max()) == pytest.approx(-21.3, abs=0.3)
