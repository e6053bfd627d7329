"""A three-axis sensor: from a true vector to its reading.

::

    v       true vector in body axes
    raw   = M v + bias + noise             M: scale, misalignment, soft iron; bias: hard iron too
    word  = round(raw / lsb)               clamped to the full scale
    value = lsb word
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.sim.rotations.rotation import quaternion_to_matrix, rotation_vector_to_quaternion

Vector = tuple[float, float, float]
Matrix = tuple[Vector, Vector, Vector]

_IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def _rows(m: FloatArray) -> Matrix:
    a, b, c = (tuple(map(float, row)) for row in m)
    return a, b, c  # type: ignore[return-value]


@dataclass(frozen=True)
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
    variance: Vector = (0.0, 0.0, 0.0)
    bias: Vector = (0.0, 0.0, 0.0)
    matrix: Matrix = _IDENTITY
    averaged: float = 1.0

    def with_errors(
        self, *, matrix: FloatArray | None = None, bias: Sequence[float] | None = None
    ) -> Triad:
        """The same sensor with other errors; None leaves one as it is."""
        return dataclasses.replace(
            self,
            matrix=self.matrix if matrix is None else _rows(np.asarray(matrix, dtype=np.float64)),
            bias=self.bias if bias is None else (float(bias[0]), float(bias[1]), float(bias[2])),
        )

    def read(
        self, truth: Callable[[FloatArray], FloatArray], t: FloatArray, rng: np.random.Generator
    ) -> FloatArray:
        """Readings (n, 3) at times t (n,) [s] of the vector that ``truth`` gives for times.

        The noise is drawn whatever its variance, so that switching one error on leaves the
        others as they were.
        """
        noise = rng.standard_normal((len(t), 3)) * np.sqrt(
            np.asarray(self.variance) / self.averaged
        )
        raw = truth(t) @ np.asarray(self.matrix).T + np.asarray(self.bias) + noise
        lsb = self.lsb / self.averaged
        value = np.rint(raw / lsb) * lsb if lsb > 0.0 else raw
        return np.asarray(np.clip(value, -self.full_scale, self.full_scale))


def misalignment(rng: np.random.Generator, sd_rad: float) -> FloatArray:
    """Matrix of a triad mounted askew: a turn by a random vector, ``sd_rad`` about each axis."""
    turn = rotation_vector_to_quaternion(sd_rad * rng.standard_normal(3))
    return quaternion_to_matrix(turn).T


def soft_iron(rng: np.random.Generator, sd: float) -> FloatArray:
    """Matrix of soft iron: I plus a symmetric matrix whose elements have standard deviation sd."""
    e = sd * rng.standard_normal((3, 3))
    return np.asarray(np.eye(3) + np.triu(e) + np.triu(e, 1).T)
