"""The estimators of the experiment, with the paper's settings, in float64 and in fixed point."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from boresight.firmware.build import CModel
from boresight.firmware.floating.build import FloatCModel
from boresight.firmware.floating.precision import DOUBLE
from boresight.model.declarations import GRAVITY
from boresight.model.estimator import Estimator, FloatArray, input_words, with_params
from boresight.model.estimators import ESTIMATORS
from boresight.model.estimators.complementary import per_sample_gains
from boresight.model.words.program import Program
from boresight.sim.attitude.ma2014 import KI, KP, TABLE_2
from boresight.sim.attitude.rotation import quaternion_to_euler, wrap_rad
from boresight.sim.experiments.ma2014.letter import filter_to_the_letter, mag_acc_angles
from boresight.sim.experiments.ma2014.world import AVERAGED, FIELD_UT, LEAD, LOOP_HZ
from boresight.sim.records.feed import feed
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.sim.records.segments import interpret

__all__ = [
    "METHODS",
    "Method",
    "count_mismatches",
    "gains_per_s",
    "kalman_parameters",
    "run_fixed",
    "run_float",
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
    Method(
        "ekf_quaternion_vector",
        "Kalman filter, vectors measured",
        "ekf_quaternion_vector",
        "kalman",
    ),
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
    """The paper's settings in the parameters of the method's estimator."""
    assert method.estimator is not None
    if method.key.startswith("gyro"):
        return gains_per_s((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    if method.estimator.startswith("complementary"):
        return gains_per_s()
    return kalman_parameters(method.estimator)


def kalman_parameters(name: str) -> dict[str, float]:
    """Table 2 in the parameters of a quaternion EKF, by what it calls them.

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
    known = {
        "scale": 64.0,
        "p0_sd": 0.01,
        **dict(zip(("field_east", "field_north", "field_up"), FIELD_UT, strict=True)),
    }
    for k, axis in enumerate("xyz"):
        known[f"gyro_sd_{axis}"] = math.sqrt(TABLE_2.gyro[k])
        known[f"angle_sd_{axis}"] = (pitch, roll, heading)[k]
        known[f"acc_sd_{axis}"] = acc[k]
        known[f"mag_sd_{axis}"] = mag[k]
    return {p.name: max(known[p.name], p.low) for p in ESTIMATORS[name].params if p.name in known}


def _records(estimator: Estimator, logs: Sequence[Record]) -> FloatArray:
    """(steps, n_inputs, runs)."""
    return np.stack([feed(estimator, log).inputs for log in logs], axis=-1)


def _angles(outputs: dict[str, Any]) -> FloatArray:
    """Pitch, roll, heading [deg]."""
    return 180.0 * np.stack([outputs[k] for k in ("pitch", "roll", "heading")], axis=-1)


def run_float(method: Method, logs: Sequence[Record]) -> FloatArray:
    """Angles [deg] of every log, float64, estimators compiled from C: (steps, runs, 3)."""
    if method.estimator is not None:
        estimator = ESTIMATORS[method.estimator]()
        model = FloatCModel(estimator, precision=DOUBLE, params=_params(method))
        runs = []
        for records in np.moveaxis(_records(estimator, logs), 2, 0):
            model.reset()
            runs.append(model.update(records))
        found = np.stack(runs, axis=-1)
        return _angles({o.name: found[:, k] for k, o in enumerate(estimator.outputs)})
    views = [NineAxis.of(log) for log in logs]
    acc, mag, gyr = (
        np.stack([getattr(v, k) for v in views], axis=1) for k in ("acc", "mag", "gyr")
    )
    measured = mag_acc_angles(acc, mag, FIELD_UT)
    if method.key == "letter":
        measured = filter_to_the_letter(measured, gyr, float(views[0].dt[0]), KP, KI)
    return np.degrees(measured)


def program_of(method: Method, params: dict[str, float] | None = None) -> Program:
    """The fixed-point program with the paper's settings (or others)."""
    assert method.estimator is not None
    estimator = ESTIMATORS[method.estimator]()
    return with_params(
        estimator.compile(), estimator, _params(method) if params is None else params
    )


def run_fixed(
    method: Method, logs: Sequence[Record], *, params: dict[str, float] | None = None
) -> tuple[FloatArray, int]:
    """Angles [deg] of every log in fixed point (C model), and the number of saturated updates."""
    program = program_of(method, params)
    estimator = ESTIMATORS[method.estimator or ""]()
    words = input_words(program, _records(estimator, logs))
    model = CModel(program)
    columns = [program.output_names.index(k) for k in ("pitch", "roll", "heading")]
    formats = [program.format(program.outputs[k]) for k in columns]
    out = np.empty((len(words), len(logs), 3))
    saturated = 0
    for run in range(len(logs)):
        model.reset()
        y, flags = model.update(words[:, :, run])
        saturated += int(flags.sum())
        for axis, (column, form) in enumerate(zip(columns, formats, strict=True)):
            out[:, run, axis] = 180.0 * form.real(y[:, column])
    return out, saturated


def count_mismatches(method: Method, log: Record) -> tuple[int, int]:
    """Updates in which C and the integer interpreter differ, and updates compared."""
    program = program_of(method)
    estimator = ESTIMATORS[method.estimator or ""]()
    words = input_words(program, _records(estimator, [log]))[:, :, 0]
    run = interpret(program, words)
    y, flags = CModel(program).update(words)
    wrong = (y != run.outputs).any(axis=1) | (flags != run.saturated)
    return int(wrong.sum()) + int(run.broken_at is not None), len(words)


def truth_deg(log: Record) -> FloatArray:
    """Pitch, roll, heading [deg] of the truth (steps, 3)."""
    return np.degrees(quaternion_to_euler(NineAxis.of(log).attitude))


def score(angles: FloatArray, logs: Sequence[Record]) -> FloatArray:
    """Error [deg] of the samples from t = 0 on: (steps - LEAD, runs, 3)."""
    truth = np.stack([truth_deg(log) for log in logs], axis=1)
    return np.degrees(wrap_rad(np.radians(angles - truth)))[LEAD:]
