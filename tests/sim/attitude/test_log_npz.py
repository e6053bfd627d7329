"""`sim.attitude.log_npz`: archives in, archives out, and damage of any kind reported as such."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.attitude.log_npz import format_npz, parse_npz

PATH = Path("dir/a.npz")


def held(**changes: Any) -> dict[str, Any]:
    arrays: dict[str, Any] = {
        "t": np.arange(4) * 0.01,
        "gyr": np.arange(12.0).reshape(4, 3),
        "acc": -np.arange(12.0).reshape(4, 3),
        "mag": np.full((4, 3), 3.0),
    }
    arrays.update(changes)
    return {key: value for key, value in arrays.items() if value is not None}


def packed(**arrays: Any) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def test_round_trip_with_every_array() -> None:
    q = np.tile([0.0, 0.0, 1.0, 0.0], (4, 1))
    q[2] = np.nan
    arrays = held(q=q, mov=np.array([True, False, True, True]), fs=123.25)
    back = parse_npz(PATH, format_npz(arrays))
    assert sorted(back) == sorted(arrays)
    assert back["fs"] == 123.25
    assert back["mov"].dtype == np.bool_
    for key, value in arrays.items():
        np.testing.assert_array_equal(back[key], value)


def test_float32_and_foreign_arrays_are_taken() -> None:
    arrays = held(gyr=np.full((4, 3), 0.1, dtype=np.float32), other=np.array(["x"]))
    back = parse_npz(PATH, packed(**arrays))
    assert sorted(back) == ["acc", "gyr", "mag", "t"]
    assert back["gyr"].dtype == np.float64
    assert back["gyr"][0, 0] == np.float64(np.float32(0.1))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gyr": None}, r": wanted the arrays t, gyr, acc, mag, found none named gyr; .*"),
        ({"t": None, "mag": None}, r": wanted the arrays .*, found none named t or mag; .*"),
        ({"acc": np.zeros((3, 4))}, r", array acc: wanted shape \(4, 3\), .* found \(3, 4\); .*"),
        ({"gyr": np.full((4, 3), np.nan)}, r", gyr\[0, 0\]: wanted .* found no value; .*"),
        ({"t": np.array([0.0, 1.0, 1.0, 2.0])}, r", t\[2\]: wanted a time above 1\.0, .*"),
        ({"fs": 0.0}, r", fs: wanted one number above 0 \(Hz\), found 0\.0; .*"),
        ({"fs": np.array([1.0, 2.0])}, r", fs: wanted one number .*, found \[1\.0, 2\.0\]; .*"),
        ({"mov": np.zeros(3, bool)}, r", array mov: wanted shape \(4,\), .*, found \(3,\); .*"),
        ({"q": np.zeros((4, 4))}, r", q\[0, 0\]: wanted a quaternion of norm 1, found norm 0; .*"),
    ],
)
def test_faulty_arrays_are_named(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=rf"^dir/a\.npz{message}$"):
        parse_npz(PATH, packed(**held(**changes)))


UNREADABLE = r"^dir/a\.npz: wanted an \.npz archive of plain arrays, found something .*; write .*$"


def single_array() -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, np.zeros(3))
    return buffer.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"t,gx\n0,1\n",
        b"PK\x03\x04 and no more",
        single_array(),
        packed(**held(gyr=np.array([None, {}], dtype=object))),
        packed(**held())[:-40],
    ],
    ids=["empty", "text", "stub", "npy", "pickle", "cut"],
)
def test_what_is_no_archive_is_said_so(content: bytes) -> None:
    with pytest.raises(InputError, match=UNREADABLE):
        parse_npz(PATH, content)


def test_damaged_bytes_never_get_through_unreported() -> None:
    whole = format_npz(held())
    rng = np.random.default_rng(11)
    refused = 0
    for _ in range(400):
        damaged = bytearray(whole)
        at = int(rng.integers(len(damaged)))
        damaged[at] ^= 1 << int(rng.integers(8))
        try:
            back = parse_npz(PATH, bytes(damaged))
        except InputError:
            refused += 1
        else:
            # a bit that nothing depends on, such as a time stamp of the archive
            for key, value in held().items():
                np.testing.assert_array_equal(back[key], value)
    assert refused > 200
