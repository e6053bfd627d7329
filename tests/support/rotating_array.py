"""Exact increments of a unit on the turning earth, by scipy alone: no code of the worlds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pymap3d
from scipy.spatial.transform import Rotation

#: Of times (m,): pitch, roll, heading (m, 3) [rad], and their rates.
Motion = Callable[[Any], tuple[Any, Any]]
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


def increments(motion: Motion, n: int, dt: float = 0.01, latitude: float = LATITUDE) -> Any:
    """Turns and velocity increments (n, 6) of a unit that stays where it is, from time 0 on.

    ``motion``: smooth within every sample; integrated by Gauss.
    """
    points, weights = np.polynomial.legendre.leggauss(4)
    t = (np.arange(n)[:, None] * dt + 0.5 * dt * (points + 1.0)).ravel()
    angles, (pitch, roll, heading) = motion(t)[0], motion(t)[1].T
    c, zero = body(angles), np.zeros_like(t)
    lat = np.radians(latitude)
    earth = EARTH * np.array([0.0, np.cos(lat), np.sin(lat)])
    rate = c.inv().apply(np.stack([zero, zero, heading], axis=1) + earth)
    inner = Rotation.from_euler("Y", angles[:, 1:2]).inv()
    rate += inner.apply(np.stack([pitch, zero, zero], axis=1)) + np.stack([zero, roll, zero], 1)
    force = c.inv().apply([0.0, 0.0, gravity(latitude, 45.0)])
    each = np.concatenate([rate, force], axis=1).reshape(n, 4, 6)
    return 0.5 * dt * np.einsum("nkj,k->nj", each, weights)


def counts(u: Any) -> Any:
    """Increments as an instrument gives them: differences of the rounded sum."""
    lsb = np.array([2.0**-38] * 3 + [2.0**-33] * 3)
    total = np.round(np.cumsum(u, axis=0) / lsb)
    return np.diff(total, axis=0, prepend=0.0) * lsb


def turning(rate: float, still: float, erection: float, start: Any = (1.0, 2.0, 90.0)) -> Motion:
    """The array: still, erected at 5 deg/s, then turning at ``rate`` [deg/s]."""

    def motion(t: Any) -> Any:
        up, around = t - still, t - still - erection
        pitch = start[0] + 5.0 * np.clip(up, 0.0, erection)
        heading = start[2] + rate * np.clip(around, 0.0, None)
        angles = np.stack([pitch, np.full_like(t, start[1]), heading], axis=1)
        rates = [5.0 * ((up > 0.0) & (around < 0.0)), 0.0 * t, rate * (around > 0.0)]
        return np.radians(angles), np.radians(np.stack(rates, axis=1))

    return motion
