"""Exact increments of a unit on the turning earth, by scipy alone: no code of the worlds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pymap3d
from scipy.spatial.transform import Rotation

__all__ = ["ARCSEC", "EARTH", "LATITUDE", "body", "counts", "gravity", "increments", "turning"]

ARCSEC = np.pi / 648000.0
EARTH = 7.292115e-5
LATITUDE = 31.9521


def gravity(latitude: float, height: float) -> float:
    """Normal gravity [m/s^2], NIMA TR8350.2: closed formula of the surface, eq. 4-3 above it."""
    e = pymap3d.Ellipsoid.from_name("wgs84")
    a, b, f = e.semimajor_axis, e.semiminor_axis, e.flattening
    s2 = np.sin(np.radians(latitude)) ** 2
    at_equator, at_pole = 9.7803253359, 9.8321849378
    k = b * at_pole / (a * at_equator) - 1.0
    surface = at_equator * (1.0 + k * s2) / np.sqrt(1.0 - e.eccentricity**2 * s2)
    m = EARTH**2 * a**2 * b / 3.986004418e14
    return float(
        surface * (1.0 - 2.0 / a * (1.0 + f + m - 2.0 * f * s2) * height + 3.0 * height**2 / a**2)
    )


def body(angles: Any) -> Rotation:
    """Body to east, north, up of (n, 3) pitch, roll, heading [rad]."""
    return Rotation.from_euler("ZXY", np.asarray(angles)[:, [2, 0, 1]])


def increments(
    angles: Callable[[Any], Any], n: int, dt: float = 0.01, latitude: float = LATITUDE
) -> Any:
    """Turns and velocity increments (n, 6) of a unit that stays where it is, from time 0 on.

    ``angles``: of times (m,) to (m, 3) pitch, roll, heading [rad], smooth within every sample. The
    turn is taken from attitudes close together, to fourth order, and integrated by Gauss.
    """
    points, weights = np.polynomial.legendre.leggauss(4)
    t = (np.arange(n)[:, None] * dt + 0.5 * dt * (points + 1.0)).ravel()
    c, h = body(angles(t)), 1e-4
    rate = np.zeros((len(t), 3))
    for k, w in ((1, 8.0), (2, -1.0)):
        step = body(angles(t - k * h)).inv() * body(angles(t + k * h))
        rate += w * step.as_rotvec() / (12.0 * h)
    lat = np.radians(latitude)
    rate += c.inv().apply(EARTH * np.array([0.0, np.cos(lat), np.sin(lat)]))
    force = c.inv().apply([0.0, 0.0, gravity(latitude, 45.0)])
    each = np.concatenate([rate, force], axis=1).reshape(n, 4, 6)
    return 0.5 * dt * np.einsum("nkj,k->nj", each, weights)


def counts(u: Any) -> Any:
    """Increments as an instrument gives them: differences of the rounded sum."""
    lsb = np.array([2.0**-38] * 3 + [2.0**-33] * 3)
    total = np.round(np.cumsum(u, axis=0) / lsb)
    return np.diff(total, axis=0, prepend=0.0) * lsb


def turning(
    rate: float, still: float, erection: float, start: Any = (1.0, 2.0, 90.0)
) -> Callable[[Any], Any]:
    """Angles of the array: still, erected at 5 deg/s, then turning at ``rate`` [deg/s]."""

    def angles(t: Any) -> Any:
        pitch = start[0] + 5.0 * np.clip(t - still, 0.0, erection)
        heading = start[2] + rate * np.clip(t - still - erection, 0.0, None)
        return np.radians(np.stack([pitch, np.full_like(t, start[1]), heading], axis=1))

    return angles
