"""Synthetic logs whose truth is exact: no integration error stands between gyro and attitude.

The attitude is a smooth function of time, given by sums of sines in the three Euler angles. The
gyro sample k is the constant body rate that takes the attitude of sample k-1 to that of sample k
in the time step between them. So an estimator that integrates each step with the closed form
follows the truth to rounding, and whatever error it shows is its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import GRAVITY
from boresight.model.errors import InputError
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record, steps_of
from boresight.sim.rotations.rotation import (
    euler_to_quaternion,
    quaternion_conjugate,
    rotate,
    turns_between,
)

__all__ = ["SensorError", "synthetic_log"]


#: Sines per Euler angle, and the band [Hz] their frequencies are drawn from.
_SINES = 3
_BAND_HZ = (0.05, 0.4)
#: Largest excursions [rad] of roll and heading.
_ROLL_LIMIT = np.radians(70.0)
_HEADING_LIMIT = np.radians(150.0)
#: Pitch amplitude [rad] of a trajectory through the vertical: one sine, which passes +-90 degrees.
_LOOP_LIMIT = np.radians(110.0)
_LARGEST_LOG = 10_000_000


@dataclass(frozen=True)
class SensorError:
    """Error that one triad adds to the true value, in its unit.

    White noise, whose standard deviation of each sample and axis is 0 or more, and an offset.
    `InputError` if a value is not finite, the noise negative or the bias not three numbers.
    """

    noise: float = 0.0
    bias: Sequence[float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not (np.isfinite(self.noise) and self.noise >= 0):
            raise InputError(f"noise must be a number of 0 or more, not {self.noise!r}")
        if np.shape(self.bias) != (3,) or not np.all(np.isfinite(self.bias)):
            raise InputError(f"bias must be three finite numbers, not {self.bias!r}")

    def apply(self, true: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Return the reading for true values (n, 3)."""
        noise = self.noise * rng.standard_normal(true.shape)
        return np.asarray(true + np.asarray(self.bias) + noise, dtype=np.float64)


def synthetic_log(
    *,
    seconds: float,
    rate_hz: float,
    seed: int,
    max_pitch_deg: float = 60.0,
    through_vertical: bool = False,
    acceleration: float = 0.0,
    gravity: float = GRAVITY,
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
    max_pitch_deg : float, in (0, 89]
        Bound of the pitch angle.
    through_vertical : bool
        Let the body tip over: pitch passes +-90 degrees at least once, and max_pitch_deg is not
        used. It needs 10 seconds or more.
    acceleration : float, 0 or more
        Bound of the linear acceleration along each axis of n [m/s^2]; sums of sines too.
    field_ut : three floats
        Magnetic field in n (ENU) [uT]; the default dips 58.9 degrees to magnetic north.
    mag_every : int, 1 or more
        The magnetometer delivers in every such row, beginning with the first.
    gyr_error, acc_error, mag_error : SensorError, optional
        Errors in rad/s, m/s^2 and uT; none by default.

    Raises
    ------
    InputError
        If an argument is out of its range.
    """
    _require("seconds", seconds, "a number above 0", seconds > 0)
    _require("rate_hz", rate_hz, "a number of 10 or more", rate_hz >= 10)
    _require("max_pitch_deg", max_pitch_deg, "in (0, 89]", 0 < max_pitch_deg <= 89)
    _require("acceleration", acceleration, "a number of 0 or more", acceleration >= 0)
    _require("gravity", gravity, "a number above 0", gravity > 0)
    _require_integer("mag_every", mag_every, 1)
    _require_integer("seed", seed, 0)
    if np.shape(field_ut) != (3,) or not np.all(np.isfinite(field_ut)) or not np.any(field_ut):
        raise InputError(f"field_ut must be three finite numbers, not all 0, not {field_ut!r}")
    vertical = "10 or more to pass the vertical"
    _require("seconds", seconds, vertical, seconds >= 10 or not through_vertical)
    count = round(seconds * rate_hz)
    legal = 2 <= count <= _LARGEST_LOG
    _require("seconds * rate_hz", count, f"2 to {_LARGEST_LOG} samples", legal)

    motion_rng, force_rng, gyr_rng, acc_rng, mag_rng = (
        np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(5)
    )
    # one sample more, before the first, for the first gyro step
    t = np.arange(-1, count) / rate_hz
    limits = (np.radians(max_pitch_deg), _ROLL_LIMIT, _HEADING_LIMIT)
    theta, gamma, psi = (_sum_of_sines(t, limit, motion_rng) for limit in limits)
    if through_vertical:
        theta = _LOOP_LIMIT * np.sin(2 * np.pi * 0.1 * t + motion_rng.uniform(0, 2 * np.pi))
    q = euler_to_quaternion(np.stack([theta, gamma, psi], axis=-1))
    turn = turns_between(q[:-1], q[1:])
    q, t = q[1:], t[1:]

    to_body = quaternion_conjugate(q)
    force = np.stack([_sum_of_sines(t, acceleration, force_rng) for _ in range(3)], axis=-1)
    force[:, 2] += gravity
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


def _require(name: str, value: float, wanted: str, legal: bool) -> None:
    if not (legal and np.isfinite(value)):
        raise InputError(f"{name} must be {wanted}, not {value!r}")


def _require_integer(name: str, value: int, low: int) -> None:
    legal = isinstance(value, int) and value >= low
    _require(name, value, f"an integer of {low} or more", legal)


def _sum_of_sines(t: FloatArray, limit: float, rng: np.random.Generator) -> FloatArray:
    """Sines of random frequency, phase and weight; the sum stays within +-limit."""
    weight = rng.uniform(0.5, 1.0, _SINES)
    frequency = rng.uniform(*_BAND_HZ, _SINES)
    phase = rng.uniform(0.0, 2 * np.pi, _SINES)
    waves = np.sin(2 * np.pi * frequency * t[:, None] + phase)
    return np.asarray(waves @ (limit * weight / weight.sum()), dtype=np.float64)
