"""Topics of recordings, by the libraries that read them, and maps from topics to columns.

PX4's flight logs, ``.ulg``, by pyulog. Bags of ROS 1 (``.bag``) and ROS 2 (a folder, ``.db3``), and
MCAP, by rosbags; the time of a message is its header's stamp, where it has one, else that of the
recorder. A map is a TOML file of tables ``[[source]]``, see `Source`.
"""

from __future__ import annotations

import io
import os
import struct
import tomllib
from collections.abc import Collection, Iterator, Mapping
from contextlib import redirect_stdout
from dataclasses import MISSING, dataclass, field, fields, is_dataclass
from functools import partial
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from boresight.model.arrays import IntArray
from boresight.model.declarations import QUATERNION
from boresight.model.errors import InputError
from boresight.model.tools.external import optional
from boresight.model.tools.reading import kind_of, opened, read_bytes

#: First bytes, length of the header, and types of messages.
_MAGIC, _HEADER, _TYPES = b"ULog\x01\x12\x35", 16, b"BFIMPQADRLCSO"
#: Whole messages that show where the log goes on behind damaged bytes.
_FOLLOWING = 8
#: Bytes of a message that is no sensor's (images, clouds), and numbers of an array.
_LARGE, _ARRAY = 1 << 14, 64
#: Nanoseconds of the units that times may have.
TIME_UNITS = {"s": 1e9, "ms": 1_000_000, "us": 1_000, "ns": 1}
_FILLS = ("none", "hold", "linear")


@dataclass(frozen=True, eq=False)
class Topic:
    """Messages of one name and type (``kind``), as recorded.

    ``stamps`` (n,) are their times [ns]; ``fields`` the numbers of each message, (n,), by the path
    to them: ``angular_velocity.x``, ``q[0]``.
    """

    name: str
    kind: str
    stamps: IntArray
    fields: Mapping[str, npt.NDArray[Any]]


@dataclass(frozen=True)
class Recording:
    """Topics of a file, and remarks about it."""

    topics: tuple[Topic, ...]
    notes: tuple[str, ...] = ()


def _damage(path: Path, wanted: str, error: Exception, fix: str) -> InputError:
    """The error of a file whose library raised another one, of any kind."""
    found = " ".join(str(error).split())[:120] or type(error).__name__
    return InputError.at(str(path), wanted=wanted, found=f"damage: {found}", fix=fix)


def read_ulog(path: Path, wanted: Collection[str] | None = None) -> Recording:
    """Topics of a flight log; of several instances of one, all but the first have a number."""
    content = read_bytes(path, "a log file that can be read")
    read = optional("pyulog").ULog
    notes = []
    try:
        complete, lost, is_cut = _complete_messages(content)
        if is_cut:
            notes.append(f"{path.name} ends in the middle of a message, the rows before are read")
        with redirect_stdout(io.StringIO()):  # pyulog prints remarks
            log = read(io.BytesIO(complete), None if wanted is None else list(wanted))
        if lost or log.file_corruption:
            told = [f"{lost} bytes are left out"] * bool(lost)
            told += ["rows may be missing from the damage on"] * log.file_corruption
            notes.append(f"{path.name}: damaged, {', and '.join(told)}")
        topics: dict[str, Topic] = {}
        for data in log.data_list:
            name = f"{data.name}.{data.multi_id}" if data.name in topics else data.name
            stamps = data.data["timestamp"].astype(np.int64) * 1000
            topics[name] = Topic(name, name, stamps, data.data)
    except Exception as error:  # pyulog raises exceptions of any kind for damaged bytes
        raise _damage(path, "a flight log of PX4 (ULog)", error, "download it again") from None
    return Recording(tuple(topics.values()), tuple(notes))


def _complete_messages(content: bytes) -> tuple[bytes, int, bool]:
    """The whole messages, how many bytes between them are none, and whether the last one is cut.

    A log ends wherever the power failed, and a bad sector damages its middle. A message that is
    followed by no other is damaged, too: bytes of it were changed or lost.
    """
    if not content.startswith(_MAGIC):
        raise ValueError("the first bytes are not those of a ULog")
    parts, offset, lost = [content[:_HEADER]], _HEADER, 0
    while offset + 3 <= len(content):
        end = _message_end(content, offset)
        if end is not None and end <= len(content):
            parts.append(content[offset:end])
            offset = end
            continue
        places = range(offset, len(content) - 2)
        following = next((k for k in places if _begins(content, k)), len(content))
        if end is not None and following == len(content):
            break  # cut, not damaged
        lost += following - offset + (len(parts.pop()) if len(parts) > 1 else 0)
        offset = following
    is_cut = offset < len(content) and (not lost or offset + 3 <= len(content))
    return b"".join(parts), lost, is_cut


def _message_end(content: bytes, offset: int) -> int | None:
    """Where the message that begins here ends; None if none does."""
    size, kind = struct.unpack_from("<HB", content, offset)
    return offset + 3 + size if kind in _TYPES else None


def _begins(content: bytes, offset: int) -> bool:
    """Whether several whole messages follow from here, up to the end."""
    for _ in range(_FOLLOWING):
        if offset + 3 > len(content):
            return offset == len(content)
        end = _message_end(content, offset)
        if end is None:
            return False
        offset = end
    return offset <= len(content)


def read_bag(path: Path, wanted: Collection[str] | None = None) -> Recording:
    """Topics of a bag, all or those of some names or types."""
    reader = optional("rosbags.highlevel").AnyReader
    types = optional("rosbags.typesys")
    if not os.path.isdir(path):
        with opened(path, "a log file that can be read"):
            pass
    series: dict[str, _Series] = {}
    fault: Exception | None = None
    try:
        store = types.get_typestore(types.Stores.LATEST)  # for bags that do not define their types
        with reader([path], default_typestore=store) as bag:
            chosen = [
                c for c in bag.connections if wanted is None or {c.topic, c.msgtype} & {*wanted}
            ]
            for c in chosen:
                series.setdefault(c.topic, _Series(str(c.topic), str(c.msgtype)))
            for c, stamp, raw in bag.messages(chosen) if chosen else ():
                large = len(raw) > _LARGE
                series[c.topic].take(stamp, None if large else bag.deserialize(raw, c.msgtype))
    except Exception as error:  # rosbags raises exceptions of any kind for damaged bytes
        fault = error
    if fault is not None and not any(s.stamps for s in series.values()):
        wanted = "a bag of ROS 1 or 2, or MCAP with messages of ROS"
        fix = "record it again, or repair it (rosbag reindex, mcap recover)"
        raise _damage(path, wanted, fault, fix) from None
    notes = () if fault is None else (f"{path.name}: damaged, only the messages before are read",)
    return Recording(tuple(s.topic() for s in series.values()), notes)


class _Series:
    """Messages of one topic."""

    def __init__(self, name: str, kind: str) -> None:
        self.name, self.kind = name, kind
        self.stamps: list[np.int64] = []
        self._leaves: list[tuple[str, int]] | None = None
        self._rows: list[tuple[Any, ...]] = []

    def take(self, stamp: int, message: Any) -> None:
        """Take a message; None of a large one, of which only the time counts."""
        time = np.int64(stamp)  # raises for a damaged stamp
        if message is not None:
            if self._leaves is None:
                self._leaves = [*_leaves(message)]
                # Of one path attrgetter gives no tuple.
                self._get = attrgetter(*(p for p, _ in self._leaves), "__class__", "__class__")
            self._rows.append(self._get(message))
        self.stamps.append(time)

    def topic(self) -> Topic:
        """Fields as arrays; those of changing size are left out."""
        stamps, fields = np.array(self.stamps, dtype=np.int64), dict[str, Any]()
        columns = [*zip(*self._rows, strict=True)] if len(self._rows) == len(stamps) else []
        for (path, size), column in zip(self._leaves or (), columns, strict=False):
            if size and all(len(x) == size for x in column):
                table = np.array(column)
                fields |= {f"{path}[{k}]": table[:, k] for k in range(size)}
            elif not size:
                fields[path] = np.array(column)
        sec, rest = fields.get("header.stamp.sec"), fields.get("header.stamp.nanosec")
        if sec is not None and rest is not None and (sec.any() or rest.any()):
            stamps = sec.astype(np.int64) * 1_000_000_000 + rest.astype(np.int64)
        return Topic(self.name, self.kind, stamps, fields)


def _leaves(message: Any, prefix: str = "") -> Iterator[tuple[str, int]]:
    """Paths to numbers and to short arrays of them, with their size; 0 of a number."""
    for part in fields(message):
        path, value = f"{prefix}{part.name}", getattr(message, part.name)
        if part.name.isupper():  # a constant of the message
            continue
        if is_dataclass(value):
            yield from _leaves(value, f"{path}.")
        elif isinstance(value, bool | int | float):
            yield path, 0
        elif isinstance(value, np.ndarray) and 0 < value.size <= _ARRAY:
            yield path, value.size


@dataclass(frozen=True)
class Source:
    """Source of columns, from a topic of this name, or else with messages of this type.

    Of several sources of the same columns the first that the recording has counts. ``fields`` has
    one for each column, or the path to a vector of them; ``scale`` are factors. ``frame`` is as FRD
    or FRD to NED; "geodetic" of latitude, longitude and altitude, which become east, north and up
    of the first fix; or "none".
    ``time`` is the field with the time of a sample, ``delay`` one that is added to the recorded
    time, both in ``time_unit``. ``fill`` are the values of rows between samples: none, hold, or
    linear (true values). ``covariance`` is a field that is -1 in messages without a sample, as ROS
    has it. A source may be ``optional``, or another device's estimate (``comparison``).
    """

    columns: tuple[str, ...]
    fields: tuple[str, ...]
    topic: str = ""
    type: str = ""
    unit: str = ""
    frame: str = ""
    scale: tuple[float, ...] = field(default=(), repr=False)
    time: str = ""
    delay: str = ""
    time_unit: str = ""
    fill: str = "none"
    covariance: str = ""
    optional: bool = False
    comparison: bool = False

    @property
    def label(self) -> str:
        """Name or type of the topic."""
        return self.topic or self.type


_RATES, _FORCE, _FIELD = (tuple(f"{sensor}{axis}" for axis in "xyz") for sensor in "gam")
_POSITION, _VELOCITY = (tuple(f"gnss_{kind}{axis}" for axis in "enu") for kind in "pv")


def _px4() -> tuple[Source, ...]:
    """PX4's flight logs. Body axes are front-right-down, the navigation frame north-east-down."""
    imu = partial(Source, topic="sensor_combined", frame="FRD")
    field = partial(Source, _FIELD, ("magnetometer_ga",), unit="gauss", frame="FRD")
    gnss = partial(Source, topic="vehicle_gps_position", optional=True)
    attitude = partial(Source, QUATERNION, ("q",), frame="FRD to NED", fill="linear", optional=True)
    late, degrees = "magnetometer_timestamp_relative", ("latitude_deg", "longitude_deg")
    return (
        imu(_RATES, ("gyro_rad",), unit="rad/s"),
        imu(_FORCE, ("accelerometer_m_s2",), unit="m/s^2"),
        field("vehicle_magnetometer", time="timestamp_sample", time_unit="us"),
        field("vehicle_magnetometer"),  # versions 1.9 to 1.11
        field("sensor_combined", delay=late, time_unit="us"),  # logs of 2018 and before
        gnss(_POSITION, (*degrees, "altitude_msl_m"), frame="geodetic"),
        # before version 1.14
        gnss(_POSITION, ("lat", "lon", "alt"), frame="geodetic", scale=(1e-7, 1e-7, 1e-3)),
        gnss(_VELOCITY, ("vel_n_m_s", "vel_e_m_s", "vel_d_m_s"), unit="m/s", frame="NED"),
        attitude("vehicle_attitude_groundtruth"),  # of a simulated flight
        attitude("vehicle_attitude", comparison=True),  # PX4's own estimate
    )


def _ros() -> tuple[Source, ...]:
    """ROS's standard messages, by their type.

    Body axes are front-left-up, the navigation frame is east-north-up (REP 103, REP 145).
    """

    def imu(columns: tuple[str, ...], field: str, **more: Any) -> Source:
        covariance = f"{field}_covariance[0]"
        return Source(columns, (field,), type="sensor_msgs/msg/Imu", covariance=covariance, **more)

    def of(kind: str, columns: tuple[str, ...], *fields: str, **more: Any) -> Source:
        return Source(columns, fields, type=kind, optional=True, **more)

    attitude = {"frame": "FLU to ENU", "fill": "linear"}
    place = ("latitude", "longitude", "altitude")
    return (
        imu(_RATES, "angular_velocity", unit="rad/s", frame="FLU"),
        imu(_FORCE, "linear_acceleration", unit="m/s^2", frame="FLU"),
        of("sensor_msgs/msg/MagneticField", _FIELD, "magnetic_field", unit="tesla", frame="FLU"),
        of("sensor_msgs/msg/NavSatFix", _POSITION, *place, frame="geodetic"),
        of("geometry_msgs/msg/TwistStamped", _VELOCITY, "twist.linear", unit="m/s", frame="ENU"),
        of("geometry_msgs/msg/PoseStamped", QUATERNION, "pose.orientation", **attitude),
        of("nav_msgs/msg/Odometry", QUATERNION, "pose.pose.orientation", **attitude),
        imu(QUATERNION, "orientation", optional=True, comparison=True, **attitude),  # its own
    )


#: Maps that are ready, by name.
READY = {"px4": _px4(), "ros": _ros()}


def read_map(path: str | Path) -> tuple[Source, ...]:
    """The sources of a file; an InputError names the source by its number, from 1."""
    content = read_bytes(path, "a map that can be read")
    try:
        data = tomllib.loads(content.decode())
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        fix, found = "correct the file", str(error)[:120]
        raise InputError.at(str(path), wanted="a map in TOML", found=found, fix=fix) from None
    extends, tables = data.pop("extends", None), data.pop("source", None)
    if data or not isinstance(tables, list) or not tables or extends not in (None, *READY):
        wanted = f"tables [[source]], and perhaps extends = {' or '.join(map(repr, READY))}"
        found = ", ".join([*data, *["extends"] * (extends is not None)]) or "no source"
        fix = "see the page on flight logs and bags"
        raise InputError.at(str(path), wanted=wanted, found=found, fix=fix)
    sources = tuple(_source(f"{path}, source {k + 1}", table) for k, table in enumerate(tables))
    names = {source.columns for source in sources}
    inherited = () if extends is None else READY[extends]
    return sources + tuple(source for source in inherited if source.columns not in names)


def _source(where: str, table: Any) -> Source:
    def need(good: object, wanted: str, found: str) -> None:
        if not good:
            raise InputError.at(where, wanted=wanted, found=found, fix="correct the map")

    need(isinstance(table, dict), "a table", kind_of(table))
    kinds = {f.name: (str(f.type), f.default is MISSING) for f in fields(Source)}
    for name in table:
        need(name in kinds, f"keys {', '.join(kinds)}", name)
    values = {name: _value(f"{where}, {name}", kinds[name][0], v) for name, v in table.items()}
    for name, (_, is_required) in kinds.items():
        need(values.get(name) or not is_required, f"a key {name}", "none")
    made = Source(**values)
    count, frame, is_attitude = len(made.columns), made.frame, " to " in made.frame
    both = "both" if made.topic else "neither"
    need(bool(made.topic) != bool(made.type), "topic or type", both)
    is_complete = len(made.fields) in (1, count) and len(made.scale) in (0, 1, count)
    need(is_complete, f"{count} fields, one for each column", str(len(made.fields)))
    need(frame or count < 2, "a frame, for example FRD or FRD to NED (none: no vector)", "none")
    is_vector = frame in ("", "none") or count == (4 if is_attitude else 3)
    need(is_vector, f"columns for the frame {frame}", ", ".join(made.columns))
    has_unit = "unit" in table or is_attitude or frame == "geodetic"
    need(has_unit, "a unit, since the file tells none ('': a plain number)", "none")
    need(made.fill in _FILLS, f"fill {', '.join(_FILLS)}", repr(made.fill))
    is_timed = made.time_unit in TIME_UNITS or not (made.time or made.delay)
    need(is_timed, f"time_unit {', '.join(TIME_UNITS)}", repr(made.time_unit))
    return made


def _value(where: str, kind: str, value: Any) -> Any:
    """A value of TOML as one of a source; a text or a number stands for a list of one."""
    types: tuple[type, ...] = (str,) if "str" in kind else (int, float)
    wanted = {"str": "a text", "bool": "true or false"}.get(kind)
    if wanted is None:
        items = value if isinstance(value, list) else [value]
        wanted = "texts" if "str" in kind else "numbers"
        good = items and all(isinstance(x, types) and not isinstance(x, bool) for x in items)
        value = tuple(items) if good else value
    else:
        good = isinstance(value, str if kind == "str" else bool)
    if not good:
        raise InputError.at(where, wanted=wanted, found=kind_of(value), fix="correct the map")
    return value
