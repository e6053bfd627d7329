"""`firmware.names`: legal and distinct, whatever the names of the values are."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boresight.firmware.names import identifier, literal, unique


@pytest.mark.parametrize(
    ("name", "wanted"),
    [
        ("gx", "gx"),
        ("q.w", "q_w"),
        ("2nd", "n2nd"),
        ("int", "int_"),
        ("bool", "bool_"),
        ("_Bool", "Bool"),
        ("INT32_MAX", "INT32_MAX_"),
        ("uint8_t", "uint8_t_"),
        ("", "unnamed"),
        ("Δψ", "unnamed"),
        ("µ_t", "t"),
        ("gyr[0]", "gyr_0_"),
    ],
)
def test_identifier(name: str, wanted: str) -> None:
    assert identifier(name) == wanted
    assert identifier(wanted) == wanted


@given(st.text())
def test_identifier_is_legal(name: str) -> None:
    assert re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", identifier(name))


def test_unique_counts() -> None:
    assert unique(["q.w", "q_w", "Q_W", "q_w_2"]) == ["q_w", "q_w_2", "Q_W", "q_w_2_2"]
    assert unique(["gx", "GX"], reserved=["Gx"], fold=True) == ["gx_2", "GX_3"]


@given(st.lists(st.text(alphabet="ab_.2", max_size=4)), st.booleans())
def test_unique_is_unique(names: list[str], fold: bool) -> None:
    got = [x.upper() if fold else x for x in unique(names, reserved=["a"], fold=fold)]
    assert len({*got, "A" if fold else "a"}) == len(names) + 1


def test_literal() -> None:
    assert [literal(w) for w in (0, -1, 2**31 - 1, -(2**31))] == [
        "0",
        "-1",
        "2147483647",
        "INT32_MIN",
    ]
