"""Sensors that say something wrong in good form: no reader sees it, the filter has to bear it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from boresight.model.declarations import GRAVITY
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record

__all__ = ["FULL_SCALE_G", "STRONGER", "WRONG_VALUES", "wronged"]

FloatArray = npt.NDArray[np.float64]
FULL_SCALE_G = 5.0  #: of the ADIS16385's accelerometer.
STRONGER = 3.0  #: times the Earth's field, that of a magnet beside the compass.


def _stuck(acc: FloatArray, mag: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.repeat(acc[:1], len(acc), axis=0), mag


def _saturated(acc: FloatArray, mag: FloatArray) -> tuple[FloatArray, FloatArray]:
    return np.column_stack([np.full(len(acc), FULL_SCALE_G * GRAVITY), acc[:, 1:]]), mag


def _strong(acc: FloatArray, mag: FloatArray) -> tuple[FloatArray, FloatArray]:
    size = STRONGER * np.nanmedian(np.linalg.norm(mag, axis=1))
    return acc, mag + [size, 0.0, 0.0]


#: By the device that has them: what becomes of the samples meanwhile.
WRONG_VALUES: dict[str, dict[str, Callable[..., tuple[FloatArray, FloatArray]]]] = {
    "adis": {"force_stuck": _stuck, "force_saturated": _saturated},
    "hmr": {"strong_field": _strong},
}


def wronged(record: Record, device: str, fault: str, rows: slice) -> Record:
    """A nine-axis record with some rows wrong in force or field."""
    log = NineAxis.of(record)
    acc, mag = log.acc.copy(), log.mag.copy()
    acc[rows], mag[rows] = WRONG_VALUES[device][fault](acc[rows], mag[rows])
    return replace(log, acc=acc, mag=mag).record()
