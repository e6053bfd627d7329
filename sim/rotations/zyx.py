"""Roll, pitch and heading of the sequence z-y'-x'': C = Rz(heading) Ry(pitch) Rx(roll)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.sim.rotations.rotation import about_axes


def quaternions_of(euler: FloatArray) -> FloatArray:
    """Quaternions (..., 4) of roll, pitch, heading (..., 3) [rad]; the sign is not forced."""
    return about_axes(euler, (3, 2, 1))


def angles_of(q: FloatArray) -> FloatArray:
    """Roll, pitch, heading (..., 3) [rad] of quaternions of norm one (..., 4)."""
    w, x, y, z = np.moveaxis(q, -1, 0)
    roll = np.arctan2(2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
    heading = np.arctan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
    return np.stack([roll, np.arcsin(np.clip(2.0 * (w * y - x * z), -1.0, 1.0)), heading], axis=-1)


def wrapped(x: npt.ArrayLike, period: float) -> FloatArray:
    """The same but for whole periods, from -period/2 up to period/2."""
    return np.asarray((np.asarray(x) + 0.5 * period) % period - 0.5 * period)
