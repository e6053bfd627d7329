"""Flight logs of PX4; bags of ROS 1 and 2 and MCAP, with the same numbers; what is refused."""

from __future__ import annotations

import json
import re
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores, get_typestore

from boresight.cli import main
from boresight.model.errors import InputError
from boresight.model.settings import using
from boresight.sim.records.assembly import record_from
from boresight.sim.records.files import log_files, read_record
from boresight.sim.records.record import Record
from boresight.sim.records.recordings import READY, Recording, Topic
from boresight.sim.records.selection import Selection
from boresight.sim.rotations.rotation import rotate
from tests.support.flights import AS_PX4, TURN, at_rest, flight, in_motion, write_bag

KINDS = ("a.bag", "a.mcap", "a.db3", "bag")
MOTION = in_motion(400)
_ROWS = MOTION["sensor_combined"]
#: A step back, a time twice, a gap.
ODD = {**MOTION, "sensor_combined": [*_ROWS[:100], _ROWS[50], *_ROWS[99:300], *_ROWS[340:]]}


def mapped(path: Path, text: str = AS_PX4) -> Record:
    (path.parent / "map.toml").write_text(text)
    with using(rows=Selection.of(map=path.parent / "map.toml")):
        return read_record(path)


@pytest.mark.parametrize("name", KINDS)
def test_a_bag_is_the_flight_log_of_the_same_numbers(tmp_path: Path, name: str) -> None:
    (tmp_path / "a.ulg").write_bytes(flight(messages=MOTION))
    log = read_record(tmp_path / "a.ulg")
    same = mapped(write_bag(tmp_path / name, MOTION, as_px4=True))
    assert [*same.columns] == [*log.columns] and not same.notes and len(log) == 400
    for column in log.columns:
        unit = log.columns[column].unit or ""
        a, b = (record.values(column, unit) for record in (log, same))
        assert np.array_equal(a, b, equal_nan=True), column
        assert np.isfinite(a).sum() >= 79


def test_ros_has_axes_and_units_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "a.ulg").write_bytes(flight(messages=MOTION))
    log, bag = read_record(tmp_path / "a.ulg"), read_record(write_bag(tmp_path / "bag", MOTION))
    for column in log.columns:
        unit = {"m": "uT", "g": "rad/s", "a": "m/s^2"}.get(column[0], "")
        a, b = (record.values(column, unit) for record in (log, bag))
        if column[0] == "q":
            sign = np.sign(log.columns["qw"].values * bag.columns["qw"].values)
            b = b * sign
        np.testing.assert_allclose(a, b, rtol=1e-6, atol=1e-7, equal_nan=True)
    assert log_files([tmp_path]) == [tmp_path / "a.ulg", tmp_path / "bag"]
    assert log_files([tmp_path / "bag"]) == [tmp_path / "bag"]


def test_verbs_print_the_same_figures(tmp_path: Path, capsys) -> None:
    (tmp_path / "map.toml").write_text(AS_PX4)
    (tmp_path / "ulog").mkdir()
    (tmp_path / "ulog" / "a.ulg").write_bytes(flight(messages=MOTION))
    texts = []
    for path in (tmp_path / "ulog" / "a.ulg", write_bag(tmp_path / "a.mcap", MOTION, as_px4=True)):
        more = [] if path.suffix == ".ulg" else ["--map", str(tmp_path / "map.toml")]
        assert main(["accuracy", "complementary", str(path), *more, "--json"]) == 0
        texts.append(json.loads(capsys.readouterr().out)["estimators"])
    assert texts[0] == texts[1] and texts[0][0]["mean"]


def test_topics_are_listed(tmp_path: Path, capsys) -> None:
    (tmp_path / "a.ulg").write_bytes(flight(messages=MOTION))
    assert main(["info", str(tmp_path / "a.ulg")]) == 0
    out = capsys.readouterr().out
    rows = [line.split() for line in out.splitlines()]
    assert ["sensor_combined", "400", "250", "0", "0", "1.596", "0", "0.004", "0", "0"] in rows
    assert ["vehicle_magnetometer", "magnetometer_ga[0..2]", "gauss", "(FRD)"] in rows, out
    assert main(["info", str(write_bag(tmp_path / "b.mcap", ODD))]) == 0
    out = capsys.readouterr().out
    rows = [line.split() for line in out.splitlines()]
    assert ["/imu", "362", "250", "0", "0", "1.596", "1", "0.164", "1", "1"] in rows
    assert ["/imu", "angular_velocity.x", "rad/s", "(FLU)"] in rows


def test_odd_times_are_counted(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "a.mcap", ODD)
    record = read_record(path)
    assert len(record) == 360 and {*record.notes} == {
        "gaps in the times: 1, longest 0.164 s",
        "/imu: messages that repeat the one before, left out: 1",
        "/imu: messages with a time far from those around them, left out: 1",
        "/mag: 7 samples dropped, a newer one falls into the same row",
    }
    with using(rows=Selection.of(gaps="restart")):
        record = read_record(path)
    assert np.flatnonzero(record.columns["dt"].values < 0).tolist() == [300]
    assert "gaps in the times, where the filter restarts: 1, the longest of 0.164 s" in record.notes
    refused = pytest.raises(InputError, match=r"t\[300\]: wanted steps .* a gap of 0\.164 s")
    with using(rows=Selection.of(gaps="refuse")), refused:
        read_record(path)


def shifted(rows: list[Any], seconds: Callable[[int], float]) -> list[Any]:
    """Messages whose times are others."""
    return [(t + round(1e6 * seconds(k)), *rest) for k, (t, *rest) in enumerate(rows)]


@pytest.mark.parametrize(
    ("topic", "seconds", "rows", "note"),
    [
        ("sensor_combined", lambda k: 3600.0 * (k == 200), 399, "/imu: messages with a time far "
         "from those around them, left out: 1"),
        ("sensor_combined", lambda k: 0.006 * (k == 200), 400, "/imu: messages out of order, "
         "sorted: 1"),
        ("sensor_combined", lambda k: 0.004 * (3 - k % 4), 400, "/imu: messages that share a time "
         "with others, spread over the step: 300"),
        ("vehicle_magnetometer", lambda k: 1.0, 400, "/mag: samples before or after those of "
         "/imu, left out: "),
    ],
)  # fmt: skip
def test_odd_times_lose_nothing_without_a_count(
    tmp_path: Path, topic: str, seconds: Callable[[int], float], rows: int, note: str
) -> None:
    made = {**MOTION, topic: shifted(MOTION[topic], seconds)}
    record = read_record(write_bag(tmp_path / "a.mcap", made))
    assert len(record) == rows and any(text.startswith(note) for text in record.notes)


@pytest.mark.parametrize("name", ["a.ulg", "a.bag", "a.mcap", "a.db3"])
def test_a_topic_without_a_value_in_any_row_is_told(tmp_path: Path, name: str) -> None:
    made = {n: list(rows) for n, rows in in_motion(100).items()}
    truth, field = "vehicle_attitude_groundtruth", "vehicle_magnetometer"
    made[truth] = [(t + 10**9, q) for t, q in made[truth]]
    made[field] = [(t, [np.nan] * 3) for t, _ in made[field]]
    path = tmp_path / name
    if name == "a.ulg":
        path.write_bytes(flight(messages=made))
    else:
        write_bag(path, made)
    told = [text.partition(": ")[2] for text in read_record(path).notes]
    assert [text.partition(" than")[0] for text in told] == [
        "its 20 messages hold no number",
        "its 50 messages are at other times",
    ]


def test_a_clock_of_another_time_is_refused(tmp_path: Path) -> None:
    for seconds in (2.0**32 * 1e-6, -(2.0**32) * 1e-6):
        moved = shifted(MOTION["vehicle_magnetometer"], lambda k, s=seconds: s)
        path = write_bag(
            tmp_path / f"{seconds:.0f}.mcap", {**MOTION, "vehicle_magnetometer": moved}
        )
        with pytest.raises(InputError, match="/mag: wanted samples at the times of /imu, found no"):
            read_record(path)
    back = shifted(MOTION["sensor_combined"], lambda k: -5.0 * (k > 199))
    path = write_bag(tmp_path / "back.mcap", {**MOTION, "sensor_combined": back})
    with pytest.raises(InputError, match="message 200: wanted times that rise, found a clock that"):
        read_record(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("/imu", "/imv"), "wanted the topic /imv, found /imu"),
        (('"angular_velocity"', '"angular_velocty"'), "angular_velocty, found .*angular_velocity"),
        (('unit = "gauss"\n', ""), "source 3: wanted a unit, since the file tells none"),
        (('unit = "gauss"', 'unit = "gaus"'), "wanted a unit that converts to uT, found gaus"),
        (('frame = "FRD"\n', ""), "source 1: wanted a frame"),
        (('frame = "FRD"', 'frame = "FRU"'), "three letters .* found 'FRU'"),
        (("extends", "extend"), "tables .*source.*found extend"),
        (("fields", "field"), "source 1: wanted keys .*found field"),
        (("[[source]]", "[source"), "wanted a map in TOML"),
    ],
)
def test_a_wrong_map_is_one_line(tmp_path: Path, change, message: str, capsys) -> None:
    path = write_bag(tmp_path / "a.mcap", MOTION, as_px4=True)
    (tmp_path / "map.toml").write_text(AS_PX4.replace(*change))
    args = ["run", "complementary", str(path), "--map", str(tmp_path / "map.toml")]
    assert main([*args, "-o", str(tmp_path / "out.csv")]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and not (tmp_path / "out.csv").exists()
    assert re.search(message, lines[0]), lines


def test_two_topics_of_a_type_need_a_name(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "bag", MOTION)
    store = get_typestore(Stores.LATEST)
    with AnyReader([path]) as bag, Writer(tmp_path / "two", version=9) as twice:
        for name in ("/imu", "/imu_raw"):
            c = twice.add_connection(name, "sensor_msgs/msg/Imu", typestore=store)
            for _, stamp, raw in bag.messages([x for x in bag.connections if x.topic == "/imu"]):
                twice.write(c, stamp, raw)
    with pytest.raises(
        InputError, match="wanted one topic of sensor_msgs/msg/Imu for gx, found /imu, /imu_raw"
    ):
        read_record(tmp_path / "two")
    assert len(mapped(tmp_path / "two", AS_PX4.split('[[source]]\ncolumns = ["mx')[0])) == 400


@pytest.mark.parametrize(
    "change", ["update topics set name=7, type=7", "update messages set timestamp='x'"]
)
def test_other_types_in_a_database_are_one_line(tmp_path: Path, change: str) -> None:
    """SQLite holds any type in any column."""
    path = write_bag(tmp_path / "a.db3", {"sensor_combined": at_rest()["sensor_combined"]})
    with sqlite3.connect(path) as connection:
        connection.execute(change)
    connection.close()
    with pytest.raises(InputError, match=r"a\.db3: wanted a"):
        read_record(path)


def test_topics_become_a_nine_axis_record(tmp_path: Path) -> None:
    (tmp_path / "flight.ulg").write_bytes(flight())
    record = read_record(tmp_path / "flight.ulg")
    columns = {name: column.values for name, column in record.columns.items()}
    assert record.name == "flight"
    assert columns["t"] == pytest.approx(0.004 * np.arange(10))
    first = [columns[n][0] for n in ("gx", "gy", "gz", "ax", "ay", "az")]
    assert first == pytest.approx([0.1, -0.2, -0.3, 1.0, -2.0, 9.0])
    assert np.flatnonzero(~np.isnan(columns["mx"])).tolist() == [2, 6]
    assert [record.values(n, "uT")[2] for n in ("mx", "my", "mz")] == pytest.approx(
        [20.0, -10.0, -40.0]
    )
    known = ~np.isnan(columns["qw"])
    assert np.flatnonzero(known).tolist() == list(range(1, 7))  # between two of them
    q = np.stack([columns[f"q{c}"][known] for c in "wxyz"], axis=1)
    for body in np.eye(3):
        n, e, d = rotate(np.array(TURN), body * [1.0, -1.0, -1.0])  # the same vector in PX4's axes
        assert rotate(q, np.tile(body, (len(q), 1))) == pytest.approx(
            np.tile([e, n, -d], (len(q), 1)), abs=1e-6
        )


@pytest.mark.parametrize("name", ["sensor_combined", "vehicle_magnetometer"])
def test_a_missing_topic_is_named(tmp_path: Path, name: str) -> None:
    (tmp_path / "a.ulg").write_bytes(flight(*(n for n in at_rest() if n != name)))
    with pytest.raises(InputError, match=f"a.ulg: wanted the topic {name}, found .*attitude"):
        read_record(tmp_path / "a.ulg")


@pytest.mark.parametrize("first", [3, 10])
def test_messages_before_the_first_sample_of_a_slow_sensor_have_none(first: int) -> None:
    """PX4's logs of 2018 and before: the delay is the largest int32 while there is no sample."""
    rows, names = np.arange(10), ("gyro_rad", "accelerometer_m_s2", "magnetometer_ga")
    fields: dict[str, Any] = {f"{name}[{k}]": np.ones(10) for name in names for k in range(3)}
    delays = np.where(rows < first, 2**31 - 1, 0).astype(np.int32)
    fields["magnetometer_timestamp_relative"] = delays
    topic = Topic("sensor_combined", "sensor_combined", rows * 4_000_000, fields)

    def read(path: Path, wanted: Any) -> Recording:
        return Recording((topic,), ())

    if first < 10:
        record = record_from(Path("a.ulg"), read, READY["px4"])
        assert np.isnan(record.columns["mx"].values).tolist() == [True] * 3 + [False] * 7
    else:
        with pytest.raises(InputError, match="wanted magnetometer_ga for mx, found no sample in"):
            record_from(Path("a.ulg"), read, READY["px4"])


def test_a_log_that_ends_early_has_the_rows_before(tmp_path: Path) -> None:
    """The power fails in the middle of a message."""
    (tmp_path / "whole.ulg").write_bytes(flight("vehicle_magnetometer", "sensor_combined"))
    content = (tmp_path / "whole.ulg").read_bytes()
    (tmp_path / "cut.ulg").write_bytes(content[:-50])
    whole, cut = (read_record(tmp_path / f"{name}.ulg") for name in ("whole", "cut"))
    assert (len(whole), len(cut)) == (10, 8)
    assert whole.notes == () and "ends in the middle of a message" in cut.notes[0]


@pytest.mark.parametrize(
    ("removed", "put"),
    [(1, b""), (0, b"\x00\x01\x02"), (600, b"\xff" * 600), (600, bytes(600)), (1, b"\xff")],
)
def test_damage_in_the_middle_leaves_the_rows_around_it(
    tmp_path: Path, removed: int, put: bytes
) -> None:
    """Bytes lost, inserted, overwritten; and a size that reaches beyond the end."""
    content = flight(messages=MOTION)
    middle = content.index(b"D\x00\x00", len(content) // 2) - 1 + (len(put) != 1) * 9
    (tmp_path / "a.ulg").write_bytes(content)
    (tmp_path / "b.ulg").write_bytes(content[:middle] + put + content[middle + removed :])
    whole, damaged = (read_record(tmp_path / f"{name}.ulg") for name in "ab")
    assert len(whole) - 30 < len(damaged) < len(whole)
    assert any("b.ulg: damaged, " in text for text in damaged.notes)
    times = damaged.numbers("t")
    kept = np.isin(whole.numbers("t"), times)
    assert kept.sum() == len(damaged)
    assert np.array_equal(whole.numbers("gx")[kept], damaged.numbers("gx"))
