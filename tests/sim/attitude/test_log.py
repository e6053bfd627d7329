"""`sim.attitude.log`: the record, its time step, and files of both kinds."""

import dataclasses
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.attitude.log import RESTART_S, Log, read_log, write_log
from boresight.sim.worlds.synthetic import SensorError, synthetic_log

ARRAYS = ("t", "gyr", "acc", "mag", "mag_new", "q", "mov")


def make(**changes: Any) -> Log:
    given: dict[str, Any] = {
        "name": "n",
        "t": np.array([0.0, 0.1, 0.3, 0.4]),
        "gyr": np.arange(12).reshape(4, 3),
        "acc": np.ones((4, 3), dtype=np.float32),
        "mag": np.ones((4, 3)),
        "mag_new": [True, False, True, False],
    }
    return Log(**{**given, **changes})


def noisy() -> Log:
    return synthetic_log(
        seconds=3.0, rate_hz=50.0, seed=3, mag_every=4, gyr_error=SensorError(noise=0.01)
    )


def assert_equal(one: Log, other: Log) -> None:
    for key in ARRAYS:
        a, b = getattr(one, key), getattr(other, key)
        if a is None or b is None:
            assert a is b, key
        else:
            assert a.dtype == b.dtype, key
            assert a.tobytes() == b.tobytes(), key
    assert one.fs == other.fs


def test_values_become_float64_copies() -> None:
    gyr = np.ones((4, 3))
    log = make(gyr=gyr)
    gyr[0] = 5
    assert log.gyr[0, 0] == 1
    assert log.acc.dtype == np.float64
    assert log.mag_new.dtype == np.bool_
    assert (log.q, log.mov, log.fs) == (None, None, None)
    assert len(log) == 4


def test_rows_without_a_new_field_are_nan() -> None:
    mag = np.ones((4, 3))
    mag[1, 0] = np.inf  # whatever a stale row holds
    np.testing.assert_array_equal(
        np.isnan(make(mag=mag).mag).all(axis=1), [False, True, False, True]
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"acc": np.ones((3, 3))}, r"array acc: wanted shape \(4, 3\), .* found \(3, 3\); .*"),
        ({"mag_new": [True] * 3}, r"array mag_new: wanted shape \(4,\), .* found \(3,\); .*"),
        ({"gyr": np.full((4, 3), np.inf)}, r"gyr\[0, 0\]: wanted .* found inf; .*"),
        ({"t": np.zeros(4)}, r"t\[1\]: wanted a time above 0\.0, .* found 0\.0; .*"),
        ({"mag": np.full((4, 3), np.nan)}, r"mag\[0, 0\]: .*mag_new is true, found no value; .*"),
        ({"fs": -1}, r"fs: wanted one number above 0 \(Hz\), found -1; .*"),
    ],
)
def test_faults_are_named_with_the_log(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=rf"^log 'n', {message}$"):
        make(**changes)


def test_dt_is_the_difference_of_times_and_starts_with_the_median() -> None:
    t = np.array([0.0, 0.1, 0.3, 0.4])
    np.testing.assert_array_equal(make().dt, [np.median(np.diff(t)), *np.diff(t)])


def test_dt_follows_a_given_rate() -> None:
    np.testing.assert_array_equal(make(fs=8).dt, [0.125] * 4)
    assert type(make(fs=8).fs) is float


def test_dt_of_a_single_sample_needs_a_rate() -> None:
    one: dict[str, Any] = {
        "t": [1.0],
        "gyr": np.zeros((1, 3)),
        "acc": np.zeros((1, 3)),
        "mag": np.zeros((1, 3)),
        "mag_new": [True],
    }
    np.testing.assert_array_equal(make(**one, fs=4.0).dt, [0.25])
    with pytest.raises(InputError, match=r"^log 'n': wanted two rows or more, .*, found one; .*$"):
        _ = make(**one).dt


@pytest.mark.parametrize("name", ["walk.csv", "walk.txt", "walk.npz", "walk.NPZ"])
def test_round_trip_is_exact(tmp_path: Path, name: str) -> None:
    log = noisy()
    write_log(tmp_path / name, log)
    back = read_log(str(tmp_path / name))
    assert back.name == "walk"
    assert_equal(back, log)
    binary = (tmp_path / name).read_bytes().startswith(b"PK")
    assert binary == name.lower().endswith(".npz")


def test_round_trip_of_npz_keeps_mov_and_fs(tmp_path: Path) -> None:
    log = dataclasses.replace(noisy(), mov=np.arange(150) % 2 == 0, fs=50.0)
    write_log(tmp_path / "a.npz", log)
    assert_equal(read_log(tmp_path / "a.npz"), log)


def test_restarts_are_kept_and_are_time_steps(tmp_path: Path) -> None:
    flags = np.arange(150) % 40 == 0
    log = dataclasses.replace(noisy(), restart=flags)
    write_log(tmp_path / "a.npz", log)
    again = read_log(tmp_path / "a.npz")
    assert again.restart is not None
    assert (again.restart == flags).all()
    assert (log.dt[flags] == RESTART_S).all()
    assert (log.dt[~flags] == noisy().dt[~flags]).all()


def test_csv_without_reference_reads_as_none(tmp_path: Path) -> None:
    log = dataclasses.replace(noisy(), q=None)
    write_log(tmp_path / "a.csv", log)
    assert "q" not in (tmp_path / "a.csv").read_text().splitlines()[0]
    assert_equal(read_log(tmp_path / "a.csv"), log)


@pytest.mark.parametrize(
    ("changes", "found"),
    [
        ({"fs": 50.0}, "fs"),
        ({"mov": [True] * 4}, "mov"),
        ({"restart": [True] * 4}, "restart"),
        ({"fs": 50.0, "mov": [True] * 4}, "mov and fs"),
    ],
)
def test_csv_refuses_what_it_would_lose(
    tmp_path: Path, changes: dict[str, Any], found: str
) -> None:
    with pytest.raises(InputError, match=rf"^.*a\.csv: wanted .*, found {found}; write .*$"):
        write_log(tmp_path / "a.csv", make(**changes))
    assert not (tmp_path / "a.csv").exists()


def test_magnetometer_may_never_be_new(tmp_path: Path) -> None:
    log = make(mag_new=[False] * 4)
    write_log(tmp_path / "a.csv", log)
    assert not read_log(tmp_path / "a.csv").mag_new.any()


@pytest.mark.parametrize("name", ["none.csv", "none.npz"])
def test_missing_file_is_named(tmp_path: Path, name: str) -> None:
    message = rf"^.*{name}: wanted a log file that .*, found no such file .*; check the path$"
    with pytest.raises(InputError, match=message):
        read_log(tmp_path / name)


def test_directory_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"^.*: wanted a log .*, found a folder; check .*$"):
        read_log(tmp_path)


def test_unwritable_place_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    message = r"^.*a\.csv: wanted a place that can be written, found not a directory; choose .*$"
    with pytest.raises(InputError, match=message):
        write_log(tmp_path / "file" / "a.csv", noisy())


def test_faults_carry_the_path(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t\n")
    (tmp_path / "a.npz").write_text("t\n")
    with pytest.raises(InputError, match=r"^/.*/a\.csv, line 1: wanted the columns .*$"):
        read_log(tmp_path / "a.csv")
    with pytest.raises(InputError, match=r"^/.*/a\.npz: wanted an \.npz archive .*$"):
        read_log(tmp_path / "a.npz")


def test_hundred_thousand_rows_are_quick(tmp_path: Path) -> None:
    log = synthetic_log(seconds=1000.0, rate_hz=100.0, seed=1, mag_every=10)
    write_log(tmp_path / "long.csv", log)
    start = time.process_time()
    back = read_log(tmp_path / "long.csv")
    # 0.7 s where this was written; the rest is room for a slower or busy machine
    assert time.process_time() - start < 3.0
    assert_equal(back, log)
