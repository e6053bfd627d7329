"""PX4's flight logs, ``.ulg``, by pyulog: sensors and attitude as a nine-axis record.

Rows are those of ``sensor_combined``. PX4's body axes are front-right-down and its navigation axes
north-east-down; the record's are front-left-up and east-north-up. A sample of the magnetometer
stands in the first row at or after its own time stamp. The reference attitude is
``vehicle_attitude_groundtruth`` of a simulated flight, else ``vehicle_attitude``, PX4's own
estimate, interpolated to the times of the rows.
"""

from __future__ import annotations

import io
import struct
from contextlib import redirect_stdout
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.errors import InputError, ToolMissing
from boresight.sim.attitude.rotation import quaternion_multiply, quaternion_normalise
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Record, name_of

__all__ = ["parse_ulog"]

FloatArray = npt.NDArray[np.float64]

_SENSORS, _FIELD = "sensor_combined", "vehicle_magnetometer"
_ATTITUDES = ("vehicle_attitude_groundtruth", "vehicle_attitude")
#: Front-right-down to front-left-up, and its inverse.
_BODY = np.array([1.0, -1.0, -1.0])
#: North-east-down to east-north-up; front-left-up to front-right-down.
_NAVIGATION, _TURNED = (0.0, 0.5**0.5, 0.5**0.5, 0.0), (0.0, 1.0, 0.0, 0.0)
#: Seconds between two reference attitudes that are bridged.
_GAP_S = 0.1
_US, _UT = 1e-6, 100.0  # of microseconds, of gauss
_NO_SAMPLE = -(2**31)  # PX4's time stamp of a sensor that has none
#: First bytes, length of the header, and types of messages.
_MAGIC, _HEADER, _TYPES = b"ULog\x01\x12\x35", 16, b"BFIMPQADRLCSO"


def parse_ulog(path: Path, content: bytes) -> Record:
    """Parse a flight log.

    Raises
    ------
    InputError
        The content is none, or lacks the sensors; the message names the topic.
    ToolMissing
        pyulog is not installed.
    """
    try:
        read = import_module("pyulog").ULog
    except ImportError:
        raise ToolMissing(
            "pyulog was not found: pip install 'boresight[ulog]' for PX4's logs."
        ) from None
    try:
        with redirect_stdout(io.StringIO()):  # pyulog prints what it thinks of a file
            topics = read(io.BytesIO(_whole(content)), [_SENSORS, _FIELD, *_ATTITUDES]).data_list
        data = {topic.name: topic.data for topic in reversed(topics)}  # the first of several
        return _record(path, data)
    except InputError:
        raise
    except Exception as error:  # pyulog lets out whatever it meets in damaged bytes
        raise InputError.at(
            str(path),
            wanted="a flight log of PX4 (ULog)",
            found=f"damage: {' '.join(str(error).split())[:120] or type(error).__name__}",
            fix="download it again",
        ) from None


def _whole(content: bytes) -> bytes:
    """The content up to its last whole message: a log ends wherever the power failed.

    Raises
    ------
    ValueError
        It is no log, or there are bytes between the messages.
    """
    if not content.startswith(_MAGIC):
        raise ValueError("the first bytes are not those of a ULog")
    at = _HEADER
    while at + 3 <= len(content):
        size, kind = struct.unpack_from("<HB", content, at)
        if kind not in _TYPES:
            raise ValueError(f"no message begins at byte {at}")
        if at + 3 + size > len(content):
            break
        at += 3 + size
    return content[:at]


def _record(path: Path, data: dict[str, Any]) -> Record:
    sensors = _topic(path, data, _SENSORS)
    stamps = sensors["timestamp"].astype(np.int64)
    t = (stamps - stamps[0]) * _US
    gyr, acc = (_vectors(path, sensors, name) for name in ("gyro_rad", "accelerometer_m_s2"))
    mag = _field(path, data, stamps)
    q = next((_attitude(data[n], stamps) for n in _ATTITUDES if n in data), None)
    return NineAxis(name_of(path), t, gyr * _BODY, acc * _BODY, mag, q).record()


def _topic(path: Path, data: dict[str, Any], name: str) -> Any:
    if name not in data or not len(data[name]["timestamp"]):
        raise InputError.at(
            str(path),
            wanted=f"the topic {name}",
            found=", ".join(sorted(data)) or "none of the topics that are read",
            fix="record it: logger's profile for estimator replay has it",
        )
    return data[name]


def _vectors(path: Path, topic: Any, field: str, count: int = 3) -> FloatArray:
    names = [f"{field}[{k}]" for k in range(count)]
    if missing := [n for n in names if n not in topic]:
        raise InputError.at(
            str(path),
            wanted=f"a field {missing[0]} beside timestamp",
            found="none",
            fix="turn the log into CSV, and rename its columns",
        )
    return np.stack([topic[n].astype(np.float64) for n in names], axis=1)


def _field(path: Path, data: dict[str, Any], stamps: npt.NDArray[np.int64]) -> FloatArray:
    """Magnetic field in every row, uT; NaN in rows without a new sample."""
    topic, field = data.get(_FIELD), np.full((len(stamps), 3), np.nan)
    if topic is not None:
        own = topic.get("timestamp_sample", topic["timestamp"]).astype(np.int64)
    else:  # logs of 2018 and before
        topic = _topic(path, data, _SENSORS)
        relative = topic.get("magnetometer_timestamp_relative")
        if relative is None:
            topic = _topic(path, data, _FIELD)
        own = stamps + relative.astype(np.int64)
        new = (relative != _NO_SAMPLE) & (np.diff(own, prepend=own[0] - 1) != 0)
        topic, own = {n: values[new] for n, values in topic.items()}, own[new]
    rows = np.searchsorted(stamps, own)
    inside = rows < len(stamps)
    values = _UT * _BODY * _vectors(path, topic, "magnetometer_ga")
    field[rows[inside]] = values[inside]
    return field


def _attitude(topic: Any, stamps: npt.NDArray[np.int64]) -> FloatArray:
    """Reference in every row, front-left-up to east-north-up; NaN where there is none."""
    own = topic["timestamp"].astype(np.int64)
    q = np.stack([topic[f"q[{k}]"].astype(np.float64) for k in range(4)], axis=1)
    out = np.full((len(stamps), 4), np.nan)
    if len(own) < 2 or (np.diff(own) <= 0).any():
        return out
    # One sign from sample to sample, so that they can be interpolated.
    q[1:] *= np.cumprod(np.where((q[1:] * q[:-1]).sum(axis=1) < 0.0, -1.0, 1.0))[:, None]
    after = np.clip(np.searchsorted(own, stamps), 1, len(own) - 1)
    gap = own[after] - own[after - 1]
    share = ((stamps - own[after - 1]) / gap)[:, None]
    known = (share[:, 0] >= 0.0) & (share[:, 0] <= 1.0) & (gap * _US <= _GAP_S)
    between = (1.0 - share) * q[after - 1] + share * q[after]
    known &= np.abs(np.linalg.norm(between, axis=1) - 1.0) < 0.1
    turned = quaternion_normalise(between[known])
    out[known] = quaternion_multiply(quaternion_multiply(_NAVIGATION, turned), _TURNED)
    return out
