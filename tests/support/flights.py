"""One flight as a log of PX4, and as bags of ROS with the same numbers."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

FORMATS = {
    "sensor_combined": "uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;",
    "vehicle_magnetometer": (
        "uint64_t timestamp;uint64_t timestamp_sample;float[3] magnetometer_ga;"
    ),
    "vehicle_attitude": "uint64_t timestamp;float[4] q;",
    "vehicle_attitude_groundtruth": "uint64_t timestamp;float[4] q;",
}
TURN = [0.8, 0.2, -0.4, 0.4]  # front-right-down to north-east-down


def message(kind: str, content: bytes) -> bytes:
    return struct.pack("<HB", len(content), ord(kind)) + content


#: Messages by topic: time stamps [us] and numbers.
Messages = Mapping[str, Sequence[tuple[int, Sequence[float]]]]


def at_rest() -> dict[str, list[tuple[int, Sequence[float]]]]:
    """Ten rows of 4 ms at rest, turned by TURN; a magnetometer at 1.5 and 5.5 rows."""
    rest = (0.1, 0.2, 0.3, 1.0, 2.0, -9.0)
    return {
        "sensor_combined": [(10_000 + 4000 * k, rest) for k in range(10)],
        "vehicle_magnetometer": [(10_000 + 4000 * k + 2000, (0.2, 0.1, 0.4)) for k in (1, 5)],
        "vehicle_attitude": [(12_000 + 8000 * k, [(-1) ** k * x for x in TURN]) for k in range(4)],
    }


def in_motion(rows: int) -> Messages:
    """Turns about all axes at 250 Hz, a field at 50 Hz, attitudes at 125 Hz; float32 numbers."""
    rng = np.random.default_rng(31)
    sensors = rng.normal([0, 0, 0.2, 0, 0, -9.81], [0.1, 0.1, 0.1, 0.3, 0.3, 0.3], (rows, 6))
    fields = rng.normal([0.2, 0.0, 0.45], 0.01, (rows // 5, 3))
    q = np.array(TURN) + rng.normal(0.0, 0.01, (rows // 2, 4))
    q /= np.linalg.norm(q, axis=1)[:, None]

    def stamped(step: int, first: int, table: npt.NDArray[Any]) -> Any:
        return [(first + step * k, row.astype(np.float32).tolist()) for k, row in enumerate(table)]

    return {
        "sensor_combined": stamped(4000, 10_000, sensors),
        "vehicle_magnetometer": stamped(20_000, 11_500, fields),
        "vehicle_attitude_groundtruth": stamped(8000, 10_500, q),
    }


def flight(*names: str, messages: Messages | None = None) -> bytes:
    """A log of PX4 with some topics, all by default."""
    messages = messages or at_rest()
    names = names or tuple(messages)
    out = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
    out += b"".join(message("F", f"{n}:{FORMATS[n]}".encode()) for n in names)
    for k, name in enumerate(names):
        out += message("A", struct.pack("<BH", 0, k) + name.encode())
    for k, name in enumerate(names):
        for stamp, numbers in messages[name]:
            # The recorded time of a field is later than its own.
            times = (stamp + 80_000, stamp) if name == "vehicle_magnetometer" else (stamp,)
            row = struct.pack(f"<{len(times)}Q{len(numbers)}f", *times, *numbers)
            out += message("D", struct.pack("<H", k) + row)
    return out


#: What a map says of a bag whose messages have PX4's numbers, axes and units.
AS_PX4 = """
extends = "ros"
[[source]]
columns = ["gx", "gy", "gz"]
topic = "/imu"
fields = "angular_velocity"
unit = "rad/s"
frame = "FRD"
[[source]]
columns = ["ax", "ay", "az"]
topic = "/imu"
fields = "linear_acceleration"
unit = "m/s^2"
frame = "FRD"
[[source]]
columns = ["mx", "my", "mz"]
type = "sensor_msgs/msg/MagneticField"
fields = "magnetic_field"
unit = "gauss"
frame = "FRD"
[[source]]
columns = ["qw", "qx", "qy", "qz"]
type = "geometry_msgs/msg/PoseStamped"
fields = "pose.orientation"
frame = "FRD to NED"
fill = "linear"
"""


def write_bag(path: Path, messages: Messages, *, as_px4: bool = False) -> Path:
    """A bag of standard messages: ``.bag``, ``.mcap``, ``.db3``, or a folder of the latter.

    In ROS's axes and units, or with PX4's numbers as they are (`AS_PX4`).
    """
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    one = path.suffix == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if one else Stores.LATEST)
    types = store.types
    body = np.array([1.0, 1.0, 1.0] if as_px4 else [1.0, -1.0, -1.0])
    half = 0.5**0.5

    def header(stamp: int) -> Any:
        time = types["builtin_interfaces/msg/Time"](stamp // 10**6, stamp % 10**6 * 1000)
        return types["std_msgs/msg/Header"](*([0] if one else []), time, "base")

    def vector(xyz: Any) -> Any:
        return types["geometry_msgs/msg/Vector3"](*(float(x) for x in xyz))

    def quaternion(w: float, x: float, y: float, z: float) -> Any:
        return types["geometry_msgs/msg/Quaternion"](x, y, z, w)

    def imu(stamp: int, row: Any) -> Any:
        none, turn = np.zeros(9), quaternion(0.0, 0.0, 0.0, 0.0)
        gyr, acc = (vector(body * x) for x in (row[:3], row[3:]))
        kind = types["sensor_msgs/msg/Imu"]
        return kind(header(stamp), turn, none, gyr, none, acc, none)

    def field(stamp: int, row: Any) -> Any:
        of = np.array(row) * (1.0 if as_px4 else 1e-4) * body
        return types["sensor_msgs/msg/MagneticField"](header(stamp), vector(of), np.zeros(9))

    def pose(stamp: int, row: Any) -> Any:
        w, x, y, z = row  # (0, h, h, 0) q (0, 1, 0, 0)*, by hand
        q = row if as_px4 else half * np.array([-w - z, -x - y, y - x, z - w])
        at = types["geometry_msgs/msg/Point"](0.0, 0.0, 0.0)
        turn = quaternion(*(float(c) for c in q))
        of = types["geometry_msgs/msg/Pose"](at, turn)
        return types["geometry_msgs/msg/PoseStamped"](header(stamp), of)

    kinds = {
        "sensor_combined": ("/imu", "sensor_msgs/msg/Imu", imu),
        "vehicle_magnetometer": ("/mag", "sensor_msgs/msg/MagneticField", field),
        "vehicle_attitude_groundtruth": ("/pose", "geometry_msgs/msg/PoseStamped", pose),
    }
    folder = path if path.suffix in ("", ".bag") else path.with_suffix("")
    plugin = StoragePlugin.MCAP if path.suffix == ".mcap" else StoragePlugin.SQLITE3
    writer = Writer1(folder) if one else Writer(folder, version=9, storage_plugin=plugin)
    with writer as bag:
        for name, rows in messages.items():
            topic, kind, make = kinds[name]
            connection = bag.add_connection(topic, kind, typestore=store)
            pack = store.serialize_ros1 if one else store.serialize_cdr
            recorded = 0
            for stamp, row in rows:
                recorded = max(recorded + 1, stamp * 1000 + 5)
                bag.write(connection, recorded, pack(make(stamp, row), kind))
    if folder != path:
        next(folder.glob(f"*{path.suffix}")).rename(path)
    return path
