"""The beam, the link and the tracking receiver of a satellite antenna."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

__all__ = ["Link", "Receiver", "direction"]

FloatArray = npt.NDArray[np.float64]

LIGHT = 299792458.0  #: m/s
ORBIT = 42164.17e3  #: m, radius of the geostationary orbit.
EQUATOR, ECCENTRICITY_SQ = 6378137.0, 6.69437999014e-3  #: WGS 84.


def direction(latitude: float, longitude: float, height: float, satellite: float) -> FloatArray:
    """Vector from a place to a geostationary satellite [m], north, east, down; shape (3,).

    Parameters
    ----------
    latitude, longitude, satellite : float
        Geodetic, and the satellite's longitude [deg].
    height : float
        [m]
    """
    phi, east = math.radians(latitude), math.radians(satellite - longitude)
    s, c = math.sin(phi), math.cos(phi)
    normal = EQUATOR / math.sqrt(1.0 - ECCENTRICITY_SQ * s * s)
    d = np.array(
        [
            ORBIT * math.cos(east) - (normal + height) * c,
            ORBIT * math.sin(east),
            -(normal * (1.0 - ECCENTRICITY_SQ) + height) * s,
        ]
    )
    return np.array([-s * d[0] + c * d[2], d[1], -c * d[0] - s * d[2]])


@dataclass(frozen=True)
class Link:
    """A beacon in Ku band, received with a small dish of tapered illumination.

    The aperture's field falls as sqrt(1 - r^2) to the rim, so the pattern is a closed form,
    first sidelobe -21 dB::

        E(u)/E(0) = 3 (sin u - u cos u)/u^3        u = pi D sin(angle)/lambda
    """

    eirp_dbw: float = 6.0
    frequency_hz: float = 12.5e9
    diameter_m: float = 0.6
    efficiency: float = 0.62
    noise_k: float = 170.0
    distance_m: float = 3.72e7

    @property
    def aperture(self) -> float:
        """pi D / lambda."""
        return math.pi * self.diameter_m * self.frequency_hz / LIGHT

    @property
    def cn0(self) -> float:
        """Carrier over noise density on the axis [Hz]."""
        gain = self.efficiency * self.aperture**2
        spread = (4.0 * math.pi * self.distance_m * self.frequency_hz / LIGHT) ** 2
        return float(10.0 ** (self.eirp_dbw / 10.0)) * gain / spread / (1.380649e-23 * self.noise_k)

    def pattern(self, sine: FloatArray) -> FloatArray:
        """Power at an angle off the axis, by its sine, over that on the axis."""
        u = np.maximum(self.aperture * np.abs(sine), 1e-3)
        field: FloatArray = 3.0 * (np.sin(u) - u * np.cos(u)) / u**3
        return field * field


class Receiver:
    """Conical scan: the beam squints right, left, up and down within every sample.

    Powers of the four are summed over a tracking interval; their differences over the sum give the
    error, the sum tells whether there is a signal.

    Parameters
    ----------
    link : Link
    every : int
        Samples of a tracking interval.
    dwell_s : float
        Time in each position.
    squint : float
        [rad]
    lock_db : float
        Power below the nominal one that still counts as tracking.
    """

    def __init__(
        self,
        link: Link,
        every: int,
        *,
        dwell_s: float = 0.005,
        squint: float = math.radians(0.35),
        lock_db: float = 6.0,
    ) -> None:
        self.link, self.every, self.squint = link, every, squint
        self.snr = link.cn0 * dwell_s
        here, beyond = (float(link.pattern(np.array(s))) for s in (squint, squint + 1e-6))
        self.slope = (here - beyond) / 1e-6 / (2.0 * here)  # of the difference over the sum
        self.least = self.snr * here * 10.0 ** (-lock_db / 10.0)
        self.reset()

    def reset(self) -> None:
        """Begin an interval."""
        self._powers, self._count = np.zeros(()), 0

    def sample(
        self, right: FloatArray, up: FloatArray, ahead: FloatArray, loss: float, noise: FloatArray
    ) -> tuple[FloatArray, FloatArray] | None:
        """One sample.

        Parameters
        ----------
        right, up, ahead : float64 (runs,)
            Direction cosines of the satellite in the antenna's axes.
        loss : float
            Share of the power that arrives.
        noise : float64 (4, 2, runs)
            Standard normal.

        Returns
        -------
        (2, runs), (runs,) or None
            At the end of an interval: error right and up [rad], NaN where there is no signal; mean
            power over noise.
        """
        s = self.squint
        sine = np.stack(
            [np.hypot(right + dx, up + dy) for dx, dy in ((-s, 0), (s, 0), (0, -s), (0, s))]
        )
        sine = np.where(ahead > 0.0, sine, 1.0)
        amplitude = np.sqrt(self.snr * loss * self.link.pattern(sine))
        noise = math.sqrt(0.5) * noise
        power = (amplitude + noise[:, 0]) ** 2 + noise[:, 1] ** 2 - 1.0
        self._powers = self._powers + power
        self._count += 1
        if self._count < self.every:
            return None
        total = self._powers.sum(axis=0)
        mean = total / (4.0 * self._count)
        difference = np.stack(
            [self._powers[0] - self._powers[1], self._powers[2] - self._powers[3]]
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            error = np.where(mean > self.least, difference / (total * self.slope), np.nan)
        self.reset()
        return error, mean
