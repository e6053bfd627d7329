"""Strapdown against closed forms: constant rate, Schuler, coning, sculling; in fixed point too."""

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from boresight.model.algebra.strapdown import FULL_SCALE, STEP_FORCE, STEP_TURN, beyond
from boresight.sim.levels.build import Build
from boresight.sim.levels.registry import make_level
from boresight.systems.array.estimator import ArrayAttitude
from tests.support.rotating_array import (
    ARCSEC,
    EARTH,
    LATITUDE,
    body,
    counts,
    gravity,
    increments,
    turning,
)

ANGLES = ("pitch", "roll", "heading")


def records(u: Any) -> Any:
    """Records of increments (n, 6): the array works, no index."""
    return np.concatenate([u, np.full((len(u), 1), 2.0), np.zeros((len(u), 3))], axis=1)


def run(u: Any, level: str = "float", start: Any = (1.0, 2.0, 90.0), **options: Any) -> Any:
    build = Build(ArrayAttitude(LATITUDE, 45.0, start, aided=False, **options))
    result = make_level(level, build).run(records(u))
    assert result.saturated is None or not result.saturated.any()
    return result.outputs


def errors(result: Any, motion: Any) -> Any:
    """(n, 3) arc seconds."""
    got = np.stack([result[a] for a in ANGLES], axis=1)
    t = 0.01 * np.arange(1, len(got) + 1)
    return ((got - motion(t)[0] / np.pi + 1.0) % 2.0 - 1.0) * np.pi / ARCSEC


@pytest.mark.parametrize("rate", [36.0, -0.35])
def test_constant_rate_at_a_tilt(rate: float) -> None:
    """Five minutes, without and with rounding; the velocity stays nothing."""
    angles = turning(rate, 0.0, 0.0, (66.0, 2.0, 90.0))
    u = counts(increments(angles, 30_000))
    for level, most in (("float", 0.006), ("c", 0.008)):
        result = run(u, level, (66.0, 2.0, 90.0))
        assert np.abs(errors(result, angles)).max() < most, level
        assert max(np.abs(result[f"v{a}"]).max() for a in "enu") < 4e-5, level


def test_axis_in_any_direction() -> None:
    """The pitch beyond 45 deg and back, all angles at once."""

    def angles(t: Any) -> Any:
        w = 0.2 * t
        result = [0.9 * np.sin(w), 0.7 * np.sin(1.3 * w), 2.0 + 2.0 * np.cos(w)]
        rates = [0.18 * np.cos(w), 0.182 * np.cos(1.3 * w), -0.4 * np.sin(w)]
        return np.stack(result, axis=1), np.stack(rates, axis=1)

    start = np.degrees(angles(np.zeros(1))[0][0])
    result = run(increments(angles, 3000), start=start)
    # two samples of the algorithm leave an error of the fifth order of the turn, and sculling
    assert np.abs(errors(result, angles)).max() < 0.02
    assert max(np.abs(result[f"v{a}"]).max() for a in "enu") < 1e-6
    q = np.stack([result[f"q{a}"] for a in "xyzw"], axis=1)
    want = body(angles(0.01 * np.arange(1, 3001))[0])
    assert np.abs((want.inv() * type(want).from_quat(q)).as_rotvec()).max() < 0.02 * ARCSEC


def errors_of_a_bias(bias: Any, t: Any) -> Any:
    """Velocity and phi (6, n) of a level unit at rest by the linear equations of its errors."""
    lat, e2 = np.radians(LATITUDE), 6.69437999014e-3
    root = np.sqrt(1.0 - e2 * np.sin(lat) ** 2)
    r_n = 6378137.0 / root + 45.0
    r_m = 6378137.0 * (1.0 - e2) / root**3 + 45.0
    earth, g = EARTH * np.array([0.0, np.cos(lat), np.sin(lat)]), gravity(LATITUDE, 45.0)

    def rates(_: float, x: Any) -> Any:
        v, phi = x[:3], x[3:]
        carry = np.array([-v[1] / r_m, v[0] / r_n, v[0] * np.tan(lat) / r_n])
        force = np.cross([0.0, 0.0, g], phi) + [*bias, 0.0] - np.cross(2.0 * earth, v)
        return np.concatenate([force, carry - np.cross(earth, phi)])

    return solve_ivp(rates, (0.0, t[-1]), np.zeros(6), t_eval=t, rtol=1e-9, atol=1e-13).y


def test_schuler() -> None:
    """Accelerometer biases swing the platform by b/g (1 - cos(w t)), w^2 = g/R; and the rest."""
    n, b = 200_000, np.array([-1e-4, 2e-4])
    u = np.repeat(increments(turning(0.0, 1e9, 0.0, (0.0, 0.0, 0.0)), 1), n, axis=0)
    u[:, 3:5] += 0.01 * b
    result, t = run(u, start=(0.0, 0.0, 0.0)), 0.01 * np.arange(1, n + 1)
    w = np.sqrt(gravity(LATITUDE, 45.0) / 6.36e6)
    # the closed form, but for the Earth's turn
    assert np.abs(result["vn"] - b[1] / w * np.sin(w * t)).max() < 0.08 * b[1] / w
    wanted = errors_of_a_bias(b, t[::1000])
    errors_ned = [result["ve"], result["vn"], result["vu"]]
    errors_ned += [-np.pi * result[a] for a in ("pitch", "roll", "heading")]
    for name, ours, theirs in zip(("e", "n", "u", *ANGLES), errors_ned, wanted, strict=True):
        assert np.abs(ours[::1000] - theirs).max() < 0.01 * np.abs(theirs).max(), name
    assert np.abs(wanted[5]).max() > 5e-6  # the heading too


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
        def __init__(self, **options: float) -> None:
            self.given = options

        def __getattr__(self, name: str) -> Any:
            return np.float64(self.given.get(name, 0.0))

    for name, full in (("dtheta_y", STEP_TURN), ("dv_z", STEP_FORCE)):
        assert beyond(U(**{name: -full})) and beyond(U(**{name: full * (1.0 - 2.0**-31)}))
        assert not beyond(U(**{name: 0.999 * FULL_SCALE * full}))
    assert EARTH * 0.01 < STEP_TURN
