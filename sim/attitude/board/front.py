"""Conversion of records to the raw counts of a board's sensors."""

from __future__ import annotations

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.attitude.front.compass_field import TENTH_HT
from boresight.model.attitude.front.field import FIELD_SCALE
from boresight.model.attitude.front.inertial import ACC_SCALE, GYRO_SCALE, STAMP_BITS
from boresight.model.attitude.front.sensed import ACC_COUNTS, GYRO_COUNTS
from boresight.model.words.fixed import IntArray
from boresight.sim.attitude.board.chain import COUNTS, HEADING, NO_LINE, Samples
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record
from boresight.sim.rotations.rotation import quaternion_to_euler

__all__ = ["field_words", "heading_words", "inertial_words", "quantise"]


def quantise(
    record: Record,
    *,
    clock_hz: float = 100e6,
    kind: int = COUNTS,
    line_hz: float = 8.0,
    number: int = 0,
) -> Samples:
    """Return a nine-axis record as the data of an ADIS16385 and an HMR3300.

    Sensor axes are body axes. Rates and forces beyond the sensors' full scale are clamped there.

    Parameters
    ----------
    clock_hz : float
        Clock of the time stamps.
    kind : int
        Lines of the compass: `NO_LINE`, `COUNTS` (of the record's field) or `HEADING` (of its
        reference attitude).
    line_hz : float
        Maximum lines in a second.
    number : int
        Number of the filter.

    Raises
    ------
    InputError
        Headings of a record without reference attitude.
    """
    log = NineAxis.of(record)
    n = len(log)
    stamp = np.rint((log.t - log.t[0]) * clock_hz).astype(np.int64)
    has_sample = np.isfinite(log.attitude).all(axis=1) if kind == HEADING else log.mag_new
    line = np.full(n, NO_LINE)
    next_line = log.t[0]
    for k in np.flatnonzero(has_sample) if kind != NO_LINE else ():
        if log.t[k] >= next_line:
            line[k] = kind
            next_line = max(next_line + 1.0 / line_hz, log.t[k])
    values = np.zeros((n, 3), dtype=np.int64)
    rows = line != NO_LINE
    if kind == HEADING:
        values[rows] = heading_words(log.attitude[rows])
    elif kind == COUNTS:
        values[rows] = field_words(log.mag[rows])
    restart = np.zeros(n, dtype=np.bool_)
    restart[0] = True
    return Samples(
        stamp % (1 << STAMP_BITS), inertial_words(log), line, values, restart, np.full(n, number)
    )


def inertial_words(log: NineAxis, halvings: int = 0) -> IntArray:
    """Counts (n, 6) of gyro and accelerometer; +-300 deg/s is halved ``halvings`` times."""
    gyro = _counts(log.gyr, GYRO_SCALE / 2**halvings, GYRO_COUNTS)
    return np.column_stack([gyro, _counts(log.acc, ACC_SCALE, ACC_COUNTS)])


def field_words(mag: FloatArray) -> IntArray:
    """Counts (n, 3) of the compass for fields [uT]."""
    return _counts(mag, FIELD_SCALE, 32767)


def heading_words(q: FloatArray) -> IntArray:
    """Tenths of a degree (n, 3) of the compass for attitudes (n, 4): heading, pitch, roll."""
    pitch, roll, heading = quaternion_to_euler(q).T / np.pi
    angles = np.rint(np.stack([-heading, pitch, roll], axis=1) / TENTH_HT).astype(np.int64)
    angles[:, 0] %= 3600
    return angles


def _counts(value: FloatArray, scale: float, limit: int) -> IntArray:
    return np.clip(np.rint(value / scale), -limit, limit).astype(np.int64)
