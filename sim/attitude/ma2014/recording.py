"""A log of a motion, as the sensors saw it.

The loop runs at one rate; at each of its samples it has the mean body rate since the last one
(what a fast gyro, summed up, gives), the specific force and the field.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import GRAVITY
from boresight.model.errors import InputError
from boresight.sim.attitude.ma2014.motion import StackedMotion
from boresight.sim.attitude.worlds.triad import Triad
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.sim.rotations.rotation import turns_between

__all__ = ["Sensors", "record"]


@dataclass(frozen=True)
class Sensors:
    """Three triads on one body, in rad/s, m/s^2 and uT.

    ``gyro_bias``: bias found at rest, which is subtracted from the gyro's readings.
    """

    gyro: Triad
    acc: Triad
    mag: Triad
    gyro_bias: Sequence[float] = (0.0, 0.0, 0.0)


def record(
    motion: StackedMotion,
    sensors: Sensors,
    *,
    rate_hz: float,
    seed: int,
    field_ut: Sequence[float],
    lead: int = 0,
    gravity: float = GRAVITY,
    lever: Sequence[float] = (0.0, 0.0, 0.0),
    name: str = "world",
) -> Record:
    """Record a motion; the same arguments give the same log.

    Each sensor has a random stream of its own.

    Nine axes with the true attitude, at ``k / rate_hz``, k = -lead to the end of the motion;
    before t = 0 the stages stand at their start. ``field_ut`` is the magnetic field [uT] in
    navigation axes, ``lever`` the place of the accelerometer [m] in body axes.
    """
    if not (np.isfinite(rate_hz) and rate_hz > 0.0):
        raise InputError(f"rate_hz must be a number above 0, not {rate_hz!r}")
    if not isinstance(seed, int) or seed < 0:
        raise InputError(f"seed must be an integer of 0 or more, not {seed!r}")
    step = 1.0 / rate_hz
    t = np.arange(-lead, int(np.floor(motion.seconds * rate_hz)) + 1) / rate_hz

    def mean_rate(at: FloatArray) -> FloatArray:
        return turns_between(motion.attitude(at - step), motion.attitude(at)) / step

    def field(at: FloatArray) -> FloatArray:
        return np.asarray(np.asarray(field_ut, dtype=np.float64) @ motion.matrix(at))  # C^T m

    def force(at: FloatArray) -> FloatArray:
        return motion.specific_force(at, gravity=gravity, lever=lever)

    gyro_rng, acc_rng, mag_rng = (
        np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(3)
    )
    return NineAxis(
        name,
        t,
        sensors.gyro.read(mean_rate, t, gyro_rng) - np.asarray(sensors.gyro_bias),
        sensors.acc.read(force, t, acc_rng),
        sensors.mag.read(field, t, mag_rng),
        motion.attitude(t),
        steps=np.full(len(t), step),
    ).record()
