"""Strapdown against closed forms: constant rate, Schuler, coning, sculling; in fixed point too."""

from typing import Any

import numpy as np
import pytest

from boresight.model.algebra.strapdown import FULL_SCALE, STEP_FORCE, STEP_TURN, beyond
from boresight.model.estimators.array.attitude import ArrayAttitude
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from tests.support.array import ARCSEC, EARTH, LATITUDE, body, counts, gravity, increments, turning

ANGLES = ("pitch", "roll", "heading")


def records(u: Any) -> Any:
    """Records of increments (n, 6): the array works, no index."""
    return np.concatenate([u, np.full((len(u), 1), 2.0), np.zeros((len(u), 3))], axis=1)


def run(u: Any, level: str = "float", start: Any = (1.0, 2.0, 90.0), **options: Any) -> Any:
    build = Build(ArrayAttitude(LATITUDE, 45.0, start, aided=False, **options))
    found = make_level(level, build).run(records(u))
    assert found.saturated is None or not found.saturated.any()
    return found.outputs


def errors(found: Any, motion: Any) -> Any:
    """(n, 3) arc seconds."""
    got = np.stack([found[a] for a in ANGLES], axis=1)
    t = 0.01 * np.arange(1, len(got) + 1)
    return ((got - motion(t)[0] / np.pi + 1.0) % 2.0 - 1.0) * np.pi / ARCSEC


@pytest.mark.parametrize("rate", [36.0, -0.35])
def test_constant_rate_at_a_tilt(rate: float) -> None:
    """Five minutes, without and with rounding; the velocity stays nothing."""
    angles = turning(rate, 0.0, 0.0, (66.0, 2.0, 90.0))
    u = counts(increments(angles, 30_000))
    for level, most in (("float", 0.006), ("c", 0.008)):
        found = run(u, level, (66.0, 2.0, 90.0))
        assert np.abs(errors(found, angles)).max() < most, level
        assert max(np.abs(found[f"v{a}"]).max() for a in "enu") < 4e-5, level


def test_axis_in_any_direction() -> None:
    """The pitch beyond 45 deg and back, all angles at once."""

    def angles(t: Any) -> Any:
        w = 0.2 * t
        found = [0.9 * np.sin(w), 0.7 * np.sin(1.3 * w), 2.0 + 2.0 * np.cos(w)]
        rates = [0.18 * np.cos(w), 0.182 * np.cos(1.3 * w), -0.4 * np.sin(w)]
        return np.stack(found, axis=1), np.stack(rates, axis=1)

    start = np.degrees(angles(np.zeros(1))[0][0])
    found = run(increments(angles, 3000), start=start)
    # two samples of the algorithm leave an error of the fifth order of the turn, and sculling
    assert np.abs(errors(found, angles)).max() < 0.02
    q = np.stack([found[f"q{a}"] for a in "xyzw"], axis=1)
    want = body(angles(0.01 * np.arange(1, 3001))[0])
    assert np.abs((want.inv() * type(want).from_quat(q)).as_rotvec()).max() < 0.02 * ARCSEC


def test_schuler() -> None:
    """A level accelerometer bias b swings the platform by b/g (1 - cos(w t)), w^2 = g/R."""
    n, b = 200_000, 2e-4
    still = turning(0.0, 1e9, 0.0, (0.0, 0.0, 0.0))
    u = np.repeat(increments(still, 1), n, axis=0)
    u[:, 4] += b * 0.01  # north
    found = run(u, start=(0.0, 0.0, 0.0))
    g, t = gravity(LATITUDE, 45.0), 0.01 * np.arange(1, n + 1)
    radius = 6378137.0 * (1.0 - 6.69437999014e-3)
    radius /= (1.0 - 6.69437999014e-3 * np.sin(np.radians(LATITUDE)) ** 2) ** 1.5
    w = np.sqrt(g / (radius + 45.0))
    vn, tilt = b / w * np.sin(w * t), b / g * (1.0 - np.cos(w * t))
    # the Earth's turn couples the two axes: the amplitude is its own within 4 % at this time
    assert np.abs(found["vn"] - vn).max() < 0.04 * b / w
    assert np.abs(np.pi * found["pitch"] - tilt).max() < 0.04 * 2.0 * b / g
    assert found["vn"][-1] < 0.7 * b / w and found["vn"].max() > 0.97 * b / w


def test_coning() -> None:
    """Two axes shake out of phase: without the increments before, a drift of 0.6 arc seconds."""
    size, f = 2e-3, 2.0 * np.pi * 5.0

    def angles(t: Any) -> Any:
        c, s = size * np.cos(f * t), size * np.sin(f * t)
        return np.stack([c, s, 0.0 * t], axis=1), f * np.stack([-s, c, 0.0 * t], axis=1)

    u = increments(angles, 2000)
    start = np.degrees(angles(np.zeros(1))[0][0])
    error = errors(run(u, start=start), angles)[-200:, 2]
    drift = -(size**2) * f / 2.0 * 20.0 * (f * 0.01) ** 2 / 12.0 / ARCSEC
    assert abs(drift) > 0.5 and np.abs(error - error.mean()).max() < 1.0
    assert abs(error.mean()) < 0.05 * abs(drift) + 0.3


def test_full_scale_is_flagged() -> None:
    class U:
        def __init__(self, **given: float) -> None:
            self.given = given

        def __getattr__(self, name: str) -> Any:
            return np.float64(self.given.get(name, 0.0))

    for name, full in (("dtheta_y", STEP_TURN), ("dv_z", STEP_FORCE)):
        assert beyond(U(**{name: -full})) and beyond(U(**{name: full * (1.0 - 2.0**-31)}))
        assert not beyond(U(**{name: 0.999 * FULL_SCALE * full}))
    assert EARTH * 0.01 < STEP_TURN
