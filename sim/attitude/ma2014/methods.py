"""The estimators of the experiment, with the paper's settings, in float64 and in fixed point."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.attitude import ESTIMATORS
from boresight.model.attitude.complementary import per_sample_gains
from boresight.model.attitude.front.sensed import board_params
from boresight.model.declarations import GRAVITY
from boresight.sim.attitude.ma2014.letter import filter_to_the_letter, mag_acc_angles
from boresight.sim.attitude.ma2014.paper import KI, KP, TABLE_2
from boresight.sim.attitude.ma2014.world import AVERAGED, FIELD_UT, LEAD, LOOP_HZ
from boresight.sim.experiments.forms import run_forms
from boresight.sim.levels.level import Run
from boresight.sim.records.feed import feed
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.sim.rotations.rotation import quaternion_to_euler, wrap_rad

__all__ = [
    "METHODS",
    "Method",
    "count_mismatches",
    "gains_per_s",
    "kalman_parameters",
    "run_method",
    "score",
    "truth_deg",
]


@dataclass(frozen=True)
class Method:
    """One row of Table 3.

    ``estimator``: the registered estimator that computes it, None for a float reference.
    ``row``: the row of Table 3 it stands beside, if any.
    """

    key: str
    title: str
    estimator: str | None
    row: str | None = None


METHODS = (
    Method("gyro", "gyro alone", "complementary", "gyro"),
    Method("mag_acc", "magnetometer and accelerometer alone", None, "mag_acc"),
    Method("ekf_quaternion", "Kalman filter, quaternion measured", "ekf_quaternion", "kalman"),
    Method("complementary", "complementary filter", "complementary", "complementary"),
    Method("letter", "the paper's filter to the letter (float only)", None, "complementary"),
    Method(
        "complementary_as_printed",
        "complementary filter, eq. (3) as printed",
        "complementary_as_printed",
    ),
    Method("gyro_as_printed", "gyro alone, eq. (3) as printed", "complementary_as_printed"),
)


def gains_per_s(
    kp: Sequence[float] = KP, ki: Sequence[float] = KI, rate_hz: float = LOOP_HZ
) -> dict[str, float]:
    """Parameters of the complementary filter for gains per sample."""
    out = {}
    for axis, p, i in zip(("pitch", "roll", "heading"), kp, ki, strict=True):
        out[f"kp_{axis}_per_s"], out[f"ki_{axis}_per_s2"] = per_sample_gains(p, i, rate_hz)
    return out


def _params(method: Method) -> dict[str, float]:
    """The paper's settings in the parameters of the method's estimator, and its sensors'."""
    assert method.estimator is not None
    sensors = board_params(ESTIMATORS[method.estimator].params)
    if method.key.startswith("gyro"):
        return sensors | gains_per_s((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    if method.estimator.startswith("complementary"):
        return sensors | gains_per_s()
    return sensors | kalman_parameters(method.estimator)


def kalman_parameters(name: str) -> dict[str, float]:
    """Table 2 in the parameters of a quaternion EKF, by their names.

    Noise of the angles at rest, level and at heading 0, for the filter that measures a quaternion::

        pitch  sd(f_y) / g        roll  sd(f_x) / g
        heading^2 = (sd(m_x) / m_h)^2 + (roll m_z / m_h)^2

    A noise below a parameter's legal range is taken as the least one: that of f_z, which says
    nothing about the attitude near level.
    """
    acc = [math.sqrt(v / AVERAGED) for v in TABLE_2.accelerometer]
    mag = [math.sqrt(v) for v in TABLE_2.magnetometer]
    level = math.hypot(FIELD_UT[0], FIELD_UT[1])
    pitch, roll = acc[1] / GRAVITY, acc[0] / GRAVITY
    heading = math.hypot(mag[0] / level, roll * FIELD_UT[2] / level)
    values = {
        "scale": 64.0,
        "p0_sd": 0.01,
        **dict(zip(("field_east", "field_north", "field_up"), FIELD_UT, strict=True)),
    }
    for k, axis in enumerate("xyz"):
        values[f"gyro_sd_{axis}"] = math.sqrt(TABLE_2.gyro[k])
        values[f"angle_sd_{axis}"] = (pitch, roll, heading)[k]
        values[f"acc_sd_{axis}"] = acc[k]
        values[f"mag_sd_{axis}"] = mag[k]
    return {p.name: max(values[p.name], p.low) for p in ESTIMATORS[name].params if p.name in values}


def run_method(
    method: Method,
    logs: Sequence[Record],
    levels: Sequence[str] = ("float", "c"),
    params: dict[str, float] | None = None,
) -> list[tuple[FloatArray, int]]:
    """Angles [deg] of every log (steps, runs, 3) on each level, and the saturated updates.

    A method without an estimator has float64 alone. Parameters are the paper's, or others.
    """
    if method.estimator is None:
        return [(_reference(method, logs), 0)]
    return [
        (_angles(runs), sum(run.n_saturated for run in runs))
        for runs in _runs(method, logs, levels, params)
    ]


def _runs(
    method: Method,
    logs: Sequence[Record],
    levels: Sequence[str],
    params: dict[str, float] | None = None,
) -> list[list[Run]]:
    """Runs of each level over every log."""
    assert method.estimator is not None
    estimator = ESTIMATORS[method.estimator]()
    records = [feed(estimator, log).inputs for log in logs]
    params = _params(method) if params is None else params
    return run_forms(estimator, records, params=params, levels=levels)


def _angles(runs: Sequence[Run]) -> FloatArray:
    """Pitch, roll, heading [deg] of every run: (steps, runs, 3)."""
    names = ("pitch", "roll", "heading")
    return 180.0 * np.stack(
        [np.stack([run.outputs[name] for name in names], axis=-1) for run in runs], axis=1
    )


def _reference(method: Method, logs: Sequence[Record]) -> FloatArray:
    """Angles [deg] of a method that is no estimator of ours: (steps, runs, 3)."""
    views = [NineAxis.of(log) for log in logs]
    acc, mag, gyr = (
        np.stack([getattr(v, k) for v in views], axis=1) for k in ("acc", "mag", "gyr")
    )
    measured = mag_acc_angles(acc, mag, FIELD_UT)
    if method.key == "letter":
        measured = filter_to_the_letter(measured, gyr, float(views[0].dt[0]), KP, KI)
    return np.degrees(measured)


def count_mismatches(method: Method, log: Record) -> tuple[int, int]:
    """Updates in which C and the integer interpreter differ, and updates compared."""
    (expected,), (run,) = _runs(method, [log], ("fixed", "c"))
    assert run.words is not None and run.saturated is not None
    mismatches = (run.words != expected.words).any(axis=1) | (run.saturated != expected.saturated)
    return int(mismatches.sum()) + bool(expected.fault), len(mismatches)


def truth_deg(log: Record) -> FloatArray:
    """Pitch, roll, heading [deg] of the truth (steps, 3)."""
    return np.degrees(quaternion_to_euler(NineAxis.of(log).attitude))


def score(angles: FloatArray, logs: Sequence[Record]) -> FloatArray:
    """Error [deg] of the samples from t = 0 on: (steps - LEAD, runs, 3)."""
    truth = np.stack([truth_deg(log) for log in logs], axis=1)
    return np.degrees(wrap_rad(np.radians(angles - truth)))[LEAD:]
