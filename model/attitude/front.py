"""Programs that stand before the filters: from raw counts to the filters' input words, by name.

They are estimators without states: written once, run in float64, in integers, in C and on the core.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from boresight.model import ops
from boresight.model.attitude.table import params_of
from boresight.model.declarations import GRAVITY
from boresight.model.estimator import Estimator, Input, Output, Param, State
from boresight.model.words.rounded import sum_of

AXES = "xyz"


def counts(*names: str, unit: str = "counts") -> tuple[Input, ...]:
    """Inputs of 16-bit two's complement words; a converter has no others, so none is watched."""
    return tuple(Input(name, -32768.0, 32767.0, unit, clamp=True) for name in names)


def matrix_params(
    name: str, scale: float, limit: float, unit: str, meaning: str, of: str = "sensor"
) -> tuple[Param, ...]:
    """Nine parameters ``name_rc``: row r a body axis, column c a sensor axis; scale * identity."""
    return tuple(
        Param(
            f"{name}_{row}{column}",
            scale if row == column else 0.0,
            -limit,
            limit,
            unit,
            f"{meaning}: body axis {row} from {of} axis {column}",
        )
        for row in AXES
        for column in AXES
    )


def vector_params(name: str, limit: float, unit: str, meaning: str) -> tuple[Param, ...]:
    """Three parameters ``name_x`` to ``name_z``, zero by default."""
    return tuple(
        Param(f"{name}_{a}", 0.0, -limit, limit, unit, f"{meaning}, axis {a}") for a in AXES
    )


def rows(
    p: Any, name: str, vector: Sequence[Any], limit: float, *, bias: str | None = None
) -> list[Any]:
    """Matrix ``name`` of the parameters times a vector, less ``bias``, clamped to +-``limit``."""
    out = []
    for row in AXES:
        total = sum_of(
            getattr(p, f"{name}_{row}{c}") * v for c, v in zip(AXES, vector, strict=True)
        )
        if bias is not None:
            total = total - getattr(p, f"{bias}_{row}")
        out.append(ops.saturated(total, limit))
    return out


#: ADIS16385 at +-300 deg/s: 0.0125 deg/s and 0.25 mg per count (the maker's register map).
GYRO_SCALE = math.radians(0.0125)
ACC_SCALE = 0.25e-3 * GRAVITY

_MATRIX = "scale, misalignment and mounting"
STAMP_BITS = 32  #: bits of a time stamp: the counter of clock cycles wraps, and so does the word.
DT_LIMIT = 0.25  #: s, full scale of the time step.
GAP_S = 0.2499  #: s, longest time between two samples that is no gap.
LONG_GAP_S = 0.24  #: s, largest reported length of a gap.
GYRO_LIMIT = 64.0  #: rad/s, where rates are clamped.
ACC_LIMIT = 256.0  #: m/s^2, where specific forces are clamped.


class CalibrateInertial(Estimator):
    """Time step, rate and specific force from time stamp and raw counts.

    ::

        dt = tick_s (stamp - stamp before)      g = M_g c_g - b_g      a = M_a c_a - b_a

    The matrices hold scale, misalignment and mounting together: rows are body axes, columns
    sensor axes. The biases are in units of the result. Rate and force are clamped to the full scale
    of the filters' inputs. A negative ``restart`` gives a dt of -0.25 s, and a gap g of more than
    `GAP_S` since the sample before one of `GAP_S` - g, at least -`LONG_GAP_S`: below zero a filter
    restarts, or uses the gap's length.

    A stamp is a count of clock cycles modulo 2^32, taken for an angle: half a turn is 2^31 cycles.
    Words of fewer than 32 bits drop its lowest ones. Gaps are seen up to 2^32 cycles (43 s at
    100 MHz).
    """

    name = "calibrate_inertial"
    summary = "time stamp and raw gyro and accelerometer counts to SI words"
    inputs = (
        *counts(*(f"{s}{a}_counts" for s in "ga" for a in AXES)),
        Input("stamp", -1.0, 1.0, "ht"),
        Input("restart", -1.0, 0.0, ""),
    )
    params = (
        Param("tick_s", 1e-8, 1e-9, 9e-7, "s", "period of the clock that stamps count"),
        *matrix_params("gyro", GYRO_SCALE, 3.9e-3, "rad/s per count", _MATRIX),
        *vector_params("gyro_bias", 1.0, "rad/s", "subtracted from the rate, in body axes"),
        *matrix_params("acc", ACC_SCALE, 0.0624, "m/s^2 per count", _MATRIX),
        *vector_params("acc_bias", 16.0, "m/s^2", "subtracted from the force, in body axes"),
    )
    states = (State("before", -1.0, 1.0, "ht"),)
    outputs = (
        *(Output(f"g{a}", "rad/s") for a in AXES),
        *(Output(f"a{a}", "m/s^2") for a in AXES),
        Output("dt", "s"),
    )
    urgent = 0  # what counts is when the filter can begin: the length

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        out = {}
        for sensor, name, limit in (("g", "gyro", GYRO_LIMIT), ("a", "acc", ACC_LIMIT)):
            raw = [getattr(u, f"{sensor}{a}_counts") for a in AXES]
            for a, value in zip(AXES, rows(p, name, raw, limit, bias=f"{name}_bias"), strict=True):
                out[f"{sensor}{a}"] = value
        # Less half the range, so that the word's wrapping leaves [0, 2) half turns.
        since = ops.wrap_ht(u.stamp - x.before - 1.0)
        half = 2.0 ** (STAMP_BITS - 1)
        dt = ops.saturated(half * (p.tick_s * since) + half * p.tick_s, DT_LIMIT)
        in_time = ops.saturated(
            GAP_S - half * (p.tick_s * since) - half * p.tick_s + 4096.0 * u.restart, 1.0
        )
        late = ops.maximum(in_time, u.restart - LONG_GAP_S)
        out["dt"] = ops.saturated(ops.where(in_time < 0.0, late, dt), DT_LIMIT)
        return {"before": u.stamp}, out


FIELD_LIMIT = 256.0  #: uT, where fields are clamped.
#: uT per count: the HMR3300's example line is of the order of 4500 counts per gauss (inferred and
#: rough: calibrate; the heading needs ratios only).
FIELD_SCALE = 100.0 / 4500.0


class CalibrateField(Estimator):
    """Field in body axes from magnetometer counts, ``m = M (c - b)``.

    ``b`` is the hard iron in counts, ``M`` soft iron, scale, misalignment and mounting together:
    rows are body axes, columns sensor axes.
    """

    name = "calibrate_field"
    summary = "magnetometer counts to field words: hard and soft iron, mounting"
    inputs = counts(*(f"m{a}_counts" for a in AXES))
    params = (
        *matrix_params("field", FIELD_SCALE, 0.499, "uT per count", f"soft iron, {_MATRIX}"),
        *vector_params("field_bias", 32767.0, "counts", "hard iron, subtracted from the counts"),
    )
    states = ()
    outputs = tuple(Output(f"m{a}", "uT") for a in AXES)
    urgent = 3

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        raw = [getattr(u, f"m{a}_counts") - getattr(p, f"field_bias_{a}") for a in AXES]
        field = rows(p, "field", raw, FIELD_LIMIT)
        return {}, {f"m{a}": value for a, value in zip(AXES, field, strict=True)}


TENTH_HT = 1.0 / 1800.0  #: half turns in a tenth of a degree.


def _angle(name: str, scale: float, meaning: str) -> tuple[Param, Param]:
    return (
        Param(f"{name}_scale", scale, -9.7e-4, 9.7e-4, "ht per 0.1 deg", meaning),
        Param(f"{name}_offset_ht", 0.0, -1.0, 0.999, "ht", f"added to the {name}"),
    )


class CompassField(Estimator):
    """Equivalent field in body axes from a compass's heading, pitch and roll.

    By its angles the compass's attitude is ``C = Rz(psi) Rx(theta) Ry(gamma)``. The level field
    (north h, down v) in its axes is ``C^T (0, h, -v)``; a mounting matrix turns it from the
    compass's axes into the body's. Every filter then finds the compass's heading by its own tilt.

    Signs: compass headings run clockwise from north, psi counter-clockwise, so the scale of the
    heading is negative. Pitch and roll are taken as positive about x and y (nose up, right side
    down); which way a given compass counts is unverified: turn the sign of its scale.

    The vertical part is zero by default: then a small error of the compass's tilt does not turn
    the heading. The horizontal part is arbitrary, a field of usual strength.
    """

    name = "compass_field"
    summary = "compass heading, pitch and roll to the field that agrees with them"
    inputs = counts("heading_tenths", "pitch_tenths", "roll_tenths", unit="0.1 deg")
    params = (
        *params_of(
            """
            horizontal_ut 30 1 127 uT
                level part of the field; what counts is that filters do not take it for disturbed
            vertical_ut 0 -127 127 uT
                downward part of the field; other than 0 it lets the compass's tilt errors into the
                heading
            """
        ),
        *_angle("heading", -TENTH_HT, "negative: the compass counts clockwise"),
        *_angle("pitch", TENTH_HT, "positive: nose up is positive"),
        *_angle("roll", TENTH_HT, "positive: right side down is positive"),
        *matrix_params("mount", 1.0, 1.999, "", "mounting", of="compass"),
    )
    states = ()
    outputs = tuple(Output(f"m{a}", "uT") for a in AXES)
    urgent = 3

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        (sh, ch), (sp, cp), (sr, cr) = (
            ops.sincos_ht(
                ops.wrap_ht(
                    getattr(u, f"{name}_tenths") * getattr(p, f"{name}_scale")
                    + getattr(p, f"{name}_offset_ht")
                )
            )
            for name in ("heading", "pitch", "roll")
        )
        # Rz(-psi), then Rx(-theta), then Ry(-gamma) of (0, h, -v).
        east, north = p.horizontal_ut * sh, p.horizontal_ut * ch
        forward = ops.bounded(cp * north - sp * p.vertical_ut, -180.0, 180.0, "part of the field")
        up = ops.bounded(-(sp * north) - cp * p.vertical_ut, -180.0, 180.0, "part of the field")
        compass = (
            ops.bounded(cr * east - sr * up, -180.0, 180.0, "part of the field"),
            forward,
            ops.bounded(sr * east + cr * up, -180.0, 180.0, "part of the field"),
        )
        field = rows(p, "mount", compass, FIELD_LIMIT)
        return {}, {f"m{a}": value for a, value in zip(AXES, field, strict=True)}


FRONT: dict[str, type[Estimator]] = {
    e.name: e for e in (CalibrateInertial, CalibrateField, CompassField)
}


#: Full scale of the inertial sensor in counts, at any range: 300 deg/s and 5 g (the maker's).
GYRO_COUNTS, ACC_COUNTS = 24000, 20000
#: uT: full scale of the compass's magnetometer, 2 gauss (the maker's).
_FIELD = 200.0


@dataclass(frozen=True)
class Sensed:
    """An input that a sensor gives: its unit and the sensor's full scale.

    ``always``: with every sample; else the estimator declares its value in between
    (`Input.missing`).
    """

    unit: str
    low: float
    high: float
    always: bool = True


def _axes(letter: str, unit: str, limit: float, *, always: bool = True) -> dict[str, Sensed]:
    return {f"{letter}{a}": Sensed(unit, -limit, limit, always) for a in AXES}


#: By name. A ``dt`` below 0 restarts a filter; it is clamped where the filter's range excludes it.
SENSED = {
    "dt": Sensed("s", -DT_LIMIT, GAP_S),
    **_axes("g", "rad/s", GYRO_COUNTS * GYRO_SCALE),
    **_axes("a", "m/s^2", ACC_COUNTS * ACC_SCALE),
    **_axes("m", "uT", _FIELD, always=False),
}


def full_scale_params(
    params: Iterable[Param], *, rate: float | None = None, force: float | None = None
) -> dict[str, float]:
    """Values of those parameters that stand for a sensor's full scale.

    ``rate`` [rad/s] and ``force`` [m/s^2] are the full scales of gyro and accelerometer. A little
    less than that of each axis, since calibration moves it; of the force without gravity, which its
    mean holds. Values end at the limits of their parameters.
    """
    values = {}
    if rate is not None:
        values["gyro_most_sq"] = values["gyro_max_sq"] = 0.98 * 0.98 * rate * rate
    if force is not None:
        limit = 0.98 * force - GRAVITY
        values["force_most_sq"] = limit * limit
    return {q.name: min(max(values[q.name], q.low), q.high) for q in params if q.name in values}


def board_params(params: Iterable[Param]) -> dict[str, float]:
    """`full_scale_params` of the board's own sensors, with which every board has its estimators."""
    return full_scale_params(params, rate=SENSED["gx"].high, force=SENSED["ax"].high)
