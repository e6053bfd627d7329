"""Readings of ideal inertial sensors between sampled attitudes and velocities."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.sim.rotations.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    rotate,
    rotation_vector_to_quaternion,
    turns_between,
)


def rates_and_forces(
    q: FloatArray, v: FloatArray, gravity: npt.ArrayLike, dt: float
) -> tuple[FloatArray, FloatArray]:
    """Mean rates [rad/s] and specific forces [m/s^2] of each step, in body axes.

    A rate is constant over its step; a force is that of the attitude in the middle of it.

    Parameters
    ----------
    q : float64 (n + 1, 4)
        Attitudes, body to navigation, of norm one.
    v : float64 (n + 1, 3)
        Velocities in navigation axes [m/s].
    gravity : (3,)
        In navigation axes [m/s^2].
    dt : float
        Length of a step [s].

    Returns
    -------
    rates, forces : float64 (n, 3)
    """
    rates = turns_between(q[:-1], q[1:]) / dt
    mid_attitude = quaternion_multiply(q[:-1], rotation_vector_to_quaternion(0.5 * dt * rates))
    return rates, rotate(
        quaternion_conjugate(mid_attitude), np.diff(v, axis=0) / dt - np.asarray(gravity)
    )
