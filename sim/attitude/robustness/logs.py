"""Logs of four carriers that never rest: car, drone, pedestrian, ship, with exact truth.

Each is a random draw of an attitude and an acceleration that belong together; a nine-axis sensor of
ordinary quality, biased, rides along and is switched on in motion. Axes are East-North-Up.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import GRAVITY
from boresight.model.errors import require_choice
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.rotation import (
    euler_to_quaternion,
    quaternion_conjugate,
    quaternion_multiply,
    rotate,
    turns_between,
)
from boresight.sim.worlds.road import profile, ride
from boresight.sim.worlds.ship import at_sea

__all__ = ["CARRIERS", "carrier"]

#: Attitude b to n (n, 4), acceleration (n, 3) [m/s^2] and change of the field (n, 3) [uT] in n.
Journey = tuple[FloatArray, FloatArray, FloatArray]
Draw = Callable[[FloatArray, float, np.random.Generator], Journey]

#: Field in n [uT], as in the middle of Europe.
FIELD_UT = (0.0, 20.0, -44.0)
#: North-east-down to east-north-up: half a turn about the line between north and east.
_NED_TO_ENU = np.array([0.0, np.sqrt(0.5), np.sqrt(0.5), 0.0])


@dataclass(frozen=True)
class _Quality:
    """Standard deviations: of a sample's noise at 100 Hz, and of the constant bias of a draw."""

    noise: tuple[float, float, float] = (2e-3, 0.03, 0.5)
    bias: tuple[float, float, float] = (np.radians(0.3), 0.03, 0.5)


def _waves(
    t: FloatArray, rng: np.random.Generator, low_hz: float, high_hz: float, axes: int
) -> FloatArray:
    """Twelve sines of random frequency and phase in each axis, (n, axes), of variance one."""
    frequency, phase = (
        rng.uniform(low_hz, high_hz, (12, axes)),
        rng.uniform(0, 2 * np.pi, (12, axes)),
    )
    return np.asarray(
        np.sin(2 * np.pi * frequency * t[:, None, None] + phase).sum(axis=1) / np.sqrt(6.0)
    )


def _car(t: FloatArray, rate_hz: float, rng: np.random.Generator) -> Journey:
    """Starts, brakes and turns of a town; the body rolls and pitches on its springs."""
    parts, speed, remaining = [(5.0, 0.0, 0.0)], 12.0, t[-1] - t[0]
    while remaining > 0.0:
        seconds = rng.uniform(3.0, 9.0)
        target = rng.uniform(3.0, 20.0)
        accel = float(np.clip((target - speed) / seconds, -3.0, 2.5))
        turn = float(rng.choice([0.0, 0.0, 1.0, -1.0]) * rng.uniform(4.0, 20.0))
        parts.append((seconds, accel, turn if speed < 15.0 else 0.2 * turn))
        speed, remaining = speed + accel * seconds, remaining - seconds
    accel, turn = profile(parts, rate_hz)[:, : len(t)].copy()
    accel[0] += 12.0 * rate_hz  # it drives already; this sample is none of the log's
    shake = _waves(t, rng, 1.0, 12.0, 3)
    motion = ride(
        rate_hz,
        accel,
        turn,
        roll_deg=-0.5 * np.cumsum(accel) / rate_hz * turn + 0.4 * shake[:, 0],
        pitch_deg=0.6 * accel + 0.4 * shake[:, 1] + _waves(t, rng, 0.01, 0.05, 1)[:, 0],
        lift=0.8 * shake[:, 2],
    )
    acceleration = motion.acceleration[:, [1, 0, 2]] * [1.0, 1.0, -1.0]
    field = 2.0 * _waves(t, rng, 0.02, 0.2, 3)  # other cars, bridges
    return quaternion_multiply(_NED_TO_ENU, motion.q), acceleration, field


def _drone(t: FloatArray, rate_hz: float, rng: np.random.Generator) -> Journey:
    """A multicopter: it accelerates as it tilts, and drags as it flies; rotors shake it."""
    tilt = np.radians(9.0) * _waves(t, rng, 0.1, 0.9, 2)
    heading = np.radians(60.0) * _waves(t, rng, 0.02, 0.2, 1)[:, 0]
    q = euler_to_quaternion(np.stack([tilt[:, 0], tilt[:, 1], heading], axis=-1))
    thrust = GRAVITY * (1.0 + 0.06 * _waves(t, rng, 0.1, 1.0, 1))
    up = rotate(q, np.concatenate([np.zeros((len(t), 2)), thrust], axis=1)) - [0.0, 0.0, GRAVITY]
    velocity, acceleration = np.zeros(3), np.empty_like(up)
    for k, force in enumerate(up):
        acceleration[k] = force - 0.35 * velocity
        velocity = velocity + acceleration[k] / rate_hz
    shaking = rotate(q, 1.5 * rng.standard_normal((len(t), 3)))
    return q, acceleration + shaking, np.zeros_like(up)


def _pedestrian(t: FloatArray, rate_hz: float, rng: np.random.Generator) -> Journey:
    """A telephone in the hand of a person who walks through a building."""
    cadence = 2 * np.pi * np.cumsum(1.8 + 0.1 * _waves(t, rng, 0.02, 0.2, 1)[:, 0]) / rate_hz
    heading = np.radians(110.0) * _waves(t, rng, 0.01, 0.12, 1)[:, 0]
    sway = np.radians([9.0, 7.0]) * _waves(t, rng, 0.1, 1.5, 2)
    euler = np.stack([0.6 + sway[:, 0] + 0.05 * np.sin(cadence), sway[:, 1], heading], axis=-1)
    euler[:, 1] += 0.06 * np.sin(0.5 * cadence)
    ahead = np.stack([-np.sin(heading), np.cos(heading)], axis=1)
    aside = np.stack([ahead[:, 1], -ahead[:, 0]], axis=1)
    horizontal = 1.5 * np.cos(cadence)[:, None] * ahead + np.sin(0.5 * cadence)[:, None] * aside
    horizontal += 1.2 * np.gradient(heading, t)[:, None] * -aside  # walks at 1.2 m/s
    up = 2.5 * np.sin(cadence) + 0.8 * np.sin(2.0 * cadence + 0.7)
    field = 3.0 * _waves(t, rng, 0.02, 0.25, 3)  # steel of the building
    return euler_to_quaternion(euler), np.concatenate([horizontal, up[:, None]], axis=1), field


def _ship(t: FloatArray, rate_hz: float, rng: np.random.Generator) -> Journey:
    """A ship in sea state 5, off its centre, that turns now and then."""
    angles, heave = at_sea(t, rng)
    heading = np.radians(25.0) * _waves(t, rng, 0.002, 0.01, 1)[:, 0]
    q = euler_to_quaternion(np.stack([angles[:, 1], angles[:, 0], heading], axis=-1))
    horizontal = 0.3 * _waves(t, rng, 0.05, 0.2, 2)
    return q, np.concatenate([horizontal, heave[:, None]], axis=1), np.zeros((len(t), 3))


#: Draw of its journey, its rate [Hz].
CARRIERS: dict[str, tuple[Draw, float]] = {
    "car": (_car, 100.0),
    "drone": (_drone, 400.0),
    "pedestrian": (_pedestrian, 100.0),
    "ship": (_ship, 50.0),
}


def carrier(name: str, seed: int, *, seconds: float = 120.0) -> NineAxis:
    """The log of a draw, named ``NAME-SEED``; the same arguments give the same log.

    Raises
    ------
    InputError
        No such carrier.
    """
    require_choice("carrier", name, CARRIERS)
    draw, rate_hz = CARRIERS[name]
    motion, sensors = (np.random.default_rng([seed, k]) for k in range(2))
    t = np.arange(-1, round(seconds * rate_hz)) / rate_hz  # one sample more, for the first turn
    q, acceleration, change = draw(t, rate_hz, motion)
    rate = turns_between(q[:-1], q[1:]) * rate_hz
    q, t = q[1:], t[1:]
    body = quaternion_conjugate(q)
    truth = (
        rate,
        rotate(body, acceleration[1:] + [0.0, 0.0, GRAVITY]),
        rotate(body, np.asarray(FIELD_UT) + change[1:]),
    )
    quality = _Quality()
    gyr, acc, mag = (
        v
        + bias * sensors.standard_normal(3)
        + noise * np.sqrt(rate_hz / 100.0) * sensors.standard_normal(v.shape)
        for v, noise, bias in zip(truth, quality.noise, quality.bias, strict=True)
    )
    steps = np.full(len(t), 1.0 / rate_hz)
    return NineAxis(f"{name}-{seed}", t, gyr, acc, mag, q, steps)
