"""Where a satellite is in a vehicle's axes: azimuth, elevation, polarisation, and their rates.

North-east-down and front-right-down, as in `satcom`, whose attitude and rate are its inputs.
With the place's geodetic latitude phi, height h, the satellite's longitude less the place's L, all
lengths over the radius of the geostationary orbit::

    n = a / sqrt(1 - e^2 sin^2 phi) = a (1 + x/2 + 3 x^2/8),  x = e^2 sin^2 phi: 1 m short of it
    d = (cos L - (n + h) cos phi, sin L, -(n (1 - e^2) + h) sin phi)     axis, east, north pole
    north = -sin phi d_1 + cos phi d_3    down = -cos phi d_1 - sin phi d_3

The direction u = C^T (north, east, down)/|d| gives azimuth (clockwise from the front) and elevation
(above the deck). The polarisation is the angle, clockwise seen along the beam, from the antenna's
upward axis to the earth's axis: the plane of a vertical polarisation. The vehicle's place changes
slowly, so u' = u x w::

    azimuth' = (u_x u_y' - u_y u_x')/(u_x^2 + u_y^2)    elevation' = -u_z'/sqrt(u_x^2 + u_y^2)
    polarisation' = -(w . u + azimuth' u_z)
"""

from __future__ import annotations

from typing import Any

from boresight import Estimator, Input, Output, Param, ops
from boresight.model.algebra.angles import unit_angle_ht
from boresight.model.algebra.quaternion import conjugate_turn, cross, dot, matrix
from boresight.model.algebra.quaternion_filter import status_word

ORBIT = 42164.17e3  #: m, radius of the geostationary orbit.
EQUATOR = 6378137.0 / ORBIT  #: WGS 84.
E2 = 6.69437999014e-3  #: its eccentricity squared.
RATE_LIMIT = 16.0  #: rad/s
KEYHOLE = 2.0**-5  #: cosine of the elevation below which the mount turns too fast.

ANGLES = ("azimuth", "elevation", "polarisation")
#: Bits of the output ``status``.
STATUS_BITS = {
    0: "the satellite is below the horizon",
    1: "the satellite is near the mount's axis: azimuth and rates mean little",
}


def direction(latitude: Any, longitude: Any, height: Any, satellite: Any) -> tuple[Any, ...]:
    """Vector to a satellite (north, east, down), cosine and sine of phi, the vector's square.

    Angles in half turns, the height in m, the vector over the orbit's radius.
    """
    sine, cosine = ops.sincos_ht(latitude)
    east, axis = ops.sincos_ht(ops.wrap_ht(satellite - longitude))
    flat = E2 * (sine * sine)
    normal = EQUATOR * (1.0 + 0.5 * flat + 0.375 * (flat * flat))
    normal = ops.bounded(normal, 0.0, 0.2, "radius over the orbit's")
    over = (1.0 / ORBIT) * height
    d1 = ops.bounded(axis - (normal + over) * cosine, -1.25, 1.25, "difference of radii")
    d3 = ops.bounded(-((1.0 - E2) * normal + over) * sine, -0.25, 0.25, "radius")
    square = ops.bounded(d1 * d1 + east * east + d3 * d3, 0.7, 1.35, "distance")
    return (cosine * d3 - sine * d1, east, -(cosine * d1 + sine * d3)), cosine, sine, square


class SatcomPointing(Estimator):
    """Azimuth, elevation and polarisation of a geostationary satellite in a vehicle's axes."""

    name = "satcom_pointing"
    summary = "azimuth, elevation, polarisation of a satellite in a vehicle's axes, and their rates"
    inputs = (
        *(Input(f"q{a}", -1.0, 1.0, "", meaning=f"attitude, component {a}") for a in "wxyz"),
        *(
            Input(f"rate_{a}", -8.0, 8.0, "rad/s", meaning=f"body rate less its bias, axis {a}")
            for a in "xyz"
        ),
        Input("latitude", -0.5, 0.5, "ht", missing="hold", meaning="geodetic, north positive"),
        Input("longitude", -1.0, 1.0, "ht", missing="hold", meaning="east positive"),
        Input("height", -500.0, 20e3, "m", missing="hold", meaning="above the ellipsoid"),
    )
    params = (Param("satellite", 110.5 / 180.0, -1.0, 1.0, "ht", "its longitude, to the east"),)
    status_bits = STATUS_BITS
    outputs = (
        *(Output(name, "ht", 1e-6) for name in ANGLES),
        *(Output(f"{name}_rate", "rad/s", 1e-4) for name in ANGLES),
        Output("status", "bits"),
    )

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        toward, cosine, sine, square = direction(u.latitude, u.longitude, u.height, p.satellite)
        inverse = ops.rsqrt(square)
        c = matrix((u.qw, u.qx, u.qy, u.qz), unit=False)
        los = conjugate_turn(c, [ops.saturated(v * inverse, 1.0) for v in toward])
        los = [ops.saturated(v, 1.0) for v in los]
        pole = [ops.saturated(cosine * c[0][k] - sine * c[2][k], 1.0) for k in range(3)]

        level_sq = ops.bounded(los[0] * los[0] + los[1] * los[1], 0.0, 2.0, "squared cosine")
        secant = ops.rsqrt(level_sq)
        level = ops.saturated(level_sq * secant, 1.0)  # cosine of the elevation
        ahead, aside = (ops.saturated(v * secant, 1.0) for v in los[:2])
        outward = ops.saturated(ahead * pole[0] + aside * pole[1], 1.0)
        right, up = ahead * pole[1] - aside * pole[0], los[2] * outward - level * pole[2]

        w = (u.rate_x, u.rate_y, u.rate_z)
        moved = [ops.saturated(v, RATE_LIMIT) for v in cross(los, w)]
        turn = ops.saturated(ahead * moved[1] - aside * moved[0], RATE_LIMIT)
        azimuth_rate = ops.saturated(turn * secant, RATE_LIMIT)
        return {}, {
            "azimuth": unit_angle_ht(los[1], los[0], secant),
            "elevation": unit_angle_ht(-los[2], level),
            "polarisation": unit_angle_ht(right, up, ops.rsqrt(right * right + up * up)),
            "azimuth_rate": azimuth_rate,
            "elevation_rate": ops.saturated(-moved[2] * secant, RATE_LIMIT),
            "polarisation_rate": ops.saturated(-(dot(w, los) + azimuth_rate * los[2]), RATE_LIMIT),
            "status": status_word({0: toward[2] > 0.0, 1: level < KEYHOLE}),
        }
