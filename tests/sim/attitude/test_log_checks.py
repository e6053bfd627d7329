"""`sim.attitude.log_checks`: every fault is found where it is, and nothing else is one."""

from typing import Any

import numpy as np
import pytest

from boresight.model.errors import InputError
from boresight.sim.attitude.log_checks import (
    check_samples,
    clean_arrays,
    clean_rate,
    index_place,
    quote,
    wanted_value,
)

PLACE = index_place("here")


def good() -> dict[str, np.ndarray]:
    arrays = {
        "t": np.arange(5) * 0.1,
        "gyr": np.zeros((5, 3)),
        "acc": np.ones((5, 3)),
        "mag": np.ones((5, 3)),
        "q": np.tile([1.0, 0, 0, 0], (5, 1)),
    }
    arrays["mag"][1] = np.nan
    arrays["q"][3] = np.nan
    return arrays


def test_good_samples_pass() -> None:
    check_samples(good(), PLACE)
    without = good()
    del without["q"]
    check_samples(without, PLACE)


@pytest.mark.parametrize(
    ("array", "index", "value", "message"),
    [
        ("t", (2,), np.nan, r"here, t\[2\]: wanted a finite number \(s\), found no value; .*"),
        ("gyr", (2, 1), np.inf, r"here, gyr\[2, 1\]: wanted .* \(rad/s\), found inf; .*"),
        ("gyr", (4, 2), np.nan, r"here, gyr\[4, 2\]: wanted .* \(rad/s\), found no value; .*"),
        ("acc", (0, 0), -np.inf, r"here, acc\[0, 0\]: wanted .* \(m/s\^2\), found -inf; .*"),
        ("mag", (2, 1), np.nan, r"here, mag\[2, 1\]: wanted .* \(uT\), or .* found no value; .*"),
        ("mag", (2, 2), np.inf, r"here, mag\[2, 2\]: wanted .* \(uT\), or no .* found inf; .*"),
        ("q", (2, 3), np.nan, r"here, q\[2, 3\]: wanted a finite number, or no .* no value; .*"),
        ("q", (2, 0), np.inf, r"here, q\[2, 0\]: wanted a finite number, or no .* inf; .*"),
        ("q", (2, 0), 1.011, r"here, q\[2, 0\]: wanted .* of norm 1, found norm 1\.011; .*"),
        ("q", (2, 0), 0.989, r"here, q\[2, 0\]: wanted .* of norm 1, found norm 0\.989; .*"),
        ("t", (3,), 0.2, r"here, t\[3\]: wanted a time above 0\.2, that .*, found 0\.2; sort .*"),
        ("t", (3,), 0.1, r"here, t\[3\]: wanted a time above 0\.2, that .*, found 0\.1; sort .*"),
    ],
)
def test_each_fault_is_named(
    array: str, index: tuple[int, ...], value: float, message: str
) -> None:
    arrays = good()
    arrays[array][index] = value
    with pytest.raises(InputError, match=f"^{message}$"):
        check_samples(arrays, PLACE)


@pytest.mark.parametrize("norm", [0.991, 1.009])
def test_rounded_quaternions_pass(norm: float) -> None:
    arrays = good()
    arrays["q"] *= norm
    check_samples(arrays, PLACE)


def test_the_first_fault_of_an_array_is_named() -> None:
    arrays = good()
    arrays["gyr"][3, 0] = arrays["gyr"][2, 2] = arrays["gyr"][4, 0] = np.nan
    with pytest.raises(InputError, match=r"^here, gyr\[2, 2\]: "):
        check_samples(arrays, PLACE)


def test_clean_arrays_converts_and_copies() -> None:
    given: dict[str, Any] = {
        "t": [0, 1],
        "gyr": np.ones((2, 3), dtype=np.float32),
        "q": None,
        "mov": [0, 1],
    }
    clean = clean_arrays("here", given)
    assert list(clean) == ["t", "gyr", "mov"]
    assert clean["t"].dtype == clean["gyr"].dtype == np.float64
    assert clean["mov"].dtype == np.bool_
    np.testing.assert_array_equal(clean["mov"], [False, True])
    clean["gyr"][0, 0] = 7
    assert given["gyr"][0, 0] == 1
    same = clean_arrays("here", clean)
    assert same["gyr"] is not clean["gyr"]
    assert not np.shares_memory(same["gyr"], clean["gyr"])


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("t", np.zeros(0), r"array t: wanted shape \(n,\) with n of 1 or more, found \(0,\); .*"),
        ("t", np.zeros((2, 1)), r"array t: wanted shape \(n,\) with .*, found \(2, 1\); .*"),
        ("t", 0.0, r"array t: wanted shape \(n,\) with .*, found \(\); .*"),
        ("gyr", np.zeros((3, 2)), r"array gyr: wanted shape \(2, 3\), .*, found \(3, 2\); .*"),
        ("gyr", np.zeros(2), r"array gyr: wanted shape \(2, 3\), .*, found \(2,\); .*"),
        ("q", np.zeros((2, 3)), r"array q: wanted shape \(2, 4\), .*, found \(2, 3\); .*"),
        ("mov", np.zeros((2, 1), bool), r"array mov: wanted shape \(2,\), .*, found \(2, 1\); .*"),
        ("mov", [0, 2], r"array mov: wanted truth values, found integers other than 0 and 1; .*"),
        ("mov", [0.0, 1.0], r"array mov: wanted truth values, found the type float64; .*"),
        ("gyr", np.full((2, 3), "x"), r"array gyr: wanted real numbers, found the type <U1; .*"),
        ("gyr", np.full((2, 3), 1j), r"array gyr: wanted real numbers, found .* complex128; .*"),
        ("gyr", np.full((2, 3), True), r"array gyr: wanted real numbers, found .* bool; .*"),
    ],
)
def test_wrong_shapes_and_types_are_named(key: str, value: Any, message: str) -> None:
    with pytest.raises(InputError, match=f"^here, {message}$"):
        clean_arrays("here", {"t": [0.0, 1.0], **{key: value}})


@pytest.mark.parametrize("rate", [100, 285.7, 0.5, np.float32(50), np.array(12.5)])
def test_clean_rate_takes_any_real_scalar(rate: Any) -> None:
    clean = clean_rate("here", rate)
    assert type(clean) is float
    assert clean == float(rate)


@pytest.mark.parametrize(
    ("rate", "found"),
    [
        (0, "0"),
        (-1.5, r"-1\.5"),
        (np.nan, "nan"),
        (np.inf, "inf"),
        ([100.0], r"\[100\.0\]"),
        ("fast", "'fast'"),
        (True, "True"),
    ],
)
def test_clean_rate_refuses_the_rest(rate: Any, found: str) -> None:
    message = rf"^here, fs: wanted one number above 0 \(Hz\), found {found}; correct it, .*$"
    with pytest.raises(InputError, match=message):
        clean_rate("here", rate)


def test_quote_shortens_to_forty_characters() -> None:
    assert quote("a" * 38) == "'" + "a" * 38 + "'"
    assert quote("a" * 39) == "'" + "a" * 36 + "..."


def test_wanted_value_names_unit_and_gap() -> None:
    assert wanted_value("t") == "a finite number (s)"
    assert wanted_value("mag") == "a finite number (uT), or no value in all of the row"
    assert wanted_value("q") == "a finite number, or no value in all of the row"
