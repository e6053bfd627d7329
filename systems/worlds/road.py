"""A vehicle on a road: attitude, rate and specific force from accelerations, turns and slopes.

Navigation north-east-down, body front-right-down, C = Rz(heading) Ry(pitch) Rx(roll).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import GRAVITY
from boresight.sim.rotations.rotation import quaternion_conjugate, rotate, turns_between
from boresight.sim.rotations.zyx import quaternions_of


@dataclass(frozen=True, eq=False)
class Ride:
    """Motion of a vehicle, at records of ``rate_hz``.

    Roll, pitch and unwrapped heading (n, 3) [rad]; q body to navigation (n, 4); mean body rate
    since the sample before (n, 3) [rad/s]; acceleration in navigation axes and specific force in
    body axes (n, 3) [m/s^2].
    """

    rate_hz: float
    euler: FloatArray
    q: FloatArray
    rate: FloatArray
    acceleration: FloatArray
    force: FloatArray


def profile(parts: Sequence[tuple[float, float, float]], rate_hz: float) -> FloatArray:
    """Acceleration [m/s^2] and turn [rad/s] (2, n), each change within a second.

    ``parts``: duration [s], acceleration along the road [m/s^2], turn to the right [deg/s].
    """
    counts = [round(p[0] * rate_hz) for p in parts]
    width = round(0.5 * rate_hz)
    smooth = np.full(width, 1.0 / width)
    pieces = []
    for k, unit in ((1, 1.0), (2, np.pi / 180.0)):
        steps = unit * np.repeat([float(p[k]) for p in parts], counts)
        padded = np.pad(steps, width - 1, mode="edge")
        pieces.append(np.convolve(np.convolve(padded, smooth, "valid"), smooth, "valid"))
    return np.stack(pieces)


def ride(
    rate_hz: float,
    accel: FloatArray,
    turn: FloatArray,
    *,
    roll_deg: FloatArray,
    pitch_deg: FloatArray,
    lift: FloatArray | float = 0.0,
) -> Ride:
    """The ride of accelerations along the road and upward (``lift``), turns and angles (n,)."""
    speed, heading = np.cumsum(accel) / rate_hz, np.cumsum(turn) / rate_hz
    euler = np.stack([np.radians(roll_deg), np.radians(pitch_deg), heading], axis=1)
    q = quaternions_of(euler)
    rate = np.zeros((len(accel), 3))
    rate[1:] = turns_between(q[:-1], q[1:]) * rate_hz
    c, s, lateral = np.cos(heading), np.sin(heading), speed * turn
    acceleration = np.stack(
        [accel * c - lateral * s, accel * s + lateral * c, np.broadcast_to(-lift, c.shape)], axis=1
    )
    force = rotate(quaternion_conjugate(q), acceleration - [0.0, 0.0, GRAVITY])
    return Ride(rate_hz, euler, q, rate, acceleration, force)
