"""A ship in a sea state: roll, pitch and heave of a spectrum of waves.

The spectrum is ITTC's of two parameters (Bretschneider). Heights are the middles of the WMO sea
state code; modal periods are those usual with it for the open ocean (STANAG 4194, not checked
against its text). Heave and pitch answer as in the closed form of Jensen, Mansour and Olsen
(2004, Estimation of ship motions using closed-form expressions, Ocean Engineering 31), roll as one
degree of freedom to the slope of the wave (Lloyd, Seakeeping, 1989).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import GRAVITY
from boresight.model.errors import require_choice

#: Significant wave height [m] and modal period [s].
SEA_STATES = {3: (0.88, 7.5), 4: (1.88, 8.8), 5: (3.25, 9.7), 6: (5.0, 12.4)}
_WAVES = 160


@dataclass(frozen=True)
class Ship:
    """A hull in m, m/s and s; by default a carrier. Waves come from ``waves_deg``, 180 ahead."""

    length: float = 300.0
    breadth: float = 40.0
    draught: float = 11.0
    block: float = 0.6
    speed: float = 10.0
    waves_deg: float = 120.0
    roll_period: float = 18.0
    roll_damping: float = 0.1

    def responses(self, w: FloatArray) -> tuple[FloatArray, ...]:
        """Heave [m/m], pitch and roll [rad/m] to waves of w [rad/s], and what it meets [rad/s].

        A box, the breadth corrected by the block coefficient, U the speed, b the heading::

            eta = 1/sqrt((1 - 2 k T a^2)^2 + (A^2/(k B a^2))^2)    a = 1 - w U cos(b)/g
            f = sqrt((1 - k T)^2 + (A^2/(k B a^3))^2)    A = 2 sin(k B a^2/2) exp(-k T a^2)
            heave = eta f e^(-kT) sin(K)/K    pitch = eta f e^(-kT) 6 (sin K - K cos K)/(K^2 L)
            K = k L |cos b|/2      roll = k sin(b)/sqrt((1 - r^2)^2 + (2 d r)^2),  r = w a/w_roll
        """
        k, beta = w**2 / GRAVITY, math.radians(self.waves_deg)
        a = 1.0 - w * self.speed * math.cos(beta) / GRAVITY
        b, t = k * self.breadth * self.block, k * self.draught
        radiated = (2.0 * np.sin(0.5 * b * a**2) * np.exp(-t * a**2)) ** 2
        force = np.hypot(1.0 - t, radiated / (b * a**3)) * np.exp(-t)
        force = force / np.hypot(1.0 - 2.0 * t * a**2, radiated / (b * a**2))
        half = 0.5 * k * self.length * abs(math.cos(beta))
        pitch = force * 6.0 * (np.sin(half) - half * np.cos(half)) / (half**2 * self.length)
        r = w * a * self.roll_period / (2.0 * math.pi)
        roll = k * math.sin(beta) / np.hypot(1.0 - r**2, 2.0 * self.roll_damping * r)
        return force * np.sin(half) / half, pitch, roll, w * a


def spectrum(w: FloatArray, state: int) -> FloatArray:
    """S = 5/16 H^2 wp^4/w^5 exp(-5/4 (wp/w)^4) [m^2 s].

    `InputError`: no such sea state.
    """
    require_choice("sea state", state, SEA_STATES)
    height, period = SEA_STATES[state]
    peak = 2.0 * math.pi / period
    return np.asarray(0.3125 * height**2 * peak**4 / w**5 * np.exp(-1.25 * (peak / w) ** 4))


def at_sea(
    t: FloatArray, rng: np.random.Generator, state: int = 5
) -> tuple[FloatArray, FloatArray]:
    """Roll and pitch (n, 2) [rad], upward acceleration (n,) [m/s^2] at times t [s]."""
    spectrum(np.ones(1), state)
    peak = 2.0 * math.pi / SEA_STATES[state][1]
    edges = np.linspace(0.4 * peak, 3.5 * peak, _WAVES + 1)
    w = edges[:-1] + np.diff(edges) * rng.uniform(size=_WAVES)  # so that it does not repeat
    amplitude = np.sqrt(2.0 * spectrum(w, state) * np.diff(edges))
    heave, pitch, roll, encounter = Ship().responses(w)
    phase = encounter * t[:, None] + rng.uniform(0.0, 2.0 * np.pi, _WAVES)
    wave = np.cos(phase)
    angles = np.stack([wave @ (amplitude * roll), wave @ (amplitude * pitch)], axis=1)
    return angles, -np.sin(phase) @ (amplitude * heave * encounter**2)
