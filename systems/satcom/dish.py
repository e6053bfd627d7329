"""A dish antenna: its beam, and the carrier that it receives over noise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray

LIGHT = 299792458.0  #: m/s


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
