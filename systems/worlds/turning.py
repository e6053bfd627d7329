"""Exact increments of a unit at one place that turns about axes fixed in the earth.

Navigation axes are east, north, up. While the rate is constant there, every vector that is constant
there turns in body axes about an axis fixed in them, so that its mean over a sample is a closed
form: its value in the middle, the part across the axis times sin(x)/x, x half the sample's turn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.errors import require
from boresight.sim.rotations.rotation import quaternion_to_matrix, rotation_vector_to_quaternion

EARTH_RATE = 7.292115e-5  #: rad/s, WGS 84.


def earth_rate(latitude_deg: float) -> FloatArray:
    """Turn of the earth (3,) [rad/s], east, north, up."""
    latitude = math.radians(latitude_deg)
    return EARTH_RATE * np.array([0.0, math.cos(latitude), math.sin(latitude)])


def normal_gravity(latitude_deg: float, height: float) -> float:
    """Downward [m/s^2] at a geodetic latitude and height [m] (WGS 84).

    On the ellipsoid (Somigliana), and to second order above it, both from the ellipsoid's constants
    (Heiskanen and Moritz, Physical Geodesy, 1967, 2-78 and 2-123)::

        (a ge cos^2 + b gp sin^2)/sqrt(a^2 cos^2 + b^2 sin^2)
        (1 - 2 (1 + f + m - 2 f sin^2) h/a + 3 h^2/a^2),    m = w^2 a^2 b/GM
    """
    a, b, gm = 6378137.0, 6356752.314245, 3.986004418e14
    at_equator, at_pole = 9.7803253359, 9.8321849379
    s = math.sin(math.radians(latitude_deg)) ** 2
    f, m = 1.0 - b / a, EARTH_RATE**2 * a**2 * b / gm
    ground = a * at_equator * (1.0 - s) + b * at_pole * s
    ground /= math.sqrt(a**2 * (1.0 - s) + b**2 * s)
    up = height / a
    return ground * (1.0 - 2.0 * (1.0 + f + m - 2.0 * f * s) * up + 3.0 * up**2)


@dataclass(frozen=True)
class Turn:
    """Whole samples at a rate [rad/s] that is constant east, north, up."""

    samples: int
    rate: tuple[float, float, float] = (0.0, 0.0, 0.0)


class Turning:
    """Turns, one after the other; each begins where the last one ended.

    ``start`` (3, 3) is the first attitude, body to navigation; ``dt`` the length of a sample [s];
    ``earth`` (3,) the rate of the navigation axes [rad/s], constant in them; ``gravity`` in m/s^2.

    `InputError`: no turn; a time step that is none.
    """

    def __init__(
        self,
        start: FloatArray,
        turns: Sequence[Turn],
        dt: float,
        *,
        earth: FloatArray,
        gravity: float,
    ) -> None:
        require(len(turns) > 0, "turning, turns", "one at least", "none")
        require(dt > 0.0, "turning, dt", "more than 0 s", dt)
        self.turns, self.dt, self.earth = tuple(turns), dt, earth
        self.force = np.array([0.0, 0.0, gravity])
        self.begins = np.cumsum([0, *(turn.samples for turn in turns)])
        self.starts = [start]
        for turn in turns:
            q = rotation_vector_to_quaternion(np.array(turn.rate) * (turn.samples * dt))
            self.starts.append(quaternion_to_matrix(q) @ self.starts[-1])

    @property
    def samples(self) -> int:
        return int(self.begins[-1])

    def _in_body(
        self, vector: FloatArray, number: int, samples: FloatArray, share: float = 1.0
    ) -> FloatArray:
        """A vector of navigation axes in body axes (n, 3), so many samples after a turn's begin.

        C_s^T R(-W t) v = C_s^T (v_along + v_across cos(W t) - u x v sin(W t)), u the axis, W the
        speed; ``share`` is a factor on the part across the axis.
        """
        rate = np.array(self.turns[number].rate)
        speed = float(np.linalg.norm(rate))
        u = rate / speed if speed else rate
        angle = speed * self.dt * samples[:, None]
        along = u * (u @ vector)
        across = (vector - along) * np.cos(angle) - np.cross(u, vector) * np.sin(angle)
        return np.asarray((along + share * across) @ self.starts[number])

    def _parts(self, first: int, last: int, every: int = 1) -> list[tuple[int, FloatArray]]:
        """Which turn, and samples of it from its begin on: the last of ``every`` from first on."""
        parts = []
        for number, (begin, end) in enumerate(pairwise(self.begins.tolist())):
            skipped = -(-max(0, begin - first - every + 1) // every)
            numbers = np.arange(first + (skipped + 1) * every - 1, min(last, end), every)
            if len(numbers):
                parts.append((number, (numbers - begin).astype(np.float64)))
        return parts

    def matrix(self, first: int, last: int, every: int = 1) -> FloatArray:
        """Attitudes (n, 3, 3), body to navigation, at the ends of samples first to last - 1.

        Of ``every`` samples the last one.
        """
        parts = self._parts(first, last, every)
        rows = [[self._in_body(unit, n, k + 1.0) for n, k in parts] for unit in np.eye(3)]
        return np.stack([np.concatenate(row) for row in rows], axis=1)

    def increments(self, first: int, last: int) -> FloatArray:
        """Increments of perfect sensors (n, 6) in samples first to last - 1.

        Turn to inertial space [rad], then specific force over time [m/s], both integrated in body
        axes as they turn.
        """
        pieces = []
        for number, samples in self._parts(first, last):
            rate = np.array(self.turns[number].rate)
            share = float(np.sinc(0.5 * np.linalg.norm(rate) * self.dt / math.pi))
            parts = [
                self.dt * self._in_body(v, number, samples + 0.5, share)
                for v in (rate + self.earth, self.force)
            ]
            pieces.append(np.concatenate(parts, axis=1))
        return np.concatenate(pieces)
