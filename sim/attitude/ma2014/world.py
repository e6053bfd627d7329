"""The two tests of Ma Long et al. (2014) as logs, and what the paper prints.

Ma Long, Zhang Rui and Su Zhigang, "A New Data Fusion Algorithm Based on Magnetometer and MEMS
Inertial Device", Computer Measurement & Control 22(8), 2014, 2518. Angles are in degrees, in the
order pitch, roll, heading.

Stages x (lowest), y and z (top) turn by the angles a, b, c, so the sensors on top have the attitude

    C_bn = Rx(a) Ry(b) Rz(c).

The loop runs at one rate; at each of its samples it has the mean body rate since the last one
(what a fast gyro, summed up, gives), the specific force and the field.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.declarations import GRAVITY
from boresight.sim.attitude.worlds import Triad, misalignment
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.sim.rotations.rotation import (
    quaternion_conjugate,
    quaternion_multiply,
    rotate,
    rotation_vector_to_quaternion,
    turns_between,
)

AXES = ("pitch", "roll", "heading")

#: Table 1: stage, amplitude [deg], period [s], periods, end attitude [deg].
TABLE_1 = (
    ("x", 15.0, 25.0, 4.25, (-15.0, 0.0, 0.0)),
    ("y", 15.0, 14.0, 4.25, (-15.0, 15.0, 0.0)),
    ("z", 15.0, 5.0, 4.25, (-15.0, 15.0, 15.0)),
    ("x", 15.0, 25.0, 4.25, (0.0, 15.0, 15.0)),
    ("y", 15.0, 14.0, 4.25, (0.0, 0.0, 15.0)),
    ("z", 15.0, 5.0, 4.25, (0.0, 0.0, 0.0)),
)

GAUSS_UT = 100.0  #: uT per gauss.


#: Table 2, axes x, y, z: gyro bias [rad/s, printed as rad], variances of the noise [(rad/s)^2,
#: (m/s^2)^2, G^2].
GYRO_BIAS = (-0.0022, 0.006, 0.0006)
GYRO_VARIANCE = (1.5669e-5, 1.7842e-5, 2.1155e-6)
ACC_VARIANCE = (0.0179, 0.014, 1.0753e-4)
MAG_VARIANCE = tuple(v * GAUSS_UT**2 for v in (2.1e-6, 2.06e-5, 5.8e-6))  #: uT^2

# The two devices with the noise of Table 2; of neither is a complete data sheet at hand.
#: ADIS16385, [rad/s] and [m/s^2]. The register table of the maker's evaluation tool has the units
#: 0.0125 deg/s and 0.25 mg, the paper's section 2.1 the ranges, 24,000 and 20,000 counts.
GYRO = Triad(math.radians(0.0125), math.radians(300.0), GYRO_VARIANCE, GYRO_BIAS)
ACCELEROMETER = Triad(GRAVITY * 0.25e-3, GRAVITY * 5.0, ACC_VARIANCE)
#: HMR3300, [uT]. Guesses: the data sheet's example line has 2,285 counts, in a field of about
#: 0.5 G; the range is usual for bridges of this kind.
MAGNETOMETER = Triad(GAUSS_UT / 4500.0, GAUSS_UT * 2.0, MAG_VARIANCE)

#: Table 4; a unit of time is not printed.
KP = (0.1414, 0.1414, 0.1)
KI = (0.0000005, 0.00005, 0.0000005)

CLOCK_MHZ = 100.0
#: Figure 8 and the conclusion [us]; the abstract says 360 for the complementary filter.
TIME_US = {"complementary": 316.0, "kalman": 1140.0}
#: The paper's filter beside which each estimator of ours stands.
BESIDE = {
    "ma2014_cf": "complementary",
    "complementary": "complementary",
    "ekf_quaternion": "kalman",
}

LOOP_HZ = 8.0
#: Accelerometer samples averaged into one of the loop, 100 Hz over 8 Hz.
AVERAGED = 12.5
#: Tianjin: (-3.45, 27.90, -46.20) uT east, north, up, seen from magnetic north.
FIELD_UT = (0.0, math.hypot(-3.45, 27.90), -46.20)
#: Samples at rest before t = 0, 3 s, in which the filters align. They are not scored.
LEAD = 24
#: Case C: standard deviation of the gyro's turn about each axis, drawn in every run [deg]; the
#: magnetometer's x too large by this fraction, its y too small.
_MISALIGNMENT_DEG, _ELLIPSE = 1.0, 0.01


@dataclass(frozen=True)
class Swing:
    """A stage swings: ``amplitude sin(phase + 2 pi t / period)`` [rad] for so many periods [s]."""

    axis: int
    amplitude: float
    period: float
    periods: float
    phase: float = 0.0


@dataclass(frozen=True)
class Motion:
    """Swings one after the other from t = 0 on; between them a stage stands where it was left."""

    swings: Sequence[Swing]

    @property
    def seconds(self) -> float:
        """How long all swings take."""
        return sum(swing.period * swing.periods for swing in self.swings)

    def attitude(self, t: FloatArray) -> FloatArray:
        """Quaternions of C_bn at times t [s], (n, 4)."""
        angles, start = np.zeros((len(t), 3)), 0.0
        for s in self.swings:
            since = np.minimum(t - start, s.period * s.periods)
            angle = s.amplitude * np.sin(s.phase + 2.0 * math.pi / s.period * since)
            angles[:, s.axis] = np.where(t >= start, angle, angles[:, s.axis])
            start += s.period * s.periods
        turns = (rotation_vector_to_quaternion(angles * axis) for axis in np.eye(3))
        return functools.reduce(quaternion_multiply, turns)


def _table_1() -> Motion:
    swings, angle = [], [0.0, 0.0, 0.0]
    for stage, amplitude, period, periods, ends in TABLE_1:
        axis = "xyz".index(stage)
        outward = angle[axis] == 0.0  # from the middle to the end of the swing, or back
        signed = math.copysign(amplitude, ends[axis] if outward else angle[axis])
        phase = 0.0 if outward else math.pi / 2.0
        swings.append(Swing(axis, math.radians(signed), period, periods, phase))
        angle[axis] = ends[axis]
    return Motion(tuple(swings))


#: Section 1.3: heading, 20 deg, 6 s, 90 periods.
E1 = Motion((Swing(2, math.radians(20.0), 6.0, 90.0),))
#: Section 3.2: Table 1.
E2 = _table_1()


def make_log(motion: Motion, case: str, seed: int) -> Record:
    """The log of a motion at the loop's rate, with the noise of Table 2; its bias is taken off.

    ``case``: "noise", or "C" with misalignment and soft iron.
    """
    turn, iron = np.eye(3), np.eye(3)
    if case == "C":
        rng = np.random.default_rng(np.random.SeedSequence([seed, 2014]))
        turn = misalignment(rng, math.radians(_MISALIGNMENT_DEG))
        iron = np.diag([1.0 + _ELLIPSE, 1.0 - _ELLIPSE, 1.0])
    sensors = (
        replace(GYRO, matrix=turn),
        replace(ACCELEROMETER, averaged=AVERAGED),
        replace(MAGNETOMETER, matrix=iron),
    )
    return _record(motion, sensors, LOOP_HZ, seed, GYRO_BIAS)


def noise_free_log(motion: Motion, rate_hz: float) -> Record:
    """The same with ideal sensors at another rate."""
    return _record(motion, (Triad(0.0, 1e9),) * 3, rate_hz, 0)


def _record(
    motion: Motion,
    sensors: tuple[Triad, Triad, Triad],
    rate_hz: float,
    seed: int,
    gyro_bias: Sequence[float] = (0.0, 0.0, 0.0),
) -> Record:
    """Nine axes with the true attitude, from `LEAD` samples before t = 0 to the motion's end.

    Each sensor has a random stream of its own. ``gyro_bias`` is taken off the readings.
    """
    step = 1.0 / rate_hz
    t = np.arange(-LEAD, int(np.floor(motion.seconds * rate_hz)) + 1) / rate_hz
    q = motion.attitude(t)
    turned, to_body = turns_between(motion.attitude(t - step), q) / step, quaternion_conjugate(q)
    truths = (turned, rotate(to_body, (0.0, 0.0, GRAVITY)), rotate(to_body, FIELD_UT))
    streams = np.random.SeedSequence(seed).spawn(3)
    gyr, acc, mag = (
        sensor.read(v, np.random.default_rng(stream))
        for sensor, v, stream in zip(sensors, truths, streams, strict=True)
    )
    steps = np.full(len(t), step)
    return NineAxis("ma2014", t, gyr - np.asarray(gyro_bias), acc, mag, q, steps=steps).record()
