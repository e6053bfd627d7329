"""Drives of a vehicle with a satellite antenna: attitude, rate, specific force, shadow.

Navigation north-east-down, body front-right-down, C = Rz(heading) Ry(pitch) Rx(roll).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError
from boresight.sim.attitude.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_rotation_vector,
    rotate,
)

__all__ = ["DRIVES", "GRAVITY", "RATE_HZ", "Drive", "city_drive", "drive", "specification_drive"]

FloatArray = npt.NDArray[np.float64]

RATE_HZ = 50.0
GRAVITY = 9.80665
SHADOW_DB = 60.0  #: loss of a tunnel and of a bridge.
#: Duration [s], acceleration [m/s^2], turn to the right [deg/s].
_SPECIFIED = (
    *((20, 0, 0), (8, 2, 0), (25, 0, 0), (10, 0, 12), (30, 0, 0), (6, -2, 0), (20, 0, 0)),
    *((10, 1.5, 0), (25, 0, 0), (12, 0, -8), (30, 0, 0), (15, -1, 0), (25, 0, 0), (5, 1, 0)),
    *((24, 0, 0), (15, 0, 6), (20, 0, 0)),
)


@dataclass(frozen=True, eq=False)
class Drive:
    """What a vehicle does, at `RATE_HZ`.

    Roll, pitch and unwrapped heading (n, 3) [rad]; q body to navigation (n, 4); mean body rate
    since the sample before (n, 3) [rad/s]; specific force in body axes (n, 3) [m/s^2]; whether the
    acceleration is beyond (0.3, 0.3, 0.5) m/s^2 (n,); loss of bridges and tunnels (n,) [dB].
    """

    euler: FloatArray
    q: FloatArray
    rate: FloatArray
    force: FloatArray
    accelerated: npt.NDArray[np.bool_]
    loss_db: FloatArray


def specification_drive() -> Drive:
    """Five minutes: accelerations of 2, -2, 1.5, -1, 1 m/s^2, turns of 12, -8, 6 deg/s, road."""
    accel, turn = _segments(_SPECIFIED)
    t = np.arange(len(accel)) / RATE_HZ
    roll = 3.0 * _wave(t, 7.0) + 1.5 * _wave(t, 1.9)
    pitch = 2.0 * _wave(t, 5.0) + 2.0 * _wave(t, 60.0)
    return _driven(accel, turn, roll, pitch, np.zeros_like(t), np.zeros_like(t))


def city_drive(seed: int = 1) -> Drive:
    """Half an hour: junctions, roundabouts, speed bumps, hills, bridges, and four tunnels."""
    rng = np.random.default_rng([seed, 30])
    parts: list[tuple[float, float, float]] = [(30.0, 0.0, 0.0)]
    bumps: list[float] = []
    while (start := sum(p[0] for p in parts)) < 1780.0:
        a, gain = rng.uniform(0.8, 2.2), rng.uniform(8.0, 18.0)
        side = rng.choice([-1.0, 1.0])
        corner = {
            "junction": [(7.5, 0.0, 12.0 * side)],
            "roundabout": [(2.5, 0.0, 18.0), (rng.uniform(6, 14), 0.0, -20.0), (2.5, 0.0, 18.0)],
            "bend": [(rng.uniform(6, 12), 0.0, 4.0 * side)],
            "bump": [(3.0, 0.0, 0.0)],
        }
        kind = str(rng.choice(list(corner)))
        slow = 0.7 * gain if kind != "bend" else 0.0
        cruise, gone = rng.uniform(8.0, 40.0), gain / a
        parts += [(gone, a, 0.0), (cruise, 0.0, 0.0), (max(slow, 0.1) / 2.0, -2.0, 0.0)]
        if kind == "bump":
            bumps.append(start + gone + cruise + slow / 2.0 + 1.5)
        parts += [*corner[kind], ((gain - slow) / 2.0, -2.0, 0.0), (rng.uniform(1, 10), 0.0, 0.0)]
    accel, turn = (x[: int(1800 * RATE_HZ)] for x in _segments(parts))
    t = np.arange(len(accel)) / RATE_HZ
    moving = np.minimum(np.cumsum(accel) / RATE_HZ / 5.0, 1.0).clip(0.0)
    roll = moving * (1.5 * _wave(t, 7.3) + 0.8 * _wave(t, 1.7)) + 2.0 * _wave(t, 83.0)
    pitch = moving * (1.0 * _wave(t, 5.1) + 0.5 * _wave(t, 1.3)) + 3.0 * _wave(t, 110.0)
    lift = np.zeros_like(t)
    for at in bumps:
        nod = 12.4 * np.gradient(np.exp(-0.5 * ((t - at) / 0.15) ** 2))  # from 1 to -1
        pitch, lift = pitch + 3.0 * nod, lift - 4.0 * nod
    loss = np.zeros_like(t)
    for at, length in [
        *zip((300.0, 700.0, 1150.0, 1550.0), (15.0, 30.0, 60.0, 25.0), strict=True),
        *zip(rng.uniform(40.0, 1780.0, 25), rng.uniform(0.4, 2.0, 25), strict=True),
    ]:
        loss[(t >= at) & (t < at + length)] = SHADOW_DB
    return _driven(accel, turn, roll, pitch, lift, loss)


#: Drives by name.
DRIVES = {"specification": specification_drive, "city": city_drive}


def drive(name: str) -> Drive:
    """One of `DRIVES`.

    Raises
    ------
    InputError
        No such drive.
    """
    if name not in DRIVES:
        raise InputError.at(
            "drive", wanted=f"one of {', '.join(DRIVES)}", found=repr(name), fix="choose of these"
        )
    return DRIVES[name]()


def _wave(t: FloatArray, period: float) -> FloatArray:
    return np.sin(2.0 * np.pi * t / period)


def _segments(parts: Sequence[tuple[float, float, float]]) -> tuple[FloatArray, FloatArray]:
    """Acceleration [m/s^2] and turn [rad/s] at every sample, each change within a second."""
    counts = [round(p[0] * RATE_HZ) for p in parts]
    smooth = np.full(25, 1.0 / 25.0)
    found = []
    for k, unit in ((1, 1.0), (2, np.pi / 180.0)):
        steps = unit * np.repeat([float(p[k]) for p in parts], counts)
        padded = np.pad(steps, 24, mode="edge")
        found.append(np.convolve(np.convolve(padded, smooth, "valid"), smooth, "valid"))
    return found[0], found[1]


def _driven(
    accel: FloatArray,
    turn: FloatArray,
    roll_deg: FloatArray,
    pitch_deg: FloatArray,
    lift: FloatArray,
    loss_db: FloatArray,
) -> Drive:
    """The drive of accelerations along and upward (``lift``), turns and road angles."""
    speed = np.cumsum(accel) / RATE_HZ
    heading = np.cumsum(turn) / RATE_HZ
    euler = np.stack([np.radians(roll_deg), np.radians(pitch_deg), heading], axis=1)
    q = np.array([1.0, 0.0, 0.0, 0.0])
    for axis, angle in ((3, heading), (2, euler[:, 1]), (1, euler[:, 0])):
        part = np.zeros((len(accel), 4))
        part[:, 0], part[:, axis] = np.cos(angle / 2.0), np.sin(angle / 2.0)
        q = quaternion_multiply(q, part)
    rate = np.zeros((len(accel), 3))
    step = quaternion_multiply(quaternion_conjugate(q[:-1]), q[1:])
    rate[1:] = quaternion_to_rotation_vector(step) * RATE_HZ
    c, s = np.cos(heading), np.sin(heading)
    across = speed * turn
    acceleration = np.stack([accel * c - across * s, accel * s + across * c, -lift], axis=1)
    force = rotate(quaternion_conjugate(q), acceleration - [0.0, 0.0, GRAVITY])
    accelerated = np.any(np.abs(acceleration) > [0.3, 0.3, 0.5], axis=1, keepdims=True)[:, 0]
    return Drive(euler, q, rate, force, accelerated, loss_db)
