"""Logs of a body that turns, and what its sensors read.

A synthetic log has exact truth: no integration error stands between gyro and attitude. The attitude
is a smooth function of time, given by sums of sines in the three Euler angles. The gyro sample k is
the constant body rate that takes the attitude of sample k-1 to that of sample k in the time step
between them. So an estimator that integrates each step with the closed form follows the truth to
rounding, and whatever error it shows is its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import FloatArray
from boresight.model.declarations import GRAVITY
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record, steps_of
from boresight.sim.rotations import rotation

_IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, eq=False)
class Triad:
    """A sensor of three axes, from a true vector to its reading, in one unit throughout.

    ::

        v       true vector in body axes
        raw   = M v + bias + noise             M: scale, misalignment, soft iron; bias: hard iron
        word  = round(raw / lsb)               clamped to the full scale
        value = lsb word
    """

    lsb: float  #: value of one count; 0: not quantised
    full_scale: float  #: largest magnitude of a reading
    variance: Sequence[float] = (0.0, 0.0, 0.0)  #: white noise of one reading, per axis
    bias: Sequence[float] | FloatArray = (0.0, 0.0, 0.0)
    matrix: npt.ArrayLike = _IDENTITY  #: M
    #: Readings that the reader averages into one value: variance and lsb shrink by it.
    averaged: float = 1.0

    def read(self, true: FloatArray, rng: np.random.Generator) -> FloatArray:
        """Readings of true vectors, (n, 3).

        The noise is drawn whatever its variance, so that switching one error on leaves the
        others as they were.
        """
        sd = np.sqrt(np.asarray(self.variance) / self.averaged)
        noise = rng.standard_normal(true.shape) * sd
        raw = true @ np.asarray(self.matrix).T + np.asarray(self.bias) + noise
        lsb = self.lsb / self.averaged
        value = np.rint(raw / lsb) * lsb if lsb > 0.0 else raw
        return np.asarray(np.clip(value, -self.full_scale, self.full_scale))


IDEAL = Triad(0.0, np.inf)  #: without errors.


def white(noise: float, bias: Sequence[float] = (0.0, 0.0, 0.0)) -> Triad:
    """A triad with white noise, by the standard deviation of a sample, and an offset."""
    return Triad(0.0, np.inf, [noise * noise] * 3, bias)


def misalignment(rng: np.random.Generator, sd_rad: float) -> FloatArray:
    """Matrix of a triad mounted askew: a turn by a random vector, ``sd_rad`` about each axis."""
    turn = rotation.rotation_vector_to_quaternion(sd_rad * rng.standard_normal(3))
    return rotation.quaternion_to_matrix(turn).T


RAMP_S = 0.1  #: s, in which the rate of the turn rises, and in which it falls.


def fast_turn(
    log: NineAxis, *, begin_s: float, rate_rad_s: npt.ArrayLike, seconds: float
) -> NineAxis:
    """The log of a sensor that turns in its housing and stays there.

    From then on its axes are others: v_sensor = r* v_body r, with the turn r so far. The steps
    of gyro and truth agree as well as those of the log. Nothing is clipped. The rate about sensor
    axes begins to rise at ``begin_s`` of the log, and for ``seconds`` it is ``rate_rad_s``, less
    than half a turn in a step.
    """
    corners = begin_s + np.cumsum([0.0, RAMP_S, seconds, RAMP_S])
    share = np.interp(log.t - 0.5 * log.dt, corners, [0.0, 1.0, 1.0, 0.0])
    turn_time = np.cumsum(share * log.dt)[:, None]
    r = rotation.rotation_vector_to_quaternion(turn_time * np.asarray(rate_rad_s, dtype=np.float64))
    # A step of the sensor: back by the turn before it, the step of the housing, the turn after it.
    turn_back = rotation.quaternion_conjugate(np.concatenate([[[1.0, 0.0, 0.0, 0.0]], r[:-1]]))
    housing = rotation.rotation_vector_to_quaternion(log.gyr * log.dt[:, None])
    step = rotation.quaternion_multiply(rotation.quaternion_multiply(turn_back, housing), r)
    to_sensor = rotation.quaternion_conjugate(r)
    return replace(
        log,
        gyr=rotation.quaternion_to_rotation_vector(step) / log.dt[:, None],
        acc=rotation.rotate(to_sensor, log.acc),
        mag=rotation.rotate(to_sensor, log.mag),
        q=None if log.q is None else rotation.quaternion_multiply(log.q, r),
    )


#: Sines per Euler angle, and the band [Hz] their frequencies are drawn from.
_SINES = 3
_BAND_HZ = (0.05, 0.4)
#: Largest excursions [rad] of pitch, roll and heading.
_LIMITS = np.radians((60.0, 70.0, 150.0))


def synthetic_log(
    *,
    seconds: float,
    rate_hz: float,
    seed: int,
    acceleration: float = 0.0,
    field_ut: Sequence[float] = (0.0, 27.9, -46.2),
    mag_every: int = 1,
    gyr_error: Triad = IDEAL,
    acc_error: Triad = IDEAL,
    mag_error: Triad = IDEAL,
    name: str = "synthetic",
) -> Record:
    """Make a log with exact truth; the same arguments give the same log.

    Motion, acceleration and the noise of each sensor have random streams of their own: switching
    one on leaves the others as they were.

    There are ``round(seconds * rate_hz)`` samples, at times k / rate_hz; from 10 Hz on no body rate
    reaches half a turn per sample. ``acceleration`` bounds the linear acceleration along each axis
    of n [m/s^2], sums of sines too. ``field_ut`` in n (ENU) [uT] dips 58.9 degrees to magnetic
    north. The magnetometer delivers in every ``mag_every``-th row, from the first on. Errors are in
    rad/s, m/s^2 and uT.
    """
    count = round(seconds * rate_hz)
    motion_rng, force_rng, gyr_rng, acc_rng, mag_rng = (
        np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(5)
    )
    # one sample more, before the first, for the first gyro step
    t = np.arange(-1, count) / rate_hz
    angles = [_sum_of_sines(t, limit, motion_rng) for limit in _LIMITS]
    q = rotation.euler_to_quaternion(np.stack(angles, axis=-1))
    turn = rotation.turns_between(q[:-1], q[1:])
    q, t = q[1:], t[1:]

    to_body = rotation.quaternion_conjugate(q)
    force = np.stack([_sum_of_sines(t, acceleration, force_rng) for _ in range(3)], axis=-1)
    force[:, 2] += GRAVITY
    mag = mag_error.read(rotation.rotate(to_body, field_ut), mag_rng)
    mag[np.arange(count) % mag_every != 0] = np.nan
    # the steps as a user of the log sees them: differences of rounded times
    dt = steps_of(name, t)[:, None]
    return NineAxis(
        name,
        t,
        gyr_error.read(turn / dt, gyr_rng),
        acc_error.read(rotation.rotate(to_body, force), acc_rng),
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
        gyr_error=white(0.003, (0.002, -0.003, 0.001)),
        acc_error=white(0.05),
        mag_error=white(0.3),
        name="synthetic_60s",
    )
