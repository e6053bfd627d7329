"""Motions of a deck, and what gyro, accelerometer and magnetometer on it give, at 1 kHz.

Axes as in `mls_attitude`: magnetic north, west, up; C = Rz(heading) Ry(pitch) Rx(roll).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import GRAVITY
from boresight.model.errors import require
from boresight.sim.rotations.rotation import quaternion_conjugate, rotate, turns_between
from boresight.sim.rotations.zyx import quaternions_of
from boresight.systems.worlds.ship import SEA_STATES, at_sea

RATE_HZ = 1000.0
JUMP_DEG, JUMP_S, JUMP_EVERY_S = 8.0, 0.06, 1.5
#: A table that jumps; a ship that turns by +-10 deg about each axis; the carrier at sea.
MOTIONS = ("table", "rolling", *(f"sea_{n}" for n in SEA_STATES))


@dataclass(frozen=True, eq=False)
class Deck:
    """Roll, pitch, heading (n, 3) [rad]; q, body to reference (n, 4); upward acceleration (n,)."""

    euler: FloatArray
    q: FloatArray
    lift: FloatArray


@dataclass(frozen=True)
class SensorErrors:
    """Noise of a sample, the gyro's bias and its spread over the runs, its delay in samples.

    In deg/s, g and shares of the field. The bias is the one that gives the figures of the
    specification's prototype.
    """

    gyro_noise: float = 0.3
    gyro_bias: tuple[float, float, float] = (0.06, 0.0765, 0.0143)
    bias_spread: float = 0.0
    acc_noise: float = 0.02
    mag_noise: float = 0.02
    gyro_lag: int = 0


def deck(name: str, seconds: float, seed: int, heading_deg: float = 0.0) -> Deck:
    """One of `MOTIONS` about a heading.

    `InputError`: no such motion.
    """
    require(name in MOTIONS, "motion", f"one of {', '.join(MOTIONS)}", name)
    t, rng = np.arange(round(seconds * RATE_HZ)) / RATE_HZ, np.random.default_rng([seed, 25])
    euler, lift = np.zeros((len(t), 3)), np.zeros_like(t)
    if name == "table":
        _swing(euler, t, rng)
    elif name == "rolling":
        phase = rng.uniform(0.0, 2.0 * np.pi, 3)
        euler += np.radians(10.0) * np.sin(2.0 * np.pi * t[:, None] / [11.0, 7.0, 17.0] + phase)
    else:
        euler[:, :2], lift = at_sea(t, rng, int(name.removeprefix("sea_")))
    euler[:, 2] += math.radians(heading_deg)
    return Deck(euler, quaternions_of(euler), lift)


def _swing(euler: FloatArray, t: FloatArray, rng: np.random.Generator) -> None:
    """A three-axis table: swings at random; one axis after the other jumps."""
    periods, phases = rng.uniform(2.0, 9.0, (4, 3)), rng.uniform(0.0, 2.0 * np.pi, (4, 3))
    size = np.radians(rng.uniform(0.5, 2.5, (4, 3)))
    euler += (size * np.sin(2.0 * np.pi * t[:, None, None] / periods + phases)).sum(axis=1)
    euler -= euler[0].copy()
    for k, at in enumerate(np.arange(JUMP_EVERY_S, t[-1], JUMP_EVERY_S)):
        passed = np.clip((t - at) / JUMP_S, 0.0, 1.0)
        sign = 1.0 if k // 3 % 2 == 0 else -1.0
        euler[:, k % 3] += sign * np.radians(JUMP_DEG) * 0.5 * (1.0 - np.cos(np.pi * passed))


def records(
    motion: Deck,
    seed: int,
    errors: SensorErrors = SensorErrors(),
    *,
    field_ut: float = 50.0,
    dip_deg: float = 54.0,
) -> FloatArray:
    """Records of `mls_attitude` (n, 10): dt, gyro, specific force, field; the first restarts."""
    n, rng = len(motion.q), np.random.default_rng([seed, 2018])
    rate = np.zeros((n, 3))
    rate[1:] = turns_between(motion.q[:-1], motion.q[1:]) * RATE_HZ
    rate = np.concatenate([rate[:1].repeat(errors.gyro_lag, axis=0), rate])[:n]
    white = rng.normal(size=(3, n, 3))
    bias = np.radians(errors.gyro_bias + errors.bias_spread * rng.normal(size=3))
    up = np.zeros((n, 3))
    up[:, 2] = GRAVITY + motion.lift
    dip, back = math.radians(dip_deg), quaternion_conjugate(motion.q)
    field = rotate(back, field_ut * np.array([math.cos(dip), 0.0, -math.sin(dip)]))
    dt = np.full((n, 1), 1.0 / RATE_HZ)
    dt[0] = -dt[0]
    gyro = rate + bias + np.radians(errors.gyro_noise) * white[0]
    field = field + errors.mag_noise * field_ut * white[1]
    force = rotate(back, up) + errors.acc_noise * GRAVITY * white[2]
    return np.concatenate([dt, gyro, force, field], axis=1)
