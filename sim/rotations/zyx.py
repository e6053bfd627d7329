"""Roll, pitch and heading of the sequence z-y'-x'': C = Rz(heading) Ry(pitch) Rx(roll)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.sim.rotations.rotation import quaternion_multiply


def quaternions_of(euler: FloatArray) -> FloatArray:
    """Quaternions (..., 4) of roll, pitch, heading (..., 3) [rad]; the sign is not forced."""
    q = np.array([1.0, 0.0, 0.0, 0.0])
    for axis in (3, 2, 1):
        part = np.zeros((*euler.shape[:-1], 4))
        half = euler[..., axis - 1] / 2.0
        part[..., 0], part[..., axis] = np.cos(half), np.sin(half)
        q = quaternion_multiply(q, part)
    return q


def angles_of(q: FloatArray) -> FloatArray:
    """Roll, pitch, heading (..., 3) [rad] of quaternions of norm one (..., 4)."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    roll = np.arctan2(2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
    heading = np.arctan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
    return np.stack([roll, np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0)), heading], axis=-1)


def wrapped(x: npt.ArrayLike, period: float) -> FloatArray:
    """The same but for whole periods, from -period/2 up to period/2."""
    return np.asarray((np.asarray(x) + 0.5 * period) % period - 0.5 * period)
