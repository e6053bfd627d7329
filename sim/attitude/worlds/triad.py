"""A three-axis sensor: from a true vector to its reading.

::

    v       true vector in body axes
    raw   = M v + bias + noise             M: scale, misalignment, soft iron; bias: hard iron too
    word  = round(raw / lsb)               clamped to the full scale
    value = lsb word
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.sim.rotations.rotation import quaternion_to_matrix, rotation_vector_to_quaternion

_IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, eq=False)
class Triad:
    """A sensor of three axes, in one unit throughout.

    Parameters
    ----------
    lsb : float, 0 or more
        Value of one count; 0: not quantised.
    full_scale : float, > 0
        Largest magnitude of a reading.
    variance : three floats, 0 or more
        White noise of one reading, per axis.
    bias : three floats
        Constant offset; of a magnetometer: hard iron.
    matrix : 3 x 3 floats
        From the true vector to the axes: scale, misalignment, soft iron.
    averaged : float, 1 or more
        Readings that the reader averages into one value: variance and lsb shrink by it.
    """

    lsb: float
    full_scale: float
    variance: Sequence[float] = (0.0, 0.0, 0.0)
    bias: Sequence[float] | FloatArray = (0.0, 0.0, 0.0)
    matrix: npt.ArrayLike = _IDENTITY
    averaged: float = 1.0

    def read(self, true: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Readings of true vectors, (n, 3).

        The noise is drawn whatever its variance, so that switching one error on leaves the
        others as they were.
        """
        sd = np.sqrt(np.asarray(self.variance) / self.averaged)
        noise = rng.standard_normal(true.shape) * sd
        raw = true @ np.asarray(self.matrix).T + np.asarray(self.bias) + noise
        lsb = self.lsb / self.averaged
        value = np.rint(raw / lsb) * lsb if lsb > 0.0 else raw
        return np.asarray(np.clip(value, -self.full_scale, self.full_scale))


def misalignment(rng: np.random.Generator, sd_rad: float) -> FloatArray:
    """Matrix of a triad mounted askew: a turn by a random vector, ``sd_rad`` about each axis."""
    turn = rotation_vector_to_quaternion(sd_rad * rng.standard_normal(3))
    return quaternion_to_matrix(turn).T
