"""Calibration of gyro and accelerometer: time stamp and raw counts to the filters' input words."""

from __future__ import annotations

import math
from typing import Any

from boresight.model import ops
from boresight.model.attitude.front.affine import AXES, counts, matrix_params, rows, vector_params
from boresight.model.declarations import GRAVITY
from boresight.model.estimator import Estimator, Input, Output, Param, State

#: ADIS16385 at +-300 deg/s: 0.0125 deg/s and 0.25 mg per count (the maker's register map).
GYRO_SCALE = math.radians(0.0125)
ACC_SCALE = 0.25e-3 * GRAVITY

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
        *matrix_params(
            "gyro",
            GYRO_SCALE,
            3.9e-3,
            "rad/s per count",
            "scale, misalignment and mounting of the gyro",
        ),
        *vector_params("gyro_bias", 1.0, "rad/s", "subtracted from the rate, in body axes"),
        *matrix_params(
            "acc",
            ACC_SCALE,
            0.0624,
            "m/s^2 per count",
            "scale, misalignment and mounting of the accelerometer",
        ),
        *vector_params(
            "acc_bias", 16.0, "m/s^2", "subtracted from the specific force, in body axes"
        ),
    )
    states = (State("before", -1.0, 1.0, "ht"),)
    outputs = (
        *(Output(f"g{a}", "rad/s") for a in AXES),
        *(Output(f"a{a}", "m/s^2") for a in AXES),
        Output("dt", "s"),
    )
    urgent = 0  # what counts is when the filter can begin: the length

    def step(self, x: Any, u: Any, p: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        """One sample."""
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
