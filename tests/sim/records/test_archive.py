"""Archives: columns by array, the nine-axis form, steps of rate and restarts."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.records.archive import format_npz, parse_npz
from boresight.sim.records.record import Column, Record

pytestmark = pytest.mark.pythons

PATH = Path("walk.npz")
T = np.array([0.0, 0.5, 0.75, 1.75])


def packed(**arrays: Any) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


def parsed(**arrays: Any) -> dict[str, Column]:
    found = parse_npz(PATH, packed(**arrays))
    assert found.name == "walk"
    return dict(found.columns)


def test_round_trip() -> None:
    held = {
        "t": Column(T, "s"),
        "nan": Column(np.array([np.nan, -0.0, 5e-324, 1e308])),
        "k": Column(np.arange(4.0), ""),
    }
    found = parse_npz(PATH, format_npz(Record("r", held)))
    assert list(found.columns) == list(held)
    for name, column in held.items():
        assert found.columns[name].values.tobytes() == column.values.tobytes()
        assert found.columns[name].unit == column.unit
    assert found.place(2, "k") == "walk.npz, k[2]"


def test_nine_axis_form() -> None:
    gyr, acc, mag = (np.arange(12.0).reshape(4, 3) + 100 * k for k in range(3))
    q = np.arange(16.0).reshape(4, 4)
    found = parsed(t=T, gyr=gyr, acc=acc, mag=mag, q=q)
    assert list(found) == [
        "t", "gx", "gy", "gz", "ax", "ay", "az", "mx", "my", "mz", "qw", "qx", "qy", "qz"
    ]  # fmt: skip
    assert found["gz"].values.tolist() == [2.0, 5.0, 8.0, 11.0]
    assert found["ax"].values.tolist() == [100.0, 103.0, 106.0, 109.0]
    assert found["my"].values.tolist() == [201.0, 204.0, 207.0, 210.0]
    assert found["qw"].values.tolist() == [0.0, 4.0, 8.0, 12.0]
    assert found["qz"].values.tolist() == [3.0, 7.0, 11.0, 15.0]


def test_a_column_may_have_the_name_of_a_triple() -> None:
    assert parsed(q=[1.0, 2.0])["q"].values.tolist() == [1.0, 2.0]


def test_steps() -> None:
    restart = [False, False, True, False]
    assert "dt" not in parsed(t=T)
    assert parsed(t=T, fs=8)["dt"].values.tolist() == [0.125] * 4
    assert parsed(t=T, fs=8.0, restart=restart)["dt"].values.tolist() == [
        0.125,
        0.125,
        -0.25,
        0.125,
    ]
    # The first is the median of 0.5, 0.25, 1.
    assert parsed(t=T, restart=restart)["dt"].values.tolist() == [0.5, 0.5, -0.25, 1.0]
    assert parsed(t=T, restart=[1, 0, 0, 0])["dt"].values.tolist() == [-0.25, 0.5, 0.25, 1.0]
    assert set(parsed(t=T, fs=8, restart=restart)) == {"t", "dt"}


@pytest.mark.parametrize(
    "arrays, message",
    [
        ({}, "walk.npz: wanted arrays, found an empty archive; store one array per column"),
        ({"gyr": np.zeros((4, 4))}, "walk.npz, array gyr: wanted shape (n, 3), found (4, 4); stor"),
        ({"q": np.zeros((4, 3))}, "walk.npz, array q: wanted shape (n, 4), found (4, 3); "),
        ({"acc": np.zeros((1, 4, 3))}, "walk.npz, array acc: wanted shape (n, 3), found (1, 4, 3)"),
        ({"z": np.zeros((4, 3))}, "walk.npz, column z: wanted real numbers, shape (n,), found "),
        ({"t": T, "gx": T, "gyr": np.zeros((4, 3))}, "walk.npz: wanted every column once, found gx "
         "alone and in an array of several columns; keep one of them"),
        ({"gyr": np.zeros((4, 3)), "gz": T}, "walk.npz: wanted every column once, found gz alone"),
        ({"gyr": np.zeros((4, 3)), "gz[deg/s]": T}, "walk.npz: wanted every column once, found two "
         "named gz; "),
        ({"fs": 8.0, "z": T}, "walk.npz: wanted t, and no dt, beside fs or restart, found z; give"),
        ({"fs": 8.0, "t": T, "dt": T}, "walk.npz: wanted t, and no dt, beside fs or restart, found "
         "t, dt; "),
        ({"fs": 8.0, "t": 1.0}, "walk.npz, column t: wanted real numbers, shape (n,), found "
         "float64, shape (); "),
        ({"restart": [False], "t": ["a"]}, "walk.npz, column t: wanted real numbers, shape (n,)"),
        ({"fs": 0.0, "t": T}, "walk.npz, fs: wanted one number above 0 (Hz), found 0.0; correct "),
        ({"fs": np.nan, "t": T}, "walk.npz, fs: wanted one number above 0 (Hz), found nan; "),
        ({"fs": np.inf, "t": T}, "walk.npz, fs: wanted one number above 0 (Hz), found inf; "),
        ({"fs": [8.0], "t": T}, "walk.npz, fs: wanted one number above 0 (Hz), found [8.0]; "),
        ({"fs": "8", "t": T}, "walk.npz, fs: wanted one number above 0 (Hz), found '8'; "),
        ({"restart": [True], "t": T}, "walk.npz, array restart: wanted truth values, shape (4,), "
         "found bool, shape (1,); store one for each sample"),
        ({"restart": np.zeros(4), "t": T}, "walk.npz, array restart: wanted truth values, shape "
         "(4,), found float64, shape (4,); "),
        ({"restart": [True], "t": [1.0]}, "walk.npz: wanted two rows or more, for a time step, "
         "found one; "),
        ({"t": T[::-1]}, "walk.npz, t[1]: wanted a time above 1.75, that of the row before, found "
         "0.75; "),
        ({"z": np.array([1.0, np.inf])}, "walk.npz, z[1]: wanted a finite number, found an infin"),
        ({"z": np.array([None])}, "walk.npz: wanted an .npz archive of plain arrays, found a fi"),
    ],
)  # fmt: skip
def test_refused(arrays: Any, message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        parsed(**arrays)


def array_alone() -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, T)
    return buffer.getvalue()


@pytest.mark.parametrize("content", [b"", b"t,z\n1,2\n", array_alone(), packed(t=T)[:-40]])
def test_what_is_no_archive(content: bytes) -> None:
    with pytest.raises(
        InputError,
        match=r"^walk\.npz: wanted an \.npz archive of plain arrays, found a file that cannot "
        r"be read as one; write it with numpy\.savez; a CSV log must not be named \.npz$",
    ):
        parse_npz(PATH, content)
