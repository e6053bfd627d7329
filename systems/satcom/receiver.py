"""A dish antenna, the carrier that it receives over noise, and its tracking receiver."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray

LIGHT = 299792458.0  #: m/s
DWELL_S, SQUINT = 0.005, math.radians(0.35)  #: of each position of the beam [s], [rad].
LOCK_DB = 6.0  #: power below the nominal one that still counts as tracking.


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
    error, the sum tells whether there is a signal. ``interval``: in samples, in the mean.
    """

    def __init__(self, link: Link, interval: float) -> None:
        self.link, self.interval = link, interval
        self.snr = link.cn0 * DWELL_S
        gain, next_gain = (float(link.pattern(np.array(s))) for s in (SQUINT, SQUINT + 1e-6))
        self.slope = (gain - next_gain) / 1e-6 / (2.0 * gain)  # of the difference over the sum
        self.lock_power = self.snr * gain * 10.0 ** (-LOCK_DB / 10.0)
        self.reset()

    def reset(self) -> None:
        """Begin an interval."""
        self._powers, self._count, self._age = np.zeros(()), 0, 0.0

    def sample(
        self, right: FloatArray, up: FloatArray, ahead: FloatArray, loss: float, noise: FloatArray
    ) -> FloatArray | None:
        """One sample.

        Direction cosines (runs,) of the satellite in the antenna's axes, the share of the power
        that arrives, and normal noise (4, 2, runs); at the end of an interval the error to the
        right (runs,) [rad], NaN where there is no signal.
        """
        across = right + SQUINT * np.array([[-1.0], [1.0], [0.0], [0.0]])
        along = up + SQUINT * np.array([[0.0], [0.0], [-1.0], [1.0]])
        sine = np.where(ahead > 0.0, np.hypot(across, along), 1.0)
        amplitude = np.sqrt(self.snr * loss * self.link.pattern(sine))
        noise = math.sqrt(0.5) * noise
        power = (amplitude + noise[:, 0]) ** 2 + noise[:, 1] ** 2 - 1.0
        self._powers = self._powers + power
        self._count, self._age = self._count + 1, self._age + 1.0
        if self._age < self.interval:
            return None
        total = self._powers.sum(axis=0)
        has_signal = total > 4.0 * self._count * self.lock_power
        difference = self._powers[0] - self._powers[1]
        with np.errstate(divide="ignore", invalid="ignore"):
            error = np.where(has_signal, difference / (total * self.slope), np.nan)
        over = self._age - self.interval
        self.reset()
        self._age = over
        return error
