"""Raw counts of a board's sensors."""

from __future__ import annotations

import numpy as np

from boresight.model.arrays import FloatArray
from boresight.model.attitude.front.compass_field import TENTH_HT
from boresight.model.attitude.front.field import FIELD_SCALE
from boresight.model.attitude.front.inertial import ACC_SCALE, GYRO_SCALE
from boresight.model.attitude.front.sensed import ACC_COUNTS, GYRO_COUNTS
from boresight.model.words.fixed import IntArray
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.rotations.rotation import quaternion_to_euler


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
