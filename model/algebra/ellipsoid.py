"""The ellipsoid of WGS 84: gravity, Earth rate and curvatures at a site, for a ``step``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from boresight.model import ops

EARTH = 7.292115e-5  #: rad/s
EQUATOR = 6378137.0  #: m
E2 = 6.69437999014e-3  #: eccentricity squared.
GAMMA = (9.7803253359, 1.931852652458e-3)  #: m/s^2, of Somigliana's formula.
FREE_AIR = (2.013605194, 0.01341124)  #: 2 (1 + f + m), 4 f.


@dataclass(frozen=True)
class Site:
    """Quantities of a site, for samples of ``dt`` seconds.

    ``earth``: Earth rate times dt, north and up [rad]; ``gravity`` times dt [m/s]; ``curvature``
    of meridian and prime vertical, and the second times the tangent of the latitude, times dt
    [rad per m/s].
    """

    earth: tuple[Any, Any]
    gravity: Any
    curvature: tuple[Any, Any, Any]


def site(latitude: Any, height: Any, dt: float) -> Site:
    """Site at a geodetic latitude [half turns] up to 89 deg, height [m] up to 10 km. 60 slots.

    Somigliana's gravity with the free-air gradient of second order, radii of first order in the
    height, in series of x = e^2 sin^2(latitude): within 1e-8 m/s^2 and 3e-6 of the radii (WGS 84,
    NIMA TR8350.2, 2000, eq. 4-1, 4-3)::

        1/sqrt(1 - x) = 1 + x/2 + 3 x^2/8 + 5 x^3/16
        g = gamma (1 + k sin^2)/sqrt(1 - x) (1 - 2 h/a (1 + f + m - 2 f sin^2) + 3 h^2/a^2)
        1/R_N = sqrt(1 - x)/a    1/R_M = (1 - x)^1.5/(a (1 - e^2))
    """
    sine, cosine = ops.sincos_ht(latitude)
    cosine = ops.bounded(cosine, 0.0174, 1.0, "up to 89 deg")
    s2 = ops.bounded(sine * sine, 0.0, 1.0, "square")
    x = E2 * s2
    up = (1.0 / EQUATOR) * height
    root = 1.0 + x * (0.5 + x * (0.375 + x * 0.3125))
    normal = GAMMA[0] * (1.0 + GAMMA[1] * s2) * root
    lift = 1.0 - up * (FREE_AIR[0] - FREE_AIR[1] * s2 - 3.0 * up)
    flat = 1.0 - x * (0.5 + x * (0.125 + x * 0.0625))
    across = (dt / EQUATOR) * flat * (1.0 - up * flat)
    bent = (1.0 - x) * flat * (1.0 / (1.0 - E2))
    along = (dt / EQUATOR) * bent * (1.0 - up * bent)
    return Site(
        (EARTH * dt * cosine, EARTH * dt * sine),
        ops.bounded(dt * normal * lift, 9.7 * dt, 9.9 * dt, "gravity"),
        (along, across, ops.bounded(across * (sine / cosine), -1e-5 * dt, 1e-5 * dt, "89 deg")),
    )
