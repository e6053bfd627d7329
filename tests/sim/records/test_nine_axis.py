"""The nine-axis log as a record, and back."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.records.nine_axis import NineAxis
from boresight.sim.records.record import Column, Record

pytestmark = pytest.mark.pythons

NAN = float("nan")
T = np.array([0.0, 0.5, 1.5])
MAG = np.arange(9.0).reshape(3, 3) + 20
MAG[1] = NAN
Q = np.array([[1.0, 0, 0, 0], [NAN] * 4, [0, 0, 0.6, 0.8]])


def log(**more: Any) -> NineAxis:
    return NineAxis(
        "walk", T, np.arange(9.0).reshape(3, 3), np.arange(9.0).reshape(3, 3) + 10, MAG, **more
    )


def test_columns() -> None:
    found = log().record()
    assert list(found.columns) == [
        "t", "gx", "gy", "gz", "ax", "ay", "az", "mx", "my", "mz"
    ]  # fmt: skip
    values = {n: c.values.tolist() for n, c in found.columns.items()}
    assert values["gy"] == [1.0, 4.0, 7.0]
    assert values["az"] == [12.0, 15.0, 18.0]
    assert values["mx"][::2] == [20.0, 26.0] and np.isnan(values["mx"][1])
    assert found.name == "walk" and found.place(2, "gy") == "log 'walk', gy[2]"


def test_there_and_back() -> None:
    mov, steps = np.array([True, False, True]), np.array([0.75, -0.25, 1.0])
    back = NineAxis.of(log(q=Q, mov=mov, steps=steps).record())
    for key in ("t", "gyr", "acc", "mag"):
        assert np.array_equal(getattr(back, key), getattr(log(), key), equal_nan=True)
    assert np.array_equal(back.attitude, Q, equal_nan=True)
    assert back.counts.tolist() == mov.tolist() and back.dt.tolist() == steps.tolist()
    assert back.mag_new.tolist() == [True, False, True] and len(back) == 3
    plain = NineAxis.of(log().record())
    assert plain.dt.tolist() == log().dt.tolist() == [0.75, 0.5, 1.0]
    assert plain.counts.all() and plain.q is None
    with pytest.raises(InputError, match="^log 'walk': wanted a reference attitude, found none"):
        _ = plain.attitude


def test_other_units_and_names() -> None:
    columns = dict(log(q=Q).record().columns)
    columns |= {
        "t": Column(T * 1e3, "ms"),
        "gx": Column(np.array([180.0, 0.0, 90.0]), "deg/s"),
        "ay": Column(np.ones(3), "g0"),
        "mz": Column(np.array([0.5, NAN, 1.0]), "gauss"),
        **{f"{n}_true": columns.pop(n) for n in ("qw", "qx", "qy", "qz")},
    }
    found = NineAxis.of(Record("r", columns))
    assert found.t.tolist() == T.tolist()
    assert found.gyr[:, 0] == pytest.approx([np.pi, 0.0, np.pi / 2])
    assert found.acc[:, 1] == pytest.approx(9.80665)
    assert found.mag[::2, 2] == pytest.approx([50.0, 100.0])
    assert np.array_equal(found.attitude, Q, equal_nan=True)


@pytest.mark.parametrize(
    "change, message",
    [
        ({"gy": None}, "log 'walk': wanted the columns t,gx,gy,gz,ax,ay,az,mx,my,mz, found none "
         "named gy; add what is missing"),
        ({"t": None}, "log 'walk': wanted the columns t,gx,gy,gz,"),
        ({"ax": [0.0, NAN, 0.0]}, "log 'walk', ax[1]: wanted a number, found no value; complete "),
        ({"my": [0.0, NAN, NAN]}, "log 'walk', my[2]: wanted a number, or none in all of the row, "
         "found no value; "),
        ({"my": [0.0, 1.0, 0.0]}, "log 'walk', mx[1]: wanted a number, or none in all of the row"),
        ({"qz": [0.0, NAN, NAN]}, "log 'walk', qz[2]: wanted a number, or none in all of the row"),
        ({"qz": [0.0, NAN, 0.9]}, "log 'walk', qw[2]: wanted a quaternion of norm 1, found norm 1."
         "08167; correct it, or leave the whole quaternion out"),
    ],
)  # fmt: skip
def test_refused(change: dict[str, Any], message: str) -> None:
    columns = dict(log(q=Q).record().columns)
    for name, values in change.items():
        del columns[name]
        if values is not None:
            columns[name] = Column(np.array(values))
    record = Record("walk", columns, log().record().place)
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        NineAxis.of(record)
