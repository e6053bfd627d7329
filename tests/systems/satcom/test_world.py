"""The closed loop: what the core points at decides what is measured next."""

import math

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import close_loop, parting
from boresight.systems.satcom.drive import specification_drive
from boresight.systems.satcom.estimator import Satcom
from boresight.systems.satcom.world import OnTheMove, SensorErrors, Vehicles

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
    found, outputs = [], None
    for k in range(steps):
        record = fleet.record(outputs)
        assert record is not None
        found.append(record["e_psi"][0])
        outputs = answers(fleet, k, **off)
    return np.array(found)


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


def test_closed_loop_on_two_levels() -> None:
    """Integers part nowhere, and the antenna finds its satellite."""
    world, build = OnTheMove(), Build(Satcom())
    fixed = close_loop(world, make_level("fixed", build), steps=40)
    loops = [close_loop(world, make_level("c", build), steps=250)]
    assert parting(Satcom(), *loops, fixed) is None
    error = 180.0 * (loops[0].outputs["heading"] - loops[0].truth["heading"])[-50:]
    assert np.abs(error).max() < 1.2
    full = world.losses_db[0][0], world.losses_db[-1][0]
    assert full[0] > 2.0 > 1.0 > full[1]


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


@pytest.mark.parametrize(
    "options, message",
    [
        ({"tracking_hz": 60.0}, "satcom, tracking_hz: wanted 0 to 50 Hz, found 60.0"),
        ({"tracking_hz": math.nan}, "satcom, tracking_hz: wanted 0 to 50 Hz, found nan"),
        ({"beam": "roll"}, "satcom, beam: wanted heading or heading_pi, found 'roll'"),
        (
            {"place": (34.0, 0.0, 110.0)},
            "satcom, place: wanted a satellite above the horizon, found '-",
        ),
        ({"place": (91.0, 110.0, 110.0)}, "satcom, place: wanted up to 90 deg of latitude, 180"),
        ({"place": (34.0, 181.0, 181.0)}, "satcom, place: wanted up to 90 deg of latitude, 180"),
        ({"place": (math.nan, 0.0, 0.0)}, "satcom, place: wanted up to 90 deg of latitude, 180"),
    ],
)
def test_mistakes(options: dict, message: str) -> None:
    with pytest.raises(InputError, match=f"^{message}"):
        Vehicles(DRIVE, (1,), **options)


def test_tracking_at_20_hz_of_50() -> None:
    error = told(Vehicles(DRIVE, (3,), tracking_hz=20.0, errors=QUIET), 1000)
    assert np.isfinite(error[50:]).mean() == pytest.approx(0.4, abs=0.01)


def test_other_rates() -> None:
    world = OnTheMove(rate_hz=200.0)
    world.start()
    first, second = world.record(None), world.record(None)
    assert first is not None and second is not None
    assert (first["dt"], second["dt"]) == (-0.005, 0.005)
