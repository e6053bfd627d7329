"""Logs with attitude as records."""

from __future__ import annotations

from typing import Any

import numpy as np

from boresight.sim.attitude.log import Log
from boresight.sim.records.nine_axis import record_of
from boresight.sim.records.record import Column, Record


def log(**more: Any) -> Log:
    return Log(
        "walk",
        t=np.array([0.0, 0.5, 1.5]),
        gyr=np.arange(9.0).reshape(3, 3),
        acc=np.arange(9.0).reshape(3, 3) + 10,
        mag=np.arange(9.0).reshape(3, 3) + 20,
        mag_new=np.array([True, False, True]),
        **more,
    )


def test_columns() -> None:
    found = record_of(log())
    assert list(found.columns) == [
        "t", "dt", "gx", "gy", "gz", "ax", "ay", "az", "mx", "my", "mz"
    ]  # fmt: skip
    values = {n: c.values.tolist() for n, c in found.columns.items()}
    assert values["dt"] == [0.75, 0.5, 1.0]
    assert values["gy"] == [1.0, 4.0, 7.0]
    assert values["az"] == [12.0, 15.0, 18.0]
    assert values["mx"][::2] == [20.0, 26.0] and np.isnan(values["mx"][1])
    assert found.name == "walk" and found.place(2, "gy") == "log 'walk', gy[2]"


def test_truth_restarts_and_what_counts() -> None:
    q = np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 0.6, 0.8]])
    found = record_of(log(q=q, mov=np.array([True, False, True]), restart=np.array([0, 1, 0])))
    values = {n: c.values.tolist() for n, c in found.columns.items()}
    assert values["qw"] == [1.0, 0.0, 0.0] and values["qz"] == [0.0, 0.0, 0.8]
    assert values["mov"] == [1.0, 0.0, 1.0]
    assert values["dt"] == [0.75, -0.25, 1.0]


def test_other_data() -> None:
    made = Record("r", {"z": Column(np.zeros(1))})
    assert record_of(made) is made
    assert record_of({"z": [1.0]}).columns["z"].values.tolist() == [1.0]
