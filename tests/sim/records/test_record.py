"""Records: what they refuse, what they are made of, headers with units."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.records.record import Column, Record, columns_of, index_place, split_header

pytestmark = pytest.mark.pythons

NAN = float("nan")


def record(**columns: list[float]) -> Record:
    return Record("r", {n: Column(np.array(v, dtype=np.float64)) for n, v in columns.items()})


class Table:
    """What pandas and polars have in common: ``columns`` and ``data[column]``."""

    def __init__(self, **columns: Any) -> None:
        self._held, self.columns = columns, list(columns)

    def __getitem__(self, name: str) -> Any:
        return self._held[name]


@pytest.mark.parametrize(
    "columns, message",
    [
        ({}, "record 'r': wanted columns with one value for each sample, at least one, found no "),
        ({"a": []}, "record 'r': wanted columns with one value for each sample, at least one, "
         "found lengths [0]; give every column the same number of values"),
        ({"a": [1.0], "b": [1.0, 2.0]}, "record 'r': wanted columns with one value for each "
         "sample, at least one, found lengths [1, 2]; "),
        ({"a": [1.0, 2.0], "b": [NAN, float("inf")]}, "record, b[1]: wanted a finite number, found "
         "an infinite one; correct or remove the row"),
        ({"a": [-float("inf")]}, "record, a[0]: wanted a finite number"),
        ({"t": [0.0, NAN, NAN]}, "record, t[1]: wanted a time in every row, found no value; "),
        ({"t": [0.0, 2.0, 2.0, 1.0]}, "record, t[2]: wanted a time above 2.0, that of the row "
         "before, found 2.0; sort the rows and remove repeated ones"),
        ({"t": [0.0, 1.0, 0.5]}, "record, t[2]: wanted a time above 1.0, that of the row before, "
         "found 0.5; "),
    ],
)  # fmt: skip
def test_refused(columns: Any, message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        record(**columns)


def test_gaps_and_other_columns_may_fall() -> None:
    made = record(t=[0.0, 0.5, 0.75], z=[NAN, 2.0, 1.0])
    assert len(made) == 3
    assert np.isnan(made.columns["z"].values[0])


def test_head() -> None:
    whole = Record(
        "r",
        {"z": Column(np.arange(3.0), "m"), "w": Column(np.arange(3.0) + 5.0)},
        lambda row, column: f"{column} of {row}",
    )
    assert whole.head(None) is whole.head(3) is whole.head(9) is whole
    cut = whole.head(2)
    assert (cut.name, len(cut)) == ("r", 2)
    assert cut.columns["w"].values.tolist() == [5.0, 6.0]
    assert (cut.columns["z"].unit, cut.columns["w"].unit) == ("m", None)
    assert cut.place(1, "z") == "z of 1"


def test_a_head_keeps_the_steps_of_the_whole() -> None:
    """The first step, which nothing precedes, is the median of all, not of those that are left."""
    whole = Record("r", {"t": Column(np.array([0.0, 4.0, 5.0, 6.0, 7.0]) * 1e3, "ms")})
    assert whole.steps().tolist() == [1.0, 4.0, 1.0, 1.0, 1.0]
    assert whole.head(2).steps().tolist() == [1.0, 4.0]
    assert whole.head(1).steps().tolist() == [1.0]
    own = Record("r", {**whole.columns, "dt": Column(np.full(5, 500.0), "ms")})
    assert own.steps().tolist() == [0.5] * 5 == [*own.head(4).steps().tolist(), 0.5]


def test_values_in_a_unit() -> None:
    made = Record("r", {"a": Column(np.array([2.0]), "km"), "b": Column(np.array([3.0]))})
    assert made.values("a", "m").tolist() == [2000.0] and made.values("b", "m").tolist() == [3.0]
    assert made.values("a", "bits") is made.columns["a"].values
    message = (
        "log 'r', column a: wanted a unit that converts to s, found km (km is not s); correct "
    )
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        made.values("a", "s")


def test_of_mappings_tables_and_structured_arrays() -> None:
    structured = np.array([(0, 1.5), (1, 2.5)], dtype=[("n", "i4"), ("z[deg/s]", "f4")])
    for data in (
        {"n": [0, 1], "z[deg/s]": np.array([1.5, 2.5], dtype=np.float32)},
        Table(**{"n": [0, 1], "z[deg/s]": (1.5, 2.5)}),
        structured,
    ):
        made = Record.of(data, name="mine")
        assert made.name == "mine" and list(made.columns) == ["n", "z"]
        assert [c.unit for c in made.columns.values()] == [None, "deg/s"]
        assert made.columns["z"].values.tolist() == [1.5, 2.5]
        assert made.columns["n"].values.dtype == np.float64
        assert made.place(1, "z") == "mine, z[1]"


def test_of_records() -> None:
    made = record(z=[1.0])
    assert Record.of(made) is made


@pytest.mark.parametrize(
    "data, message",
    [
        (5, "mine: wanted a path, arrays by column name, or a table with named columns, found int; "
         'give for example {"t": t, "z": z}'),
        (np.zeros((3, 2)), "mine: wanted a path, arrays by column name, or a table with named "
         "columns, found ndarray; "),
        ({"z": 3.0}, "mine, column z: wanted real numbers, shape (n,), found float64, shape (); "),
        ({"z": np.zeros((2, 3))}, "mine, column z: wanted real numbers, shape (n,), found float64, "
         "shape (2, 3); convert it"),
        ({"z": ["a", "b"]}, "mine, column z: wanted real numbers, shape (n,), found <U1, shape (2"),
        ({"z": [1j]}, "mine, column z: wanted real numbers, shape (n,), found complex128, shape"),
        ({"z": np.array(["2020-01-01"], dtype="M8[D]")}, "mine, column z: wanted real numbers"),
        ({"z": [[1.0], [1.0, 2.0]]}, "mine, column z: wanted real numbers, shape (n,), found list, "
         "not convertible to an array; convert it"),
        ({"z": [1.0], " z[m]": [1.0]}, "mine: wanted every column once, found two named z; keep "),
        ({}, "record 'mine': wanted columns with one value for each sample, at least one, found "),
    ],
)  # fmt: skip
def test_data_that_is_no_record(data: Any, message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        Record.of(data, name="mine")


def test_truth_values_and_integers_are_numbers() -> None:
    made = columns_of("x", {"flag": np.array([True, False]), "n": np.array([3], dtype=np.uint8)})
    assert made["flag"].values.tolist() == [1.0, 0.0]
    assert made["n"].values.tolist() == [3.0]


@pytest.mark.parametrize(
    "head, wanted",
    [
        ("gx", ("gx", None)),
        (" gx ", ("gx", None)),
        ("gx[deg/s]", ("gx", "deg/s")),
        (" gx [ m/s^2 ] ", ("gx", "m/s^2")),
        ("gx[]", ("gx", "")),
    ],
)
def test_header_fields(head: str, wanted: tuple[str, str | None]) -> None:
    assert split_header("a.csv", head) == wanted


@pytest.mark.parametrize(
    "head", ["", " ", "[m]", "a[m", "am]", "a[m]b", "a[[m]]", "a[m][s]", "a]["]
)
def test_header_fields_that_are_none(head: str) -> None:
    message = f"a.csv: wanted column names like gx or gx[deg/s], found {head!r}; correct it"
    with pytest.raises(InputError, match=f"^{re.escape(message)}$"):
        split_header("a.csv", head)


def test_places() -> None:
    assert index_place("a.npz")(7, "gx") == "a.npz, gx[7]"
