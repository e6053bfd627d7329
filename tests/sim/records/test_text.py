"""CSV: every number comes back bit for bit, every fault is named by line and column."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from boresight.model.errors import InputError
from boresight.sim.records.record import Column, Record
from boresight.sim.records.text import format_csv, parse_csv

pytestmark = pytest.mark.pythons

PATH = Path("walk.csv")
NAN = float("nan")


def parsed(text: str | bytes) -> dict[str, list[float]]:
    content = text.encode() if isinstance(text, str) else text
    found = parse_csv(PATH, content)
    assert found.name == "walk"
    return {n: c.values.tolist() for n, c in found.columns.items()}


def bits(values: np.ndarray) -> bytes:
    """With one NaN for all."""
    return np.where(np.isnan(values), np.nan, values).tobytes()


number = st.floats(allow_infinity=False, width=64)
columns = st.integers(1, 6).flatmap(
    lambda n: st.lists(arrays(np.float64, n, elements=number), min_size=1, max_size=4)
)
names = st.lists(
    st.sampled_from(["a", "nan", "finance", "E", "inf", "mx", "x_true", "1e3x"]),
    min_size=4,
    max_size=4,
    unique=True,
)
units = st.lists(st.sampled_from([None, "", "deg/s", "nan"]), min_size=4, max_size=4)


@settings(max_examples=200)
@given(columns, names, units)
def test_round_trip(values: list[np.ndarray], heads: list[str], said: list[str | None]) -> None:
    held = {n: Column(v, u) for n, v, u in zip(heads, values, said, strict=False)}
    found = parse_csv(PATH, format_csv(Record("r", held)).encode())
    assert list(found.columns) == list(held)
    for name, column in held.items():
        assert bits(found.columns[name].values) == bits(column.values)
        assert found.columns[name].unit == column.unit


def test_text_as_written() -> None:
    held = {
        "t": Column(np.array([0.0, 0.1]), "s"),
        "nano": Column(np.array([NAN, 1e-300])),
        "k": Column(np.array([-0.0, 3.0]), ""),
    }
    assert format_csv(Record("r", held)) == "t[s],nano,k[]\n0.0,,-0.0\n0.1,1e-300,3.0\n"


@pytest.mark.parametrize(
    "text, wanted",
    [
        ("a,b\n1,2\n3,4\n", {"a": [1.0, 3.0], "b": [2.0, 4.0]}),
        ("a,b\n1,2", {"a": [1.0], "b": [2.0]}),
        ("\ufeffa,b\r\n1,2\r\n\r\n \n", {"a": [1.0], "b": [2.0]}),
        ("a,b\r1,2\r", {"a": [1.0], "b": [2.0]}),
        ("# one\n\n#two\na , b\n 1 ,\t2\n", {"a": [1.0], "b": [2.0]}),
        ("a,2\n+1.5e2,.5\n", {"a": [150.0], "2": [0.5]}),
        ("a\n1e-999\n", {"a": [0.0]}),
    ],
)
def test_read(text: str, wanted: dict[str, list[float]]) -> None:
    assert parsed(text) == wanted


def test_empty_fields_are_gaps() -> None:
    found = parsed("a,b\n, \n1,\n")
    assert np.isnan(found["b"]).all() and np.isnan(found["a"][0]) and found["a"][1] == 1.0
    single = parsed("a\n\n1\n\n")["a"]  # of one column, an empty line is a sample without a value
    assert len(single) == 3 and single[1] == 1.0 and np.isnan(single[::2]).all()


@pytest.mark.parametrize(
    "text, message",
    [
        ("", "walk.csv: wanted a header of column names, found an empty file; write the header "),
        (" \n# a,b\n", "walk.csv: wanted a header of column names, found only blank lines and "),
        (b"a\0\n1\n", "walk.csv: wanted a CSV log in UTF-8 text, found binary data; export it as "),
        (b"a\n\xff\n", "walk.csv: wanted a CSV log in UTF-8 text, found binary data; "),
        ("# x\na,b\n", "walk.csv, line 2: wanted rows of samples below the header, found none; "),
        ("a,b\n\n\n", "walk.csv, line 1: wanted rows of samples below the header, found none; "),
        ("a\n", "walk.csv, line 1: wanted rows of samples below the header, found none; "),
        ("#\na,b,a\n1,2,3\n", "walk.csv, line 2: wanted every column once, found 2 columns a; "),
        ("1,2.5\n3,4\n", "walk.csv, line 1: wanted a header of column names, found numbers only; "),
        ("a,\n1,2\n", "walk.csv, line 1: wanted column names like gx or gx[deg/s], found ''; "),
        ("a,b\n1,2\n1\n", "walk.csv, line 3: wanted 2 fields, as in the header, found 1; complete"),
        ("#\na,b\n1,2\n1,2,3\n", "walk.csv, line 4: wanted 2 fields, as in the header, found 3; "),
        ("a,b\n1,2\n\n1,2\n", "walk.csv, line 3: wanted 2 fields, as in the header, found an empt"),
        ("a,b\n1,2\n1,x\n", "walk.csv, line 3, column b: wanted a finite number, or nothing, found "
         "'x'; correct or remove the line"),
        ("a,b\n1,2\nnan,1\n", "walk.csv, line 3, column a: wanted a finite number, or nothing, "
         "found 'nan'; "),
        ("a,b\n1,inf\n", "walk.csv, line 2, column b: wanted a finite number, or nothing, found '"),
        ("a,b\n1,1e999\n", "walk.csv, line 2, column b: wanted a finite number, or nothing, found"),
        ("a,b\n1_0,1\n", "walk.csv, line 2, column a: wanted a finite number, or nothing, found '"),
        ("a,b\n٣,1\n", "walk.csv, line 2, column a: wanted a finite number, or nothing, found '٣'"),
        ("a,b\n1,.\n", "walk.csv, line 2, column b: wanted a finite number, or nothing, found '.'"),
        ("a\n" + "y" * 41, f"walk.csv, line 2, column a: wanted a finite number, or nothing, found "
         f"'{'y' * 37}...'; "),
        ("a\n" + "y" * 40, f"walk.csv, line 2, column a: wanted a finite number, or nothing, found "
         f"'{'y' * 40}'; "),
        ("#\nt,a\n1,2\n1,3\n", "walk.csv, line 4, column t: wanted a time above 1.0, that of the "
         "row before, found 1.0; "),
        ("t,a\n1,2\n,3\n", "walk.csv, line 3, column t: wanted a time in every row, found no valu"),
    ],
)  # fmt: skip
def test_refused(text: str | bytes, message: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(message)}"):
        parsed(text)


def test_places_count_lines_from_the_header() -> None:
    found = parse_csv(PATH, b"# one\n# two\na,b\n1,2\n3,4\n")
    assert found.place(1, "b") == "walk.csv, line 5, column b"
    assert found.head(1).place(0, "a") == "walk.csv, line 4, column a"
