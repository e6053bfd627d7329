"""Flights of a target in earth-fixed axes (WGS 84)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import pymap3d

from boresight import InputError
from boresight.model.arrays import FloatArray
from boresight.model.errors import require_choice

GM = 3.986004418e14  #: m^3/s^2
J2 = 1.08262668e-3
EQUATOR = 6378137.0  #: m
EARTH_RATE = 7.292115e-5  #: rad/s
#: Radars of the paper: longitude, latitude [deg], height [m].
SITES = ((115.74, 29.43, 5.0), (114.11, 30.71, 5.0))


def gravity(place: FloatArray) -> FloatArray:
    """Gravitation of the earth with J2 [m/s^2], without the centrifugal part, at (3,) [m]."""
    x, y, z = place
    square = x * x + y * y + z * z
    flat = 1.5 * J2 * EQUATOR**2 / square
    bulge = 5.0 * z * z / square
    side = 1.0 + flat * (1.0 - bulge)
    pull: FloatArray = (
        -GM / square**1.5 * np.array([x * side, y * side, z * (1.0 + flat * (3.0 - bulge))])
    )
    return pull


def ballistic(place: Sequence[float], velocity: Sequence[float], t: FloatArray) -> FloatArray:
    """Positions (n, 3) at times (n,) of a body that falls freely, in axes that turn with the earth.

    Runge and Kutta's fourth order, a step from each time to the next.
    """
    w = EARTH_RATE

    def rate(s: FloatArray) -> FloatArray:
        x, y, _, vx, vy, _ = s
        # 2 w x v + w x (w x p), of w along z
        turning = np.array([2.0 * (-w * vy) - w * (w * x), 2.0 * (w * vx) - w * (w * y), 0.0])
        return np.concatenate([s[3:], gravity(s[:3]) - turning])

    state = np.array([*place, *velocity], dtype=np.float64)
    points = [state[:3]]
    for h in np.diff(t):
        k1 = rate(state)
        k2 = rate(state + h / 2.0 * k1)
        k3 = rate(state + h / 2.0 * k2)
        k4 = rate(state + h * k3)
        state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        points.append(state[:3])
    return np.array(points)


def straight(
    site: Sequence[float], start: Sequence[float], velocity: Sequence[float], t: FloatArray
) -> FloatArray:
    """Positions (n, 3) on a line given in east, north, up [m, m/s] of a site."""
    longitude, latitude, height = site
    e, n, u = np.array(start)[:, None] + np.array(velocity)[:, None] * t
    return np.stack(pymap3d.enu2ecef(e, n, u, latitude, longitude, height), axis=1)


#: Flights by name: the paper's missile; an aircraft at 11 km that crosses the line between the
#: radars; a fast one at 24 km that passes close to the zenith of radar 1.
FLIGHTS: dict[str, Callable[[FloatArray], FloatArray]] = {
    "printed": partial(ballistic, (-2664e3, 5350e3, 2870e3), (1700.0, 104.0, 1100.0)),
    "crossing": partial(straight, SITES[0], (-1.3e5, 3e4, 11e3), (620.0, 140.0, 4.0)),
    "overhead": partial(straight, SITES[0], (-6e4, 4e4, 24e3), (900.0, -580.0, 0.0)),
}


def flight(name: str, t: FloatArray) -> FloatArray:
    """Positions (n, 3) [m] of one of `FLIGHTS` at times (n,) [s].

    `InputError`: no such flight; it ends below the ground.
    """
    require_choice("flight", name, FLIGHTS)
    place = FLIGHTS[name](t)
    if (height := pymap3d.ecef2geodetic(*place.T)[2]).min() < 0.0:
        raise InputError.at(
            f"flight {name}",
            wanted="a target above the ground",
            found=f"{height.min():.0f} m at {t[int(np.argmax(height < 0.0))]:.1f} s",
            fix="end sooner",
        )
    return place
