"""The estimators of the experiment with the paper's settings, in float64 and in fixed point."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.attitude.complementary import Complementary
from boresight.model.attitude.ekf_quaternion import EkfQuaternion
from boresight.model.attitude.front.sensed import board_params
from boresight.model.attitude.ma2014 import Ma2014Cf
from boresight.model.declarations import GRAVITY
from boresight.model.estimator import Estimator
from boresight.sim.attitude.ma2014.paper import AXES, KI, KP, TABLE_2
from boresight.sim.attitude.ma2014.world import AVERAGED, FIELD_UT, LEAD, LOOP_HZ
from boresight.sim.experiments.forms import run_forms
from boresight.sim.levels.level import Run
from boresight.sim.records.feed import feed
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.sim.rotations.rotation import quaternion_to_euler


class Method(NamedTuple):
    """One row of Table 3: an estimator with these parameters."""

    key: str
    title: str
    estimator: Estimator
    params: Mapping[str, float]


def gains(
    kp: Sequence[float] = KP, ki: Sequence[float] = KI, rate_hz: float | None = None
) -> dict[str, float]:
    """Parameters of `ma2014_cf`; with a rate those of `complementary`, whose gains are per s."""
    kp_unit, ki_unit = ("", "") if rate_hz is None else ("_per_s", "_per_s2")
    rate = rate_hz or 1.0
    return {
        **{f"kp_{axis}{kp_unit}": k * rate for axis, k in zip(AXES, kp, strict=True)},
        **{f"ki_{axis}{ki_unit}": k * rate * rate for axis, k in zip(AXES, ki, strict=True)},
    }


def kalman_parameters() -> dict[str, float]:
    """Table 2 in the parameters of `ekf_quaternion`.

    Noise of the angles at rest, level and at heading 0::

        pitch  sd(f_y) / g        roll  sd(f_x) / g
        heading^2 = (sd(m_x) / m_h)^2 + (roll m_z / m_h)^2
    """
    acc = [math.sqrt(v / AVERAGED) for v in TABLE_2.accelerometer]
    level = math.hypot(FIELD_UT[0], FIELD_UT[1])
    pitch, roll = acc[1] / GRAVITY, acc[0] / GRAVITY
    heading = math.hypot(math.sqrt(TABLE_2.magnetometer[0]), roll * FIELD_UT[2]) / level
    values = {"scale": 64.0, "p0_sd": 0.01}
    for axis, variance, angle in zip("xyz", TABLE_2.gyro, (pitch, roll, heading), strict=True):
        values |= {f"gyro_sd_{axis}": math.sqrt(variance), f"angle_sd_{axis}": angle}
    return values


def _kalman_of_table_4() -> dict[str, float]:
    """Noises whose steady gains are those of Table 4, all measured angles with 0.2 deg.

    Of a scalar filter with gain K: q = r K^2 / (1 - K), in the angle that the gyro adds in a step.
    """
    values = kalman_parameters()
    angle = math.radians(0.2)
    for axis, k in zip("xyz", KP, strict=True):
        values[f"angle_sd_{axis}"] = angle
        values[f"gyro_sd_{axis}"] = angle * k / math.sqrt(1.0 - k) * LOOP_HZ
    return values


_NO_GAIN, _FULL_GAIN = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
_GYRO, _PRINTED = gains(_NO_GAIN, _NO_GAIN), Ma2014Cf(as_printed=True)
METHODS = (
    Method("gyro", "gyro alone", Ma2014Cf(), _GYRO),
    Method(
        "mag_acc", "magnetometer and accelerometer alone", Ma2014Cf(), gains(_FULL_GAIN, _NO_GAIN)
    ),
    Method(
        "ekf_quaternion", "Kalman filter, noises of Table 2", EkfQuaternion(), kalman_parameters()
    ),
    Method(
        "ekf_table_4",
        "Kalman filter, steady gains of Table 4",
        EkfQuaternion(),
        _kalman_of_table_4(),
    ),
    Method("ma2014_cf", "the paper's complementary filter", Ma2014Cf(), gains()),
    Method(
        "complementary",
        "the improved complementary filter",
        Complementary(),
        gains(rate_hz=LOOP_HZ),
    ),
    Method("ma2014_cf_as_printed", "the paper's filter, eq. (3) as printed", _PRINTED, gains()),
    Method("gyro_as_printed", "gyro alone, eq. (3) as printed", _PRINTED, _GYRO),
)


def run_method(
    method: Method,
    logs: Sequence[Record],
    levels: Sequence[str] = ("float", "c"),
    params: Mapping[str, float] | None = None,
) -> list[tuple[FloatArray, int]]:
    """Angles [deg] of every log (steps, runs, 3) on each level, and the saturated updates.

    Parameters are the method's, or others.
    """
    return [
        (
            180.0 * np.stack([np.column_stack([r.outputs[n] for n in AXES]) for r in runs], axis=1),
            sum(run.n_saturated for run in runs),
        )
        for runs in _runs(method, logs, levels, params)
    ]


def _runs(
    method: Method,
    logs: Sequence[Record],
    levels: Sequence[str],
    params: Mapping[str, float] | None = None,
) -> list[list[Run]]:
    """Runs of each level over every log."""
    estimator = method.estimator
    records = [feed(estimator, log).inputs for log in logs]
    params = {**board_params(estimator.params), **(method.params if params is None else params)}
    return run_forms(estimator, records, params=params, levels=levels)


def count_mismatches(method: Method, log: Record) -> int:
    """Updates in which C and the integer interpreter differ; one more if that stopped."""
    (expected,), (run,) = _runs(method, [log], ("fixed", "c"))
    assert run.words is not None and run.saturated is not None
    mismatches = (run.words != expected.words).any(axis=1) | (run.saturated != expected.saturated)
    return int(mismatches.sum()) + bool(expected.fault or not len(mismatches))


def score(angles: FloatArray, logs: Sequence[Record]) -> FloatArray:
    """Error [deg] of the samples from t = 0 on: (steps - LEAD, runs, 3)."""
    truth = [np.degrees(quaternion_to_euler(NineAxis.of(log).attitude)) for log in logs]
    return wrapped_deg(angles - np.stack(truth, axis=1))[LEAD:]


def wrapped_deg(x: FloatArray) -> FloatArray:
    """Degrees into [-180, 180)."""
    return np.asarray((x + 180.0) % 360.0 - 180.0)
