"""Synthetic logs whose truth is exact: no integration error stands between gyro and attitude.

The attitude is a smooth function of time, given by sums of sines in the three Euler angles. The
gyro sample k is the constant body rate that takes the attitude of sample k-1 to that of sample k
in the time step between them. So an estimator that integrates each step with the closed form
follows the truth to rounding, and whatever error it shows is its own.

``python -m boresight.sim.attitude.worlds.synthetic FILE`` writes ``synthetic_60s.csv`` again.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import GRAVITY
from boresight.sim.records.files import content_of
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record, steps_of
from boresight.sim.rotations.rotation import (
    euler_to_quaternion,
    quaternion_conjugate,
    rotate,
    turns_between,
)

#: Sines per Euler angle, and the band [Hz] their frequencies are drawn from.
_SINES = 3
_BAND_HZ = (0.05, 0.4)
#: Largest excursions [rad] of pitch, roll and heading.
_LIMITS = np.radians((60.0, 70.0, 150.0))


@dataclass(frozen=True)
class SensorError:
    """Error that one triad adds to the true value, in its unit.

    White noise, by its standard deviation of each sample and axis, and an offset.
    """

    noise: float = 0.0
    bias: Sequence[float] = (0.0, 0.0, 0.0)

    def apply(self, true: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return the reading for true values (n, 3)."""
        noise = self.noise * rng.standard_normal(true.shape)
        return np.asarray(true + np.asarray(self.bias) + noise, dtype=np.float64)


def synthetic_log(
    *,
    seconds: float,
    rate_hz: float,
    seed: int,
    acceleration: float = 0.0,
    field_ut: Sequence[float] = (0.0, 27.9, -46.2),
    mag_every: int = 1,
    gyr_error: SensorError | None = None,
    acc_error: SensorError | None = None,
    mag_error: SensorError | None = None,
    name: str = "synthetic",
) -> Record:
    """Make a log with exact truth; the same arguments give the same log.

    Motion, acceleration and the noise of each sensor have random streams of their own: switching
    one on leaves the others as they were.

    Parameters
    ----------
    seconds, rate_hz : float
        There are ``round(seconds * rate_hz)`` samples, at times k / rate_hz. From 10 Hz on no body
        rate reaches half a turn per sample.
    acceleration : float, 0 or more
        Bound of the linear acceleration along each axis of n [m/s^2]; sums of sines too.
    field_ut : three floats
        Magnetic field in n (ENU) [uT]; the default dips 58.9 degrees to magnetic north.
    mag_every : int, 1 or more
        The magnetometer delivers in every such row, beginning with the first.
    gyr_error, acc_error, mag_error : SensorError, optional
        Errors in rad/s, m/s^2 and uT; none by default.
    """
    count = round(seconds * rate_hz)
    motion_rng, force_rng, gyr_rng, acc_rng, mag_rng = (
        np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(5)
    )
    # one sample more, before the first, for the first gyro step
    t = np.arange(-1, count) / rate_hz
    angles = [_sum_of_sines(t, limit, motion_rng) for limit in _LIMITS]
    q = euler_to_quaternion(np.stack(angles, axis=-1))
    turn = turns_between(q[:-1], q[1:])
    q, t = q[1:], t[1:]

    to_body = quaternion_conjugate(q)
    force = np.stack([_sum_of_sines(t, acceleration, force_rng) for _ in range(3)], axis=-1)
    force[:, 2] += GRAVITY
    mag = (mag_error or SensorError()).apply(rotate(to_body, field_ut), mag_rng)
    mag[np.arange(count) % mag_every != 0] = np.nan
    # the steps as a user of the log sees them: differences of rounded times
    dt = steps_of(name, t)[:, None]
    return NineAxis(
        name,
        t,
        (gyr_error or SensorError()).apply(turn / dt, gyr_rng),
        (acc_error or SensorError()).apply(rotate(to_body, force), acc_rng),
        mag,
        q,
    ).record()


def _sum_of_sines(t: FloatArray, limit: float, rng: np.random.Generator) -> FloatArray:
    """Sines of random frequency, phase and weight; the sum stays within +-limit."""
    weight = rng.uniform(0.5, 1.0, _SINES)
    frequency = rng.uniform(*_BAND_HZ, _SINES)
    phase = rng.uniform(0.0, 2 * np.pi, _SINES)
    waves = np.sin(2 * np.pi * frequency * t[:, None] + phase)
    return np.asarray(waves @ (limit * weight / weight.sum()), dtype=np.float64)


def synthetic_60s() -> Record:
    """Make the bundled log: 100 Hz, modest sensor errors, a magnetometer at 10 Hz, exact truth."""
    return synthetic_log(
        seconds=60.0,
        rate_hz=100.0,
        seed=20140,
        acceleration=0.5,
        mag_every=10,
        gyr_error=SensorError(noise=0.003, bias=(0.002, -0.003, 0.001)),
        acc_error=SensorError(noise=0.05),
        mag_error=SensorError(noise=0.3),
        name="synthetic_60s",
    )


if __name__ == "__main__":
    Path(sys.argv[1]).write_bytes(content_of(sys.argv[1], synthetic_60s()))
