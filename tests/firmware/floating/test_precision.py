"""Single and double precision: literals and the text of C."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from boresight.firmware.floating.precision import DOUBLE, SINGLE, Precision


@pytest.mark.parametrize(
    "precision, number, text",
    [
        (SINGLE, 0.0, "0.0f"),
        (SINGLE, -0.0, "-0.0f"),
        (SINGLE, 1.0, "1.0f"),
        (SINGLE, 1 / 3, "0.33333334f"),
        (DOUBLE, 1 / 3, "0.3333333333333333"),
        (DOUBLE, 100.0, "100.0"),
        (DOUBLE, 1e-5, "0.00001"),
        (DOUBLE, 1e-9, "1e-9"),
        (SINGLE, 1e20, "1e+20f"),
        (SINGLE, 1e-300, "1.1754944e-38f"),
        (SINGLE, -1e-300, "-1.1754944e-38f"),
        (DOUBLE, 1e-300, "1e-300"),
        (DOUBLE, 5e-324, "2.2250738585072014e-308"),
    ],
)
def test_literals(precision: Precision, number: float, text: str) -> None:
    assert precision.literal(number) == text


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_double_literals_give_the_number_back(number: float) -> None:
    text = DOUBLE.literal(number)
    wanted = number
    if 0.0 < abs(number) < 2.0**-1022:
        wanted = math.copysign(2.0**-1022, number)
    assert struct.pack("d", float(text)) == struct.pack("d", wanted)
    assert "." in text or "e" in text  # an integer in C is none


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_single_literals_give_the_number_back(number: float) -> None:
    text = SINGLE.literal(number)
    assert text.endswith("f") and ("." in text or "e" in text)
    if number == 0.0 or abs(number) >= 2.0**-126:
        assert np.float32(text[:-1]) == np.float32(number)


@pytest.mark.parametrize(
    "precision, number, found",
    [
        (SINGLE, 1e39, "a float, not 1e+39"),
        (SINGLE, -1e39, "a float, not -1e+39"),
        (DOUBLE, math.inf, "a double, not inf"),
        (DOUBLE, math.nan, "a double, not nan"),
    ],
)
def test_what_has_no_literal(precision: Precision, number: float, found: str) -> None:
    with pytest.raises(ValueError) as raised:
        precision.literal(number)
    assert str(raised.value) == f"number must be finite in {found}"


TEXT = "float x = 2.5f * fabsf(y_float) + sqrtf(0.5f); // float; my_sinf(atan2f(1.0f, x0.5f))"


def test_text_of_single_precision() -> None:
    assert SINGLE.of_single(TEXT) == TEXT


def test_text_of_double_precision() -> None:
    assert DOUBLE.of_single(TEXT) == (
        "double x = 2.5 * fabs(y_float) + sqrt(0.5); // double; my_sinf(atan2(1.0, x0.5f))"
    )
    functions = ("fabs", "sqrt", "sin", "cos", "asin", "atan2", "floor")
    calls = " ".join(f"{name}f(" for name in functions)
    assert DOUBLE.of_single(calls) == calls.replace("f(", "(")


def test_counterparts() -> None:
    assert [(p.type, p.numpy) for p in (SINGLE, DOUBLE)] == [
        ("float", np.float32),
        ("double", np.float64),
    ]
