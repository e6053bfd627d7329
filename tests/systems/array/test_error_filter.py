"""The error filter, the index, and short words."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from boresight.model.algebra.strapdown import Angles, angles
from boresight.systems.array import error_filter as errors
from boresight.systems.array.error_filter import KINDS, PHI, UNITS
from boresight.systems.array.estimator import ArrayAttitude
from tests.support.rotating_array import EARTH, LATITUDE

# -- propagation against matrices in SI units; what grows, and what stops growing -----------------

SCALES = np.array([UNITS[k] for k in KINDS])
LAT = np.radians(LATITUDE)


def scalar_first(r: Rotation) -> Any:
    return r.as_quat()[[3, 0, 1, 2]]


def dynamics(c: Any, up_rate: float) -> Any:
    """F of the 13 states."""
    f, w = np.zeros((13, 13)), EARTH * np.array([0.0, np.cos(LAT), np.sin(LAT)])

    def skew(a: Any) -> Any:
        return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])

    f[0:3, 4:7], f[0:3, 10:13] = skew([0.0, 0.0, errors.G]), c
    f[4:7, 4:7], f[4:7, 7:10] = -skew(w), -c
    f[6, 3] = -up_rate
    return f


@pytest.mark.parametrize("seconds", [1.0, 0.37])
def test_propagation(seconds: float) -> None:
    rng = np.random.default_rng(3)
    root = 0.1 * rng.normal(size=(13, 13))
    finer = np.array([0.25] * 3 + [1.0] * 10)  # of velocities, which are held in large units
    root *= finer[:, None]
    p = root @ root.T
    start, rate = Rotation.from_euler("ZXY", [1.0, 1.1, 0.1]), np.radians(36.0)
    end = Rotation.from_rotvec([0.0, 0.0, rate * seconds]) * start
    earth = tuple(EARTH * seconds * np.array([np.cos(LAT), np.sin(LAT)]))
    result = errors.propagated(p, scalar_first(start), scalar_first(end), seconds, earth)
    # the mean of C over the arc
    t = (np.arange(200) + 0.5) / 200.0 * seconds
    turns = Rotation.from_rotvec(np.outer(rate * t, [0.0, 0.0, 1.0]))
    c = (turns * start).as_matrix().mean(axis=0)
    phi = np.eye(13) + seconds * dynamics(c, rate)
    phi = np.diag(1.0 / SCALES) @ phi @ np.diag(SCALES)
    wanted, by = phi @ p @ phi.T, np.outer(finer, finer)
    # over 36 deg C half way is 1 % short across the axis, 2.4 % along it, and the angle its sine
    assert np.array(result) / by == pytest.approx(wanted / by, abs=3e-3 * seconds**2 + 1e-4)
    assert np.abs((wanted - p) / by).max() > 0.02
    still = errors.propagated(p, scalar_first(start), scalar_first(start), 1.0, (0.0, 0.0))
    c = start.as_matrix()
    exact = np.diag(1.0 / SCALES) @ expm(dynamics(c, 0.0)) @ np.diag(SCALES)
    assert np.array(still) == pytest.approx(exact @ p @ exact.T, abs=1e-3)


def test_noise_and_what_stops_it() -> None:
    p = SimpleNamespace(**ArrayAttitude().param_values({"gyro_walk": 1e-9, "force_walk": 1e-4}))
    variances = {f"p{k}{k}": 0.1 for k in "0123456789abc"}

    def grown(*case: Any, **more: float) -> dict[str, float]:
        """By kind, of which the last state counts."""
        return dict(
            zip(KINDS, errors.grown(SimpleNamespace(**variances | more), p, *case), strict=True)
        )

    result = grown(1.0, True, False)
    floor = errors.FLOOR_NOISE
    assert result["tilt"] == pytest.approx((1.5e-7 / UNITS["tilt"]) ** 2 + floor)
    assert result["heading"] == pytest.approx((1.5e-7 / UNITS["heading"]) ** 2 + floor)
    assert result["velocity"] == pytest.approx((5e-5 / UNITS["velocity"]) ** 2 + floor)
    assert result["gyro"] == pytest.approx((1e-9 / UNITS["gyro"]) ** 2 + floor)
    assert result["scale"] == floor
    full = grown(1.0, True, False, paa=0.3)
    assert full["gyro"] == full["scale"] == full["force"] == 0.0 < full["tilt"]
    limited = grown(1.0, True, False, p22=0.2, p55=0.5, p66=0.5)
    assert limited["velocity"] == limited["tilt"] == limited["heading"] == 0.0 < limited["gyro"]
    erected = grown(1.0, True, True)
    assert erected["force"] == pytest.approx((300.0 * 9.80665e-6 / UNITS["force"]) ** 2)
    assert not any(grown(0.0, False, True).values())


# --------------------------------------------------------------------------------------------------
# what an index measures: its row, by differences of angles; its time, its noise, both readings

SHARE = np.array([UNITS["tilt"], UNITS["tilt"], UNITS["heading"]])
C = Rotation.from_euler("ZXY", [100.0, 66.0, 7.0], degrees=True)


def seen_of(c: Rotation) -> Angles:
    return angles(np.asarray(c.as_quat()[[3, 0, 1, 2]]))


def heading(c: Rotation) -> float:
    m = c.as_matrix()
    return float(np.arctan2(-m[0, 1], m[1, 1]))


def test_the_row_is_the_derivative() -> None:
    """heading of C less heading of (1 + phi x) C, times the cosine of the pitch."""
    row = errors.heading_row(seen_of(C))
    result = np.array([row[k] for k in PHI]) * UNITS["heading"] / SHARE
    assert np.linalg.norm(result) == pytest.approx(1.0)
    for k in range(3):
        phi = np.zeros(3)
        phi[k] = 1e-6
        moved = heading(C) - heading(Rotation.from_rotvec(phi) * C)
        assert result[k] == pytest.approx(np.cos(np.radians(66.0)) * moved / 1e-6, abs=1e-5)


@pytest.mark.parametrize("at", [0.0, 0.25, 1.0])
def test_the_heading_is_that_of_the_index(at: float) -> None:
    turn = np.array([1e-3, -5e-4, 6e-3])
    then = C * Rotation.from_rotvec(-(1.0 - at) * turn)
    sample: Any = SimpleNamespace(turn=turn)
    azimuth = heading(then) / np.pi - 0.3
    off = errors.offset(SimpleNamespace(index_time=at, azimuth=azimuth), sample, seen_of(C))
    # within the square of the turn
    assert off == pytest.approx(0.3, abs=1e-4 * (1.0 - at) + 1e-12)
