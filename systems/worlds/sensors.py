"""Errors of a triad that reports increments: of gyros [rad], of accelerometers [m/s]."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import MICRO_G

PER_HOUR = math.radians(1.0) / 3600.0  #: deg/h in rad/s.


@dataclass(frozen=True)
class Noise:
    """Random errors of each axis; a unit is rad/s of gyros, m/s^2 of accelerometers."""

    white: float = 0.0  #: root of the spectral density: what the integral walks, unit s^(1/2).
    walk: float = 0.0  #: what the bias walks in a second, unit over s^(1/2).
    lsb: float = 0.0  #: count of the increments; what a count leaves goes into the next one.


#: A fibre-optic gyro of the class of 0.003 deg/h: 0.0005 deg/h^(1/2), bias walking by 0.001 deg/h
#: in an hour; and an accelerometer beside it: 5 ug/Hz^(1/2), walking by 5 ug in an hour.
FIBRE_OPTIC = Noise(5e-4 * PER_HOUR * 60.0, 1e-3 * PER_HOUR / 60.0)
ACCELEROMETER = Noise(5.0 * MICRO_G, 5.0 * MICRO_G / 60.0)


def signed(
    rng: np.random.Generator | None, bias: float, scale: float, askew: float
) -> tuple[FloatArray, FloatArray]:
    """Bias (3,) and matrix (3, 3) of errors of given size, their signs drawn; None: all plus."""
    size = np.full((3, 3), askew)
    np.fill_diagonal(size, scale)
    signs = np.ones((3, 4)) if rng is None else rng.choice(np.array([-1.0, 1.0]), (3, 4))
    return bias * signs[:, 0], np.eye(3) + size * signs[:, 1:]


class Triad:
    """Increments as a triad reports them: ``matrix`` times the true ones + bias dt + noise.

    Every source has random numbers of its own, so that another size of one error, or another
    length of the pieces, leaves the others as they were.
    ``bias`` (3,) in the unit of `Noise`, ``matrix`` (3, 3), ``dt`` [s].
    """

    def __init__(
        self, bias: FloatArray, matrix: FloatArray, noise: Noise, seed: Sequence[int], dt: float
    ) -> None:
        self.bias, self.matrix, self.noise, self.dt = bias, matrix, noise, dt
        self._white, self._walk = (np.random.default_rng([*seed, k]) for k in range(2))
        self._bias_walk, self._residual = np.zeros(3), np.zeros(3)

    def read(self, true: FloatArray) -> FloatArray:
        """Reports (n, 3) of the next true increments (n, 3)."""
        reading: FloatArray = true @ self.matrix.T + self.bias * self.dt
        noise, sqrt_dt = self.noise, math.sqrt(self.dt)
        if noise.white:
            reading += noise.white * sqrt_dt * self._white.standard_normal(true.shape)
        if noise.walk:
            steps = noise.walk * sqrt_dt * self._walk.standard_normal(true.shape)
            steps[0] += self._bias_walk
            bias = np.cumsum(steps, axis=0)
            reading += bias * self.dt
            self._bias_walk = bias[-1]
        if noise.lsb:
            total = self._residual + np.cumsum(reading, axis=0)
            counts = np.rint(total / noise.lsb)
            reading = noise.lsb * np.diff(counts, axis=0, prepend=0.0)
            self._residual = total[-1] - noise.lsb * counts[-1]
        return reading
