"""Initial alignment: any start, a shaking array, errors of the instruments, one that moves."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.sim.worlds.loop import close_loop
from boresight.systems.array.estimator import ArrayAttitude
from boresight.systems.array.world import ERECTED, TurningArray
from tests.support.rotating_array import ARCSEC, EARTH, LATITUDE, body, counts, gravity, increments

ANGLES = ("pitch", "roll", "heading")
UNKNOWN = 256  #: in the status
GYRO, FORCE = np.array([1.0, -1.0, 0.5]) * 0.003 * ARCSEC, np.array([-2e-4, 2e-4, 1e-4])


def records(start: Any, seconds: float, dt: float = 0.01, shake: float = 2.5e-5) -> Any:
    """The array at rest in ``start`` [deg] but for 5 Hz of ``shake`` [rad], and its angles."""
    w, where = 2.0 * np.pi * 5.0, np.radians(start)

    def motion(t: Any) -> Any:
        move, rate = shake * np.sin(w * t), shake * w * np.cos(w * t)
        return where + np.stack([move, -move, move], 1), np.stack([rate, -rate, rate], 1)

    n = round(seconds / dt)
    u = np.zeros((n, 10))
    u[:, :6] = increments(motion, n, dt) + dt * np.concatenate([GYRO, FORCE])
    u[:, :6] = counts(u[:, :6])
    return u, motion(dt * np.arange(1, n + 1))[0]


@cache
def build(**options: Any) -> Build:
    return Build(ArrayAttitude(**options))


def run(u: Any, level: str = "c", **options: Any) -> Any:
    return make_level(level, build(**options)).run_anew(u)


def errors(result: Any, angles: Any) -> Any:
    """(n, 3) arc seconds."""
    got = np.stack([result.outputs[a] for a in ANGLES], axis=1)
    return ((got - angles / np.pi + 1.0) % 2.0 - 1.0) * 648000.0


def status(result: Any) -> Any:
    return np.rint(result.outputs["status"]).astype(int)


@pytest.mark.parametrize(
    "start, align, most",
    [
        ((5.0, -5.0, -60.0), 150.0, 150.0),
        ((1.0, 1.5, 179.9), 150.0, 151.0),
        ((40.0, 9.0, 30.0), 150.0, 150.0),
        ((5.0, -5.0, 30.0), 300.0, 300.0),
    ],
)
def test_any_start_is_found_to_what_the_instruments_allow(
    start: Any, align: float, most: float
) -> None:
    """Heading: east gyro bias over the Earth's rate, north; tilt: accelerometers' over gravity."""
    u, angles = records(start, most)
    c, lat = body(np.radians([start])).as_matrix()[0], np.radians(LATITUDE)
    level = c @ FORCE / gravity(LATITUDE, 45.0)
    north = (c @ GYRO)[0] / (EARTH * np.cos(lat)) - np.tan(lat) * level[0]
    for name in ("float", "c"):
        result = run(u, name, attitude=(0.0, 0.0, 0.0), align=align)
        bits = status(result) & UNKNOWN
        assert bits[round(95.0 * align)] and not bits[-1], name
        q = np.array([[result.outputs[f"q{a}"][-1] for a in "xyzw"]])
        turn = (type(body(angles[:1])).from_quat(q) * body(angles[-1:]).inv()).as_rotvec()[0]
        wanted = np.array([level[1], -level[0], north])
        level_off = np.abs(turn - wanted)[:2].max()
        assert level_off < 0.35 * ARCSEC, name
        assert abs(turn - wanted)[2] < 3.0 * ARCSEC, name


@pytest.mark.parametrize("seed", [1, 4])
def test_one_turn_after_any_start_the_errors_are_small(seed: int) -> None:
    """5 deg of tilt, any heading, noise: from a second after the first turn on below 30 arcsec."""
    world = TurningArray(36.0, seed, hours=0.02, noise=1.0, tilt_deg=5.0)
    loop = close_loop(world, make_level("c", build()))
    angles = np.pi * np.stack([loop.truth[a] for a in ANGLES], axis=1)
    error = errors(loop.run, angles)[1 + ERECTED + 1100 :]
    assert len(error) > 6000 and np.abs(error).max() < 30.0


def test_c_and_rtl_align_with_the_same_words() -> None:
    """A short alignment from its begin to the filter's first second."""
    options = {"rate": 50.0, "align": 30.0, "attitude": (0.0, 0.0, 0.0)}
    u, _ = records((5.0, -5.0, 120.0), 34.0, 0.02)
    c, rtl = (run(u, name, **options) for name in ("c", "rtl"))
    assert not status(c)[-1] & UNKNOWN
    for name, values in c.outputs.items():
        assert np.array_equal(values, rtl.outputs[name]), name


def test_an_array_that_moves_is_aligned_when_it_rests() -> None:
    """Moved after 10 s; an index before the attitude is known is not used."""
    options = {"rate": 50.0, "align": 30.0}
    u, angles = records((1.0, 2.0, 90.0), 52.0, 0.02)
    u[500:1000, 6], u[700, 9] = 2.0, 1.0
    result = run(u, **options)
    bits = status(result)
    assert not (bits & 64).any()
    assert (bits[:2400] & UNKNOWN).all() and not (bits[2502:] & UNKNOWN).any()
    assert np.abs(errors(result, angles)[-1]).max() < 100.0
