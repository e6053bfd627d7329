"""Accelerometer faults with wrong values in valid form, which the filter must survive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from boresight.model.declarations import GRAVITY
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record

__all__ = ["FULL_SCALE_G", "WRONG_VALUES", "wronged"]

FloatArray = npt.NDArray[np.float64]
FULL_SCALE_G = 5.0  #: of the ADIS16385's accelerometer.


def _stuck(acc: FloatArray) -> FloatArray:
    return np.repeat(acc[:1], len(acc), axis=0)


def _saturated(acc: FloatArray) -> FloatArray:
    return np.column_stack([np.full(len(acc), FULL_SCALE_G * GRAVITY), acc[:, 1:]])


#: Functions of the specific force during a fault.
WRONG_VALUES: dict[str, Callable[[FloatArray], FloatArray]] = {
    "force_stuck": _stuck,
    "force_saturated": _saturated,
}


def wronged(record: Record, fault: str, rows: slice) -> Record:
    """Return a nine-axis record with a fault in some rows."""
    log = NineAxis.of(record)
    acc = log.acc.copy()
    acc[rows] = WRONG_VALUES[fault](acc[rows])
    return replace(log, acc=acc).record()
