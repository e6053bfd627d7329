"""Identifiers and comments out of any text."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from boresight.model.tools.c_names import comment, identifier, unique


@pytest.mark.parametrize(
    "name, wanted",
    [
        ("kp_roll", "kp_roll"),
        ("a b-c", "a_b_c"),
        ("_x", "x"),
        ("3d", "n3d"),
        ("", "unnamed"),
        ("__", "unnamed"),
        ("größe", "gr__e"),
        ("int", "int"),
    ],
)
def test_identifier(name: str, wanted: str) -> None:
    assert identifier(name) == wanted


def test_unique() -> None:
    assert unique(["a", "A", "a_2", "b", "a"], reserved=["B"]) == [
        "a",
        "A_2",
        "a_2_2",
        "b_2",
        "a_3",
    ]


@pytest.mark.parametrize(
    "text, wanted",
    [
        ("m/s^2", "m/s^2"),
        ("a */ b /* c", "a *_ b _* c"),
        ("end\\", "end_"),
        ("??/", "__/"),
        ("two\nlines", "two_lines"),
    ],
)
def test_comment(text: str, wanted: str) -> None:
    assert comment(text) == wanted


@given(st.text(alphabet=st.one_of(st.characters(), st.sampled_from("*/\\?\n"))))
def test_comment_is_harmless(text: str) -> None:
    got = comment(text)
    assert got.isprintable()
    assert not any(mark in got for mark in ("*/", "/*", "\\", "??"))
