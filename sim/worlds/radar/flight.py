"""Flights of a target in earth-fixed axes (WGS 84)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import pymap3d

from boresight.model.errors import InputError

__all__ = ["FLIGHTS", "ballistic", "flight", "gravity", "straight"]

FloatArray = npt.NDArray[np.float64]

GM = 3.986004418e14  #: m^3/s^2
J2 = 1.08262668e-3
EQUATOR = 6378137.0  #: m
EARTH_RATE = 7.292115e-5  #: rad/s


def gravity(place: FloatArray) -> FloatArray:
    """Gravitation of the ellipsoid's mass, with J2 [m/s^2]; no centrifugal part."""
    x, y, z = place
    r2 = x * x + y * y + z * z
    flat = 1.5 * J2 * EQUATOR**2 / r2
    bulge = 5.0 * z * z / r2
    pull = -GM / r2**1.5
    return pull * np.array(
        [x * (1.0 + flat * (1.0 - bulge)), y * (1.0 + flat * (1.0 - bulge)), z * (1.0 + flat * (3.0 - bulge))]
    )


def ballistic(place: Sequence[float], velocity: Sequence[float], t: FloatArray) -> FloatArray:
    """Positions (n, 3) of a body that falls freely in axes that turn with the earth.

    Runge and Kutta's fourth order between the times ``t`` (n,).
    """
    w = np.array([0.0, 0.0, EARTH_RATE])

    def rate(s: FloatArray) -> FloatArray:
        p, v = s[:3], s[3:]
        a = gravity(p) - 2.0 * np.cross(w, v) - np.cross(w, np.cross(w, p))
        return np.concatenate([v, a])

    state = np.array([*place, *velocity], dtype=np.float64)
    found = [state[:3]]
    for h in np.diff(t):
        k1 = rate(state)
        k2 = rate(state + h / 2.0 * k1)
        k3 = rate(state + h / 2.0 * k2)
        k4 = rate(state + h * k3)
        state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        found.append(state[:3])
    return np.array(found)


def straight(
    site: Sequence[float], start: Sequence[float], velocity: Sequence[float], t: FloatArray
) -> FloatArray:
    """Positions (n, 3) on a straight line, given in east, north, up [m, m/s] of a site.

    ``site``: longitude, latitude [deg], height [m].
    """
    longitude, latitude, height = site
    e, n, u = np.array(start)[:, None] + np.array(velocity)[:, None] * t
    return np.stack(pymap3d.enu2ecef(e, n, u, latitude, longitude, height), axis=1)


def _printed(t: FloatArray) -> FloatArray:
    return ballistic((-2664e3, 5350e3, 2870e3), (1700.0, 104.0, 1100.0), t)


#: Flights by name, with their longest duration [s]: the paper's missile, an aircraft that crosses
#: the line between the radars, one that passes over radar 1.
FLIGHTS = {}


def flight(name: str, seconds: float, dt: float) -> FloatArray:
    raise InputError("")
