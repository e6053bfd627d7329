"""Values in valid form that the filter must survive: wrong forces, and a turn that is too fast."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from boresight.model.attitude.front.inertial import GYRO_SCALE
from boresight.model.attitude.front.sensed import GYRO_COUNTS
from boresight.model.declarations import GRAVITY
from boresight.sim.attitude.worlds.fast_turn import RAMP_S, fast_turn
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record

FULL_SCALE_G = 5.0  #: of the ADIS16385's accelerometer.
#: Rate of a fast turn in full scales of the gyro, and how long it is at full scale [s].
BEYOND, FULL_SCALE_S = 1.1, 0.1
#: s, with rise and fall.
TURN_S = FULL_SCALE_S + 2.0 * RAMP_S / BEYOND


def _stuck(log: NineAxis, rows: slice) -> NineAxis:
    acc = log.acc.copy()
    acc[rows] = acc[rows.start]
    return replace(log, acc=acc)


def _saturated(log: NineAxis, rows: slice) -> NineAxis:
    acc = log.acc.copy()
    acc[rows, 0] = FULL_SCALE_G * GRAVITY
    return replace(log, acc=acc)


def _turn_fault(axis: int) -> Callable[[NineAxis, slice], NineAxis]:
    """The sensor really turns beyond its gyro's full scale, from the first row on."""
    rate = BEYOND * GYRO_COUNTS * GYRO_SCALE * np.eye(3)[axis]

    def fault(log: NineAxis, rows: slice) -> NineAxis:
        begin_s = float(log.t[rows.start])
        return fast_turn(log, begin_s=begin_s, rate_rad_s=rate, seconds=TURN_S - 2.0 * RAMP_S)

    return fault


#: Fast turns about each axis: no fault of a device, and the truth turns too.
FAST_TURNS = {f"fast_turn_{name}": _turn_fault(axis) for axis, name in enumerate("xyz")}
#: Functions that put each fault into some rows of a log.
WRONG_VALUES: dict[str, Callable[[NineAxis, slice], NineAxis]] = {
    "force_stuck": _stuck,
    "force_saturated": _saturated,
    **FAST_TURNS,
}


def wronged(record: Record, fault: str, rows: slice) -> Record:
    """Return a nine-axis record with a fault in some rows; a fast turn has its own length."""
    return WRONG_VALUES[fault](NineAxis.of(record), rows).record()
