"""Motions of a deck, and what gyro, accelerometer and magnetometer on it give, at 1 kHz.

Axes as in `mls_attitude`: magnetic north, west, up; C = Rz(heading) Ry(pitch) Rx(roll). `at_sea` is
an ITTC two-parameter (Bretschneider) spectrum of the sea states of STANAG 4194, answered by the
closed-form transfer functions of heave and pitch of Jensen, Mansour and Olsen (2004), and by a roll
of one degree of freedom to the wave slope (Lloyd, Seakeeping, 1989).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from boresight.model.declarations import GRAVITY
from boresight.model.errors import InputError
from boresight.sim.attitude.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    rotate,
    turns_between,
)

__all__ = ["MOTIONS", "RATE_HZ", "SEA_STATES", "Deck", "SensorErrors", "deck", "records", "responses"]

FloatArray = npt.NDArray[np.float64]
RATE_HZ = 1000.0
#: Significant wave height [m] and modal period [s] by sea state.
SEA_STATES = {3: (0.88, 7.5), 4: (1.88, 8.8), 5: (3.25, 9.7), 6: (5.0, 12.4)}
#: A carrier: length, breadth, draught [m], block coefficient, speed [m/s], waves from [rad] (pi:
#: ahead), period of the roll [s], its damping.
SHIP = (300.0, 40.0, 11.0, 0.6, 10.0, math.radians(120.0), 18.0, 0.1)
JUMP_DEG, JUMP_S = 8.0, 0.06


@dataclass(frozen=True, eq=False)
class Deck:
    """Roll, pitch, heading (n, 3) [rad]; q, body to reference (n, 4); upward acceleration (n,)."""

    euler: FloatArray
    q: FloatArray
    lift: FloatArray


@dataclass(frozen=True)
class SensorErrors:
    """Noise of a sample, the gyro's bias and its spread over the runs, its delay in samples.

    In deg/s, g and shares of the field.
    """

    gyro_noise: float = 0.3
    gyro_bias: tuple[float, float, float] = (0.0606, 0.077, 0.0118)
    bias_spread: float = 0.0
    acc_noise: float = 0.02
    mag_noise: float = 0.02
    gyro_lag: int = 0


def table(t: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """A three-axis table: swings at random, now and then 8 deg in 60 ms; angles (n, 3), lift."""
    periods, phases = rng.uniform(2.0, 9.0, (4, 3)), rng.uniform(0.0, 2.0 * np.pi, (4, 3))
    size = np.radians(rng.uniform(0.5, 2.5, (4, 3)))
    euler = (size * np.sin(2.0 * np.pi * t[:, None, None] / periods + phases)).sum(axis=1)
    euler -= euler[0]
    for k, at in enumerate(np.arange(1.5, t[-1], 1.5)):
        passed = np.clip((t - at) / JUMP_S, 0.0, 1.0)
        sign = 1.0 if k // 3 % 2 == 0 else -1.0
        euler[:, k % 3] += sign * np.radians(JUMP_DEG) * 0.5 * (1.0 - np.cos(np.pi * passed))
    return euler, np.zeros_like(t)


def rolling(t: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """A ship that turns by +-10 deg about each axis."""
    phase = rng.uniform(0.0, 2.0 * np.pi, 3)
    return np.radians(10.0) * np.sin(2.0 * np.pi * t[:, None] / [11.0, 7.0, 17.0] + phase), 0.0 * t


def at_sea(
    t: FloatArray, rng: np.random.Generator, state: int = 5
) -> tuple[FloatArray, FloatArray]:
    """The carrier in a sea state: angles (n, 3) [rad], upward acceleration (n,) [m/s^2]."""
    height, period = SEA_STATES[state]
    peak = 2.0 * np.pi / period
    w = np.linspace(0.4 * peak, 3.5 * peak, 160)
    w = w + np.diff(w)[0] * rng.uniform(-0.5, 0.5, len(w))  # so that it does not repeat
    # S = 5/16 H^2 wp^4/w^5 exp(-5/4 (wp/w)^4)
    s = 0.3125 * height**2 * peak**4 / w**5 * np.exp(-1.25 * (peak / w) ** 4)
    amplitude = np.sqrt(2.0 * s * (3.1 * peak / 159.0))
    heave, pitch, roll, encounter = responses(w)
    phase = encounter * t[:, None] + rng.uniform(0.0, 2.0 * np.pi, len(w))
    sine, cosine = np.sin(phase), np.cos(phase)
    euler = np.stack([cosine @ (amplitude * roll), cosine @ (amplitude * pitch), 0.0 * t], axis=1)
    return euler, -sine @ (amplitude * heave * encounter**2)


def responses(w: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Heave [m/m], pitch and roll [rad/m] of `SHIP` to waves of w [rad/s]; what it meets [rad/s].

    Jensen et al. (2004), a box with the breadth corrected by the block coefficient::

        eta = 1/sqrt((1 - 2 k T a^2)^2 + (A^2/(k B a^2))^2)    a = 1 - w U cos(b)/g
        f = sqrt((1 - k T)^2 + (A^2/(k B a^3))^2)   A = 2 sin(k B a^2/2) exp(-k T a^2)
        heave = eta f e^(-k T) sin(K)/K    pitch = eta f e^(-k T) 6 (sin K - K cos K)/(K^2 L)
        K = k L |cos b|/2        roll = k sin(b) / sqrt((1 - r^2)^2 + (2 d r)^2),  r = w_e/w_roll
    """
    length, breadth, draught, block, speed, beta, natural, damping = SHIP
    k = w**2 / GRAVITY
    a = 1.0 - w * speed * np.cos(beta) / GRAVITY
    b = k * breadth * block
    sway = 2.0 * np.sin(0.5 * b * a**2) * np.exp(-k * draught * a**2)
    eta = 1.0 / np.hypot(1.0 - 2.0 * k * draught * a**2, sway**2 / (b * a**2))
    force = eta * np.hypot(1.0 - k * draught, sway**2 / (b * a**3)) * np.exp(-k * draught)
    half = 0.5 * k * length * abs(np.cos(beta))
    heave = force * np.sin(half) / half
    pitch = force * 6.0 * (np.sin(half) - half * np.cos(half)) / (half**2 * length)
    r = w * a * natural / (2.0 * np.pi)
    roll = k * np.sin(beta) / np.hypot(1.0 - r**2, 2.0 * damping * r)
    return heave, pitch, roll, w * a


#: Motions by name.
MOTIONS = {
    "table": table,
    "rolling": rolling,
    **{
        f"sea_{n}": lambda t, rng, n=n: at_sea(t, rng, n)  # type: ignore[misc]
        for n in SEA_STATES
    },
}


def deck(name: str, seconds: float, seed: int, heading_deg: float = 0.0) -> Deck:
    """One of `MOTIONS` about a heading.

    Raises
    ------
    InputError
        No such motion.
    """
    if name not in MOTIONS:
        raise InputError.at(
            "motion", wanted=f"one of {', '.join(MOTIONS)}", found=repr(name), fix="choose of these"
        )
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    euler, lift = MOTIONS[name](t, np.random.default_rng([seed, 25]))
    euler = euler + [0.0, 0.0, math.radians(heading_deg)]
    q = np.array([1.0, 0.0, 0.0, 0.0])
    for axis, angle in ((3, euler[:, 2]), (2, euler[:, 1]), (1, euler[:, 0])):
        part = np.zeros((len(t), 4))
        part[:, 0], part[:, axis] = np.cos(angle / 2.0), np.sin(angle / 2.0)
        q = quaternion_multiply(q, part)
    return Deck(euler, q, lift)


def records(
    what: Deck,
    seed: int,
    errors: SensorErrors = SensorErrors(),
    *,
    field_ut: float = 50.0,
    dip_deg: float = 54.0,
) -> FloatArray:
    """Records of the nine-axis filters (n, 10): dt, gyro, field, specific force; the first restarts."""
    n, rng = len(what.q), np.random.default_rng([seed, 2018])
    rate = np.zeros((n, 3))
    rate[1:] = turns_between(what.q[:-1], what.q[1:]) * RATE_HZ
    rate = np.concatenate([rate[:1].repeat(errors.gyro_lag, axis=0), rate])[:n]
    white = rng.normal(size=(3, n, 3))
    bias = np.radians(errors.gyro_bias + errors.bias_spread * rng.normal(size=3))
    up = np.zeros((n, 3))
    up[:, 2] = GRAVITY + what.lift
    dip = math.radians(dip_deg)
    north = field_ut * np.array([math.cos(dip), 0.0, -math.sin(dip)])
    back = quaternion_conjugate(what.q)
    dt = np.full((n, 1), 1.0 / RATE_HZ)
    dt[0] = -dt[0]
    return np.concatenate(
        [
            dt,
            rate + bias + np.radians(errors.gyro_noise) * white[0],
            rotate(back, north) + errors.mag_noise * field_ut * white[1],
            rotate(back, up) + errors.acc_noise * GRAVITY * white[2],
        ],
        axis=1,
    )
